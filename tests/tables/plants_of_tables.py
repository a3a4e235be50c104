"""Records and what was read of them, for tests of tables."""

import numpy as np

NaN = np.nan


def plant(n=400, seed=0):
    """A valve in steps of 25 % and the first-order level that it drives, with noise."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.integers(0, 5, n // 20) * 25.0, 20)
    y = np.zeros(n)
    for k in range(1, n):
        y[k] = 0.9 * y[k - 1] + 1.2 * u[k - 1] + rng.normal()
    return y, u


def taken(segments):
    """Return (time, y, u) of the whole table."""
    return tuple(np.concatenate(parts) for parts in zip(*segments))


def noisy(samples=1500):
    """Return heater and temperature of a plant, and a generator for more."""
    y, u = plant(samples)
    rng = np.random.default_rng(7)
    return u, y + 0.01 * rng.standard_normal(samples), rng
