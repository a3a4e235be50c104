"""The trace says what happened, in columns that other tools can read."""

import json

import numpy as np
import pytest

import driftwise as dw
from driftwise.analysis.laws import same
from driftwise.results.snapshot import describe, load_state, save_state


@pytest.fixture(scope="module")
def trace():
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=1500, noise_std=0.1, seed=3, missing=0.05)
    return dw.Joint(2, inputs=1, dt=0.5).scan(y, u, keep="covariance")


def test_columns_fit_together(trace):
    used = trace.is_used
    np.testing.assert_allclose((trace.y - trace.prediction)[used], trace.innovation[used], atol=1e-12)
    assert np.isnan(trace.innovation[np.isnan(trace.y)]).all()
    P = trace.covariance
    np.testing.assert_allclose(np.sqrt(np.einsum("tii->ti", P))[:, 2:], trace.parameters_std)
    assert np.allclose(P, P.swapaxes(1, 2))
    std = trace.estimator.scan(trace.y, trace.u)
    np.testing.assert_allclose(std.parameters_std, trace.parameters_std, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(trace.time, 0.5 * np.arange(len(trace)))


def test_filtered_state_explains_the_output(trace):
    """x(t|t) lies between prediction and measurement, and knows more than the prediction did."""
    late = slice(200, None)
    assert np.nanmean((trace.y - trace.x[:, 0])[late] ** 2) < np.nanmean(trace.innovation[late] ** 2)


def test_time_continues_over_pieces():
    est = dw.Joint(1, dt=0.1)
    first = est.scan(np.zeros(5))
    second = est.scan(np.zeros(3), state=first.state)
    np.testing.assert_allclose(second.time, [0.5, 0.6, 0.7])


@pytest.mark.parametrize("backend", ["pandas", "polars", "pyarrow"])
def test_frames(trace, backend):
    frame = trace.to_frame(backend)
    names = frame.column_names if backend == "pyarrow" else list(frame.columns)
    assert names[:7] == ["time", "y", "u", "prediction", "innovation", "variance", "dof"]
    assert {"x2", "x1", "a1", "b2", "a1_std"} <= set(names)
    assert len(frame) == len(trace)


def test_saved_trace_comes_back(trace, tmp_path):
    trace.save(tmp_path / "t.npz")
    back = dw.Trace.load(tmp_path / "t.npz")
    assert same(back.table, trace.table) and same(back.state, trace.state)
    assert describe(back.estimator) == describe(trace.estimator)
    more = [0.1, 0.2], [1.0, 1.0]
    assert same(
        back.estimator.scan(*more, state=back.state).table, trace.estimator.scan(*more, state=trace.state).table
    )


def test_fleet_of_states_comes_back(tmp_path):
    est = dw.Joint(
        2, noise=dw.models.NoisePolynomial([0.1, 0.2]), memory=dw.RandomWalk([1e-3, 1e-4]), gate=dw.InnovationGate(4.0)
    )
    states, _ = est.update_batch(est.start(5), np.random.default_rng(0).standard_normal((5, 30)))
    save_state(est, states, tmp_path / "s.json")
    other, back = load_state(tmp_path / "s.json")
    assert same(back, states) and describe(other) == describe(est)


def test_a_file_of_another_schema_is_refused(tmp_path):
    (tmp_path / "s.json").write_text(json.dumps({"schema": 99, "options": {}, "rows": [], "shape": []}))
    with pytest.raises(dw.InputError, match="schema 99"):
        load_state(tmp_path / "s.json")


def test_summary_in_pieces_is_the_summary_of_the_whole(trace):
    est = trace.estimator
    whole, pieces, state = trace.summary(), dw.results.Summary(est), None
    for part in np.array_split(np.arange(len(trace)), 7):
        piece = est.scan(trace.y[part], trace.u[part], state=state)
        state = piece.state
        pieces.add(piece)
    a, b = whole.as_dict(), pieces.as_dict()
    assert a["samples"] == b["samples"] == 1500
    for key in ("fit", "rmse", "nis", "coverage", "loglik", "noise_std"):
        assert a[key] == pytest.approx(b[key], rel=1e-9), key
    assert a["whiteness"]["statistic"] == pytest.approx(b["whiteness"]["statistic"], rel=1e-9)
    json.dumps(a, allow_nan=False)


def test_summary_of_a_right_model_is_content(trace):
    s = trace.summary()
    assert 0.9 < s.nis < 1.1 and 0.93 < s.coverage < 0.97 and s.whiteness.is_white
    assert s.noise_std == pytest.approx(0.1, rel=0.1)
    assert s.missing_outputs == np.isnan(trace.y).sum()
    assert "can be believed" in s.words and "white" in s.words


def test_whiteness_is_ljung_box_without_correction():
    from statsmodels.stats.diagnostic import acorr_ljungbox

    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=1500, noise_std=0.1, seed=3)  # no gaps: statsmodels knows none
    trace = dw.Joint(2, inputs=1).scan(y, u)
    s = trace.summary()
    late = np.arange(len(trace)) >= s.settle
    z = (trace.innovation / np.sqrt(trace.variance))[trace.is_used & late]
    table = acorr_ljungbox(z, lags=[20])
    statistic, p = table["lb_stat"].iloc[0], table["lb_pvalue"].iloc[0]
    # statsmodels takes the mean off first, here zero is the model's own mean
    assert s.whiteness.statistic == pytest.approx(statistic, rel=0.05)
    assert s.whiteness.p_value == pytest.approx(p, abs=0.05)


def test_excitation_names_what_was_not_learned():
    y, _ = dw.simulate([-0.8], [1.0], samples=300, noise_std=0.1, u=np.zeros(300), seed=1)
    s = dw.Joint(1, inputs=1).scan(y, np.zeros(300)).summary()
    assert [d for d, _ in s.unlearned] == ["b1"]
    assert "did not teach b1" in s.words
    y, u = dw.simulate([-0.8], [1.0], samples=300, noise_std=0.1, seed=1)
    assert dw.Joint(1, inputs=1).scan(y, u).summary().unlearned == []


def test_events_tell_runs_of_the_same_thing_once():
    y = np.r_[np.zeros(5), np.nan, np.nan, np.zeros(5)]
    events = dw.Joint(1, noise=dw.models.EquationError(1.0)).scan(y).events()
    assert [(e.sample, e.kind) for e in events] == [(5, "MISSING_OUTPUT")]
    assert "2 samples" in events[0].text


def test_gate_ignores_one_outlier_and_believes_a_change():
    y, u = dw.simulate([-0.8], [1.0], samples=400, noise_std=0.05, noise="equation", seed=5)
    spoiled = y.copy()
    spoiled[200] += 50.0
    est = dw.Joint(1, inputs=1, noise=dw.models.EquationError(0.0025), gate=dw.InnovationGate(5.0, patience=3), P0=10.0)
    clean, gated = est.scan(y, u), est.scan(spoiled, u)
    assert gated.status[200] & dw.Status.REJECTED and not gated.status[201] & dw.Status.REJECTED
    np.testing.assert_allclose(gated.parameters[-1], clean.parameters[-1], atol=0.02)
    level = np.r_[y[:200], y[200:] + 50.0]
    status = est.scan(level, u).status[200:220] & int(dw.Status.REJECTED)
    assert np.count_nonzero(status[:3]) == 3 and status[3] == 0


def test_walk_follows_and_rests():
    a = np.where(np.arange(2000)[:, None] < 1000, -0.9, -0.5)
    y, u = dw.simulate(a, [1.0], samples=2000, noise_std=0.1, noise="equation", seed=6)
    est = dw.Joint(1, inputs=1, noise=dw.models.EquationError(0.01), memory=dw.RandomWalk([1e-4, 0.0]), P0=1.0)
    trace = est.scan(y, u)
    assert abs(trace.parameters[990, 0] + 0.9) < 0.1
    assert abs(trace.parameters[-1, 0] + 0.5) < 0.1
    resting = est.scan(np.zeros(20000), np.zeros(20000))
    assert resting.parameters_std[-1, 0] <= 1.0 + 1e-9
    assert resting.status[-1] & dw.Status.CAPPED
