"""No state is poisoned for good: extreme samples, and states made NaN by hand."""

import numpy as np
import pytest
from test_laws import ESTIMATORS, OBSERVERS

import driftwise as dw
from driftwise.analysis.laws import example
from driftwise.engine.status import LOST
from driftwise.memory import ExponentialForgetting
from driftwise.models import OutputError, UnknownPolynomial

ALL = {**ESTIMATORS, **OBSERVERS}
T = 300
# what was NaN for good: an estimator, samples of a record, their inputs, whether the outputs are the same
EXTREME = {
    "output error, inputs of 1e59": (
        lambda: dw.Joint(2, 1, noise=OutputError()),
        slice(100, 103),
        lambda u: 1e59 * u,
        False,
    ),
    "colour unknown, inputs of 1e99": (
        lambda: dw.Joint(2, 1, noise=UnknownPolynomial()),
        slice(100, 103),
        lambda u: 1e99 * u,
        False,
    ),
    "forgets nearly all, 1e45": (
        lambda: dw.ARX(2, 2, memory=ExponentialForgetting(0.05)),
        slice(50, 150),
        lambda u: np.full(100, 1e45),
        True,
    ),
}


def record(name):
    """Return estimator, outputs and inputs of such a record."""
    make, where, extreme, is_both = EXTREME[name]
    rng = np.random.default_rng(1)
    u = rng.standard_normal(T)
    y = np.convolve(u, [0.0, 1.0, 0.5])[:T] + 0.1 * rng.standard_normal(T)
    u[where] = extreme(u[where])
    if is_both:
        y[where] = u[where]
    return make(), y, u


@pytest.mark.parametrize("name", EXTREME)
def test_it_recovers_from_extreme_samples_and_says_so(name):
    est, y, u = record(name)
    trace = est.scan(y, u)
    assert (trace.status & LOST).any()
    after = slice(-50, None)
    assert np.isfinite(trace.prediction[after]).all() and np.isfinite(trace.variance[after]).all()
    if isinstance(est, dw.Joint):  # the other forgets what it learns
        assert np.sqrt(np.mean(trace.innovation[after] ** 2)) < 0.5, "it has not learnt the plant anew"


@pytest.mark.parametrize("name", EXTREME)
def test_it_is_lost_at_the_same_sample_whichever_way_the_samples_come(name):
    est, y, u = record(name)
    trace = est.scan(y, u)
    state, seen = est.start(), []
    for t in range(T):
        state, step = est.update(state, y[t], u[t])
        seen.append(step)
    assert np.array_equal([s.prediction for s in seen], trace.prediction, equal_nan=True)
    assert [s.status for s in seen] == trace.status.tolist()
    assert state.tobytes() == trace.state.tobytes()
    # a fleet of twelve, eight of which are taken side by side; of some of them other samples
    shifts = [0, 0, 0, 0, 7, 0, 0, 0, 0, 3, 0, 0]
    keys = np.repeat(np.arange(12), T - 10)
    fleet = dw.Fleet(est, list(range(12)), threads=1)
    rows = [slice(shift, shift + T - 10) for shift in shifts]
    step = fleet.scan(keys, np.concatenate([y[r] for r in rows]), np.concatenate([u[r] for r in rows]))
    for key, r in enumerate(rows):
        alone = est.scan(y[r], u[r])
        assert fleet.state(key).tobytes() == alone.state.tobytes()
        assert step.status[keys == key].tolist() == alone.status.tolist()


@pytest.mark.parametrize("name", ALL)
def test_a_poisoned_state_is_no_longer_poisoned_two_samples_later(name):
    est = ALL[name]
    y, u = example(est, 60)
    before = est.scan(y[:30], None if u is None else u[:30]).state
    state = before.copy()
    for part in ("theta", "z", "D"):
        if part in est.dtype.names:
            state[part] = np.nan
    for t in (30, 31):
        state, _ = est.update(state, y[t], None if u is None else u[t])
    unknown = [part for part in est.unknown_parts if part in est.dtype.names]
    for part in est.dtype.names:
        assert part in unknown or np.isfinite(state[part]).all(), part
    assert state["samples"] == before["samples"] + 2


def test_the_sample_at_which_it_shows_is_the_first_of_a_fresh_state():
    est = dw.ARX(2, 2)
    rng = np.random.default_rng(2)
    u = rng.standard_normal(50)
    y = np.convolve(u, [0.0, 1.0])[:50]
    state = est.scan(y[:20], u[:20]).state
    state["D"] = np.nan
    rest, fresh = est.scan(y[20:], u[20:], state=state), est.scan(y[20:], u[20:])
    assert np.array_equal(rest.table[1:], fresh.table[1:], equal_nan=True)
    assert np.array_equal(rest.prediction, fresh.prediction) and rest.status[0] == fresh.status[0] | LOST
    assert rest.time[0] == 20 * est.dt and rest.state["samples"] == 50


def test_a_clock_goes_on():
    est = dw.ContinuousJoint(1, 1, dt=0.5)
    rng = np.random.default_rng(3)
    u, y = rng.standard_normal((2, 40))
    state = est.scan(y[:20], u[:20]).state
    now = float(state["time"])
    state["theta"] = np.nan
    trace = est.scan(y[20:], u[20:], state=state)
    assert trace.status[0] & LOST and trace.state["time"] == now + 20 * 0.5 and np.isfinite(trace.prediction).all()
