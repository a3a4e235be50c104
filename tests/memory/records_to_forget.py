"""Records and detectors for tests of memories."""

import numpy as np

import driftwise as dw


def record(samples=400, seed=3):
    return dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=samples, noise_std=0.3, noise="equation", seed=seed)


def excite(seed, samples=300, N=3):
    """Regressors and an output of a regression."""
    rng = np.random.default_rng(seed)
    phi = rng.standard_normal((samples, N))
    return phi, phi @ np.arange(1.0, N + 1) + 0.5 * rng.standard_normal(samples)
