"""Without a clock, time is counted in samples, and a column that looks like one is told."""

import json
import re

import numpy as np
import pytest

RUN = ("-o", "y", "-i", "u", "--memory", "restart")


def period(out):
    """Return the unit and the number of the period that was told."""
    number, unit = re.search(r"oscillation of period ([\d.e+]+) (\w+) that decays", " ".join(out.split())).groups()
    return unit, float(number)


@pytest.fixture
def table(tmp_path):
    """A minute a row, in the second column; the plant jumps half-way."""
    rng = np.random.default_rng(6)
    y, u = np.zeros(600), rng.standard_normal(600)
    for t in range(2, 600):
        y[t] = 1.5 * y[t - 1] - 0.7 * y[t - 2] + (1 if t < 300 else 2) * u[t - 1] + 0.1 * rng.standard_normal()
    stamps = np.datetime64("2024-03-30T12:00", "m") + np.arange(600)
    file = tmp_path / "table.csv"
    file.write_text("u,logged at,y\n" + "".join(f"{a:.4f},{t},{b:.4f}\n" for a, t, b in zip(u, stamps, y)))
    return file


def test_samples_are_the_unit_and_the_clock_is_told(call, table, tmp_path):
    page, results = tmp_path / "page.html", tmp_path / "results.json"
    code, out, _ = call("run", table, *RUN, "--report", page, "--json", results)
    out = " ".join(out.split())
    assert code == 0 and "· no clock ·" in out
    assert period(out) == ("samples", pytest.approx(13.6, rel=0.05))  # of the poles 0.75 +- 0.37j
    assert "jumps noticed at: sample 3" in out and "The parameters jumped once, at sample 3" in out
    note = "column 'logged at' looks like the clock (a row every 60 s): --time 'logged at'; without it, times are in"
    assert note in out
    assert any(said.startswith(note) for said in json.loads(results.read_text())["notes"])
    text = page.read_text()
    assert '"axis_label":"sample"' in text and "time constant (samples)" in text and "time (s)" not in text


@pytest.mark.parametrize("options, step", [(["-t", "logged at"], 60), (["--dt", "60"], 60), (["--dt", "1"], 1)])
def test_with_a_clock_or_a_step_nothing_is_told(call, table, options, step):
    code, out, _ = call("run", table, *RUN, *options)
    assert code == 0 and "looks like the clock" not in out and "sample 3" not in out
    assert period(out) == ("s", pytest.approx(13.6 * step, rel=0.05))


def test_a_table_without_a_clock_is_told_none(call, table):
    rows = [line.split(",") for line in table.read_text().splitlines()]
    table.write_text("".join(f"{a},{b}\n" for a, _, b in rows))
    code, out, _ = call("run", table, *RUN)
    assert code == 0 and "looks like the clock" not in out and period(out)[0] == "samples"
