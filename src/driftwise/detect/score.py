"""Which parameter of a regression has jumped, and which way? Likelihood ratios of each parameter and direction."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ..engine.dispatch import Vector
from ..engine.errors import InputError
from .alarms import Alarms, scan
from .average_run_length import rate, run_length
from .registry import register
from .settings import each, rate_words, reachable
from .size_mixture import EXCESS, SizeMixture, size_mixture
from .watch import OWN, WHICH, accumulate, conclude, side, watch


@register(
    "parameters",
    "jumps of a parameter",
    "the jump to expect, where output and inputs are of size one; jumps of any size are found without it",
    is_each=True,
)
class ScoreCUSUM(NamedTuple):
    """Alarms where a parameter has jumped, and says which and in which direction: likelihood ratios of the score.

    A jump of parameter i by d moves the mean of the whitened innovation z by d s_i, s_i its slope, which changes from
    sample to sample with the regressor: where that has mean zero, so has z, and `PageHinkley` sees nothing. The exact
    likelihood ratio of the jump is followed instead, for each parameter and each sign of d.

    How large d is need not be told: four sizes compete, .13, .39, 1.17 and 3.51 over the mean of |s_i| so far, which
    move z by about as many standard deviations, and all samples at which the jump may have been, each with weight q,

        R <- (R + q) exp(d s_i z - (d s_i)^2 / 2),   q = |s_i| / (mean of |s_i|)

    with an alarm when the mean of all R reaches the promised number of samples over 1.8. Given a size, ``jump``, the
    logarithm of that ratio alone is summed, and each sum alarms for itself:

        g <- max(0, g + d s_i z - (d s_i)^2 / 2),   alarm when one reaches the threshold

    For a linear regression these are also the probe bank (`ProbeBank`) of predictors whose parameters are shifted
    by +d_i or -d_i.

    Parameters
    ----------
    false_alarms : str or float
        Promised rate, "1 per 10_000" or a mean number of samples. Unused where `threshold` is given.
    jump : float or (m,), optional
        Size of the jump to be found soonest, of each parameter: in its own units, or, inside an estimator, in the
        units of `y_scale` and `u_scale`. None: of any size.
    threshold : float, optional
        The threshold itself: of a sum, or of the logarithm of the sum of R over parameters and signs, mean over sizes.
    slopes : (m,), optional
        Typical sizes of the slopes that the threshold was calibrated to (`calibrated_to` fills them in), for `words`.

    Notes
    -----
    Without a size: R less the sum of q is a martingale where z is N(0, 1) given the past, whatever the regressors, so
    until an alarm it takes as many samples, on average, as the mean of all R then is: the threshold and what goes
    beyond it, 1.8 times as much by simulation (0.85 to 1.2 of the promise with normal, skewed, Laplace and Student
    noise, more where noise has no tails). |z| counts up to 3 and |d s_i| up to 2, so no single outlier alarms. How soon
    jumps are found: docs/detectors.md.

    With a size the promise is a guarantee: exp(g) is a supermartingale, so with m parameters false alarms are at least
    exp(threshold)/(2 m) samples apart on average. It is conservative: by a factor of six to ten where d s_i is about 1,
    of more than thirty where it is 0.3. `calibrated_to` gives up the guarantee for a rate that is nearly the promised
    one, and finds jumps sooner. Bad at, with a size: jumps much smaller than half of ``jump`` (their sums fall on
    average). Without: jumps that move z by much less than 0.1 standard deviation, and inputs that become much larger or
    smaller than they were on average. Either: naming one of two parameters whose regressors are alike, parameters that
    drift, and a plant that is not of the model's kind, to which the smallest sizes are the most sensitive.

    References
    ----------
    Lorden (1971), Annals of Mathematical Statistics 42, 1897-1908; Pollak (1987), Annals of Statistics 15, 749-779, for
    the mixture; Perriot-Mathonna (1981), section 4, for the score.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> rng = np.random.default_rng(1)
    >>> slopes = rng.standard_normal((1000, 2))
    >>> z = rng.standard_normal(1000)
    >>> z[600:] -= 0.8 * slopes[600:, 1]                      # parameter 1 has fallen by 0.8
    >>> dw.detect.ScoreCUSUM("1 per 10_000").scan(z[:640], slopes[:640])
    1 alarm in 640 samples: #1 down at 624 since 592
    """

    false_alarms: Any = "1 per 10_000"
    jump: Any = None
    threshold: float | None = None
    slopes: Any = None

    def resolve(self, parameters: int) -> ScoreSums | SizeMixture:
        """Return what the kernel sees, for so many parameters."""
        if parameters < 1:
            raise InputError(
                "ScoreCUSUM watches parameters: it needs the slopes of a regression. Where only innovations are "
                "watched, use VarianceCUSUM, PageHinkley or GLR"
            )
        if self.threshold is None:
            h = math.log(2 * parameters * rate(self.false_alarms) / self._excess)
        else:
            h = float(reachable(self.threshold, 1)[0])
        if self.jump is None:
            return size_mixture(h)
        return ScoreSums(each("jump", self.jump, parameters), np.full(2 * parameters, h))

    @property
    def _excess(self) -> float:
        """Mean run length over exp(threshold)/(2 m): 1 at least, which is what is guaranteed of a size that is told."""
        return EXCESS if self.jump is None else 1.0

    def run_length(self, parameters: int) -> float:
        """Return the mean number of samples between false alarms, whatever the regressors.

        With a size it is guaranteed (false alarms are rarer), without one it is nearly the true one.
        """
        return self._excess * math.exp(float(np.min(self.resolve(parameters).h))) / (2 * parameters)

    def typical_run_length(self, slopes) -> float:
        """Return the mean number of samples between false alarms, slopes (m,) of constant size (any sign) for each.

        Exact for one sum; that the rates of several add up is an approximation, from below. Without a size it is that
        of `run_length`.
        """
        slopes = each("slopes", np.abs(slopes), np.size(slopes))
        found = self.resolve(len(slopes))
        if isinstance(found, SizeMixture):
            return self.run_length(len(slopes))
        a = found.d * slopes
        return 0.5 / sum(1.0 / run_length(h / x, x / 2) for h, x in zip(found.h[::2].tolist(), a.tolist()))

    def calibrated_to(self, slopes) -> ScoreCUSUM:
        """Return the same detector, of a given size, with the threshold at which `typical_run_length` is the promise.

        Parameters
        ----------
        slopes : (m,) typical size of the slope of each parameter: the root mean square of its whitened regressor

        Close to the promise for slopes of constant size where jumps move z by 1 sd or less; otherwise alarms are rarer
        (Gaussian slopes: run lengths 1.2 to 1.6 times as long, 2 to 3 times where a jump moves z by 3 sd).
        """
        from scipy.optimize import brentq

        if self.jump is None:
            raise InputError(
                "calibrated_to is for a jump of a given size: without one the rate is nearly the promised one"
            )
        wanted = rate(self.false_alarms)

        def off(h):
            return math.log(self._replace(threshold=h).typical_run_length(slopes) / wanted)

        sizes = tuple(each("slopes", np.abs(slopes), np.size(slopes)).tolist())
        most = math.log(2 * len(sizes) * wanted)  # what is guaranteed
        least = 1e-3 * most
        if off(least) > 0:
            raise InputError(f"false alarms as often as {self.false_alarms!r} need no threshold at all")
        return self._replace(threshold=float(brentq(off, least, most, xtol=1e-6)), slopes=sizes)

    @property
    def words(self) -> str:
        """What the settings promise, as a sentence."""
        if self.slopes is not None:
            sizes = ", ".join(f"{s:.3g}" for s in np.ravel(self.slopes))
            how = f"typically, for white Gaussian innovations and slopes of size {sizes}; no guarantee"
            return rate_words(self.typical_run_length(self.slopes), how)
        if self.jump is None:
            told = rate_words(self.run_length(1), "by simulation, for white Gaussian innovations; jumps of any size")
        else:
            told = "at most " + rate_words(self.run_length(1), "guaranteed for white Gaussian innovations")
        return told if self.threshold is None else f"{told}, for each parameter that is watched"

    def scan(self, signal, slopes, *, std: float = 1.0, state=None) -> Alarms:
        """Return the alarms in the innovations of a regression.

        Parameters
        ----------
        signal : (T,) innovations e; NaN where missing (skipped)
        slopes : (T, m) how the mean of e moves per unit of each parameter: the regressors
        std : standard deviation of e, to whiten both
        state : ``alarms.state`` of the record before, to go on from
        """
        slopes = np.asarray(slopes, float)
        if slopes.ndim != 2:
            raise InputError(f"slopes must be (T, m), one column per parameter, got shape {slopes.shape}")
        return scan(self.resolve(slopes.shape[1]), signal, 0.0, std, state, slopes / std)


class ScoreSums(NamedTuple):
    """What the kernel sees of `ScoreCUSUM`: size of jump (m,), threshold (2 m,)."""

    d: Vector
    h: Vector

    def state_size(self, parameters: int) -> int:
        """Return how many numbers it keeps: sums (up, down) of each parameter, and samples since they were 0."""
        return OWN + 4 * parameters


@watch.on(ScoreSums)
def watch_score_sums(detector, detector_state, z, slope):
    m = slope.size
    g, since = detector_state[OWN : OWN + 2 * m], detector_state[OWN + 2 * m :]
    for i in range(m):
        a = detector.d[i] * slope[i]
        accumulate(g, since, 2 * i, a * z - 0.5 * a * a)
        accumulate(g, since, 2 * i + 1, -a * z - 0.5 * a * a)
    best = conclude(detector_state, g, since, detector.h)
    if best >= 0:
        detector_state[WHICH] = best // 2
    return side(best)
