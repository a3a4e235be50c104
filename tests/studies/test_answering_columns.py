"""Columns that answer to a hidden fault: what is drawn, and what is counted."""

import numpy as np
from driftwise_studies.score.claims.answering import FAULT, INPUTS, STEADY, answering, do_nothing, told

from driftwise.analysis.segmentation import hindsight


def test_a_fault_moves_the_output_and_the_columns_do_not():
    """Around the fault all move; elsewhere small moves of the columns are nothing to the output of a fault."""
    y, u, first = answering(77, 0, FAULT)
    same, moves, at = answering(77, 0, INPUTS)
    assert at == first and np.array_equal(u, moves) and not np.array_equal(y, same)
    before = slice(0, first)
    high = [abs(np.corrcoef(np.diff(x[before]), np.diff(y[before]))[0, 1]) for x in u.T]
    assert max(high) < 0.25
    assert abs(y[first + 70 : first + 110].mean() - y[before].mean()) > 1.0


def test_what_is_told_near_the_beginning_counts_and_steady_rigs_are_long():
    y, u, first = answering(77, 1, FAULT)
    stepped = hindsight(8 * (np.arange(len(y)) >= first) + 0.1 * y, u[:, :0])
    assert told(FAULT, stepped, first) == (True, 0) and told(FAULT, None, first) == (False, 0)
    assert not do_nothing(stepped) and len(answering(77, 1, STEADY)[0]) == 2000


def test_small_moves_of_columns_that_answer_do_nothing_and_those_of_inputs_do_what_is_said():
    assert do_nothing(hindsight(*answering(0, 5, FAULT)[:2]))
    assert not do_nothing(hindsight(*answering(0, 6, INPUTS)[:2]))
