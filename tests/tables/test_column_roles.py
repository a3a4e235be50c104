"""What is output, input, clock, and what is left out, from names, units and values."""

import numpy as np
import pytest
from plants_of_tables import NaN, noisy, plant, taken

from driftwise.engine.errors import InputError
from driftwise.tables.autoread import read
from driftwise.tables.column_roles import parse
from driftwise.tables.recognise import recognise

# --- roles ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name, base, unit",
    [
        ("temp [degC]", "temp", "°C"),
        ("speed (m/s)", "speed", "m/s"),
        ("u_V", "u", "V"),
        ("Druck / bar", "Druck", "bar"),
        ("flow_1e8m3", "flow", "1e8m3"),
        ("CO(GT)", "CO", ""),
        ("PT08.S4(NO2)", "PT08.S4", ""),
        ("step_response", "step_response", ""),
        ("in_out", "in_out", ""),
    ],
)
def test_units_in_names(name, base, unit):
    assert parse(name)[:2] == (base, unit)


def test_what_is_not_a_signal_is_left_out_and_said():
    y, u = plant()
    k = np.arange(400.0)
    stuck = np.where(k < 200, np.sin(k), 0.3)
    table = recognise(
        {
            "no": k,
            "t_ms": 20 * k,
            "valve": u,
            "level_m": y,
            "valve copy": u,
            "spare": 0 * k,
            "probe": stuck,
            "fault": (k > 300) * 1.0,
            "lost": np.full(400, NaN),
            "operator": None,
        }
    )
    roles = {column.name: column.role for column in table.columns}
    assert roles == {
        "no": "counter",
        "t_ms": "time",
        "valve": "input",
        "level_m": "output",
        "valve copy": "duplicate",
        "spare": "constant",
        "probe": "stuck",
        "fault": "label",
        "lost": "empty",
        "operator": "text",
    }
    assert table.dt == pytest.approx(0.02) and table.timed
    for word in ("'level_m'", "'valve'", "the same as 'valve'", "always 0", "0.02 s"):
        assert word in table.words
    assert any("stuck" in note for note in table.notes)


def test_days_of_a_spreadsheet_are_days():
    u, y, _ = noisy(200)
    day = 45381.5 + np.round(np.arange(200) / 1440, 6)
    table = recognise({"time": day, "valve": u, "level": y})
    assert table.timed and table.dt == pytest.approx(60, rel=2e-3) and "days since 1900" in table.notes[0]
    assert not recognise({"time": 45381.5 + np.arange(200) / 1024, "valve": u, "level": y}).timed


def test_a_time_of_day_that_is_used_is_not_said_to_be_left_out(tmp_path):
    u, y, _ = noisy(200)
    rows = [f"30/03/2024,{12 + k // 60}:{k % 60:02d}:00,{a},{b:.3f}" for k, (a, b) in enumerate(zip(u, y))]
    path = tmp_path / "two.csv"
    path.write_text("\n".join(["Date,Time,valve,level", *rows]))
    table = read(path)[0]
    assert table.dt == 60 and "Left out" not in table.words


def test_names_that_say_nothing():
    """The last column is the output, and what helps to predict it comes first; what is given is left alone."""
    y, u = plant()
    rng = np.random.default_rng(3)
    columns = {"a": rng.normal(size=400), "b": u, "c": rng.normal(size=400), "d": y}
    table = recognise(columns)
    assert (table.time, table.output, table.inputs) == (None, "d", ("b",))
    table = recognise(columns, output="b", inputs=["c", "a"])
    assert (table.output, table.inputs) == ("b", ("c", "a"))
    assert recognise(columns, inputs=()).inputs == ()


def test_set_points_act_through_the_drive_unless_that_is_computed_from_the_output():
    rng = np.random.default_rng(0)
    r = np.repeat(rng.integers(0, 4, 20) * 1.0, 20)
    y, drive = np.zeros(400), 5 * r
    for k in range(1, 400):
        y[k] = 0.9 * y[k - 1] + 0.1 * drive[k - 1] + 0.01 * rng.normal()
        drive[k] = 5 * (r[k] - y[k])
    found = recognise({"speed": y, "speed_ref": r, "drive": drive})
    assert found.inputs == ("speed_ref",) and "computed from 'speed' and 'speed_ref'" in found["drive"].why
    found = recognise({"speed": y, "speed_ref": r, "drive": drive + 0.3 * rng.normal(size=400)})
    assert found.inputs == ("drive",) and "acts through" in found["speed_ref"].why


def test_what_comes_after_the_first_rows_does_not_decide():
    y, u = plant()
    other = np.random.default_rng(5).normal(size=400)
    early = read({"a": other, "b": u, "z": y}, head_rows=200)[0]
    late = read({"a": np.r_[other[:200], 50 * y[200:]], "b": np.r_[u[:200], other[200:]], "z": y}, head_rows=200)[0]
    assert (early.inputs, early.words, early.rows) == (late.inputs, late.words, 200)


def test_at_most_four_inputs_the_ones_that_help():
    rng = np.random.default_rng(0)
    u = rng.normal(size=(2000, 9))
    y = np.zeros(2000)
    for k in range(1, 2000):
        y[k] = 0.8 * y[k - 1] + u[k - 1, [1, 3, 5, 7]].sum() + 0.1 * rng.normal()
    table = recognise({**{f"u{j}": u[:, j] for j in range(9)}, "y": y})
    assert table.inputs == ("u1", "u3", "u5", "u7")
    assert "too little" in table["u2"].why


def test_a_step_may_be_an_input_where_there_is_no_other():
    y, u = plant()
    assert recognise({"t_s": np.arange(400.0), "step": u, "response": y}).inputs == ("step",)
    table = recognise({"t_s": np.arange(400.0), "heater": u, "step": np.arange(400) // 50 * 1.0, "response": y})
    assert table.inputs == ("heater",)


@pytest.mark.parametrize(
    "columns, options, words",
    [
        ({"name": None}, {}, "no column of numbers"),
        ({"t_s": np.arange(9.0), "fault": np.ones(9)}, {}, "no column looks like an output"),
        ({"y": np.arange(9.0) ** 2}, {"output": "z"}, "no column of numbers 'z'"),
        ({"y": np.ones(9), "u": np.arange(9.0)}, {"output": "y"}, "always 1"),
    ],
)
def test_tables_without_an_output_say_why(columns, options, words):
    with pytest.raises(InputError, match=words):
        recognise(columns, **options)


# --- in memory, through a pipe, and too long to hold ---------------------------------------------------------


def test_on_and_off_are_an_input(tmp_path):
    y, u = plant()
    file = tmp_path / "switch.csv"
    file.write_text("pump,level\n" + "\n".join(f"{'ON' if a > 50 else 'off'},{b:.6g}" for a, b in zip(u, y)) + "\n")
    table, segments = read(str(file))
    assert table.inputs == ("pump",)
    np.testing.assert_array_equal(taken(segments)[2][:, 0], u > 50)
