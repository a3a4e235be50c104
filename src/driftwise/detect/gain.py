"""Has the optimal gain of a Kalman filter moved? Tests for `AdaptiveGain`."""

from typing import Any, NamedTuple

from ..engine.errors import InputError
from .hinkley import TwoSums
from .probes import ProbeBank, bank
from .registry import register
from .settings import each, reachable


@register()
class PullTest(NamedTuple):
    """Alarm when the data pull K up or down for long: Hinkley's test on Z = f nu / R, two sums (up, down).

    a <- max(0, a + Z - drift), b <- max(0, b - Z - drift), alarm beyond the threshold. ``drift`` is half the mean of Z
    after the change; that mean is not symmetric (`mean_pull`), hence pairs. The defaults are the paper's.
    Source: Perriot-Mathonna (1981), section 4. Bad at decreases of the gain: few are found (use `GainProbes`); only for
    a scalar state and a memory with a gain sequence (not `RandomWalk`).

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> rng = np.random.default_rng(4)
    >>> q = np.repeat([0.1, 0.9], 1500)  # the state becomes restless
    >>> y = np.cumsum(q * rng.standard_normal(3000)) + rng.standard_normal(3000)
    >>> est = dw.AdaptiveGain(1.0, memory=dw.Constant(), method="plr", detector=dw.detect.PullTest(), restart=26.5)
    >>> [jump.sample for jump in est.scan(y).jumps() if jump.sample > 1400][:1]
    [1510]
    """

    drift: Any = (0.15, 0.07)
    threshold: Any = (15.0, 20.0)

    def resolve(self, parameters: int) -> TwoSums:
        """Return what the kernel sees."""
        if parameters > 1:
            raise InputError("PullTest is for a scalar state: use GainProbes")
        return TwoSums(each("drift", self.drift), reachable(self.threshold), 0.0)


@register()
class GainProbes(NamedTuple):
    """Alarm when a filter with another, fixed gain predicts better for long: a bank of likelihood-ratio sums.

    g_m <- max(0, g_m + (nu^2 - nu_m^2)/(2 c)) for every probe m; alarm when one reaches ``threshold``. ``gains``: (M,)
    for a scalar state or (M, n); by default .05, .12, .25, .45, .75 (of 1/H), or the Kalman gains of six
    signal-to-noise ratios. No size of jump need be stated: while K is right, every probe is worse.
    False alarms at a gain of .1 / .3 / .5, one in so many samples: threshold 6.17 with "plr", `Constant` and restart
    26.5 2000 / 2100 / 1600, with the defaults 1000 / 1800 / 1500; 5.64 with "rpem", `Constant` and restart 10 2900 /
    1500 / 1000. So calibrate for the working range.
    Bad at: small upward jumps; a jump of R, whose first alarm may be about the scale rather than the gain.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> rng = np.random.default_rng(4)
    >>> q = np.repeat([0.1, 0.9], 1500)  # the state becomes restless
    >>> y = np.cumsum(q * rng.standard_normal(3000)) + rng.standard_normal(3000)
    >>> trace = dw.AdaptiveGain(1.0, detector=dw.detect.GainProbes()).scan(y)
    >>> [jump.sample for jump in trace.jumps() if jump.sample > 1400][:1]
    [1525]
    """

    gains: Any = None
    threshold: float = 6.17

    def resolve(self, probes: int) -> ProbeBank:
        """Return what the kernel sees: log likelihood ratios come in place of slopes."""
        return bank(probes, threshold=self.threshold)
