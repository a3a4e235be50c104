"""Lines of serial monitors, topics, ROS and spreadsheets: rows that are there and rows that are none; one oven."""

import numpy as np
import pytest

from driftwise.engine.errors import InputError
from driftwise.tables.autoread import read
from driftwise.tables.table import open_table

SAMPLES = 240
RNG = np.random.default_rng(29)
U = np.repeat(RNG.integers(0, 5, SAMPLES // 20), 20) * 10.0
Y = 21 + np.convolve(U, 0.05 * 0.92 ** np.arange(90))[:SAMPLES] + 0.1 * RNG.normal(size=SAMPLES)
ROWS = range(SAMPLES)


def understood(path, lines):
    path.write_text("\n".join(lines) + "\n")
    table, segments = read(path)
    parts = list(segments)
    y, u = (np.concatenate([part[j] for part in parts]) for j in (1, 2))
    assert np.allclose(y, Y, atol=1e-2) and u[:, 0].tolist() == U.tolist()
    return table


@pytest.mark.parametrize("cut", [",", "\t", " "], ids=["commas", "tabs", "blanks"])
@pytest.mark.parametrize("is_named", [True, False], ids=["named", "nameless"])
def test_times_of_a_serial_monitor_are_a_clock(tmp_path, cut, is_named):
    lines = [f"09:{k // 60:02d}:{k % 60:02d}.000 -> {U[k]:.0f}{cut}{Y[k]:.2f}" for k in ROWS]
    table = understood(tmp_path / "monitor.txt", ([f"09:00:00.000 -> heater{cut}temp"] if is_named else []) + lines)
    names = ("time", "heater", "temp") if is_named else ("column1", "column2", "column3")
    assert (table.time, table.inputs[0], table.output) == names and table.dt == 1.0


@pytest.mark.parametrize("at", ["{:.0f}", "2024-05-05T08:{0[0]:02.0f}:{0[1]:02.0f}"], ids=["seconds", "stamps"])
def test_topics_without_a_header_are_columns(tmp_path, at):
    lines = []
    for k in ROWS:
        stamp = at.format((k // 60, k % 60)) if "[" in at else at.format(1_714_896_000 + k)
        lines += [f"{stamp} home/oven/heater {U[k]:.1f}", f"{stamp} home/oven/temp {Y[k]:.3f}"]
    table = understood(tmp_path / "topics.txt", lines)
    assert (table.output, table.inputs, table.dt) == ("home/oven/temp", ("home/oven/heater",), 1.0)


@pytest.mark.parametrize("part, digits", [("nanosec", 9), ("nsecs", 9), ("usec", 6)])
def test_seconds_and_their_fractions_are_one_clock(tmp_path, part, digits):
    whole = part.replace("nano", "").removeprefix("n").removeprefix("u")
    rest = [f"{k % 4 * 25 * 10 ** (digits - 2) + 12}" for k in ROWS]
    rows = [f"{1_714_896_000 + k // 4},{rest[k]},oven,{U[k]:.0f},{Y[k]:.3f}" for k in ROWS]
    header = f"stamp.{whole},stamp.{part},frame_id,heater.data,temperature.data"
    table = understood(tmp_path / "bag.csv", [header, *rows])
    assert (table.time, table.dt, table.timed) == (f"stamp.{whole}", pytest.approx(0.25), True)
    assert any("are fractions of the seconds" in note for note in table.notes)


def test_what_does_not_stay_below_a_second_is_no_fraction(tmp_path):
    path = tmp_path / "two.csv"
    path.write_text("run.sec,run.ms,temp\n" + "\n".join(f"{k},{40 * k},{Y[k]:.2f}" for k in ROWS) + "\n")
    assert open_table(path).names == ("run.sec", "run.ms", "temp")


@pytest.mark.parametrize("cut", [",", ";"])
def test_averages_below_the_rows_are_no_samples(tmp_path, cut):
    rows = [cut.join((f"{k + 1}", f"{k}", f"{U[k]:.0f}", f"{Y[k]:.2f}")) for k in ROWS]
    closing = [cut.join((name, "", f"{U.mean():.2f}", f"{Y.mean():.2f}")) for name in ("Average", "Max.")]
    lines = [cut.join(("No.", "Time (s)", "Heater (%)", "Temp (°C)")), *rows, cut * 3, *closing, cut * 3]
    table = understood(tmp_path / "report.csv", lines)
    assert table.notes[0] == "Lines below the rows are no samples: 'Average' and 'Max.' left out."


def test_a_name_among_words_is_a_row(tmp_path):
    path = tmp_path / "people.csv"
    path.write_text("who,t,y\n" + "\n".join(f"{('Ann', 'Max')[k % 2]},{k},{Y[k]:.2f}" for k in ROWS) + "\n")
    assert len(open_table(path).head["y"]) == SAMPLES


def test_settings_beside_the_first_rows_are_no_signal(tmp_path):
    """A scope that writes what it was set to left of time and voltage."""
    left = ["Record Length,2.4e+02", "Sample Interval,4.0e-04", "Trigger Point,0", ",", "Source,CH1", "Probe,10"]
    rows = [f"{left[k] if k < len(left) else ','},,{-0.02 + 4e-4 * k:.9f}, {Y[k]:.5f}," for k in ROWS]
    path = tmp_path / "scope.csv"
    path.write_text("\n".join(rows) + "\n")
    table = read(path)[0]
    assert (table.output, table.time, table.inputs) == ("column5", "column4", ())
    assert table["column2"].why == "no value after row 6"


def test_kinds_of_rows_that_are_mixed_are_not_read_as_one(tmp_path):
    path = tmp_path / "flight.log"
    lines = [
        line for k in ROWS for line in (f"TEMP, {k * 1000}, {U[k]}, {Y[k]:.3f}", f"IMU, {k * 1000}, 0.1, 0.2, 9.8")
    ]
    path.write_text("\n".join(["FMT, 128, 89, FMT, BBnNZ, Type", *lines]) + "\n")
    with pytest.raises(InputError, match=r"mixed, each with cells of its own \(IMU with 5, TEMP with 4\)"):
        open_table(path)
