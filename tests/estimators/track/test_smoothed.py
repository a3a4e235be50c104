"""Smoothing of tracks: a dense Gaussian for one member, the truth of drawn flights, wild plots, fixed lag."""

import numpy as np
import pytest
from driftwise_studies.score.motions import draw, simulate

import driftwise as dw
from driftwise.engine import compile
from driftwise.engine.dispatch import flatten
from driftwise.estimators.track import bank, both_ways, linear, remembered

T, Q, R0 = 12, 0.3, 4.0
VELOCITY = 100.0  # variance of either end's velocity


def steps(time):
    """Return F and Q of constant velocity between plots at these times, one coordinate."""
    for d in np.diff(time):
        yield np.array([[1, d], [0, 1.0]]), Q * np.array([[d**3 / 3, d**2 / 2], [d**2 / 2, d]])


def kalman(time, y, ahead):
    """Return means (T, 2) and covariances (T, 2, 2) of the textbook filter, after or before each plot."""
    x, P, H = np.array([y[0], 0.0]), np.diag([R0, VELOCITY]), np.array([1.0, 0.0])
    kept = [(x, P)]
    for (F, q), z in zip(steps(time), y[1:]):
        x, P = F @ x, F @ P @ F.T + q
        if ahead:
            kept.append((x, P))
        K = P @ H / (P[0, 0] + R0)
        x, P = x + K * (z - x[0]), P - np.outer(K, P[0])
        if not ahead:
            kept.append((x, P))
    return np.array([x for x, _ in kept]), np.array([P for _, P in kept])


def dense(time, y):
    """Return mean (T, 2) and covariance (T, 2, 2) of all states given all plots, as one Gaussian of 2T numbers."""
    n = len(time)
    info, vector = np.zeros((2 * n, 2 * n)), np.zeros(2 * n)
    for end in (0, n - 1):  # what either filter begins with
        info[2 * end + 1, 2 * end + 1] += 1 / VELOCITY
    for k, (F, q) in enumerate(steps(time)):
        A = np.zeros((2, 2 * n))
        A[:, 2 * k : 2 * k + 2], A[:, 2 * k + 2 : 2 * k + 4] = -F, np.eye(2)
        info += A.T @ np.linalg.inv(q) @ A
    for k in range(n):
        info[2 * k, 2 * k] += 1 / R0
        vector[2 * k] += y[k] / R0
    V = np.linalg.inv(info)
    return (V @ vector).reshape(n, 2), np.array([V[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] for k in range(n)])


def members(x, P, which):
    """Return the table of one coordinate's members of whom one alone is possible; its acceleration is unknown."""
    size, K = remembered.each(1), remembered.told(1)
    table = np.full((len(x), K * size), -np.inf)
    at = which * size
    table[:, at] = 0.0
    table[:, at + 1 : at + 4] = np.column_stack([x, np.zeros(len(x))])
    V = np.zeros((len(x), 3, 3))
    V[:, :2, :2], V[:, 2, 2] = P, 1.0
    table[:, at + 4 : at + 10] = V[(slice(None), *np.triu_indices(3))]
    return table


@pytest.mark.parametrize("which", [0, 7])
def test_one_member_both_ways_is_the_dense_gaussian(which):
    rng = np.random.default_rng(3)
    time = np.cumsum(rng.uniform(0.3, 3.0, T))
    y = 5 * time + 2 * rng.standard_normal(T)
    past = members(*kalman(time, y, ahead=False), which)
    x, P = kalman(-time[::-1], y[::-1], ahead=True)
    turned = np.array([1.0, -1.0])
    future = members((x * turned)[::-1], (P * np.outer(turned, turned))[::-1], which)
    out = np.zeros((T, bank.columns(1)))
    go = compile.passage(both_ways.BothWays)
    go(past, future, np.empty(both_ways.room(1)), out, np.zeros(1), flatten([both_ways.BothWays(1, 0.5, 2.0)]))
    at = bank.sample_at(1)
    mean, V = dense(time, y)
    inner = slice(1, -1)  # at either end one filter has begun: its prior is not a plot's
    np.testing.assert_allclose(out[inner, at.state : at.state + 2], mean[inner], rtol=1e-9, atol=1e-9)
    upper = V[(slice(None), *np.triu_indices(2))]
    told = out[:, [at.covariance, at.covariance + 1, at.covariance + 3]]
    np.testing.assert_allclose(told[inner], upper[inner], rtol=1e-8, atol=1e-9)


def flights(many, plots=100):
    """Yield drawn flights of one object and one sensor: (scene, time, position, truth)."""
    number = 0
    while many:
        scene, number = draw(1, number), number + 1
        if scene.name == "flight" and scene.objects == 1 and len(scene.sensors) == 1 and scene.plots > 60:
            many -= 1
            seen = simulate(scene)
            yield scene, seen.plots.time[:plots], seen.plots.position[:plots], seen


def rms(e):
    return np.sqrt(np.mean(e[10:] ** 2))


def test_drawn_flights_are_told_truer_and_bands_hold():
    ratio, held = [], []
    for scene, time, plots, seen in flights(16):
        est, truth = dw.TrackEstimator(scene.kind.told), seen.truth[: len(time)]
        trace, filtered = est.smooth(time, plots), est.scan(time, plots)
        ratio.append(rms(trace.position - truth) / rms(filtered.position - truth))
        held.append(np.mean(np.abs(trace.position - truth) <= 1.96 * trace.position_sd))
        forecast = ("prediction", "innovation", "nis", "log_score", "manoeuvre", "onset")
        for name in forecast:
            np.testing.assert_array_equal(getattr(trace, name), getattr(filtered, name))
        assert trace.state.tobytes() == filtered.state.tobytes()
    assert np.exp(np.mean(np.log(ratio))) < 0.7 and 0.88 < np.mean(held) < 0.98, (ratio, held)


def straight(n=60, noise=5.0, seed=2):
    time = 2.0 * np.arange(n)
    truth = np.stack([80 * time, -30 * time], axis=1) + 1e5
    return time, truth, truth + noise * np.random.default_rng(seed).standard_normal(truth.shape)


def test_wild_plots_are_set_aside_and_marked():
    time, truth, plots = straight()
    clean = dw.TrackEstimator().smooth(time, plots)
    wild = np.array([20, 21, 40])
    plots[wild] += [[400.0, 0.0], [0.0, -900.0], [300.0, 300.0]]
    trace = dw.TrackEstimator().smooth(time, plots)
    np.testing.assert_array_equal(np.flatnonzero(trace.status & int(dw.Status.OUTLIER)), wild)
    assert np.abs(trace.position - clean.position).max() < 5.0, "as if they had not been there"
    assert np.abs(trace.position - truth)[wild].max() < 10.0


def test_a_mirrored_record_is_a_mirrored_answer_and_scans_without_plots_are_filled():
    time, truth, plots = straight()
    plots[30:34] = np.nan
    est = dw.TrackEstimator()
    trace, back = est.smooth(time, plots), est.smooth(-time[::-1], plots[::-1])
    assert np.abs(trace.position - truth)[30:34].max() < 8.0
    # the two differ in which way began with the knowledge of the noise: by little
    assert np.abs(trace.position - back.position[::-1]).max() < 2.0
    assert np.abs(trace.velocity + back.velocity[::-1]).max() < 0.5


def test_fixed_lag_looks_no_further_than_it_says_and_gains_with_the_lag():
    time, truth, plots = straight(40)
    est, lag = dw.TrackEstimator(), 6
    trace = est.smooth(time, plots, lag=lag)
    plots[30] += 30.0
    other = est.smooth(time, plots, lag=lag)
    same = (trace.position == other.position).all(axis=1)
    assert same[: 30 - lag].all() and not same[30 - lag : 33].all()
    errors = [rms(t.position - truth) for t in (est.scan(time, plots), other, est.smooth(time, plots))]
    assert errors[0] > errors[1] > errors[2]
    with pytest.raises(dw.InputError, match="lag"):
        est.smooth(time, plots, lag=-1)


def test_short_records_and_one_coordinate():
    time, _, plots = straight()
    est, single = dw.TrackEstimator(), dw.TrackEstimator(10.0, coordinates=1)
    for n in (0, 1, 2, 3, 4):
        trace, filtered = est.smooth(time[:n], plots[:n]), est.scan(time[:n], plots[:n])
        assert trace.position.shape == (n, 2)
        if n < 3:
            np.testing.assert_array_equal(trace.table, filtered.table)
    trace = single.smooth(time, plots[:, :1])
    assert np.median(trace.velocity_sd[5:]) < np.median(single.scan(time, plots[:, :1]).velocity_sd[5:])
    nothing = est.smooth(time, np.full((len(time), 2), np.nan))
    assert not np.isfinite(nothing.position).any()


def test_uncompiled_equals_compiled(monkeypatch):
    time, _, plots = straight(6)
    est = dw.TrackEstimator()
    trace = est.smooth(time, plots)
    monkeypatch.setattr(compile, "passage", compile.plain_passage)
    plain = dw.TrackEstimator().smooth(time, plots)
    np.testing.assert_array_equal(plain.table, trace.table)


def test_what_comes_from_the_end_has_no_prior_of_its_own():
    rng, which, r = np.random.default_rng(8), bank.LINES - 1, 2.0
    row, rate, q = np.zeros(bank.row_size(1)), *bank.STRAIGHT[which]
    row[bank.at_linear(1, which, 0) + linear.SCALE], prior = 1.0, q * r / (2.0 * rate)
    for _ in range(5):
        A = rng.standard_normal((2, 2)) / 10.0
        information, told = A @ A.T + np.eye(2) / prior, 20.0 * rng.standard_normal(2)  # of plots alone
        P = np.linalg.inv(information + np.diag([0.0, 1.0 / prior]))
        x, V = np.append(P @ information @ told, 0.0), np.zeros((3, 3))
        V[:2, :2] = np.triu(P)
        k = remembered.take_out_prior(row, 1, which, 1.0, 1e6, np.array([r]), x, V)
        np.testing.assert_allclose(x[:2], told, rtol=1e-9)
        np.testing.assert_allclose(V[:2, :2], np.triu(np.linalg.inv(information)), rtol=1e-9, atol=1e-9)
        at = rng.standard_normal(2)
        both = [0.5 * np.linalg.slogdet(J)[1] - 0.5 * (at - m) @ J @ (at - m)
                for J, m in ((np.linalg.inv(P), P @ information @ told), (information, told))]  # fmt: skip
        assert k == pytest.approx(both[0] + 0.5 * np.log(prior) + 0.5 * at[1] ** 2 / prior - both[1])


def test_animals_between_whose_fixes_lie_hours():
    ratios, held = [], []
    for number in (34, 41, 45, 73, 84, 116, 120, 215):
        scene = draw(0, number)
        seen = simulate(scene)
        given = seen.plots.time, seen.plots.position, seen.plots.covariance if scene.stated else None
        est = dw.TrackEstimator(scene.kind.told)
        errors = [rms((trace.position - seen.truth)[10:]) for trace in (est.scan(*given), est.smooth(*given))]
        trace = est.smooth(*given)
        ratios.append(errors[1] / errors[0])
        held.append(np.mean(np.abs(trace.velocity - seen.velocity) < 1.96 * trace.velocity_sd))
    assert np.median(ratios) < 1.35 and np.mean(held) > 0.55  # 1.65 and .38 while who is silent was listened to


def test_a_place_that_plots_repeat_is_known_to_its_cell():
    rng, step = np.random.default_rng(5), 20.0
    path = np.concatenate([np.zeros(60), 1.5 * np.arange(60.0)])[:, None] * np.array([1.0, 0.4]) + [7.0, 3.0]
    y = step * np.round((path + rng.standard_normal(path.shape)) / step)
    trace = dw.TrackEstimator("boat").smooth(np.arange(120.0), y)
    assert trace.position_sd[10:50].min() > 0.99 * step / np.sqrt(12)
    assert np.mean(np.abs(trace.position - path) < 1.96 * trace.position_sd) > 0.9
