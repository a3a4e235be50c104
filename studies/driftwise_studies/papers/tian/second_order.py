"""Records of y'' + a1 y' + a0 y = b0 u + q under a square wave: the family of plants that is identified."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

THIS = "this package's study of algebraic identification"
PERIOD = 2.0  # s, of the square wave


class Records(NamedTuple):
    """Plants of one family, one a row, and their noise-free outputs."""

    a: np.ndarray  # (S, 2): a1, a0
    b: np.ndarray  # (S,): b0
    u: np.ndarray  # (T,), held between samples
    y: np.ndarray  # (S, T)
    noise: np.ndarray  # (S, T), of standard deviation one

    @property
    def parameters(self) -> np.ndarray:
        """a0, a1, b0 of each plant, (S, 3)."""
        return np.column_stack([self.a[:, ::-1], self.b])


def records(seeds: int, h: float, samples: int, base: int = 0) -> Records:
    """Return records of plants drawn from a0 in [1, 9], a1 in [.3, 1.5], b0 in [1, 4], q and the state in [-1, 1]."""
    a, b, q, x, noise = np.empty((seeds, 2)), np.empty(seeds), np.empty(seeds), np.empty((seeds, 2)), []
    for s in range(seeds):
        rng = np.random.default_rng(base + s)
        a[s] = rng.uniform(0.3, 1.5), rng.uniform(1.0, 9.0)
        b[s], q[s], x[s] = rng.uniform(1.0, 4.0), rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0, 2)
        noise.append(rng.standard_normal(samples))
    u = square(samples, h)
    return Records(a, b, u, outputs(a, b, q, x, u, h), np.array(noise))


def square(samples: int, h: float) -> np.ndarray:
    """Return the square wave, +1 first, (T,)."""
    return np.where(np.arange(samples) // round(PERIOD / 2 / h) % 2 == 0, 1.0, -1.0)


def outputs(a, b, q, x, u, h: float) -> np.ndarray:
    """Return exact samples (S, T) of z1' = -a1 z1 + z2, z2' = -a0 z1 + b0 u + q, y = z1, from the states x (S, 2)."""
    F = np.zeros((len(a), 3, 3))
    F[:, :2, 0], F[:, 0, 1], F[:, 1, 2] = -a, 1.0, 1.0
    E, y = expm(F * h)[:, :2], np.empty((len(a), len(u)))
    for t, held in enumerate(u):
        y[:, t] = x[:, 0]
        x = np.einsum("sij,sj->si", E, np.column_stack([x, b * held + q]))
    return y
