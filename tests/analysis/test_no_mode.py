"""A mode is told of an output that has a memory, not of the roots that noise has."""

import numpy as np

import driftwise as dw
from driftwise.analysis.claims import has_memory


def test_noise_has_no_mode():
    """Of thirty records of white noise and an AR(5) of each, the roots of almost none are told."""
    told = []
    for seed in range(30):
        y = np.random.default_rng(seed).standard_normal(400)
        est = dw.AR(5, offset=True)
        told.append(has_memory(est.model_of(est.scan(y).state)))
    assert sum(told) <= 1


def test_an_oscillation_has_one():
    rng, y = np.random.default_rng(1), np.zeros(400)
    for t in range(2, 400):
        y[t] = 1.6 * y[t - 1] - 0.8 * y[t - 2] + rng.standard_normal()
    est = dw.AR(5, offset=True)
    assert has_memory(est.model_of(est.scan(y).state))
    assert "Oscillation of period" in dw.identify({"y": y}, output="y").words
