"""Who in a fleet needs a look: what is planted is found, and nobody is named where there is nothing to name."""

import numpy as np
import pytest
from scipy import stats

import driftwise as dw
from driftwise.fleet.fleet_snapshot import census
from driftwise.fleet.outliers import KINDS, STILL, outliers
from driftwise.fleet.robust import bursts, discoveries, unlike

NAMES = (
    "samples", "measured", "missing", "bad", "late", "duplicate", "jumps", "noise", "scored", "z2", "inside",
    "compared", "dy2",
)  # fmt: skip


def counts(S, T, **more):
    """Return the counts of series of which nothing is remarkable but what is given."""
    found = {name: np.zeros(S) for name in NAMES} | {"samples": np.full(S, float(T)), "measured": np.full(S, float(T))}
    instants = {"first_time": np.zeros(S), "last_time": np.full(S, T - 1.0), "last_jump": np.full(S, np.nan)}
    return found | instants | more


def plants(S, T, rng, a=-0.8, b=1.0, noise=0.3):
    """Return y, u (T, S) of y(t) = -a y(t-1) + b u(t-1) + noise e(t), each series with numbers of its own if given."""
    u, e = rng.choice([-1.0, 1.0], (T, S)), rng.standard_normal((T, S))
    y = noise * e
    for t in range(1, T):
        y[t] += -np.asarray(a) * y[t - 1] + np.asarray(b) * u[t - 1]
    return y, u


def run(y, u, est=None):
    """Return the fleet of these columns and what was counted, scored from sample 30 on."""
    T, S = y.shape
    fleet = dw.Fleet(est or dw.ARX(1, 1), range(S), threads=1)
    step = fleet.scan(np.tile(np.arange(S), T), y.ravel(), u.ravel())
    e, V = (column.reshape(T, S)[30:] for column in (step.innovation, step.variance))
    z2, steps = np.where(np.isfinite(e), e * e / V, np.nan), np.diff(y, axis=0)[29:]
    measured = np.isfinite(y)
    return fleet, counts(
        S, T, measured=measured.sum(0).astype(float), missing=(~measured).sum(0).astype(float), z2=np.nansum(z2, 0),
        compared=np.isfinite(steps).sum(0).astype(float), dy2=np.nansum(steps**2, 0),
        scored=np.isfinite(z2).sum(0).astype(float), inside=(z2 < 1.96**2).sum(0).astype(float),
    )  # fmt: skip


@pytest.mark.parametrize("est", [dw.ARX(1, 1), dw.Joint(1, 1)], ids=["arx", "joint"])
def test_columns_are_what_the_estimator_says_of_each_series(est):
    y, u = plants(5, 60, np.random.default_rng(1))
    y[:, 3] = np.nan
    u[:, 4] = 1.0
    fleet = dw.Fleet(est, range(4), threads=1)
    fleet.add([4], est.scaled_to(8 * y[:, 0], u[:, 0]))
    fleet.scan(np.tile(np.arange(5), 60), y.ravel(), u.ravel())
    found = census(fleet)
    for k in range(5):
        own, state = fleet.estimator_of(k), fleet.state(k)
        model = own.model_of(state)
        covariance = own.parameters_of(state)[1] if hasattr(own, "parameters_of") else model.covariance
        assert np.array_equal(found.theta[k], state["theta"])
        np.testing.assert_allclose(found.std[k], np.sqrt(np.diag(covariance)), rtol=1e-12)
        assert found.noise[k] == pytest.approx(np.sqrt(own.policies[1].R * own.sigma2(state)), rel=1e-12)
        assert found.untaught[k] == pytest.approx(own.information_ratio(state)[0][0], rel=1e-9)
    assert found.moves.ravel().tolist() == [True, True, True, True, False]
    assert np.isnan(found.still).all(), "this memory knows of no drift"


def test_drift_is_read_as_from_one_state():
    est = dw.ARX(1, 1, memory=dw.AutoMemory())
    y, u = plants(3, 200, np.random.default_rng(2), b=np.array([1.0, 1.0, 2.0]))
    y[:, 1] = np.cumsum(0.2 * np.random.default_rng(3).standard_normal(200))
    fleet = dw.Fleet(est, range(3))
    for k in range(3):
        fleet.states[k] = est.scan(y[:, k], u[:, k]).state
    found = census(fleet)
    for k in range(3):
        speeds = est.drift_of(fleet.state(k))
        assert found.still[k] == speeds.weights["still"]
        np.testing.assert_allclose(found.memory[k], speeds.memory, rtol=1e-12)
    fleet.add(["silent"])
    tally = counts(4, 200, measured=np.array([200.0, 200, 200, 0]), compared=np.full(4, 170.0), dy2=np.ones(4))
    drifting = set(outliers(fleet, tally).found["drifts"].rows.tolist())
    assert census(fleet).still[3] < STILL and 3 not in drifting, "who was never measured drifts nowhere"


def test_false_discoveries_by_hand():
    p = np.array([0.001, np.nan, 0.004, 0.9, 0.02, 0.021])
    for rate in (0.001, 0.01, 0.05, 0.5):
        seen = np.sort(p[np.isfinite(p)])
        passed = [q for k, q in enumerate(seen, 1) if q <= rate * k / len(seen)]
        assert discoveries(p, rate).tolist() == [bool(passed) and q <= max(passed) for q in p]
    assert not discoveries(np.full(3, np.nan), 0.01).any()


def test_spread_is_what_own_deviations_do_not_explain():
    rng = np.random.default_rng(4)
    std = rng.uniform(0.5, 2.0, 20_000)
    truth = 3.0 + 1.5 * rng.standard_normal(20_000)
    middle, spread, z = unlike(truth + std * rng.standard_normal(20_000), std)
    assert middle == pytest.approx(3.0, abs=0.06) and spread == pytest.approx(1.5, abs=0.06)
    assert np.std(z) == pytest.approx(1.0, abs=0.02)
    _, none, z = unlike(std * rng.standard_normal(20_000), std)
    assert none < 0.15 and np.std(z) == pytest.approx(1.0, abs=0.03)
    assert np.isnan(unlike(np.full(3, np.nan), np.ones(3))[2]).all()


def test_a_fleet_of_one_kind_names_nobody():
    """Promised is one fleet in a hundred for each of three kinds: of 60, 5 or more have a chance of 1 in 3000."""
    named = 0
    for seed in range(20):
        rng = np.random.default_rng([5, seed])
        found = outliers(*run(*plants(300, 200, rng))).found
        named += sum(len(found[kind].rows) > 0 for kind in ("differs", "noise", "bars"))
        assert not len(found["untaught"].rows) and not len(found["data"].rows)
    assert named < 5


@pytest.fixture(scope="module")
def planted():
    """A fleet whose members differ a little, and twenty of which are not as they should be."""
    rng, S, T = np.random.default_rng(6), 400, 300
    a, b, noise = -0.8 + 0.02 * rng.standard_normal(S), 1 + 0.05 * rng.standard_normal(S), np.full(S, 0.3)
    a[:4], b[4:8], noise[8:11] = -0.5, [2.0, 1.6, 0.4, 0.1], [0.9, 0.8, 0.12]
    y, u = plants(S, T, rng, a, b, noise)
    u[:, 11:14] = 0.0
    y[:, 11:14] = 0.3 * rng.standard_normal((T, 3))
    y[:, 11:14] = plants(3, T, rng, a[11:14], 0.0, 0.3)[0]
    louder = np.where(np.arange(T)[:, None] < 150, 0.2, 3.0) * rng.standard_normal((T, 2))
    y[:, 14:16] += louder
    y[rng.random((T, S)) < np.where(np.arange(S) // 2 == 8, 0.5, 0.0)] = np.nan
    y[8:, 18:20] = np.nan
    fleet, tally = run(y, u)
    tally["jumps"][[3, 30, 31, 32, 33, 34]] = [3, 1, 1, 1, 1, 1]
    tally["last_jump"][[3, 30, 31, 32, 33, 34]] = [17, 200, 201, 204, 204, 211]
    return outliers(fleet, tally, inputs=["valve"]), tally


def test_the_planted_are_found(planted):
    found, _ = planted
    rows = {kind: set(some.rows.tolist()) for kind, some in found.found.items()}
    assert set(range(8)) <= rows["differs"] and set(range(8, 11)) <= rows["noise"]
    assert rows["untaught"] == {11, 12, 13} and {14, 15} <= rows["bars"]
    assert rows["data"] == {16, 17, 18, 19} and rows["jumped"] == {3, 30, 31, 32, 33, 34}
    assert not rows["drifts"], "this memory knows of no drift"
    assert set(range(20)) <= set(found.rows.tolist())
    innocent = set(found.rows.tolist()) - set(range(20)) - rows["jumped"]
    assert len(innocent) <= 2, "false discoveries are 1 % of those that are named"


def test_the_worst_come_first_and_say_why(planted):
    found, _ = planted
    assert set(found.found) == set(KINDS)
    for rows, scores in found.found.values():
        assert len(rows) == len(scores) and (np.diff(scores) <= 0).all()
    assert found.found["jumped"].rows[0] == 3
    words = {(key, kind): text for key, kind, _, text in found.table()}
    assert words[3, "jumped"] == "jumped 3 times, the last time at 17" and words[30, "jumped"] == "jumped at 200"
    assert words[12, "untaught"] == "valve never moved: what it does cannot be learnt"
    assert words[16, "data"] == "49 % missing, 154 measured samples"
    assert words[18, "data"].endswith(", 8 measured samples")
    assert words[0, "differs"] == "a1 is -0.513, that of the rest -0.798 \u00b1 0.022 (10.9 deviations)"
    assert words[8, "noise"].startswith("noise of 0.") and "times that of the rest" in words[8, "noise"]
    assert "(1 is right)" in words[14, "bars"]


def test_a_sensor_that_is_stuck_is_said_to_be_and_nothing_else():
    y, u = plants(20, 200, np.random.default_rng(8))
    y[:, 4], y[50:, 5] = 0.0, y[50, 5]  # from the beginning; later on, which is told by other means
    found = outliers(*run(y, u))
    kinds = {kind: text for key, kind, _, text in found.table() if key == 4}
    assert set(kinds) <= {"data", "differs"} and kinds["data"].startswith(
        "the output never moved: is its sensor stuck?"
    )
    assert not [text for key, kind, _, text in found.table() if key != 4 and "stuck" in text]


def test_many_jumps_at_one_time_have_a_cause(planted):
    found, tally = planted
    (burst,) = found.together
    assert burst.rows.tolist() == [30, 31, 32, 33, 34] and (burst.start, burst.end) == (200, 211)
    rng, false = np.random.default_rng(7), 0
    for _ in range(300):  # jumps at any time alike: promised is less than 1 in 1000
        jumps = np.full(400, np.nan)
        jumps[:40] = rng.uniform(0, 5000, 40)
        false += len(bursts(counts(400, 5000, last_jump=jumps))) > 0
    assert false <= 3
    assert not bursts(counts(5, 100)) and not bursts(tally | {"first_time": np.full(400, np.nan)} | counts(400, 1))


def test_few_series_cannot_differ_from_each_other():
    fleet, tally = run(*plants(4, 100, np.random.default_rng(8), b=np.array([1.0, 1.0, 1.0, 50.0])))
    assert not len(outliers(fleet, tally).found["differs"].rows)
    empty = dw.Fleet(dw.ARX(1, 1))
    assert not len(outliers(empty, counts(0, 0)).rows)


@pytest.mark.slow
def test_who_stands_still_is_rarely_said_to_drift_and_who_drifts_is_found():
    """Promised is 1 in 200: of 900 series that stand still, 12 or more have a chance of 1 in 800."""
    rng, S, T = np.random.default_rng(9), 1000, 600
    speed = np.select([np.arange(S) < 50, np.arange(S) < 100], [0.02, 0.05])
    walk = np.cumsum(speed * rng.standard_normal((T, S)), axis=0)
    u, y = rng.choice([-1.0, 1.0], (T, S)), 0.1 * rng.standard_normal((T, S))
    for t in range(1, T):
        y[t] += 0.8 * y[t - 1] + (1 + walk[t]) * u[t - 1]
    fleet = dw.Fleet(dw.ARX(1, 1, memory=dw.AutoMemory()), range(S))
    step = fleet.scan(np.tile(np.arange(S), T), y.ravel(), u.ravel())
    drifts = census(fleet).still < STILL
    assert drifts[100:].sum() < 12, "these stand still"
    assert drifts[:50].sum() >= 43 and drifts[50:100].sum() >= 47, "a fifth, and half, of the noise each sample"
    jumps = (step.status.reshape(T, S)[:, 100:] & int(dw.Status.JUMP)) != 0
    assert jumps.sum() <= 11, "at most 1 in 100 000, of 540 000; 12 and more have a chance of 1 in 100"


@pytest.mark.parametrize("seed", range(5))
def test_false_discoveries_are_those_of_scipy(seed):
    rng = np.random.default_rng(seed)
    p = np.where(rng.random(300) < 0.1, rng.random(300) * 1e-3, rng.random(300)).round(3)  # with ties
    p[rng.random(300) < 0.1] = np.nan
    expected = np.zeros(300, bool)
    expected[np.isfinite(p)] = stats.false_discovery_control(p[np.isfinite(p)]) <= 0.05
    assert np.array_equal(discoveries(p, 0.05), expected) and expected.any()
