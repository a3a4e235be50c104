"""`driftwise run` with orders, smoothing, jumps and an unknown noise: held against the library called by hand."""

import io
import json
import sys

import numpy as np
import pyarrow.csv
import pyarrow.parquet
import pytest

import driftwise as dw
from driftwise.cli.run_options import orders
from driftwise.engine.errors import InputError

A, B = [-1.5, 0.7], [1.0, 0.5]
JUMP = 700


def jumping(samples=1400, noise=0.2, seed=4):
    """Return a record of a plant whose a1 moves by 0.3 half-way; NaN where lost."""
    rng = np.random.default_rng(seed)
    u, e = rng.standard_normal(samples), noise * rng.standard_normal(samples)
    y = np.zeros(samples)
    for t in range(2, samples):
        a1 = -1.5 if t < JUMP else -1.2
        y[t] = -a1 * y[t - 1] - 0.7 * y[t - 2] + u[t - 1] + 0.5 * u[t - 2] + e[t]
    y[300:310] = np.nan
    return y, u


def table(path, y, u):
    np.savetxt(path, np.c_[u, y], delimiter=",", header="u,y", comments="", fmt="%.17g")
    return str(path)


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    y, u = jumping()
    return table(tmp_path_factory.mktemp("run") / "jump.csv", y, u), y, u


def flat(text):
    return " ".join(text.split())


@pytest.mark.parametrize("ending", ["csv", "parquet"])
@pytest.mark.parametrize("smooth", ["all", "25"])
def test_smoothed_columns_are_those_of_the_library(call, record, tmp_path, ending, smooth):
    path, y, u = record
    plain, wide, result = tmp_path / f"p.{ending}", tmp_path / f"w.{ending}", tmp_path / "r.json"
    options = (path, "-o", "y", "-i", "u", "--offset", "none", "--memory", "restart", "--chunk", 300)
    assert call("run", *options, "--save", plain)[0] == 0
    assert call("run", *options, "--save", wide, "--smooth", smooth, "--json", result)[0] == 0
    read = pyarrow.csv.read_csv if ending == "csv" else pyarrow.parquet.read_table
    old, new = read(plain), read(wide)
    for name in old.column_names:
        np.testing.assert_array_equal(np.asarray(old[name], float), np.asarray(new[name], float))
    est = dw.Joint(2, inputs=1, memory=dw.RestartOnChange()).scaled_to(y[:300], u[:300])
    by_hand = est.smooth(y, u, lag=None if smooth == "all" else int(smooth))
    for j, name in enumerate(est.names):
        np.testing.assert_array_equal(np.asarray(new[f"{name}_smoothed"]), by_hand.parameters[:, j])
        np.testing.assert_array_equal(np.asarray(new[f"{name}_smoothed_std"]), by_hand.parameters_std[:, j])
    np.testing.assert_array_equal(np.asarray(new["x2_smoothed"]), by_hand.x[:, 0])
    assert [p.name for p in tmp_path.iterdir() if ".part" in p.name] == []
    said = json.loads(result.read_text())["smoothed"]
    assert said["lag"] == (None if smooth == "all" else 25)
    assert said["parameters"][0]["first"] == by_hand.parameters[0, 0]


def test_jumps_are_told_with_their_time(call, record, tmp_path):
    path, *_ = record
    result, page = tmp_path / "r.json", tmp_path / "r.html"
    code, out, _ = call("run", path, "-o", "y", "-i", "u", "--memory", "restart", "--json", result, "--report", page)
    assert code == 0
    data = json.loads(result.read_text())
    found = [jump["sample"] for jump in data["jumps"]]
    assert len(found) == data["summary"]["jumps"] >= 1
    assert all(JUMP <= k < JUMP + 30 for k in found)
    assert f"jumps noticed at: sample {found[0]}" in out
    assert "The parameters jumped" in flat(out)
    text = page.read_text()
    assert "parameters jumped, freed again" in text
    assert "Vertical lines: jumps (dashed)." in text


def test_orders_are_those_of_the_library(call, record, tmp_path):
    path, y, u = record
    result, page = tmp_path / "r.json", tmp_path / "r.html"
    options = ("run", path, "-o", "y", "-i", "u", "--offset", "none", "--memory", "restart", "--chunk", 200)
    code, out, _ = call(*options, "--orders", "1-3", "-n", 3, "--json", result, "--report", page)
    assert code == 0
    data = json.loads(result.read_text())["orders"]
    by_hand = dw.analysis.choose_order(y, u, [1, 2, 3], memory=dw.RestartOnChange())
    assert data["order"] == [1, 2, 3]
    assert data["best"] == by_hand.best == 2
    np.testing.assert_allclose(data["log_evidence"], by_hand.log_evidence, rtol=1e-12)
    assert "log evidence" in out
    assert "the data speak for another: --order 2" in flat(out)
    text = page.read_text()
    assert 'id="orders"' in text
    assert "posterior probability" in text


def test_order_auto_runs_the_most_probable(call, record, tmp_path):
    path, *_ = record
    one, other = tmp_path / "1.json", tmp_path / "2.json"
    code, out, _ = call("run", path, "-o", "y", "-i", "u", "--order", "auto", "--memory", "restart", "--json", one)
    assert code == 0
    assert "order 2 (the most probable)" in out
    assert call("run", path, "-o", "y", "-i", "u", "--order", 2, "--memory", "restart", "--json", other)[0] == 0
    one, other = json.loads(one.read_text()), json.loads(other.read_text())
    assert one["estimator"] == other["estimator"]
    assert one["summary"] == other["summary"]
    assert one["orders"]["best"] == 2
    assert other["orders"] is None


def test_an_unknown_noise_says_whether_to_trust_a(call, tmp_path):
    y, u = dw.simulate(A, B, d=[-0.8, 0.3], samples=2000, noise_std=0.5, seed=1)
    result, page = tmp_path / "r.json", tmp_path / "r.html"
    path = table(tmp_path / "p.csv", y, u)
    files = ["--offset", "mean", "--json", result, "--report", page]
    code, out, _ = call("run", path, "-o", "y", "-i", "u", "--noise", "unknown", *files)
    assert code == 0
    data = json.loads(result.read_text())
    values = {p["name"]: p["value"] for p in data["summary"]["parameters"]}
    assert values == pytest.approx({"a1": -1.5, "a2": 0.7, "b1": 1, "b2": 0.5, "c1": -0.8, "c2": 0.3}, abs=0.1)
    bound = data["identifiability"]["cramer_rao"]
    assert 1 <= max(bound["ratio"]) < 3
    assert "a can be trusted without knowing c" in flat(out)
    text = page.read_text()
    assert "error of a, noise colour unknown / known" in text
    assert "+ v(t) + c1 v(t\u22121) + c2 v(t\u22122)." in text


def test_an_unknown_polynomial_is_smoothed_to_its_last_value(call, tmp_path):
    y, u = dw.simulate(A, B, d=[-0.8, 0.3], samples=800, noise_std=0.5, seed=1)
    path, result = table(tmp_path / "p.csv", y, u), tmp_path / "r.json"
    options = ("--noise", "unknown", "--smooth", "all", "--json", result, "--report", tmp_path / "r.html")
    code, _, _ = call("run", path, "-o", "y", "-i", "u", *options)
    assert code == 0
    data = json.loads(result.read_text())
    final = {p["name"]: p["value"] for p in data["summary"]["parameters"]}
    for smoothed in data["smoothed"]["parameters"]:
        assert smoothed["first"] == pytest.approx(final[smoothed["name"]], abs=1e-3 * smoothed["first_std"])


def test_what_the_record_cannot_teach_is_said_once(call, tmp_path):
    y, _ = dw.simulate([-0.8], samples=300, noise_std=1.0, seed=1)
    path = table(tmp_path / "p.csv", y, np.full(300, 3.0))
    result, page = tmp_path / "r.json", tmp_path / "r.html"
    code, out, _ = call("run", path, "-o", "y", "-i", "u", "-n", 1, "--json", result, "--report", page)
    assert code == 0
    words = "The input is zero once its mean is subtracted: it teaches nothing about b."
    assert flat(out).count(words) == 1
    assert "stayed at 3" not in out
    assert "Steady-state gain" not in out
    assert words in page.read_text()
    data = json.loads(result.read_text())["identifiability"]
    assert not data["is_identifiable"]
    assert data["rank"] == 2
    _, out, _ = call("run", path, "-o", "y", "-i", "u", "-n", 2, "--offset", "none")
    assert "along b1 - b2. The input is constant: move it." in flat(out)


def test_a_gain_beside_an_integrator_has_an_interval_or_no_bound(call, tmp_path):
    y, u = dw.simulate([-0.995], [1.0], samples=800, noise_std=2.0, seed=5)
    est = dw.Joint(1, inputs=1).scaled_to(y, u)
    model = est.scan(y, u).model()
    assert np.isinf(model.dc_gain_std[0])
    low, high = model.dc_gain_interval()[0]
    words = est.scan(y, u).summary().words
    if np.isfinite(low):
        assert f"Steady-state gain {low:.3g} to {high:.3g} (95 %)" in words
    else:
        assert "Steady-state gain" not in words
    path, result = table(tmp_path / "p.csv", y, u), tmp_path / "r.json"
    call("run", path, "-o", "y", "-i", "u", "-n", 1, "--offset", "none", "--json", result)
    gain = json.loads(result.read_text())["summary"]["dc_gain"][0]
    assert gain["std"] is None
    assert gain["interval"] == [low if np.isfinite(low) else None, high if np.isfinite(high) else None]


def test_a_record_too_long_is_not_smoothed_and_says_why(call, record, tmp_path, monkeypatch):
    monkeypatch.setattr("driftwise.cli.early_samples.ROWS", 500)
    monkeypatch.setattr("driftwise.analysis.study.ROWS", 400)
    path, *_ = record
    saved, result = tmp_path / "s.csv", tmp_path / "r.json"
    options = ("--smooth", "all", "--save", saved, "--json", result, "--chunk", 300, "--report", tmp_path / "r.html")
    code, out, _ = call("run", path, "-o", "y", "-i", "u", *options)
    assert code == 0
    assert "not smoothed: it needs the record in memory, and 1400 rows are more than the 500" in flat(out)
    data = json.loads(result.read_text())
    assert data["smoothed"] is None
    assert data["identifiability"]["rows"] == 400
    assert "smoothed" not in saved.read_text().split("\n")[0]


def test_smoothing_works_through_a_pipe(call, record, tmp_path, monkeypatch):
    path, *_ = record
    result, again = tmp_path / "r.json", tmp_path / "a.json"
    assert call("run", path, "-o", "y", "-i", "u", "--smooth", "all", "--json", result)[0] == 0
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(open(path, "rb").read())))
    assert call("run", "-", "-o", "y", "-i", "u", "--smooth", "all", "--json", again)[0] == 0
    assert json.loads(result.read_text())["smoothed"] == json.loads(again.read_text())["smoothed"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--orders", "5-1"], "--orders 5-1 counts downwards; was 1-5 meant?"),
        (["--orders", "0"], "--orders must lie between 1 and 30, got '0'"),
        (["--orders", "-3"], "--orders takes a range or a list of orders"),
        (["--orders", "1;2"], "--orders takes a range or a list of orders"),
        (["--orders", "1-1000000000"], "--orders must lie between 1 and 30"),
        (["--smooth", "-3"], "--smooth must be all (the whole record) or a number of samples"),
        (["--smooth", "some"], "--smooth must be all"),
        (["--memory", "leap"], "--memory must be constant"),
        (["--memory", "restart:"], "--memory must be constant"),
        (["--memory", "restart:-1"], "a positive number"),
        (["--memory", "random-walk:1,2,3,4", "--orders", "1-3"], "give one number for all while orders are compared"),
        (["--noise", "polynomial:0.1,0.2", "--orders", "1-3"], "--noise polynomial lists 2 coefficients"),
    ],
)
def test_wrong_options_are_one_line(call, record, options, words):
    code, out, err = call("run", record[0], "-o", "y", "-i", "u", *options)
    assert (code, out) == (2, "")
    assert words in err
    assert err.startswith("driftwise: ")
    assert err.count("\n") == 1


def test_order_auto_says_what_it_needs(call, record, tmp_path):
    code, _, err = call("run", "-", "-o", "y", "--order", "auto")
    assert code == 2
    assert "standard input can be read only once" in err
    y, u = jumping(samples=24)
    code, _, err = call("run", table(tmp_path / "short.csv", y, u), "-o", "y", "-i", "u", "--order", "auto")
    assert code == 1
    assert "24 measured outputs are too few to choose among orders 1-5: order 5 has 16 unknowns" in err
    assert call("run", record[0], "-o", "y", "--order", "automatic")[0] == 2


def test_orders_are_read_as_written():
    assert orders("1-3") == orders("3,1,2") == orders(" 1-2 , 3,3") == [1, 2, 3]
    for text in ("", "1,,2", "a-b", "1-", "1.5"):
        with pytest.raises(InputError, match="range or a list"):
            orders(text)
