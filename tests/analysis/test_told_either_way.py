"""What columns show of a fault is told whether somebody named the output or not."""

from types import SimpleNamespace

import numpy as np
import pytest
from draws import slow

from driftwise.analysis.table_together import apart, together_of
from driftwise.tables.recognise import recognise

ROWS, FIRST = 900, 450


def bench(seed: int, louder: str = "", moved: str = "") -> dict[str, np.ndarray]:
    """Return columns that follow one load, of which one is louder, or moves, from a row on."""
    rng = np.random.default_rng(seed)
    load, late = rng.standard_normal(ROWS).cumsum() / 15, np.arange(ROWS) >= FIRST
    names = {"Current": 1.0, "Voltage": 0.5, "Flow rate": 0.8, "Pressure": 0.4}
    columns = {"time_s": np.arange(ROWS) * 1.0}
    for name, share in names.items():
        noise = rng.standard_normal(ROWS) * np.where(late & (name == louder), 3.0, 1.0)
        columns[name] = share * load + noise + 4 * late * (name == moved)
    return columns


def told(columns, changes=(), **named) -> list[tuple[str, ...]]:
    """Return which columns changed about the row, of all changes that are told."""
    table = recognise(columns, **named)
    found = apart(together_of(columns, table), changes, table.output)
    assert all(abs(one.since - FIRST) < 60 for one in found)
    return [one.names for one in found]


@pytest.mark.parametrize("named", [{}, {"output": "Flow rate"}, {"output": "Flow rate", "inputs": ("Current",)}])
@pytest.mark.parametrize("seed", [0, slow(1)])
def test_noise_of_what_acts_is_told_whatever_was_named(seed, named):
    assert told(bench(seed, louder="Current"), **named) == [("Current",)]


@pytest.mark.parametrize("seed", [0, slow(1)])
def test_a_change_of_the_output_is_told_where_inputs_were_found_that_may_answer(seed):
    columns = bench(seed, moved="Flow rate")
    assert recognise(columns, output="Flow rate").inputs
    assert told(columns, output="Flow rate") == [("Flow rate",)]
    assert not told(columns, output="Flow rate", inputs=())  # the model tells it, or says why it does not


def test_what_the_answer_tells_itself_is_not_told_twice():
    columns = bench(0, moved="Flow rate")
    before, there = SimpleNamespace(times=(200.0, 210.0)), SimpleNamespace(times=(440.0, 470.0))
    assert told(columns, [before], output="Flow rate")
    assert not told(columns, [before, there], output="Flow rate")
