"""Benches with a fault: what is drawn, and the filter of who knows against Gauss's own density."""

from __future__ import annotations

from collections import Counter

import numpy as np
from driftwise_studies.score.claims.rigs_bench import BOTH, FREE, NOISE, count, drawn, evidence, shape, table
from scipy.linalg import block_diag, toeplitz


def test_a_fault_is_the_only_difference():
    for kind in (BOTH, NOISE):
        faulty, steady = (drawn(3, 1, kind, is_faulty) for is_faulty in (True, False))
        before = slice(0, faulty.first)
        assert np.array_equal(faulty.columns[:, before], steady.columns[:, before])
        assert steady.is_steady
        assert not faulty.is_steady
    assert not faulty.sizes.any()


def test_who_knows_weighs_a_date_as_the_density_does():
    whole = drawn(3, 2, BOTH, True)
    T = 80
    few = [np.flatnonzero((whole.factors != 1) | (whole.sizes != 0))[0], 0, 1][:2]
    cut = {
        name: getattr(whole, name)[few] for name in ("sizes", "factors", "white", "own", "keeps", "follows", "units")
    }
    bench = whole._replace(columns=whole.columns[few, 400 : 400 + T], warm=whole.warm[few, 400 : 400 + T], **cut)
    dates, odds = evidence(bench, bench)
    none, one = (_density(bench, at) for at in (None, dates[1]))
    assert abs(odds[1] - (one - none)) < 1e-6 * abs(one)


def _density(bench, at) -> float:
    """Return the log density of a bench, row by row of one column after the other."""
    T = bench.columns.shape[1]
    moved = np.zeros(T) if at is None else shape(np.arange(T) - at, bench.lasts, bench.length)
    x = bench.columns - bench.warm - bench.columns.mean(axis=1, keepdims=True) - bench.sizes[:, None] * moved
    unit, lag = bench.white, np.arange(T)
    K = block_diag(*(
        (own / w) ** 2 * toeplitz(keep**lag) + FREE + np.diag(factor ** (2 * moved) + (digit / w) ** 2 / 12)
        for own, w, keep, factor, digit in zip(bench.own, unit, bench.keeps, bench.factors, bench.units)
    ))  # fmt: skip
    for keep, load in zip(bench.shared, (bench.follows / unit[:, None]).T):
        K += np.kron(np.outer(load, load), toeplitz(keep**lag))
    z = (x / unit[:, None]).ravel()
    return float(-0.5 * (np.linalg.slogdet(K)[1] + z @ np.linalg.solve(K, z)))


def test_what_is_told_of_a_bench_is_counted():
    seen = Counter()
    count(drawn(0, 4, BOTH, True), seen)
    assert (seen["told"], seen["beside"]) == (1, 0)
    assert f"| {NOISE} | 1 | " in table(0, 1, (NOISE,))
