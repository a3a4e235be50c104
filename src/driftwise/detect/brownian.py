"""How long a cumulative sum runs before it alarms, were it a Brownian motion: closed forms, right for any drift."""

from __future__ import annotations

from functools import cache
from math import factorial

import numpy as np

from ..engine.errors import InputError

OVERSHOOT = (
    2 * 0.5825971579390107
)  # -zeta(1/2)/sqrt(2 pi), twice: what discrete time adds to a threshold (Siegmund 1985)
SERIES = np.array([1.0 / factorial(k + 2) for k in range(16)])  # of phi2; the last term is below 1e-18 at 1/2


def positive(name, value):
    """Return a positive finite number, or an array of them."""
    value = finite(name, value)
    if not np.all(value > 0):
        raise InputError(f"{name} must be positive, got {value!r}. Was a sign lost, or is it switched off by a zero?")
    return value


def finite(name, value):
    """Return a finite number, or an array of them."""
    try:
        number = np.asarray(value, float)[()]
    except (TypeError, ValueError):
        raise InputError(f"{name} must be a number, got {value!r}") from None
    if not np.all(np.isfinite(number)):
        raise InputError(f"{name} must be finite, got {value!r}. Was something divided by zero, or a sample missing?")
    return number


def phi1(x):
    """Return (e^x - 1)/x, whose limit at 0 is 1."""
    x = np.minimum(x, 1e3)  # e^1000 is infinity as a double
    safe = np.where(x == 0, 1.0, x)
    with np.errstate(over="ignore"):
        return np.where(x == 0, 1.0, np.expm1(safe) / safe)[()]


def phi2(x):
    """Return (e^x - 1 - x)/x^2, whose limit at 0 is 1/2; a series where the formula would cancel."""
    x = np.minimum(x, 1e3)
    near = np.abs(x) < 0.5
    safe = np.where(near, 1.0, x)
    return np.where(near, np.polynomial.polynomial.polyval(np.where(near, x, 0.0), SERIES), (phi1(safe) - 1) / safe)[()]


def brownian_run_length(drift, threshold, std=1.0):
    """Return the mean number of samples until a Brownian sum, started and reflected at 0, reaches the threshold.

    Parameters
    ----------
    drift : float or array
        How far the sum falls per sample: the reference of the detector less the mean of its signal. Positive while
        nothing has happened (the result is a time between false alarms), negative after a jump (a delay).
    threshold : float or array
        In units of the signal. For a sum of discrete Gaussian samples give ``threshold + OVERSHOOT * std``.
    std : float or array
        Standard deviation of the signal per sample; of a correlated signal the long-run one.

    Returns
    -------
    float or array
        G^2/(2 drift^2) (e^x - 1 - x), x = 2 drift h/G^2; h^2/G^2 without drift; infinity where e^x is.

    Raises
    ------
    InputError
        For numbers that are not finite, and a threshold or std that is not positive.

    Notes
    -----
    Perriot-Mathonna (1981) prints T1 with ``+ x``, and h/drift for the delay, which forgets the reflection.
    Bad at: low thresholds (without the overshoot 70 % short at drift 0.5, threshold 4), and correlated or heavy-tailed
    signals at high ones, where the exponent is another (eight times too long: see `product_run_length`).

    Examples
    --------
    >>> print(round(brownian_run_length(0.3, 3.0), 2), brownian_run_length(0.0, 3.0))
    18.05 9.0
    >>> print(round(brownian_run_length(-0.07, 20.0 + 1.01 * OVERSHOOT, std=1.01), 1))     # 204 when simulated
    204.1
    """
    drift, h, G = finite("drift", drift), positive("threshold", threshold), positive("std", std)
    return 2 * (h / G) ** 2 * phi2(2 * drift * h / G**2)


def brownian_threshold(run_length, drift, std=1.0) -> float:
    """Return the threshold that a Brownian sum takes so many samples to reach: the inverse of `brownian_run_length`.

    Parameters
    ----------
    run_length : float
        Mean number of samples from 0 to the threshold; of a promise in words, ``rate("1 per 10_000")``.
    drift : float
        How far the sum falls per sample, as there: positive for a time between false alarms, negative for a delay.
    std : float
        Standard deviation of the signal per sample.

    Raises
    ------
    InputError
        For numbers that are not finite, and a run length or std that is not positive.

    Notes
    -----
    For a sum of discrete Gaussian samples take ``OVERSHOOT * std`` off the threshold that comes out; `threshold_for`
    is exact there. Bad at what `brownian_run_length` is bad at.

    Examples
    --------
    >>> h = brownian_threshold(10_000, 0.5)  # or run_length=rate("1 per 10_000")
    >>> print(round(h, 3), round(brownian_run_length(0.5, h), 3))
    8.519 10000.0
    """
    from scipy.optimize import brentq

    T, d, G = float(positive("run_length", run_length)), float(finite("drift", drift)), float(positive("std", std))
    # log T rises with log h, at a rate between 1 and 2 or more: a search without a scale
    low = high = np.log(G) + 0.5 * np.log(T)  # without drift

    def off(log_h):
        return np.log(brownian_run_length(d, np.exp(log_h), G)) - np.log(T)

    while off(low) > 0:
        low -= 1.0
    while off(high) < 0:
        high += 1.0
    return float(np.exp(brentq(off, low, high, xtol=1e-15, rtol=1e-14)))


@cache
def legendre(n):
    """Return the n nodes and weights of Gauss and Legendre on (0, 1)."""
    from scipy.special import roots_legendre

    x, w = roots_legendre(n)
    return (x + 1) / 2, w / 2


def brownian_delay(drift_after, drift_before, threshold, std=1.0):
    """Return the mean delay of a Brownian detector that has been waiting for long when the jump comes.

    It then stands at a level s of density proportional to exp(-2 drift_before s/G^2) on [0, h]; the delay from s is
    that from 0 less the time from 0 to s.

    Parameters
    ----------
    drift_after : float
        How far the sum climbs per sample after the jump: the new mean of the signal less the reference.
    drift_before : float
        How far it falls per sample before the jump: the reference.
    threshold, std : float
        As for `brownian_run_length`.

    Raises
    ------
    InputError
        For numbers that are not positive and finite.

    Notes
    -----
    Bad at: discrete time. With ``threshold + OVERSHOOT * std`` up to 7 % short; `run_length` with ``start="steady"`` is
    exact for Gaussian signals.

    Examples
    --------
    >>> print(round(brownian_delay(0.1, 0.1, 10.0), 2), round(brownian_run_length(-0.1, 10.0), 2))
    44.04 56.77
    """
    m, dmu = positive("drift_after", drift_after), positive("drift_before", drift_before)
    h, G = positive("threshold", threshold), positive("std", std)
    q = 2 * dmu / G**2
    nodes, weights = legendre(200)
    top = min(h, 40 / q)  # beyond, the density is below 1e-17
    s = top * nodes
    density = weights * np.exp(-q * s)
    return brownian_run_length(-m, h, G) - density @ brownian_run_length(-m, s, G) / density.sum()


def growth(reference, std=1.0):
    """Return c of the threshold h + c ln n that makes the number of false alarms finite: 1.1 std^2/(2 reference).

    With a fixed threshold false alarms never stop, each one raises the gain again, and the estimate does not converge
    with probability 1, as Perriot-Mathonna (1981) says it does. Bad at: late jumps; the delay then grows like ln n too.

    Examples
    --------
    >>> print(round(growth(0.25), 2))
    2.2
    """
    return 1.1 * positive("std", std) ** 2 / (2 * positive("reference", reference))
