"""The user's own matrices from the command line: a file of them, a table, and the filter's words, page and numbers."""

import json

import numpy as np
import pytest

import driftwise as dw
from driftwise.tables import matricesfile


@pytest.fixture(scope="module")
def way(tmp_path_factory):
    """A position that is measured every 0.5 s, its speed wandering; some cells are empty."""
    path, rng = tmp_path_factory.mktemp("way") / "way.csv", np.random.default_rng(1)
    speed = 1 + np.cumsum(0.1 * rng.standard_normal(400))
    y = np.cumsum(0.5 * speed) + 2 * rng.standard_normal(400)
    rows = [f"{0.5 * k},{'' if k % 50 == 7 else repr(float(v))}" for k, v in enumerate(y)]
    path.write_text("\n".join(["t,gps", *rows]) + "\n")
    return path


def written(folder, text):
    path = folder / "system.toml"
    path.write_text(text)
    return path


def read(way):
    return np.genfromtxt(way, delimiter=",", skip_header=1)[:, 1]


def test_the_example_of_the_error_is_a_file_that_works(call, way, tmp_path):
    code, shown, told = call("run", way, "--plant", written(tmp_path, matricesfile.EXAMPLE), "-o", "gps", "-t", "t")
    assert code == 0 and "position" in shown and "speed" in shown and "log evidence" in shown
    assert "times what was given" in " ".join((shown + told).split())


def test_it_is_the_estimator_on_the_table(call, way, tmp_path):
    system = written(tmp_path, "[matrices]\nF = [[1, 0.5], [0, 1]]\nH = [1, 0]\nQ = [0, 0.01]\nR = 4.0\nP0 = 100\n")
    results, page = tmp_path / "way.json", tmp_path / "way.html"
    code, _, _ = call("run", way, "--plant", system, "-o", "gps", "-t", "t", "--json", results, "--report", page)
    assert code == 0 and "Bands: two standard deviations" in page.read_text()
    est = dw.StateSpace([[1, 0.5], [0, 1]], H=[1, 0], Q=[0, 0.01], R=4.0, P0=100.0, dt=0.5)
    trace = est.scan(read(way))
    found = json.loads(results.read_text())["summary"]
    assert found["loglik"] == pytest.approx(est.loglik(trace.state), rel=1e-12)
    assert [one["value"] for one in found["estimates"]] == pytest.approx(trace.estimates[-1].tolist(), rel=1e-12)


def test_a_differential_equation_goes_by_the_instants_of_the_table(call, way, tmp_path):
    lines = way.read_text().splitlines()
    thinned = tmp_path / "thinned.csv"
    kept = [line for k, line in enumerate(lines) if k == 0 or k % 3 != 1]
    thinned.write_text("\n".join(kept) + "\n")
    text = "[matrices]\nF = [[0, 1], [0, 0]]\nH = [1, 0]\nQ = [0, 0.02]\nR = 4.0\nP0 = 100\ncontinuous = true\n"
    results = tmp_path / "way.json"
    code, _, _ = call(
        "run", thinned, "--plant", written(tmp_path, text), "-o", "gps", "-t", "t", "--dt", "0.5", "--json", results
    )
    table = np.genfromtxt(thinned, delimiter=",", skip_header=1)
    est = dw.StateSpace([[0, 1], [0, 0]], H=[1, 0], Q=[0, 0.02], R=4.0, P0=100.0, dt=0.5, continuous=True)
    found = json.loads(results.read_text())["summary"]
    assert code == 0
    assert found["loglik"] == pytest.approx(est.loglik(est.scan(table[:, 1], time=table[:, 0]).state), rel=1e-9)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[matrices]\nF = 1\nQ = 1\n", "[matrices] needs R"),
        ("[matrices]\nF = 1\nQ = 1\nR = 1\nB = 1\n", "'B' is no entry of [matrices]"),
        ("[matrices]\nF = 1\nQ = 1\nR = 1\n[plant]\nA = 1\n", "'plant' is no section beside [matrices]"),
        ("[matrices]\nF = 1\nQ = -1\nR = 1\n", "Q must not be negative"),
        ("[matrices]\nF = 1\nQ = 1\nR = 1\ntune = ['P']\n", "tune lists what is learnt"),
        ("[matrices]\nF = 1\nQ = 1\nR = 1\nscale = 2\n", "scale is [alpha, beta]"),
        ("[matrices]\nF = 1\nH = [[1], [1]]\nQ = 1\nR = 1\n", "H has 2 rows and G 0 columns, and 1 outputs"),
        ("matrices = 1\n", "[matrices] is a section"),
    ],
)
def test_a_file_that_does_not_fit_is_a_sentence(call, way, tmp_path, text, said):
    code, _, told = call("run", way, "--plant", written(tmp_path, text), "-o", "gps", "-t", "t")
    assert code == 2 and said in " ".join(told.split())
