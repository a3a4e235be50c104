"""`ContinuousJoint` in use: clocks, doors, laws, saving, the model that comes out."""

import numpy as np
import pytest
from memories_of_joint import MEMORIES
from oracle import continuous as oracle
from oracle.continuous import problem

import driftwise as dw
from driftwise.analysis.laws import LAWS, example, same
from driftwise.models.canonical import Canonical
from driftwise.models.continuous import ContinuousModel

C = 1.3


# --- clocks, doors, laws -----------------------------------------------------------------------------------

ESTIMATORS = {
    "default": dw.ContinuousJoint(2, 1),
    "no input": dw.ContinuousJoint(3, observer=2.0),
    "two inputs, walk, gate": dw.ContinuousJoint(
        1,
        2,
        dt=0.1,
        noise=dw.models.EquationError(0.01),
        memory=dw.RandomWalk(1e-4),
        gate=dw.InnovationGate(),
        P0=100.0,
    ),
    "exact": dw.ContinuousJoint(2, 1, noise=dw.models.EquationError(0.0), P0=100.0),
    **{name: dw.ContinuousJoint(2, 1, memory=memory) for name, memory in MEMORIES.items()},
}


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.__name__)
@pytest.mark.parametrize("name", ESTIMATORS)
def test_law(name, law):
    law(ESTIMATORS[name], *example(ESTIMATORS[name]))


def test_time_stamps_one_by_one_in_halves_and_as_a_fleet():
    time, y, u = problem(11)
    est = dw.ContinuousJoint(2, 1, observer=C, memory=dw.RandomWalk(1e-3), gate=dw.InnovationGate())
    whole = est.scan(y, u, time=time)
    state = est.start()
    for t in range(len(y)):
        state, _ = est.update(state, y[t], u[t], time=time[t])
    assert same(state, whole.state)
    first = est.scan(y[:33], u[:33], time=time[:33])
    second = est.scan(y[33:], u[33:], time=time[33:], state=first.state)
    assert same(second.state, whole.state) and same(np.r_[first.table, second.table], whole.table)
    states, _ = est.update_batch(est.start(2), np.stack([y, y]), np.stack([u, u]), time=np.stack([time, time + 7.0]))
    assert same(states[0], whole.state)
    np.testing.assert_allclose(states[1]["theta"], whole.state["theta"], rtol=1e-8)
    assert same(whole.time, time)


def test_dt_is_the_clock_without_stamps():
    y, u = example(ESTIMATORS["default"])
    est = dw.ContinuousJoint(2, 1, dt=0.25)
    plain, stamped = est.scan(y, u), est.scan(y, u, time=0.25 * np.arange(len(y)))
    np.testing.assert_array_equal(plain.time, stamped.time)
    assert same(plain.table, stamped.table)


def test_a_walk_goes_by_the_second():
    """Ten empty samples within a second widen as much as one second does, and never beyond the prior."""
    est = dw.ContinuousJoint(
        1, 1, observer=1.0, noise=dw.models.EquationError(0.01), memory=dw.RandomWalk(1e-3), P0=2.0
    )
    y, u = dw.models.simulate_continuous([1.0], [1.0], time=np.arange(50) * 0.3)
    state = est.scan(y, u, time=np.arange(50) * 0.3).state
    one, _ = est.update(state, np.nan, 0.0, time=15.7)
    many = state
    for t in np.linspace(14.8, 15.7, 10):
        many, _ = est.update(many, np.nan, 0.0, time=t)
    np.testing.assert_allclose(est.covariance(one), est.covariance(many), rtol=1e-12, atol=1e-15)
    seconds = 15.7 - 49 * 0.3
    widened = np.diag(est.covariance(one) - est.covariance(state))[1:]
    np.testing.assert_allclose(widened, 1e-3 * seconds, rtol=1e-9)
    late, step = est.update(state, np.nan, 0.0, time=1e6)
    assert step.status & dw.Status.CAPPED
    np.testing.assert_allclose(np.diag(est.covariance(late))[1:], 2.0, rtol=1e-9)


def test_an_outlier_is_passed_by():
    time, y, u = problem(12, gaps=False, late=False)
    y = oracle.own_law(C, [1.0, 2.0], [[0.0, 1.0]], [0, 0], time, u, np.zeros(60))
    est = dw.ContinuousJoint(
        2, 1, observer=C, noise=dw.models.EquationError(1e-4), gate=dw.InnovationGate(6.0, settle=20)
    )
    spoiled, gap = y.copy(), y.copy()
    spoiled[40], gap[40] = 1e3, np.nan
    a, b = est.scan(spoiled, u, time=time), est.scan(gap, u, time=time)
    assert a.status[40] & dw.Status.REJECTED
    assert same(a.parameters, b.parameters)


@pytest.mark.parametrize(
    "change, words",
    [
        (lambda t: np.r_[t[:5], t[3], t[6:]], r"time\[5\].*unsorted"),
        (lambda t: np.r_[t[:5], t[4], t[6:]], r"time\[5\] = .* repeats .*clock too coarse"),
        (lambda t: np.r_[t[:5], np.nan, t[6:]], r"time\[5\] is nan"),
        (lambda t: t[:-1], "one instant per sample"),
        (lambda t: ["noon"] * len(t), "turn dates into seconds"),
    ],
)
def test_bad_time_stamps_are_named(change, words):
    time, y, u = problem(13)
    with pytest.raises(dw.InputError, match=words):
        dw.ContinuousJoint(2, 1).scan(y, u, time=change(time))


def test_a_stream_does_not_go_back():
    est = dw.ContinuousJoint(1)
    state, _ = est.update(est.start(), 1.0, time=10.0)
    for time in (10.0, 9.0):
        with pytest.raises(dw.InputError, match="not after the state's last sample at 10 s"):
            est.update(state, 1.0, time=time)


@pytest.mark.parametrize(
    "options, words",
    [
        (dict(observer=0.0), "observer must be a positive"),
        (dict(noise=dw.models.OutputError()), "noise must be EquationError"),
        (dict(memory=0.98), "memory must be Constant"),
        (dict(order=13), "order must be at most 12"),
        (dict(dt=-1.0), "dt must be a positive"),
    ],
)
def test_bad_options_are_named(options, words):
    with pytest.raises(dw.InputError, match=words):
        dw.ContinuousJoint(**{"order": 2, **options})


def test_save_and_load(tmp_path):
    time, y, u = problem(14)
    est = dw.ContinuousJoint(2, 1, observer=C, memory=dw.RandomWalk(1e-3))
    trace = est.scan(y, u, time=time)
    trace.save(tmp_path / "run.npz")
    back = dw.Trace.load(tmp_path / "run.npz")
    assert type(back.estimator) is type(est) and same(back.estimator.spec, est.spec)
    assert same(back.table, trace.table) and same(back.time, time)
    dw.save_state(est, trace.state, tmp_path / "s.json")
    other, state = dw.load_state(tmp_path / "s.json")
    a, b = (e.update(s, 1.0, 0.5, time=time[-1] + 1) for e, s in ((est, trace.state), (other, state)))
    assert same(a[0], b[0])


# --- the model ---------------------------------------------------------------------------------------------


def test_model():
    from scipy import signal

    model = ContinuousModel(Canonical(2, 1), np.array([0.3, 1.0, 0.5, 2.0]), np.diag([1e-6, 4e-6, 1e-6, 1e-6]))
    A, B, Cm, D = model.to_scipy()
    assert isinstance(signal.lti(A, B, Cm, D), signal.StateSpace)
    np.testing.assert_allclose(
        sorted(model.poles, key=lambda p: p.imag), sorted(np.roots([1, 0.3, 1.0]), key=lambda p: p.imag)
    )
    assert model.is_stable and model.dc_gain == pytest.approx([2.0])
    for w in (0.3, 1.7):
        p = 1j * w
        expected = (0.5 * p + 2) / (p * p + 0.3 * p + 1)
        assert model.frequency_response(w)[0][0, 0] == pytest.approx(expected, rel=1e-12)
        assert (Cm @ np.linalg.solve(p * np.eye(2) - A, B) + D)[0, 0] == pytest.approx(expected, rel=1e-12)
    rng = np.random.default_rng(0)
    draws = model.values + rng.standard_normal((4000, 4)) * np.sqrt(np.diag(model.covariance))
    poles = np.array([ContinuousModel(model.form, d, model.covariance).poles[0] for d in draws])
    spread = np.cov(np.stack([poles.real, poles.imag]))
    np.testing.assert_allclose(np.diag(model.poles_covariance[0]), np.diag(spread), rtol=0.08)
    assert np.std(draws[:, 3] / draws[:, 1]) == pytest.approx(model.dc_gain_std[0], rel=0.05)


def test_model_to_control():
    control = pytest.importorskip("control")
    model = ContinuousModel(Canonical(1, 1), np.array([2.0, 3.0]), np.eye(2))
    system = model.to_control()
    assert system.isctime() and control.dcgain(system) == pytest.approx(1.5)
    with pytest.raises(dw.InputError, match="no input"):
        ContinuousModel(Canonical(1), np.array([2.0]), np.eye(1)).to_control()


def test_trace_gives_continuous_models():
    time, y, u = problem(15)
    est = dw.ContinuousJoint(2, 1, observer=C)
    trace = est.scan(y, u, time=time)
    assert isinstance(trace.model(), ContinuousModel) and isinstance(trace.model(30), ContinuousModel)
    np.testing.assert_array_equal(trace.model(30).values, trace.parameters[30])


def test_simulation_is_the_exact_plant():
    """Held inputs, any instants: against scipy's lsim on a grid that contains them."""
    from scipy import signal

    grid = np.arange(0, 200) * 0.05
    at = np.array([0, 3, 4, 20, 33, 80, 81, 150, 199])
    u = np.random.default_rng(1).standard_normal(len(at))
    fine = np.repeat(u, np.diff(np.append(at, 200)))
    A, B, Cm, D = ContinuousModel(Canonical(2, 1), np.array([0.3, 1.0, 0.5, 2.0]), np.eye(4)).to_scipy()
    Ad, Bd, *_ = signal.cont2discrete((A, B, Cm, D), 0.05)
    x, expected = np.array([1.0, -1.0]), []
    for value in fine:
        expected.append(x[0])
        x = Ad @ x + Bd[:, 0] * value
    y, _ = dw.models.simulate_continuous([0.3, 1.0], [0.5, 2.0], time=grid[at], u=u, x0=[1.0, -1.0])
    np.testing.assert_allclose(y, np.array(expected)[at], rtol=1e-9, atol=1e-12)
    with pytest.raises(dw.InputError, match="increasing"):
        dw.models.simulate_continuous([1.0], time=[0.0, 0.0])


def test_words_of_a_run():
    time = np.cumsum(np.random.default_rng(0).uniform(0.05, 0.15, 600))
    y, u = dw.models.simulate_continuous([2.0], [4.0], time=time, noise_std=0.002, seed=3)
    words = dw.ContinuousJoint(1, 1).scaled_to(y, u, time=time).scan(y, u, time=time).summary().words
    assert "time constant 0.5" in words or "time constant 0.49" in words
    assert "Steady-state gain 2" in words or "Steady-state gain 1.99" in words


def test_the_gate_goes_by_the_prediction_and_its_variance():
    """Rejected is what lies more than 3 sigma from the prediction, on long steps too (where y_k predicts itself)."""
    rng = np.random.default_rng(4)
    time = np.cumsum(rng.uniform(0.05, 0.5, 300))
    y, u = dw.models.simulate_continuous([1.0, 2.0], [0.0, 2.0], time=time, noise_std=0.02, seed=4)
    y += 0.15 * (rng.random(300) < 0.2) * rng.standard_normal(300)
    est = dw.ContinuousJoint(
        2, 1, observer=4.0, noise=dw.models.EquationError(4e-4), gate=dw.InnovationGate(3.0, patience=1e9, settle=30)
    )
    trace = est.scan(y, u, time=time)
    rejected = (trace.status & int(dw.Status.REJECTED)) != 0
    seen = np.cumsum(~rejected) - ~rejected >= 31
    size = abs(trace.innovation) / np.sqrt(trace.variance)
    assert np.array_equal(rejected[seen], size[seen] > 3.0) and 5 < rejected.sum() < 150
