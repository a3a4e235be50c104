"""`driftwise track`: files in, tables out; a growing file and a pipe give what the whole file gives."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from driftwise.engine.errors import InputError

COMMAND = [sys.executable, "-m", "driftwise.cli.main", "track"]
ROW = "{:.3f},{:.2f},{:.2f},{}\n"


def table(objects=2, T=40, dt=4.0, start=1.7e9):
    """Return the lines of a CSV of objects that fly straight and then turn right by 1.5 degrees a second."""
    rng, rows, k = np.random.default_rng(3), [], np.arange(T)
    for i in range(objects):
        course = i + np.cumsum(np.where((k > 15) & (k < 31), np.radians(1.5) * dt, 0.0))
        path = np.cumsum(150 * dt * np.stack([np.sin(course), np.cos(course)], axis=1), axis=0) + 3000 * i
        plots = path + 20 * rng.standard_normal((T, 2))
        rows += [(start + 0.3 * i + dt * j, *plots[j], f"AB000{i}") for j in k]
    return ["time,east,north,icao24\n"] + [ROW.format(*row) for row in sorted(rows)]


@pytest.fixture(scope="module")
def lines():
    return table()


@pytest.fixture
def whole(call, lines, tmp_path):
    """The numbers of the whole file at once."""
    path, found = tmp_path / "plots.csv", tmp_path / "whole.json"
    path.write_text("".join(lines))
    assert call("track", path, "--json", found, "--quiet") == (0, "", "")
    return json.loads(found.read_text())


def test_prints_who_was_there_and_what_turned(call, lines, tmp_path):
    path, page = tmp_path / "plots.csv", tmp_path / "page.html"
    path.write_text("".join([*lines, "1700000200,broken,1,AB0000\n"]))
    code, out, err = call("track", path, "--report", page, "--out", tmp_path / "tracks")
    flat = " ".join(out.split())
    assert (code, err) == (0, "")
    assert "2 objects in 156 s, of which AB0000 and AB0001 turned." in flat
    assert "to the right from 2023-11-14 22:14" in flat
    assert "1 record skipped" in flat and "'broken'): " not in flat and "at 82" in flat
    assert len([line for line in out.splitlines() if line.startswith("AB000")]) == 2
    assert page.read_text().count("AB0001") > 2
    assert (tmp_path / "tracks" / "tracks.csv").exists()


def test_numbers_are_those_of_the_tracks(whole, tmp_path):
    import driftwise as dw

    tracks = dw.track(tmp_path / "plots.csv")
    assert [t["track"] for t in whole["tracks"]] == [t.id for t in tracks]
    for told, track in zip(whole["tracks"], tracks):
        assert told["nis"] == track.summary()["nis"] and told["plots"] == len(track) == 40
        (turn,) = told["turns"]
        assert turn["angle"] == pytest.approx(90, abs=12), "15 scans of 4 s at 1.5 degrees a second"
        assert turn["start"] - 1.7e9 == pytest.approx(62, abs=9)


def test_many_objects_list_the_busiest(call, tmp_path):
    path = tmp_path / "many.csv"
    path.write_text("".join(line.replace("AB000", f"AB{k:02}") for k in range(12) for line in table(2, 6)[k > 0 :]))
    code, out, _ = call("track", path)
    assert code == 0 and "and 4 more tracks of 6 to 6 plots" in out
    assert sum(line.startswith("AB") for line in out.splitlines()) == 20


@pytest.mark.parametrize(
    "args, code, words",
    [
        (["nowhere.csv"], 2, "no such file: nowhere.csv"),
        (["-"], 2, "standard input is read with --follow"),
        (["FILE", "--speed", "rocket"], 2, "aircraft, helicopter, glider, uav, boat, or a typical speed"),
        (["FILE", "--site", "95,3"], 2, "--site takes LATITUDE,LONGITUDE"),
        (["FILE", "--format", "csv,shp"], 2, "csv, parquet, geojson, kml, gpx, cat062"),
        (["FILE", "--report", "no/such/page.html"], 2, "no folder no/such"),
        (["FILE", "FILE", "--follow"], 2, "takes one file"),
        (["FILE", "--page", "0"], 2, "--page shows tracks as they move, with --follow or --listen"),
        (["EMPTY"], 1, "no plot has a time and a position"),
    ],
)
def test_says_no_in_a_sentence(call, lines, tmp_path, args, code, words):
    files = {"FILE": tmp_path / "plots.csv", "EMPTY": tmp_path / "empty.csv"}
    files["FILE"].write_text("".join(lines))
    files["EMPTY"].write_text(lines[0] + "1,,,AB0000\n")
    found = call("track", *(files.get(arg, arg) for arg in args))
    assert found[:2] == (code, "") and words in " ".join(found[2].split())


def told(path, time_told, seconds=60.0):
    """Wait until the estimate of a plot at some time has been written; return all complete lines."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        rows = [json.loads(line) for line in path.read_text().split("\n")[:-1]]
        if any("estimate" in row and row["time"] == time_told for row in rows):
            return rows
        time.sleep(0.05)
    raise AssertionError(f"nothing was told of {time_told}")


def test_a_growing_file_gives_what_the_whole_file_gives(lines, whole, tmp_path):
    """Lines come in pieces, half a line at a time; the file is moved away, then cut; Ctrl-C ends it."""
    path, found, page, out = (tmp_path / name for name in ("live.csv", "live.json", "page.html", "out.jsonl"))
    when = [0.0, *(float(line.split(",")[0]) for line in lines[1:])]
    path.write_text(lines[0][:7])
    command = [*COMMAND, str(path), "--follow", "--json", str(found), "--report", str(page)]
    with (
        out.open("w") as stdout,
        subprocess.Popen(command, stdout=stdout, stderr=subprocess.PIPE, text=True) as process,
    ):
        with path.open("a") as file:
            for text in (lines[0][7:] + "".join(lines[1:20]), lines[20][:9], lines[20][9:] + lines[21], lines[22][:-1]):
                file.write(text)
                file.flush()
                time.sleep(0.15)
        rows = told(out, when[21])
        assert {row["event"] for row in rows if "event" in row} == {"initiated", "confirmed"}
        os.rename(path, tmp_path / "live.csv.1")  # its last line was complete but for the line's end
        path.write_text("".join([lines[0], *lines[23:60]]))
        told(out, when[59])
        path.write_text("".join([lines[0], *lines[60:-1], lines[-1][:-1]]))  # cut: shorter than before
        told(out, when[-2])
        process.send_signal(signal.SIGINT)
        err = process.communicate(timeout=60)[1]
    assert process.returncode == 0 and "2 objects in 156 s" in " ".join(err.split())
    estimates = [row for row in map(json.loads, out.read_text().splitlines()) if "estimate" in row]
    assert sorted(row["time"] for row in estimates) == sorted(when[1:])
    assert json.loads(found.read_text())["tracks"] == whole["tracks"]
    assert page.stat().st_size > 1e6


def test_a_pipe_of_json_lines_gives_what_the_whole_file_gives(lines, whole, tmp_path):
    names = lines[0].strip().split(",")
    rows = [dict(zip(names, [*map(float, line.split(",")[:3]), line.split(",")[3].strip()])) for line in lines[1:]]
    text = "".join(json.dumps(row) + "\n" for row in rows)
    found = tmp_path / "live.json"
    done = subprocess.run(
        [*COMMAND, "-", "--follow", "--json", str(found)], input=text[:-1], capture_output=True, text=True, check=True
    )
    assert json.loads(found.read_text())["tracks"] == whole["tracks"]
    assert sum('"estimate"' in line for line in done.stdout.splitlines()) == len(rows)


def test_lines_one_by_one_are_the_table(tmp_path):
    """Stale rows, two rows of one time, a bad cell and a midnight are read as in the whole file."""
    from driftwise.tracking.live_plots import LivePlots
    from driftwise.tracking.read import read_plots

    text = "time of day,lat,lon,icao24,velocity\n"
    for k in range(60):
        second = (86370 + k) % 86400
        text += f"{second},{50 + 0.001 * k:.4f},4.0000,AB0000,110\n"
        text += f"{second},{51 + 0.001 * (k // 2):.4f},4.1000,AB0001,110\n" * (1 + (k % 7 == 0))
        text += "x,51,4,AB0002,1\n" * (k == 33)
    path = tmp_path / "plots.csv"
    path.write_text(text)
    whole, live = read_plots(path), LivePlots("plots.csv")
    parts = [part for line in text.splitlines(True) if (part := live.take(line.encode())) is not None]
    np.testing.assert_allclose(np.concatenate([p.position for p in parts]), whole.position, atol=1e-6)
    for name in ("time", "key", "altitude"):
        np.testing.assert_array_equal(np.concatenate([getattr(p, name) for p in parts]), getattr(whole, name))
    assert parts[0].origin == whole.origin and whole.time[-1] > 86400
    bad = [f.offset for p in parts for f in p.faults if "'x'" in f.what]
    assert bad == [f.offset for f in whole.faults if "'x'" in f.what] != []


def test_frames_one_by_one_are_the_recording():
    from driftwise.tracking.live_plots import LivePlots
    from driftwise.tracking.read import read_plots

    path = Path(os.environ.get("DRIFTWISE_DATA", "")) / "tracking/modes_raw/full_flight_short.lines00001-12000.jsonl"
    if not path.is_file():
        pytest.skip("DRIFTWISE_DATA names no folder with tracking recordings")
    whole, live = read_plots(path), LivePlots(path.name)
    lines = path.read_bytes().splitlines(True)
    pieces = [b"".join(lines[k : k + 700]) for k in range(0, len(lines), 700)]
    parts = [part for piece in pieces if (part := live.take(piece)) is not None]
    np.testing.assert_allclose(np.concatenate([p.position for p in parts]), whole.position, atol=1e-6)
    for name in ("time", "name", "altitude"):
        np.testing.assert_array_equal(np.concatenate([getattr(p, name) for p in parts]), getattr(whole, name))


def test_a_start_without_a_fix_and_a_file_without_its_header_are_taken():
    from driftwise.tracking.live_plots import LivePlots

    live = LivePlots("gps.csv")
    for text in ("time,lat,lon\n", "1,0,0\n", "2,0,0\n"):
        assert live.take(text.encode()) is None
    found = live.take(b"3,50,4\n4,50.001,4\n5,50.002,4\n")
    assert found.time.tolist() == [3, 4, 5] and len(found.faults) == 2
    assert live.take(b"6,50.003,4\n", begins=True).time.tolist() == [6]
    assert live.take(b"time,lat,lon\n7,50.004,4\n", begins=True).time.tolist() == [7]
    lost = live.take(b"8,500,4\n")
    assert len(lost) == 0 and "not on earth" in lost.faults[0].what and lost.faults[0].offset == 3


@pytest.mark.parametrize("size", [1, 7, 1000])
def test_a_line_with_zero_bytes_is_one_fault_and_the_others_are_read(size):
    """What a logger leaves that lost its power; by one line, seven, or all at a time."""
    from driftwise.tracking.live_plots import LivePlots

    lines = [b"time,x,y\n", *(b"%d,%d,%d\n" % (4 * k, 100 * k + k % 7, 50 * k + k % 5) for k in range(40))]
    lines[20] = b"76,\0\0,900\n"
    live, times, faults = LivePlots("plots.csv"), [], []
    for k in range(0, len(lines), size):
        found = live.take(b"".join(lines[k : k + size]))
        if found is not None:
            times += found.time.tolist()
            faults += [(fault.offset, fault.what) for fault in found.faults]
    assert times == [4.0 * k for k in range(40) if k != 19]
    assert faults == [(21, "the line holds bytes that are zero: it is left out")]


def test_lines_that_cannot_be_read_later_on_are_a_fault(monkeypatch):
    from driftwise.tracking.live_plots import LivePlots

    live = LivePlots("plots.csv")
    assert len(live.take(b"time,x,y\n0,1,2\n4,5,6\n")) == 2

    def refuse(lines, first):
        raise InputError("no sense in it")

    monkeypatch.setattr(live, "_plots", refuse)
    found = live.take(b"8,9,10\n")
    assert len(found) == 0 and [(fault.offset, fault.what) for fault in found.faults] == [(4, "no sense in it")]
