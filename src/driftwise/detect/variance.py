"""Has the variance of the innovations changed? Cumulative sums of likelihood ratios (Page 1954)."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from ..engine.dispatch import Vector
from ..engine.elementary import log
from ..engine.errors import InputError
from .alarms import Alarms, scan
from .average_run_length import rate, run_length_of, threshold_of
from .brownian import positive
from .registry import register
from .settings import rate_words, reachable, together, watched
from .watch import OWN, accumulate, conclude, side, watch


@register(
    "noise",
    "innovations that widen",
    "their variance after over before, above 1",
    read=lambda rate, *size: VarianceCUSUM(*size)._replace(false_alarms=rate),
)
class VarianceCUSUM(NamedTuple):
    """Alarms where the innovations look ``ratio`` times wider in variance than predicted, or as much narrower.

    With z = e/sqrt(T), the logarithm of the likelihood ratio of variance ratio (up), or 1/ratio (down), against 1:

        up:    g <- max(0, g - 1/2 log(ratio) + 1/2 z^2 (1 - 1/ratio))
        down:  g <- max(0, g + 1/2 log(ratio) - 1/2 z^2 (ratio - 1))

    Parameters that jump make exactly the first: a predictor that is suddenly wrong, whichever parameter it was.

    Parameters
    ----------
    ratio : float
        Variance after over variance before; above 1.
    false_alarms : str or float, optional
        Promised rate, "1 per 10_000" or a mean number of samples; it sets the threshold (Brook and Evans 1972 on the
        chi-square increments). None: `threshold` holds.
    threshold : float or (up, down)
        exp(threshold) samples and more between false alarms of a side, whatever the ratio.
    sides : "up", "down" or "both"
        What to look for.

    Notes
    -----
    Bad at outliers, which look the same (put a `InnovationGate` before it), and at small jumps hidden in the noise. The
    direction is that of the variance: nobody can say which way a parameter moved.

    Examples
    --------
    >>> import driftwise as dw
    >>> print(dw.detect.VarianceCUSUM(false_alarms="1 per 10_000").words)
    one false alarm per 10 000 samples on average (numerically, for independent Gaussian innovations); a variance 4
    times as large is found after 10.0 samples
    """

    ratio: float = 4.0
    false_alarms: Any = None
    threshold: Any = 12.0
    sides: str = "up"

    def resolve(self, parameters: int = 0) -> VarianceSums:
        """Return what the kernel sees."""
        ratio, sides = float(positive("ratio", self.ratio)), watched(self.sides)
        if ratio <= 1:
            raise InputError(
                f"ratio > 1 is expected (variance after over before, either way round), got {self.ratio!r}"
            )
        if self.false_alarms is None:
            h = reachable(self.threshold)
        else:
            wanted = rate(self.false_alarms) * float(sides.sum())
            h = np.array([_threshold(wanted, ratio, i) if sides[i] else np.inf for i in range(2)])
        h[~sides] = np.inf
        return VarianceSums(ratio, h)

    @property
    def run_length(self) -> float:
        """Mean number of samples between false alarms, for independent Gaussian innovations."""
        found = self.resolve()
        return together([_length(h, found.ratio, i, 1.0) for i, h in enumerate(found.h) if np.isfinite(h)])

    def delay(self, ratio: float | None = None, start: str = "steady") -> float:
        """Return the mean number of samples until a variance of ``ratio`` (default: the one set) alarms.

        With the sum in its long-run law (``start="steady"``) or at 0 (``"zero"``) when the variance changes.
        """
        if start not in ("steady", "zero"):
            raise InputError(f'start must be "zero" or "steady", got {start!r}')
        found = self.resolve()
        ratio = ratio or (1 / found.ratio if self.sides == "down" else found.ratio)
        i = int(ratio < 1)
        if not np.isfinite(found.h[i]):
            raise InputError(f"a ratio of {ratio:g} is on the side that sides={self.sides!r} does not watch")
        return _length(found.h[i], found.ratio, i, ratio, start == "steady")

    @property
    def words(self) -> str:
        """What the settings promise, as a sentence."""
        told = rate_words(self.run_length, "numerically, for independent Gaussian innovations")
        change = f"{self.ratio:g}" if self.sides != "down" else f"1/{self.ratio:g}"
        return f"{told}; a variance {change} times as large is found after {self.delay():.1f} samples"

    def scan(self, signal, *, mean: float = 0.0, std: float = 1.0, state=None) -> Alarms:
        """Return the alarms in a signal (T,) of known mean and standard deviation; see `PageHinkley.scan`."""
        return scan(self.resolve(), signal, mean, std, state)


class VarianceSums(NamedTuple):
    """What the kernel sees of `VarianceCUSUM`."""

    ratio: float
    h: Vector

    def state_size(self, parameters: int) -> int:
        """Return how many numbers it keeps: two sums and the samples since they were 0."""
        return OWN + 4


@watch.on(VarianceSums)
def watch_variance_sums(detector, detector_state, z, slope):
    g, since, r, surprise = detector_state[OWN : OWN + 2], detector_state[OWN + 2 : OWN + 4], detector.ratio, z * z
    accumulate(g, since, 0, -0.5 * log(r) + 0.5 * surprise * (1.0 - 1.0 / r))
    accumulate(g, since, 1, 0.5 * log(r) - 0.5 * surprise * (r - 1.0))
    return side(conclude(detector_state, g, since, detector.h))


def _increments(ratio: float, i: int, variance: float):
    """Return distribution function and reference of what side i sums, z of this variance (chi-square, one degree)."""
    from scipy.stats import chi2

    half = 0.5 * math.log(ratio)
    if i == 0:
        return (lambda x: chi2.cdf(2.0 * x / (1.0 - 1.0 / ratio) / variance, 1)), half
    return (lambda x: chi2.sf(2.0 * (2.0 * half - x) / (ratio - 1.0) / variance, 1)), half


def _length(h: float, ratio: float, i: int, variance: float, is_late: bool = False) -> float:
    cdf, reference = _increments(ratio, i, variance)
    return run_length_of(cdf, float(h), reference, before=_increments(ratio, i, 1.0)[0] if is_late else None)


# What `SelfStarting` asks for by default and where records are identified: the search takes a second.
KNOWN = {
    (3000.0, 4.0, 0): 5.411647680709862,
    (4500.0, 4.0, 0): 5.814275746482731,
    (5000.0, 4.0, 0): 5.917551141315015,
    (9000.0, 4.0, 0): 6.503417931783994,
}


@lru_cache(maxsize=256)
def _threshold(wanted: float, ratio: float, i: int) -> float:
    return KNOWN.get((wanted, ratio, i)) or _searched(wanted, ratio, i)


def _searched(wanted: float, ratio: float, i: int) -> float:
    cdf, reference = _increments(ratio, i, 1.0)
    return threshold_of(cdf, wanted, reference, std=(1.0 - 1.0 / ratio if i == 0 else ratio - 1.0) / math.sqrt(2.0))
