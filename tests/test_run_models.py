"""`driftwise run --model`: recursive identification from the command line, held against the library called by hand."""

import json

import numpy as np
import pytest

import driftwise as dw


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
        "run", record[0], "-o", "y", "-i", "u", "-i", "v", "--center", "none", "--json", result, *options
    )
    assert code == 0, err
    return json.loads(result.read_text()), out


@pytest.mark.parametrize(
    ("memory", "policy"),
    [
        ("never", dw.Never()),
        ("weighted:0.98", dw.Weighted(0.98)),
        ("limited:80", dw.LimitedGain(80)),
        ("walk:1e-6", dw.Walk(1e-6)),
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


def test_a_regression_uses_the_names_of_the_columns(call, record, tmp_path):
    page = tmp_path / "r.html"
    found, out = run(call, record, tmp_path, "--model", "regression", "--report", page)
    assert [row["name"] for row in found["summary"]["parameters"]] == ["u", "v"]
    assert "The regression explains" in " ".join(out.split())
    assert "y(t) = u + v + noise" in page.read_text()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--model", "arx"], "--model is written arx:na,nb,nk, for example arx:2,2,1"),
        (["--model", "arx:2,x"], "nb = 'x' must be a whole number, or one for each input as in 2/1"),
        (["--model", "arx:2/1,1"], "na = '2/1' must be a whole number."),
        (["--model", "arx:2,1/1/1"], "nb lists 3 numbers for 2 input(s)"),
        (["--model", "ar:2"], "--model ar has no input"),
        (["--model", "narx:2"], "--model must be one of ar, arx"),
        (["--model", "arx:2,1", "--order", "3"], "--order is for the joint filter"),
        (["--model", "arx:2,1", "--smooth", "all"], "--smooth is for the joint filter"),
        (["--model", "arx:2,1", "--memory", "limited:0.5"], "samples must exceed 1"),
        (["--model", "arx:2,1", "--memory", "weighted:1.5"], "p is a weight per sample"),
        (["--model", "arx:400,400"], "measured outputs are too few for 1200 unknowns (--model arx:400,400"),
    ],
)
def test_wrong_models_are_one_line(call, record, options, words):
    code, out, err = call("run", record[0], "-o", "y", "-i", "u", "-i", "v", *options)
    assert (code, out) == (1, "")
    assert words in err
    assert err.startswith("driftwise: ")
    assert err.count("\n") == 1
