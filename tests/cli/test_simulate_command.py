"""`driftwise simulate`: through a pipe, of random plants, and what it refuses."""

import json
import subprocess
import sys

import numpy as np
import pytest


def test_simulate_into_run_through_a_pipe():
    command = [sys.executable, "-m", "driftwise.cli.main"]
    table = subprocess.run(
        [
            *command,
            "simulate",
            "--a",
            "-1.5,0.7",
            "--b",
            "1,0.5",
            "--samples",
            "2000",
            "--seed",
            "5",
            "--missing",
            "0.1",
        ],
        capture_output=True,
        check=True,
    )
    assert b"2000 samples of a = -1.5, 0.7; b = 1, 0.5" in table.stderr
    run = subprocess.run(
        [*command, "run", "-", "--output", "y", "--input", "u", "-n", "2", "--offset", "mean", "--json", "-"],
        input=table.stdout,
        capture_output=True,
        check=True,
    )
    values = {p["name"]: p["value"] for p in json.loads(run.stdout)["summary"]["parameters"]}
    assert values == pytest.approx({"a1": -1.5, "a2": 0.7, "b1": 1.0, "b2": 0.5}, abs=0.03)
    assert b"one-step fit" in run.stderr


@pytest.mark.parametrize("order", [1, 2, 5])
def test_simulate_random_plants_are_stable(call, tmp_path, order):
    from driftwise.cli.demo import random_plant

    for seed in range(20):
        a, b = random_plant(order, seed)
        assert len(a) == len(b) == order
        assert np.abs(np.roots([1, *a])).max() < 0.96
    path = tmp_path / "s.csv"
    assert call("simulate", path, "--order", order, "--samples", 50, "--missing", 0.3)[0] == 0
    again = tmp_path / "again.csv"
    call("simulate", again, "--order", order, "--samples", 50, "--missing", 0.3)
    assert path.read_text() == again.read_text()
    header, first, *_ = path.read_text().split("\n")
    assert header.replace('"', "") == "t,u,y"
    assert first.startswith("0,")


def test_simulate_refuses_what_does_not_fit(call, tmp_path):
    assert "as many numbers as --a" in call("simulate", "--a", "0.5,0.1", "--b", "1")[2]
    assert "--b is the numerator" in call("simulate", "--b", "1")[2]
    code, _, err = call("simulate", tmp_path / "no" / "x.csv", "--samples", 10)
    assert code == 1
    assert "cannot be written" in err
