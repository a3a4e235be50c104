"""`validate`: what is wrong is named, what is right is left alone, and the tables are what they say."""

import math

import numpy as np
import pytest

import driftwise as dw
from driftwise.analysis.delays import DelayScan, lagged, lagged_products, longest_delay, shown_delays
from driftwise.analysis.held_model import HeldModel
from driftwise.analysis.residual_tests import echoed, feedback, is_computed
from driftwise.engine.errors import InputError
from driftwise.models.curves import modes, step_response

A, B = [-1.5, 0.7], [1.0, 0.5]


def record(seed, samples=1500, noise_std=0.5, delay=0, level=0.0):
    u = np.random.default_rng(seed + 7000).standard_normal(samples)
    y, _ = dw.simulate(A, B, u=u, samples=samples, noise_std=noise_std, seed=seed)
    return np.concatenate([np.zeros(delay), y[: samples - delay]]) + level, u


def validated(est, y, u):
    return est.scaled_to(y, u).scan(y, u).validate()


def named(found):
    return [verdict.name for verdict in found.verdicts.not_fine]


def test_a_sound_run_is_left_alone():
    told = [named(validated(dw.ARX(2, 2), *record(seed))) for seed in range(30)]
    assert sum(map(bool, told)) <= 4  # five tests at 1 %: 1.5 expected, more than 4 in 2 % of such tests


@pytest.mark.parametrize("delay", [4, 11, 30])
def test_a_wrong_delay_is_named_with_the_right_one(delay):
    found = validated(dw.ARX(2, 2, 1), *record(1, delay=delay))
    assert "delay" in named(found)
    assert f"take nk = {delay + 1}" in found.verdicts.find("delay").advice
    assert named(validated(dw.ARX(2, 2, delay + 1), *record(1, delay=delay))) == []


def test_a_missing_lag_is_named():
    rng = np.random.default_rng(3)
    u = rng.standard_normal(2000)
    y = np.convolve(u, [0, 1.0, 0, 0, 0, 0.6])[:2000] + 0.3 * rng.standard_normal(2000)
    verdict = validated(dw.ARX(0, 2, 1), y, u).verdicts.find("missing lag")
    assert not verdict.is_fine and "nb = 5" in verdict.advice


def controlled(gain, seed, dither=0.0, samples=1500):
    rng = np.random.default_rng(seed)
    y, u, e = np.zeros(samples), np.zeros(samples), rng.standard_normal(samples)
    for t in range(samples):
        y[t] = 0.8 * y[t - 1] + 0.5 * u[t - 1] + e[t] if t else 0.0
        u[t] = -gain * y[t] + dither * rng.standard_normal()
    return y, u


@pytest.mark.parametrize("dither", [0.0, 0.3])
def test_feedback_is_named(dither):
    found = validated(dw.ARX(1, 1, 1), *controlled(0.8, 1, dither))
    assert "feedback" in named(found) and "delay" not in named(found)
    assert is_computed(*controlled(0.8, 1, dither)) == (dither == 0)


def test_an_answer_to_slow_noise_is_feedback():
    """Of what is new in y it sees next to nothing; an input of its own moves ten times as much."""
    rng = np.random.default_rng(6)
    T, level = 2000, np.zeros(2000)
    y, u, told = np.zeros(T), np.zeros(T), []
    for share in (0.0, 0.1):
        for t in range(1, T):
            level[t] = 0.98 * level[t - 1] + 0.1 * rng.standard_normal()
            y[t] = level[t] + 0.2 * u[t - 1] + 0.5 * rng.standard_normal()
            u[t] = rng.standard_normal() - 2 * share * y[t - 1]
        told += feedback(y, u[:, None], 0.99, [True])
    assert told[0].largest < told[0].limit and told[1].largest > 1.3 * told[1].limit


def test_an_answer_to_the_response_alone_is_feedback_and_an_echo_of_its_own_is_none():
    """The noise is a thousandth of the input, but its echo is just the plant's; an echo by another law is no loop."""
    rng = np.random.default_rng(7)
    e, v, own = rng.standard_normal((3, 3000))
    y, u, w = np.zeros(3000), e.copy(), own.copy()
    for t in range(1, 3000):
        y[t] = 0.8 * y[t - 1] + 0.4 * u[max(t - 9, 0)] + 0.1 * v[t]
        u[t] -= 0.3 * y[t - 1]
        w[t] -= 0.5 * w[max(t - 17, 0)]
    (back,) = feedback(y, u[:, None], 0.99, [True])
    assert back.largest < back.limit and echoed(y, u) > 50
    found = validated(dw.ARX(1, 1, 9), y, u)
    assert next(v.advice for v in found.verdicts if v.name == "feedback").startswith("feedback: u answers the output")
    follows = np.convolve(np.roll(w, 3), 0.8 ** np.arange(60))[:3000] + 0.1 * v
    assert echoed(follows, w) < 0


@pytest.mark.parametrize("period", [5, 40])
def test_an_input_that_is_held_answers_nothing(period):
    rng = np.random.default_rng(8)
    u = np.repeat(rng.choice([-1.0, 1.0], 3000), period)[:3000]
    y = np.convolve(np.append(0.0, u), 0.9 ** np.arange(100))[:3000] + 0.3 * rng.standard_normal(3000)
    assert echoed(y, u) < 0


def test_two_valued_and_held_inputs_are_not_computed():
    rng = np.random.default_rng(1)
    for u in (rng.choice([-1.0, 1.0], 1000), np.repeat(rng.standard_normal(60), 20), np.zeros(1000)):
        y = np.convolve(u, 0.8 ** np.arange(30))[: len(u)] + 0.1 * rng.standard_normal(len(u))
        assert not is_computed(y, u)


@pytest.mark.parametrize("where", ["input", "output"])
def test_a_square_law_is_named(where):
    rng = np.random.default_rng(4)
    u, e = rng.standard_normal(1500), 0.3 * rng.standard_normal(1500)
    bent = u + 0.3 * u**2 if where == "input" else u
    y, _ = dw.simulate(A, B, u=bent, samples=1500, noise_std=0.0)
    y = y + 0.1 * y**2 if where == "output" else y
    assert "nonlinearity" in named(validated(dw.OE(2, 2), y + e, u))


def test_an_input_of_two_values_shows_no_square_law_of_its_own():
    rng = np.random.default_rng(5)
    u = rng.choice([-1.0, 1.0], 1500)
    y = 2 * u + rng.standard_normal(1500)
    assert not validated(dw.ARX(0, 1, 0), y, u).verdicts.find("nonlinearity").value > 20


def test_held_forecasts_are_those_of_the_equation_step_by_step():
    y, u = record(5, samples=300, level=3.0)
    est = dw.ARMAX(2, 2, 1, offset=True).scaled_to(y, u)
    state = est.scan(y, u).state
    held = HeldModel.of(est, state)
    a, b, c, offset = held.A, held.B[0], held.C, held.offset
    e = np.zeros(300)
    for t in range(300):
        past = [y[t - i] if t >= i else 0.0 for i in (1, 2)], [u[t - i] if t >= i else 0.0 for i in (1, 2)]
        e[t] = y[t] + a[1] * past[0][0] + a[2] * past[0][1] - b[1] * past[1][0] - b[2] * past[1][1] - offset
        e[t] -= c[1] * e[t - 1] if t else 0.0

    def ahead(t, k):  # forecast of y(t) from samples up to t - k
        known, noise = list(y[: t - k + 1]), list(e[: t - k + 1])
        for s in range(t - k + 1, t + 1):
            known.append(-a[1] * known[s - 1] - a[2] * known[s - 2] + b[1] * u[s - 1] + b[2] * u[s - 2] + offset
                         + c[1] * noise[s - 1])  # fmt: skip
            noise.append(0.0)
        return known[t]

    errors = held.errors(y, u[:, None], (1, 5, 25, math.inf))
    for k in (1, 5, 25):
        assert errors[k][250] == pytest.approx(y[250] - ahead(250, k), abs=1e-9)
    x = np.zeros(300)
    for t in range(2, 300):
        x[t] = -a[1] * x[t - 1] - a[2] * x[t - 2] + b[1] * u[t - 1] + b[2] * u[t - 2] + offset
    assert errors[math.inf][299] == pytest.approx(y[299] - x[299], abs=1e-6)


@pytest.mark.parametrize("est", [dw.ARX(2, 2, offset=True), dw.Joint(2, 1, offset=True), dw.OE(2, 2, offset=True),
                                 dw.BJ(2, 1, 1, 2, offset=True)])  # fmt: skip
def test_a_held_model_errs_as_its_filter_does_when_it_has_settled(est):
    y, u = record(6, samples=4000, level=5.0)
    est = est.scaled_to(y, u)
    trace = est.scan(y, u)
    e = HeldModel.of(est, trace.state).errors(y, u[:, None], (1,))[1]
    assert np.std((e - trace.innovation)[3000:]) < 0.05 * np.std(e[3000:])


def test_fits_are_told_of_samples_that_were_seen_and_of_fresh_ones():
    y, u = record(8)
    found = validated(dw.ARX(2, 2), y, u)
    assert [fit.name for fit in found.fresh] == ["1 step", "5 steps", "25 steps", "simulation"]
    assert all(abs(a.fit - b.fit) < 5 for a, b in zip(found.seen, found.fresh))
    assert found.fresh[0].fit > found.fresh[1].fit > found.fresh[3].fit - 1
    y[1000:] = np.random.default_rng(0).permutation(y[1000:])  # another plant
    assert validated(dw.ARX(2, 2), y, u).fresh[1].fit < 0 < validated(dw.ARX(2, 2), y, u).seen[1].fit


def test_poles_have_the_damping_and_the_frequency_of_continuous_time():
    omega, zeta, dt = 2 * math.pi * 0.5, 0.2, 0.1  # 0.5 Hz
    p = np.exp(dt * omega * complex(-zeta, math.sqrt(1 - zeta**2)))
    rng = np.random.default_rng(2)
    u = rng.standard_normal(3000)
    y, _ = dw.simulate([-2 * p.real, abs(p) ** 2], B, u=u, samples=3000, noise_std=0.2, seed=2)
    model = dw.ARX(2, 2, dt=dt).scaled_to(y, u).scan(y, u).model()
    (mode,) = modes(model, dt)
    assert abs(mode.hertz - 0.5) < 4 * mode.hertz_std < 0.1
    assert abs(mode.damping - zeta) < 4 * mode.damping_std < 0.1
    assert abs(mode.time_constant - 1 / (zeta * omega)) < 4 * mode.time_constant_std

    def numbers(a):
        s = np.log(np.roots([1, *a])[0]) / dt
        return np.array([abs(s) / 2 / math.pi, -s.real / abs(s), -1 / s.real])

    J = np.array([(numbers(model.values[:2] + d) - numbers(model.values[:2] - d)) / 2e-6 for d in 1e-6 * np.eye(2)]).T
    std = np.sqrt(np.diag(J @ model.covariance[:2, :2] @ J.T))
    assert [mode.hertz_std, mode.damping_std, mode.time_constant_std] == pytest.approx(std.tolist(), rel=1e-3)


def test_a_step_response_ends_at_the_gain():
    y, u = record(9)
    model = dw.ARX(2, 2).scaled_to(y, u).scan(y, u).model()
    curve = step_response(model, 0, 1.0)
    assert curve.value[-1] == pytest.approx(model.dc_gain[0], rel=0.01)
    assert (curve.high - curve.low)[-1] / 3.92 == pytest.approx(model.dc_gain_std[0], rel=0.2)


def test_delays_of_several_inputs_are_found_together():
    rng = np.random.default_rng(11)
    u = rng.standard_normal((2000, 2))
    x = np.concatenate([np.zeros(6), u[:-6, 0]]) + 0.7 * np.concatenate([np.zeros(17), u[:-17, 1]])
    y = np.zeros(2000)
    for t in range(1, 2000):
        y[t] = 0.8 * y[t - 1] + x[t] + rng.standard_normal()
    assert DelayScan(y, u, 1, (1, 1), longest_delay(y)).best((1, 1), (0, 0)) == (6, 17)


@pytest.mark.parametrize("missing", [0, 9, 200])
def test_products_of_all_lags_are_those_of_the_samples_that_are_known(missing):
    rng = np.random.default_rng(4)
    x, y = rng.standard_normal(300), rng.standard_normal(300)
    x[rng.choice(300, missing, replace=False)] = np.nan
    X = np.hstack([lagged(x, range(3)), lagged(y, range(7))])
    X = X[6:][np.isfinite(X[6:]).all(axis=1)]
    np.testing.assert_allclose(lagged_products([x, y], [3, 7]), X.T @ X, atol=1e-11)


@pytest.mark.parametrize("delay", [12, 37])
def test_identify_finds_a_long_delay(delay):
    y, u = record(14, delay=delay - 1)
    chosen = dw.identify({"heater": u, "temperature": y}).chosen
    assert chosen.candidate.orders["nk"] == (delay,)


def test_identify_gives_several_inputs_delays_of_their_own():
    rng = np.random.default_rng(15)
    u, y = rng.standard_normal((1500, 2)), np.zeros(1500)
    for t in range(20, 1500):
        y[t] = 0.8 * y[t - 1] + u[t - 6, 0] + 0.7 * u[t - 17, 1] + 0.5 * rng.standard_normal()
    chosen = dw.identify({"heater": u[:, 0], "valve": u[:, 1], "temperature": y}).chosen
    assert chosen.candidate.orders["nk"] == (6, 17) and chosen.name.endswith("6/17)")


def test_the_answer_prints_and_several_outputs_are_refused():
    y, u = record(12)
    text = str(validated(dw.ARX(2, 2), y, u))
    assert all(word in text for word in ("feedback", "simulation", "damping", "Hz"))
    with pytest.raises(InputError, match="one output"):
        dw.ARXMIMO(2, 1, na=1).scan(np.column_stack([y, y[::-1]]), u).validate()


def test_what_was_identified_is_validated_about_its_center():
    y, u = record(13, level=40.0)
    found = dw.identify({"heater": u + 7, "temperature": y}).validate()
    assert named(found) == [] and found.inputs == ("heater",)
    assert found.fresh[0].fit > 85


def test_one_outlier_does_not_hide_the_feedback():
    y, u = controlled(0.8, 2, 0.3)
    y[700] += 1000
    assert "feedback" in named(validated(dw.ARX(1, 1, 1), y, u))


@pytest.mark.parametrize("est", [dw.AR(2, offset=True), dw.ARMA(2, 1), dw.Joint(2)])
def test_a_model_without_inputs_is_validated_and_reported(est, tmp_path):
    from scipy.signal import lfilter

    y = lfilter([1], [1, *A], np.random.default_rng(16).standard_normal(1200))
    trace = est.scaled_to(y).scan(y)
    found = trace.validate()
    assert [verdict.name for verdict in found.verdicts] == ["autocorrelation", "nonlinearity"] and found.is_fine
    assert "Poles in time" in trace.report(tmp_path / "page.html").read_text()
    assert "Poles in time" in found.report(tmp_path / "own.html").read_text()


@pytest.mark.parametrize("delay", [0, 1, 2, 3, 17])
def test_a_delay_begins_with_the_first_lag_that_counts(delay):
    """Beside noise that is no equation error, where coefficients that lie later look better."""
    rng, found = np.random.default_rng(8), []
    for _ in range(20):
        u = rng.standard_normal(1500)
        x = np.convolve(u, np.r_[np.zeros(delay), 0.3, 1.0, 1.2, 1.1 * 0.9 ** np.arange(60)])[:1500]
        found.append(shown_delays(x + 2.0 * rng.standard_normal(1500), u[:, None]))
    assert found.count(() if delay == 1 else (delay,)) >= 18


def test_an_input_that_does_nothing_has_no_delay():
    """Of forty delays tried, one stands out by chance in one record of twenty."""
    rng = np.random.default_rng(9)
    found = [shown_delays(rng.standard_normal(600), rng.standard_normal((600, 1))) for _ in range(40)]
    assert found.count(()) >= 35
