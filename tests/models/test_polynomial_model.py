"""Models out of the polynomial family: against SciPy, python-control and sampling."""

import control
import numpy as np
import pytest
import scipy.signal
from test_polynomials import SYSTEMS

import driftwise as dw
from driftwise.models.family import Family

S = SYSTEMS["BJ, two inputs, offset"]
FAMILY = Family(0, (2, 1), (1, 0), True, nc=2, nd=1, nf=(2, 1))
rng = np.random.default_rng(1)
L = 0.003 * rng.standard_normal((len(S.theta), len(S.theta)))
W = np.linspace(0.05, 3.0, 30)


def model(theta=S.theta, P=L @ L.T):
    return dw.models.PolynomialModel(FAMILY, np.array(theta), P)


def test_channels_and_noise_are_the_polynomials():
    m, (A, B, C, D, F) = model(), S.polynomials
    G, _ = m.frequency_response(W)
    for l in range(2):
        np.testing.assert_allclose(G[l], scipy.signal.freqz(B[l], np.convolve(A, F[l]), worN=W)[1], rtol=1e-12)
    noise, _ = m.noise_model.frequency_response(W)
    np.testing.assert_allclose(noise[0], scipy.signal.freqz(C, np.convolve(A, D), worN=W)[1], rtol=1e-12)
    assert m.noise_model.values[-1] == 1 and m.noise_model.covariance[-1, -1] == 0
    np.testing.assert_allclose(np.sort_complex(m.poles), np.sort_complex(np.concatenate([np.roots(f) for f in F])))
    np.testing.assert_allclose(m.zeros(0), [-0.5])
    np.testing.assert_allclose(m.dc_gain, [1.5 / 0.3, 0.3 / 0.4])


def test_control_and_scipy():
    m, (_, B, C, D, F) = model(), S.polynomials
    system = m.to_control(noise=True)
    assert system.ninputs == 3 and m.to_control().ninputs == 2
    response = control.frequency_response(system, W).frdata[0]
    for row, (num, den) in zip(response, [(B[0], F[0]), (B[1], F[1]), (C, D)]):
        np.testing.assert_allclose(row, scipy.signal.freqz(num, den, worN=W)[1], rtol=1e-9)
    u = np.random.default_rng(0).standard_normal((40, 2))
    *abcd, dt = m.to_scipy()
    _, y, _ = scipy.signal.dlsim(scipy.signal.dlti(*abcd, dt=dt), u)
    np.testing.assert_allclose(y[:, 0] + S.offset, m.simulate(u, noise_std=0.0)[0], atol=1e-12)
    np.testing.assert_allclose(m.simulate(u, noise_std=0.0)[0], S.simulate(u, np.zeros(40)), atol=1e-12)
    num, den = m.to_transfer_function()
    np.testing.assert_allclose(scipy.signal.freqz(num[1], den, worN=W)[1], scipy.signal.freqz(B[1], F[1], worN=W)[1])


def test_bars_agree_with_sampling():
    m = model()
    draws = [model(S.theta + e) for e in np.random.default_rng(2).standard_normal((500, len(S.theta))) @ L.T]

    def rms(of):
        at = of(m)
        return np.sqrt(np.mean([abs(of(d) - at) ** 2 for d in draws], axis=0))

    np.testing.assert_allclose(m.poles_std, rms(lambda d: d.poles), rtol=0.1)
    np.testing.assert_allclose(m.dc_gain_std, rms(lambda d: d.dc_gain), rtol=0.1)
    np.testing.assert_allclose(m.zeros_std(0), rms(lambda d: d.zeros(0)), rtol=0.1)
    np.testing.assert_allclose(m.noise_model.zeros_std(), rms(lambda d: d.noise_model.zeros()), rtol=0.1)
    _, C = m.frequency_response([0.7])
    G = rms(lambda d: d.frequency_response([0.7])[0][:, 0])
    np.testing.assert_allclose(np.sqrt(np.trace(C[:, 0], axis1=1, axis2=2)), G, rtol=0.1)
    assert np.all(np.isfinite(m.dc_gain_interval()))


def test_a_shared_root_leaves_poles_sharp():
    """A and F with the same pole: each is known from its own coefficients, no double root."""
    m = dw.models.PolynomialModel(Family(1, (1,), (1,), nf=(1,)), np.array([-0.8, 1.0, -0.8]), 1e-6 * np.eye(3))
    np.testing.assert_allclose(m.poles_std, 1e-3)
    assert m.method == ["first order"] * 2


def test_words():
    text = str(model(P=np.diag(np.full(10, 1e-4))))
    assert text.splitlines()[0] == "y(t) = B1(q)/F1(q) u1(t) + B2(q)/F2(q) u2(t) + offset + C(q)/D(q) e(t)"
    assert "F1(q) = 1 - 1.2 (± 0.01) q^-1 + 0.5 (± 0.01) q^-2" in text
    assert "B2(q) = 0.3 (± 0.01)\n" in text
    assert "offset = 0.4" in text


def test_models_of_a_trace_and_errors():
    y, u = S.records(1, 600, 0.3, seed=4)
    est = dw.BJ((2, 1), 2, 1, (2, 1), (1, 0), offset=True)
    trace = est.scan(y[0], u[0], keep="covariance")
    assert trace.model().names == est.names and trace.model(300).poles.shape == (3,)
    assert np.isfinite(trace.model().noise_std) and trace.model().is_stable
    with pytest.raises(dw.InputError, match="input must be one of 0 to 1"):
        trace.model().zeros(2)
    with pytest.raises(dw.InputError, match="u must be finite"):
        trace.model().simulate(np.ones((5, 3)))
    arma = dw.ARMA(2, 1).scan(y[0]).model()
    assert (
        arma.dc_gain.shape == (0,)
        and arma.frequency_response(W)[0].shape == (0, 30)
        and len(arma.noise_model.zeros()) == 2
    )
    with pytest.raises(dw.InputError, match="no input"):
        arma.to_control()
    assert arma.to_control(noise=True).ninputs == 1
    assert "fit of" in trace.summary().words and trace.summary().as_dict()["poles"]
