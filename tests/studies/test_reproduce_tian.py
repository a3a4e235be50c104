"""The experiment of Tian (2009): motor against closed form, opponents against brute force, the comparison."""

import numpy as np
import pytest
from driftwise_studies.papers.tian import comparison, listed, motor, opponents
from oracle import algebraic as oracle
from oracle.algebraic_motor import OSCILLATOR, VOLTS, augmented, dc_motor

import driftwise as dw

SEEDS = 20


@pytest.mark.parametrize("name", [*motor.SCENARIOS, "torque"])
def test_motor_against_the_closed_form(name):
    s = motor.SCENARIOS.get(name, motor.Scenario(torque=0.7, w=31.0))
    r = motor.records(s, 1)
    some = slice(None, 3751 if s.R_end else None, 1250)
    jump = None if s.R_after is None else (s.jump, s.R_after)
    drift = 0.0 if s.R_end is None else (s.R_end - s.R) / 10
    exact = dc_motor(r.t[some], R=s.R, q1=s.q1, q2=s.q2, w=s.w, torque=s.torque, jump=jump, drift=drift)
    near = 2e-6 if drift else 1e-10
    np.testing.assert_allclose(r.x[some], exact.x, rtol=0, atol=near)
    np.testing.assert_allclose(r.y3[some], exact.y3, rtol=0, atol=10 * near)
    np.testing.assert_allclose(r.u[some], exact.u, rtol=0, atol=1e-12)


def test_noise_is_what_it_is_called():
    found = {kind: motor.records(seeds=range(3, 33), kind=kind) for kind in motor.NOISES}
    noise = {kind: r.y - r.x[:, 0] for kind, r in found.items()}
    np.testing.assert_array_equal(found["uniform"].y[4:5], motor.records(seeds=range(7, 8)).y)
    for kind, std in (("uniform", motor.SIGMA), ("ar1", motor.SIGMA), ("hum", 0.015 / np.sqrt(2))):
        assert abs(noise[kind].std() / std - 1) < 0.06
    assert np.abs(noise["uniform"]).max() <= 0.015
    lag1 = {kind: (each[:, 1:] * each[:, :-1]).mean() / each.var() for kind, each in noise.items()}
    assert abs(lag1["uniform"]) < 0.01 and abs(lag1["ar1"] - 0.99) < 0.003
    assert np.allclose(noise["hum"][:, 20:], noise["hum"][:, :-20])  # 50 Hz
    assert abs(noise["ar1"][:, 0].std() / motor.SIGMA - 1) < 0.5  # stationary from the first sample


@pytest.mark.parametrize("kind, seeds", [("pink", 2), ("uniform", 0), ("uniform", range(-1, 2))])
def test_no_such_record(kind, seeds):
    with pytest.raises(dw.InputError, match="pink" if kind == "pink" else "seeds must be"):
        motor.records(seeds=seeds, kind=kind)


def test_kalman_against_the_joint_gaussian():
    """The cosine with a prior, a constant that walks; the exact sine against straight lines between its samples."""
    r = motor.records(seeds=2)
    y, t, prior = r.y[:, :40], r.t[:40], np.array([1.0, 3.0, 30.0, 2.0, 2.0, 2.0])
    model = motor.motor(motor.Told(), motor.constant(walk=10.0), motor.cosine())
    got = opponents.Kalman(model, tuple(prior))(y, r.u[:40])
    A, B, H = augmented()
    v = VOLTS * np.column_stack([np.sin(t), np.cos(t)])
    given = dict(B=np.hstack([B, 0 * B]), G=OSCILLATOR, v=v, prior=prior)
    for each, estimates in zip(y, got):
        grown = oracle.growing_estimates(A, H, t, each, motor.SIGMA, np.eye(6)[3] * 10, **given)
        np.testing.assert_allclose(estimates, [one.z[:3] for one in grown], rtol=0, atol=2e-5)


def test_observers():
    model = motor.motor(motor.Told(), motor.constant(walk=10.0))
    gains = opponents.gains(opponents.Kalman(model, opponents.PRIOR[:4]), 10_000)
    np.testing.assert_allclose(opponents.steady(model).gain, gains[-1], rtol=1e-5)
    Phi, _, _ = motor.modes(6).discretise(1e-3, "foh")
    gain = opponents.luenberger(motor.modes(6), -4.0).gain
    poles = np.log(np.linalg.eigvals((np.eye(6) - np.outer(gain, np.eye(6)[0])) @ Phi)) * 1000
    np.testing.assert_allclose(sorted(poles.real, reverse=True), -4 * (1 + 0.15 * np.arange(6)), rtol=1e-4)


@pytest.mark.parametrize("points, degree", [(21, 3), (1001, 4)])
def test_polynomials(points, degree):
    for at, index in ((1.0, points - 1), (0.0, points // 2)):
        got = opponents.polynomial_weights(points, degree, at)
        for order in range(3):
            weights = oracle.polynomial_weights(points, degree, index, order) * 1000.0**order
            np.testing.assert_allclose(got[order], weights, rtol=0, atol=1e-10 * np.abs(weights).max())
    t = np.arange(1200) / 1000
    truth = np.array([t**3 - t, 3 * t**2 - 1, 5 * 6 * t]).T  # x3 = 5 y''
    for centred in (False, True):
        got = opponents.SavitzkyGolay(points, degree, centred)(truth[None, :, 0], t)[0]
        seen = np.isfinite(got[:, 0])
        first = points // 2 if centred else points - 1
        assert seen.sum() == 1200 - points + 1 and np.argmax(seen) == first
        np.testing.assert_allclose(got[seen], truth[seen], rtol=0, atol=1e-5)


def test_score():
    r = motor.records(seeds=4)
    estimates = np.broadcast_to(r.x, (4, *r.x.shape)).copy()
    estimates[0, :3000, 2] += 2.0  # settles at 3 s
    estimates[1, :, 2] += 2.0  # never
    estimates[2, :500] = np.nan
    estimates[3, :4000, 2] += 1.1  # within its limit
    got = comparison.score(estimates, r)
    np.testing.assert_array_equal(got.settles[:, 2], [3.0, np.inf, 0.0, 0.0])
    np.testing.assert_allclose(got.late[2] ** 2, (4 * 1000 / 8001 + 4 + 1.21 * 2000 / 8001) / 4)
    assert (got.late[:2] == 0).all()
    nobody = comparison.score(np.full_like(estimates, np.nan), r)
    assert np.isnan(nobody.early).all() and np.isinf(nobody.settles).all()
    estimates[:, :500], estimates[:, -200:] = np.nan, np.nan  # a window that looks both ways
    np.testing.assert_array_equal(comparison.score(estimates, r).settles[:, 2], [3.0, np.inf, 0.5, 0.5])


def test_everybody_does_what_is_listed():
    def silent(y, u):
        return np.zeros((*y.shape, 3))

    found = comparison.section(SEEDS, {listed.WINDOW4: silent, "mine": silent})
    judged = {v.name: v.confirmed for v in found.verdicts}
    assert judged.pop(f"errors of the states: {listed.WINDOW4}") is False  # rows of others are judged, and can fail
    assert len(judged) == 12 and all(judged.values()), judged
    assert [row[0] for row in found.tables[0].rows][:2] == [listed.WINDOW4, "mine"]


@pytest.mark.slow
def test_model_errors():
    told = []

    def more(what):
        told.append(what)
        return {listed.THEOREM: lambda y, u: np.full((*y.shape, 3), np.nan)} if len(told) == 1 else {}

    found = comparison.model_errors(SEEDS, more)
    assert [v.name for v in found.verdicts if not v.confirmed] == ["model errors: nominal"]
    assert len(found.verdicts) == len(listed.LISTED_ERRORS) == len(told)
    assert {each.w for each in told} == {50.0, 52.0} and {each.R for each in told} == {0.9, 1.0, 1.1}


def test_near_is_a_unit_of_the_last_digit_and_four_standard_errors():
    def near(value, error, word):
        return comparison.near([value], [error], word) == [True]

    assert near(4.05e-3, 0, "4.0e-3") and not near(4.2e-3, 0, "4.0e-3") and near(4.2e-3, 0.03e-3, "4.0e-3")
    assert near(17.9, 0, "17") and near(2.9e5, 0, "2e5") and not near(4e5, 0, "2e5")
    assert near(np.inf, 0, "never") and not near(9.0, 0, "never") and not near(np.nan, 1.0, "1.0")
    assert comparison.near([1.0, np.nan], [0.0, 0.0], "1.0 -") == [True]
