"""`driftwise run --model`: recursive identification from the command line, held against the library called by hand."""

import json

import numpy as np
import pyarrow.parquet
import pytest
from draws import slow

import driftwise as dw
from driftwise.cli import specs


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    rng = np.random.default_rng(3)
    u, e = rng.standard_normal((900, 2)), 0.1 * rng.standard_normal(900)
    y = np.zeros(900)
    for t in range(2, 900):
        y[t] = 1.2 * y[t - 1] - 0.5 * y[t - 2] + u[t - 1, 0] + 0.5 * u[t, 1] + e[t]
    path = tmp_path_factory.mktemp("models") / "plant.csv"
    np.savetxt(path, np.c_[u, y], delimiter=",", header="u,v,y", comments="", fmt="%.17g")
    return str(path), y, u


def run(call, record, tmp_path, *options):
    result = tmp_path / "r.json"
    code, out, err = call(
        "run", record[0], "-o", "y", "-i", "u", "-i", "v", "--offset", "none", "--json", result, *options
    )
    assert code == 0, err
    return json.loads(result.read_text()), out


@pytest.mark.parametrize(
    ("memory", "policy"),
    [
        ("constant", dw.Constant()),
        ("exponential:0.98", dw.ExponentialForgetting(0.98)),
        ("gain-floor:80", dw.memory.GainFloor(80)),
        ("random-walk:1e-6", dw.RandomWalk(1e-6)),
    ],
)
def test_every_number_is_the_librarys(call, record, tmp_path, memory, policy):
    found, out = run(call, record, tmp_path, "--model", "arx:2,1/1,1/0", "--memory", memory)
    _, y, u = record
    by_hand = dw.ARX(2, (1, 1), (1, 0), memory=policy).scaled_to(y, u).scan(y, u)
    rows = found["summary"]["parameters"]
    assert [row["name"] for row in rows] == by_hand.names == ["a1", "a2", "b1.1", "b0.2"]
    assert [row["value"] for row in rows] == by_hand.parameters[-1].tolist()
    assert [row["std"] for row in rows] == [std for *_, std in by_hand.summary().parameters]
    assert "ARX 2,1/1,1/0" in out


def test_the_default_finds_out_and_looks_back_from_the_command_line(call, record, tmp_path):
    """Memory AutoMemory without being asked; --smooth is what `smooth` returns for the same rows."""
    saved = tmp_path / "s.parquet"
    options = ("--model", "arx:2,1/1,1/0", "--smooth", "all", "--save", saved, "--report", tmp_path / "r.html")
    found, out = run(call, record, tmp_path, *options)
    _, y, u = record
    est = dw.ARX(2, (1, 1), (1, 0), memory=dw.AutoMemory()).scaled_to(y, u)
    trace, smoothed = est.scan(y, u), est.smooth(y, u)
    assert found["estimator"]["memory"] == "auto" and "parameters that may drift or jump" in out
    assert [row["value"] for row in found["summary"]["parameters"]] == trace.parameters[-1].tolist()
    drift = est.drift_of(trace.state)
    assert [row["memory"] for row in found["summary"]["drift"]["parameters"]] == drift.memory.tolist()
    assert found["summary"]["drift"]["weights"] == drift.weights
    columns = pyarrow.parquet.read_table(saved)
    for j, name in enumerate(est.names):
        np.testing.assert_array_equal(columns[f"{name}_smoothed"], smoothed.parameters[:, j])
        np.testing.assert_array_equal(columns[f"{name}_smoothed_std"], smoothed.parameters_std[:, j])
    words = " ".join(out.split())
    assert smoothed.words in words and f"Drift: {drift.words}." in words
    assert found["smoothed"]["words"] == smoothed.words and found["smoothed"]["nvr"]["a1"] == smoothed.nvr[0]
    page = (tmp_path / "r.html").read_text()
    assert "How fast each parameter drifts" in page and "In hindsight (900 samples" in page


def test_a_regression_uses_the_names_of_the_columns(call, record, tmp_path):
    page = tmp_path / "r.html"
    found, out = run(call, record, tmp_path, "--model", "regression", "--report", page)
    assert [row["name"] for row in found["summary"]["parameters"]] == ["u", "v"]
    assert "The regression predicts" in " ".join(out.split())
    for word in ("pole", "zero", "Steady-state", "b0"):
        assert word not in out
    assert found["summary"]["poles"] == found["summary"]["zeros"] == found["summary"]["dc_gain"] == []
    assert 'id="poles"' not in page.read_text()
    assert "y(t) = θ(u) u(t) + θ(v) v(t) + noise" in page.read_text()


def test_every_memory_is_written_as_it_is_called():
    for text, policy in {
        "auto": dw.AutoMemory(),
        "auto:outliers": dw.AutoMemory("outliers"),
        "auto:jumps": dw.AutoMemory("jumps"),
        "multiple-model": dw.memory.MultipleModel(),
        "imm": dw.memory.IMM(),
        "variable:100": dw.memory.VariableForgetting(100.0),
        "directional:0.98": dw.memory.DirectionalForgetting(0.98),
        "window:60": dw.memory.Window(60),
        "change-point:0.3/500": dw.memory.BayesianChangePoint(0.3, 500.0),
        "change-point:0.3,0.1/500": dw.memory.BayesianChangePoint((0.3, 0.1), 500.0),
        "random-walk:1e-3": dw.RandomWalk(1e-3),
        "random-walk:0.3/500": dw.RandomWalk(matched=(0.3, 500.0)),
        "restart:0.3": dw.RestartOnChange(response=dw.memory.CovarianceInflation(0.3)),
        "gain-reset:10": dw.RestartOnChange(response=dw.memory.GainReset(10.0)),
    }.items():
        assert specs.memory(text) == policy
    for text, detector in {
        "parameters:10000": dw.detect.ScoreCUSUM("10000"),
        "parameters:1 per 10_000,0.3,0.2": dw.detect.ScoreCUSUM("1 per 10_000", (0.3, 0.2)),
        "level:10000,0.5": dw.PageHinkley("10000", 0.5),
        "noise:1/10000,2": dw.detect.VarianceCUSUM(2.0, false_alarms="1/10000"),
        "glr:10000,50": dw.detect.GLR("10000", 50),
    }.items():
        assert specs.policy("constant", text) == dw.RestartOnChange(detector)
        assert specs.policy("gain-reset:10", text) == dw.RestartOnChange(detector, dw.memory.GainReset(10.0))


def test_a_jump_is_named_dated_and_drawn_against_its_threshold(call, tmp_path):
    rng = np.random.default_rng(3)
    u, y = rng.standard_normal(900), 0.2 * rng.standard_normal(900)
    for t in range(1, 900):
        y[t] += 0.6 * y[t - 1] + (1.0 if t < 500 else 1.3) * u[t - 1]
    path, page, result = tmp_path / "jump.csv", tmp_path / "r.html", tmp_path / "r.json"
    np.savetxt(path, np.c_[u, y], delimiter=",", header="u,y", comments="", fmt="%.17g")
    options = (
        "--model",
        "arx:1,1",
        "--jumps",
        "parameters:10000,0.15",
        "--memory",
        "gain-reset:10",
        "--offset",
        "none",
    )
    code, out, err = call("run", path, "-o", "y", "-i", "u", *options, "--report", page, "--json", result)
    assert (code, err) == (0, "")
    est = dw.ARX(
        1, 1, memory=dw.RestartOnChange(dw.detect.ScoreCUSUM(10_000, 0.15), dw.memory.GainReset(10))
    ).scaled_to(y, u)
    trace = est.scan(y, u)
    found = json.loads(result.read_text())["jumps"]
    assert [(jump["sample"], jump["words"]) for jump in found] == [(e.sample, e.text) for e in trace.jumps()]
    assert 500 <= found[0]["sample"] < 540 and found[0]["words"].startswith("jump: b1 rose, it began about ")
    assert f"jumps noticed at: sample {found[0]['sample']} (b1 rose)" in " ".join(out.split())
    assert trace.weight[found[0]["sample"] - 1] > 490 and trace.weight[found[0]["sample"] + 1] < 12
    text = page.read_text()
    assert "ScoreCUSUM promises at most one false alarm per 10" in text
    assert "statistic / threshold" in text and "memory (samples)" in text and found[0]["words"] in text


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--model", "arx"], "--model is written arx:na,nb,nk, for example arx:2,2,1"),
        (["--model", "arx:2,x"], "nb = 'x' must be a whole number, or one for each input as in 2/1"),
        (["--model", "arx:2/1,1"], "na = '2/1' must be a whole number."),
        (["--model", "arx:2,1/1/1"], "nb lists 3 numbers for 2 input(s)"),
        (["--model", "arx:50000,1"], "na is at most 1000"),
        (["--model", "ar:2"], "--model ar has no input"),
        (["--model", "narx:2"], "--model must be one of ar, arx"),
        (["--model", "arx:2,1", "--order", "3"], "--order is for the joint filter"),
        (["--model", "arx:2,1", "--orders", "1-3"], "--orders is for the joint filter"),
        (
            ["--model", "armax:2,1,1", "--smooth", "all"],
            "--smooth is for ar, arx, regression, whose regressors are data",
        ),
        (["--model", "arx:400,400"], "AutoMemory of 1201 parameters keeps 8.9e+08 numbers"),
        (["--model", "arx:2,1", "--memory", "auto:drift"], "expect must be one of both, outliers, jumps"),
        (
            ["--model", "arx:2,1", "--memory", "imm:3"],
            "auto or auto:outliers or auto:jumps (how fast each parameter drifts",
        ),
        (["--model", "arx:2,1", "--memory", "auto", "--jumps", "level:1000"], "and --memory auto forgets all the time"),
        (["--model", "arx:2,1", "--memory", "gain-floor:0.5"], "samples must exceed 1"),
        (["--model", "arx:2,1", "--memory", "exponential:1.5"], "lam is a weight per sample"),
        (["--model", "arx:2,1", "--memory", "random-walk:nan"], "q must be a finite number"),
        (["--model", "arx:2,1", "--memory", "window:1e9"], "take a shorter one"),
        (["--model", "arx:2,1", "--memory", "window:1.5"], "a whole number of samples is expected"),
        (
            ["--model", "arx:2,1", "--memory", "change-point:0.3"],
            "takes two numbers, for example change-point:0.3/1000",
        ),
        (
            ["--model", "arx:2,1", "--memory", "random-walk:0.1", "--jumps", "level:100"],
            "forgets all the time: leave one",
        ),
        (["--model", "arx:2,1", "--jumps", "level"], "--jumps is written DETECTOR:RATE or DETECTOR:RATE,SIZE"),
        (["--model", "arx:2,1", "--jumps", "level:often"], "a rate of false alarms is written '1 per 10_000'"),
        (["--model", "arx:2,1", "--jumps", "level:100,-1"], "jump must be positive"),
        (["--model", "arx:2,1", "--jumps", "glr:1000,1.5"], "SIZE is how many samples to look back, a whole number"),
        (["--model", "arx:2,1", "--jumps", "noise:1e30"], "such a threshold never alarms"),
        (["--memory", "exponential:1.5"], "lam is a weight per sample"),
        (["-o", "v"], "--output was given 2 times (y, v), and one output is identified at a time"),
    ],
)
def test_wrong_models_are_one_line(call, record, options, words):
    code, out, err = call("run", record[0], "-o", "y", "-i", "u", "-i", "v", *options)
    assert (code, out) == (2, "")
    assert words in err
    assert err.startswith("driftwise: ")
    assert err.count("\n") == 1


def test_records_too_short_say_so(call, record, tmp_path):
    code, out, err = call(
        "run", record[0], "-o", "y", "-i", "u", "-i", "v", "--model", "arx:400,400", "--memory", "constant"
    )
    assert (code, out) == (1, "")
    assert "measured outputs are too few for 1201 unknowns (--model arx:400,400" in err
    (tmp_path / "three.csv").write_text("y\n1\n2\n1.5\n")
    code, out, _ = call("run", tmp_path / "three.csv", "-o", "y", "--model", "ar:1", "--report", tmp_path / "r.html")
    assert code == 0
    assert "2 measured outputs are too few for 2 unknowns" in " ".join(out.split())
    assert "nan" not in out and ">nan<" not in (tmp_path / "r.html").read_text()


def test_columns_that_nobody_named_are_recognised_for_a_model_that_was(call, tmp_path):
    """By the same means as where nothing is named, clock included; a level that jumps is one jump of the offset."""
    rng, T, result = np.random.default_rng(3), 3000, tmp_path / "r.json"
    u = 5.0 + np.repeat(rng.standard_normal(T // 10), 10)
    e, y = 0.1 * rng.standard_normal(T) + np.where(np.arange(T) < T // 2, 4.0, 5.5), np.zeros(T)
    for t in range(1, T):
        y[t] = 0.8 * y[t - 1] + 0.5 * u[t - 1] + e[t]
    rows = "".join(f"{0.5 * k:g},{a:.5f},{b:.5f}\n" for k, (a, b) in enumerate(zip(u, y)))
    (tmp_path / "t.csv").write_text("seconds,valve,temperature\n" + rows)
    for options in ([], ["-o", "temperature"], ["-o", "temperature", "-i", "valve", "-t", "seconds"]):
        code, _, err = call("run", tmp_path / "t.csv", "--model", "arx:1,1", *options, "--json", result)
        assert (code, err) == (0, "")
        found = json.loads(result.read_text())
        assert found["columns"] == {"output": "temperature", "inputs": ["valve"], "time": "seconds"}
        late = [jump["sample"] for jump in found["jumps"] if jump["sample"] > 100]
        assert found["estimator"]["dt"] == 0.5 and len(late) == 1 and abs(late[0] - T // 2) < 10
        a1, b1, _ = found["summary"]["parameters"]
        assert abs(a1["value"] + 0.8) < 4 * a1["std"] and abs(b1["value"] - 0.5) < 4 * b1["std"]
        assert ("The output is 'temperature'" in found["words"]) == (options[-2:] != ["-t", "seconds"])
    assert late == [T // 2 + 3] and abs(a1["value"] + 0.8) < a1["std"]
    assert call("run", tmp_path / "t.csv", "--model", "arx:1,1", "--offset", "mean", "--json", result)[0] == 0
    found = json.loads(result.read_text())  # means belong to no regime
    assert len(found["jumps"]) == 9 and found["summary"]["parameters"][1]["value"] < 0


def test_a_model_of_columns_that_leave_it_open_is_asked_about(call, tmp_path):
    a, b = np.random.default_rng(3).normal(size=(2, 400)).cumsum(axis=1)
    np.savetxt(tmp_path / "t.csv", np.column_stack([a, b]), "%.5f", ",", header="ch1,ch2", comments="")
    code, out, _ = call("run", tmp_path / "t.csv", "--model", "ar:1", "--direct")
    assert code == 2  # which the model does not have, whatever the columns
    code, out, _ = call("run", tmp_path / "t.csv", "--model", "ar:1", "--memory", "constant", "--offset", "none")
    assert code == 3 and "-o ch1 --model ar:1 --memory constant --offset none\n" in out
    code, out, _ = call("run", tmp_path / "t.csv", "--model", "ar:1", "--take-best")
    assert code == 0 and "the likelier is taken" in " ".join(out.split())


@pytest.mark.parametrize(
    "options, said",
    [
        (["--model", "arx:2,1/1,1/0"], "The model is ARX 2,1/1,1/0 with an offset: --model names it"),
        slow(["--order", 1, "--offset", "none"], "The model is the joint filter of order 1 without an offset: --ord"),
        (["--order", "auto", "--orders", "1-2"], "with an offset: the most probable of the orders 1-2."),
        (["--memory", "restart", "--offset", "mean"],
         "order 2 about the means: neither --model nor --order was named beside --memory, --offset"),
    ],
)  # fmt: skip
def test_a_run_says_which_model_it_had_and_why(call, record, tmp_path, options, said):
    result, page = tmp_path / "n.json", tmp_path / "n.html"
    files = ["--json", result, "--report", page]
    code, out, _ = call("run", record[0], "-o", "y", "-i", "u", "-i", "v", *options, *files)
    assert code == 0 and said in " ".join(out.split())
    assert said in json.loads(result.read_text())["words"] and said in page.read_text()
