"""Cause and effect by fits in both directions, and the question where nothing decides."""

from __future__ import annotations

import json
import shlex

import numpy as np
import pytest
from draws import slow

import driftwise as dw
from driftwise.analysis.directions import explained, settled
from driftwise.tables.table import open_table

QUESTION = 3


def plant(seed, samples=600, delay=1, memory=0.7, pole=0.8):
    """Return the output and the input of a plant; what drives it has a memory of its own."""
    rng = np.random.default_rng(seed)
    u, y = np.zeros(samples), np.zeros(samples)
    for k in range(1, samples):
        u[k] = memory * u[k - 1] + rng.normal()
        y[k] = pole * y[k - 1] + (u[k - delay] if k >= delay else 0.0)
    return y + 0.1 * rng.normal(size=samples), u


@pytest.fixture
def even(tmp_path):
    """A table of two columns that have nothing to do with one another."""
    a, b = np.random.default_rng(3).normal(size=(2, 400)).cumsum(axis=1)
    path = tmp_path / "even table.csv"
    path.write_text("ch 1,ch 2\n" + "".join(f"{x:.4f},{y:.4f}\n" for x, y in zip(a, b)))
    return path


@pytest.mark.parametrize("delay", [1, 4, 30])
@pytest.mark.parametrize("seed", [0, *map(slow, (1, 2, 3))])
def test_names_that_say_nothing_in_either_order(seed, delay):
    y, u = plant(seed, delay=delay)
    for columns in ({"a": y, "b": u}, {"a": u, "b": y}):
        table = settled(open_table(columns))
        assert columns[table.output] is y and not table.is_ambiguous
        assert "the past of the others" in table[table.output].why


def test_the_likelihood_gained_is_that_of_two_regressions():
    """An oracle of numpy's own least squares: all lags of both columns, and of one alone."""
    y, u = plant(1, samples=300)
    rows = np.arange(48, 300)
    lags = [slice(k, k + 1) for k in range(1, 7)]

    def past(x):
        means = [
            np.array([x[t - last : t - first + 1].mean() for t in rows])
            for first, last in ((7, 12), (13, 24), (25, 48))
        ]
        return np.column_stack([*(x[rows - one.start] for one in lags), *means])

    def left(A):
        return np.linalg.lstsq(A, y[rows], rcond=None)[1][0]

    one = np.ones((rows.size, 1))
    before, after = left(np.hstack((one, past(y)))), left(np.hstack((one, past(y), past(u))))
    nats = 0.5 * rows.size * np.log(before / after) - 4.5 * np.log(rows.size)
    assert explained({"y": y, "u": u})["y"].nats == pytest.approx(nats, rel=1e-4)


def test_names_decide_before_fits():
    y, u = plant(0)
    assert settled(open_table({"temperature": u, "heater": y})).output == "temperature"
    assert settled(open_table({"a": y, "b": u}), output="b").output == "b"


def test_what_says_nothing_is_asked(even):
    table = settled(open_table(even))
    assert table.is_ambiguous and [one.output for one in table.alternatives] == ["ch 1", "ch 2"]
    assert sum(one.share for one in table.alternatives) == pytest.approx(1.0)


def test_identify_goes_on_with_the_likelier_and_says_so(even):
    found = dw.identify(str(even))
    assert found.is_ambiguous and found.alternatives[0].output == found.table.output
    assert found.words.startswith("The columns can be read in more than one way, and the likelier is taken: 'ch 1'")
    y, u = plant(0)
    found = dw.identify({"heater": u, "temperature": y})
    assert not found.is_ambiguous and found.alternatives == ()


def test_run_asks_and_takes_neither(call, even, tmp_path):
    page, results = tmp_path / "page.html", tmp_path / "results.json"
    code, out, _ = call("run", even, "--report", page, "--json", results)
    assert code == QUESTION and not page.exists()
    said = json.loads(results.read_text())
    assert set(said) == {"driftwise", "alternatives"} and len(said["alternatives"]) == 2
    for one in said["alternatives"]:
        assert one["command"] in out and one["evidence"] in out
        words = shlex.split(one["command"])
        assert words[:3] == ["driftwise", "run", str(even)] and words[words.index("-o") + 1] == one["output"]


def test_the_command_that_was_shown_and_take_best_are_answered(call, even, tmp_path):
    results = tmp_path / "results.json"
    code, out, _ = call("run", even, "--take-best", "--json", results)
    assert code == 0 and "The columns can be read in more than one way, and the likelier is taken" in out
    said = json.loads(results.read_text())
    assert len(said["alternatives"]) == 2 and said["columns"]["output"] == said["alternatives"][0]["output"]
    code, out, _ = call("run", even, "--model", "auto", "-o", "ch 2")
    assert code == 0 and "more than one way" not in out


@pytest.mark.parametrize("seed", [0, slow(1)])
def test_a_slow_answer_measured_at_every_fifth_row_is_the_effect(seed):
    """No row has all rows of its past: regressions have nothing to go by, a response has."""
    rng = np.random.default_rng(seed)
    u, y = np.repeat(rng.normal(size=20), 30), np.zeros(600)
    for k in range(1, 600):
        y[k] = 0.9 * y[k - 1] + 0.1 * u[k - 1]
    y = np.where(np.arange(600) % 5 == 0, y + 0.05 * rng.normal(size=600), np.nan)
    for columns in ({"a": y, "b": u}, {"a": u, "b": y}):
        table = settled(open_table(columns))
        assert columns[table.output] is y and not table.is_ambiguous


def test_columns_that_are_as_likely_as_those_shown_are_named(tmp_path, call):
    columns = np.random.default_rng(5).normal(size=(4, 400)).cumsum(axis=1)
    path = tmp_path / "four.csv"
    rows = [",".join(f"{x:.4f}" for x in row) for row in columns.T]
    path.write_text("\n".join(["ch 1,ch 2,ch 3,ch 4", *rows, ""]))
    code, out, _ = call("run", path)
    assert (
        code == QUESTION
        and "whoever knows names it, with -o" in out
        and "none of 'ch 3' and 'ch 4'" in " ".join(out.split())
    )


@pytest.mark.parametrize(("samples", "delay"), [(400, 16), (700, 33)])
def test_an_input_that_acts_later_than_the_first_look_goes_is_taken_and_a_column_beside_is_not(samples, delay):
    y, u = plant(5, samples, delay, memory=0.0)
    beside = np.random.default_rng(6).normal(size=samples)
    table = settled(open_table({"a": y, "b": u, "c": beside}))
    assert table.inputs == ("b",) and "No column drives it" not in table.words
    assert table["b"].helps > 0.02 and table["c"].role == "spare"


def test_an_input_of_few_rows_that_a_response_finds_is_taken():
    """What says which column is the effect says what drives it, too."""
    rng = np.random.default_rng(2)
    u, y = rng.normal(size=420), np.zeros(420)
    for k in range(2, 420):
        y[k] = 1.9 * y[k - 1] - 0.905 * y[k - 2] + 0.01 * u[k - 2]
    y = np.where(np.arange(420) % 7 == 0, y + 0.02 * rng.normal(size=420), np.nan)
    table = settled(open_table({"a": y, "b": u}))
    assert (table.output, table.inputs) == ("a", ("b",))


def test_who_says_that_nothing_drives_it_is_believed():
    y, u = plant(7, delay=20)
    assert settled(open_table({"a": y, "b": u}), inputs=()).inputs == ()
