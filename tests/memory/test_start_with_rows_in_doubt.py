"""A start that begins with the rows that agree hands back the present row, of which it may take no notice."""

import numpy as np

import driftwise as dw
from driftwise.memory import Setting, resolve
from driftwise.memory.modes import mode
from driftwise.memory.robust_start import open_rows, remember, rows_size
from driftwise.memory.second_start import AGE, begin_with_rows, open_second, second_size, start_again

N = 2


class View:
    """What `begin_with_rows` sees of a regression."""

    def __init__(self, psi):
        self.psi, self.s2 = np.array(psi), 1.0
        self.f, self.b, self.c = np.zeros(N), np.zeros(N), np.zeros(N)


def begun(again=False):
    """Let one begin with rows of which one is wrong; return it, and what it saw."""
    rng = np.random.default_rng(4)
    rows = open_rows(np.zeros(rows_size(N)), N)
    for k in range(rows.y.size):
        psi = rng.standard_normal(N)
        remember(rows, psi, psi @ [1.0, -2.0] + 0.1 * rng.standard_normal() + (5.0 if k == 6 else 0.0))
    memory = resolve(dw.AutoMemory(), Setting(units=np.ones(N), cap=np.full(N, 1e4), is_regression=True))
    second, view = open_second(np.zeros(second_size(N)), N), View(psi if again else [3.0, 4.0])
    theta, unit, P = np.zeros(N), np.ones(N), np.zeros(N * (N + 1) // 2)
    if again:  # as a sample comes, which is the last of the rows
        start_again(memory, second, rows, rows.y[-1], memory.R, 0.0, unit, theta, P, view, 0.0)
    else:
        begin_with_rows(memory, second, rows, theta, unit, P, view, 0.0, 0.0)
    return second, view


def test_a_row_in_doubt_that_is_none_of_those_kept_stays_what_it_is():
    second, view = begun()
    assert second.head[AGE] > 0.0  # it has begun
    np.testing.assert_allclose(mode(second.row, 0, N).theta, [1.0, -2.0], atol=0.2)
    assert view.psi.tolist() == [3.0, 4.0]


def test_the_present_row_is_seen_once():
    np.testing.assert_array_equal(begun(again=True)[0].row, begun()[0].row)
