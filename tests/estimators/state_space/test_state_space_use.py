"""What is done with a filter of one's own matrices: forecasts, page, figures, files, sentences."""

import json

import numpy as np
import pytest
from oracle.linear_gaussian import dense, each

import driftwise as dw
from driftwise.analysis.laws import same

F, G, H = np.array([[1.0, 1.0], [0.0, 0.9]]), np.array([[0.0], [1.0]]), np.eye(2)
OPTIONS = dict(states=("way", "speed"), inputs=("force",), outputs=("radar", "wheel"))
EST = dw.StateSpace(F, G, H, Q=[0.0, 0.1], R=[1.0, 0.5], P0=1.0, **OPTIONS)


def record(T=200, seed=1):
    rng = np.random.default_rng(seed)
    x, u, y = np.zeros(2), rng.standard_normal((T, 1)), np.zeros((T, 2))
    for t in range(T):
        y[t] = x + np.sqrt([1.0, 0.5]) * rng.standard_normal(2)
        x = F @ x + G @ u[t] + [0.0, np.sqrt(0.1) * rng.standard_normal()]
    y[50:60] = y[3, 1] = np.nan
    return y, u


def test_a_forecast_is_the_dense_gaussians():
    y, u = record(6)
    ahead = np.array([[1.0], [-1.0], [0.5]])
    mean, std = EST.predict(EST.scan(y, u).state, ahead)
    more = np.concatenate([y, np.full((3, 2), np.nan)])
    for k in range(3):
        T = len(y) + k + 1
        matrices = each((F, G, H, np.zeros((2, 1)), np.diag([0.0, 0.1]), np.diag([1.0, 0.5])), T)
        x, P, _ = dense(*matrices, np.zeros(2), np.eye(2), more[:T], np.concatenate([u, ahead])[:T])
        np.testing.assert_allclose(mean[k], x, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(std[k] ** 2, np.diag(P) + [1.0, 0.5], rtol=1e-9)


def test_page_figure_table_and_words(tmp_path):
    y, u = record()
    trace = EST.scan(y, u)
    page = trace.report(tmp_path / "page.html").read_text()
    for name in ("radar", "wheel", "way", "speed", "force", "log evidence", "Bands: two standard deviations"):
        assert name in page
    assert len(trace.plot()) == 6
    table = trace.to_frame()
    assert {"way", "way_std", "nis", "log_density", "innovation.radar"} <= set(table.columns)
    said = trace.summary()
    assert said.words.startswith("radar is predicted as well as the plant and the noise say (NIS ")
    found = json.loads(json.dumps(said.as_dict()))
    assert found["loglik"] == pytest.approx(trace.log_density.sum()) and found["estimates"][1]["name"] == "speed"
    assert "Q or R is too small, or F and H" in EST.replace(R=[0.01, 0.005]).scan(y, u).summary().words


def test_what_is_learnt_of_the_noise_is_said(tmp_path):
    y, u = record()
    est = EST.replace(Q=[0.0, 1.0], memory=dw.memory.LikelihoodDrift(), scale=dw.models.InverseGamma(2.0, 2.0))
    trace = est.scan(y, u)
    said, found = trace.summary().words, trace.summary().as_dict()
    assert "Q and R are " in said and "times what was given besides, within a factor of" in said
    assert found["noise_factor"] < 0.5 < found["noise_factor_std"] * 2 and found["sigma2"] == est.sigma2(trace.state)
    assert "times what was given besides" in trace.report(tmp_path / "page.html").read_text()
    hidden = dw.StateSpace([[1, 0], [0, 0.5]], H=[1, 0], Q=0.1, R=1.0, states=("level", "hidden"))
    assert "hidden cannot be told from y" in hidden.scan(y[:, 0]).summary().words


def test_states_traces_and_settings_are_saved(tmp_path):
    y, u = record()
    trace = EST.scan(y, u)
    dw.save_state(EST, trace.state, tmp_path / "state.json")
    again, state = dw.load_state(tmp_path / "state.json")
    more, force = record(40, seed=2)
    assert same(again.scan(more, force, state=state).state, EST.scan(more, force, state=trace.state).state)
    trace.save(tmp_path / "trace.npz")
    found = dw.Trace.load(tmp_path / "trace.npz")
    assert type(found) is type(trace) and same(found.table, trace.table) and found.nis.tolist() == trace.nis.tolist()
    est = dw.StateSpace(lambda dt: 0.9**dt, Q=1.0, R=1.0)
    with pytest.raises(dw.InputError, match="has a policy or a function that is not driftwise's own"):
        dw.save_state(est, est.start(), tmp_path / "function.json")
    with pytest.raises(dw.InputError, match="StateSpace is not exported: it needs a host"):
        est.export(tmp_path)


def test_many_series_are_each_by_itself():
    y, u = record()
    series = np.array([y, 2 * y, y[::-1]])
    states, _ = EST.update_batch(EST.start(3), series, np.array([u, u, u]))
    for i in range(3):
        assert same(states[i], EST.scan(series[i], u).state)
    fleet = dw.Fleet(EST)
    fleet.scan(np.tile(["a", "b", "c"], len(y)), series.swapaxes(0, 1).reshape(-1, 2), np.repeat(u, 3, axis=0))
    assert all(same(fleet.state(key), states[i]) for i, key in enumerate("abc"))


def test_a_record_with_matrices_of_each_sample_is_a_trace_like_any_other():
    pd = pytest.importorskip("pandas")
    y, u = record(20)
    table = pd.DataFrame(y, index=pd.date_range("2026-01-01", periods=20, freq="h"))
    plain, given = EST.scan(table, u), EST.scan(table, u, F=np.broadcast_to(F, (20, 2, 2)))
    assert given.index is not None and given.index.equals(plain.index)
    np.testing.assert_array_equal(given.table, plain.table)
    assert given.begun.tobytes() == EST.start().tobytes()
