"""The command line end to end: what it prints, what it writes, how it says no."""

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import driftwise as dw
from driftwise.cli import downsample, main
from driftwise.engine import compile
from driftwise.engine.status import Status
from driftwise.tables import record

A, B = [-1.5, 0.7], [1.0, 0.5]


@pytest.fixture
def plant(tmp_path):
    """Return a table of a known plant, with some outputs missing."""
    y, u = dw.simulate(A, B, samples=1500, noise_std=0.1, missing=0.05, seed=3)
    path = tmp_path / "plant.csv"
    cells = [(0.5 * k, float(u[k]), "" if math.isnan(y[k]) else float(y[k])) for k in range(len(y))]
    lines = [",".join(map(str, row)) for row in cells]
    path.write_text("t,u,y\n" + "\n".join(lines) + "\n")
    return str(path)


def test_run_finds_the_plant(call, plant):
    code, out, err = call("run", plant, "--output", "y", "--input", "u", "--time", "t", "-n", 2)
    assert (code, err) == (0, "")
    for word in ("a1", "−1.5", "b2", "one-step fit", "NIS", "white", "missing outputs", "dt 0.5 s"):
        assert word in out
    assert "means of the first chunk were subtracted" in out


def test_results_do_not_depend_on_the_chunks(call, plant, tmp_path):
    found = []
    for chunk in (64, 333, 65_536):
        path = tmp_path / f"{chunk}.json"
        assert call("run", plant, "-o", "y", "-i", "u", "--offset", "none", "--chunk", chunk, "--json", path)[0] == 0
        found.append(json.loads(path.read_text())["summary"])
    exact = ("samples", "observed", "missing_outputs", "parameters", "poles", "loglik")
    for other in found[:2]:
        assert {k: other[k] for k in exact} == {k: found[2][k] for k in exact}
        assert other["nis"] == pytest.approx(found[2]["nis"], rel=1e-12)


def test_the_record_read_by_hand_gives_the_same_numbers(call, plant, tmp_path):
    path = tmp_path / "r.json"
    call("run", plant, "-o", "y", "-i", "u", "-t", "t", "--offset", "none", "--json", path)
    summary = json.loads(path.read_text())["summary"]
    table = np.genfromtxt(plant, delimiter=",", skip_header=1)
    y, u = table[:, 2], table[:, 1]
    trace = dw.Joint(2, inputs=1, dt=0.5).scaled_to(y, u).scan(y, u)
    assert [p["value"] for p in summary["parameters"]] == trace.parameters[-1].tolist()


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_save_writes_every_sample_in_the_units_of_the_file(call, plant, tmp_path, ending):
    import pyarrow.csv
    import pyarrow.parquet

    path = str(tmp_path / f"trace.{ending}")
    code, out, _ = call("run", plant, "-o", "y", "-i", "u", "-t", "t", "-n", 2, "--chunk", 400, "--save", path)
    assert code == 0
    assert path in out
    read = pyarrow.csv.read_csv if ending == "csv" else pyarrow.parquet.read_table
    table = read(path)
    assert table.num_rows == 1500
    source = np.genfromtxt(plant, delimiter=",", skip_header=1)
    columns = {name: np.asarray(table[name], float) for name in table.column_names}
    np.testing.assert_allclose(columns["y"], source[:, 2], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(columns["u"], source[:, 1], rtol=1e-12)
    np.testing.assert_array_equal(columns["time"], source[:, 0])
    seen = ~np.isnan(source[:, 2])
    np.testing.assert_allclose((columns["y"] - columns["prediction"])[seen], columns["innovation"][seen], atol=1e-9)
    assert {"a1", "a1_std", "variance", "dof", "status"} <= set(columns)


def test_bad_rows_are_counted_flagged_and_passed_over(call, plant, tmp_path):
    lines = open(plant).read().split("\n")
    lines[100], lines[200], lines[300] = "49.5,1,broken", "99.5,1", "149.5,1,inf"
    path, result, saved = tmp_path / "bad.csv", tmp_path / "r.json", tmp_path / "s.csv"
    path.write_text("\n".join(lines))
    words = ["-o", "y", "-i", "u", "-t", "t", "-n", 2, "--chunk", 150]
    code, out, _ = call("run", path, *words, "--json", result, "--save", saved)
    assert code == 0
    out = " ".join(out.split())  # lines are as long as a terminal is wide
    assert "2 cells are neither numbers below 1e100 nor times, and were taken as missing (first: row 100" in out
    assert "row 100, column 'y'" in out
    assert "1 row has too many or too few cells" in out
    data = json.loads(result.read_text())
    assert data["summary"]["samples"] == 1500
    assert data["summary"]["bad_values"] == 3
    assert data["ragged_rows"] == 1
    status = np.genfromtxt(saved, delimiter=",", names=True)["status"].astype(int)
    assert np.flatnonzero(status & int(Status.BAD_VALUE)).tolist() == [99, 199, 299]


def test_duplicate_and_decreasing_stamps_are_told(call, plant):
    lines = open(plant).read().split("\n")
    lines[50], lines[60] = lines[50].replace("24.5", "24.0", 1), lines[60].replace("29.5", "9.5", 1)
    open(plant, "w").write("\n".join(lines))
    code, out, _ = call("run", plant, "-o", "y", "-i", "u", "-t", "t", "-n", 2)
    assert code == 0
    flat = " ".join(out.split())
    assert "time goes backwards 1 times in 't', first at row 60" in flat
    assert "1 time stamps of 't' repeat the one before, first at row 50" in flat


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["-o", "Y"], "no column 'Y' for the output. Did you mean 'y'? The columns are: t, u, y"),
        (["-o", "y", "-i", "nothing"], "no column 'nothing' for the input"),
        (["-o", "y", "--noise", "pink"], "--noise must be"),
        (["-o", "y", "--noise", "polynomial:1,x"], "numbers separated by commas"),
        (["-o", "y", "--memory", "walk"], "--memory must be"),
        (["-o", "y", "--gate", "-1"], "--gate must be a positive number"),
        (["-o", "y", "--order", "0"], "order must be"),
        (["-o", "y", "--direct"], "there is no --input"),
        (["-o", "y", "-n", "2", "--dt", "0"], "dt must be"),
        (["-o", "y", "--save", "x.xlsx"], ".parquet or .csv"),
        (["-o", "y", "--report", "nowhere/x.html"], "there is no folder nowhere"),
        (["-o", "y", "--order", "800"], "order is at most 200"),
    ],
)
def test_input_errors_are_one_paragraph(call, plant, options, words):
    code, out, err = call("run", plant, *options)
    assert code == (1 if "column" in words else 2)  # the data, or the command
    assert out == ""
    assert words in err
    assert err.startswith("driftwise: ")
    assert err.count("\n") == 1


def test_files_that_cannot_be_used(call, tmp_path, plant):
    for name, content, words in (
        ("empty.csv", "", "is empty"),
        ("header.csv", "u,y\n", "a header but no rows"),
        ("flat.csv", "y\n1\n1\n1\n", "a constant tells nothing"),
        ("text.csv", "u,y\n1,a\n2,b\n", "not numbers"),
        ("nan.csv", "u,y\n1,\n2,\n", "is empty in all 2 rows"),
        ("short.csv", "y\n1\n2\n3\n", "too few"),
    ):
        path = tmp_path / name
        path.write_text(content)
        code, _, err = call("run", path, "-o", "y", "-n", 2)
        assert code == 1
        assert words in err
        assert str(path) in err
    assert call("run", tmp_path / "plant.cvs", "-o", "y")[0] == 1
    code, _, err = call("run", plant, "-o", "y", "--save", plant)
    assert code == 2
    assert "overwrite" in err
    before = Path(plant).read_bytes()
    code, _, err = call("run", plant, "--save", plant)
    assert code == 2 and "overwrite" in err and Path(plant).read_bytes() == before


def test_usage_errors_have_exit_code_two(call, plant):
    assert call("run")[0] == 2
    assert call("run", plant, "--order", "3", "--memory", "walk")[0] == 2
    assert call("walk", plant)[0] == 2
    assert call("run", plant, "-o", "y", "--order", "two")[0] == 2


def test_version_and_help(call):
    assert call("--version") == (0, f"driftwise {dw.__version__}\n", "")
    code, out, _ = call("run", "--help")
    assert code == 0
    for option in (
        "--output",
        "--input",
        "--time",
        "--order",
        "--noise",
        "--memory",
        "--gate",
        "--save",
        "--report",
        "--json",
    ):
        assert option in out


def test_demo_ends_with_what_to_type_next(call, tmp_path):
    code, out, err = call("demo", "--report", tmp_path / "flight.html")
    assert (code, err) == (0, "")
    assert "one-step fit" in out
    assert "beware" not in out and "NIS                         0.9" in out, "the first impression is calibrated"
    assert out.rstrip().endswith("driftwise run FILE --report report.html")
    assert (tmp_path / "flight.html").stat().st_size > 1e6


def test_warm_compiles_and_says_so(call, monkeypatch):
    from driftwise.estimators.common import warm
    from driftwise.fleet import warm as fleets

    monkeypatch.setattr(warm, "warm", lambda: iter(["one", "two"]))
    monkeypatch.setattr(fleets, "warm", lambda: iter(["three"]))
    code, out, _ = call("warm")
    assert code == 0
    assert out.startswith("3 combinations compiled and stored in ")


def test_warm_compiles_what_identify_needs(monkeypatch):
    from driftwise.analysis.candidates import candidates
    from driftwise.estimators.common import warm
    from driftwise.estimators.model_average.step import Averaging

    asked = set()
    for name in ("driver", "passage"):
        monkeypatch.setattr(compile, name, lambda *kinds: asked.add(kinds) or (lambda *arrays: None))
    monkeypatch.setattr(dw.Joint, "smooth", lambda self, y: None)
    list(warm.warm())
    all_ = [c for inputs in (0, 1, 2) for c in candidates(inputs)]
    needed = [est for c in all_ for est in (c.best, *map(c.estimator, c.memories))]
    others = {(Averaging,)}
    assert {tuple(map(type, est.policies)) for est in needed} | others <= asked


def test_help_loads_nothing_heavy():
    program = (
        "import sys; sys.argv = ['driftwise', '--help']\n"
        "from driftwise.cli.main import main\n"
        "try: main()\nexcept SystemExit: pass\n"
        "names = {'numpy', 'numba', 'pyarrow', 'scipy', 'bokeh', 'matplotlib', 'narwhals', 'pandas'}\n"
        "heavy = names & set(sys.modules)\n"
        "print('HEAVY', sorted(heavy))"
    )
    out = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
    assert "HEAVY []" in out
    assert "simulate" in out


def greet(name: str) -> None:
    """Say hello."""
    print("hello", name)


def test_others_bring_commands_and_are_looked_for_only_when_asked_for(call, monkeypatch):
    monkeypatch.setattr(main, "entry_points", {"driftwise.commands": {"greet": f"{__name__}:greet"}}.get)
    assert call("greet", "you")[:2] == (0, "hello you\n")
    code, _, said = call("score")  # a study, and they are not here
    assert code == 2 and "pip install ./studies" in said
    listed = call("--help")[1]
    assert "Say hello." in listed and "score" not in listed
    monkeypatch.setattr(main, "entry_points", lambda group: 1 / 0)
    assert call("run", "--help")[0] == 0


def test_offsets_are_subtracted_and_given_back(call, tmp_path):
    y, u = dw.simulate(A, B, samples=2000, noise_std=0.1, seed=1)
    path, result, saved = tmp_path / "p.csv", tmp_path / "r.json", tmp_path / "s.csv"
    np.savetxt(path, np.column_stack([u + 7, y + 100]), delimiter=";", header="u;y", comments="")
    call("run", path, "-o", "y", "-i", "u", "--offset", "mean", "--json", result, "--save", saved)
    data = json.loads(result.read_text())
    assert data["offsets"] == pytest.approx({"y": np.mean(y) + 100, "u": np.mean(u) + 7})
    values = [p["value"] for p in data["summary"]["parameters"]]
    assert values == pytest.approx([*A, *B], abs=0.05)
    table = np.genfromtxt(saved, delimiter=",", names=True)
    np.testing.assert_allclose(table["y"], y + 100, rtol=1e-12)
    assert abs(np.mean(table["prediction"][100:]) - 100) < 20


def test_a_constant_input_is_told(call, tmp_path):
    y, _ = dw.simulate([-0.8], samples=300, noise_std=1.0, noise="equation", seed=1)
    path = tmp_path / "p.csv"
    np.savetxt(path, np.column_stack([np.full(300, 3.0), y]), delimiter=",", header="u,y", comments="")
    code, out, _ = call("run", path, "-o", "y", "-i", "u", "-n", "1")
    assert code == 0
    assert "The input is zero once its mean is subtracted: it teaches nothing about b." in " ".join(out.split())
    assert "not identified" in out


def test_long_runs_keep_every_extreme(monkeypatch):
    monkeypatch.setattr(downsample, "ROWS", 500)
    y, u = dw.simulate(A, B, samples=6000, noise_std=0.1, seed=2, missing=0.01)
    y[4321] += 40
    est = dw.Joint(2, 1).scaled_to(y, u)
    whole, found = est.scan(y, u), []
    for cut in (701, 6000):
        keeper, state = downsample.TraceDownsampler(est, downsample.Offsets("y", ("u",), {"y": 2.0})), None
        for start in range(0, 6000, cut):
            trace = est.scan(y[start : start + cut], u[start : start + cut], state=state)
            state = trace.state
            keeper.add(trace)
        found.append(keeper.trace())
    thin = found[0]
    np.testing.assert_array_equal(thin.rows, found[1].rows)
    assert len(thin) <= 501
    assert {4321, 5999} <= set(thin.rows)
    for name in ("time", "parameters", "dof", "status"):
        np.testing.assert_array_equal(getattr(thin, name), getattr(whole, name)[thin.rows])
    np.testing.assert_array_equal(thin.y, whole.y[thin.rows] + 2)
    for j in range(4):  # of every bucket
        for first in range(0, 6000, keeper.width):
            bucket = whole.parameters[first : first + keeper.width, j]
            kept = thin.parameters[(thin.rows // keeper.width) == first // keeper.width, j]
            assert (kept.min(), kept.max()) == (bucket.min(), bucket.max())
    missing = [e.sample for e in keeper.events if e.kind == "MISSING_OUTPUT"]
    assert missing
    assert np.isnan(y[missing]).all()


def test_interrupting_gives_the_results_so_far(call, plant, monkeypatch):
    whole = record.open_record

    class Interrupted:
        def __init__(self, record):
            self.record = record

        def __getattr__(self, name):
            return getattr(self.record, name)

        def __iter__(self):
            for k, chunk in enumerate(self.record):
                if k == 3:
                    raise KeyboardInterrupt
                yield chunk

    monkeypatch.setattr(record, "open_record", lambda *args: Interrupted(whole(*args)))
    code, out, _ = call("run", plant, "-o", "y", "-i", "u", "-n", 2, "--chunk", 200)
    assert code == 130
    assert "600 samples" in out
    assert "stopped early" in out


def test_memory_of_a_run_does_not_grow_with_the_file(tmp_path):
    import pyarrow as pa
    import pyarrow.parquet as pq

    peaks = []
    for rows in (200_000, 1_000_000):
        path = str(tmp_path / f"{rows}.parquet")
        rng = np.random.default_rng(0)
        pq.write_table(pa.table({"u": rng.standard_normal(rows), "y": rng.standard_normal(rows)}), path)
        program = (
            "import atexit, sys, resource; from driftwise.cli.main import main\n"
            f"sys.argv = ['driftwise', 'run', {path!r}, '-o', 'y', '-i', 'u', '-n', '1']\n"
            "atexit.register(lambda: print('PEAK', resource.getrusage(resource.RUSAGE_SELF).ru_maxrss))\n"
            "main()"
        )
        env = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
        out = subprocess.run(
            [sys.executable, "-c", program], capture_output=True, text=True, check=True, env=env
        ).stdout
        peaks.append(int(out.split("PEAK")[1]) / 1024)
    assert peaks[1] < peaks[0] + 40, f"MB: {peaks}"


def test_an_error_code_in_a_column_is_named(tmp_path, call):
    rng = np.random.default_rng(0)
    y, u = rng.standard_normal(400), rng.standard_normal(400)
    u[122] = -1e8
    file = tmp_path / "wild.csv"
    np.savetxt(file, np.c_[y, u], delimiter=",", header="y,u", comments="")
    code, out, _ = call("run", file, "-o", "y", "-i", "u", "-n", 2)
    assert code == 0
    assert "'u' is -1e+08 in row 123" in " ".join(out.split())


def test_run_notes_the_verdicts_that_are_not_fine(call, plant, tmp_path):
    path = tmp_path / "r.json"
    code, out, _ = call("run", plant, "-o", "y", "-i", "u", "-t", "t", "--offset", "none", "--json", path)
    assert code == 0 and "(fine: " not in out
    assert json.loads(path.read_text())["verdicts"]["NIS"]["is_fine"]
    lines = (tmp_path / "plant.csv").read_text().splitlines()
    late = [f"{t},{u},{float(y) + 3 if y else y}" for t, u, y in (line.split(",") for line in lines[750:])]
    (tmp_path / "jump.csv").write_text("\n".join([*lines[:750], *late]) + "\n")
    code, out, _ = call("run", tmp_path / "jump.csv", "-o", "y", "-i", "u", "-t", "t", "--offset", "none")
    assert code == 0
    assert "drift or jump > 1 million (fine: 0 to 100): the parameters " in " ".join(out.split())
