"""Every fault that a hostile week found: the command that failed, and what it says now."""

import os

import pytest

from hostile.rows import ROWS, tried


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="shells, pipes and limits")
@pytest.mark.parametrize("row", ROWS, ids=[f"{row.number}-{row.fault.replace(' ', '-')}" for row in ROWS])
def test_a_fault_that_was_found_is_gone(row):
    wrong, answer = tried(row)
    assert not wrong, answer
