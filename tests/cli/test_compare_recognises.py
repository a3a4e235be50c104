"""`driftwise compare` with no column named: recognised as `run` does, and asked about where the evidence is even."""

import json

import numpy as np
import pytest


@pytest.fixture
def heated(tmp_path):
    rng = np.random.default_rng(1)
    u, y = rng.normal(size=400), np.zeros(400)
    for k in range(1, 400):
        y[k] = 0.8 * y[k - 1] + 0.5 * u[k - 1] + 0.1 * rng.normal()
    path = tmp_path / "heated.csv"
    np.savetxt(path, np.c_[u, y], "%.5f", ",", header="heater,temperature", comments="")
    return str(path)


def test_columns_that_are_not_named_are_those_named(call, heated):
    named = call("compare", heated, "arx:2,2,1", "last", "-o", "temperature", "-i", "heater", "--json", "-")
    found = call("compare", heated, "arx:2,2,1", "last", "--json", "-")
    assert named[0] == found[0] == 0
    named, found = json.loads(named[1]), json.loads(found[1])
    assert found["columns"] == {"output": "temperature", "inputs": ["heater"], "time": None}
    assert "driven by 'heater'" in found["notes"][0]
    scores = [[(row["name"], row["rmse"]) for row in one["rows"]] for one in (named, found)]
    assert scores[0] == scores[1]


def test_even_evidence_is_asked_about_with_the_command_at_hand(call, tmp_path):
    walks = np.cumsum(np.random.default_rng(0).normal(size=(300, 2)), axis=0)
    np.savetxt(path := tmp_path / "walks.csv", walks, "%.4f", ",", header="p,q", comments="")
    code, out, _ = call("compare", str(path), "ar:2", "last")
    assert code == 3 and f"driftwise compare {path} ar:2 last -o q" in out.replace("\n", "")
    code, out, _ = call("compare", str(path), "ar:2", "last", "--take-best")
    assert code == 0 and "predict" in out


def test_a_stream_is_read_once_and_needs_its_output(call):
    code, _, err = call("compare", "-", "ar:2", "last")
    assert code != 0 and "--output" in err
