"""Rigs with a fault that moves several columns: what is drawn, and that the likelihood of its date is that of Gauss."""

import numpy as np
from driftwise_studies.score.claims.common_dates import COLUMNS, dated, evidence, rig
from scipy.stats import multivariate_normal


def test_a_fault_is_the_only_difference_and_is_dated():
    faulty, steady = (rig(3, 1, is_faulty) for is_faulty in (True, False))
    moved = faulty.columns - steady.columns
    assert moved.shape[0] == COLUMNS and not moved[:, : faulty.first].any()
    assert np.array_equal(moved.any(axis=1), faulty.sizes != 0)
    assert dated(faulty, sum(evidence(faulty, j)[1] for j in range(COLUMNS))) == (True, True)
    assert dated(steady, sum(evidence(steady, j)[1] for j in range(COLUMNS)))[0] is False


def test_the_evidence_is_that_of_two_gaussians():
    one = rig(3, 2, True)
    covariance = one.roots[0] @ one.roots[0].T + 1e6 * np.ones((len(one.shapes),) * 2)  # a level that nobody knows
    gauss = multivariate_normal(np.zeros(len(covariance)), covariance, allow_singular=True)
    for k in (0, len(one.dates) // 2):
        ratio = gauss.logpdf(one.columns[0] - one.sizes[0] * one.shapes[:, k]) - gauss.logpdf(one.columns[0])
        assert abs(evidence(one, 0)[0][k] - ratio) < 0.01 * abs(ratio) + 0.05
