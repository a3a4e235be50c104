"""Noise of an autoregression where samples are missing: innovations are those of the samples that are there."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.signal import lfilter

from driftwise.analysis.interrupted_noise import BACK, gaps
from driftwise.analysis.response_orders import plainest
from driftwise.analysis.response_record import recorded


def covariance(f, samples: int) -> np.ndarray:
    """Return that of the noise, which began long ago, (samples, samples)."""
    answer = lfilter([1.0], np.append(1.0, f), np.eye(1, 4000)[0])
    return toeplitz([answer[: 4000 - k] @ answer[k:] for k in range(samples)])


@pytest.mark.parametrize("f", [[-0.9], [-1.5, 0.6], [-0.4, 0.0, 0.3, -0.2]])
def test_innovations_after_gaps_are_those_of_the_cholesky_factor(f):
    """The whole past of samples that are there, by a factor of their covariance, says what the last few say."""
    rng, T = np.random.default_rng(3), 120
    used = rng.random(T) > 0.25
    used[60 : 60 + BACK // 2] = False
    now = replace(plainest(recorded(np.where(used, rng.normal(size=T), np.nan), np.zeros((T, 0)))[0]), f=np.array(f))
    root = np.linalg.cholesky(covariance(f, T)[np.ix_(used, used)])
    x = rng.normal(size=(2, T))
    exact = np.linalg.solve(root, x[:, used].T).T
    late = now.rows > 40  # begun by nothing, as far as can be seen
    which = np.searchsorted(np.flatnonzero(used), now.rows[late])
    np.testing.assert_allclose(now.whitened(x)[:, late], exact[:, which], atol=0.02)
    np.testing.assert_allclose(now.spread[late], np.diag(root)[which], rtol=0.02)
    assert np.mean(np.isin(np.flatnonzero(used), now.rows)) > 0.95


def test_what_is_missing_says_nothing_whatever_stands_there():
    used = np.ones(50, bool)
    used[[20, 22, 30]] = False
    now = replace(
        plainest(recorded(np.where(used, 0.1, np.nan) * np.arange(50), np.zeros((50, 0)))[0]), f=np.array([-1.2, 0.5])
    )
    x = np.random.default_rng(1).normal(size=50)
    np.testing.assert_allclose(now.whitened(np.where(used, x, 1e3)), now.whitened(x), atol=1e-4)


def test_nothing_is_bridged_where_all_follow_or_nothing_did():
    assert gaps(np.array([-0.5]), np.ones(9, bool)) is None
    assert gaps(np.array([-0.5]), np.arange(40) > 30) is None  # the first ones after a pause longer than is looked back
