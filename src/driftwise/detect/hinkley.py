"""Has the mean of the innovations moved? Two cumulative sums, one up and one down (Page 1954, Hinkley 1971)."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from ..engine.dispatch import Vector
from ..engine.elementary import log
from ..engine.errors import InputError
from .alarms import Alarms, scan
from .average_run_length import growth, rate, run_length, threshold_for
from .registry import register
from .settings import delay_words, each, rate_words, reachable, together, watched
from .watch import OWN, accumulate, conclude, side, watch


@register("level", "shifts of the innovations", "the shift to expect, in standard deviations")
class PageHinkley(NamedTuple):
    """Alarms where the mean of whitened innovations z has moved: Hinkley's test, also called CUSUM.

    With ``k = jump / 2``, for an increase and for a decrease,

        a <- max(0, a + z - k),   b <- max(0, b - z - k),   alarm when one reaches its threshold h

    Each sum starts at 0, both start afresh after an alarm, and the change is dated to the last sample at which the
    alarming sum was 0. The threshold is designed so that independent N(0, 1) innovations alarm as rarely as promised
    (each side at twice the run length); a threshold of the paper's sort may be given instead.

    Parameters
    ----------
    false_alarms : str or float
        Promised rate: "1 per 10_000", or a mean number of samples. Unused where `threshold` is given.
    jump : float or (up, down)
        Mean of z after the change to be found soonest, in standard deviations of z. (The sums take off **half** of it:
        "the smallest perturbation to detect" of the paper, read literally, is twice too large.)
    threshold : float or (up, down), optional
        The threshold h itself.
    sides : "both", "up" or "down"
        What to look for.
    growing : bool
        Let h grow like log n, h + 1.1 log(n)/(2 k): the alarms of an undisturbed run die out, so an estimator that
        restarts at each still converges with probability 1. It needs a `threshold`: no fixed rate can be promised.

    Raises
    ------
    InputError
        Where a number does not fit, or no threshold has the run length asked for.

    Notes
    -----
    Bad at: innovations that are not white with the stated variance (an estimator whose noise variance is wrong breaks
    the promise), changes much smaller than `jump`, parameters with a zero-mean regressor (their jumps do not move the
    mean of z: use `ScoreCUSUM` or `VarianceCUSUM`), and with `growing` at changes late in a long run: delays grow too.

    References
    ----------
    Page (1954), Biometrika 41, 100-115; Hinkley (1971), Biometrika 58, 509-523; Perriot-Mathonna (1981), section 4,
    with one sum for each direction (his single sum S for both fires seven times too often on clean data).

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> z = np.random.default_rng(1).standard_normal(1000)
    >>> z[600:] += 1.0
    >>> detector = dw.PageHinkley(false_alarms="1 per 10_000", jump=1.0, sides="up")
    >>> found = detector.scan(z)
    >>> int(found.samples[0]), int(found.changes[0])
    (605, 601)
    >>> print(detector.words)
    one false alarm per 10 000 samples on average (exact for independent Gaussian innovations); a shift of 1 sd is
    found after 14.3 samples
    """

    false_alarms: Any = "1 per 10_000"
    jump: Any = 1.0
    threshold: Any = None
    sides: str = "both"
    growing: bool = False

    def resolve(self, parameters: int = 0) -> TwoSums:
        """Return what the kernel sees."""
        k, sides = each("jump", self.jump) / 2, watched(self.sides)
        if self.threshold is not None:
            h = reachable(self.threshold)
        elif self.growing:
            raise InputError("growing=True needs a threshold to grow from: it cannot promise a false-alarm rate")
        else:
            wanted = rate(self.false_alarms) * float(sides.sum())
            h = np.array([_threshold(wanted, reference) for reference in k.tolist()])
        h[~sides] = np.inf
        return TwoSums(k, h, growth(1.0) if self.growing else 0.0)

    @property
    def run_length(self) -> float:
        """Mean number of samples between false alarms, exact for each side (the two together: within 1 %)."""
        if self.growing:
            raise InputError("with growing=True there is no run length: the rate of false alarms falls like 1/n^1.1")
        found = self.resolve()
        return together([run_length(h, k) for h, k in zip(found.h, found.k) if np.isfinite(h)])

    def delay(self, jump: float | None = None, start: str = "steady") -> float:
        """Return the mean number of samples until a shift of the mean by ``jump`` (its sign counts) alarms.

        Exact for independent Gaussian innovations: with the sum in its long-run law (``start="steady"``) or at 0
        (``"zero"``) when the shift comes. With `growing`, that of the first samples.
        """
        found = self.resolve()
        jump = self._shift() if jump is None else jump
        i = int(jump < 0)
        if not np.isfinite(found.h[i]):
            raise InputError(f"a shift of {jump:g} is on the side that sides={self.sides!r} does not watch")
        return run_length(float(found.h[i]), float(found.k[i]), mean=abs(jump), start=start)

    def _shift(self):
        up, down = each("jump", self.jump)
        return float(-down if self.sides == "down" else up)

    @property
    def words(self) -> str:
        """What the settings promise, as a sentence."""
        shift = self._shift()
        found = delay_words(shift, self.delay(shift))
        if self.growing:
            return f"no fixed rate of false alarms: they die out like 1/n^1.1; {found} early in a run, later ever later"
        return f"{rate_words(self.run_length, 'exact for independent Gaussian innovations')}; {found}"

    def scan(self, signal, *, mean: float = 0.0, std: float = 1.0, state=None) -> Alarms:
        """Return the alarms in a signal whose mean and standard deviation before the change are known.

        Parameters
        ----------
        signal : (T,) numbers; NaN where missing (skipped)
        mean, std : what the signal has before the change, to whiten it
        state : ``alarms.state`` of the record before, to go on from
        """
        return scan(self.resolve(), signal, mean, std, state)


class TwoSums(NamedTuple):
    """What the kernel sees of `PageHinkley`: (up, down) reference and threshold, and growth times reference."""

    k: Vector
    h: Vector
    growth: float

    def state_size(self, parameters: int) -> int:
        """Return how many numbers it keeps: sums, samples since they were 0, thresholds now, samples."""
        return OWN + 7


@watch.on(TwoSums)
def watch_two_sums(detector, detector_state, z, slope):
    g, since, h = detector_state[OWN : OWN + 2], detector_state[OWN + 2 : OWN + 4], detector_state[OWN + 4 : OWN + 6]
    detector_state[OWN + 6] += 1.0
    for i in range(2):
        accumulate(g, since, i, (z if i == 0 else -z) - detector.k[i])
        h[i] = detector.h[i]
        if detector.growth > 0.0:
            h[i] += detector.growth / detector.k[i] * log(detector_state[OWN + 6])
    return side(conclude(detector_state, g, since, h))


@lru_cache(maxsize=256)
def _threshold(wanted: float, reference: float) -> float:
    return threshold_for(wanted, reference)
