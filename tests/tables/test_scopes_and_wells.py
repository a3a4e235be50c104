"""Lines above the rows of scopes, loggers and well logs: names, units, the interval; the same oven in each."""

import numpy as np
import pytest

from driftwise.tables.autoread import read
from driftwise.tables.said_interval import interval_of
from driftwise.tables.table import open_table

SAMPLES = 300
RNG = np.random.default_rng(23)
U = np.repeat(RNG.integers(0, 5, SAMPLES // 20), 20) * 10.0
Y = 21 + np.convolve(U, 0.05 * 0.92 ** np.arange(90))[:SAMPLES] + 0.1 * RNG.normal(size=SAMPLES)
ROWS = range(SAMPLES)


def pairs(form, begin=0.0, step=1.0):
    return [form.format(t=begin + step * k, k=k, u=U[k], y=Y[k]) for k in ROWS]


# lines, (output, inputs, s between rows), the clock
WRITTEN = {
    "an increment to the right of the names": (
        ["X,CH1,CH2,Start,Increment,", "Sequence,Volt,Volt,-1.0e-03,5.0e-06", *pairs("{k},{u:.2e},{y:.4e},")],
        ("CH2", ("CH1",), 5e-6), None,
    ),
    "units in words, a comma at the end": (
        ["X,CH1,CH2,", "Second,Volt,Volt,", *pairs("{t:.7e},{u:.2e},{y:.4e},", -6e-6, 2e-8)],
        ("CH2", ("CH1",), 2e-8), "X",
    ),
    "seconds that count by one": (
        ["X,CH1,CH2", "Second,Volt,Volt", *pairs("{t:.0f},{u:.2e},{y:.4e}")], ("CH2", ("CH1",), 1.0), "X",
    ),
    "settings as wide as the table": (
        ['"Sampling Frequency (Hz)=",50', '"Channel Data","CH 1","CH 2"', '"Scale (V/DIV) = ",0.1,2',
         '"Inverted = ","NO","NO"', '"Time (s)","Current (A)","Speed (rpm)"',
         *pairs("{t:.3f},{u:.1f},{y:.4f}", 0, 0.02)],
        ("Speed (rpm)", ("Current (A)",), 0.02), "Time (s)",
    ),
    "LabVIEW without times": (
        ["LabVIEW Measurement\t", "X_Columns\tNo\t", "***End_of_Header***\t", "\t", "Samples\t300\t300\t",
         "Delta_X\t0.500000\t0.500000\t", "***End_of_Header***\t\t\t", "X_Value\tHeater\tTemperature\tComment",
         *pairs("\t{u:.6f}\t{y:.6f}\t")],
        ("Temperature", ("Heater",), 0.5), None,
    ),
    "LabChart": (
        ["Interval=\t10 ms", "ExcelDateTime=\t4.5e+04\t03/05/24 09:12:07", "ChannelTitle=\tHeater\tOven",
         "Range=\t100 %\t100 °C", *pairs("{k}\t{u:.1f}\t{y:.4f}")],
        ("Oven", ("Heater",), 0.01), None,
    ),
    "times of day above the rows": (
        ["TraceName,CH1,CH2", "SampleRate,20,20", "Date,2024/03/05,2024/03/05", "Time,09:12:07,09:12:07", "",
         *pairs(",{u:.4f},{y:.4f},")],
        ("column3", ("column2",), 0.05), None,
    ),
    "a sign apart": (
        ["Number,Date&Time,Heater,Oven", "NO.,Time,%,degC",
         *(f"{k + 1},2024/03/05 09:{k // 60:02d}:{k % 60:02d},+{U[k]:8.2f},+{Y[k]:8.2f}" for k in ROWS)],
        ("Oven", ("Heater",), 1.0), "Date&Time",
    ),
    "a well log": (
        ["~VERSION INFORMATION", " VERS.  1.2: CWLS", "~CURVE INFORMATION", " DEPT .M : 1 DEPTH", " DT .US/M : 2 SONIC",
         " GR .API : 3 RAY", "~A  TIME_s  HEATER  TEMP", *pairs("{t:9.1f} {u:9.2f} {y:9.3f}", 5, 2)],
        ("TEMP", ("HEATER",), 2.0), "TIME_s",
    ),
}  # fmt: skip


@pytest.mark.parametrize("how", WRITTEN)
def test_what_stands_above_the_rows(tmp_path, how):
    lines, known, clock = WRITTEN[how]
    path = tmp_path / "oven.txt"
    path.write_text("\n".join(lines) + "\n")
    table, segments = read(path)
    assert (table.output, table.inputs, pytest.approx(table.dt)) == known and table.timed
    assert table.time == clock
    assert sum(len(y) for _, y, _ in segments) == SAMPLES


def test_an_interval_is_said_where_no_clock_tells_it(tmp_path):
    path = tmp_path / "no_times.csv"
    path.write_text("Sample Interval,2 ms\nheater,temp\n" + "\n".join(pairs("{u},{y:.3f}")) + "\n")
    table = read(path)[0]
    assert "Samples are 0.002 s apart, as the lines above the rows say." in table.notes
    assert "rows are samples 0.002 s apart" in table.words


@pytest.mark.parametrize(
    "line",
    [["Sample Interval", "0"], ["Sample Rate", "fast"], ["Delta_X", "1", "2"], ["Interval", "7"], ["Interval", "1 m"]],
    ids=" ".join,
)
def test_what_is_no_interval_says_none(line):
    assert interval_of([line]) is None


def test_scales_print_a_sign_apart_and_a_unit(tmp_path):
    path = tmp_path / "scale.txt"
    path.write_text("\n".join(f"ST,GS,{'+-'[k % 9 == 0]}{Y[k]:9.3f}kg" for k in ROWS) + "\n")
    table = open_table(path)
    assert table.source.units == {"column3": "kg"}
    assert np.allclose(np.abs(table.head["column3"]), Y, atol=1e-3) and (table.head["column3"] < 0).sum() == 34


def test_channels_called_alike_are_no_causes_by_name(tmp_path):
    path = tmp_path / "scope.csv"
    path.write_text("Time,CH1,CH2\ns,V,V\n" + "\n".join(pairs("{t:.1f},{u},{y:.3f}")) + "\n")
    table = read(path)[0]
    assert table.inputs == ("CH1",) and table["CH1"].why.startswith("its past helps")


def test_a_line_of_the_version_as_wide_as_the_table_names_nothing(tmp_path):
    path = tmp_path / "wide.las"
    head = ["~VERSION", "VERS. 2.0 :CWLS", "WRAP. NO :ONE LINE PER STEP", "~CURVE", "TEMP.degC : 1 of two"]
    head += ["~A TIME_s HEATER TEMP"]
    path.write_text("\n".join([*head, *pairs("{t:9.1f} {u:9.2f} {y:9.3f}", 5, 2)]) + "\n")
    assert open_table(path).names == ("TIME_s", "HEATER", "TEMP")


def test_a_sentence_about_the_interval_is_no_name(tmp_path):
    path = tmp_path / "phase.txt"
    path.write_text("# Signal: oven\n# data interval 2 s\n" + "\n".join(pairs("{y:.4f}")) + "\n")
    table = read(path)[0]
    assert (table.output, table.dt, table.timed) == ("Signal: oven", 2.0, True)


def test_a_unit_that_all_channels_have_makes_none_an_input(tmp_path):
    """Read beside two others in volts, of which one drives it and one is noise."""
    noise = RNG.normal(size=SAMPLES)
    path = tmp_path / "volts.csv"
    rows = [f"{0.1 * k:.1f},{U[k]},{noise[k]:.3f},{Y[k]:.3f}" for k in ROWS]
    path.write_text("Time,CH1,CH2,CH3\ns,V,V,V\n" + "\n".join(rows) + "\n")
    table = read(path, output="CH3")[0]
    assert table.inputs == ("CH1",) and table["CH2"].why == "helps too little to predict the output"
