"""The exact gradient: its slopes are those of filters a little beside it, and it ends where a batch fit does."""

import numpy as np
import pytest
from test_grey_box import CELL, PENDULUM, square

import driftwise as dw
from driftwise.engine import ud
from driftwise.engine.errors import InputError
from driftwise.estimators.grey_box.start import Batch

SWINGING = PENDULUM.replace("std = 0.5}", "std = 0.5, walk = 0.05}")
LAG = """
[states]
x = {std = 1.0, walk = 0.3}
[inputs]
u = {}
[outputs]
y = {noise = 0.3}
[parameters]
tau = {unit = "s", start = 8}
gain = {start = 1}
[formulas]
dx = "(gain * u - x) / tau"
y = "x"
"""


def cell():
    rng = np.random.default_rng(3)
    time, u = np.cumsum(rng.uniform(0.5, 20.0, 80)), square(1, 80)
    y = dw.GreyBox(CELL).simulate(u, {"R0": 0.02, "R1": 0.015, "C1": 1500.0}, time=time, seed=2)
    y[rng.random(80) < 0.1] = np.nan
    return y, u, time


def swing():
    time = 0.05 * np.arange(60)
    y = dw.GreyBox(SWINGING).simulate(None, {"k": 25.0}, samples=60, x0=[0.6, 0.1], time=time, seed=1)
    return y, None, time


@pytest.mark.parametrize("text, record", [(CELL, cell), (SWINGING, swing)], ids=["linear", "bends"])
def test_slopes_of_state_and_covariance_are_those_of_filters_with_other_parameters(text, record):
    y, u, time = record()

    def ended(method, theta, variance):
        """Return x, its covariance given theta, A and dP of a filter whose parameters stay where they are."""
        est = dw.GreyBox(text, start=None, method=method)
        state, n = est.start(), est.model.n
        state["theta"] += theta
        state["D"][n:], state["bend"] = variance, 0.0
        state = est.scan(y, u, time=time, state=state).state
        U = np.eye(est.model.N)
        U[ud.packed_indices(est.model.N)] = state["U"]
        P = (U[:n, :n] * state["D"][:n]) @ U[:n, :n].T
        return state["x"], P, U[:n, n:] @ np.linalg.inv(U[n:, n:]), state["dP"].reshape(-1, n, n)

    (_, _, A, dP), (_, _, without, _) = (ended(method, 0.0, 1e-20) for method in ("rpem", "joint"))
    gap = 0.0
    for j, h in enumerate(1e-4 * np.eye(A.shape[1])):
        (x, P, *_), (x_less, P_less, *_) = (ended("joint", way * h, 0.0) for way in (1, -1))
        slope = (x - x_less) / 2e-4
        np.testing.assert_allclose(A[:, j], slope, rtol=1e-5, atol=1e-6 * abs(slope).max())
        np.testing.assert_allclose(dP[j], (P - P_less) / 2e-4, rtol=1e-5, atol=1e-6 * abs(P).max())
        gap = max(gap, np.max(abs(without[:, j] - slope)) / abs(slope).max())
    assert gap > 0.01  # that of the joint filter is another one


def test_of_a_state_that_wanders_less_than_it_is_said_to_it_ends_at_the_batch_fit():
    off = {"joint": [], "rpem": []}
    for seed in range(3):
        rng, u, x, y = np.random.default_rng(seed), square(seed, 500), 0.0, np.empty(500)
        f = np.exp(-1 / 4.0)
        for t in range(500):
            y[t] = x + 0.3 * rng.standard_normal()
            x = f * x + (1 - f) * 1.5 * u[t] + 0.05 * rng.standard_normal()
        best = Batch(dw.GreyBox(LAG), y[:, None], np.column_stack([u, np.arange(500.0)])).fits(np.zeros(2))[0]
        bars = np.sqrt(np.diag(np.linalg.inv(best.information)))
        for method, found in off.items():
            found.append(np.max(abs(dw.GreyBox(LAG, method=method).scan(y, u).state["theta"] - best.z) / bars))
    assert max(off["rpem"]) < 0.2 < 1.0 < max(off["joint"])


def test_every_way_of_feeding_samples_gives_the_same_bits_by_the_exact_gradient_too():
    est = dw.GreyBox(CELL, start=None, method="rpem", dt=2.0)
    u = square(2, 60)
    y = est.simulate(u, {"R0": 0.015, "C1": 1400.0}, seed=1)
    y[[0, 1, 30]] = np.nan
    dw.check_estimator(est, y, u)


def test_another_method_is_refused():
    with pytest.raises(InputError, match="method must be one of joint, rpem, got 'ekf'"):
        dw.GreyBox(CELL, method="ekf")
