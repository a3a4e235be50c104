"""What a verdict allows chance: both sides of a comparison are estimates; a real difference is seen all the same."""

import numpy as np
from driftwise_studies.papers.verdict import Estimate

PAIRS = 4000


def drawn(records, seed, scale=1.0):
    return scale * np.random.default_rng(seed).exponential(size=(PAIRS, records))


def kept(n, m, scale=1.0):
    """How often medians of n records agree with those that others had from m, and how often a fixed 35 % holds."""
    mine, listed = drawn(n, 1, scale), np.median(drawn(m, 2), axis=1)
    agree, fixed = 0, 0
    for samples, expected in zip(mine, listed):
        got = Estimate.median(samples)
        agree += got.is_at_most(got.expected(expected, m))
        fixed += got.value <= 1.35 * expected
    return agree / PAIRS, fixed / PAIRS


def test_two_honest_medians_agree_whatever_their_numbers_of_records():
    """Three standard errors, one side: 99.87 % of normal differences; a standard error from ranks is itself rough."""
    for n, m in ((150, 100), (100, 100), (30, 100), (600, 100)):
        agree, _ = kept(n, m)
        assert agree > 0.98, (n, m)
    assert kept(150, 100)[1] < 0.985  # what a fixed 35 % does not know


def test_errors_two_and_three_times_as_large_are_seen():
    """ln 2 is three and a half of 1.44 sqrt(1/150 + 1/100), the standard error of the difference in proportion."""
    assert kept(150, 100, 2.0)[0] < 0.4 and kept(150, 100, 3.0)[0] < 0.03


def test_a_standard_error_by_ranks_is_that_of_the_median():
    samples = drawn(101, 3)
    found = np.array([Estimate.median(row).std for row in samples])
    assert abs(found.mean() / np.median(samples, axis=1).std() - 1) < 0.05


def test_shares_of_none_and_all_are_not_certain():
    none, all_ = Estimate.share(0.0, 100), Estimate.share(1.0, 100)
    assert none.std > 0.005 and abs(all_.std - none.std) < 1e-12
    assert none.agrees(Estimate.share(0.02, 100)) and not none.agrees(Estimate.share(0.2, 100))
    hits = np.random.default_rng(4).binomial(100, 0.3, (PAIRS, 2)) / 100
    agree = np.mean([Estimate.share(a, 100).agrees(Estimate.share(b, 100)) for a, b in hits])
    assert 0.992 < agree < 1.0  # 99.73 % but for the steps of counts
