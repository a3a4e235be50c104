"""Physical parameters from the command line: columns are found by name and unit, parameters told with units."""

import json

import numpy as np
import pytest

import driftwise as dw


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    """A cell whose ohmic resistance rises by 30 % after 600 s, sampled every 2 s."""
    path = tmp_path_factory.mktemp("cell") / "cell.csv"
    u = np.repeat(np.random.default_rng(1).choice([-1.0, 0.0, 1.0], 60), 10)
    est = dw.GreyBox("battery", dt=2.0)
    before, after = (est.simulate(u, {"R0": R0, "R1": 0.015}, noise=5e-4, seed=1) for R0 in (0.02, 0.026))
    y = np.where(np.arange(600) < 300, before, after)
    table = np.column_stack([2.0 * np.arange(600), u, y])
    np.savetxt(path, table, delimiter=",", header="time,current [A],voltage [V]", comments="")
    return path


def test_a_plant_of_the_library_prints_its_parameters_with_bars_units_and_when_they_moved(call, cell, tmp_path):
    results, page = tmp_path / "cell.json", tmp_path / "cell.html"
    code, shown, _ = call("run", cell, "--plant", "battery", "--json", results, "--report", page)
    assert code == 0
    assert "R0" in shown and "Ohm" in shown and "ohmic resistance" in shown and "R0 rose by" in shown
    found = json.loads(results.read_text())
    assert found["columns"] == {"outputs": ["voltage [V]"], "inputs": ["current [A]"], "time": "time"}
    R0 = found["summary"]["parameters"][0]
    assert R0["unit"] == "Ohm" and R0["interval"][0] < 0.026 < R0["interval"][1]
    first = found["summary"]["moves"][0]
    assert first["name"] == "R0" and abs(first["time"] - 600) < 20
    assert "R0 (Ohm)" in page.read_text()


@pytest.mark.parametrize(
    "options, said",
    [
        (("--plant", "batery"), "there is no plant 'batery'"),
        (("--plant", "battery", "--order", "2"), "--order: the model is the plant that --plant names"),
        (("--plant", "battery", "-o", "voltage [V]", "-o", "time"), "has 1 outputs (v), and --output names 2"),
    ],
)
def test_what_does_not_fit_a_plant_is_a_sentence(call, cell, options, said):
    code, _, told = call("run", cell, *options)
    assert code == 2 and said in " ".join(told.split())


def test_a_column_that_is_not_found_is_asked_for(call, cell, tmp_path):
    other = tmp_path / "other.csv"
    other.write_text(cell.read_text().replace("current [A]", "a").replace("voltage [V]", "b"))
    code, _, told = call("run", other, "--plant", "battery")
    assert code == 2 and "which column is v in V, an output of the plant battery" in " ".join(told.split())
    _, shown, _ = call("run", other, "--plant", "battery", "-o", "b", "-i", "a", "--memory", "constant")
    assert "R1" in shown and "rose" not in shown
