"""Do two windows of a known plant tell the same story? The parity test of consecutive estimates."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..engine.errors import InputError
from .average_run_length import rate
from .registry import register
from .settings import rate_words

NOTHING = 1e-7  # singular value, relative to the largest, of a combination of z that round-off alone decides


@register()
class Parity(NamedTuple):
    """Alarms where the newest window of a `WindowObserver` contradicts the one before it.

    Both estimate the same trajectory from samples of their own:

        d = z[t-T, t] - Phi(T) z[t-2T, t-T] - what the inputs do,      d' S^-1 d ~ chi2(m)

    with S the covariance of d. A plant or a disturbance that is not the one given makes
    d large long before the residuals of either window show anything.

    Parameters
    ----------
    false_alarms : str or float, optional
        Promised rate, "1 per 10_000" or a mean number of samples. None: `probability` holds.
    probability : float
        Of d' S^-1 d above the threshold, at one sample, while plant and disturbances are those given.
    restart : bool
        After an alarm the window begins anew with the samples that follow, and two whole windows must pass before the
        next alarm. False: the alarm lasts as long as the contradiction, up to two windows.

    Notes
    -----
    The statistic of neighbouring samples is nearly the same, so alarms come in runs and more rarely than single samples
    exceed: with P(exceed) = 1/(2 N) the mean time to a false alarm is at least N samples, however they depend
    (sum of P(no alarm before n) >= sum of 1 - n/(2 N)). `false_alarms` keeps that promise.

    A prior is no data: both windows use it, but the disturbance is one. S counts it once, as drawn at the start of the
    older window; so disturbances without a prior, or with a true one, give exactly chi2, and one that is larger than
    its prior gives alarms.

    Bad at: noise that is not white, whose deviations are too small; what both windows get wrong alike (a constant
    error of the plant at a constant operating point); windows so short that their deviation hides the fault, or so long
    that the plant is never right for two of them. Samples missing in either window: not tested.

    References
    ----------
    Two-window form of parity space residuals (Gertler 1998); Willsky and Jones (1976) for the contradiction of filters.

    Examples
    --------
    >>> import driftwise as dw
    >>> print(dw.detect.Parity("1 per 500_000").words)
    one false alarm per 500 000 samples on average (or fewer: a bound for any dependence); each is above its threshold
    with probability 1e-06
    """

    false_alarms: Any = None
    probability: float = 1e-6
    restart: bool = True

    @property
    def exceeds(self) -> float:
        """Probability that the statistic of one sample is above the threshold while nothing is wrong."""
        if self.false_alarms is not None:
            return 0.5 / rate(self.false_alarms)
        p = self.probability
        if not (isinstance(p, float) and 0 < p < 0.5):
            raise InputError(f"probability must lie between 0 and .5, got {p!r}")
        return p

    def threshold(self, degrees: int) -> float:
        """Return what chi2 of so many degrees exceeds with this probability."""
        from scipy.stats import chi2

        return float(chi2.isf(self.exceeds, degrees))

    @property
    def words(self) -> str:
        """What the settings promise, as a sentence."""
        p = self.exceeds
        told = rate_words(0.5 / p, "or fewer: a bound for any dependence")
        return f"{told}; each is above its threshold with probability {p:g}"


def covariance_root(Phi, noise, prior, turn) -> np.ndarray:
    """Return W of the covariance W W' of d = z(new) - Phi z(old).

    Parameters
    ----------
    Phi : (m, m) over the window
    noise, prior : (m, .), (m, d) of the error noise v - prior w of each window's estimate; v is its own white noise,
        w what the disturbances are at its start, over their prior deviations
    turn : (d, d) w of the newer window from w of the older one
    """
    return np.hstack([noise, Phi @ noise, prior @ turn - Phi @ prior])


def whitening(root) -> np.ndarray:
    """Return V (degrees, m), V root (V root)' = 1: combinations that are known up to round-off are left out."""
    size = np.linalg.norm(root, axis=1)
    live = size > 0
    U, values, _ = np.linalg.svd(root[live] / size[live, None], full_matrices=False)
    kept = values > NOTHING * values[0]
    V = np.zeros((int(kept.sum()), len(size)))
    V[:, live] = U[:, kept].T / values[kept, None] / size[live]
    return V


def over_window(Phi, steps, samples: int) -> np.ndarray:
    """Return sum of Phi^j steps(t - j), j < samples, for each t (T, m): by doubling, nothing is ever subtracted."""
    whole, done, piece, length, P = np.zeros_like(steps), 0, steps, 1, Phi
    while done < samples:
        if samples & length:
            whole = piece + _delayed(whole, length) @ P.T  # the newest `length` steps, then those before
            done += length
        if done < samples:
            piece, P, length = piece + _delayed(piece, length) @ P.T, P @ P, 2 * length
    return whole


def _delayed(x, steps):
    return np.vstack([np.zeros((min(steps, len(x)), x.shape[1])), x[: max(0, len(x) - steps)]])


def parity_statistic(z, Phi, steps, V, samples: int) -> np.ndarray:
    """Return d' S^-1 d (T,) of a record, NaN where there are no two estimates ``samples`` apart.

    Parameters
    ----------
    z : (T, m) estimates from windows of so many samples, NaN where there is none
    Phi : (m, m) over one sample
    steps : (T, m) what the inputs add to z from the sample before
    V : from `whitening`
    samples : of a window
    """
    found = np.full(len(z), np.nan)
    carried = z[:-samples] @ np.linalg.matrix_power(Phi, samples).T + over_window(Phi, steps, samples)[samples:]
    found[samples:] = np.sum(((z[samples:] - carried) @ V.T) ** 2, axis=1)
    return found
