"""Samples that come in another order than they were taken: the state is that of the record in order, bit for bit."""

import numpy as np
import pytest

import driftwise as dw
from driftwise.analysis.laws import same
from driftwise.estimators import OutOfOrder
from driftwise.estimators.common.late import LateBuffer
from driftwise.results.snapshot import describe

A, W = np.array([[0.0, 1.0], [-1.0, -0.3]]), 0.2
PLANT = dw.models.Plant(A, [[0.0], [1.0]], [[1.0, 0.0]])


def oscillator(**more):
    return dw.StateSpace(A, [[0.0], [1.0]], np.eye(2), Q=W, R=[0.3, 0.5], P0=1.0, dt=0.5, continuous=True, **more)


ROOM = """
[states]
T = {start = 0.0, std = 1.0, walk = 0.1}

[inputs]
q = {}

[outputs]
reading = {noise = 0.3}

[parameters]
R = {start = 1.0}
C = {start = 3.0}

[formulas]
dT = "(q - T / R) / C"
reading = "T"
"""

KINDS = {
    "state space": oscillator(),
    "gate, fading and learnt scale": oscillator(
        gate=dw.InnovationGate(2.5, settle=4),
        memory=dw.ExponentialForgetting(0.98),
        scale=dw.models.InverseGamma(2.0, 2.0),
        detector=dw.PageHinkley(),
    ),
    "functions of dt": dw.StateSpace(lambda dt: 0.9**dt, 0.5, Q=lambda dt: 0.1 * dt, R=1.0, P0=1.0),
    "grey box": dw.GreyBox(ROOM, dt=0.5),
    "grey box without a start": dw.GreyBox(ROOM, start=None, dt=0.5),
    "continuous joint": dw.ContinuousJoint(1, 1, dt=0.5),
    "window": dw.WindowObserver(PLANT, window=3.0, noise_std=0.1, dt=0.5, irregular=True, hold="zoh"),
    "growing window": dw.WindowObserver(PLANT, window=np.inf, noise_std=0.1, dt=0.5, irregular=True, hold="zoh"),
}


def record(est, seed, T=50):
    """Return time, y, u of a record in order, some of it missing, and an order in which it comes, up to 3 s late."""
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.choice([0.1, 0.25, 0.5, 0.7], T))
    y, u = rng.standard_normal((T, est.outputs or 1)), rng.standard_normal((T, est.model.inputs))
    y[rng.random(y.shape) < 0.2] = np.nan
    delay = np.where(rng.random(T) < 0.3, rng.uniform(0, 3.0, T), 0.0)
    return time, (y if est.outputs else y[:, 0]), (u if est.model.inputs else None), np.argsort(time + delay)


def fed(late, state, time, y, u, order):
    steps = []
    for k in order:
        state, step = late.update(state, y[k], None if u is None else u[k], time=time[k])
        steps.append(step)
    return state, steps


@pytest.mark.parametrize("kind", KINDS)
def test_within_the_lag_the_state_is_that_of_the_record_in_order(kind):
    est = KINDS[kind]
    late = OutOfOrder(est, lag=3.0)
    for seed in range(3):
        time, y, u, order = record(est, seed)
        state, came = late.start(), []
        for part in np.array_split(order, 4):
            state, _ = fed(late, state, time, y, u, part)
            came = np.sort(np.r_[came, part]).astype(int)
            in_order = est.scan(y[came], None if u is None else u[came], time=time[came]).state
            assert same(late.state_of(state), in_order)
        assert state["late"] > 3 and state["refused"] == 0


@pytest.mark.parametrize("kind", ["state space", "continuous joint"])
def test_beyond_the_lag_it_is_refused_counted_and_changes_nothing(kind):
    est = KINDS[kind]
    for lag, samples in ((0.8, 64), (3.0, 4)):
        late = OutOfOrder(est, lag=lag, samples=samples)
        for seed in range(6):
            time, y, u, order = record(est, seed)
            state, steps = fed(late, late.start(), time, y, u, order)
            is_refused = np.array([np.all(step.status == dw.Status.LATE) for step in steps])
            taken = np.sort(order[~is_refused])
            assert same(late.state_of(state), est.scan(y[taken], u[taken], time=time[taken]).state)
            assert state["refused"] == is_refused.sum() > 0 and np.all(np.isnan(steps[-1].prediction) == is_refused[-1])


def test_what_a_late_sample_shows_is_said_by_those_before_it():
    est = KINDS["state space"]
    time, y, u, order = record(est, 1)
    _, steps = fed(OutOfOrder(est, lag=10.0), OutOfOrder(est, lag=10.0).start(), time, y, u, order)
    last = int(np.flatnonzero(order == np.flatnonzero(np.diff(np.argsort(order)) < 0)[-1])[0])
    k, before = order[last], np.sort(order[:last])
    before = before[before < order[last]]
    ahead = est.scan(y[np.r_[before, k]], u[np.r_[before, k]], time=time[np.r_[before, k]])
    np.testing.assert_array_equal(steps[last].prediction, ahead.prediction[-1])


def test_regular_samples_fill_in_what_was_missing():
    est = dw.StateSpace([[1, 1], [0, 1]], H=np.eye(2), Q=0.1, R=1.0, P0=1.0)
    rng = np.random.default_rng(2)
    y = rng.standard_normal((40, 2))
    late = OutOfOrder(est, lag=5.0)
    state, waiting = late.start(), []
    for t in range(40):
        first = y[t].copy()
        if t % 3 == 0:
            first[rng.integers(2)] = np.nan
            waiting.append(t)
        state, _ = late.update(state, first, time=float(t))
        if len(waiting) > 1:
            at = waiting.pop(0)
            state, _ = late.update(state, y[at], time=at + 1e-4)
    state, _ = late.update(state, y[waiting[0]], time=float(waiting[0]))
    assert same(late.state_of(state), est.scan(y).state) and state["refused"] == 0
    for time in (38.5, 38.0, 3.0):  # between samples; nothing of it is missing; too late
        state, step = late.update(state, [0.0, 0.0], time=time)
        assert (step.status == dw.Status.LATE).all()
    assert state["refused"] == 3 and same(late.state_of(state), est.scan(y).state)


def test_each_sample_says_which_sensor_it_is_of():
    est = dw.StateSpace(A, H=[1.0, 0.0], Q=W, R=0.3, P0=1.0, dt=0.5, continuous=True)
    rng = np.random.default_rng(3)
    late, T = OutOfOrder(est, lag=3.0, matrices=("H", "R")), 40
    time, y = np.repeat(np.cumsum(rng.uniform(0.1, 0.6, T // 2)), 2), rng.standard_normal(T)
    H = np.where(rng.random((T, 1, 1)) < 0.5, [[1.0, 0.0]], [[0.0, 1.0]])
    R = rng.uniform(0.1, 1.0, (T, 1, 1))
    order = np.argsort(time + rng.uniform(0, 1.5, T), kind="stable")
    state = late.start()
    for k in order:
        state, _ = late.update(state, y[k], time=time[k], H=H[k], R=R[k])
    ranks = order[np.argsort(time[order], kind="stable")]  # of one instant: in the order in which they came
    assert same(late.state_of(state), est.scan(y[ranks], time=time[ranks], H=H[ranks], R=R[ranks]).state)


def test_a_state_is_saved_and_goes_on(tmp_path):
    est = KINDS["state space"]
    late = OutOfOrder(est, lag=3.0)
    time, y, u, order = record(est, 4)
    whole, _ = fed(late, late.start(), time, y, u, order)
    half, _ = fed(late, late.start(), time, y, u, order[:25])
    dw.save_state(late, half, tmp_path / "half.json")
    again, state = dw.load_state(tmp_path / "half.json")
    assert describe(again) == describe(late) and same(state, half)
    assert same(fed(again, state, time, y, u, order[25:])[0], whole)
    mean, std = late.estimate(whole)
    assert mean.shape == std.shape == (2,)


def test_tracks_take_late_plots_by_the_same_way():
    est = dw.TrackEstimator("boat")

    def run(row, sample):
        state, out = est.advance(row.view(est.dtype).reshape(()), sample[0], sample[1:])
        return np.ascontiguousarray(state).reshape(1).view(float), out

    buffer = LateBuffer(run, est.dtype.itemsize // 8, 3, lag=20.0, samples=16)
    rng = np.random.default_rng(5)
    time = np.cumsum(rng.uniform(1.0, 4.0, 40))
    plots = np.column_stack([5 * time, 2 * time]) + rng.standard_normal((40, 2))
    state = np.zeros((), buffer.dtype)
    for k in np.argsort(time + rng.uniform(0, 8.0, 40)):
        state, _ = buffer.put(state, np.r_[time[k], plots[k]])
    assert same(np.array(state["row"]).view(est.dtype).reshape(()), est.scan(time, plots).state)
    assert state["late"] > 5 and state["refused"] == 0


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: OutOfOrder(dw.ARX(1, 1), lag=1.0), "estimator must be one that goes by instants"),
        (lambda: OutOfOrder(KINDS["state space"], lag=-1.0), "lag must be"),
        (lambda: OutOfOrder(KINDS["state space"], lag=1.0, samples=0), "samples must be"),
        (lambda: OutOfOrder(KINDS["state space"], lag=1.0, matrices=("F",)), "let them be functions of dt"),
        (lambda: OutOfOrder(dw.StateSpace(1.0, Q=1.0, R=1.0), lag=1.0, matrices=("H",)), "one sample for each instant"),
    ],
)
def test_what_does_not_fit_is_a_sentence(make, words):
    with pytest.raises(dw.InputError, match=words):
        make()


def test_a_sample_that_does_not_fit_is_a_sentence():
    late = OutOfOrder(dw.StateSpace(0.0, Q=1.0, R=1.0, continuous=True), lag=1.0)
    for time in (np.nan, "noon", [1.0]):
        with pytest.raises(dw.InputError, match="time"):
            late.update(late.start(), 1.0, time=time)
    with pytest.raises(dw.InputError, match="'H' is no matrix of a sample here"):
        late.update(late.start(), 1.0, time=1.0, H=[[1.0]])
    with pytest.raises(dw.InputError, match="belongs to another estimator"):
        late.update(late.estimator.start(), 1.0, time=1.0)
