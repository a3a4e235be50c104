"""The data of the benchmarks: a stable third-order plant with an input and a direct term."""

from __future__ import annotations

import numpy as np

import driftwise as dw

VARIANCE = 0.01


def record(samples: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Return y and u."""
    return dw.simulate([-1.5, 0.9, -0.3], [1.0, 0.5, 0.2], direct=0.1, samples=samples, noise_std=0.1, seed=seed)


def joint(noise: str, **options) -> dw.Joint:
    """Return Joint(3), N = 10 by default, its noise known so that the opponents compute the same."""
    kinds = {"EquationError": dw.models.EquationError, "OutputError": dw.models.OutputError}
    return dw.Joint(3, **{"inputs": 1, "direct": True, **options}, noise=kinds[noise](VARIANCE))
