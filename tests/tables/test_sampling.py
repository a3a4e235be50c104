"""The clock of a table: regular or not, with gaps, however it is cut into chunks."""

import numpy as np
import pytest
from plants_of_tables import NaN

from driftwise.tables.sampling import LATE, LONGEST_GAP, RESTART_ROWS, Regular, Sampling, judge_sampling


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
