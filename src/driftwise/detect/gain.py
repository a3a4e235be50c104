"""Has the optimal gain of a Kalman filter moved? Tests for `AdaptiveGain`."""

from typing import Any, NamedTuple

from ..kernel.compose import Vector, kernel
from .watch import OWN, SINCE, STATISTIC, WHICH, watch


class PullTest(NamedTuple):
    """Alarm when the data pull K up or down for long: Hinkley's test on Z = f nu / R, two sums (up, down).

    a <- max(0, a + Z - drift), b <- max(0, b - Z - drift), alarm beyond the threshold. ``drift`` is half the mean of Z
    after the change; that mean is not symmetric (`mean_pull`), hence pairs. The defaults are the paper's.
    Source: Perriot-Mathonna (1981), section 4. Bad at decreases of the gain: few are found (use `GainProbes`); only for
    a scalar state and a memory with a gain sequence (not `Walk`).
    """

    drift: Any = (0.15, 0.07)
    threshold: Any = (15.0, 20.0)


class GainProbes(NamedTuple):
    """Alarm when a filter with another, fixed gain predicts better for long: a bank of likelihood-ratio sums.

    g_m <- max(0, g_m + (nu^2 - nu_m^2)/(2 c)) for every probe m; alarm when one reaches ``threshold``. ``gains``: (M,)
    for a scalar state or (M, n); by default .05, .12, .25, .45, .75 (of 1/H), or the Kalman gains of six
    signal-to-noise ratios. No size of jump need be stated: while K is right, every probe is worse.
    False alarms at a gain of .1 / .3 / .5, one in so many samples: threshold 6.17 with "plr", `Never` and restart 26.5
    2000 / 2100 / 1600, with the defaults 1000 / 1800 / 1500; 5.64 with "rpem", `Never` and restart 10 2900 / 1500 /
    1000. So calibrate for the working range.
    Bad at: small upward jumps; a jump of R, whose first alarm may be about the scale rather than the gain.
    """

    gains: Any = None
    threshold: float = 6.17


class Pull(NamedTuple):
    """What the kernel sees of `PullTest`."""

    drift: Vector
    threshold: Vector

    def marks(self, parameters: int) -> int:
        """Return how many numbers it keeps."""
        return OWN + 4


class Probes(NamedTuple):
    """What the kernel sees of `GainProbes`; log likelihood ratios come in place of slopes."""

    threshold: float
    probes: float

    def marks(self, parameters: int) -> int:
        """Return how many numbers it keeps."""
        return OWN + 2 * int(self.probes)


@kernel
def grow(g, since, i, ratio):
    """Let sum i grow, never below 0, and count the samples since it was 0."""
    g[i] = max(0.0, g[i] + ratio)
    since[i] = since[i] + 1.0 if g[i] > 0.0 else 0.0


@watch.on(Pull)
def _(detector, marks, z, slope):
    g, since = marks[OWN : OWN + 2], marks[OWN + 2 : OWN + 4]
    way = 0.0
    for i in range(1, -1, -1):  # the increase last: it is the one reported
        grow(g, since, i, (1.0 - 2.0 * i) * z - detector.drift[i])
        if g[i] >= detector.threshold[i]:
            way, marks[SINCE], marks[WHICH] = 1.0 - 2.0 * i, since[i], 0.0
    marks[STATISTIC] = max(g[0] / detector.threshold[0], g[1] / detector.threshold[1])
    if way != 0.0:
        for j in range(4):
            marks[OWN + j] = 0.0
    return way


@watch.on(Probes)
def _(detector, marks, z, slope):
    M, best = slope.size, 0
    g, since = marks[OWN : OWN + M], marks[OWN + M : OWN + 2 * M]
    for m in range(M):
        grow(g, since, m, slope[m])
        if g[m] > g[best]:
            best = m
    marks[STATISTIC] = g[best] / detector.threshold
    if marks[STATISTIC] < 1.0:
        return 0.0
    marks[SINCE], marks[WHICH] = since[best], best
    for j in range(2 * M):
        marks[OWN + j] = 0.0
    return 1.0
