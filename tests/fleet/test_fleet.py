"""A fleet gives each series the numbers that its estimator gives it alone, bit for bit."""

import numpy as np
import pytest
from draws import slow

import driftwise as dw
from driftwise.engine import compile
from driftwise.engine.compilers import compilers
from driftwise.engine.simd_fleet import turns
from driftwise.estimators.grey_box.start import BatchStart
from driftwise.fleet import crew as crews
from driftwise.fleet import fleet as fleets
from driftwise.fleet.grouping import group_samples, stable_order

SERIES, SAMPLES = 7, 60
CASES = {
    "ar": dw.AR(1),
    "joint": dw.Joint(1),
    "arx": dw.ARX(2, 2),
    "joint3": dw.Joint(3),
    "input": dw.Joint(1, 1),
    "several": dw.JointMIMO([1, 1]),
}
QUICK = ["ar", "joint"]


def table(estimator, seed=1, missing=0.1, series=SERIES, samples=SAMPLES):
    """Return keys in any order, y and u with gaps."""
    rng = np.random.default_rng(seed)
    n, p, k = series * samples, getattr(estimator.model, "outputs", None), estimator.model.inputs
    y, u = rng.standard_normal((n, p) if p else n), rng.standard_normal((n, k))
    y[rng.random(y.shape) < missing], u[rng.random(u.shape) < missing / 2] = np.nan, np.nan
    return rng.permutation(np.repeat(np.arange(series), samples)), y, u if k else None


def of(u, where):
    return None if u is None else u[where]


def bits(state) -> bytes:
    return np.atleast_1d(state).tobytes()


def check_alone(estimator, fleet, steps, keys, y, u):
    """Check states and steps of a fleet against each series on its own: one by one, and as a record."""
    for key in fleet.keys:
        own = keys == key
        trace = estimator.scan(y[own], of(u, own))
        assert bits(trace.state) == bits(fleet.state(key))
        for name in ("prediction", "innovation"):
            assert np.array_equal(getattr(steps, name)[own], getattr(trace, name), equal_nan=True)
    state, own = estimator.start(), np.flatnonzero(keys == fleet.keys[0])
    for t in own:
        state, step = estimator.update(state, y[t], of(u, t))
        assert np.array_equal(step.variance, steps.variance[t], equal_nan=True)
        assert np.array_equal(step.status, steps.status[t])
    assert bits(state) == bits(fleet.state(fleet.keys[0]))


@pytest.mark.parametrize("name", [name if name in QUICK else slow(name) for name in CASES])
def test_alone_or_together_any_order_any_stretch_any_threads(name, monkeypatch):
    monkeypatch.setattr(crews, "SMALL", 10)
    estimator = CASES[name]
    keys, y, u = table(estimator)
    for threads in (1, 2, 3):
        fleet = dw.Fleet(estimator, threads=threads)
        check_alone(estimator, fleet, fleet.scan(keys, y, u), keys, y, u)
        parts = dw.Fleet(estimator, range(SERIES)[::-1], threads=threads)
        for part in np.split(np.arange(len(keys)), [1, 40, 41, 300]):
            parts.scan(keys[part], y[part], of(u, part))
        for key in range(SERIES):
            assert bits(parts.state(key)) == bits(fleet.state(key))


def test_ticks_are_the_same_as_a_scan():
    estimator = CASES["joint"]
    y = np.random.default_rng(2).standard_normal((SAMPLES, SERIES))
    one, other = (dw.Fleet(estimator, list("abcdefg")) for _ in range(2))
    for t, row in enumerate(y):
        if t % 2:
            one.update_batch(None, row)
        else:
            one.update_batch(list("gfedcba"), row[::-1])
    step = other.scan(np.tile(list("abcdefg"), SAMPLES), y.ravel())
    assert bits(one.states) == bits(other.states) and step.prediction.shape == (SAMPLES * SERIES,)


def test_a_key_may_come_twice_in_one_tick():
    estimator = CASES["ar"]
    fleet = dw.Fleet(estimator, ["a", "b"])
    fleet.update_batch(["a", "b", "a", "a"], [1.0, 5.0, 2.0, np.nan])
    assert bits(fleet.state("a")) == bits(estimator.scan([1.0, 2.0, np.nan]).state)


def test_series_come_and_go_and_have_settings_of_their_own():
    plain, special = dw.AR(1), dw.AR(1, y_scale=32.0)
    y = {key: np.random.default_rng(key).standard_normal(30) for key in range(40)}
    fleet = dw.Fleet(plain, range(10))
    fleet.add([10], special)
    for key in range(11):
        fleet.scan([key] * 10, y[key][:10])
    fleet.drop([0, 9])
    fleet.add(range(20, 40))  # grows
    fleet.add([0])  # begins afresh
    with pytest.raises(dw.InputError, match="no series 9"):
        fleet.update_batch([1, 9], [0.0, 0.0])
    assert fleet.keys == [*range(1, 9), 10, *range(20, 40), 0]
    for key in fleet.keys:
        fleet.scan([key] * 20, y[key][10:])
    for key in fleet.keys:
        alone = special if key == 10 else plain
        assert fleet.estimator_of(key) is alone
        begun = y[key] if key in range(1, 11) else y[key][10:]
        assert bits(alone.scan(begun).state) == bits(fleet.state(key))


OBSERVERS = {
    "state space": dw.StateSpace([[1, 1], [0, 1]], [[0.5], [1]], [1, 0], Q=[0, 0.1], R=1.0),
    "window": dw.WindowObserver(dw.Plant([[-0.9]], [[1.0]], C=[[1.0]]), 1.0, noise_std=0.1, dt=0.1, hold="zoh"),
    "grey box": dw.GreyBox("tank", start=None),
    "grey box that fits": dw.GreyBox("tank", start=BatchStart(16), jumps="fit"),
}


@pytest.mark.parametrize("name", OBSERVERS)
def test_observers_of_a_plant_are_a_fleet_also_those_that_pause_for_fits(name, tmp_path):
    est = OBSERVERS[name]
    rng = np.random.default_rng(1)
    u, y = 1e-3 * rng.random((80, 1)), 1 + 0.1 * rng.standard_normal((80, 2))
    keys = np.tile(["a", "b"], 40)
    fleet = dw.Fleet(est)
    fleet.scan(keys, y[:40].ravel(), np.repeat(u[:40], 2, axis=0))
    fleet.save(tmp_path / "fleet.parquet")
    fleet = dw.Fleet.load(tmp_path / "fleet.parquet")
    step = fleet.scan(keys, y[40:].ravel(), np.repeat(u[40:], 2, axis=0))
    for i, key in enumerate("ab"):
        trace = est.scan(y[:, i], u)
        assert bits(trace.state) == bits(fleet.state(key)) and np.isfinite(fleet.mean(key)).all()
        assert np.array_equal(trace.prediction[40:], step.prediction[i::2])


def test_bad_input_is_refused_and_nothing_is_lost():
    fleet = dw.Fleet(dw.AR(1), ["a", "b"])
    fleet.update_batch(None, [1.0, 2.0])
    before = bits(fleet.states)
    observer = dw.WindowObserver(dw.Plant([[0.9]], C=[[1.0]]), dt=1.0, window=3.0, noise_std=1.0)
    box = dw.GreyBox("tank")
    boxes = dw.Fleet(box)
    refused = [
        (lambda: fleet.update_batch(["a", "c"], [1.0, 2.0]), "no series 'c'"),
        (lambda: fleet.update_batch(None, [1.0, 2.0, 3.0]), "y must have 2 rows"),
        (lambda: fleet.update_batch(None, [1.0, np.inf]), "infinite"),
        (lambda: fleet.update_batch(None, [1.0, 2.0], [1.0, 2.0]), "no input"),
        (lambda: fleet.update_batch("a", 1.0), r"keys must be several, as in \['a'\]"),
        (lambda: dw.Fleet(dw.AR(1), [1]).mean("1"), "there is 1, and numbers are not text"),
        (lambda: fleet.add(["a"]), "'a' is there twice"),
        (lambda: fleet.add(["d", "c", "c"]), "'c' is there twice"),
        (lambda: fleet.drop(["c"]), "no series"),
        (lambda: fleet.add(["c"], dw.AR(2)), "one kind of estimator"),
        (lambda: fleet.add(["c"], dw.AR(1, memory=dw.ExponentialForgetting(0.99))), "one kind of estimator"),
        (lambda: dw.Fleet(dw.Joint(1, noise=dw.models.OutputError(), start="algebraic")), "algebraic"),
        (lambda: dw.Fleet(dw.AR(1), threads=0), "threads"),
        (lambda: fleets.check_learns(observer), "known plant"),
        (lambda: boxes.add(["c"], box.replace(dt=2.0)), "another needs its own fleet"),
        (lambda: dw.Fleet(dw.ModelAverage([dw.AR(1), dw.AR(2)])), "needs one of driftwise's estimators"),
        (lambda: dw.Fleet(dw.TrackEstimator()), "needs one of driftwise's estimators"),
        (
            lambda: fleet.advance(np.zeros(1, int), np.zeros((1, 1)), np.zeros((1, 0)), columns=5),
            "columns must be 4, or",
        ),
        (lambda: dw.Fleet("AR(1)"), "needs one of driftwise's estimators"),
    ]
    for call, why in refused:
        with pytest.raises(dw.InputError, match=why):
            call()
    assert bits(fleet.states) == before and fleet.keys == ["a", "b"]


def test_the_loop_is_the_same_uncompiled():
    estimator = CASES["joint"]
    keys, y, _ = table(estimator, series=3, samples=30)
    one, other = dw.Fleet(estimator, range(3)), dw.Fleet(estimator, range(3), threads=1)
    crew = other.crew
    crew.loop = lambda columns: compile.plain_crew(crew.kinds, crew.sizes, crew.shapes(columns))
    a, b = one.scan(keys, y), other.scan(keys, y)
    np.testing.assert_allclose(a.prediction, b.prediction, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(one.states.view(float), other.states.view(float), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("count", [3, 5000])
def test_samples_are_found_in_stable_order(count):
    rng = np.random.default_rng(count)
    for at in (rng.integers(0, count, 200), np.sort(rng.integers(0, count, 200)), np.empty(0, np.int64)):
        assert np.array_equal(stable_order(at, count), np.argsort(at, kind="stable"))
        members, starts, _, _ = group_samples(at, count)
        assert np.array_equal(members, np.unique(at))
        assert np.array_equal(np.diff(starts), np.unique(at, return_counts=True)[1])


needs_lanes = pytest.mark.skipif(all(c.is_quick for c in compilers()), reason="lanes need gcc or clang")


@needs_lanes
@pytest.mark.parametrize("name", ["joint3", "arx", "input"])
@pytest.mark.parametrize("missing", [0.0, 0.002])
def test_eight_side_by_side_give_the_same_bits(name, missing):
    estimator, series = CASES[name], 29
    keys, y, u = table(estimator, missing=missing, series=series, samples=100)
    y[keys == 3] *= 1e9  # of one series: branches differ between lanes
    order = np.argsort(keys, kind="stable")
    fleets = [dw.Fleet(estimator, range(series), threads=1, lanes=lanes) for lanes in (False, True)]
    for fleet in fleets:
        fleet.add(["special"], type(estimator)(**{**estimator.options, "y_scale": 64.0}))
    for part in (slice(None), order[: len(order) // 2], order[len(order) // 2 :]):  # mixed, then one after the other
        one, other = (fleet.scan(keys[part], y[part], of(u, part)) for fleet in fleets)
        assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(one, other))
        assert bits(fleets[0].states) == bits(fleets[1].states)
    assert fleets[1].crew.is_wide and not fleets[0].crew.is_wide


def test_a_brief_fleet_takes_the_loop_of_one_series_until_its_own_is_there(monkeypatch):
    """Seconds of compilation are not spent on few samples; the numbers are the same, mixed or sorted."""
    monkeypatch.delenv("DRIFTWISE_ENGINE", raising=False)
    y, u = dw.simulate([-0.8], [1.0], samples=600, noise_std=0.1, missing=0.1, seed=2)
    at = np.random.default_rng(0).integers(0, 5, 600)
    found = []
    for is_there in (True, False):
        monkeypatch.setattr(crews.compile, "has_driver", lambda kinds: True)
        monkeypatch.setattr(crews.compile, "has_crew", lambda *args, is_there=is_there: is_there)
        for keys in (at, np.sort(at)):
            fleet = dw.Fleet(dw.ARX(1, 1, memory=dw.RestartOnChange()))
            found.append(np.stack(fleet.scan(keys, y, u)))
            assert fleet.crew.is_brief(5, 4) != is_there
    assert np.array_equal(found[0], found[2], equal_nan=True) and np.array_equal(found[1], found[3], equal_nan=True)


@needs_lanes
def test_lanes_that_disagree_give_the_same_bits():
    estimator = dw.ARX(2, 2, gate=dw.InnovationGate(3.0))
    rng, series, samples = np.random.default_rng(5), 16, 200
    at = rng.permutation(np.repeat(np.arange(series), samples))  # mixed
    y, u = rng.standard_normal((at.size, 1)), rng.standard_normal((at.size, 1))
    y[rng.random(at.size) < 0.02] *= 1e3  # outliers: the gate says no to one lane of eight
    y[at == 3] = 0.0  # known exactly: T = 0
    y[(at == 9) & (np.arange(at.size) > at.size // 2)] += 50.0  # a jump
    fleets = [dw.Fleet(estimator, range(series), threads=1, lanes=lanes) for lanes in (False, True)]
    outs = [fleet.advance(at, y, u) for fleet in fleets]
    assert fleets[1].crew.is_wide
    assert outs[0].tobytes() == outs[1].tobytes()
    assert bits(fleets[0].states) == bits(fleets[1].states)
    rejected = (outs[0][:, 3].astype(int) & int(dw.Status.REJECTED)) != 0
    assert 0 < rejected.sum() < at.size // 4


def test_turns_put_series_of_as_many_samples_side_by_side():
    members, starts = np.array([4, 5, 7, 9]), np.array([0, 3, 5, 8, 9])
    group = np.zeros(10, np.int64)
    assert turns(members, starts, group).tolist() == [3, 1, 0, 2]
    group[5] = 1
    assert turns(members, starts, group).tolist() == [3, 0, 2, 1]


def test_no_row_of_a_fleet_lies_in_two_lines_of_the_cache():
    for rows, columns in (1, 4), (1000, 4), (77, 8):
        outs = crews.table(rows, columns)
        assert outs.shape == (rows, columns) and outs.flags.c_contiguous and outs.flags.writeable
        assert outs.ctypes.data % 64 == 0
