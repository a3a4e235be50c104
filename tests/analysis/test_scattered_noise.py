"""Noise between samples of which few follow each other, against the dense Gaussian."""

import numpy as np
import pytest

from driftwise.analysis.scattered_noise import bridge, misfits, scattered

RNG = np.random.default_rng(2)
AT = np.sort(RNG.choice(400, 120, replace=False))


@pytest.mark.parametrize("share", [0.0, 2.0])
def test_whitened_is_the_cholesky_factor(share):
    phi = 0.93
    S = phi ** abs(np.subtract.outer(AT, AT)) / (1 - phi * phi) + share * np.eye(len(AT))
    x = RNG.normal(size=(3, len(AT)))
    found = bridge(phi, share, AT)
    np.testing.assert_allclose(found.whitened(x), np.linalg.solve(np.linalg.cholesky(S), x.T).T, atol=1e-9)
    np.testing.assert_allclose(2 * np.log(found.size).sum(), np.linalg.slogdet(S)[1])


def test_misfits_are_those_of_the_same_filter():
    v, time, share = RNG.normal(size=len(AT)), 7.0, 1.5
    found = bridge(np.exp(-1 / time), share, AT)
    wanted = len(AT) * np.log(np.mean(found.whitened(v) ** 2)) + 2 * np.log(found.size).sum()
    assert misfits(v, AT, np.array([time]), np.array([share]))[0] == pytest.approx(wanted)


def test_few_values_are_white():
    assert scattered(np.ones(5), np.arange(5)) == ()
