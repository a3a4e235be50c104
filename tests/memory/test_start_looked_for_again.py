"""A start that is not ahead is looked for again among the last rows; one that is ahead goes on, however old it is."""

import numpy as np
import pytest

import driftwise as dw
from driftwise.memory import Setting, resolve
from driftwise.memory.auto_constants import AHEAD, AT_ONCE, BETWEEN, LEARNING, YOUTH
from driftwise.memory.modes import CHI2, FREEDOM, WEIGHT, mode
from driftwise.memory.robust_start import open_rows, remember, rows_size
from driftwise.memory.second_start import AGE, SCORE, open_second, second_size, start_again

N, SIGMA = 2, 0.1


class View:
    """What it sees of a regression whose sigma^2 is thought to be ``s2``."""

    def __init__(self, psi, s2):
        self.psi, self.s2 = np.array(psi), s2
        self.f, self.b, self.c = np.zeros(N), np.zeros(N), np.zeros(N)


def after(score, age, s2, wrong=(3, 6), more=BETWEEN, R=1.0, evidence=0.0):
    """Let a start of this score and age see the last of some rows; return it."""
    rng = np.random.default_rng(4)
    rows = open_rows(np.zeros(rows_size(N)), N)
    count = rows.y.size
    for k in range(-more, count):
        psi = rng.standard_normal(N)
        remember(rows, psi, psi @ [1.0, -2.0] + SIGMA * rng.standard_normal() + (2.0 if k in wrong else 0.0))
    setting = Setting(np.ones(N), np.full(N, 1e4), dw.models.InverseGamma(0.5, 0.5), is_regression=True)
    memory = resolve(dw.AutoMemory(), setting)
    second, view = open_second(np.zeros(second_size(N)), N), View(psi, s2)
    one = mode(second.row, 0, N)
    one.own[WEIGHT], one.own[FREEDOM], one.own[CHI2], one.D[:] = 1.0, 5.0, 5.0 * s2, 1.0
    second.head[AGE], second.head[SCORE] = age, score
    y = rows.y[(count + more - 1) % count]
    start_again(memory, second, rows, y, R, evidence, np.ones(N), np.zeros(N), np.zeros(N * (N + 1) // 2), view, 0.0)
    return second


def test_one_sample_counts_half_of_what_decides():
    """To all others it is beyond all odds, to this start it is not."""
    assert after(0.0, 20.0, 25.0 * SIGMA**2, (), 1, evidence=-30.0).head[SCORE] == AT_ONCE


def has_begun_with_rows(second):
    return second.head[AGE] == N + LEARNING and second.head[SCORE] == -AHEAD


def test_rows_that_agree_begin_another_start_where_the_one_that_runs_is_no_better():
    second = after(0.5, 20.0, 25.0 * SIGMA**2)
    assert has_begun_with_rows(second)
    np.testing.assert_allclose(mode(second.row, 0, N).theta, [1.0, -2.0], atol=0.2)


@pytest.mark.parametrize(
    "what",
    [
        dict(score=AHEAD + 0.1, s2=25.0 * SIGMA**2),  # it is ahead
        dict(score=0.5, s2=2.0 * SIGMA**2),  # they do not pay for those left out
        dict(score=0.5, s2=25.0 * SIGMA**2, wrong=()),  # all agree
        dict(score=0.5, s2=25.0 * SIGMA**2, more=BETWEEN + 1),  # it is not time
        dict(score=0.5, s2=25.0 * SIGMA**2, R=2.0),  # no row is kept
    ],
)
def test_else_it_goes_on(what):
    assert not has_begun_with_rows(after(age=20.0, **what))


@pytest.mark.parametrize("score, goes_on", [(AHEAD - 0.5, False), (AHEAD + 0.5, True)])
def test_one_that_is_ahead_goes_on_however_old(score, goes_on):
    assert (after(score, N + LEARNING + YOUTH, SIGMA**2, (), 1).head[AGE] > N + LEARNING + YOUTH) == goes_on
