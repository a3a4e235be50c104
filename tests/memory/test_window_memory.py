"""A sliding window is batch least squares of its rows, and forgets completely."""

import numpy as np
import pytest
from oracle.tracking import ridge
from records_to_forget import excite, record

import driftwise as dw

# --- a window --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("T", [1, 2, 7, 50])
@pytest.mark.parametrize("missing", [0.0, 0.2])
def test_a_window_is_batch_least_squares_of_its_rows(T, missing):
    phi, y = excite(5, 160)
    y[np.random.default_rng(0).random(160) < missing] = np.nan
    P0, theta0 = np.array([[4.0, 1.0, 0.0], [1.0, 9.0, 2.0], [0.0, 2.0, 1.0]]), np.array([1.0, 0.0, -1.0])
    est = dw.Regression(3, memory=dw.memory.Window(T), variance=0.25, P0=P0, theta0=theta0)
    trace = est.scan(y, phi, keep="covariance")
    state = est.start()
    for t in range(160):
        state, _ = est.update(state, y[t], phi[t])
        last = np.flatnonzero(np.isfinite(y[: t + 1]))[-T:]
        theta, P, _ = ridge(phi[last] / 0.5, y[last] / 0.5, theta0, P0)
        assert np.max(np.abs(trace.parameters[t] - theta)) < 1e-10
        assert np.max(np.abs(est.covariance(state) - P)) < 1e-10
    assert trace.table[-1, 4] == T


def test_a_window_learns_the_noise_from_its_rows():
    phi, y = excite(6)
    y[100:] = phi[100:] @ [1.0, 2.0, 3.0] + 1e-6 * (y - phi @ [1.0, 2.0, 3.0])[100:]
    est = dw.Regression(3, memory=dw.memory.Window(20), P0=1e4)
    state = est.scan(y, phi).state
    theta, _, chi2 = ridge(phi[-20:], y[-20:], np.zeros(3), 1e4 * np.eye(3))
    np.testing.assert_allclose(state["theta"], theta, rtol=1e-9)
    np.testing.assert_allclose(est.sigma2(state), chi2 / 18, rtol=1e-6)  # 20 rows, reference prior 1 - 3
    assert state["count"] == 18


def test_a_window_forgets_completely():
    """After T samples nothing is left of what was before, however large it was."""
    phi, y = excite(7)
    wild, far = y.copy(), phi.copy()
    wild[:100], far[:100] = 1e8 * wild[:100] + 1e9, 1e6 * far[:100]
    est = dw.Regression(3, memory=dw.memory.Window(30))
    one, two = est.scan(y, phi), est.scan(wild, far)
    assert np.max(np.abs(one.parameters - two.parameters)[130:]) < 1e-12


# --- nothing to do, nothing changes ----------------------------------------------------------------------------


def test_a_window_longer_than_the_record_is_no_window():
    y, u = record()
    one, two = dw.ARX(2, 2).scan(y, u), dw.ARX(2, 2, memory=dw.memory.Window(1000)).scan(y, u)
    np.testing.assert_allclose(one.table, two.table, rtol=1e-8, atol=1e-12)
