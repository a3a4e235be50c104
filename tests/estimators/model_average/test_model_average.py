"""The model average: laws, calibration, and what happens to bad input."""

import math

import numpy as np
import pytest
from scipy.signal import lfilter

import driftwise as dw
from driftwise.analysis.laws import example
from driftwise.engine import compile
from driftwise.engine.dispatch import flatten
from driftwise.engine.order import smallest
from driftwise.estimators.model_average import step

MEMBERS = [dw.ARX(1, 1), dw.ARX(2, 2, memory=dw.ExponentialForgetting(0.98)), dw.AR(1)]


@pytest.fixture(scope="module")
def average():
    return dw.ModelAverage(MEMBERS)


@pytest.fixture(scope="module")
def record():
    return example(MEMBERS[1], samples=150, missing=0.1)


def same(a, b):
    return np.array_equal(np.atleast_1d(a).view(float), np.atleast_1d(b).view(float), equal_nan=True)


def test_stream_halves_and_fleet_equal_the_record_bit_for_bit(average, record):
    y, u = record
    whole = average.scan(y, u)
    first = average.scan(y[:70], u[:70])
    second = average.scan(y[70:], u[70:], state=first.state)
    assert same(np.vstack([first.table, second.table]), whole.table) and same(second.state, whole.state)
    state, steps = average.start(), []
    for t in range(len(y)):
        state, shown = average.update(state, y[t], u[t])
        steps.append(shown)
    assert same(state, whole.state)
    assert same(np.array([s.prediction for s in steps]), whole.prediction)
    states, shown = average.update_batch(average.start(2), np.stack([y, y]), np.stack([u, u]))
    assert same(states[1], whole.state) and same(shown.variance[0], whole.variance)


def test_a_saved_state_goes_on_where_it_was(average, record, tmp_path):
    y, u = record
    state = average.scan(y[:70], u[:70]).state
    dw.save_state(average, state, tmp_path / "average.json")
    again, loaded = dw.load_state(tmp_path / "average.json")
    assert same(again.scan(y[70:], u[70:], state=loaded).table, average.scan(y[70:], u[70:], state=state).table)


def test_scaling_the_data_scales_the_forecast(average, record):
    y, u = record
    c, g = 2.0**20, 2.0**-13
    one, two = average.scaled_to(y, u).scan(y, u), average.scaled_to(c * y, g * u).scan(c * y, g * u)
    assert same(c * one.prediction, two.prediction) and same(c * c * one.variance, two.variance)


def test_a_missing_output_is_forecast_and_teaches_nothing(average, record):
    y, u = record
    state = average.scan(y[:100], u[:100]).state
    after, shown = average.update(state, math.nan, u[100])
    assert shown.status == dw.Status.MISSING_OUTPUT and math.isfinite(shown.prediction) and math.isnan(shown.innovation)
    assert after["own"]["silent"] == 1 and state["own"]["silent"] == math.isnan(y[99])
    after["own"]["silent"] = state["own"]["silent"]
    assert same(after["own"], state["own"])
    _, absurd = average.update(state, 1e80, u[100])
    assert absurd.status == dw.Status.BAD_VALUE


def test_compiled_equals_plain(average, record):
    y, u = record
    trace = average.scan(y[:60], u[:60])
    means = np.full((60, len(MEMBERS) + 3), np.nan)
    variances = means.copy()
    for i, member in enumerate(MEMBERS):
        own = member.scan(y[:60], u[:60] if member.model.inputs else None)
        means[:, i], variances[:, i] = own.prediction, own.variance
    outs, numbers = (
        np.empty_like(trace.table),
        np.concatenate([step.fresh(average.task).reshape(1).view(float), np.empty(step.scratch_size(means.shape[1]))]),
    )
    with np.errstate(all="ignore"):
        compile.plain_passage(step.Averaging)(y[:60, None], means, variances, outs, numbers, flatten([average.task]))
    np.testing.assert_allclose(outs, trace.table, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("noise", ["normal", "heavy"])
def test_bands_hold_what_they_promise_whatever_the_tails(noise):
    rng = np.random.default_rng(5)
    e = rng.standard_normal(4000) if noise == "normal" else rng.standard_t(3, 4000)
    y = np.zeros(4000)
    for t in range(1, 4000):
        y[t] = 0.8 * y[t - 1] + e[t]
    trace = dw.ModelAverage([dw.AR(1), dw.AR(1, memory=dw.ExponentialForgetting(0.98))]).scaled_to(y).scan(y)
    z = trace.normal_score[500:]
    # of 3500 independent ones, five standard deviations
    assert abs(np.mean(abs(z) < 1.96) - 0.95) < 0.02 and abs(np.mean(abs(z) < 0.6745) - 0.5) < 0.045
    assert trace.coverage(0.95, 500) == pytest.approx(np.mean(abs(trace.innovation[500:]) <= trace.band()[500:]))
    assert 0.85 < trace.nis(500) < 1.2


def test_it_is_not_worse_than_the_naive_ones_where_members_are_useless():
    rng = np.random.default_rng(6)
    y = np.cumsum(rng.standard_normal(800)) + 100  # a walk: the last value cannot be beaten
    trace = dw.ModelAverage([dw.Regression(1)]).scan(y, rng.standard_normal(800))
    assert np.sqrt(np.mean(trace.innovation[100:] ** 2)) < 1.05 * np.sqrt(np.mean(np.diff(y)[99:] ** 2))
    assert trace.leader == "last value"


def test_narrowed_it_goes_on_with_fewer(average, record):
    y, u = record
    state = average.scan(y[:100], u[:100]).state
    fewer, go_on = average.narrowed(state, [1])
    assert fewer.names == [average.names[1]]
    assert math.isclose(fewer.weights(go_on).sum(), 1.0)
    assert same(go_on["member0"], state["member1"])
    assert np.isfinite(fewer.scan(y[100:], u[100:], state=go_on).prediction).all()


@pytest.mark.parametrize(
    ("members", "words"),
    [([], "members must be estimators"), ([1], "got 1"), ([dw.ARX(1, 1), dw.ARX(1, (1, 1))], "same inputs")],
)
def test_bad_members_are_refused(members, words):
    with pytest.raises(dw.InputError, match=words):
        dw.ModelAverage(members)


def test_of_a_switch_the_average_is_as_good_as_its_member():
    """Members without an offset need the mean: of a switch the median is one of its two levels."""
    rng = np.random.default_rng(0)
    u = rng.choice([0.0, 1.0], 600, p=[0.3, 0.7])
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], u=u - u.mean(), noise_std=0.1, seed=1)
    alone, together = (est.scaled_to(y, u).scan(y, u) for est in (dw.ARX(2, 2), dw.ModelAverage([dw.ARX(2, 2)])))
    wrong, right = (float(np.std((trace.prediction - y)[100:])) for trace in (together, alone))
    assert wrong < 1.05 * right


def test_a_wrong_number_does_not_move_the_center():
    y = np.random.default_rng(0).standard_normal(600)
    y[[100, 300]] = -9999.0
    (center,) = dw.ModelAverage([dw.AR(1)]).scaled_to(y).center
    assert abs(center) < 0.2


def test_glitches_do_not_make_it_worse_than_its_best_member():
    """Between two glitches the last value is the likeliest; after each of them it is the furthest off."""
    rng = np.random.default_rng(1)
    u = np.repeat(rng.standard_normal(150), 10)
    y, u = dw.simulate([-0.9], [0.1], u=u, noise_std=0.001, seed=1)
    y = y + np.where(rng.random(1500) < 0.02, 5 * y.std() * rng.choice([-1, 1], 1500), 0)
    members = [dw.ARX(1, 1), dw.ARX(8, 8), dw.ARX(2, 2, memory=dw.ExponentialForgetting(0.98))]
    trace = dw.ModelAverage(members).scaled_to(y, u).scan(y, u)
    alone = [np.square((m.scaled_to(y, u).scan(y, u).innovation)[300:]).mean() for m in members]
    together = np.square(trace.innovation[300:]).mean()
    assert together < 1.1 * min(alone)
    assert trace.coverage(0.95, 300) == pytest.approx(
        np.mean(abs(trace.innovation) <= trace.band(), where=np.arange(1500) >= 300)
    )


def test_after_a_rest_the_forecast_is_not_left_to_who_was_best_at_rest():
    """Rounded, at rest for most of the time, nonlinear: one error in motion outweighs all that came at rest."""
    rng, T = np.random.default_rng(1), 1200
    u = np.zeros(T)
    for t in range(40, T, 80):
        u[t : t + rng.integers(3, 25)] = rng.uniform(-4, 4)
    y = lfilter([0.3, 0.0, 0.1], [1, -0.9], u) + 0.1 * np.maximum(u, 0) ** 2
    y = np.round(y + 0.001 * rng.standard_normal(T), 2)
    memories = dw.Constant(), dw.ExponentialForgetting(0.995), dw.ExponentialForgetting(0.98)
    members = [dw.ARX(n, n, k, offset=True, memory=m) for n in (1, 2, 4) for k in (0, 1) for m in memories]
    average = dw.ModelAverage(members).scaled_to(y[:200], u[:200])
    trace = average.scan(y, u)
    best = average.squares(trace.state).min()
    assert np.sum(trace.innovation[average.task.settle :] ** 2) < 1.5 * best  # 10.8 where the rate is a factor of trust


@pytest.mark.parametrize("n", [1, 2, 7, 40])
def test_the_quartile_is_the_one_that_stands_there_in_order(n):
    rng = np.random.default_rng(n)
    for x in (rng.standard_normal(n), np.round(rng.standard_normal(n)), np.arange(1.0 * n), np.zeros(n)):
        for at in {0, (n - 1) // 2, 3 * (n - 1) // 4, n - 1}:
            assert smallest(x.copy(), n, at) == np.sort(x)[at]
