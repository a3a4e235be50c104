"""Parameters that move faster than the filters of the family: battery cells, whose R0 jumps by a hundred deviations."""

import sys
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from draws import slow

import driftwise as dw
from driftwise.engine import ud
from driftwise.estimators.armax.follow import correct_gradient, fade
from driftwise.estimators.armax.regressors import RADIUS

sys.path.append(str(Path(__file__).parents[3] / "examples" / "gallery"))
from battery import OCV, cell

CELLS = 20
FAMILIES = {
    "OE": lambda memory: dw.OE(2, 1, 0, memory=memory),
    "BJ": lambda memory: dw.BJ(2, 1, 1, 1, 0, memory=memory),
    "ARMAX": lambda memory: dw.ARMAX(1, 2, 1, 0, memory=memory),
}
RESTLESS = [
    dw.AutoMemory(),
    dw.memory.IMM(),
    dw.memory.MultipleModel(),
    dw.memory.LikelihoodDrift(),
    dw.memory.VariationalBayes(),
    dw.memory.BayesianChangePoint(0.01, 1500),
    dw.RestartOnChange(response=dw.memory.CovarianceInflation(0.02)),
]


def name_of(memory):
    return type(memory).__name__


@cache
def seen(family, memory, number, jump):
    """Return a trace, and how many of its bars R0 is off at each sample."""
    voltage, current, R0, *_ = cell(number, jump=jump, seed=5)
    trace = FAMILIES[family](memory).scan(voltage - OCV, current)
    at = list(trace.names).index("b0")
    return trace, np.abs(trace.parameters[:, at] - R0) / trace.parameters_std[:, at]


@pytest.mark.parametrize("memory", [dw.AutoMemory(), dw.memory.IMM(), slow(dw.memory.MultipleModel())], ids=name_of)
@pytest.mark.parametrize("family", FAMILIES)
def test_no_predictor_leaves_the_circle(family, memory):
    """Filters of a bank used to keep the step that the projection took back, and the predictor ran away with them."""
    for number in range(CELLS):
        trace, _ = seen(family, memory, number, 1.3)
        inside = [i for i, name in enumerate(trace.names) if name[0] in "cf"]
        assert np.abs(trace.parameters[:, inside]).max() <= RADIUS
        assert np.isfinite(trace.parameters).all()
        assert np.mean((trace.innovation**2 / trace.variance)[300:]) < 300.0


@pytest.mark.parametrize("memory", RESTLESS[:3] + RESTLESS[5:6], ids=name_of)
def test_what_is_set_free_is_free_in_the_filters_of_a_memory(memory):
    """After 2 N samples the poles have a standard deviation of one; a bank used to keep that of the noise, .01."""
    y, u = dw.simulate([-0.8], [1.0], samples=200, noise_std=0.01, noise="output", seed=1)
    est = dw.OE(1, 1, memory=memory)
    state = est.start()
    while state["observed"] < 4.0:
        t = int(state["samples"])
        state, _ = est.update(state, y[t], u[t])
    assert est.sigma2(state) * est.covariance(state)[1, 1] > 0.5


@pytest.mark.parametrize("memory", RESTLESS[:-1], ids=name_of)
def test_bars_hold_while_the_parameters_rest(memory):
    """Learnt speeds used to outrun the filters of an output error model at once: 1-3 % off, half of the bars short."""
    cover, error = [], []
    for number in range(CELLS):
        trace, off = seen("OE", memory, number, 1.0)
        cover.append(np.mean(off[300:] < 2.0))
        error.append(off[-1] * trace.parameters_std[-1, 0] / 0.03)
    assert np.mean(cover) > 0.9
    assert np.median(error) < 5e-4


@pytest.mark.parametrize("memory", RESTLESS, ids=name_of)
@pytest.mark.parametrize("family", ["OE", "ARMAX"])
def test_a_jump_is_followed_to_the_end(family, memory):
    ends, last = [], []
    for number in range(CELLS):
        trace, off = seen(family, memory, number, 1.3)
        ends.append(off[-1])
        last.append(np.mean((trace.innovation**2 / trace.variance)[-500:]))
    assert np.mean(np.array(ends) < 2.0) >= 0.8
    assert np.median(ends) < 1.2
    assert np.median(last) < 1.2


def test_moving_parameters_are_told_where_they_count():
    """Right after the jump the registers are in doubt (FILLED); while nothing moves they are not."""
    told, quiet = [], []
    for number in range(CELLS):
        *_, at = cell(number, seed=5)
        trace, _ = seen("OE", dw.memory.IMM(), number, 1.3)
        is_filled = (trace.status & int(dw.Status.FILLED)) > 0
        told.append(is_filled[at : at + 60].any())
        quiet.append(is_filled[at - 300 : at].mean())
    assert np.mean(told) > 0.9
    assert np.mean(quiet) < 0.05


def test_the_gradient_fades_as_the_joint_filter_of_registers_and_parameters_says():
    """Two registers, three parameters that are independent: theta and r after theta gained Q, by dense matrices."""
    rng = np.random.default_rng(3)
    W, p, q, s2 = rng.standard_normal((2, 3)), np.array([0.5, 2.0, 1.0]), np.array([0.0, 1.0, 30.0]), 0.3
    S = np.diag([0.2, 0.1])
    joint = np.block([[S + s2 * W * p @ W.T, s2 * W * p], [s2 * (W * p).T, s2 * np.diag(p)]])
    joint[2:, 2:] += s2 * np.diag(q)
    left = np.linalg.solve(joint[2:, 2:], joint[2:, :2]).T  # regression of the registers' errors on those of theta
    rest = joint[:2, :2] - left @ joint[2:, :2]

    kept = SimpleNamespace(dr=W.copy(), S=np.zeros((5, 5)), variances=p, is_uncertain=np.zeros(1))
    kept.S[2:4, 2:4] = S
    U, D = ud.factor(np.diag(p + q))
    state = SimpleNamespace(U=U[ud.packed_indices(3)], D=D)
    fade(None, state, kept, SimpleNamespace(h=np.zeros(3), g=np.zeros(3)), 2, s2)
    np.testing.assert_allclose(kept.dr, left, rtol=1e-12)
    np.testing.assert_allclose(kept.S[2:4, 2:4], rest, rtol=1e-12)
    assert kept.is_uncertain[0] == 1.0


def test_a_corrected_register_depends_less_on_the_parameters():
    """x = x0 + K (y - yhat(theta)): its derivative, by differences."""
    rng = np.random.default_rng(4)
    theta, phi, W, K = rng.standard_normal((4, 4))[:3].tolist() + [rng.standard_normal(4)]
    theta, phi = np.array(theta), np.array(phi)
    W = rng.standard_normal((2, 4))

    def corrected(theta_now):
        row = phi.copy()
        row[1:3] += W @ (theta_now - theta)
        return row[1:3] - K[1:3] * (row @ theta_now)

    steps = 1e-6 * np.eye(4)
    slopes = np.array([(corrected(theta + h) - corrected(theta - h)) / 2e-6 for h in steps]).T
    kept, room = SimpleNamespace(dr=W.copy()), SimpleNamespace(g=2.0 * K, h=np.zeros(4), phi=phi)
    correct_gradient(kept, room, theta, 1, 2.0)
    np.testing.assert_allclose(kept.dr, slopes, rtol=1e-6, atol=1e-8)
