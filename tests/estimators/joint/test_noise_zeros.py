"""Zeros of the noise polynomial outside and on the circle: the same process, filtered all the same."""

import numpy as np
import pytest

import driftwise as dw

A = [-1.2, 0.5]


def predictions(d, variance, y):
    trace = dw.Joint(2, noise=dw.models.NoisePolynomial(d, variance), P0=100.0).scan(y)
    return trace.prediction, trace


@pytest.mark.parametrize("c", [[-2.5, 1.0], [2.0, 0.0], [0.3, 1.7]])
def test_outside_the_circle_the_filter_works_with_the_reflected_zeros(c):
    """The spectral factor has the same law: after the start both predict the same, and x stays uncertain in one."""
    y, _ = dw.simulate(A, d=c, samples=3000, noise_std=1.0, seed=3)
    d = np.array(c)[::-1]
    inside, gain = dw.models.minimum_phase(d)
    given, trace = predictions(d, 1.0, y)
    reflected, twin = predictions(inside, gain, y)
    assert np.max(abs(given - reflected)[300:]) < 1e-4
    assert np.allclose(trace.variance[300:], twin.variance[300:], rtol=1e-6)
    assert 0.9 < trace.summary().nis < 1.1


def test_on_the_circle_the_variance_falls_as_one_over_t():
    y, _ = dw.simulate(A, d=[-1.0, 0.0], samples=4000, noise_std=1.0, seed=3)
    _, trace = predictions((0.0, -1.0), 1.0, y)
    excess = trace.variance - 1.0
    early, late = np.mean(excess[800:1000]), np.mean(excess[3800:4000])
    assert late < 0.005
    assert 0.15 < late / early < 0.35  # 1/t: 900/3900 = .23
    assert 0.9 < trace.summary().nis < 1.1
