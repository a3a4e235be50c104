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


def test_lines_with_names_and_values_of_their_own_are_no_header(tmp_path):
    """What a data base of weather puts above the names: names and values of the place, padded or not."""
    said = "Source,Id,City,Unit\nNSRDB,155474,-,w/m2\n"
    rows = "\n".join(f"2017-01-01 {k // 4:02d}:{k % 4 * 15:02d},{k % 7},{y:.3f}," for k, y in enumerate(Y))
    path = tmp_path / "place.csv"
    path.write_text(said + "time,sun,temperature,\n" + rows + "\n")
    assert open_table(path).names[:3] == ("time", "sun", "temperature")


def test_words_between_rows_are_no_header(tmp_path):
    rows = [f"{k},{y:.3f}" for k, y in enumerate(Y)]
    path = tmp_path / "again.csv"
    path.write_text("\n".join(["t,y", *rows[:9], "t,y", *rows[9:]]) + "\n")
    table = open_table(path)
    assert table.names == ("t", "y") and len(table.head["y"]) == 97


def test_months_may_be_six_digits(tmp_path):
    path = tmp_path / "months.csv"
    path.write_text("Date,Value\n" + "\n".join(f"{1951 + k // 12}{k % 12 + 1:02d},{y:.2f}" for k, y in enumerate(Y)))
    table = open_table(path)
    assert table.kinds["Date"] == "stamp" and table.origin("Date").startswith("1951-01-01")


def test_a_long_line_of_json_is_read(tmp_path):
    path = tmp_path / "rows.json"
    path.write_text(
        '{"rows": [' + ", ".join(f'{{"t": {k}, "y": {y}}}' for k, y in enumerate(np.resize(Y, 5000))) + "]}"
    )
    table = open_table(path)
    assert table.names == ("t", "y") and len(table.head["y"]) == 5000


@pytest.mark.parametrize(
    "zone, told", [("-07:00", True), ("+0530", True), ("Z", False), ("", False), ("+00:00", False)]
)
def test_stamps_of_another_zone_are_told_in_utc_and_that_is_said(tmp_path, zone, told):
    rows = "\n".join(f"2019-01-01 {k // 4:02d}:{k % 4 * 15:02d}:00{zone},{y:.3f}" for k, y in enumerate(Y))
    path = tmp_path / "zone.csv"
    path.write_text("time,temperature\n" + rows + "\n")
    notes = " ".join(autoread.read(path)[0].notes)
    assert (f"written in the zone {zone}: dates are told in UTC" in notes) == told


def test_a_column_that_is_mostly_a_code_for_missing_is_no_signal():
    """A logger writes -7999 where a sensor gives nothing, and this one hardly ever gives something."""
    cold = np.where(RNG.random(96) < 0.8, -7999.0, -300.0 - Y)
    table = autoread.read({"t": np.arange(96.0), "Temp a [deg C]": cold, "Temp b [deg C]": Y})[0]
    assert table.output == "Temp b [deg C]"
    assert "of its first 96 values stand for a missing one" in table["Temp a [deg C]"].why


def test_a_column_that_is_measured_every_seventh_row_is_a_signal():
    """The rows between hold a code for a missing value."""
    rare = np.where(np.arange(96) % 7, -9999.0, Y)
    assert autoread.read({"t": np.arange(96.0), "TempOut": rare, "tag118": Y})[0].output == "TempOut"


def test_the_voltage_of_a_motor_in_french_drives():
    signals = {"tension moteur": Y, "position": np.cumsum(Y), "couple": Y[::-1]}
    table = autoread.read(signals)[0]
    assert table.output == "position" and table.inputs == ("tension moteur", "couple")
    assert autoread.read({"roll force": Y, "strip tension": Y[::-1]})[0].output == "strip tension"


def test_parts_of_a_date_without_names_drive_nothing():
    """Year, day of year, hours and minutes, as loggers write them: a jump at midnight is the clock's."""
    rng = np.random.default_rng(12)
    minutes = np.arange(21 * 60, 21 * 60 + 900)
    heat = np.repeat(rng.integers(0, 2, 90), 10) * 5.5 + 1
    temperature = 20 + np.convolve(heat, 0.1 * 0.9 ** np.arange(60))[:900] + 0.01 * rng.standard_normal(900)
    stamps = [np.full(900, 2010.0), 207.0 + minutes // 1440, minutes % 1440 // 60 * 100.0 + minutes % 60]
    names = [f"column{j + 1}" for j in range(5)]
    table = autoread.read(dict(zip(names, [*stamps, heat, temperature])))[0]
    assert (table.time, table.inputs, table.output) == ("column1", ("column4",), "column5")
    assert [c.why for c in table.columns if c.name in names[1:3]] == ["a part of the dates"] * 2


def test_the_air_is_outside_where_wind_and_sun_are():
    rng = np.random.default_rng(13)
    air, wind, sun = rng.standard_normal((3, 200))
    load = {"load [kW]": rng.standard_normal(200), "air temperature [°C]": air, "wind speed [m/s]": wind}
    assert autoread.read(load)[0].inputs == ("air temperature [°C]", "wind speed [m/s]")
    for beside in ("heater power [W]", "outdoor temperature [°C]"):  # then it is that of a room
        room = {"load [kW]": load["load [kW]"], "air temperature [°C]": air, "solar [W/m2]": sun, beside: wind}
        assert "air temperature [°C]" not in autoread.read(room)[0].inputs
