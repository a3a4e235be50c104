"""Changes that several columns of a table have in common."""

from __future__ import annotations

import json

import numpy as np
import pytest
from draws import draws
from driftwise_studies.score.claims.common_dates import rig

import driftwise as dw
from driftwise.analysis.together import together

NAMES = "Pressure", "Current", "Flow", "Temperature", "Voltage", "Vibration", "Level", "Speed"


def named(columns) -> dict[str, np.ndarray]:
    return dict(zip(NAMES, columns))


def test_a_fault_that_moves_several_columns_by_little_is_told():
    one = rig(11, 4, True)
    (found,) = together(named(one.columns))
    assert abs(found.since - one.first) < 20
    assert found.interval[0] <= one.first <= found.interval[1]
    true = {name: size for name, size in zip(NAMES, one.sizes) if size}
    assert all(true[name] * move > 0 for name, move in found.moves.items())
    assert len(found.moves) >= 4


@draws("numbers", range(2), range(6))
def test_steady_rigs_have_none(numbers):
    assert not any(together(named(rig(11, number, False).columns)) for number in numbers)


def test_something_slow_that_all_follow_is_no_change():
    rng = np.random.default_rng(3)
    for _ in range(4):
        slow = np.cumsum(rng.standard_normal(800)) / 5
        assert not together({name: slow * rng.uniform(0.5, 2) + rng.standard_normal(800) for name in NAMES[:5]})


def test_what_happens_again_and_again_is_how_the_plant_is_run():
    rng = np.random.default_rng(4)
    level = np.repeat([0.0, 3.0, 1.0, 4.0, 0.0, 2.0, 5.0, 1.0], 100)
    assert not together({name: level + rng.standard_normal(800) for name in NAMES[:4]})


@pytest.fixture(scope="module")
def faulty(tmp_path_factory):
    """A file of six columns of which nobody can say which is the output."""
    rng, rows = np.random.default_rng(5), np.arange(500)
    moved = (rows >= 260) & (rows < 400)
    columns = {name: rng.standard_normal(500).round(3) + 1.5 * moved * (k % 2) for k, name in enumerate(NAMES[:6])}
    path = tmp_path_factory.mktemp("together") / "rig.csv"
    lines = [";".join(["time_s", *columns]), *(";".join(map(str, row)) for row in zip(rows, *columns.values()))]
    path.write_text("\n".join(lines))
    return path


def test_it_is_told_where_the_output_is_asked_for(call, faulty, tmp_path):
    code, out, _ = call("run", faulty, "--json", tmp_path / "asked.json")
    assert code == 3
    assert "several columns changed together: 'Current' rose by" in out
    assert "until " in out
    (told,) = json.loads((tmp_path / "asked.json").read_text())["together"]
    assert sorted(told["moves"]) == ["Current", "Temperature", "Vibration"]
    assert abs(told["time"] - 260) < 10
    assert abs(told["end"] - 400) < 10


def test_it_is_a_claim_of_the_answer(faulty):
    found = dw.identify(str(faulty), output="Temperature", input=())
    (claim,) = [claim for claim in found.claims if claim.kind == "together"]
    assert claim.text in found.words
    assert claim.interval[0] <= 260 <= claim.interval[1]
    assert claim.odds > 1000
    assert not any(isinstance(one.value, dict) for one in found.claims if one.kind == "change")  # "no jump was found"


def test_a_change_of_one_column_is_told_where_no_part_is_known(call, tmp_path):
    rng, moved = np.random.default_rng(11), np.arange(600) >= 350
    columns = {name: rng.standard_normal(600).round(3) + 4 * moved * (name == "Flow") for name in NAMES[:4]}
    (found,) = together(columns)
    assert list(found.moves) == ["Flow"]
    rows = (",".join(map(str, row)) for row in zip(*columns.values()))
    (tmp_path / "one.csv").write_text("\n".join([",".join(columns), *rows]))
    code, out, _ = call("run", tmp_path / "one.csv")
    assert code == 3
    assert "'Flow' rose by" in out
    assert "what moved it the table does not say" in out


def test_an_input_that_steps_is_no_news():
    rng, step = np.random.default_rng(6), np.where(np.arange(600) < 300, 0.0, 4.0)
    heater = step + 0.3 * rng.standard_normal(600)
    temperature = np.convolve(heater, 0.2 * 0.8 ** np.arange(40))[:600] + 0.1 * rng.standard_normal(600)
    found = dw.identify({"heater": heater, "temperature": temperature}, output="temperature", input="heater")
    assert not found.together
