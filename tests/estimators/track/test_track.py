"""Laws of `TrackEstimator`: the same whatever the cut, the origin, the unit or the axes; nothing wild breaks it."""

import numpy as np
import pytest

import driftwise as dw
from driftwise.engine import compile
from driftwise.engine.dispatch import flatten
from driftwise.engine.errors import InputError
from driftwise.estimators.track import bank, step

MISSED = slice(20, 23)
POSITIONS = ("prediction", "position")  # columns that move with the origin


def plots(T=80, seed=1):
    """Return times and positions on a grid of 1/64: straight, a turn, straight, one scan missed, one wild."""
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.choice([4.0, 3.75, 8.25], T))
    course = np.radians(2) * np.clip(t - t[30], 0, 90)
    y = np.cumsum(200 * np.diff(t, prepend=0)[:, None] * np.stack([np.sin(course), np.cos(course)], axis=1), axis=0)
    y += 50 * rng.standard_normal((T, 2))
    y[60] += 5000
    y[MISSED] = np.nan
    return t, np.round(64 * y) / 64


T, Y = plots()
EST = dw.TrackEstimator(250.0)
TRACE = EST.scan(T, Y)


def same(a, b):
    return np.array_equal(a, b, equal_nan=True)


def same_state(one, two):
    return one.state.tobytes() == two.state.tobytes()


def test_record_halves_stream_and_bytes_are_one():
    first = EST.scan(T[:33], Y[:33])
    rest = EST.scan(T[33:], Y[33:], state=first.state)
    assert same(np.concatenate([first.table, rest.table]), TRACE.table) and same_state(rest, TRACE)
    state, others = EST.start(), EST.start(2)
    for k, (t, y) in enumerate(zip(T, Y)):
        state = np.frombuffer(state.tobytes(), EST.dtype)[0]
        if k == 50:  # asking changes nothing
            kept = state.tobytes()
            EST.predict(state, t + 10), EST.density(state, t + 10, Y[0])
            assert state.tobytes() == kept
        state, told = EST.update(state, t, y)
        others, _ = EST.update_batch(others, [t, t], [y, y + 1.0])
        for name in ("prediction", "innovation", "position", "velocity", "acceleration", "turn_rate", "turn_rate_sd"):
            assert same(getattr(told, name), getattr(TRACE, name)[k]), (name, k)
        assert same(told.spread, TRACE.spread[k]) and same(told.manoeuvre, TRACE.manoeuvre[k])
        assert same(np.diag(told.covariance), TRACE.variance[k]) and told.status == TRACE.status[k]
        assert np.isclose(told.nis, TRACE.nis[k], rtol=1e-14, equal_nan=True)
    assert state.tobytes() == TRACE.state.tobytes() == others[0].tobytes() != others[1].tobytes()
    assert EST.dtype.itemsize <= 4096 and dw.TrackEstimator(8.0, coordinates=1).dtype.itemsize <= 4096


def test_a_missed_scan_is_only_time():
    seen = np.isfinite(Y).all(axis=1)
    assert not seen.all()
    without = EST.scan(T[seen], Y[seen])
    assert same(TRACE.table[seen], without.table) and same_state(TRACE, without)
    one = np.where(np.arange(len(Y))[:, None] == 25, [1.0, np.nan], 1.0)  # half a plot is none
    half, none = EST.scan(T, Y * one), EST.scan(T, Y * one.min(axis=1, keepdims=True))
    assert same_state(half, none) and half.status[25] & int(dw.Status.MISSING_OUTPUT)
    gap = TRACE.position_sd[MISSED]
    assert np.all(np.diff(gap, axis=0) > 0) and np.all(TRACE.variance[MISSED] > gap**2)


def test_the_origin_of_place_and_time_does_not_matter():
    moved = EST.scan(T + 2.0**20, Y + [2.0**20, -(2.0**18)])
    for name in ("innovation", "variance", "velocity", "spread", "turn_rate", "manoeuvre", "weights", "log_score"):
        assert same(getattr(moved, name), getattr(TRACE, name)), name
    for name in POSITIONS:
        assert np.allclose(
            getattr(moved, name) - [2.0**20, -(2.0**18)], getattr(TRACE, name), atol=1e-8, equal_nan=True
        )


def test_the_unit_of_length_does_not_matter():
    """Nearly bit for bit: the logarithm of a variance is kept."""
    c = 2.0**-7
    scaled = dw.TrackEstimator(250 * c).scan(T, c * Y)
    for name, power in (("prediction", 1), ("velocity", 1), ("spread", 2), ("variance", 2), ("turn_rate", 0)):
        a, b = getattr(TRACE, name) * c**power, getattr(scaled, name)
        assert np.allclose(a, b, rtol=1e-9, atol=1e-9 * np.nanmax(abs(a[2:])), equal_nan=True), name
    assert np.allclose(TRACE.weights, scaled.weights, rtol=1e-9) and same(TRACE.onset, scaled.onset)
    assert np.allclose(TRACE.log_score[2:] - np.log(c), scaled.log_score[2:], rtol=1e-9, equal_nan=True)


def test_the_unit_of_time_does_not_matter():
    """A film played faster: the noises of the bank are per plot. (What is a manoeuvre is a matter of seconds.)"""
    c = 2.0**3
    faster = dw.TrackEstimator(250 * c).scan(T / c, Y)
    assert np.allclose(faster.prediction, TRACE.prediction, rtol=1e-9, equal_nan=True)
    assert np.allclose(faster.velocity, c * TRACE.velocity, rtol=1e-8)
    assert np.allclose(faster.weights, TRACE.weights, rtol=1e-8, atol=1e-15)
    assert np.allclose(faster.turn_rate, c * TRACE.turn_rate, rtol=1e-6, atol=1e-10, equal_nan=True)


def test_east_and_north_are_alike():
    mirrored = EST.scan(T, Y[:, ::-1])
    for name in ("prediction", "velocity", "acceleration", "variance", "position_sd", "velocity_sd"):
        assert np.allclose(getattr(mirrored, name)[:, ::-1], getattr(TRACE, name), rtol=1e-9, atol=1e-9, equal_nan=True)
    assert np.allclose(-mirrored.turn_rate, TRACE.turn_rate, rtol=1e-9, atol=1e-12, equal_nan=True)
    assert np.allclose(mirrored.turn_rate_sd, TRACE.turn_rate_sd, rtol=1e-9, equal_nan=True)
    assert np.allclose(mirrored.weights, TRACE.weights, rtol=1e-8, atol=1e-15)
    assert np.allclose((mirrored.course + TRACE.course)[2:] % 360, 90, atol=1e-6)


def straight(T=80, sd=20.0, seed=5):
    """Return times, a straight path of 200 m/s, and its plots."""
    t = 4.0 * np.arange(T)
    path = np.stack([160 * t, 120 * t], axis=1)
    return t, path, path + sd * np.random.default_rng(seed).standard_normal(path.shape)


def test_a_wild_plot_moves_nothing_and_a_leap_is_followed():
    """The next plot tells them apart: what was wild is gone, what was true is used from then on."""
    t, path, y = straight()
    y[40] += [2000.0, -1500.0]
    trace = EST.scan(t, y)
    off = np.abs(trace.position - path).max(axis=1)
    assert trace.status[40] & int(dw.Status.OUTLIER) and np.all(off[41:] < 60) and np.all(off[:40][12:] < 60)
    assert trace.variance[45].max() < 2 * trace.variance[39].max() and not trace.onset[20:60].any()
    t, _, y = straight()
    y[40:] += [2000.0, -1500.0]
    trace = EST.scan(t, y)
    off = np.abs(trace.position - y).max(axis=1)
    assert off[40] > 1900 and np.all(off[41:] < 300) and np.all(off[47:] < 60)


@pytest.mark.parametrize("wild, most", [((2,), 1.3), ((1, 4), 1.9)])
def test_what_a_wild_start_teaches_of_errors_is_soon_forgotten(wild, most):
    t, wider = np.arange(40) * 2.0, []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        y = t[:, None] * [5.0, 2.0] + 2.0 * rng.standard_normal((40, 2))
        spoiled = y.copy()
        spoiled[list(wild)] += rng.choice([-60.0, 60.0], (len(wild), 2))
        usual, other = (dw.TrackEstimator("boat").scan(t, one).variance[25:35] for one in (y, spoiled))
        wider.append(np.mean(np.sqrt(other / usual)))
    assert np.median(wider) < most  # deviations of the forecast; 2.6 and 2.5 where a scale falls a twentieth a plot


def test_that_none_was_wild_for_long_is_no_reason_to_believe_the_first():
    """Fifteen deviations off after sixty good plots: of forty such, the next plot undoes most."""
    believed = 0
    for seed in range(40):
        t, _, y = straight(65, seed=seed)
        y[60] += [0.0, 300.0]
        believed += EST.scan(t, y).tails()[-1, bank.WILD] < 0.01
    assert believed < 20


def test_what_no_object_of_the_class_could_do_is_not_followed():
    """A boat seen every 2 s with errors of 1 m, one plot in twelve 25 m off: plots after those are expected as well."""
    t, rng = 2.0 * np.arange(120), np.random.default_rng(3)
    path = np.stack([3.0 * t, 1.0 * t], axis=1)
    y, wild = path + rng.standard_normal(path.shape), np.arange(12, 120, 12)
    y[wild] += 25.0 * np.stack([np.sin(wild), np.cos(wild)], axis=1)
    trace = dw.TrackEstimator("boat").scan(t, y)
    assert np.max(np.hypot(*(trace.prediction - path)[wild + 1].T)) < 5.0


def test_a_plot_that_waits_is_saved():
    t, _, y = straight()
    y[40] += [2000.0, -1500.0]
    whole, half = EST.scan(t, y), EST.scan(t[:41], y[:41])
    rest = EST.scan(t[41:], y[41:], state=np.frombuffer(half.state.tobytes(), EST.dtype)[0])
    assert same(rest.table, whole.table[41:]) and same_state(rest, whole)
    with pytest.raises(InputError, match="time must increase"):
        EST.update(half.state, t[40] - 1.0, y[40])


def test_nothing_follows_what_no_object_of_the_class_does():
    """Seventeen plots of a millimetre, then a leap: no member goes on at a multiple of what is fast."""
    rng = np.random.default_rng(9)
    t = 5.0 * np.arange(60)
    error = np.where(np.arange(60) < 17, 1e-3, 50.0)[:, None] * rng.standard_normal((60, 2))
    y = np.stack([6.0 * t, 2.0 * t], axis=1) + error
    y[17:] += [380.0, -40.0]
    trace = EST.scan(t, y)
    assert np.abs(trace.innovation[19:]).max() < 2000 and np.abs(trace.innovation[40:]).max() < 400


@pytest.mark.parametrize("coordinates", [1, 2])
def test_compiled_equals_uncompiled(coordinates):
    est = dw.TrackEstimator(250.0, coordinates=coordinates)
    y, R = Y[:, :coordinates], np.full((len(T), coordinates), np.nan)
    trace = est.scan(T, y)
    row, outs = np.zeros(bank.row_size(coordinates)), np.empty_like(trace.table)
    kept, spec = np.empty(step.room(coordinates)), flatten([est.task])
    compile.plain_passage(step.Tracking)(np.column_stack([T, y]), R, kept, outs, row, spec)
    # a part in 10^9 of what the column holds at most; entries of a covariance cancel
    assert np.allclose(outs, trace.table, rtol=1e-8, atol=1e-9, equal_nan=True)
    assert np.allclose(row, np.atleast_1d(trace.state).view(float), rtol=1e-8, atol=1e-9, equal_nan=True)


def test_a_manoeuvre_is_told_while_it_lasts_and_not_without_one():
    """A precise radar with slow scans, of which no model of a straight flight calls anything a manoeuvre; a circle."""
    rng = np.random.default_rng(4)
    t = 12.0 * np.arange(1000)
    straight = EST.scan(t, 200 * t[:, None] * [0.6, 0.8] + 10 * rng.standard_normal((1000, 2)))
    assert not straight.onset.any() and np.max(straight.manoeuvre[10:]) < 0.5
    t = 4.0 * np.arange(120)
    turned = np.radians(12) * np.clip(t - 160, 0, 240)
    path = np.cumsum(4 * 30 * np.stack([np.sin(turned), np.cos(turned)], axis=1), axis=0)
    circling = dw.TrackEstimator("glider").scan(t, path + 10 * rng.standard_normal((120, 2)))
    first = np.flatnonzero(circling.onset)
    assert len(first) and 40 < first[0] < 46 and np.median(circling.manoeuvre[48:100]) > 0.8


def test_a_manoeuvre_that_is_over_is_over():
    """Models that learnt a turn go on seeing accelerations; what they are not sure of tells no second manoeuvre."""
    t, told = 4.0 * np.arange(160), 0
    course = np.radians(90 + 1.5 * np.clip(t - 200, 0, 60))
    path = np.cumsum(720 * np.stack([np.sin(course), np.cos(course)], axis=1), axis=0)
    for seed in range(5):
        trace = dw.TrackEstimator().scan(t, path + 30 * np.random.default_rng(seed).standard_normal(path.shape))
        assert np.any(trace.onset[50:60]) and np.mean(trace.manoeuvre[80:] > 0.5) < 0.1
        told += trace.onset[70:].sum()
    assert told <= 1


def intervals(kind, rng, n):
    d = np.full(n, 1e-6 if kind == "fast" else 4.0)
    if kind == "gaps":
        d[rng.integers(2, n, n // 100)] = 4e6
        d[rng.integers(2, n, n // 10)] = 1e-6
    return d


def places(kind, rng, t):
    noise = 50 * rng.standard_normal((len(t), 2))
    if kind == "wild":
        return noise * np.where(rng.random((len(t), 1)) < 0.1, 1e6, 1.0)
    if kind == "leaps":
        return noise + 1e8 * (np.arange(len(t))[:, None] // 100 % 2)
    if kind == "walk":
        return 1e3 * np.cumsum(noise, axis=0)
    if kind == "exact":
        return 200 * t[:, None] * [0.6, 0.8]
    if kind == "stuck":
        where = np.clip(np.arange(len(t)), 50, 1100)
        return (200 * t[:, None] * [0.6, 0.8] + noise)[np.where(where < 1100, np.minimum(where, 50), np.arange(len(t)))]
    return np.full((len(t), 2), 1234.5) if kind == "rest" else 200 * t[:, None] * [0.6, 0.8] + noise


@pytest.mark.parametrize("times", ["even", "gaps", "fast"])
@pytest.mark.parametrize("where", ["straight", "exact", "stuck", "rest", "wild", "leaps", "walk"])
def test_nothing_breaks_it(times, where):
    """After leaps, rest, gaps of 10^6 periods and steps of 1 us all is finite, and covariances are covariances."""
    rng = np.random.default_rng(7)
    t = np.cumsum(intervals(times, rng, 1500))
    y = places(where, rng, t)
    y[rng.integers(2, len(y), 50)] = np.nan
    trace = EST.scan(t, y)
    for name in ("prediction", "variance", "position", "velocity", "acceleration", "weights", "manoeuvre", "pole"):
        assert np.isfinite(getattr(trace, name)[3:]).all(), name
    seen = trace.is_plot
    seen[:2] = False
    assert np.isfinite(trace.log_score[seen]).all() and np.isfinite(trace.normal_score[seen]).all()
    assert np.allclose(trace.weights[2:].sum(axis=1), 1) and (trace.variance[1:] > 0).all()
    V = trace.spread[2:]
    sd = np.sqrt(np.diagonal(V, axis1=1, axis2=2))
    assert np.isfinite(sd).all() and (sd > 0).all() and same(V, V.transpose(0, 2, 1))
    assert np.linalg.eigvalsh(V / sd[:, :, None] / sd[:, None, :]).min() > -1e-9
    if where == "straight" and times != "fast":
        assert 0.9 < trace.coverage() < 0.99


def test_before_there_are_plots():
    start = EST.start()
    mean, S = EST.predict(start, 0.0)
    assert np.isnan(mean).all() and np.isinf(np.diag(S)).all() and EST.density(start, 0.0, [0.0, 0.0]) == 0.0
    state, told = EST.update(start, 5.0, [3e5, -4e5])
    assert same(told.position, [3e5, -4e5]) and told.status & int(dw.Status.NOT_READY)
    mean, S = EST.predict(state, 9.0)
    assert same(mean, [3e5, -4e5]) and np.all(np.diag(S) >= (4.0 * EST.speed) ** 2)  # it may be that fast


def test_stated_variances_are_a_start_and_their_ratios_are_believed():
    R = 2500.0 * np.eye(2)
    stated = EST.scan(T, Y, R)
    assert np.allclose(stated.prediction[20:], EST.scan(T, Y, np.tile(R, (len(T), 1, 1))).prediction[20:])
    precise = np.where((np.arange(len(T)) == 40)[:, None, None], 1e-4 * R, R)
    assert np.all(EST.scan(T, Y, precise).position_sd[40] < 0.2 * stated.position_sd[40])
    unknown = EST.scan(T, Y, np.full((2, 2), np.nan))
    assert same(unknown.table, TRACE.table)


@pytest.mark.parametrize("variances", [(1e-30, 1e30), (1e-30, 1e-30), (1e200, 2500.0)])
def test_absurd_variances_do_no_harm(variances):
    R = np.where(np.arange(len(T)) % 2, *variances)[:, None, None] * np.eye(2)
    trace = EST.scan(T, Y, R)
    for name in ("prediction", "variance", "position", "velocity", "speed_sd", "course_sd", "turn_rate_sd"):
        assert np.isfinite(getattr(trace, name)[2:]).all(), name


def test_at_rest_the_course_is_any_and_the_speed_has_a_deviation():
    trace = EST.scan(np.arange(50.0), np.ones((50, 2)))
    assert same(trace.speed_sd, trace.velocity_sd[:, 0]) and np.allclose(trace.course_sd, 360 / np.sqrt(12))


def test_dates_are_unix_seconds():
    dates = np.datetime64("2024-01-01", "ms") + np.round(1000 * np.arange(50)).astype("m8[ms]")
    trace = EST.scan(dates, np.cumsum(np.ones((50, 2)), axis=0))
    assert trace.time[0] == 1704067200.0 and trace.time[-1] - trace.time[0] == 49.0
    assert np.allclose(trace.velocity[-1], 1.0)


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda: EST.scan([0, 1, 1], np.zeros((3, 2))), "time must increase.*plot 2"),
        (lambda: EST.update(TRACE.state, T[-1], [0, 0]), "time must increase"),
        (lambda: EST.predict(TRACE.state, T[0]), "time must increase"),
        (lambda: EST.density(TRACE.state, T[0], [0, 0]), "time must increase"),
        (lambda: EST.scan([0, np.nan], np.zeros((2, 2))), "time must be finite.*plot 1"),
        (lambda: EST.scan([0, 1], [[0, 0], [np.inf, 0]]), "position must be finite"),
        (lambda: EST.scan([0, 1], [[0, 0], [1e200, 0]]), "position must be finite"),
        (lambda: EST.scan([0, 1], np.zeros((3, 2))), r"position must have shape \(2, 2\)"),
        (lambda: EST.scan([0, 1], np.zeros(2)), "position must have shape"),
        (lambda: EST.update(EST.start(), 0.0, [1.0]), "position must have shape"),
        (lambda: EST.predict(TRACE.state, np.nan), "time must be one finite number"),
        (lambda: EST.scan(np.array(["2024-01-01", "NaT"], "M8[s]"), np.zeros((2, 2))), "time must be finite.*plot 1"),
        (lambda: EST.density(TRACE.state, 1e6, [np.nan, 0]), "position must be a finite vector"),
        (lambda: EST.scan([0, 1], np.zeros((2, 2)), np.zeros((3, 3))), "covariance must have shape"),
        (lambda: EST.scan([0, 1], np.zeros((2, 2)), -np.eye(2)), "covariance must have positive variances"),
        (lambda: EST.scan([0, 1], np.zeros((2, 2)), np.diag([1, np.inf])), "covariance must have positive variances"),
        (lambda: EST.update(np.zeros(3), 0.0, [0, 0]), "state belongs to another estimator"),
        (lambda: EST.update(dw.TrackEstimator(coordinates=1).start(), 0, [0, 0]), "state belongs to another estimator"),
        (lambda: EST.scan(["a"], [[0, 0]]), "time must hold numbers"),
        (lambda: dw.TrackEstimator("zeppelin"), "speed must be .*one of aircraft, helicopter"),
        (lambda: dw.TrackEstimator(-3.0), "speed must be"),
        (lambda: dw.TrackEstimator(np.nan), "speed must be"),
        (lambda: dw.TrackEstimator(coordinates=3), "coordinates must be 1 or 2"),
        (lambda: dw.TrackEstimator(forgetting=1.5), "forgetting"),
        (lambda: dw.TrackEstimator(noise=0), "noise must be"),
    ],
)
def test_bad_input_is_told_at_the_door(call, words):
    with pytest.raises(InputError, match=words):
        call()
