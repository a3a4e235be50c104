"""Singer's model and its canonical form against the golden cases, long arithmetic and a textbook Kalman filter."""

from functools import cache

import mpmath as mp
import numpy as np
import pytest
import scipy.linalg
from oracle import golden

import driftwise as dw

STEPS = [1e-12, 1e-9, 1e-6, 1e-3, 0.1, 0.99999, 1.0, 1.1, 2, 5, 20, 100, 600, 1e3]


@cache
def long_model(alpha, q, dt):
    """Phi and Q by Van Loan's block exponential, with digits to spare for exp(alpha dt)."""
    with mp.workdps(150 + int(alpha * dt)):
        A = mp.matrix([[0, 1, 0], [0, 0, 1], [0, 0, -mp.mpf(alpha)]])
        block = mp.zeros(6)
        block[:3, :3], block[3:, 3:] = -A, A.T
        block[2, 5] = 2 * mp.mpf(alpha) * mp.mpf(q)
        E = mp.expm(block * mp.mpf(dt), method="taylor")
        Phi = E[3:, 3:].T
        return Phi, Phi * E[:3, 3:]


@cache
def long_canonical(alpha, q, dt, r):
    """d_0..d_2 and var v, in long numbers: zeros of the palindromic polynomial of the autocovariances."""
    Phi, Q = long_model(alpha, q, dt)
    with mp.workdps(200):
        phi = Phi[2, 2]
        A = [mp.mpf(1), -(2 + phi), 1 + 2 * phi, -phi]
        H = mp.matrix([[1, 0, 0]])
        M = [H]
        for k in range(1, 4):
            M.append(M[-1] * Phi + A[k] * H)
        gamma = []
        for k in range(4):
            gamma.append(sum((M[i + k] * Q * M[i].T)[0] + mp.mpf(r) * A[i] * A[i + k] for i in range(4 - k)))
        z = [mp.mpf(0)]  # beyond alpha dt = 500 one zero is far below the least double
        if alpha * dt < 500:
            z = []
        inner = gamma[: 4 - len(z)]
        pairs = mp.polyroots(inner[::-1] + inner[1:], maxsteps=1000, extraprec=600)  # a palindrome: either order
        z += sorted(pairs, key=abs)[: 3 - len(z)]
        d = [mp.re(-z[0] * z[1] * z[2]), mp.re(z[0] * z[1] + z[0] * z[2] + z[1] * z[2]), mp.re(-z[0] - z[1] - z[2])]
        return d, gamma[0] / (1 + sum(k * k for k in d))


def relative(got, expected):
    got, expected = np.asarray(got), np.array(expected.tolist(), float).reshape(np.shape(got))
    return np.max(np.abs(got - expected) / np.where(expected == 0, 1, abs(expected)))


def test_golden_covariance():
    given, expected, tolerance = golden.case("G07")
    for s, Phi, Q in zip(given["sets"], expected["Phi"], expected["Q"], strict=True):
        model = dw.models.Singer(**s)
        assert np.all(abs(model.Phi - Phi) <= tolerance * abs(Phi))
        assert np.all(abs(model.Q - Q) <= tolerance * abs(Q))


@pytest.mark.parametrize("x", STEPS)
def test_every_entry_keeps_its_relative_digits(x):
    """Down to alpha dt = 1e-12, where the closed form is wrong by dozens of orders of magnitude."""
    for dt in (1.0, 0.004):
        model = dw.models.Singer(x / dt, 2.5, dt)
        Phi, Q = long_model(model.alpha, model.q, model.dt)
        assert relative(model.Phi, Phi) < 1e-12  # the exponential itself turns one ulp of alpha dt into 1e3 of them
        assert relative(model.Q, Q) < 1e-13 if x < 100 else relative(model.Q, Q) < 1e-12
        assert np.linalg.eigvalsh(model.Q / np.sqrt(np.outer(np.diag(model.Q), np.diag(model.Q))))[0] > -1e-15


def test_golden_canonical_form():
    given, expected, tolerance = golden.case("G08")
    for s, a, d, variance in zip(given["sets"], *(expected[k] for k in ("a", "d", "var_v")), strict=True):
        form = dw.models.Singer(s["alpha"], s["q"], s["dt"]).canonical(s["r"])
        golden.assert_close(form.a, a, tolerance)
        golden.assert_close(form.d, d, tolerance)
        assert form.variance == pytest.approx(variance, rel=tolerance)
        assert form.error < 1e-12


@pytest.mark.parametrize("x", [1e-12, 1e-3, 0.1, 1, 5, 1e3])
@pytest.mark.parametrize("ratio", [1e-14, 1e-2, 1, 1e12])
def test_canonical_form_over_the_whole_range(x, ratio):
    """``ratio`` is the disturbance of one step over the noise of the sensor, 2 alpha dt q dt^4 / r."""
    dt, r = 0.5, 16.0
    model = dw.models.Singer(x / dt, ratio * r / (2 * x * dt**4), dt)
    form = model.canonical(r)
    d, variance = long_canonical(model.alpha, model.q, model.dt, r)
    d, variance = np.array(d, float), float(variance)
    assert np.max(abs(form.d - d)) < 1e-12
    assert form.d[0] == pytest.approx(d[0], rel=1e-11, abs=1e-300)
    assert form.variance == pytest.approx(variance, rel=1e-11)
    assert np.all(abs(np.roots([1, *form.d[::-1]])) < 1)


@pytest.mark.parametrize("x", [1e-12, 0.01, 1, 300])
def test_refuses_what_doubles_cannot_hold(x):
    """Below some q/r rounding d moves the zeros; the stated error is that of the spectrum in long arithmetic."""

    def spectrum_error(form, model):
        d, variance = long_canonical(model.alpha, model.q, model.dt, 1.0)
        worst = 0
        with mp.workdps(60):
            for w in np.geomspace(1e-9, 3.14, 40):
                z = mp.expj(mp.mpf(w))
                got = abs(z**3 + sum(mp.mpf(k) * z**i for i, k in enumerate(form.d))) ** 2 * form.variance
                exact = abs(z**3 + sum(k * z**i for i, k in enumerate(d))) ** 2 * variance
                worst = max(worst, abs(got / exact - 1))
        return float(worst)

    accepted = refused = 0
    for power in range(-25, -8, 4):
        model = dw.models.Singer(x, 10.0**power / (2 * x), 1.0)
        try:
            form = model.canonical(1.0)
        except dw.InputError:
            with pytest.raises(dw.InputError, match=r"doubles.*longer dt"):
                model.canonical(1.0)
            refused += 1
            continue
        accepted += 1
        measured = spectrum_error(form, model)
        assert measured < 1e-6
        assert measured < 1.5 * form.error + 1e-13
    assert accepted and refused


def test_the_joint_filter_with_the_canonical_form_is_the_kalman_filter():
    """A target with known dynamics: predictions of Joint(3) equal those of the steady filter on [p, v, a]."""
    model, r = dw.models.Singer(0.3, 4.0, 0.8), 25.0
    form = model.canonical(r)
    Phi, Q, H = model.Phi, model.Q, np.eye(1, 3)
    P = scipy.linalg.solve_discrete_are(Phi.T, H.T, Q, [[r]])
    assert form.variance == pytest.approx(P[0, 0] + r, rel=1e-11)
    rng = np.random.default_rng(3)
    start = np.array([300.0, -20.0, 2.0])
    target, x, predicted, y = start, start, [], []
    for _ in range(60):
        y.append(target[0] + 5 * rng.standard_normal())
        predicted.append(x[0])
        x = Phi @ (x + P[:, 0] / form.variance * (y[-1] - x[0]))
        target = Phi @ target + np.linalg.cholesky(Q) @ rng.standard_normal(3)
    est = dw.Joint(3, noise=form.noise, s0=form.prior(*start), P0=np.zeros((6, 6)))
    trace = est.scan(y)
    np.testing.assert_allclose(trace.prediction, predicted, atol=1e-9)
    est = dw.Joint(3, noise=form.noise, s0=form.prior(*start), P0=form.P0(50, 5, 1, 0.1))
    spread = form.transform @ np.diag([50.0, 5, 1]) ** 2 @ form.transform.T
    np.testing.assert_allclose(est.covariance(est.start())[:3, :3], spread, rtol=1e-9)


@pytest.mark.parametrize("zeros", [[0.5], [-0.9, 0.3], [0.7 + 0.6j, 0.7 - 0.6j, -0.2], [0.0, 0.4], [0.99, 0.5, -0.99]])
def test_spectral_factor_finds_the_polynomial(zeros):
    c = np.poly(zeros).real
    d, variance = dw.models.spectral_factor(3.0 * np.correlate(c, c, "full")[len(c) - 1 :])
    np.testing.assert_allclose(d, c[:0:-1], atol=1e-10)
    assert variance == pytest.approx(3.0, rel=1e-10)


def test_spectral_factor_of_a_reflected_polynomial():
    c = np.poly([2.0, 0.5, -1.25]).real
    d, variance = dw.models.spectral_factor(np.correlate(c, c, "full")[len(c) - 1 :])
    reflected, gain = dw.models.minimum_phase(c[:0:-1])
    np.testing.assert_allclose(d, reflected, atol=1e-12)
    assert variance == pytest.approx(gain, rel=1e-12)


def test_white_noise_and_trailing_zeros():
    assert dw.models.spectral_factor([4.0]) == (pytest.approx(np.zeros(0)), 4.0)
    d, _ = dw.models.spectral_factor([1.25, 0.5, 0.0])
    np.testing.assert_allclose(d, [0.0, 0.5], atol=1e-14)


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: dw.models.Singer(0.0, 1.0, 1.0), "alpha must be a positive"),
        (lambda: dw.models.Singer(1.0, -1.0, 1.0), "q must be a positive"),
        (lambda: dw.models.Singer(1.0, 1.0, np.nan), "dt must be a positive"),
        (lambda: dw.models.Singer("fast", 1.0, 1.0), "alpha must be"),
        (lambda: dw.models.Singer(1.0, 1.0, 1e90), "range of doubles"),
        (lambda: dw.models.Singer(1.0, 1.0, 1.0).canonical(0.0), "r must be a positive"),
        (lambda: dw.models.Singer(1.0, 1e-150, 1.0).canonical(1.0), "beyond what doubles hold"),
        (lambda: dw.models.spectral_factor([1.0, 2.0]), "exceeds gamma_0"),
        (lambda: dw.models.spectral_factor([1.0, 0.7]), "negative at some frequency"),
        (lambda: dw.models.spectral_factor([2.0, -1.0]), "vanishes"),
        (lambda: dw.models.spectral_factor([-1.0, 0.0]), "gamma_0 > 0"),
        (lambda: dw.models.minimum_phase([1.0]), "on the unit circle"),
        (lambda: dw.models.minimum_phase([np.nan]), "finite"),
    ],
)
def test_bad_input_has_a_clear_answer(call, says):
    with pytest.raises(dw.InputError, match=says):
        call()
