"""Loops that take millions of samples, compiled when called: run lengths of cumulative sums, and of a whole loop."""

from __future__ import annotations

from functools import cache

import numpy as np


@cache
def compiled(loop):
    """Return a loop of this folder compiled; each stands alone, so that its cache is never stale."""
    from numba import njit

    return njit(cache=True)(loop)


def one_sided(rng, h, k, std, mean, runs):
    """Return the run lengths (runs,) of g <- max(0, g + z - k) >= h, z white and Gaussian."""
    found = np.zeros(runs)
    for i in range(runs):
        g, n = 0.0, 0.0
        while g < h:
            g = max(0.0, g + mean + std * rng.standard_normal() - k)
            n += 1.0
        found[i] = n
    return found


def two_sided(rng, h, k, std, runs):
    """Return the run lengths of both sums at once."""
    found = np.zeros(runs)
    for i in range(runs):
        a, b, n = 0.0, 0.0, 0.0
        while a < h and b < h:
            z = std * rng.standard_normal()
            a, b = max(0.0, a + z - k), max(0.0, b - z - k)
            n += 1.0
        found[i] = n
    return found


def late(rng, h, k, std, mean, before, runs):
    """Return the delays after ``before`` quiet samples; a run with an alarm in them is taken back and begun again."""
    found = np.zeros(runs)
    for i in range(runs):
        g, n = h, 0.0
        while g >= h:
            g = 0.0
            for _ in range(before):
                g = max(0.0, g + std * rng.standard_normal() - k)
                if g >= h:
                    break
        while g < h:
            g = max(0.0, g + mean + std * rng.standard_normal() - k)
            n += 1.0
        found[i] = n
    return found


def products(rng, h, k, std, runs):
    """Return the run lengths of g over std e(n) e(n+1), the test signal of Hampton's filter at its optimum."""
    found = np.zeros(runs)
    for i in range(runs):
        g, n, e = 0.0, 0.0, rng.standard_normal()
        while g < h:
            new = rng.standard_normal()
            g = max(0.0, g + std * e * new - k)
            e = new
            n += 1.0
        found[i] = n
    return found


def fine_and_coarse(rng, h, k, std, dt, runs):
    """Return the run times (runs, 2) of one reflected Brownian path looked at every dt and every 4 dt."""
    found, root = np.zeros((runs, 2)), np.sqrt(dt)
    for i in range(runs):
        fine, coarse, change, n = 0.0, 0.0, 0.0, 0
        while found[i, 0] == 0.0 or found[i, 1] == 0.0:
            n += 1
            step = std * root * rng.standard_normal() - k * dt
            change += step
            if found[i, 0] == 0.0:
                fine = max(0.0, fine + step)
                if fine >= h:
                    found[i, 0] = n * dt
            if n % 4 == 0:
                if found[i, 1] == 0.0:
                    coarse = max(0.0, coarse + change)
                    if coarse >= h:
                        found[i, 1] = n * dt
                change = 0.0
    return found


def loop(rng, h, growth, dmu, N0, looks, runs):
    """Return alarms so far (looks, runs), mean square (runs,) of x over the second half, and x^2 at the end.

    Linear case F = -1, G = 1 without jumps: x <- x + g Z, Z = w - x, gains 1/2, 1/3, ..., 1/N0 after an alarm. The
    threshold is h + growth ln n.
    """
    alarms, half, last = np.zeros((len(looks), runs)), np.zeros(runs), np.zeros(runs)
    total = looks[-1]
    for i in range(runs):
        x, t, a, b, count, row = 0.0, 2.0, 0.0, 0.0, 0.0, 0
        for n in range(1, total + 1):
            Z = rng.standard_normal() - x
            x += Z / t
            t += 1.0
            a, b = max(0.0, a + Z - dmu), max(0.0, b - Z - dmu)
            if a >= h + growth * np.log(n) or b >= h + growth * np.log(n):
                a, b, t = 0.0, 0.0, N0
                count += 1.0
            if 2 * n > total:
                half[i] += x * x
            if n == looks[row]:
                alarms[row, i] = count
                row = min(row + 1, len(looks) - 1)
        half[i] /= total - total // 2
        last[i] = x * x
    return alarms, half, last
