"""Rows that contradict the others are found, and another start begins with those that agree."""

import itertools

import numpy as np
import pytest

import driftwise as dw
from driftwise.memory.auto_constants import AGREE
from driftwise.memory.robust_start import fit_trimmed, open_rows, remember, rows_size, says_enough, smallest

N = 2
COUNT = 3 * N + 10


def kept(psi, y, more=0):
    """Return the rows that agree, and the fit to them; ``more`` rows came before."""
    rows = open_rows(np.zeros(rows_size(psi.shape[1])), psi.shape[1])
    for row, value in zip(psi[-more:] if more else (), y[-more:]):
        remember(rows, 10.0 * row, -value)
    for row, value in zip(psi, y):
        remember(rows, row, value)
    limit, many = fit_trimmed(rows, np.ones(psi.shape[1]), np.empty(psi.shape[1] * (psi.shape[1] + 1) // 2))
    found = np.roll(rows.square <= limit, -more)
    assert found.sum() == many
    return found, rows.x.copy(), rows.fit.copy()


def test_the_largest_of_the_smallest_is_found_whatever_their_order_and_where_some_are_equal():
    rng, rows = np.random.default_rng(3), open_rows(np.zeros(rows_size(N)), N)
    for squares in (rng.random(COUNT), rng.integers(0, 4, COUNT), np.zeros(COUNT), np.arange(COUNT)[::-1]):
        rows.square[:] = squares
        assert [smallest(rows, many) for many in range(1, COUNT + 1)] == sorted(squares)
    rows.square[:] = np.nan
    assert smallest(rows, 3) == np.inf


def drawn(seed, wrong):
    """Return rows, what they say, and which are wrong."""
    rng = np.random.default_rng(seed)
    psi, bad = rng.standard_normal((COUNT, N)), np.zeros(COUNT, bool)
    bad[rng.choice(COUNT, wrong, replace=False)] = True
    y = psi @ [1.0, -2.0] + 0.1 * rng.standard_normal(COUNT) + np.where(bad, rng.choice([-2.0, 2.0], COUNT), 0.0)
    return psi, y, bad


@pytest.mark.parametrize("wrong", [1, 3, 4])
def test_wrong_rows_are_left_out_and_the_others_fitted(wrong):
    right = 0
    for seed in range(100):
        psi, y, bad = drawn(seed, wrong)
        found, x, _ = kept(psi, y)
        if np.array_equal(found, ~bad):
            right += 1
            np.testing.assert_allclose(x, [1.0, -2.0], atol=0.2)  # five deviations
    assert right >= 80  # a right row now and then lies beyond four deviations that so few rows tell


def test_the_best_fit_is_near_that_of_all_subsets():
    """Least trimmed squares by trying all pairs of rows, each with two steps: at least as good in nine of ten."""
    half, as_good = int(AGREE * COUNT), 0
    for seed in range(40):
        psi, y, _ = drawn(seed, 4)
        best = np.inf
        for pair in itertools.combinations(range(COUNT), N):
            rows = list(pair)
            for _ in range(3):
                x = np.linalg.lstsq(psi[rows], y[rows], rcond=None)[0]
                squares = (y - psi @ x) ** 2
                rows = np.argsort(squares)[:half]
            best = min(best, np.sort(squares)[:half].sum())
        _, _, fit = kept(psi, y)
        as_good += np.sort((y - psi @ fit) ** 2)[:half].sum() <= 1.5 * best
    assert as_good >= 36


def test_only_the_last_rows_count():
    psi, y, _ = drawn(1, 3)
    once, again = kept(psi, y), kept(psi, y, more=5)
    assert np.array_equal(once[0], again[0])
    np.testing.assert_allclose(once[1], again[1], rtol=1e-9)


def test_no_row_is_left_out_where_none_is_wrong():
    assert sum(kept(*drawn(seed, 0)[:2])[0].all() for seed in range(100)) >= 85


def test_rows_that_alone_speak_of_a_parameter_are_not_wrong_ones():
    """A load that is switched ten times in four hundred samples, by which alone its resistance is known."""
    rng = np.random.default_rng(3)
    step = np.zeros(400)
    step[20::40] = rng.choice([-30.0, 30.0], 10)
    y = np.cumsum(1e-3 * rng.standard_normal(400)) + 2e-2 * step
    est = dw.Regression(2, memory=dw.AutoMemory())
    trace = est.scan(np.diff(y), np.column_stack([step[1:], rng.standard_normal(399)]))
    assert abs(trace.parameters[-1, 0] - 2e-2) < 2e-3
    rows = open_rows(np.zeros(rows_size(N)), N)
    for k in range(COUNT):
        remember(rows, np.array([10.0 * (k == 5), 1.0 + k % 3]), 7.0 * (k == 5) + (1.0 + k % 3))
    limit, many = fit_trimmed(rows, np.ones(N), np.empty(3))
    assert many == COUNT or not says_enough(rows, limit)


def test_wrong_numbers_among_the_first_samples_cost_less():
    """Errors over those of who is told which are wrong, geometric mean: 1.32 if nothing begins with what agrees."""
    a, b, ratios = np.array([-1.2, 0.6, -0.2]), np.array([1.0, 0.5, 0.2]), []
    est, truth = dw.ARX(3, 3, memory=dw.AutoMemory()), np.concatenate([a, b])
    for seed in range(400):
        y, u = dw.simulate(a, b, samples=200, noise_std=0.1, seed=seed)
        rng = np.random.default_rng(1000 + seed)
        at = 6 + rng.choice(40, 2, replace=False)
        y[at] += rng.choice([-2.0, 2.0], 2)
        told = y.copy()
        told[at] = np.nan
        mine, known = (((est.scan(z, u).parameters[50:] - truth) ** 2).mean() for z in (y, told))
        ratios.append(np.log(mine / known) / 2)
    assert np.exp(np.mean(ratios)) < 1.27
