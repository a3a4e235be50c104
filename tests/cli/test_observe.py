"""A known plant from the command line: the file it is read from, what is printed, saved and drawn."""

import json
from pathlib import Path

import numpy as np
import pytest

import driftwise as dw

CART = """
[plant]
states = ["position", "speed"]
A = [[0, 1], [0, 0]]
B = [0, 1]

[[disturbance]]
name = "push"
into = [0, 1]
prior_std = inf

[derived.acceleration]
push = 1
u = 1

[observer]
window = 0.5
noise_std = 0.01
hold = "zoh"
"""


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    """A cart that is pushed: position every 10 ms, the known force, and a constant push of 0.3."""
    path = tmp_path_factory.mktemp("cart") / "cart.csv"
    t = np.arange(400) * 0.01
    u = np.sign(np.sin(3 * t))
    speed = np.concatenate([[0.0], np.cumsum((u + 0.3) * 0.01)[:-1]])
    position = np.concatenate([[0.0], np.cumsum(speed * 0.01 + (u + 0.3) * 0.01**2 / 2)[:-1]])
    y = position + 0.01 * np.random.default_rng(1).standard_normal(400)
    np.savetxt(path, np.column_stack([t, y, u]), delimiter=",", header="t,pos,force", comments="", fmt="%.17g")
    return path


@pytest.fixture
def plant(tmp_path):
    """Write a plant file and return its path."""

    def write(text=CART):
        path = tmp_path / "cart.toml"
        path.write_text(text)
        return path

    return write


def run(call, record, plant, *options):
    return call("run", record, "-o", "pos", "-i", "force", "-t", "t", "--plant", plant, *options)


def test_every_number_is_the_librarys(call, record, plant, tmp_path):
    table, results, page = (tmp_path / name for name in ("out.csv", "out.json", "out.html"))
    code, out, err = run(call, record, plant(), "--save", table, "--json", results, "--report", page, "--chunk", "150")
    assert code == 0, err
    y, u = np.loadtxt(record, delimiter=",", skiprows=1).T[1:]
    cart = dw.Plant([[0, 1], [0, 0]], [0, 1], states=("position", "speed"), inputs="force", outputs="pos")
    est = dw.WindowObserver(
        cart, 0.5, noise_std=0.01, hold="zoh", dt=0.01,
        disturbances=dw.models.Polynomial([0, 1], np.inf, name="push"), derived={"acceleration": ([0, 0, 1], [1])},
    )  # fmt: skip
    trace = est.scan(y, u)
    saved = np.genfromtxt(table, delimiter=",", names=True)
    for name, column in trace.columns().items():
        if name != "ready":
            np.testing.assert_allclose(saved[name], column, rtol=1e-12, err_msg=name)
    told = json.loads(results.read_text())["summary"]
    assert [e["name"] for e in told["estimates"]] == ["position", "speed", "push", "acceleration"]
    np.testing.assert_allclose([e["value"] for e in told["estimates"]], trace.estimates[-1])
    np.testing.assert_allclose(told["outputs"][0]["nis"], np.nanmean(trace.innovation**2 / trace.variance), rtol=1e-9)
    value, std = trace.of("push")
    assert abs(value[-1] - 0.3) < 3 * std[-1] and "push" in out
    html = page.read_text()
    assert "Derived outputs" in html and "Disturbances" in html and "http" not in html.split("<body")[0][:500]


def test_uneven_stamps_are_taken_as_they_are(call, record, plant, tmp_path):
    t, y, u = np.loadtxt(record, delimiter=",", skiprows=1).T
    some = np.random.default_rng(2).random(400) > 0.3
    path = tmp_path / "uneven.csv"
    np.savetxt(path, np.column_stack([t, y, u])[some], delimiter=",", header="t,pos,force", comments="")
    code, out, err = run(call, path, plant(CART.replace("window = 0.5", "window = inf")))
    assert code == 0 and "irregular" in out, err


@pytest.mark.parametrize(
    "change, words",
    [
        ([("window = 0.5", 'window = "tune"')], "predicts the next"),
        (
            [("window = 0.5", "window = inf"), ("0.01", '"tune"'), ("= inf\n\n[d", '= inf\nwalk = "tune"\n\n[d')],
            "Noise deviation",
        ),
    ],
)
def test_what_the_record_is_asked_for(call, record, plant, change, words):
    text = CART
    for old, new in change:
        text = text.replace(old, new)
    code, out, err = run(call, record, plant(text))
    assert code == 0 and words in out, err
    value, _, std = out.split("push")[1].split("\n")[0].split()
    assert abs(float(value) - 0.3) < 4 * float(std)


@pytest.mark.parametrize(
    "change, options, message",
    [
        (("[plant]", "[plan]"), (), "'plan' is no section"),
        (("A = [[0, 1], [0, 0]]", "A = [[0, 1]]"), (), "A must be square"),
        (("prior_std = inf", ""), (), "needs prior_std"),
        (("push = 1", "pusch = 1"), (), "'pusch' is no state, disturbance or input"),
        (("noise_std = 0.01", ""), (), "needs window"),
        (("A = ", "A == "), (), "is not a TOML file"),
        (("window = 0.5", "window = 0.01"), (), "window"),
        (("hold", "held"), (), "'held' is no entry of [observer]"),
        (("u = 1", "u = 1"), ("--memory", "auto"), "--memory: with --plant the plant is known"),
        (("u = 1", "u = 1"), ("--order", "3"), "--order: with --plant"),
    ],
)
def test_what_is_wrong_is_one_line(call, record, plant, change, options, message):
    code, _, err = run(call, record, plant(CART.replace(*change)), *options)
    assert code == 2 and message in err, err


def test_a_command_that_lacks_an_option(call, record, plant):
    path = plant(CART.replace("u = 1", ""))
    code, _, err = call("run", record, "-o", "pos", "-i", "force", "--plant", path)
    assert code == 2 and "--time COLUMN, or --dt" in err, err
    code, _, err = call("run", record, "-o", "pos", "-t", "t", "--plant", path)
    assert code == 2 and "B has 1 columns, and 0 inputs" in err, err
    path = plant("derived = 3" + CART.replace("[derived.acceleration]\npush = 1\nu = 1\n", ""))
    code, _, err = run(call, record, path)
    assert code == 2 and "derived outputs are sections" in err, err


def test_a_plant_file_that_is_not_there(call, record, tmp_path):
    code, _, err = run(call, record, tmp_path / "none.toml")
    assert code == 2 and "No such file" in err


def test_the_example_is_a_plant_file(tmp_path):
    from driftwise.tables.plantfile import EXAMPLE, read

    assert EXAMPLE in (Path(__file__).parents[2] / "docs" / "algebraic.md").read_text()
    (tmp_path / "e.toml").write_text(EXAMPLE)
    options, tuned = read(str(tmp_path / "e.toml"), ["y"], ["u"])
    assert tuned == [0] and options["derived"]["acceleration"] == ([0.0, -2.1, -0.01], [0.37])
