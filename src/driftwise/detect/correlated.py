"""Run lengths of a cumulative sum whose signal is correlated: two short simulations, extrapolated by theory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..engine.errors import InputError
from .brownian import finite, phi2, positive

LONGEST = 10**7  # samples that a simulated run may take


def inverse_excess(c):
    """Return x >= 0 with e^x - 1 - x = c, for c >= 0."""
    from scipy.optimize import brentq

    high = np.log1p(c) + np.log1p(np.log1p(c)) + np.sqrt(2 * c) + 2
    return brentq(lambda x: x * x * phi2(x) - c, 0.0, high, xtol=1e-300, rtol=1e-15, maxiter=1000)


@dataclass(frozen=True)
class RunLengthFit:
    """Mean run length (e^z - 1 - z)/(exponent drift), z = exponent (threshold + overshoot), and its inverse.

    A Brownian sum has exponent 2 drift/std^2 and no overshoot. Bad at: thresholds below the overshoot.

    Attributes
    ----------
    exponent : float
        The run length grows like exp(exponent threshold) (Cramer).
    overshoot : float
        What discrete time adds to the threshold.
    drift : float
        How far the sum falls per sample: the reference, for a signal of mean 0.
    """

    exponent: float
    overshoot: float
    drift: float

    def run_length(self, threshold):
        """Return the mean run length at a threshold, or at each of an array."""
        h = positive("threshold", threshold) + self.overshoot
        return self.exponent * h**2 / self.drift * phi2(self.exponent * h)

    def threshold(self, run_length) -> float:
        """Return the threshold of a mean run length."""
        h = inverse_excess(self.exponent * self.drift * positive("run_length", run_length)) / self.exponent
        if h <= self.overshoot:
            raise InputError(
                f"run_length = {run_length:g} is below what any threshold gives here "
                f"({self.run_length(1e-9):.3g}); false alarms that frequent need a smaller reference"
            )
        return h - self.overshoot


def product_exponent(mu) -> float:
    """Return the exponent of run lengths of products of successive innovations of variance 1, less mu.

    The root l in (0, 1/2) of -1/2 ln[(1 + sqrt(1 - 4 l^2))/2] = l mu: the limit of the moment generating function of
    the quadratic form sum e(n) e(n+1) (Szego); 1/2 beyond mu = ln 2, where the tail of one product decides.

    Examples
    --------
    >>> print(round(product_exponent(0.15), 4), "against a Brownian", 2 * 0.15)
    0.2662 against a Brownian 0.3
    """
    from scipy.optimize import brentq

    mu = positive("mu", mu)
    if mu >= np.log(2):
        return 0.5

    def excess(l):
        return -0.5 * np.log1p(-2 * l * l / (1 + np.sqrt(1 - 4 * l * l))) - l * mu

    return brentq(excess, mu / 2, 0.5, xtol=1e-300, rtol=1e-14)


def product_run_length(threshold, reference, std=1.0, overshoot=2.05):
    """Return the mean run length of a one-sided sum over the products std e(n) e(n+1) of successive innovations.

    Parameters
    ----------
    threshold, reference : float
        The sum is g <- max(0, g + z - reference); it alarms at the threshold.
    std : float
        Standard deviation of the product; 1/Phi for the gain of Hampton's filter.
    overshoot : float
        In units of ``std``. 2.05 suits a reference near 0.15 std (measured 1.86, 2.03, 2.49 at 0.07, 0.15, 0.3).

    Notes
    -----
    Within 3 % at reference 0.15; bad at a reference of 0.3 (-28 %): fit two simulations instead
    (`extrapolate_run_length`).

    Examples
    --------
    >>> print(round(product_run_length(25.0, 0.15, std=1 / 0.99)))
    30021
    """
    G, dmu = positive("std", std), positive("reference", reference)
    return RunLengthFit(product_exponent(dmu / G) / G, finite("overshoot", overshoot) * G, dmu).run_length(threshold)


def extrapolate_run_length(thresholds, run_lengths, drift) -> RunLengthFit:
    """Return the law of run lengths that passes through two simulated ones; it holds at far higher thresholds.

    For any stationary signal, correlated or not: simulate two low thresholds, whose run lengths are a few hundred to a
    few thousand (`simulate_run_length`, 20 000 runs), and read the rare alarms from the fit.

    Parameters
    ----------
    thresholds : (2,)
        Increasing.
    run_lengths : (2,)
        Mean run lengths there, increasing.
    drift : float
        How far the sum falls per sample: the reference, for a signal of mean 0.

    Raises
    ------
    InputError
        Where the numbers are not two increasing pairs of positive numbers.

    Notes
    -----
    Bad at: small drifts (10 % short at reference 0.07, threshold 40) and too few runs: an error of 1 % in the exponent
    is one of (exponent x threshold) % in the run length.

    Examples
    --------
    >>> fit = extrapolate_run_length([8, 15], [262.2, 2033.2], 0.15)
    >>> print(round(fit.exponent, 2), round(fit.threshold(fit.run_length(25.0)), 6))
    0.26 25.0
    """
    from scipy.optimize import brentq

    h, T = positive("thresholds", thresholds), positive("run_lengths", run_lengths)
    drift = positive("drift", drift)
    if np.shape(h) != (2,) or np.shape(T) != (2,) or not (h[0] < h[1] and T[0] < T[1]):
        raise InputError(
            f"thresholds and run_lengths must be two increasing numbers each, got {thresholds!r} and {run_lengths!r}. "
            "Were there too few runs to tell them apart?"
        )

    def gap(l):  # z2 - z1 = l (h2 - h1); falls from infinity to below 0 at ln(T2/T1)/(h2 - h1)
        return (inverse_excess(l * drift * T[1]) - inverse_excess(l * drift * T[0])) / l - (h[1] - h[0])

    high = np.log(T[1] / T[0]) / (h[1] - h[0])
    low = high / 2
    while gap(low) < 0:
        low /= 2
    l = brentq(gap, low, high, xtol=1e-300, rtol=1e-13)
    return RunLengthFit(l, inverse_excess(l * drift * T[0]) / l - float(h[0]), float(drift))


def lagged_products(generator, runs):
    """Yield products e(n) e(n+1) of standard Gaussian innovations, one for each run still going.

    The pattern of every signal for `simulate_run_length`: yield one sample of each run, be told which of them go on.
    """
    e = generator.standard_normal(runs)
    while True:
        new = generator.standard_normal(e.size)
        going = yield new * e
        e = new[going]


def simulate_run_length(signal, reference, thresholds, runs=20_000, seed=0) -> np.ndarray:
    """Return mean run lengths of g <- max(0, g + z - reference) at several thresholds, from one simulation.

    Parameters
    ----------
    signal : callable
        ``signal(generator, runs)`` yields the samples z of all runs at once, (runs,), and is sent a mask of those that
        go on: `lagged_products` is one in five lines. Every run must begin in its stationary law.
    reference : float
        Subtracted from each sample.
    thresholds : (k,)
        Levels at which the sum alarms, each run starting from 0.
    runs : int
        Independent runs; the standard error of a mean is about the mean over sqrt(runs).
    seed : int
        Of ``numpy.random.default_rng``.

    Raises
    ------
    InputError
        Where a sample is not finite, samples are not one per run, or a run takes more than ten million samples.

    Notes
    -----
    Time goes like runs x run length (a second for 20 000 runs of 2000): bad at rare alarms, for which
    `extrapolate_run_length` is made.

    Examples
    --------
    >>> low, high = simulate_run_length(lagged_products, 0.15, [3, 5], runs=2000, seed=1)
    >>> print(33 < low < 40, 81 < high < 101)
    True True
    """
    h = np.atleast_1d(positive("thresholds", thresholds))
    reference = finite("reference", reference)
    g, peak, total = np.zeros(runs), np.zeros(runs), np.full(len(h), float(runs))  # E T = sum over n of P(T > n)
    source = signal(np.random.default_rng(seed), runs)
    z = next(source)
    for _ in range(LONGEST):
        if np.shape(z) != g.shape or not np.isfinite(z).all():
            raise InputError(
                f"signal must yield one finite sample for each of {g.size} runs still going, got shape {np.shape(z)}"
                + (
                    ". Does it drop the runs it is told have ended?"
                    if np.shape(z) != g.shape
                    else " with some that are not"
                )
            )
        g = np.maximum(0.0, g + z - reference)
        peak = np.maximum(peak, g)
        total += [np.count_nonzero(peak < level) for level in h]
        going = peak < h.max()
        if not going.any():
            return total / runs
        g, peak = g[going], peak[going]
        z = source.send(going)
    raise InputError(
        f"{g.size} of {runs} runs had no alarm in {LONGEST:,} samples at threshold {h.max():g}: simulate lower ones, "
        "and extrapolate"
    )
