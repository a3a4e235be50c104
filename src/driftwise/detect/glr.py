"""Has the mean of the innovations moved, by however much? Generalised likelihood ratio over a window."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from ..engine.dispatch import kernel
from ..engine.errors import InputError
from .alarms import Alarms, scan, simulated_delay
from .average_run_length import rate
from .registry import register
from .settings import delay_words, rate_words, reachable
from .watch import OWN, SINCE, STATISTIC, WHICH, watch

LONGEST = 100_000  # samples of a window


@register("glr", "shifts of the innovations, of any size", "how many samples to look back", is_whole=True)
class GLR(NamedTuple):
    """Alarms where the last samples have another mean, whatever its size: generalised likelihood ratio.

    With A_m the sum of the last m whitened innovations,

        max over m <= window of A_m^2 / (2 m)  >=  threshold

    The best m dates the change, the sign of its A_m gives the direction. After an alarm the window is emptied.

    Parameters
    ----------
    false_alarms : str or float
        Promised rate, "1 per 10_000" or a mean number of samples. Unused where `threshold` is given.
    window : int
        How far back a change may lie, in samples. A sample costs that many additions.
    threshold : float, optional
        The threshold itself.

    Notes
    -----
    The threshold for a rate is an approximation (Siegmund and Venkatraman 1995, their integral over the window's
    lengths as a sum): simulated run lengths are up to 15 % longer (window 200; 2 % for 20). Bad at: a shift known
    beforehand (`PageHinkley` set for it is sooner), shifts so small that they need more than ``window`` samples, and
    cost.

    References
    ----------
    Siegmund and Venkatraman (1995), Annals of Statistics 23, 255-271; Willsky and Jones (1976), IEEE TAC 21, 108-112.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> z = np.random.default_rng(3).standard_normal(1000)
    >>> z[600:] -= 2.0
    >>> dw.detect.GLR(false_alarms="1 per 10_000").scan(z[:605])
    1 alarm in 605 samples: down at 602 since 600
    """

    false_alarms: Any = "1 per 10_000"
    window: int = 200
    threshold: float | None = None

    def resolve(self, parameters: int = 0) -> Windowed:
        """Return what the kernel sees."""
        if isinstance(self.window, bool) or not isinstance(self.window, int | np.integer) or self.window < 1:
            raise InputError(f"window must be a whole number of samples, at least 1, got {self.window!r}")
        if self.window > LONGEST:
            raise InputError(
                f"window may be {LONGEST} samples, for all are gone through at every sample; got {self.window}"
            )
        window = int(self.window)
        if self.threshold is not None:
            return Windowed(float(window), float(reachable(self.threshold, 1)[0]))
        return Windowed(float(window), _threshold(rate(self.false_alarms), window))

    @property
    def run_length(self) -> float:
        """Mean number of samples between false alarms, approximately, for independent Gaussian innovations."""
        found = self.resolve()
        return math.exp(_log_run_length(found.threshold, int(found.window)))

    def delay(self, jump: float = 1.0) -> float:
        """Return the mean number of samples until a shift of the mean by ``jump`` alarms (2000 simulated runs)."""
        return _delay(self.resolve(), float(jump))

    @property
    def words(self) -> str:
        """What the settings promise, as a sentence."""
        told = rate_words(self.run_length, "approximately, for independent Gaussian innovations")
        return f"{told}; {delay_words(1.0, self.delay(1.0))} (simulated)"

    def scan(self, signal, *, mean: float = 0.0, std: float = 1.0, state=None) -> Alarms:
        """Return the alarms in a signal (T,) of known mean and standard deviation; see `PageHinkley.scan`."""
        return scan(self.resolve(), signal, mean, std, state)


class Windowed(NamedTuple):
    """What the kernel sees of `GLR`."""

    window: float
    threshold: float

    def state_size(self, parameters: int) -> int:
        """Return how many numbers it keeps: how many samples, where the next one goes, and the window."""
        return OWN + 2 + int(self.window)


@kernel
def best_stretch(ring, newest, count):
    """Return max A_m^2/(2 m), its m, and the sign of A_m, over the last m <= count numbers of a ring."""
    at, total, best, length, sign = newest, 0.0, -1.0, 0.0, 0.0
    for m in range(1, count + 1):
        total += ring[at]
        level = 0.5 * total * total / m
        if level > best:
            best, length, sign = level, float(m), 1.0 if total >= 0.0 else -1.0
        at = at - 1 if at > 0 else ring.size - 1
    return best, length, sign


@watch.on(Windowed)
def watch_windowed(detector, detector_state, z, slope):
    ring, newest = detector_state[OWN + 2 :], int(detector_state[OWN + 1])
    ring[newest] = z
    detector_state[OWN] = min(detector_state[OWN] + 1.0, detector.window)
    detector_state[OWN + 1] = newest + 1.0 if newest + 1.0 < detector.window else 0.0
    best, length, sign = best_stretch(ring, newest, int(detector_state[OWN]))
    detector_state[STATISTIC] = best / detector.threshold
    if best < detector.threshold:
        return 0.0
    detector_state[SINCE], detector_state[WHICH], detector_state[OWN] = length, -1.0, 0.0
    return sign


def _log_run_length(threshold: float, window: int) -> float:
    """Return the logarithm of the mean run length, with b = sqrt(2 threshold) and x = b/sqrt(m).

    Siegmund and Venkatraman (1995, eq. 3): E T = sqrt(2 pi) exp(b^2/2) / (b int x nu(x)^2 dx); on the lengths m = 1, 2,
    .., window there are, int x nu^2 dx = sum over m of b^2/(2 m^2) nu(b/sqrt(m))^2.
    """
    m = np.arange(1.0, window + 1)
    b = math.sqrt(2 * threshold)
    integral = float(np.sum(b * b / (2 * m * m) * _nu(b / np.sqrt(m)) ** 2))
    return 0.5 * math.log(2 * math.pi) + threshold - math.log(b * integral)


def _nu(x):
    """Return the mean of exp(-overshoot) of a likelihood ratio of shift x: Siegmund (1985), in Yakir's closed form."""
    from scipy.stats import norm

    half = x / 2
    return (norm.cdf(half) - 0.5) / half / (half * norm.cdf(half) + norm.pdf(half))


@lru_cache(maxsize=256)
def _threshold(wanted: float, window: int) -> float:
    from scipy.optimize import brentq

    low = 1.0  # below, the formula means nothing
    if _log_run_length(low, window) > math.log(wanted):
        raise InputError(
            f"{wanted:g} samples between false alarms is too often for the approximation: give a threshold"
        )
    return brentq(lambda h: _log_run_length(h, window) - math.log(wanted), low, 700.0)


@lru_cache(maxsize=64)
def _delay(detector, jump: float) -> float:
    if jump == 0:
        raise InputError("jump = 0 is no shift: run_length is the time between false alarms")
    return simulated_delay(detector, jump)[0]
