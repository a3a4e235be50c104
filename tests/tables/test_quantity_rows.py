"""Tables of data bases and historians: one quantity a row, named by a column, read as one column each."""

from datetime import datetime, timedelta

import numpy as np
import pytest

from driftwise.tables.autoread import read

SAMPLES = 300
RNG = np.random.default_rng(7)
HEATER = np.repeat(RNG.integers(1, 6, SAMPLES // 10), 10) * 10.0
OVEN = 20 + np.convolve(HEATER, 0.05 * 0.9 ** np.arange(60))[:SAMPLES] + 0.1 * RNG.normal(size=SAMPLES)
STAMPS = [f"{datetime(2024, 3, 14) + timedelta(seconds=30 * k)}" for k in range(SAMPLES)]


def rows_of(tag, values, unit):
    return [f"{stamp},{tag},{value:.3f},{unit}" for stamp, value in zip(STAMPS, values)]


def read_back(folder, header, rows):
    (path := folder / "export.csv").write_text("\n".join([header, *rows]) + "\n")
    table, segments = read(path)
    return table, [np.concatenate(part) for part in zip(*segments)]


@pytest.mark.parametrize("order", ["one below the other", "row by row"])
def test_quantities_stand_side_by_side_with_their_units(tmp_path, order):
    heater, oven = rows_of("heater", HEATER, "W"), rows_of("oven temperature", OVEN, "degC")
    rows = [*heater, *oven] if order == "one below the other" else [row for pair in zip(oven, heater) for row in pair]
    table, (_, y, u) = read_back(tmp_path, "_time,_field,_value,unit", rows)
    assert (table.output, table.inputs, table.dt) == ("oven temperature", ("heater",), 30.0)
    assert table["oven temperature"].unit == "°C" and table["heater"].unit == "W"
    np.testing.assert_allclose(y, OVEN, atol=6e-4)
    np.testing.assert_array_equal(u[:, 0], HEATER)
    assert any("names 2 quantities" in note for note in table.notes)


def test_a_quantity_that_was_not_taken_is_missing_and_others_stay_where_they_were(tmp_path):
    heater, oven = rows_of("heater", HEATER, "W"), rows_of("temperature", OVEN, "degC")
    _, (_, y, u) = read_back(tmp_path, "time,Tag,Value,uom", [*heater, *oven[:100], *oven[103:]])
    assert np.flatnonzero(np.isnan(y)).tolist() == [100, 101, 102] and np.isfinite(u).all()


def test_one_quantity_of_several_places_stays_a_column(tmp_path):
    rows = [row for pair in zip(rows_of("A", OVEN, "m"), rows_of("B", OVEN + 5, "m")) for row in pair]
    table, (_, y, _) = read_back(tmp_path, "time,station,level,unit", rows)
    assert table.output == "level" and any("names 2 recordings" in note for note in table.notes)
    np.testing.assert_allclose(y, OVEN, atol=6e-4)


def test_of_quantities_with_times_of_their_own_one_is_read(tmp_path):
    rows = sorted([*rows_of("heater", HEATER, "W")[:-1:4], *rows_of("temperature", OVEN, "degC")[1::2]])
    table, (_, y, _) = read_back(tmp_path, "time,tag,value,unit", rows)
    assert (table.output, table.dt) == ("value", 60.0) and any("'temperature' alone" in note for note in table.notes)
    np.testing.assert_allclose(y, OVEN[1::2], atol=6e-4)
