"""Tables as stations, meters and calculators of power plants write them."""

import numpy as np
import pytest

from driftwise.tables import autoread
from driftwise.tables.table import open_table

RNG = np.random.default_rng(11)
Y = 20 + np.cumsum(RNG.standard_normal(96))


@pytest.mark.parametrize("word", ["hr", "mo", "second"])
def test_a_signal_that_is_called_like_a_part_of_a_date_is_one(word):
    """A heart rate: no hour is 515, and none goes up and down by the sample."""
    table = autoread.read({"timer": np.arange(96) * 8.5, word: 500 + Y})[0]
    assert table.output == word


def test_hours_that_count_are_the_clock():
    assert autoread.read({"hour": np.arange(96.0), "y": Y})[0].time == "hour"


def test_lines_of_what_was_recorded_that_are_padded_are_no_header(tmp_path):
    """A spreadsheet saves as many commas in each line as the widest needs."""
    said = "Report of a plant,,,,\nPlace:,15013 Western Parkway,,,,\nHeight (m):,1819.6,,,,\n,,,,\n"
    rows = "\n".join(f"2024-01-01 {k // 4:02d}:{k % 4 * 15:02d},{k % 7},{y:.3f},1,2" for k, y in enumerate(Y))
    path = tmp_path / "plant.csv"
    path.write_text(said.replace(",,,,,", ",,,,") + "time,heater,temperature,a,b\n" + rows + "\n")
    assert open_table(path).names == ("time", "heater", "temperature", "a", "b")


def test_names_of_groups_stay_a_line_of_the_header(tmp_path):
    rows = "\n".join(f"{k},{y:.3f},{k % 3},1" for k, y in enumerate(Y))
    path = tmp_path / "groups.csv"
    path.write_text("Tank,,Pump,\ntime,level,flow,power\n" + rows + "\n")
    assert open_table(path).names == ("Tank time", "Tank level", "Pump flow", "Pump power")


@pytest.mark.parametrize("zone", ["UTC", "MST", "LST"])
def test_hours_and_minutes_may_be_called_by_their_zone(zone):
    minutes = np.arange(24 * 60)
    clock = {"Year": np.full(len(minutes), 2018), "DOY": np.full(len(minutes), 291)}
    table = open_table(clock | {zone: minutes // 60 * 100 + minutes % 60, "y": np.resize(Y, len(minutes))})
    assert table.calendar["hours and minutes"] == zone
    hours = np.arange(96)
    clock = {"Year": np.full(96, 2018), "DOY": 291 + hours // 24, zone: hours % 24}
    assert open_table(clock | {"y": Y}).calendar["hour"] == zone
