"""Outputs recorded in steps: no filter of `AutoMemory` believes in less noise than rounding leaves."""

import numpy as np
import pytest
from driftwise_studies.score.worlds import recorded

import driftwise as dw
from driftwise.memory.auto_state import open_parts
from driftwise.memory.modes import mode, own_sigma2
from driftwise.memory.resolution import NONE, STEP, step_after

REST = int(dw.Status.AT_REST)


def step_of(y):
    step = 0.0
    for move in np.abs(np.diff(y)):
        step = step_after(step, move)
    return step


def test_the_step_is_what_all_moves_are_multiples_of():
    rng = np.random.default_rng(1)
    walk = np.cumsum(rng.integers(-9, 10, 300))
    for step in (0.1, 0.25, 3.0, 1e-4):
        assert step_of(np.round(walk * step, 10) + 1e3) == pytest.approx(step, rel=1e-5)
    assert step_of(np.repeat(7.3, 50)) == 0.0
    assert step_of([7.3, 7.3, 7.4, 7.4]) == pytest.approx(0.1)
    assert step_of([7.3, 7.4]) < 0.0, "two numbers that differ have no step yet"
    assert step_of(rng.standard_normal(4)) == NONE and step_of(np.round(rng.standard_normal(99), 14)) == NONE


def modes_of(est, state):
    """Return the sigma^2 of each filter."""
    memory, N = est.policies[2], est.model.N
    parts = open_parts(memory, state["memory_state"], N)
    return [own_sigma2(memory, mode(parts.own.bank, m, N).own) for m in range(3)], parts.resolution[STEP]


@pytest.mark.parametrize("number", [4, 5, 12])
def test_what_stands_still_at_first_is_no_plant_without_noise(number):
    """Without it 4 to 33 % of these samples are outliers, and errors are 1.3 to 3 times those of least squares.

    Of 120 such records one, number 5, has a jump told late, at 12.7:1.
    """
    one = recorded.draw(0, number)
    found = recorded.measure(one)
    assert found.ratio < 1.02 and found.outliers == 0.0 and found.jumps <= (number == 5)
    assert found.inside > 0.87 and 0.9 < found.sigma < 1.5
    est = dw.ARX(one.order, 1, offset=True, memory=dw.AutoMemory())
    variances, step = modes_of(est, est.scan(one.y, one.u).state)
    assert step == pytest.approx(one.step, rel=1e-6)
    assert min(variances) >= 0.99 * one.step**2 / 12


def test_it_is_bound_where_it_stands_still_later():
    one = recorded.draw(0, 5)
    y, u = np.r_[one.y, np.repeat(one.y[-1], 2000)], np.r_[one.u, np.random.default_rng(2).standard_normal((2000, 1))]
    est = dw.ARX(one.order, 1, offset=True, memory=dw.AutoMemory())
    assert min(modes_of(est, est.scan(y, u).state)[0]) >= 0.99 * one.step**2 / 12


def test_what_has_not_moved_yet_teaches_nothing_of_the_noise():
    est = dw.ARX(1, 1, offset=True, memory=dw.AutoMemory())
    u = np.random.default_rng(3).standard_normal(100)
    trace = est.scan(np.repeat(20.1, 100), u)
    assert est.sigma2(trace.state) == 1.0, "what was believed before"
    assert np.all(trace.status[5:] & REST)


def test_a_plant_without_noise_stays_one():
    u = np.random.default_rng(4).standard_normal(400)
    y = np.zeros(400)
    for t in range(1, 400):
        y[t] = 0.8 * y[t - 1] + u[t - 1]
    est = dw.ARX(1, 1, memory=dw.AutoMemory(), at_rest=True)
    trace = est.scan(y, u)
    assert est.sigma2(trace.state) < 1e-15
    np.testing.assert_allclose(trace.parameters[-1], [-0.8, 1.0], atol=1e-6)


def test_units_halves_and_files_change_nothing(tmp_path):
    one = recorded.draw(0, 5)
    y, u = one.y[:500], one.u[:500]
    est = dw.ARX(one.order, 1, offset=True, memory=dw.AutoMemory())
    whole = est.scan(y, u)
    first = est.scan(y[:100], u[:100])
    dw.save_state(est, first.state, tmp_path / "state.json")
    again, state = dw.load_state(tmp_path / "state.json")
    second = again.scan(y[100:], u[100:], state=state)
    assert second.innovation.tolist() == whole.innovation[100:].tolist()
    small, large = (est.scaled_to(c * y, c * u).scan(c * y, c * u) for c in (1.0, 8.0))
    np.testing.assert_array_equal(large.innovation, 8.0 * small.innovation)
    np.testing.assert_array_equal(large.status, small.status)


def test_compiled_is_plain(monkeypatch):
    one = recorded.draw(0, 12)
    fast = dw.ARX(one.order, 1, offset=True, memory=dw.AutoMemory()).scan(one.y[:350], one.u[:350])
    monkeypatch.setenv("DRIFTWISE_ENGINE", "python")
    slow = dw.ARX(one.order, 1, offset=True, memory=dw.AutoMemory()).scan(one.y[:350], one.u[:350])
    np.testing.assert_allclose(fast.innovation, slow.innovation, rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(fast.status, slow.status)


def test_beside_a_state_as_well():
    """Without it the error is 3.8 times that of constant parameters."""
    one = recorded.draw(0, 0)
    memories = dw.AutoMemory(), dw.Constant()
    joint, plain = (dw.Joint(one.order, 1, offset=True, memory=m).scan(one.y, one.u) for m in memories)
    assert np.sum(joint.innovation[one.still :] ** 2) < 1.03 * np.sum(plain.innovation[one.still :] ** 2)
    assert not np.any(joint.status & int(dw.Status.OUTLIER))
