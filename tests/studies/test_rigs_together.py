"""Rigs whose columns change together: what is drawn, what is counted, and the evidence against Gauss's own."""

from __future__ import annotations

from collections import Counter

import numpy as np
from driftwise_studies.score.claims.rigs_together import ALONE, KNOWN, OWN, count, drawn, table

from driftwise.analysis.together_evidence import SIZES, blocks, likelihoods, white_shapes
from driftwise.analysis.together_noise import TINY, covariances, noises, shapes_of
from driftwise.analysis.together_white import FOLLOWS, seen, whitened


def test_a_fault_is_the_only_difference():
    for kind, fewest in ((OWN, 2), (ALONE, 1)):
        faulty, steady = (drawn(2, 3, kind, is_faulty) for is_faulty in (True, False))
        assert faulty.columns.shape == steady.columns.shape
        assert np.count_nonzero(faulty.sizes) >= fewest
        assert not steady.sizes.any()
    assert np.count_nonzero(faulty.sizes) == 1


def test_what_is_told_is_counted():
    seen = Counter()
    count(drawn(11, 4, KNOWN, True), seen)
    assert seen["told"] == seen["dated"] == 1
    assert seen["moved"] == seen["named"] >= 4
    assert f"| {KNOWN} | 1 | " in table(11, 1, (KNOWN,))


def test_the_evidence_is_that_of_gauss_of_a_level_and_a_size_that_nobody_knows():
    n, k, v = 64, 1234, SIZES[0]
    shapes, grid = shapes_of(n), noises(n)
    x = blocks(np.random.default_rng(1).standard_normal(512).cumsum(), n)
    white = whitened(x[:, None])
    x = white.X[:, 0]
    shape = shapes.shape(k, n)
    for i, (K, _) in enumerate(covariances(n)):
        if i % 40:
            continue
        K = K / (np.trace(K) / n - K.mean()) + TINY * np.eye(n)
        beside, none = (_marginal(x, S) for S in (K + v * np.outer(shape, shape), K))
        along, whole = shapes.of_steps(white.along[0, :, i])[[k]], white.gram[i, 0, 0]
        found = likelihoods(whole, grid.free[[k], i], along**2, v, n - 1)[0] + 0.5 * (n - 1) * np.log(whole)
        assert abs(found - (beside - none)) < 1e-3 * max(1.0, abs(found))


def _marginal(x, S) -> float:
    """Return the log likelihood over level and variance, but for what does not depend on S."""
    inverse = np.linalg.inv(S)
    one = inverse.sum(axis=1)
    left = x @ inverse @ x - (one @ x) ** 2 / one.sum()
    return -0.5 * np.linalg.slogdet(S)[1] - 0.5 * np.log(one.sum()) - 0.5 * (len(x) - 1) * np.log(left)


def test_beside_others_it_is_that_of_gauss_where_their_coefficients_are_as_likely_as_gauss_says():
    n, k, v, freedom = 64, 4321, SIZES[1], 63
    rng = np.random.default_rng(2)
    shapes, shape = shapes_of(n), shapes_of(n).shape(k, n)
    white = whitened(rng.standard_normal((n, 4)).cumsum(axis=0))
    x, others = white.X[:, 1], white.X[:, [0, 2, 3]]
    by = seen(white, 1, (0, 2, 3))
    along, free = white_shapes(by, n, [k])
    logs = by.constant + likelihoods(by.whole, free, along**2, v, freedom)[0]
    none = by.constant - 0.5 * freedom * np.log(by.whole)
    assert shapes.of_steps(by.others[0], [k]).shape == along.shape == free.shape == (1, len(none))
    for i, (K, _) in enumerate(covariances(n)):
        if i % 40:
            continue
        K = K / (np.trace(K) / n - K.mean()) + TINY * np.eye(n) + FOLLOWS * others @ others.T
        with_it, without = (_marginal(x, S) for S in (K + v * np.outer(shape, shape), K))
        assert abs(logs[i] - none[i] - (with_it - without)) < 2e-3 * max(1.0, abs(with_it - without))
