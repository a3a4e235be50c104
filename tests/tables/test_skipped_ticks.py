"""Tables without names, written at some ticks of a clock: its column is known as the clock."""

import numpy as np
import pytest

from driftwise.tables.recognise import recognise


def table(first, seed):
    """Return columns without names: the first as given, a valve and what follows from it."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.integers(0, 2, len(first) // 20 + 1), 20)[: len(first)].astype(float)
    y = np.convolve(u, 0.2 * 0.8 ** np.arange(40))[: len(first)] + 0.05 * rng.standard_normal(len(first))
    return {"column1": first, "column2": u, "column3": y}


def ticks(seed, share):
    return np.flatnonzero(np.random.default_rng([seed, 1]).random(2400) < share)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("tick", [0.02, 15.0, 60.0])
def test_the_clock_of_rows_that_came_at_some_of_its_ticks(tick, seed):
    found = recognise(table(tick * ticks(seed, 0.25 + 0.1 * seed), seed))
    assert found.time == "column1" and found.dt == pytest.approx(tick)


@pytest.mark.parametrize("seed", range(4))
def test_a_meter_and_the_numbers_of_picked_rows_are_none(seed):
    rng = np.random.default_rng([seed, 2])
    meter = np.round(np.cumsum(rng.gamma(4.0, 0.5, 600)), 2)
    assert recognise(table(meter, seed)).time is None
    assert recognise(table(1.0 * ticks(seed, 0.25), seed)).time is None
