"""What a memory knows of the drift, and what a run says of it: speeds, louder noise, outliers, rest, jumps."""

import numpy as np
import pytest

import driftwise as dw
from driftwise.estimators.arx.speeds import Speeds
from driftwise.results.events import Event


def speeds(*memories, weights=None, samples=1000):
    names = [f"b{i + 1}" for i in range(len(memories))]
    return Speeds(names, np.array(memories, float) ** -2.0, samples, weights)


def test_speeds_in_words():
    assert speeds(40, 600, 2.5).words == "b1 forgets in about 40, b3 in about 2.5 samples; b2 stands still"
    assert speeds(600, 700, np.nan, 30).words == (
        "b4 forgets in about 30 samples; b1, b2 stand still; of b3 nothing was seen"
    )
    assert speeds(600, np.inf).words == "no parameter drifts" and speeds(600, np.inf).is_still.all()
    some = dict(still=0.2, fast=0.1, learnt=0.7)
    assert speeds(40, weights=some).words == "b1 forgets in about 40 samples (70 % likely)"
    still = speeds(40, weights=dict(still=0.6, fast=0.1, learnt=0.3))
    assert still.words == "no parameter drifts (60 % likely), or else b1 forgets in about 40 samples"
    assert still.is_still.all() and not speeds(40, weights=some).is_still.any()
    fast = speeds(40, weights=dict(still=0.1, fast=0.6, learnt=0.3))
    assert fast.words.startswith("all parameters forget in about 3.2 samples (60 % likely), or else b1 forgets")
    assert speeds(40, weights={"0": 0.9, "0.1": 0.1}).words == "b1 forgets in about 40 samples"


def drifting(samples=1500, seed=3):
    """Return y, phi: slope walks (NVR 0.01, memory 10), other stands; the noise is known."""
    rng = np.random.default_rng(seed)
    phi, walk = rng.standard_normal((samples, 2)), np.cumsum(0.05 * rng.standard_normal(samples))
    return phi[:, 0] * walk + 2 * phi[:, 1] + 0.5 * rng.standard_normal(samples), phi


def regression(memory):
    return dw.Regression(["slope", "other"], memory=memory)


def test_a_speed_that_was_said_is_read_back():
    """In units of the noise as it is; in units of theta by the variance it leaves, P/q: near 1/sqrt(NVR)."""
    y, phi = drifting()
    est = regression(dw.memory.Drift(nvr=[1e-2, 1e-4]))
    np.testing.assert_allclose(est.drift_of(est.scan(y, phi).state).memory, [10, 100])
    walks = regression(dw.RandomWalk([1e-2, 1e-4]))
    known = walks.scan(y, phi).state
    P, s2 = np.diag(walks.covariance(known)), walks.sigma2(known)
    np.testing.assert_allclose(P / [1e-2, 1e-4], [10, 100], rtol=0.5)
    for memory, q in (
        (walks.options["memory"], np.array([1e-2, 1e-4])),
        (dw.memory.Drift(q=[1e-2, 1e-4]), np.array([1e-2, 1e-4])),
        (dw.memory.Drift(np.eye(2), [[2e-2, 1e-3], [1e-3, 3e-4]]), np.array([2e-2, 3e-4])),
        (dw.RandomWalk(matched=([0.5, 0.1], 25)), np.array([1e-2, 4e-4]) / s2),
    ):
        est = regression(memory)
        state = est.start()
        for name in ("U", "D", "observed", "count", "chi2"):
            state[name] = known[name]
        np.testing.assert_allclose(est.drift_of(state).memory, P / q, rtol=1e-9)
    est = regression(dw.Constant())
    assert est.drift_of(est.start()) is None and est.scan(y, phi).summary().drift is None
    with pytest.raises(dw.InputError, match="one state is expected"):
        est.drift_of(est.start(3))


def test_auto_finds_the_speeds_and_says_so():
    y, phi = drifting()
    est = regression(dw.AutoMemory())
    summary = est.scan(y, phi).summary()
    found = summary.drift
    slope, other = found.memory
    assert 6 < slope < 16 and other > 3 * slope and sum(found.weights.values()) == pytest.approx(1)
    assert list(found.weights) == ["still", "fast", "learnt"] and found.weights["learnt"] > 0.5
    assert f" Drift: {found.words}." in summary.words
    rows = summary.as_dict()["drift"]["parameters"]
    assert [row["name"] for row in rows] == ["slope", "other"] and rows[0]["nvr"] == pytest.approx(slope**-2)
    nothing = est.drift_of(est.start())
    assert np.isnan(nothing.nvr).all() and nothing.words.endswith("of slope, other nothing was seen")


def test_what_happened_is_counted_and_said_and_outliers_are_left_out_of_the_numbers(tmp_path):
    """other jumps from 2 to 6 at 600, a glitch at 400, noise three times as loud from 900, nothing moves after 1400."""
    rng = np.random.default_rng(5)
    phi, e = rng.standard_normal((1500, 2)), 0.2 * rng.standard_normal(1500)
    e[900:] *= 3
    phi[1400:] *= 0.01
    y = phi[:, 0] + np.where(np.arange(1500) < 600, 2.0, 6.0) * phi[:, 1] + e
    y[400] += 20
    est = regression(dw.AutoMemory())
    trace = est.scan(y, phi)
    summary = trace.summary()
    outliers, rises, rest = (summary.happened[name] for name in ("outliers", "noise_rises", "at_rest"))
    status = trace.status
    assert status[400] & dw.Status.OUTLIER and outliers[0] == np.count_nonzero(status & dw.Status.OUTLIER) <= 5
    assert rises == (1, trace.time[status & dw.Status.NOISE != 0][0]) and 900 < rises[1] < 940
    assert 97 <= rest[0] <= 100 and rest[1] == 1499, "a row that is small by chance is no rest"
    (jump,) = trace.jumps()
    assert jump.parameter == "other" and jump.direction == 1 and jump.since in (600, 601) and jump.odds > 5
    words = summary.words
    assert f"jumped once, at {jump.time:.6g} s ({jump.moved}, odds " in words and "other jumped from 2" in words
    assert f"The noise level rose once, at {rises[1]:.6g} s." in words
    assert f"{outliers[0]} outlier" in words and f"{rest[0]} at rest (the last at 1499 s)" in words
    assert summary.as_dict()["noise_rises"] == {"samples": 1, "last": rises[1]}
    nis = trace.innovation**2 / trace.variance
    assert nis[400] > 1000 and summary.nis - nis[600] / 1500 < 1.1, (
        "one glitch does not condemn the bars; a jump counts"
    )
    text = trace.report(tmp_path / "r.html").read_text()
    for legend in ('"louder noise"', '"jump"', '"outlier"', "rises of the noise (dotted)", jump.text):
        assert legend in text
    smoothed = est.smooth(y[:800], phi[:800])
    assert not smoothed.is_used[400] and [step.sample for step in smoothed.jumps] == [600]
    halves = dw.results.Summary(est)
    first = est.scan(y[:700], phi[:700])
    halves.add(first).add(est.scan(y[700:], phi[700:], state=first.state))
    assert halves.happened == summary.happened and halves.last_moved == summary.last_moved


def test_several_outputs_say_each_its_own():
    """The second equation's slope on u jumps at 500; a memory that weighs explanations tells it, of output 2 alone."""
    rng = np.random.default_rng(2)
    u, e, y = rng.standard_normal(800), 0.1 * rng.standard_normal((800, 2)), np.zeros((800, 2))
    for t in range(1, 800):
        y[t] = 0.5 * y[t - 1] + [u[t - 1], (1.0 if t < 500 else 3.0) * u[t - 1]] + e[t]
    orders = dict(na=[[1, 0], [0, 1]], nb=1)
    est = dw.ARXMIMO(2, 1, **orders, memory=dw.memory.BayesianChangePoint(1.0, 500))
    trace = est.scan(y, u)
    (jump,) = trace.jumps()
    assert jump in trace.events() and jump.text.startswith("output 2: b1.21 jumped from 0.99") and jump.odds > 100
    assert abs(jump.since - 500) <= 1
    summary = trace.summary()
    assert [one.jumps for one in summary.outputs] == [0, 1] and "; its parameters jumped 1 time" in summary.words
    assert summary.as_dict()["outputs"][1]["noise_rises"]["samples"] == 0 and summary.outputs[0].drift is None
    (bare,) = est.scan(y, u, keep="means").jumps()
    assert bare.text.startswith("output 2: jump: parameters jumped (statistic ")
    assert bare.direction == 0 and bare.parameter is None
    walks = dw.ARXMIMO(2, 1, **orders, memory=dw.RandomWalk(1e-5))
    summary = walks.scan(y, u).summary()
    first, second = walks.drift_of(summary.state)
    assert first.names == ["a1.11", "b1.11"] and second.names == ["a1.22", "b1.21"]
    assert f"; drift: {second.words}" in summary.words
    P = walks.covariance(summary.state)
    np.testing.assert_allclose([*first.memory, *second.memory], np.diag(P) / 1e-5, rtol=1e-9)


def test_a_jump_dated_to_the_first_sample_is_judged_from_there():
    y, phi = drifting(300)
    trace = regression(dw.Constant()).scan(y, phi)
    event = Event(20, 20.0, "JUMP", "", since=0)
    assert repr(trace.what_changed(event)) == repr(trace.what_changed(0)) != repr(trace.what_changed(20))


def test_a_default_prior_that_is_not_wide_is_told():
    """Data a ten-thousandth of the scales: the prior rules, and the summary says what to do; scaled, it does not."""
    y, u = dw.simulate([-0.9], [0.5], samples=500, noise_std=0.1, seed=1)
    y, u = 1e-4 * y, 1e-4 * u
    est = dw.ARX(1, 1)
    assert "Use est.scaled_to(y, u)" in est.scan(y, u).summary().words
    scaled = est.scaled_to(y, u).scan(y, u).summary()
    assert "scaled_to" not in scaled.words and scaled.prior_share < 1e-4
    with pytest.raises(dw.InputError, match="percentage"):
        est.scan(y, u).band(95)


def test_states_that_cannot_be_kept_or_read_say_why(tmp_path):
    est = dw.ARX(1, 1)
    with pytest.raises(dw.InputError, match="takes"):
        dw.save_state(est.start(), est, tmp_path / "state.json")
    (tmp_path / "other.json").write_text("import nothing")
    with pytest.raises(dw.InputError, match="no file that save_state wrote"):
        dw.load_state(tmp_path / "other.json")
    dw.save_state(est, est.start(), tmp_path / "state.json")
    text = (tmp_path / "state.json").read_text()
    (tmp_path / "older.json").write_text(text.replace('"0x0.0p+0", ', "", 1))
    with pytest.raises(dw.InputError, match="an earlier version and cannot be continued"):
        dw.load_state(tmp_path / "older.json")
