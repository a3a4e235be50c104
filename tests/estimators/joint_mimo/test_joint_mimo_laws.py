"""`JointMIMO` obeys the laws, in both ways of running, with every policy once."""

import numpy as np
import pytest
from memories_of_joint import MEMORIES

import driftwise as dw
from driftwise.analysis.laws import LAWS, example, same

ROOT = np.tril(np.full((5, 5), 0.05)) + 0.1 * np.eye(5)
FULL = ROOT @ ROOT.T
LINKED = dw.models.NoiseCovariance(FULL[:3, :3], FULL[:3, 3:], FULL[3:, 3:])

ESTIMATORS = {
    "split": dw.JointMIMO((2, 1), 1),
    "coupled": dw.JointMIMO((2, 1), 1, split=False),
    "linked noise": dw.JointMIMO((2, 1), 1, noise=LINKED),
    "walk": dw.JointMIMO((2, 1), 1, memory=dw.RandomWalk(1e-4)),
    "until a jump": dw.JointMIMO((2, 1), 1, memory=dw.RestartOnChange(settle=10)),
    "gate": dw.JointMIMO((2, 1), 1, gate=dw.InnovationGate(4.0)),
    "linked, gate": dw.JointMIMO((1, 2), 1, True, noise=LINKED, gate=dw.InnovationGate(4.0)),
    "proper scale": dw.JointMIMO(
        (1, 2, 1), 1, noise=dw.models.EquationError((1.0, 2.0, 3.0)), scale=dw.models.InverseGamma(2.0, 0.1), P0=100.0
    ),
    "one output": dw.JointMIMO(3, 2),
    "no input": dw.JointMIMO((1, 1)),
    "dead-beat": dw.JointMIMO((2, 1), 1, noise=dw.models.EquationError(0.0), P0=100.0),
    "all together": dw.JointMIMO(
        (2, 1), 2, True, noise=dw.models.NoisePolynomial(((0.1, -0.4), (0.3,)), 0.01), memory=dw.RandomWalk(1e-5),
        gate=dw.InnovationGate()
    ),
    **{name: dw.JointMIMO((2, 1), 1, memory=memory) for name, memory in MEMORIES.items()},
    "auto, coupled": dw.JointMIMO((2, 1), 1, memory=dw.AutoMemory(), split=False),
    "interacting, coupled": dw.JointMIMO((1, 1), 1, memory=dw.memory.IMM((0.0, 1e-2)), split=False),
    "likelihood, linked noise": dw.JointMIMO((2, 1), 1, memory=dw.memory.LikelihoodDrift(), noise=LINKED),
    "exponential, linked noise, the state too": dw.JointMIMO(
        (2, 1), 1, memory=dw.ExponentialForgetting(0.95), noise=LINKED, forget_state=True
    ),
}  # fmt: skip


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.__name__)
@pytest.mark.parametrize("name", ESTIMATORS)
def test_law(name, law):
    est = ESTIMATORS[name]
    law(est, *example(est))


def test_check_estimator_takes_several_outputs():
    dw.check_estimator(ESTIMATORS["split"])


@pytest.mark.parametrize(
    "name", ["split", "linked noise", "dead-beat", "all together", "auto", "exponential", "auto, coupled"]
)
@pytest.mark.parametrize("missing", [0.0, 0.3, 0.95])
def test_long_gappy_records_stay_finite(name, missing):
    est = ESTIMATORS[name]
    state = est.scan(*example(est, samples=2000, missing=missing)).state
    assert np.all(state["D"] >= 0) and np.isfinite(np.atleast_1d(state).view(float)).all()


@pytest.mark.parametrize("name", ["split", "linked noise"])
def test_a_fleet_and_a_restart_of_the_state(name):
    """An unstable plant through a very long gap: flagged LOST, finite, and back to work."""
    est = ESTIMATORS[name]
    theta = np.zeros(9)
    theta[0] = -1.05
    theta[3:5] = theta[7] = 1.0
    y, u = dw.models.simulate_mimo((2, 1), theta, samples=150, inputs=1, noise_std=0.1, seed=2)
    state = est.scan(y, u).state
    gap = est.scan(np.full((3000, 2), np.nan), np.zeros((3000, 1)), state=state)
    assert np.any(gap.status & dw.Status.LOST)
    assert np.isfinite(np.atleast_1d(gap.state).view(float)).all()
    after = est.scan(y, u, state=gap.state)
    assert abs(after.innovation[-20:]).max() < 1.0
    states, steps = est.update_batch(est.start(2), np.stack([y, y]), np.stack([u, u]))
    assert same(states[0], state) and same(states[1], state)
    assert steps.prediction.shape == (2, 150, 2)


def test_a_rejected_outlier_is_a_missing_sample():
    for noise in (dw.models.EquationError(0.01), LINKED):
        y, u = example(dw.JointMIMO((2, 1), 1), missing=0.0)
        for i in range(2):
            spoiled, gap = y.copy(), y.copy()
            spoiled[90, i], gap[90, i] = 1e3, np.nan
            gated = dw.JointMIMO((2, 1), 1, noise=noise, P0=10.0, floor=0.0, gate=dw.InnovationGate(8.0, settle=50))
            plain = dw.JointMIMO((2, 1), 1, noise=noise, P0=10.0, floor=0.0)
            got, expected = gated.scan(spoiled, u), plain.scan(gap, u)
            assert got.status[90, i] & dw.Status.REJECTED and not np.any(got.status[90, 1 - i])
            np.testing.assert_allclose(got.state["theta"], expected.state["theta"], rtol=1e-10, atol=1e-12)
            np.testing.assert_allclose(
                gated.covariance(got.state), plain.covariance(expected.state), rtol=1e-9, atol=1e-13
            )
