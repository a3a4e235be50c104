"""A newcomer's table: roles from names and values, what is not believed, a regular clock, and files as they come."""

import io
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from plants_of_tables import NaN, plant, taken

from driftwise.engine.errors import InputError
from driftwise.tables.autoread import read
from driftwise.tables.table import open_table

DATA = Path(os.environ.get("DRIFTWISE_DATA", "no recordings")) / "sysid"


# --- the newcomer's files ------------------------------------------------------------------------------------


def german(x, digits):
    return f"{x:,.{digits}f}".translate(str.maketrans(",.", ".,"))


def files(folder):
    """Write the table of `plant` the way people do; return the paths by what they are."""
    y, u = plant()
    clock = [f"31.12.2024 {13 + s // 3600}:{s // 60 % 60:02d}:{s % 60:02d}" for s in range(2700, 3100)]
    made = {
        "german": "\ufeffZeitstempel;Temperatur [°C];Ventilstellung [%];Bemerkung\r\n"
        + "".join(f"{t};{german(a, 3)};{german(b, 1)};ok\r\n" for t, a, b in zip(clock, y, u)),
        "groups": "Test rig 7,,,\nTime,Boiler,,\n,Temperature,Pressure,Heater\ns,degC,bar,%\n"
        + "".join(f'{k},{a:.3f},{a / 500 + 1:.4f},"{b:.1f}"\n' for k, (a, b) in enumerate(zip(y, u))),
        "semicolons": "# exported\nsep=;\nMessung Heizkreis 1;;;\nZeit;Vorlauf;Ventil;\n[s];[°C];[%];\n".removeprefix(
            "# exported\n"
        )
        + "".join(f"{k};{german(a, 3)};{german(b, 0)};\n" for k, (a, b) in enumerate(zip(y, u))),
        "american": 'Date,"Tank level, in",Pump\n'
        + "".join(
            f"12/31/2024 {1 + s // 3600}:{s // 60 % 60:02d}:{s % 60:02d} PM,{a:.3f},{b}\n"
            for s, a, b in zip(range(400), y, u)
        ),
    }
    paths = {}
    for name, text in made.items():
        paths[name] = folder / f"{name}.csv"
        paths[name].write_bytes(text.encode())
    stamps = pa.array(np.datetime64("2024-12-31T13:45", "ms") + 1000 * np.arange(400))
    level = pa.array([None if k in (7, 8) else v for k, v in enumerate(y.round(3))])
    frame = pa.table({"timestamp": stamps, "level": level, "pump": u, "note": ["a", None] * 200})
    keep = [k for k in range(400) if k not in (100, 101)]
    paths["parquet"] = folder / "table.parquet"
    pq.write_table(frame.take(keep), paths["parquet"], row_group_size=150)
    return paths, y.round(3), u


ROLES = {
    "german": ("Zeitstempel", "Temperatur [°C]", ("Ventilstellung [%]",), "°C"),
    "groups": ("Time", "Boiler Temperature", ("Boiler Heater",), "°C"),
    "semicolons": ("Zeit", "Vorlauf", ("Ventil",), "°C"),
    "american": ("Date", "Tank level, in", ("Pump",), ""),
    "parquet": ("timestamp", "level", ("pump",), ""),
}


@pytest.mark.parametrize("kind", ROLES)
def test_files_as_they_come(kind, tmp_path):
    paths, y, u = files(tmp_path)
    table, segments = read(paths[kind], chunk_rows=90)
    time, outputs, inputs = taken(segments)
    assert (table.time, table.output, table.inputs, table[table.output].unit) == ROLES[kind]
    np.testing.assert_allclose(time, np.arange(400), atol=1e-9)
    hole = [7, 8, 100, 101] if kind == "parquet" else []
    y[hole], u[hole[2:]] = NaN, NaN
    np.testing.assert_array_equal(outputs, y)
    np.testing.assert_array_equal(inputs[:, 0], u)
    assert sum(segments.cleaned.values()) == 0


def recording(name):
    if not (DATA / name).exists():
        pytest.skip(f"set DRIFTWISE_DATA to the folder of recordings: {name} is not in {DATA}")
    return DATA / name


def test_the_soldering_station():
    """A header too short, uneven stamps, a set point of -1e8, drop-outs to 25.235, a column of nothing."""
    table, segments = read(recording("soldering_station.csv"))
    time, y, u = taken(segments)
    for mine, theirs in zip(taken(read(recording("soldering_station.csv"), chunk_rows=10)[1]), (time, y, u)):
        np.testing.assert_array_equal(mine, theirs)
    assert (table.time, table.output, table.inputs) == ("Time", "temperature", ("setpoint",))
    assert table["column6"].role == "empty" and table.sampling.kind == "uneven" and 1.1 < table.dt < 1.2
    assert segments.cleaned == {"temperature": 28, "setpoint": 1}
    assert np.nanmin(y) > 100 and np.nanmin(u) > 100 and len(y) == 1749 and time[-1] == pytest.approx(2310, abs=10)
    told = " ".join([*table.notes, *segments.notes()])
    assert "28 values" in told and "25.235" in told and "unevenly" in told


RECORDS = {
    "ahu_faults_szvav.csv": ("Supply_Air_T", {"Cooling_Coil_Valve", "Heating_Coil_Valve"}),
    "building_heat_load.csv": ("heatload_kW", {"Ta_obs_degC", "I_obs_Wm2", "Ta_fc1_degC", "I_fc1_Wm2"}),
    "canning_rainfall_flow.csv": ("flow_mm", {"rain_mm", "pet_mm"}),
    "dc_motor_hoop_random.csv": ("speed_V", {"u"}),
    "emps_train.csv": ("position_m", {"u_V"}),
    "gas_furnace.csv": ("co2_percent", {"gas_rate"}),
    "hair_dryer.csv": ("air_temp_V", {"heater_V"}),
    "heat_exchanger.csv": ("outlet_temp", {"flow"}),
    "heating_system.csv": ("temp_degC", {"drive_V"}),
    "hydraulic_hanging_load.csv": ("position", {"reference"}),
    "leaf_cell_hppc_25C.csv": ("voltage_V", {"current_A"}),
    "mur_groundwater.csv": ("head_m", {"river_m", "prec_mm", "evap_mm"}),
    "nile.csv": ("flow_1e8m3", set()),
    "robot_arm.csv": ("acceleration", {"reaction_torque"}),
}


@pytest.mark.parametrize("name", RECORDS)
def test_recordings_get_the_parts_an_engineer_would_give_them(name):
    table, segments = read(recording(name))
    output, inputs = RECORDS[name]
    assert table.output == output and len(table.inputs) <= 4
    assert set(table.inputs) == inputs if "ahu" not in name else set(table.inputs) > inputs
    for _ in segments:
        pass
    assert sum(segments.cleaned.values()) == 0  # rain, floods, pulses and faults are real


def test_a_labelled_rig_is_not_driven_by_its_labels():
    table, _ = read(recording("skab/valve1_0.csv"))
    assert {table["anomaly"].role, table["changepoint"].role} == {"label"}
    assert table.dt == 1 and table.time == "datetime"


def test_dates_and_times_of_day_in_two_columns(tmp_path):
    y, u = plant()
    clock = [(23 * 3600 + 59 * 60 + s) % 86_400 for s in range(400)]
    hours = [f"{s // 3600:02d}:{s // 60 % 60:02d}:{s % 60:02d}" for s in clock]
    text = "".join(f"{30 + (s < 80000)}.12.2024;{h};{a:.3f};{b}\n" for s, h, a, b in zip(clock, hours, y, u))
    for header, cut in (("Datum;Uhrzeit;Stand;Ventil\n", 0), ("Uhrzeit;Stand;Ventil\n", 11)):
        path = tmp_path / f"{cut}.csv"
        path.write_text(header + "".join(line[cut:] + "\n" for line in text.splitlines()))
        table, segments = read(path, chunk_rows=50)
        time, outputs, _ = taken(segments)
        assert (table.output, table.inputs, table.dt, table.timed) == ("Stand", ("Ventil",), 1.0, True)
        np.testing.assert_array_equal(time - time[0], np.arange(400))
        np.testing.assert_array_equal(outputs, y.round(3))


# --- in memory, through a pipe, and too long to hold ---------------------------------------------------------


def test_frames_and_mappings():
    pandas, polars = pytest.importorskip("pandas"), pytest.importorskip("polars")
    y, u = plant()
    columns = {"when": np.datetime64("2024-01-01", "ms") + 250 * np.arange(400), "pump": u, "level": y}
    frame = pandas.DataFrame(columns)
    wanted = taken(read(columns)[1])
    for data in (frame, frame.set_index("when"), polars.DataFrame(columns).lazy(), pa.table(columns)):
        table, segments = read(data, chunk_rows=100)
        assert (table.output, table.inputs, table.dt) == ("level", ("pump",), 0.25)
        for mine, theirs in zip(taken(segments), wanted):
            np.testing.assert_array_equal(mine, theirs)
    for data, words in (
        (np.ones((5, 2)), "An array has no names"),
        ({"y": np.ones((5, 2))}, "one dimension"),
        ({"y": np.ones(5), "u": np.ones(4)}, "differ in length"),
        ({}, "no columns"),
    ):
        with pytest.raises(InputError, match=words):
            read(data)


def test_standard_input_and_what_is_not_asked_for_is_not_converted(monkeypatch):
    y, u = plant()
    text = "t_s,valve,level,spare\n" + "".join(f"{k},{a},{b},{0}\n" for k, (a, b) in enumerate(zip(u, y)))
    monkeypatch.setattr("driftwise.tables.csvfile.BLOCK", 1000)
    monkeypatch.setattr("driftwise.tables.csvfile.HEAD", 1000)
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text.encode())))
    table = open_table("-", chunk_rows=50, head_rows=70)
    asked = []
    batches = table.source.batches
    monkeypatch.setattr(table.source, "batches", lambda names: asked.append(list(names)) or batches(names))
    chunks = list(table.chunks(["level", "valve"]))
    assert asked == [["level", "valve"]] and [len(chunk["level"]) for chunk in chunks] == [50] * 8
    np.testing.assert_array_equal(np.concatenate([chunk["level"] for chunk in chunks]), y)


def write_long(path, rows):
    from pyarrow import csv

    writer = None
    for first in range(0, rows, 500_000):
        k = np.arange(first, min(first + 500_000, rows))
        u = np.sign(np.sin(k / 50))
        part = pa.table(
            {"t_s": (0.01 * k).round(2), "heater": u, "temp": (np.sin(k / 50 - 1) + 1e-3 * (k % 7)).round(4)}
        )
        writer = writer or csv.CSVWriter(path, part.schema)
        writer.write(part)
    writer.close()


def test_a_long_file_is_read_chunk_by_chunk(tmp_path):
    path = str(tmp_path / "long.csv")
    write_long(path, 300_000)
    segments = read(path, chunk_rows=20_000)[1]
    y = next(segments)[1]
    assert len(y) <= 20_000 and segments.table.source.fraction < 0.5
    sizes = [len(y)] + [len(part) for _, part, _ in segments]
    assert sum(sizes) == 300_000 and max(sizes) <= 20_000 and segments.table.source.fraction == 1.0


@pytest.mark.slow
def test_ten_million_rows_in_constant_memory(tmp_path):
    """Peak memory of a process of its own, at a million and at ten million rows."""
    script = """
import sys
from driftwise.tables.autoread import read
table, segments = read(sys.argv[1])
rows = sum(len(y) for _, y, _ in segments)
print(rows, next(int(line.split()[1]) // 1024 for line in open("/proc/self/status") if line.startswith("VmHWM")))
"""
    peaks = []
    for rows in (1_000_000, 10_000_000):
        path = str(tmp_path / "long.csv")
        write_long(path, rows)
        out = subprocess.run([sys.executable, "-c", script, path], capture_output=True, text=True, check=True).stdout
        count, peak = map(int, out.split())
        assert count == rows
        peaks.append(peak)
    assert peaks[1] < peaks[0] + 30 and peaks[1] < 300, peaks


def test_the_newest_row_first_is_turned_round(tmp_path):
    y, u = plant()
    rows = [f"{k},{a},{b:.6g}" for k, (a, b) in enumerate(zip(u, y))]
    file = tmp_path / "backwards.csv"
    file.write_text("time_s,valve,level\n" + "\n".join(rows[::-1]) + "\n")
    table, segments = read(str(file))
    assert table.time == "time_s" and "the rows were turned round" in table.notes[0]
    np.testing.assert_allclose(taken(segments)[1], y, rtol=1e-5)
    with pytest.raises(InputError, match="sort its rows"):
        read({"time_s": np.arange(400.0)[::-1], "valve": u, "level": y}, head_rows=100)


def test_a_header_with_fewer_cells_than_the_rows_and_units(tmp_path):
    y, u = plant()
    rows = "\n".join(f"{5 * k};{b:.6g};{a};" for k, (a, b) in enumerate(zip(u, y)))
    file = tmp_path / "logger.csv"
    file.write_text(f"Logger 3;;\nTime;Temperature;Valve\n[s];[degC];[%]\n{rows}\n")
    table = read(str(file))[0]
    assert (table.output, table.inputs, table.dt, table.timed) == ("Temperature", ("Valve",), 5.0, True)
    assert table["Temperature"].unit == "°C"
