"""Would another predictor do better by now? Likelihood ratios of a bank of probes beside an estimator."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..engine.dispatch import Vector, kernel
from ..engine.errors import InputError
from .alarms import scan
from .average_run_length import rate
from .registry import register
from .settings import reachable
from .watch import OWN, WHICH, accumulate, conclude, watch


@register()
class ProbeBank(NamedTuple):
    """Thresholds (M,) of the sums of M probes; `bank` and `probe_bank` make it.

    As a detector it takes the log likelihood ratios of the probes, ``(nu^2 - nu_m^2)/(2 c)``, in place of the slopes.

    Parameters
    ----------
    h : (M,)
        The thresholds, in units of a log likelihood ratio.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> ratios = np.full((20, 2), [0.5, -0.5])  # the first probe predicts better
    >>> dw.detect.ProbeBank(np.array([6.0, 6.0])).h.tolist()
    [6.0, 6.0]
    """

    h: Vector

    def resolve(self, parameters: int) -> ProbeBank:
        """Return itself, for an estimator that runs so many probes."""
        if parameters != np.size(self.h):
            raise InputError(f"this ProbeBank compares {np.size(self.h)} probes, but the estimator runs {parameters}")
        return ProbeBank(np.asarray(self.h, float))

    def state_size(self, parameters: int) -> int:
        """Return how many numbers it keeps: a sum for each probe, and the samples since it was 0."""
        return OWN + 2 * len(self.h)


@kernel
def compare(detector_state, h, ratios):
    """Let the sum of each probe grow by its log likelihood ratio; return the probe that alarms, or -1."""
    m = h.size
    g, since = detector_state[OWN : OWN + m], detector_state[OWN + m : OWN + 2 * m]
    for i in range(m):
        accumulate(g, since, i, ratios[i])
    return conclude(detector_state, g, since, h)


@watch.on(ProbeBank)
def watch_probe_bank(detector, detector_state, z, slope):
    best = compare(detector_state, detector.h, slope)
    if best < 0:
        return 0.0
    detector_state[WHICH] = best
    return 1.0


def bank(probes: int, false_alarms="1 per 10_000", threshold=None) -> ProbeBank:
    """Return the detector of so many probes: from a rate, threshold = log(probes x samples between false alarms).

    That is a guarantee where exp of each ratio has mean 1 or less given the past, as where the estimator predicts
    exactly; with an estimator still learning, calibrate the threshold in its loop.
    """
    if not probes >= 1:
        raise InputError(f"a bank needs at least one probe, got {probes!r}")
    h = math.log(probes * rate(false_alarms)) if threshold is None else reachable(threshold, 1)
    return ProbeBank(np.full(probes, h))


def probe_bank(innovation, probe_innovations, variance=1.0, threshold=None, *, false_alarms="1 per 10_000", state=None):
    """Return the alarms of a bank of probe predictors that begin to predict better than the estimator.

        g_m <- max(0, g_m + (nu^2 - nu_m^2) / (2 c)),   alarm when the largest reaches the threshold

    While the estimator is right the sums fall on average, whatever the probes, so no size of change need be named. For
    a linear regression, probes with parameter i shifted by +d or -d make this `ScoreCUSUM`.

    Parameters
    ----------
    innovation : (T,) prediction errors nu of the estimator; NaN where missing (skipped)
    probe_innovations : (T, M) those of the probes, on the same samples
    variance : float or (T,) their variance c while the estimator is right
    threshold : float, optional; from `false_alarms` if omitted, see `bank`
    false_alarms : str or float, "1 per 10_000" or a mean number of samples
    state : ``alarms.state`` of the record before, to go on from

    Returns
    -------
    Alarms
        ``which`` is the probe; ``directions`` is always +1 (what a probe stands for is known to the caller).

    Notes
    -----
    Perriot-Mathonna (1981) leaves the decreases of an adaptive gain undetected; probes of fixed gains find them. Bad
    at: probes close to the estimator (differences drown), innovations whose variance is wrong by a lot.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> y = np.random.default_rng(2).standard_normal(300)
    >>> y[200:] += 2.0
    >>> dw.detect.probe_bank(y[:205], y[:205, None] - np.array([-2.0, -1.0, 1.0, 2.0]), threshold=8.0)
    1 alarm in 205 samples: #3 up at 203 since 200
    """
    nu, others = np.asarray(innovation, float), np.asarray(probe_innovations, float)
    if nu.ndim != 1 or others.ndim != 2 or len(others) != len(nu):
        raise InputError(f"innovation must be (T,) and probe_innovations (T, M), got {nu.shape} and {others.shape}")
    c = np.asarray(variance, float)
    if c.shape not in ((), nu.shape) or not np.all(c > 0):
        raise InputError(f"variance must be positive, one number or one per sample, got shape {c.shape}")
    ratios = 0.5 * ((nu**2)[:, None] - others**2) / (c if c.ndim == 0 else c[:, None])
    return scan(bank(others.shape[1], false_alarms, threshold), nu, 0.0, 1.0, state, ratios)
