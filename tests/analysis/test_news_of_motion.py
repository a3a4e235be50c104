"""That a body turns or climbs is no news of its record; what else is on board may be."""

from __future__ import annotations

import numpy as np
import pytest
from draws import slow

from driftwise.analysis.table_together import together_of
from driftwise.tables.recognise import recognise

ROWS, EARLIER, FIRST = 900, 250, 450


def voyage(seed: int, oil: float = 0.0) -> dict[str, np.ndarray]:
    """Return the record of a ship: faster and heeling more from a row on; its oil may lose pressure before."""
    rng = np.random.default_rng(seed)
    late = np.arange(ROWS) >= FIRST
    speed = 6 + 2 * late + 0.2 * rng.standard_normal(ROWS)
    east, north = (np.cumsum(speed * part) * 1e-5 for part in (0.6, 0.8))
    return {
        "time_s": np.arange(ROWS) * 1.0,
        "latitude_deg": 48 + north,
        "longitude_deg": 2 + east,
        "speed_mps": speed,
        "roll_deg": 3 * late + 0.3 * rng.standard_normal(ROWS),
        "oil pressure_bar": 4 - oil * (np.arange(ROWS) >= EARLIER) + 0.05 * rng.standard_normal(ROWS),
    }


def told(columns) -> list[tuple[str, ...]]:
    return [one.names for one in together_of(columns, recognise(columns))]


@pytest.mark.parametrize("seed", [0, slow(1)])
def test_a_turn_is_no_news_of_a_body_that_moves(seed):
    assert not told(voyage(seed))


@pytest.mark.parametrize("seed", [0, slow(1)])
def test_what_else_is_on_board_is_news(seed):
    assert told(voyage(seed, oil=0.5)) == [("oil pressure_bar",)]


@pytest.mark.parametrize("seed", [0, slow(1)])
def test_the_same_is_news_of_a_bench_that_stands_still(seed):
    columns = voyage(seed)
    columns["latitude_deg"][:] = 48.0
    columns["longitude_deg"][:] = 2.0
    (names,) = told(columns)
    assert {"speed_mps", "roll_deg"} & set(names)
