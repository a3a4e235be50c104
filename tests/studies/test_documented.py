"""What a documented step says, against the same likelihood put together densely."""

import numpy as np
import pytest
from driftwise_studies.score.documented import EDGE, evidence, months, odds

T, SIZE, RATIO = 60, 6.0, 0.2


def dense(y, X, K):
    """Return the log likelihood of y under s2 K, with flat effects of X and log s2, but for constants."""
    inverse = np.linalg.inv(K)
    information = X.T @ inverse @ X
    left = y - X @ np.linalg.solve(information, X.T @ inverse @ y)
    logs = np.linalg.slogdet(K)[1] + np.linalg.slogdet(information)[1]
    return -0.5 * logs - 0.5 * (len(y) - X.shape[1]) * np.log(left @ inverse @ left)


def test_the_evidence_of_a_step_is_that_of_a_covariance_with_a_step_in_it():
    rng = np.random.default_rng(1)
    X = np.column_stack([months(T), rng.standard_normal(T)])
    y = rng.standard_normal(T) + 0.4 * np.cumsum(rng.standard_normal(T)) + 2.0 * (np.arange(T) >= 40)
    K = RATIO * np.minimum.outer(np.arange(T) + 1.0, np.arange(T) + 1.0) + np.eye(T)
    none, gain = evidence(y, X, RATIO, SIZE)
    assert none == pytest.approx(dense(y, X, K))
    for k in (10, 40, 50):
        s = (np.arange(T) >= k).astype(float)
        assert none + gain[k] == pytest.approx(dense(y, X, K + SIZE * np.outer(s, s)))
    assert not np.isfinite(gain[[0, EDGE, T - EDGE]]).any()


def test_a_record_without_a_step_seldom_has_long_odds():
    """By chance one of a hundred has 100:1, at most, as they say of themselves."""
    loud = 0
    for seed in range(100):
        rng = np.random.default_rng([5, seed])
        y = rng.standard_normal(T) + 0.3 * np.cumsum(rng.standard_normal(T))
        loud += odds(y, np.ones((T, 1)), 30)["by sizes, anywhere"] > np.log(20.0)
    assert loud <= 9  # of 100, where 5 are promised, at 99 %
