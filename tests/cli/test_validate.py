"""`driftwise validate`: the same verdicts as `trace.validate()`, columns recognised or named."""

import json

import numpy as np
import pytest

import driftwise as dw


@pytest.fixture(scope="module")
def late(tmp_path_factory):
    u = np.random.default_rng(7).standard_normal(1200)
    y, _ = dw.simulate([-1.5, 0.7], [1.0, 0.5], u=u, samples=1200, noise_std=0.5, seed=1)
    y = np.concatenate([np.zeros(4), y[:-4]]) + 20
    path = tmp_path_factory.mktemp("late") / "plant.csv"
    np.savetxt(path, np.c_[u, y], delimiter=",", header="heater,temperature", comments="", fmt="%.17g")
    return str(path)


def test_a_wrong_delay_is_told_and_written(call, late, tmp_path):
    result, page = tmp_path / "r.json", tmp_path / "p.html"
    named = ("-o", "temperature", "-i", "heater")
    code, out, err = call("validate", late, "--model", "arx:2,2,1", *named, "--json", result, "--report", page)
    assert code == 0, err
    found = json.loads(result.read_text())
    assert (
        not found["is_fine"]
        and "nk = 5" in found["verdicts"]["delay"]["advice"]
        and "take nk = 5" in " ".join(out.split())
    )
    assert [fit["ahead"] for fit in found["fresh"]] == ["1 step", "5 steps", "25 steps", "simulation"]
    assert "Bode and Nyquist" in page.read_text()


def test_columns_are_recognised_and_the_model_found(call, late, tmp_path):
    result = tmp_path / "r.json"
    code, _, err = call("validate", late, "--model", "arx:2,2,5", "--json", result)
    assert code == 0, err
    found = json.loads(result.read_text())
    assert found["columns"]["output"] == "temperature" and found["is_fine"]
    code, out, err = call("validate", late)
    assert code == 0 and "simulation" in out, err


@pytest.mark.parametrize(("model", "word"), [("arx", "arx"), ("last", "forecaster"), ("arx:2,2,1@nothing", "nothing")])
def test_what_is_no_model_is_refused_before_the_table_is_read(call, model, word):
    code, _, err = call("validate", "nowhere.csv", "--model", model)
    assert code == 2 and word in err


def test_time_is_counted_in_seconds_only_where_the_clock_says_so(call, late, tmp_path):
    u, y = np.loadtxt(late, delimiter=",", skiprows=1).T
    times = {}
    for name, unit in (("t", "samples"), ("time_s", "s")):
        path, result = tmp_path / f"{name}.csv", tmp_path / f"{name}.json"
        rows = np.c_[10.0 * np.arange(len(y)), u, y]
        np.savetxt(path, rows, delimiter=",", header=f"{name},heater,temperature", comments="", fmt="%.17g")
        code, out, err = call("validate", path, "--model", "arx:2,2,5", "--json", result)
        assert code == 0, err
        found = json.loads(result.read_text())
        assert found["unit"] == unit and ("Hz" in out) == (unit == "s")
        times[name] = found["poles"][0]["time_constant"]
    assert times["time_s"] == pytest.approx(10 * times["t"])
    assert dw.identify({"heater": u, "temperature": y}).validate().unit == "samples"
