"""Rows of a long table into samples of a fleet: against plain loops over one series after the other, bit for bit."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

import driftwise as dw
from driftwise.engine.errors import InputError
from driftwise.engine.status import Status
from driftwise.fleet import intake as intakes
from driftwise.fleet.counters import COLUMNS, Tally
from driftwise.fleet.intake import Intake, Taken
from driftwise.models.canonical import power_of_two

ROWS, SERIES = 1500, 12
EST = dw.ARX(1, 1)


def table(seed, has_clock=True):
    """Rows of mixed series: of very different sizes, with holes, repeated and late times, rows without key or time."""
    rng = np.random.default_rng(seed)
    codes = rng.integers(0, SERIES, ROWS)
    codes[-30:] = SERIES - 1  # and one that is short, below
    codes[rng.random(ROWS) < 0.02] = -1
    codes[codes == 0] = np.where(np.arange(np.sum(codes == 0)) < 9, 0, 1)
    y = rng.standard_normal(ROWS) * 10.0 ** (codes % 5 - 2) + codes
    u = 3 + rng.standard_normal((ROWS, 1)) * 100.0
    y[rng.random(ROWS) < 0.1], u[rng.random(ROWS) < 0.05] = np.nan, np.nan
    time, now = np.empty(ROWS), 1000.0 * np.arange(SERIES + 1)
    for i, code in enumerate(codes):
        now[code] += rng.choice([1, 1, 1, 1, 2, 4, 0, -1, -7, 9, 60])
        time[i] = now[code] + rng.uniform(-0.2, 0.2)
    time[rng.random(ROWS) < 0.02] = np.nan
    return codes, time if has_clock else None, y[:, None], u, rng.random(ROWS) < 0.03


def cut(rows, edges):
    """Return rows as batches, names in order of appearance."""
    codes, time, ys, us, bad = rows
    met = list(dict.fromkeys(code for code in codes.tolist() if code >= 0))
    code_of = {old: new for new, old in enumerate(met)} | {-1: -1}
    codes, names = np.array([code_of[code] for code in codes.tolist()]), []
    for first, last in pairwise(edges):
        part = slice(first, last)
        names += [f"pump {old}" for old in met[len(names) : max(codes[:last].max(initial=-1) + 1, 0)]]
        when = None if time is None else time[part]
        yield SimpleNamespace(
            first=first, names=names, codes=codes[part], time=when, ys=ys[part], us=us[part], bad=bad[part]
        )


def run(rows, edges=(0, ROWS), stop=None, go_on=None, threads=1, **options):
    """Return fleet, intake, and everything that was taken and shown, series by series."""
    fleet = dw.Fleet(EST, threads=threads)
    intake = Intake(fleet, **options)
    got = []

    def take(stretches):
        for taken in stretches:
            assert np.all(np.diff(taken.at) >= 0)
            outs = fleet.advance(taken.at, taken.ys, taken.us)
            intake.tally.add(taken, outs)
            got.append((taken, outs))

    for i, batch in enumerate(cut(rows, edges)):
        if i == stop:
            kept, tallied = intake.snapshot(), intake.tally.table.copy()
            intake = Intake(fleet, **options)
            intake.restore(kept)
            intake.tally.restore(tallied)
        take(intake.take(batch))
    take(intake.rest())
    taken = Taken(*(np.concatenate([getattr(one, name) for one, _ in got]) for name in Taken._fields))
    order = np.argsort(taken.at, kind="stable")
    return fleet, intake, Taken(*(column[order] for column in taken)), np.concatenate([o for _, o in got])[order]


def same(a, b):
    return all(np.array_equal(x, y, equal_nan=x.dtype.kind == "f") for x, y in zip(a, b, strict=True))


def one_by_one(rows, code, dt=None, first=32, longest=50):
    """Return (samples, level, scales, counts) of one series, by a loop that is the rule as it is written down."""
    codes, time, ys, us, _ = rows
    counts = dict.fromkeys(["late", "duplicate", "timeless", "early", "filled", "jumped"], 0)
    samples, last, origin, has_begun = [], -np.inf, None, not first
    for i in np.flatnonzero(codes == code):
        if time is not None and np.isnan(time[i]):
            counts["timeless"] += 1
            continue
        has_begun |= bool(np.isfinite(ys[i, 0]))
        if not has_begun:
            counts["early"] += 1
            continue
        t = len(samples) * (dt or 1.0) if time is None else time[i]
        origin = t if origin is None else origin
        tick = t if dt is None else round((t - origin) / dt)
        if time is not None and tick <= last:
            counts["late" if tick < last else "duplicate"] += 1
            continue
        missed = int(tick - last - 1) if dt and time is not None and last > -np.inf else 0
        fill = min(missed, longest)
        counts["filled"], counts["jumped"] = counts["filled"] + fill, counts["jumped"] + missed - fill
        samples.append(([origin + (tick - back) * dt for back in range(fill, 0, -1)] if dt else [], t, i))
        last = tick
    begun, complete = [], 0
    for _, _, i in samples:
        if complete == first or len(begun) == 8 * first:
            break
        begun.append(i)
        complete += bool(np.isfinite(ys[i, 0]) and np.isfinite(us[i, 0]))
    level, scales = [], []
    for column in (ys[begun].T, us[begun].T) if first else ():
        seen = column[0][np.isfinite(column[0])]
        total = 0.0
        for value in seen.tolist():
            total += value
        level.append(total / max(len(seen), 1))
        scales.append(power_of_two(seen - level[-1]))
    return samples, level or [0.0, 0.0], scales or [1.0, 1.0], counts


@pytest.mark.parametrize(
    ("has_clock", "options"),
    [(True, {}), (True, {"dt": 1.0, "longest": 50}), (False, {"dt": 0.5}), (True, {"first": 0, "longest": 50})],
)
def test_each_series_gets_what_a_loop_over_it_alone_gives(has_clock, options):
    rows = table(3, has_clock)
    fleet, intake, taken, outs = run(rows, (0, 400, 401, 1100, ROWS), **options)
    names = fleet.keys
    assert intake.keyless == np.sum(rows[0] < 0)
    for code in range(SERIES):
        at = names.index(f"pump {code}")
        samples, level, scales, counts = one_by_one(rows, code, **options)
        assert {name: intake.tally[name][at] for name in counts} == counts
        time = [t for filled, t, _ in samples for t in [*filled, t]]
        source = [i for filled, _, i in samples for _ in range(len(filled) + 1)]
        filled = [is_filled for gap, _, _ in samples for is_filled in [*[True] * len(gap), False]]
        here = taken.at == at
        np.testing.assert_array_equal(taken.time[here], time)
        np.testing.assert_array_equal(taken.source[here], source)
        np.testing.assert_array_equal(taken.filled[here], filled)
        np.testing.assert_array_equal(taken.bad[here], rows[4][source] & ~np.array(filled))
        gone = np.array(filled)[:, None]
        ys = np.where(gone, np.nan, rows[2][source] - level[0])
        us = np.where(gone, np.nan, rows[3][source] - level[1])
        est = dw.ARX(1, 1, y_scale=scales[0], u_scale=[scales[1]])
        alone = dw.Fleet(est, ["it"], threads=1)
        np.testing.assert_array_equal(outs[here], alone.advance(np.zeros(len(ys), np.int64), ys, us))
        assert alone.states.tobytes() == fleet.states[at].tobytes()
        assert (intake.levels[0][at, 0], intake.levels[1][at, 0]) == tuple(level)


@pytest.mark.parametrize("dt", [None, 1.0])
def test_cuts_threads_and_snapshots_do_not_show(dt, monkeypatch):
    rows = table(4)
    whole = run(rows, dt=dt, longest=50)
    monkeypatch.setattr(intakes, "SEGMENT", 64)  # many series set their units in one batch: stretch by stretch
    monkeypatch.setattr("driftwise.fleet.crew.SMALL", 1)
    rng = np.random.default_rng(5)
    for trial in range(6):
        edges = np.unique([0, ROWS, *rng.integers(0, ROWS, 4**trial)]).tolist()
        other = run(rows, edges, stop=len(edges) // 2, threads=2, dt=dt, longest=50)
        assert same(whole[2], other[2]) and same([whole[3]], [other[3]])
        assert whole[0].states.tobytes() == other[0].states.tobytes() and whole[0].keys == other[0].keys
        assert same([whole[1].tally.table], [other[1].tally.table])
        assert len(other[0].estimators) == len(whole[0].estimators)


def test_how_series_are_mixed_does_not_show():
    rows = table(6)
    fleet, intake, _, _ = run(rows, dt=1.0)
    for seed in range(3):
        rng = np.random.default_rng(seed)
        order, codes = np.empty(ROWS, int), rows[0][rng.permutation(ROWS)]
        for code in range(-1, SERIES):
            order[codes == code] = np.flatnonzero(rows[0] == code)
        mixed = run([column[order] for column in rows], (0, 700, ROWS), dt=1.0)
        for at, key in enumerate(fleet.keys):
            assert mixed[0].state(key).tobytes() == fleet.state(key).tobytes()
            assert same([mixed[1].tally.table[mixed[0].keys.index(key)]], [intake.tally.table[at]])


def test_a_tally_counts_what_loops_count():
    rows = table(7)
    fleet, intake, taken, outs = run(rows, (0, 300, ROWS), dt=1.0)
    tally, settle = intake.tally, intake.tally.settle
    assert settle == 2 * EST.model.N + 10 and np.any(tally["inside"] < tally["scored"])
    for at in range(len(fleet)):
        found = dict.fromkeys(COLUMNS, 0.0)
        last_y, measured = np.nan, 0
        for i in np.flatnonzero(taken.at == at):
            y, (_, e, variance, status) = taken.ys[i, 0], outs[i]
            found["samples"] += 1
            found["bad"] += taken.bad[i]
            found["filled"] += taken.filled[i]
            found["missing"] += bool(int(status) & Status.MISSING_OUTPUT)
            found["lost"] += bool(int(status) & Status.LOST)
            measured += np.isfinite(e)
            if np.isfinite(e) and measured > settle:
                found["scored"] += 1
                found["z2"] += e * e / variance
                found["inside"] += e * e / variance <= 1.96**2
                if np.isfinite(last_y):
                    found["compared"] += 1
                    found["e2"] += e * e
                    found["dy2"] += (y - last_y) ** 2
                    found["y1"] += y
                    found["y2"] += y * y
            last_y = y if np.isfinite(y) else last_y
        found["measured"], found["last_y"] = measured, last_y
        for name in found.keys() - {"late", "duplicate", "timeless", "early", "jumped", "first_time", "last_time"}:
            if name != "last_jump":
                assert tally[name][at] == found[name], name
        where = taken.time[taken.at == at]
        assert (tally["first_time"][at], tally["last_time"][at]) == (where[0], where[-1])
    assert np.isnan(tally["last_jump"]).all()


def test_jumps_outliers_and_rejected_samples_are_set_aside():
    fleet = dw.Fleet(EST, ["a", "b"])
    tally = Tally(fleet, settle=0)
    status = np.array([0, Status.JUMP, Status.JUMP | Status.REJECTED, 0, Status.OUTLIER, Status.NOISE])
    at, zeros = np.array([0, 0, 0, 1, 1, 1]), np.zeros(6, bool)
    ys = np.array([1.0, 3, 7, 5, 5, 9])[:, None]
    outs = np.column_stack([np.zeros(6), [3.0, 1, 1, 1, 2, 1], np.ones(6), status])
    tally.add(Taken(at, ys, np.empty((6, 1)), np.arange(6.0), at, zeros, zeros), outs)
    told = {name: tally[name].tolist() for name in ("jumps", "rejected", "outliers", "noise", "scored", "compared")}
    assert told == {
        "jumps": [2, 0], "rejected": [1, 0], "outliers": [0, 1], "noise": [0, 1], "scored": [2, 2], "compared": [1, 2]
    }  # fmt: skip
    assert tally["last_jump"][0] == 2 and np.isnan(tally["last_jump"][1])
    assert tally["inside"].tolist() == [1, 2] and tally["dy2"].tolist() == [4, 16]
    with pytest.raises(InputError, match="no column 'jumped_up'"):
        tally["jumped_up"]


def test_the_usual_step_of_a_clock_and_its_gaps_are_found_however_it_is_cut():
    rng, T = np.random.default_rng(8), 600
    steps = np.where(rng.random((T, 2)) < 0.1, 7.0, 1.0) * [60.0, 0.5] * rng.uniform(0.9, 1.1, (T, 2))
    steps[:3, 0] = 500.0  # it begins with gaps
    time = np.cumsum(steps, axis=0).ravel()
    y, zeros = rng.standard_normal((2 * T, 1)), np.zeros(2 * T, bool)
    rows = np.tile([0, 1], T), time, y, np.ones((2 * T, 1)), zeros
    tallies = [run(rows, edges)[1].tally for edges in ((0, 2 * T), (0, 5, 6, 300, 301, 2 * T))]
    tally = tallies[0]
    assert all(np.array_equal(tally[name], tallies[1][name]) for name in ("gaps", "step", "votes"))
    np.testing.assert_allclose(tally["step"], [60.0, 0.5], rtol=0.1)
    long = np.sum(steps[1:] > 1.5 * np.array([60.0, 0.5]), axis=0)
    assert abs(tally["gaps"] - long).max() <= 3, "but for the first few, before most steps were short"


def of_one(y, u=None, time=None):
    """Return a table of one series."""
    n = len(y)
    us = np.zeros((n, 1)) if u is None else np.asarray(u, float)[:, None]
    when = np.arange(n) * 1.0 if time is None else np.asarray(time, float)
    ys = np.asarray(y, float)[:, None]
    return SimpleNamespace(
        first=0, names=["it"], codes=np.zeros(n, int), time=when, ys=ys, us=us, bad=np.zeros(n, bool)
    )


def units(batch, **options):
    intake = Intake(dw.Fleet(EST), **options)
    taken = [*intake.take(batch), *intake.rest()]
    est = intake.fleet.estimator_of("it")
    return intake.levels[0][0, 0], est.options["y_scale"], est.options["u_scale"][0], len(taken)


def test_units_of_constants_and_of_nothing():
    assert units(of_one([20.0] * 40, [np.nan] * 40)) == (20.0, 16.0, 1.0, 1)
    assert units(of_one([0.1] * 40, [0.1] * 40)) == (0.1, 0.125, 0.125, 1)  # 40 * 0.1 is not 4.0
    assert units(of_one([0.0] * 40)) == (0.0, 1.0, 1.0, 1)
    assert units(of_one([100.0, 104.0]), center=False) == (0.0, 128.0, 1.0, 1)
    intake = Intake(dw.Fleet(EST))
    assert not [*intake.take(of_one([np.nan] * 40)), *intake.rest()]
    assert intake.tally["early"][0] == 40 and intake.fleet.keys == ["it"]


def test_a_clock_that_is_wrong_by_a_thousand_costs_no_memory(monkeypatch):
    monkeypatch.setattr(intakes, "SEGMENT", 1000)
    batch = of_one(np.arange(50.0), time=np.arange(50) * 1000.0)
    taken = list(Intake(dw.Fleet(EST), dt=1.0, first=10).take(batch))
    assert sum(len(one.at) for one in taken) == 49 * 1000 + 1 and max(len(one.at) for one in taken) <= 2000
    intake = Intake(dw.Fleet(EST), dt=1.0, longest=20)
    taken = list(intake.take(batch))
    assert len(taken[0].at) + len(taken[1].at) == 49 * 21 + 1 and intake.tally["jumped"][0] == 49 * (999 - 20)
    assert taken[0].time[:23].tolist() == [0.0, *range(980, 1001), 1980.0]


def test_rows_are_held_back_until_enough_of_them_are_complete():
    """Ten values, a long silence, then the rest; an input that is never there; beside one that is complete."""
    rng, T, first = np.random.default_rng(5), 400, 32
    ys, us = 1e3 * rng.standard_normal((T, 3)), rng.standard_normal((T, 3))
    ys[0] = 1.0
    ys[10:150, 0], us[:, 1], ys[1:10, 0] = np.nan, np.nan, 1.0
    codes = np.tile(np.arange(3), T)
    rows = codes, None, ys.reshape(-1, 1), us.reshape(-1, 1), np.zeros(3 * T, bool)
    whole = run(rows, (0, 3 * T), first=first)
    for edges in (range(0, 3 * T + 1, 7), (0, 30, 31, 600, 3 * T)):
        assert same(whole[2], run(rows, tuple(edges) + (3 * T,), first=first)[2])
    fleet, intake, _, _ = whole
    level = [np.mean(np.append(np.ones(10), ys[150:172, 0])), np.mean(ys[: 8 * first, 1]), np.mean(ys[:first, 2])]
    np.testing.assert_allclose(intake.levels[0][:, 0], level, rtol=1e-12)
    assert [fleet.estimator_of(key).options["y_scale"] for key in fleet.keys] == [512.0, 1024.0, 1024.0]
    freed = run(rows, (0, 3 * 256, 3 * 256 + 1, 3 * T), first=first)
    assert same(whole[2], freed[2]) and not freed[1].snapshot()["held_at"].size


def test_series_of_the_fleet_go_on_as_they_are():
    fleet = dw.Fleet(EST, ["it"])
    before = fleet.estimators[:]
    taken = list(Intake(fleet).take(of_one([5.0, 6.0])))
    assert taken[0].ys[:, 0].tolist() == [5.0, 6.0] and fleet.estimators == before


def test_several_outputs():
    fleet = dw.Fleet(dw.ARXMIMO(2, 1, na=1, nb=1))
    batch = of_one([1.0, 2.0, 3.0, 4.0], [1.0, 2.0, 3.0, 4.0])
    batch.ys = np.column_stack([batch.ys[:, 0], [np.nan, 100.0, 300.0, np.nan]])
    intake = Intake(fleet, first=4)
    assert not list(intake.take(batch))  # of two rows one output is missing
    (taken,) = intake.rest()
    assert intake.levels[0][0].tolist() == [2.5, 200.0] and intake.levels[1][0].tolist() == [2.5]
    assert fleet.estimator_of("it").options["y_scale"] == [1.0, 128.0]
    outs = np.column_stack([0 * taken.ys, taken.ys, np.ones((4, 2)), np.zeros((4, 2))])
    tally = Tally(fleet, settle=0)
    tally.add(taken, outs)
    assert (tally["samples"][0], tally["measured"][0], tally["scored"][0], tally["compared"][0]) == (4, 4, 6, 4)
    assert tally["dy2"][0] == 3 + 200.0**2 and (tally["last_y"][0], tally["last_y2"][0]) == (1.5, 100.0)


def test_bad_use_is_refused():
    fleet = dw.Fleet(EST, ["it", "gone"])
    intake = Intake(fleet)
    fleet.drop(["gone"])
    with pytest.raises(InputError, match="dropped"):
        list(intake.take(of_one([1.0])))
    with pytest.raises(InputError, match="dt must be a positive"):
        Intake(dw.Fleet(EST), dt=-1)
    with pytest.raises(InputError, match="first must be a whole number"):
        Intake(dw.Fleet(EST), first=1.5)
    with pytest.raises(InputError, match="the snapshot has 1 series, the fleet 0"):
        Intake(dw.Fleet(EST)).restore(Intake(fleet).snapshot())
