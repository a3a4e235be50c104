"""A sensor that drifts, calibrated against references that come now and then: nothing to tune."""

from __future__ import annotations

import numpy as np

from ...memory.drift import Drift
from ...models.disturbance import Disturbance
from ..arx.regression import Regression
from .estimator import ModelAverage

POLES = (0.6, 0.8, 0.9)  # of the disturbance: gone after 2, 4.5, 9.5 samples
SPEEDS = (0.0, 1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2)  # NVRs relative to all of the noise: memories of 300 to 10
FORGETTING, LEARNING_RATE = 0.999, 0.1


def sensor_calibration(regressors=1, *, poles=POLES, speeds=SPEEDS) -> ModelAverage:
    """Return an estimator of y = phi' theta + offset + disturbance + noise, theta and offset drifting: nothing to tune.

    A `ModelAverage` over poles of the disturbance and speeds of drift, of the offset alone and of everything. Give it
    the reference as y, NaN where there is none, and what the sensor says as u, at all samples: the prediction is what
    the reference would have shown. Between references the disturbance fades and what drifted stays.

    Parameters
    ----------
    regressors : int, or a list of names
        What the reference is explained by, such as the sensor, temperature and humidity.
    poles : floats, 0 to below 1
        Of the disturbance; what remains of it after a sample.
    speeds : floats
        Noise variance ratios per sample; 1/sqrt(NVR) is a memory in samples.

    Returns
    -------
    ModelAverage
        One sample's evidence counts a tenth (``learning_rate``): the members are alike, and what none of them knows,
        such as the hours of the day, makes errors come in rows.

    Notes
    -----
    Centre the regressors first: a slope drifts about zero, and far from it that is a drift of the offset, much larger.

    Bad at: references at one time of the day only. How noisy other hours are cannot be told from them, and the bars are
    too narrow there. Jumps of the sensor are followed like drift.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> rng = np.random.default_rng(0)
    >>> truth = 50 + 10 * np.sin(np.arange(2000) / 40) + rng.standard_normal(2000)
    >>> sensor = (truth - 0.01 * np.arange(2000)) / 5  # its zero drifts
    >>> y = np.where(np.arange(2000) % 25 == 0, truth, np.nan)  # every 25th sample has a reference
    >>> trace = dw.estimators.sensor_calibration(["sensor"]).scaled_to(y, sensor).scan(y, sensor)
    >>> print(f"{np.sqrt(np.mean((trace.prediction - truth)[1000:] ** 2)):.1f}, {truth.std():.1f} without")
    0.5, 7.2 without
    """
    members, names = [], []
    for pole in poles:
        disturbance = Disturbance(pole)
        for speed in speeds:
            for offset_alone in (False, True) if speed > 0 else (False,):
                nvr = np.full(Regression(regressors, offset=True).model.N, speed * (1 + disturbance.ratio))
                nvr[:-1] *= not offset_alone
                memory = Drift(nvr=tuple(nvr.tolist()))
                est = Regression(regressors, offset=True, disturbance=disturbance, memory=memory, missing="skip")
                members.append(est)
                names.append(f"pole {pole:g}, {'offset' if offset_alone else 'all'} at {speed:g}")
    return ModelAverage(members, names=names, forgetting=FORGETTING, learning_rate=LEARNING_RATE)
