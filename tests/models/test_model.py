"""Models out: state space, poles, gains, and how sure they are; records in: the simulator."""

import control
import numpy as np
import pytest
import scipy.signal

import driftwise as dw
from driftwise.models.canonical import Canonical

THETA = np.array([-1.5, 0.7, 1.0, 0.5, 0.2, -0.3, 0.4, 0.1])  # n = 2, two inputs, direct terms


def model(theta=THETA, P=None, inputs=2, direct=True, dt=0.5):
    P = np.eye(len(theta)) * 1e-6 if P is None else P
    return dw.models.Model(Canonical((len(theta) - 2 * direct) // (inputs + 1), inputs, direct), theta, P, dt)


def test_state_space_is_the_polynomials():
    m = model()
    w = np.linspace(0.05, 6.0, 40)
    G, _ = m.frequency_response(w)
    a, b = m.form.polynomials(m.values)
    for i in range(2):
        _, H = scipy.signal.freqz(b[i], a, worN=w * m.dt)
        np.testing.assert_allclose(G[i], H, rtol=1e-12)
        num, den = scipy.signal.ss2tf(m.A, m.B, m.C, m.D, input=i)
        np.testing.assert_allclose(num[0], b[i], atol=1e-12)
        np.testing.assert_allclose(den, a, atol=1e-12)


def test_python_control_and_scipy_agree():
    m = model()
    system = m.to_control()
    np.testing.assert_allclose(np.sort_complex(system.poles()), np.sort_complex(m.poles), atol=1e-12)
    np.testing.assert_allclose(control.dcgain(system).ravel(), m.dc_gain, rtol=1e-10, atol=1e-12)
    A, B, C, D, dt = m.to_scipy()
    lti = scipy.signal.dlti(A, B, C, D, dt=dt)
    u = np.random.default_rng(0).standard_normal((30, 2))
    _, y, _ = scipy.signal.dlsim(lti, u)
    expected, _ = dw.simulate(THETA[:2], THETA[2:6].reshape(2, 2), direct=THETA[6:], samples=30, u=u)
    np.testing.assert_allclose(y[:, 0], expected, atol=1e-10)


def test_delta_method_agrees_with_sampling():
    rng = np.random.default_rng(1)
    L = rng.standard_normal((8, 8)) * 0.002
    P = L @ L.T
    m = model(P=P)
    draws = THETA + rng.standard_normal((4000, 8)) @ L.T
    others = [model(t) for t in draws]
    poles = np.array([o.poles for o in others])
    spread = np.sqrt(np.mean(abs(poles - m.poles) ** 2, axis=0))
    np.testing.assert_allclose(m.poles_std, spread, rtol=0.06)
    np.testing.assert_allclose(m.dc_gain_std, np.std([o.dc_gain for o in others], axis=0), rtol=0.06)
    _, C = m.frequency_response([0.7])
    sampled = np.array([o.frequency_response([0.7])[0][:, 0] for o in others])
    np.testing.assert_allclose(C[:, 0, 0, 0], sampled.real.var(axis=0), rtol=0.1)
    np.testing.assert_allclose(C[:, 0, 1, 1], sampled.imag.var(axis=0), rtol=0.1)


def test_transfer_function_goes_round():
    """Time responses of scipy and python-control, from polynomials and from matrices, are the model's own."""
    m = model()
    u = np.random.default_rng(7).standard_normal((80, 2))
    y, _ = m.simulate(u)
    num, den = m.to_transfer_function()
    assert num.shape == (2, 3) and den.tolist() == [1, -1.5, 0.7]
    parts = [scipy.signal.dlsim(scipy.signal.dlti(row, den, dt=m.dt), u[:, i])[1][:, 0] for i, row in enumerate(num)]
    np.testing.assert_allclose(sum(parts), y, atol=1e-10)
    np.testing.assert_allclose(sum(scipy.signal.lfilter(row, den, c) for row, c in zip(num, u.T)), y, atol=1e-10)
    t = np.arange(80) * m.dt
    np.testing.assert_allclose(control.forced_response(m.to_control(), t, u.T).outputs[0], y, atol=1e-10)
    parts = [control.forced_response(control.tf(row, den, m.dt), t, c).outputs for row, c in zip(num, u.T)]
    np.testing.assert_allclose(sum(parts), y, atol=1e-9)
    for i in range(2):
        system = control.tf(num[i], den, m.dt)
        np.testing.assert_allclose(np.sort_complex(system.zeros()), np.sort_complex(m.zeros(i)), atol=1e-12)
        back = control.ss2tf(m.to_control()[0, i])
        np.testing.assert_allclose(back.num[0][0] / back.den[0][0][0], num[i], atol=1e-10)


def test_orders_and_names():
    form = Canonical(2, 2, True)
    assert form.names == ["a1", "a2", "b1.1", "b2.1", "b1.2", "b2.2", "b0.1", "b0.2"]
    assert form.N == 10
    salut = np.array(["x1", "x2", "a_0", "a_1", "b_0", "b_1", "c_0", "c_1", "b_n", "c_n"])
    assert salut[form.salut].tolist() == ["x2", "x1", "a_1", "a_0", "b_1", "b_0", "c_1", "c_0", "b_n", "c_n"]
    assert salut[form.salut][form.kernel].tolist() == salut.tolist()


def test_no_input_no_transfer_function():
    with pytest.raises(dw.InputError, match="no input"):
        model(np.array([-0.5, 0.1]), inputs=0, direct=False).to_control()


def test_model_of_a_run_is_right_within_its_errors():
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=3000, noise_std=0.2, seed=4)
    m = dw.Joint(2, inputs=1).scan(y, u).model()
    truth = np.array([-1.5, 0.7, 1.0, 0.5])
    assert np.all(abs(m.values - truth) < 4 * np.sqrt(np.diag(m.covariance)))
    assert abs(m.dc_gain[0] - 7.5) < 4 * m.dc_gain_std[0]
    assert m.is_stable


def test_simulator_does_what_it_says():
    a = np.linspace([-0.9], [-0.5], 400)
    y, u = dw.simulate(a, [1.0], samples=400, noise_std=0.0, seed=1)
    expected = np.zeros(400)
    for t in range(1, 400):
        expected[t] = -a[t - 1, 0] * expected[t - 1] + u[t - 1]
    np.testing.assert_allclose(y, expected, atol=1e-12)
    lost, _ = dw.simulate(a, [1.0], samples=400, missing=0.3, seed=1)
    assert 80 < np.isnan(lost).sum() < 160
    assert dw.simulate([-0.5], samples=10, noise_std=1.0)[1] is None
    white, _ = dw.simulate([-0.9], samples=20000, noise_std=1.0, noise="output", seed=2)
    assert abs(np.std(white) - 1) < 0.02  # no input: only the measurement noise is seen
