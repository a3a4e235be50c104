"""Random walks: the textbook's Kalman filter, absolute where matched."""

import numpy as np
from oracle.tracking import kalman
from records_to_forget import excite, record

import driftwise as dw

# --- walks -----------------------------------------------------------------------------------------------------


def peers_task(samples=10_000):
    """ARX(2,2) whose parameters drift: regressors, outputs and the true parameters."""
    rng = np.random.default_rng(7)
    Q = np.diag([1e-6, 1e-6, 1e-5, 1e-5])
    th, u = np.array([-1.2, 0.5, 1.0, 0.5]), np.sign(rng.standard_normal(samples + 2))
    y, phi, true = np.zeros(samples + 2), np.zeros((samples, 4)), np.zeros((samples, 4))
    for k in range(samples):
        t = k + 2
        th = th + np.sqrt(np.diag(Q)) * rng.standard_normal(4)
        phi[k] = -y[t - 1], -y[t - 2], u[t - 1], u[t - 2]
        y[t] = phi[k] @ th + 0.2 * rng.standard_normal()
        true[k] = th
    return phi, y, u, true, Q


def test_a_walk_is_the_textbook_kalman_filter():
    phi, y, u, true, Q = peers_task()
    twin, e, S, _ = kalman(phi, y[2:], Q, 0.04, np.zeros(4), 100 * np.eye(4))
    options = dict(memory=dw.RandomWalk(np.diag(Q)), variance=0.04, P0=np.full(4, 1e3))
    for est, data in ((dw.Regression(4, **options), (y[2:], phi)), (dw.ARX(2, 2, **options, at_rest=True), (y, u))):
        state = est.start()
        if est.model.na:  # the first two samples only fill the registers
            for t in range(2):
                state, _ = est.update(state, np.nan, u[t])
            state["ys"], state["ys_covariance"], data = 0.0, 0.0, (y[2:], u[2:])
        state["D"], state["U"] = 100 + np.diag(Q), 0.0  # the state carries P of the next sample
        trace = est.scan(*data, state=state)
        assert np.max(np.abs(trace.parameters - twin)) < 1e-9
        np.testing.assert_allclose(trace.innovation, e, atol=1e-9)
        np.testing.assert_allclose(trace.variance, S, rtol=1e-9)
    assert np.sqrt(np.mean((twin - true)[1000:] ** 2)) < 0.1


def test_a_matched_walk_is_absolute():
    """q = jump^2/every, divided by the current sigma^2 where that is learnt."""
    phi, y = excite(4)
    matched = dw.Regression(3, memory=dw.RandomWalk(matched=([0.1, 0.2, 0.0], 50)), variance=0.25, P0=4.0)
    plain = dw.Regression(3, memory=dw.RandomWalk([0.0002, 0.0008, 0.0]), variance=0.25, P0=4.0)
    np.testing.assert_allclose(matched.scan(y, phi).parameters, plain.scan(y, phi).parameters, rtol=1e-12)
    learnt = dw.Regression(3, memory=dw.RandomWalk(matched=(0.1, 50)))
    calm = dw.Regression(3)
    state = calm.scan(y, phi).state
    one, two = (e.update(state, y[0], phi[0])[0] for e in (learnt, calm))
    gained = calm.sigma2(state) * np.diag(learnt.covariance(one) - calm.covariance(two))
    np.testing.assert_allclose(gained, 0.0002, rtol=1e-9)


# --- run lengths -----------------------------------------------------------------------------------------------


def test_a_matched_walk_learns_the_noise_of_a_walk():
    found = []
    for seed in range(5):
        rng = np.random.default_rng(seed)
        phi, steps, e = rng.standard_normal((3, 3000, 3))
        y = np.sum(phi * np.cumsum(0.3 / np.sqrt(1500) * steps, axis=0), axis=1) + 0.1 * e[:, 0]
        est = dw.Regression(3, memory=dw.RandomWalk(matched=(0.3, 1500)))
        found.append(np.sqrt(est.sigma2(est.scan(y, phi).state)) / 0.1)
    assert abs(np.mean(found) - 1) < 0.03, found


# --- words -----------------------------------------------------------------------------------------------------


def test_a_matched_walk_of_the_joint_filter():
    y, u = record()
    options = dict(noise=dw.models.EquationError(0.09), P0=1e3)
    plain = dw.Joint(2, 1, memory=dw.RandomWalk([0.0002, 0.0002, 0.0008, 0.0008]), **options)
    matched = dw.Joint(2, 1, memory=dw.RandomWalk(matched=([0.1, 0.1, 0.2, 0.2], 50)), **options)
    np.testing.assert_allclose(plain.scan(y, u).parameters, matched.scan(y, u).parameters, rtol=1e-9, atol=1e-12)
