"""What rigs are made of: how long, poles, what excites them, a linear plant.

Each is drawn by ``rng``; T samples.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter


def samples(rng) -> int:
    """Return how long a record is."""
    return int(np.exp(rng.uniform(np.log(400), np.log(6000))))


def poles(rng, n):
    """Return a polynomial with n roots within the unit circle."""
    found: list[complex] = []
    while len(found) < n:
        if n - len(found) > 1 and rng.random() < 0.5:
            z = rng.uniform(0.3, 0.97) * np.exp(1j * rng.uniform(0.05, 2.0))
            found += [z, z.conj()]
        else:
            found.append(rng.uniform(0.2, 0.97))
    return np.real(np.poly(found))


def excitation(rng, T, how=None):
    """Return an input (T,), of a kind that is drawn where it is not told."""
    how = how or rng.choice(["prbs", "noise", "steps", "rare steps", "pulses", "sines"])
    if how == "prbs":
        h = rng.integers(1, 30)
        return np.repeat(rng.choice([-1.0, 1], T // h + 1), h)[:T]
    if how == "noise":
        return lfilter([1], [1, -rng.uniform(0, 0.95)], rng.standard_normal(T))
    if how == "steps":
        h = rng.integers(10, 60)
        return np.repeat(rng.uniform(-2, 2, T // h + 1), h)[:T]
    if how == "sines":
        return sum(
            rng.uniform(0.3, 1) * np.sin(np.arange(T) * rng.uniform(0.005, 0.5) + rng.uniform(0, 6)) for _ in range(3)
        )
    u, t, level = np.zeros(T), 0, 0.0
    while t < T:
        if how == "rare steps":
            n = int(rng.exponential(T / 15)) + 20
            u[t : t + n] = level
            t += n
            level = rng.choice([0, rng.uniform(-3, 3)])
        else:
            t += int(rng.exponential(T / 20)) + 30
            n = int(rng.integers(1, 25))
            u[t : t + n] = rng.uniform(-4, 4)
    return u


def linear(rng, T, inputs=1, how=None):
    """Return poles, output (T,) of deviation 1, and inputs (T, k) of a linear plant of order one to three."""
    n = int(rng.integers(1, 4))
    A, u = poles(rng, n), np.stack([excitation(rng, T, how) for _ in range(inputs)], 1)
    x = sum(lfilter(np.r_[0.0, rng.standard_normal(n)], A, u[:, i]) for i in range(inputs))
    return A, x / max(x.std(), 1e-9), u
