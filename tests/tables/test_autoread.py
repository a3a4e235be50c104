"""A newcomer's table: roles from names and values, what is not believed, a regular clock, and files as they come."""

import io
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from driftwise.engine.errors import InputError
from driftwise.tables.autoread import read
from driftwise.tables.cleaning import Cleaner, believe, doubtful
from driftwise.tables.column_roles import parse
from driftwise.tables.recognise import recognise
from driftwise.tables.sampling import LATE, LONGEST_GAP, RESTART_ROWS, Regular, Sampling, judge_sampling
from driftwise.tables.stuck_sensor import still
from driftwise.tables.table import open_table

NaN = np.nan
DATA = Path(os.environ.get("DRIFTWISE_DATA", "no recordings")) / "sysid"


def plant(n=400, seed=0):
    """A valve in steps of 25 % and the first-order level that it drives, with noise."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.integers(0, 5, n // 20) * 25.0, 20)
    y = np.zeros(n)
    for k in range(1, n):
        y[k] = 0.9 * y[k - 1] + 1.2 * u[k - 1] + rng.normal()
    return y, u


def taken(segments):
    """Return (time, y, u) of the whole table."""
    return tuple(np.concatenate(parts) for parts in zip(*segments))


# --- values that cannot be believed --------------------------------------------------------------------------


def dirty(n=3000):
    """A smooth signal with drop-outs of one to three samples to three different values, and two absurd ones."""
    rng = np.random.default_rng(1)
    y = 200 + 30 * np.sin(np.arange(n) / 40) + rng.normal(size=n)
    bad = [100, 101, 500, 502, 900, 901, 902, 1500, 2999 - 40]
    y[bad] = [30, 31, 28, 30, 30, 32, 29, 30, -1e8]
    y[1700] = 3e9
    return y, sorted([*bad, 1700])


def test_drop_outs_are_found_and_the_good_sample_between_two_is_kept():
    y, bad = dirty()
    assert np.flatnonzero(doubtful(y, believe(y))).tolist() == bad


def test_a_rail_is_told_by_three_largest_moves_anything_else_by_eight():
    y = np.random.default_rng(0).normal(size=400)  # moves by up to 4
    at = [50, 51, 120, 200, 300]
    for low, found in ((-8.0, 0), (-25.0, 5)):
        y[at] = low
        assert doubtful(y, believe(y)).sum() == found
    y[at] = [-25, -24, -23, -22, -21]
    assert not doubtful(y, believe(y)).any()


def test_codes_for_missing_only_far_outside_the_others():
    y = np.sin(np.arange(300.0))
    y[40:90] = -999.0
    assert believe(y).codes == (-999.0,) and doubtful(y, believe(y)).sum() == 50
    y = np.linspace(-1500, 1500, 3001)  # a ramp goes through -999
    assert not believe(y).codes


SHAPES = {
    "rain": lambda rng, n: np.where(rng.random(n) < 0.1, rng.gamma(0.4, 15, n), 0).round(1),
    "rare rain": lambda rng, n: np.where(rng.random(n) < 0.01, rng.gamma(0.4, 15, n), 0).round(1),
    "flood": lambda rng, n: np.convolve(np.where(rng.random(n) < 0.03, rng.gamma(0.3, 50, n), 0), 0.6 ** np.arange(30))[
        :n
    ],
    "steps": lambda rng, n: np.repeat(rng.normal(size=n // 50 + 1), 50)[:n] * 100 + rng.normal(size=n),
    "binary": lambda rng, n: np.where(np.cumsum(rng.random(n) < 0.1) % 2, 6.41, 3.41) + 0.01 * rng.normal(size=n),
    "pulses": lambda rng, n: (rng.random(n) < 0.01) * 1.0,
    "heavy-tailed walk": lambda rng, n: np.cumsum(rng.standard_t(2, n)),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_real_moves_are_not_eaten(shape):
    for seed in range(20):
        for n in (300, 3000):
            y = SHAPES[shape](np.random.default_rng(seed), n)
            assert not doubtful(y, believe(y)).any()


def test_a_later_drop_out_must_leave_the_range_and_a_later_step_stays():
    y = np.sin(np.arange(2000.0) / 10)
    belief = believe(y)
    assert not belief.seen
    y[500], y[700:] = 50.0, y[700:] + 80.0
    assert np.flatnonzero(doubtful(y, belief)).tolist() == [500]


@pytest.mark.parametrize("rows", [1, 5, 17, 700])
def test_cleaning_does_not_depend_on_the_chunks(rows):
    y, bad = dirty()
    y[600:630], y[105] = NaN, NaN
    both = np.column_stack((y, y[::-1]))
    cleaner = Cleaner([believe(y), believe(y[::-1])])
    out = [cleaner.push(both[k : k + rows]) for k in range(0, len(y), rows)] + [cleaner.flush()]
    whole = np.concatenate(out)
    assert cleaner.cleaned.tolist() == [len(bad)] * 2
    for j, column in enumerate(both.T):
        np.testing.assert_array_equal(whole[:, j], np.where(doubtful(column, believe(column)), NaN, column))


# --- the clock -----------------------------------------------------------------------------------------------


def test_kinds_of_sampling():
    k = np.arange(200.0)
    rng = np.random.default_rng(0)
    assert judge_sampling(0.1 * k)[:2] == ("regular", 0.1)
    assert judge_sampling(k + 0.02 * rng.random(200)).kind == "regular"
    assert judge_sampling(np.cumsum(rng.uniform(1.0, 2.0, 200))).kind == "uneven"
    assert judge_sampling(np.cumsum(np.where(k % 10 < 8, 0.1, 60.0))).kind == "irregular"
    assert judge_sampling(np.zeros(5)).kind == judge_sampling(np.full(5, NaN)).kind == "none"
    scattered = 15.0 * np.cumsum(rng.geometric(0.25, 300))
    assert judge_sampling(scattered)[:2] == ("irregular", 15.0)  # a clock on which each row has a tick of its own
    assert judge_sampling(scattered + 7e-3 * rng.random(300))[1] == pytest.approx(15.0, abs=0.02)
    gaps = np.concatenate((k[:50], k[60:100], k[150:] + 5000))
    assert (judge_sampling(gaps).gaps, judge_sampling(gaps).restarts) == (1, 1)
    assert judge_sampling(np.concatenate((k, k, k))).restarts == 2
    late = k.copy()
    late[[20, 30]] = [19.0, 28.0]
    assert (judge_sampling(late).duplicates, judge_sampling(late).late) == (1, 1)


def plainly(time, values, dt):
    """Put the rows of a regular record on its clock one by one: the same rules, none of the code."""
    out, rows, shift, last, before = [], [], 0.0, None, None
    for row, (t, v) in enumerate(zip(time, values)):
        if np.isnan(t) and before is None:
            continue
        if np.isnan(t):
            t = before + dt
        if before is not None and t - before < -LATE * dt:
            shift += before - t + (RESTART_ROWS + 1) * dt
        before = t
        if last is not None and t + shift <= last:
            continue
        lost = 0 if last is None else (t + shift - last) / dt
        lost = round(lost) - 1 if lost > 1.75 else 0
        lost = RESTART_ROWS if lost > LONGEST_GAP else lost
        out += [[NaN, NaN]] * lost + [v.tolist()]
        rows += [-1] * lost + [row]
        last = t + shift
    return np.array(out), np.array(rows)


def wild_stamps():
    """Stamps with a gap, a repetition, late rows, holes, a restart and a long silence."""
    time = np.concatenate((np.arange(40), np.arange(50, 90), np.arange(30), 5000 + np.arange(30))).astype(float)
    time[[10, 45, 60, 111]] = [9.0, 52.0, NaN, NaN]
    return time, np.column_stack((np.arange(140.0), -np.arange(140.0)))


def pushed(clock, time, values, rows):
    parts = [clock.push(time[k : k + rows], values[k : k + rows]) for k in range(0, len(time), rows)]
    return tuple(np.concatenate(part) for part in zip(*parts, clock.flush()))


@pytest.mark.parametrize("rows", [1, 7, 140])
def test_a_regular_clock_as_written_out_plainly(rows):
    stamps, values = wild_stamps()
    stamps[:3] = NaN
    clock = Regular(Sampling("regular", 1.0))
    time, out, source = pushed(clock, stamps, values, rows)
    wanted, origin = plainly(stamps, values, 1.0)
    np.testing.assert_array_equal(out, wanted)
    np.testing.assert_array_equal(source, origin)
    assert np.all(np.diff(time) > 0)
    assert (clock.inserted, clock.dropped, clock.restarts) == (
        int(np.isnan(wanted[:, 0]).sum()),
        140 - (origin >= 0).sum(),
        2,
    )


@pytest.mark.parametrize("rows", [1, 7, 140])
def test_irregular_rows_are_sampled_and_held(rows):
    stamps = np.cumsum(np.concatenate((np.full(50, 0.25), np.full(40, 3.0), [5000.0], np.full(49, 1.0)))) - 0.25
    values = np.column_stack((np.arange(140.0), -np.arange(140.0)))
    clock = Regular(Sampling("irregular", 1.0), [False, True])
    time, out, source = pushed(clock, stamps, values, rows)
    assert np.all(np.diff(time) > 0)
    for t, (y, u), row in zip(time, out, source):  # each tick: the last row at or before it
        last = np.flatnonzero(stamps <= t + 1e-9)[-1]
        assert row in (-1, last) and (y == last if row >= 0 else np.isnan(y))
        assert u == -last or (np.isnan(u) and 132.0 < t < 5133)
    assert clock.restarts == 1 and np.isnan(out[:, 1]).sum() == RESTART_ROWS
    assert set(source[source >= 0]) >= set(range(50, 140))  # nothing of the slow part is lost
    assert clock.dropped == 140 - (source >= 0).sum()


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


def noisy(samples=1500):
    """Return heater and temperature of a plant, and a generator for more."""
    y, u = plant(samples)
    rng = np.random.default_rng(7)
    return u, y + 0.01 * rng.standard_normal(samples), rng


@pytest.mark.parametrize("first, last, where", [(1301, 1500, "from row 1301 on"), (701, 730, "from row 701 to 730")])
def test_what_a_stuck_sensor_reads_is_missing_and_the_rest_is_not(first, last, where):
    u, y, _ = noisy()
    y[first - 1 : last] = y[first - 1]
    table = recognise({"valve": u, "level": y})
    assert (table.output, table.inputs) == ("level", ("valve",))
    assert table.notes[0] == f"'level' reads {y[first - 1]:.6g} {where}: stuck, and taken as missing there."
    for rows in (7, 100, 2000):
        segments = read({"valve": u, "level": y}, chunk_rows=rows)[1]
        lost = np.flatnonzero(np.isnan(np.concatenate([part[1] for part in segments])))
        assert lost.tolist() == list(range(first - 1, last))


@pytest.mark.parametrize("rows", [7, 100, 2000])
def test_a_stuck_sensor_is_one_beside_missing_cells_and_coarse_steps(rows):
    """Cells that are missing meanwhile are no readings; steps repeat themselves, but not for as long."""
    u, y, rng = noisy()
    coarse = np.round(y + 0.15 * rng.standard_normal(1500), 1)
    with_gaps = np.where(rng.random(1500) < 0.2, NaN, y)
    for level in (with_gaps, coarse):
        level[700:800] = np.where(np.isnan(level[700:800]), NaN, level[np.flatnonzero(np.isfinite(level))[500]])
        table = recognise({"valve": u, "level": level})
        assert table["level"].stuck and "stuck, and taken as missing there" in " ".join(table.notes)
        segments = read({"valve": u, "level": level}, chunk_rows=rows)[1]
        lost = np.isnan(np.concatenate([part[1] for part in segments]))
        assert lost[700:800].all() and np.array_equal(lost[:700], np.isnan(level[:700]))


def test_what_rests_for_good_reasons_is_not_stuck():
    u, y, rng = noisy()
    k = np.arange(1500)
    at = slice(400, 460)
    rests = {
        "coarse": np.round(y, 1), "switch": np.repeat(rng.choice([0.0, 1.0], 50), 30),
        "ramp": np.clip(np.abs((k % 500) - 250), 100, 200) + 1e-3 * k, "shut": np.maximum(y - np.quantile(y, 0.1), 0.0),
    }  # fmt: skip
    rests["shut"][at] = 0.0
    rests["again"] = y.copy()
    rests["again"][at] = rests["again"][900:960] = 20.0
    for name, values in rests.items():
        assert not recognise({"valve": u, name: values}, output=name)[name].stuck, name
    y[at] = y[400]
    u[at] = 0.0
    assert not recognise({"valve": u, "level": y})["level"].stuck  # nothing moved meanwhile


def test_readings_that_repeat_themselves_say_nothing_where_noise_stops_or_they_end_by_a_leap():
    white = np.random.default_rng(4).standard_normal(1500)
    white[1400:1440] = white[np.argmin(abs(white))]
    assert [one[:2] for one in still(white)] == [(1400, 1440)]
    turned = np.sin(np.arange(1500) / 20)  # without noise
    held = turned.copy()
    held[460:560] = held[460]
    assert [one[:2] for one in still(held)] == [(460, 560)]
    rests = np.concatenate([turned[:461], np.full(100, turned[460]), turned[461:]])
    assert still(rests) == [] and still(held[:550]) == [] and still(turned) == []


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


# --- the newcomer's files ------------------------------------------------------------------------------------


def german(x, digits):
    return f"{x:,.{digits}f}".translate(str.maketrans(",.", ".,"))


def files(folder):
    """Write the table of `plant` the way people do; return the paths by what they are."""
    y, u = plant()
    clock = [f"31.12.2024 {13 + s // 3600}:{s // 60 % 60:02d}:{s % 60:02d}" for s in range(2700, 3100)]
    made = {
        "german": "\ufeffZeitstempel;Temperatur [°C];Ventilstellung [%];Bemerkung\r\n"
        + "".join(f"{t};{german(a, 3)};{german(b, 1)};ok\r\n" for t, a, b in zip(clock, y, u)),
        "groups": "Test rig 7,,,\nTime,Boiler,,\n,Temperature,Pressure,Heater\ns,degC,bar,%\n"
        + "".join(f'{k},{a:.3f},{a / 500 + 1:.4f},"{b:.1f}"\n' for k, (a, b) in enumerate(zip(y, u))),
        "semicolons": "# exported\nsep=;\nMessung Heizkreis 1;;;\nZeit;Vorlauf;Ventil;\n[s];[°C];[%];\n".removeprefix(
            "# exported\n"
        )
        + "".join(f"{k};{german(a, 3)};{german(b, 0)};\n" for k, (a, b) in enumerate(zip(y, u))),
        "american": 'Date,"Tank level, in",Pump\n'
        + "".join(
            f"12/31/2024 {1 + s // 3600}:{s // 60 % 60:02d}:{s % 60:02d} PM,{a:.3f},{b}\n"
            for s, a, b in zip(range(400), y, u)
        ),
    }
    paths = {}
    for name, text in made.items():
        paths[name] = folder / f"{name}.csv"
        paths[name].write_bytes(text.encode())
    stamps = pa.array(np.datetime64("2024-12-31T13:45", "ms") + 1000 * np.arange(400))
    level = pa.array([None if k in (7, 8) else v for k, v in enumerate(y.round(3))])
    frame = pa.table({"timestamp": stamps, "level": level, "pump": u, "note": ["a", None] * 200})
    keep = [k for k in range(400) if k not in (100, 101)]
    paths["parquet"] = folder / "table.parquet"
    pq.write_table(frame.take(keep), paths["parquet"], row_group_size=150)
    return paths, y.round(3), u


ROLES = {
    "german": ("Zeitstempel", "Temperatur [°C]", ("Ventilstellung [%]",), "°C"),
    "groups": ("Time", "Boiler Temperature", ("Boiler Heater",), "°C"),
    "semicolons": ("Zeit", "Vorlauf", ("Ventil",), "°C"),
    "american": ("Date", "Tank level, in", ("Pump",), ""),
    "parquet": ("timestamp", "level", ("pump",), ""),
}


@pytest.mark.parametrize("kind", ROLES)
def test_files_as_they_come(kind, tmp_path):
    paths, y, u = files(tmp_path)
    table, segments = read(paths[kind], chunk_rows=90)
    time, outputs, inputs = taken(segments)
    assert (table.time, table.output, table.inputs, table[table.output].unit) == ROLES[kind]
    np.testing.assert_allclose(time, np.arange(400), atol=1e-9)
    hole = [7, 8, 100, 101] if kind == "parquet" else []
    y[hole], u[hole[2:]] = NaN, NaN
    np.testing.assert_array_equal(outputs, y)
    np.testing.assert_array_equal(inputs[:, 0], u)
    assert sum(segments.cleaned.values()) == 0


def recording(name):
    if not (DATA / name).exists():
        pytest.skip(f"set DRIFTWISE_DATA to the folder of recordings: {name} is not in {DATA}")
    return DATA / name


def test_the_soldering_station():
    """A header too short, uneven stamps, a set point of -1e8, drop-outs to 25.235, a column of nothing."""
    table, segments = read(recording("soldering_station.csv"))
    time, y, u = taken(segments)
    for mine, theirs in zip(taken(read(recording("soldering_station.csv"), chunk_rows=10)[1]), (time, y, u)):
        np.testing.assert_array_equal(mine, theirs)
    assert (table.time, table.output, table.inputs) == ("Time", "temperature", ("setpoint",))
    assert table["column6"].role == "empty" and table.sampling.kind == "uneven" and 1.1 < table.dt < 1.2
    assert segments.cleaned == {"temperature": 28, "setpoint": 1}
    assert np.nanmin(y) > 100 and np.nanmin(u) > 100 and len(y) == 1749 and time[-1] == pytest.approx(2310, abs=10)
    told = " ".join([*table.notes, *segments.notes()])
    assert "28 values" in told and "25.235" in told and "unevenly" in told


RECORDS = {
    "ahu_faults_szvav.csv": ("Supply_Air_T", {"Cooling_Coil_Valve", "Heating_Coil_Valve"}),
    "building_heat_load.csv": ("heatload_kW", {"Ta_obs_degC", "I_obs_Wm2", "Ta_fc1_degC", "I_fc1_Wm2"}),
    "canning_rainfall_flow.csv": ("flow_mm", {"rain_mm", "pet_mm"}),
    "dc_motor_hoop_random.csv": ("speed_V", {"u"}),
    "emps_train.csv": ("position_m", {"u_V"}),
    "gas_furnace.csv": ("co2_percent", {"gas_rate"}),
    "hair_dryer.csv": ("air_temp_V", {"heater_V"}),
    "heat_exchanger.csv": ("outlet_temp", {"flow"}),
    "heating_system.csv": ("temp_degC", {"drive_V"}),
    "hydraulic_hanging_load.csv": ("position", {"reference"}),
    "leaf_cell_hppc_25C.csv": ("voltage_V", {"current_A"}),
    "mur_groundwater.csv": ("head_m", {"river_m", "prec_mm", "evap_mm"}),
    "nile.csv": ("flow_1e8m3", set()),
    "robot_arm.csv": ("acceleration", {"reaction_torque"}),
}


@pytest.mark.parametrize("name", RECORDS)
def test_recordings_get_the_parts_an_engineer_would_give_them(name):
    table, segments = read(recording(name))
    output, inputs = RECORDS[name]
    assert table.output == output and len(table.inputs) <= 4
    assert set(table.inputs) == inputs if "ahu" not in name else set(table.inputs) > inputs
    for _ in segments:
        pass
    assert sum(segments.cleaned.values()) == 0  # rain, floods, pulses and faults are real


def test_a_labelled_rig_is_not_driven_by_its_labels():
    table, _ = read(recording("skab/valve1_0.csv"))
    assert {table["anomaly"].role, table["changepoint"].role} == {"label"}
    assert table.dt == 1 and table.time == "datetime"


def test_dates_and_times_of_day_in_two_columns(tmp_path):
    y, u = plant()
    clock = [(23 * 3600 + 59 * 60 + s) % 86_400 for s in range(400)]
    hours = [f"{s // 3600:02d}:{s // 60 % 60:02d}:{s % 60:02d}" for s in clock]
    text = "".join(f"{30 + (s < 80000)}.12.2024;{h};{a:.3f};{b}\n" for s, h, a, b in zip(clock, hours, y, u))
    for header, cut in (("Datum;Uhrzeit;Stand;Ventil\n", 0), ("Uhrzeit;Stand;Ventil\n", 11)):
        path = tmp_path / f"{cut}.csv"
        path.write_text(header + "".join(line[cut:] + "\n" for line in text.splitlines()))
        table, segments = read(path, chunk_rows=50)
        time, outputs, _ = taken(segments)
        assert (table.output, table.inputs, table.dt, table.timed) == ("Stand", ("Ventil",), 1.0, True)
        np.testing.assert_array_equal(time - time[0], np.arange(400))
        np.testing.assert_array_equal(outputs, y.round(3))


# --- in memory, through a pipe, and too long to hold ---------------------------------------------------------


def test_frames_and_mappings():
    pandas, polars = pytest.importorskip("pandas"), pytest.importorskip("polars")
    y, u = plant()
    columns = {"when": np.datetime64("2024-01-01", "ms") + 250 * np.arange(400), "pump": u, "level": y}
    frame = pandas.DataFrame(columns)
    wanted = taken(read(columns)[1])
    for data in (frame, frame.set_index("when"), polars.DataFrame(columns).lazy(), pa.table(columns)):
        table, segments = read(data, chunk_rows=100)
        assert (table.output, table.inputs, table.dt) == ("level", ("pump",), 0.25)
        for mine, theirs in zip(taken(segments), wanted):
            np.testing.assert_array_equal(mine, theirs)
    for data, words in (
        (np.ones((5, 2)), "An array has no names"),
        ({"y": np.ones((5, 2))}, "one dimension"),
        ({"y": np.ones(5), "u": np.ones(4)}, "differ in length"),
        ({}, "no columns"),
    ):
        with pytest.raises(InputError, match=words):
            read(data)


def test_standard_input_and_what_is_not_asked_for_is_not_converted(monkeypatch):
    y, u = plant()
    text = "t_s,valve,level,spare\n" + "".join(f"{k},{a},{b},{0}\n" for k, (a, b) in enumerate(zip(u, y)))
    monkeypatch.setattr("driftwise.tables.csvfile.BLOCK", 1000)
    monkeypatch.setattr("driftwise.tables.csvfile.HEAD", 1000)
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text.encode())))
    table = open_table("-", chunk_rows=50, head_rows=70)
    asked = []
    batches = table.source.batches
    monkeypatch.setattr(table.source, "batches", lambda names: asked.append(list(names)) or batches(names))
    chunks = list(table.chunks(["level", "valve"]))
    assert asked == [["level", "valve"]] and [len(chunk["level"]) for chunk in chunks] == [50] * 8
    np.testing.assert_array_equal(np.concatenate([chunk["level"] for chunk in chunks]), y)


def write_long(path, rows):
    from pyarrow import csv

    writer = None
    for first in range(0, rows, 500_000):
        k = np.arange(first, min(first + 500_000, rows))
        u = np.sign(np.sin(k / 50))
        part = pa.table(
            {"t_s": (0.01 * k).round(2), "heater": u, "temp": (np.sin(k / 50 - 1) + 1e-3 * (k % 7)).round(4)}
        )
        writer = writer or csv.CSVWriter(path, part.schema)
        writer.write(part)
    writer.close()


def test_a_long_file_is_read_chunk_by_chunk(tmp_path):
    path = str(tmp_path / "long.csv")
    write_long(path, 300_000)
    segments = read(path, chunk_rows=20_000)[1]
    y = next(segments)[1]
    assert len(y) <= 20_000 and segments.table.source.fraction < 0.5
    sizes = [len(y)] + [len(part) for _, part, _ in segments]
    assert sum(sizes) == 300_000 and max(sizes) <= 20_000 and segments.table.source.fraction == 1.0


@pytest.mark.slow
def test_ten_million_rows_in_constant_memory(tmp_path):
    """Peak memory of a process of its own, at a million and at ten million rows."""
    script = """
import sys
from driftwise.tables.autoread import read
table, segments = read(sys.argv[1])
rows = sum(len(y) for _, y, _ in segments)
print(rows, next(int(line.split()[1]) // 1024 for line in open("/proc/self/status") if line.startswith("VmHWM")))
"""
    peaks = []
    for rows in (1_000_000, 10_000_000):
        path = str(tmp_path / "long.csv")
        write_long(path, rows)
        out = subprocess.run([sys.executable, "-c", script, path], capture_output=True, text=True, check=True).stdout
        count, peak = map(int, out.split())
        assert count == rows
        peaks.append(peak)
    assert peaks[1] < peaks[0] + 30 and peaks[1] < 300, peaks


def test_the_newest_row_first_is_turned_round(tmp_path):
    y, u = plant()
    rows = [f"{k},{a},{b:.6g}" for k, (a, b) in enumerate(zip(u, y))]
    file = tmp_path / "backwards.csv"
    file.write_text("time_s,valve,level\n" + "\n".join(rows[::-1]) + "\n")
    table, segments = read(str(file))
    assert table.time == "time_s" and "the rows were turned round" in table.notes[0]
    np.testing.assert_allclose(taken(segments)[1], y, rtol=1e-5)
    with pytest.raises(InputError, match="sort its rows"):
        read({"time_s": np.arange(400.0)[::-1], "valve": u, "level": y}, head_rows=100)


def test_on_and_off_are_an_input(tmp_path):
    y, u = plant()
    file = tmp_path / "switch.csv"
    file.write_text("pump,level\n" + "\n".join(f"{'ON' if a > 50 else 'off'},{b:.6g}" for a, b in zip(u, y)) + "\n")
    table, segments = read(str(file))
    assert table.inputs == ("pump",)
    np.testing.assert_array_equal(taken(segments)[2][:, 0], u > 50)


def test_a_header_with_fewer_cells_than_the_rows_and_units(tmp_path):
    y, u = plant()
    rows = "\n".join(f"{5 * k};{b:.6g};{a};" for k, (a, b) in enumerate(zip(u, y)))
    file = tmp_path / "logger.csv"
    file.write_text(f"Logger 3;;\nTime;Temperature;Valve\n[s];[degC];[%]\n{rows}\n")
    table = read(str(file))[0]
    assert (table.output, table.inputs, table.dt, table.timed) == ("Temperature", ("Valve",), 5.0, True)
    assert table["Temperature"].unit == "°C"
