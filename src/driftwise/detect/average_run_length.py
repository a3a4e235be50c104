"""How often a one-sided cumulative sum alarms for nothing, how late it is, and the threshold for a promised rate."""

from __future__ import annotations

import re

import numpy as np

from ..engine.errors import InputError
from .brownian import (
    OVERSHOOT,
    brownian_delay,
    brownian_run_length,
    brownian_threshold,
    finite,
    growth,
    legendre,
    positive,
)
from .correlated import (
    RunLengthFit,
    extrapolate_run_length,
    inverse_excess,
    lagged_products,
    product_exponent,
    product_run_length,
    simulate_run_length,
)

__all__ = [
    "OVERSHOOT",
    "RunLengthFit",
    "brownian_delay",
    "brownian_run_length",
    "brownian_threshold",
    "extrapolate_run_length",
    "growth",
    "lagged_products",
    "product_exponent",
    "product_run_length",
    "rate",
    "run_length",
    "run_length_of",
    "simulate_run_length",
    "threshold_for",
    "threshold_of",
]

WIDEST = 1000.0  # threshold, in standard deviations, up to which the linear equations are solved
RAREST = 1e18  # samples between false alarms that doubles can tell from never


def rate(text) -> float:
    """Return the mean number of samples between false alarms of a promise such as "1 per 10_000".

    Parameters
    ----------
    text : str or float
        ``"1 per 10_000"``, ``"3 in 1e5"``, ``"1/2000"``, or a number of samples.

    Raises
    ------
    InputError
        For anything else, and for a rate that is not between 0 and 1 alarm per sample.

    Examples
    --------
    >>> rate("1 per 10_000"), rate("1/2000"), rate(1e4)
    (10000.0, 2000.0, 10000.0)
    """
    number = r"([-+]?[\d_.]+(?:e[-+]?\d+)?)"
    found = re.fullmatch(rf"\s*(?:{number}\s*(?:per|in|/)\s*)?{number}\s*(?:samples?)?\s*", str(text), re.IGNORECASE)
    try:
        alarms, samples = (float(part or 1) for part in (found.groups() if found else ()))
    except ValueError:
        raise InputError(
            f"a rate of false alarms is written '1 per 10_000', '1/2000' or as a number of samples, got {text!r}"
        ) from None
    if not (alarms > 0 and 1 < samples / alarms < np.inf):
        raise InputError(
            f"a rate of false alarms must be above 0 and below one per sample, got {text!r}: no threshold promises "
            "never, and the mean time between alarms is more than one sample. Are the two numbers in this order?"
        )
    if samples / alarms > RAREST:
        raise InputError(
            f"at most {RAREST:g} samples between false alarms can be promised, got {text!r}: such a threshold never "
            "alarms. For no detector at all choose another memory"
        )
    return samples / alarms


@np.errstate(divide="ignore", invalid="ignore", over="ignore")  # where there is never an alarm
def _times(A, alarm):
    """Return L of L = 1 + A L: the mean time to alarm from each state, to all digits however rare alarms are.

    Elimination without a subtraction (Grassmann, Taksar and Heyman 1985): the chance of leaving a state is summed, not
    taken from 1. Only states within reach of each other are touched, and the first, to which the sum falls back.
    """
    A, alarm, time, n = A.copy(), alarm.copy(), np.ones(len(A)), len(A)
    near = np.maximum(A, A.T) > 1e-18
    near[:, 0] = A[0] > 1e-18
    low = np.minimum.accumulate(np.argmax(near, axis=1)[::-1])[::-1]
    leave = np.empty(n)
    for j in range(n - 1, 0, -1):
        a = low[j]
        way = A[j, a:j]
        leave[j] = way.sum() + alarm[j] + (A[j, 0] if a else 0.0)
        share = A[a:j, j] / leave[j]
        A[a:j, a:j] += share[:, None] * way
        if a:
            A[a:j, 0] += share * A[j, 0]
        time[a:j] += share * time[j]
        alarm[a:j] += share * alarm[j]
    L = np.empty(n)
    L[0] = time[0] / alarm[0]
    for j in range(1, n):
        a = low[j]
        L[j] = (time[j] + A[j, a:j] @ L[a:j] + (A[j, 0] * L[0] if a else 0.0)) / leave[j]
    return L


def _nystrom(h, k):
    """Return the chances of S <- max(0, S + z - k), z standard Gaussian, to go from node to node, and to alarm."""
    from scipy.special import ndtr

    x, w = legendre(int(4 * h) + 30)
    s = np.concatenate([[0.0], h * x])
    A = np.empty((len(s), len(s)))
    A[:, 0] = ndtr(k - s)
    A[:, 1:] = h * w * np.exp(-0.5 * (s[1:] - s[:, None] + k) ** 2) / np.sqrt(2 * np.pi)
    return A, ndtr(s - h - k)


def _brook_evans(cdf, h, k, n):
    """Return the chances to go between n cells of [0, h], the first of half width, and to alarm (Brook-Evans)."""
    w = 2 * h / (2 * n - 1)
    F = np.asarray(cdf((np.arange(-n, n) + 0.5) * w + k), float)
    if F.shape != (2 * n,) or not (np.isfinite(F).all() and F.min() >= 0 and F.max() <= 1):
        raise InputError("cdf must map an array of values to probabilities from 0 to 1; is it a density?")
    i = np.arange(n)
    A = np.diff(F)[n - 1 + i - i[:, None]]
    A[:, 0] = F[n - i]
    return A, 1 - F[2 * n - 1 - i]


def _known(L, threshold, reference):
    if not (np.isfinite(L) and L > 0.99):
        raise InputError(
            f"with threshold = {threshold:g} and reference = {reference:g} there is never an alarm, or later than "
            "doubles can count. Are both in units of the signal?"
        )
    return float(L)


def run_length(threshold, reference, std=1.0, mean=0.0, start="zero") -> float:
    """Return the exact mean number of samples until g <- max(0, g + z - reference) >= threshold, z Gaussian and white.

    Parameters
    ----------
    threshold, reference : float
        In units of the signal z. The best reference for a jump of the mean from 0 to m is m/2.
    std : float
        Standard deviation of z.
    mean : float
        Mean of z: 0 gives the time between false alarms, the mean after a jump gives the delay.
    start : {"zero", "steady"}
        Where the sum stands: at 0, or in its law after a long wait without alarm (mean 0), as when a jump comes late.

    Raises
    ------
    InputError
        For settings out of range, and a threshold beyond 1000 std.

    Notes
    -----
    The integral equation of Page (1954), solved at Gauss-Legendre nodes (Nystrom), to about eleven digits up to run
    lengths of 1e13 and six at 1e18. Two sides at once: 1/T = 1/T_up + 1/T_down. Bad at: correlated signals, for which
    see `simulate_run_length`, and wide thresholds: a second at 1000 std, where `brownian_run_length` is as good.

    Examples
    --------
    >>> print(round(run_length(5.0, 0.5), 2), round(run_length(5.0, 0.5, mean=1.0), 2))
    930.89 10.38
    """
    std = positive("std", std)
    h, k, mean = (
        positive("threshold", threshold) / std,
        finite("reference", reference) / std,
        finite("mean", mean) / std,
    )
    _within(h)
    L = _times(*_nystrom(h, k - mean))
    if start == "zero":
        return _known(L[0], threshold, reference)
    if start != "steady":
        raise InputError(f'start must be "zero" or "steady", got {start!r}')
    return _known(_settled(_nystrom(h, k)[0]) @ L, threshold, reference)


def _settled(A):
    """Return the law of the sum after a long wait without alarm: the leading left eigenvector of its chances."""
    from scipy.linalg import eig

    values, left = eig(A.T)
    law = np.abs(left[:, np.argmax(values.real)])
    return law / law.sum()


def _within(h):
    if h > WIDEST:
        raise InputError(
            f"threshold is {h:g} standard deviations: beyond {WIDEST:g} use brownian_run_length. "
            "Is std in the units of the signal?"
        )


def _states(cdf, h, k, n, before=None):
    def mean(size):
        L = _times(*_brook_evans(cdf, h, k, size))
        return L[0] if before is None else _settled(_brook_evans(before, h, k, size)[0]) @ L

    fine, coarse = mean(n), mean(n // 2)
    return fine + (fine - coarse) / 3 if np.isfinite(coarse) else coarse  # Richardson: the error goes like 1/n^2


def run_length_of(cdf, threshold, reference, mean=0.0, states=400, before=None) -> float:
    """Return the mean run length of a one-sided sum over independent samples of any distribution.

    Parameters
    ----------
    cdf : callable
        Distribution function of the signal, on arrays: ``scipy.stats.t(4).cdf``.
    threshold, reference : float
        As for `run_length`.
    mean : float
        Added to every sample: the jump, for a delay.
    states : int
        Even; cells of the Markov chain (Brook and Evans 1972), extrapolated from half as many.
    before : callable, optional
        Distribution function until then: the sum starts in its law after a long wait without alarm, as when a change
        comes late, and the result is a delay. At 0 if omitted.

    Raises
    ------
    InputError
        For settings out of range, a cdf that is none, and where there is never an alarm.

    Notes
    -----
    About 1e-6 relative for a smooth distribution. Bad at: distributions with atoms (rounded data), where the answer
    moves in steps, and signals much narrower than threshold/states.

    Examples
    --------
    >>> from scipy.stats import norm, t
    >>> heavy = lambda x: t.cdf(x * 2**0.5, 4)                    # variance 1
    >>> print(round(run_length_of(norm.cdf, 5.0, 0.5), 2), round(run_length_of(heavy, 5.0, 0.5)))
    930.89 503
    """
    h, k = positive("threshold", threshold), finite("reference", reference) - finite("mean", mean)
    if isinstance(states, bool) or not isinstance(states, int | np.integer) or states < 4 or states % 2:
        raise InputError(f"states must be an even whole number of at least 4, got {states!r}")
    settled = None if before is None else lambda x: before(x + mean)  # no mean is added yet
    return _known(_states(cdf, h, k, states, settled), threshold, reference)


def _search(wanted, smallest, k, std, length):
    """Return h with length(h) = wanted, by Brent's method from the Brownian threshold less the overshoot."""
    from scipy.optimize import brentq

    if wanted <= smallest:
        raise InputError(
            f"a mean run length of {wanted:g} samples is impossible: with reference {k:g} and std {std:g} even a "
            f"threshold of 0 alarms only every {smallest:.3g}. Lower the reference, or accept rarer alarms"
        )
    c = 2 * k**2 * wanted / std**2
    start = max((inverse_excess(c) * std**2 / (2 * k) if k else std * wanted**0.5) - OVERSHOOT * std, 0.05 * std)

    def off(h):
        L = length(h)  # what doubles cannot count comes out infinite, negative or NaN
        return (min(np.log(L), 710.0) if L > 0 else 710.0) - np.log(wanted)

    low, high, step = max(0.2 * start, 1e-6 * std), start + 0.5 * std, std
    while off(low) > 0:
        low /= 2
    while off(high) < 0:
        high, step = high + step, 2 * step
    h = brentq(off, low, high, xtol=1e-10 * std, rtol=1e-13)
    if abs(off(h)) > 0.01:  # it leaps there: the equations have lost their digits
        raise InputError(_beyond(wanted, k, std))
    return h


def threshold_for(run_length, reference, std=1.0) -> float:
    """Return the threshold at which a one-sided sum over white Gaussian samples keeps its promise of false alarms.

    Parameters
    ----------
    run_length : float or str
        Mean number of samples between false alarms, or a `rate` such as "1 per 10_000". For a detector with two sides
        give each side twice the run length.
    reference : float
        Subtracted from each sample, in units of the signal; 0 or more.
    std : float
        Standard deviation of the signal.

    Raises
    ------
    InputError
        For a run length that no threshold gives (at most 1/P(z > reference), 3.24 for reference 0.5).

    Notes
    -----
    The inverse of `run_length`. Bad at: correlated signals (see `extrapolate_run_length`) and heavy tails (see
    `threshold_of`); and in a loop that reacts to its own alarms the rate is another.

    Examples
    --------
    >>> import driftwise as dw
    >>> h = dw.detect.threshold_for("1 per 1_000", reference=0.5)
    >>> print(round(h, 3), round(dw.detect.run_length(h, 0.5), 6))
    5.071 1000.0
    """
    from scipy.special import ndtr

    std = positive("std", std)
    k = _not_negative(reference)

    def length(h):
        _within(h / std)
        return _times(*_nystrom(h / std, k / std))[0]

    return _search(rate(run_length), 1 / ndtr(-k / std), k, std, length)


def threshold_of(cdf, run_length, reference, std=1.0) -> float:
    """Return the threshold that gives a mean run length, for independent samples of any distribution.

    ``std`` is only where the search begins; the rest is as for `threshold_for` and `run_length_of`, whose inverse it
    is. Bad at: distributions with atoms; the nearest threshold may then give another run length.

    Examples
    --------
    >>> from scipy.stats import t
    >>> print(round(threshold_of(t(4).cdf, 1000.0, 0.5, std=2**0.5), 2))
    10.3
    """
    std = positive("std", std)
    k = _not_negative(reference)
    above = 1 - float(cdf(np.array([k]))[0])
    if not above > 0:
        raise InputError(f"the signal never exceeds reference = {k:g}: no threshold is ever reached")
    wanted = rate(run_length)
    h = _search(wanted, 1 / above, k, std, lambda h: _states(cdf, h, k, 400))
    fine, coarse = (_times(*_brook_evans(cdf, h, k, states))[0] for states in (400, 200))
    if not (0.5 * coarse < fine < 2.0 * coarse):
        raise InputError(_beyond(wanted, k, std))
    return h


def _beyond(wanted, k, std) -> str:
    return (
        f"a mean run length of {wanted:g} cannot be computed with reference {k:g} and std {std:g}: the sum moves too "
        "little per sample. Give a threshold; log(run length) keeps the promise for sums of log likelihood ratios"
    )


def _not_negative(reference):
    k = finite("reference", reference)
    if k < 0:
        raise InputError(f"reference must not be negative, got {k:g}: the sum would climb without a jump")
    return k
