"""Limits and bounds against golden numbers, integrals over frequency, finite differences and simulation."""

import numpy as np
import pytest
from oracle import golden
from scipy.signal import lfilter

import driftwise as dw

PAPER = [-0.24, 1.18, -1.9], [-0.056, 0.5, -1.3]
POSED = (
    np.poly([0.9 * np.exp(0.2j * np.pi), 0.9 * np.exp(-0.2j * np.pi)]).real[:0:-1],
    np.poly([-0.6, 0.3])[:0:-1],
)


def q(p):
    return np.append(1.0, np.asarray(p)[::-1])


def test_golden_limits():
    given, expected, _ = golden.case("G13")
    stated = zip(given["d_assumed"], *(expected[k] for k in ("a_star", "pred_var", "std1000")), strict=True)
    for d, a_printed, variance, std in stated:
        limit = dw.models.asymptotic_bias(*PAPER, d)
        golden.assert_close(-limit.a, a_printed, 1e-8)
        golden.assert_close(limit.prediction_variance, variance, 1e-8)
        golden.assert_close(np.sqrt(np.diag(limit.reported) / 1000), std, 1e-8)


@pytest.mark.parametrize(
    ("d", "std"),
    [
        ([0.5, 0.06, 0.5], (0.0275, 0.0361, 0.0262)),
        ([-0.125, 0.75, -1.5], (0.0285, 0.0526, 0.0284)),
        ([0.25, -1.0], (0.0225, 0.0224)),
    ],
)
def test_sandwich_is_that_of_the_theory(d, std):
    limit = dw.models.asymptotic_bias(*PAPER, d)
    np.testing.assert_allclose(np.sqrt(np.diag(limit.covariance) / 1000), std, atol=6e-5)


def test_the_right_model_has_no_bias_and_one_covariance():
    limit = dw.models.asymptotic_bias(*PAPER, PAPER[1], var_v=7.0)
    np.testing.assert_allclose(limit.a, PAPER[0], atol=1e-9)
    assert limit.prediction_variance == pytest.approx(7.0)
    np.testing.assert_allclose(limit.covariance, limit.reported, rtol=1e-6)
    bound = dw.models.cramer_rao(*PAPER, samples=1, d_known=True)
    np.testing.assert_allclose(limit.covariance, bound.covariance, rtol=1e-6)


@pytest.mark.parametrize("assumed", [[0.2, -0.7], [0.4]])
def test_limit_and_sandwich_by_simulation(assumed):
    """Least squares on filtered records: mean and covariance within four standard errors of 1500 records."""
    records, T, m = 1500, 1500, len(assumed)
    limit = dw.models.asymptotic_bias(*POSED, assumed)
    v = np.random.default_rng(5).standard_normal((records, T + 300))
    y = lfilter(q(POSED[1]), np.convolve(q(POSED[0]), q(assumed)), v)[:, 300 - m :]
    psi = np.stack([-y[:, j : j + T] for j in range(m)], axis=2)
    M = psi.swapaxes(1, 2) @ psi
    a = np.linalg.solve(M, psi.swapaxes(1, 2) @ y[:, m:, None])[..., 0]
    covariance = limit.covariance / T
    error = (a - limit.a) @ np.linalg.inv(np.linalg.cholesky(covariance)).T
    assert np.max(abs(error.mean(0))) < 4 / np.sqrt(records) + 0.05  # the bias of a short record is one over T
    assert np.max(abs(np.cov(error.T) - np.eye(m))) < 4 * np.sqrt(2 / records) + 0.02
    # what the filter reports is something else, so the comparison can fail
    assert abs(limit.reported[0, 0] / limit.covariance[0, 0] - 1) > 0.25


def information_by_integral(a, d, b, direct, powers, r):
    """Per-sample information as an integral over frequency of the gradient filters' cross spectra."""
    n, k = len(a), len(b)
    z = np.exp(-2j * np.pi * np.arange(4096) / 4096)

    def at(p):
        return np.polyval(np.asarray(p)[::-1], z)

    A, C = at(q(a)), at(q(d))
    lags = [z**lag for lag in range(n, 0, -1)]
    directs = 0 if direct is None else k
    none = [0 * z]
    rows = [([g / A for g in lags] + none * (n * k + directs) + [-g / C for g in lags], 1.0)]
    for i in range(k):
        B = at([0.0 if direct is None else direct[i], *b[i][::-1]])
        row = [g * B / (A * C) for g in lags] + none * (n * k + directs) + none * n
        row[n * (i + 1) : n * (i + 2)] = [-g / C for g in lags]
        if directs:
            row[n * (k + 1) + i] = -1 / C
        rows.append((row, powers[i] / r))
    return sum(w * np.real(np.array(row) @ np.array(row).conj().T) / 4096 for row, w in rows)


@pytest.mark.parametrize(
    ("b", "direct"), [([], None), ([[0.3, 1.0]], None), ([[0.3, 1.0]], [0.5]), ([[0.3, 1.0], [0.2, 0.5]], [0.1, -0.2])]
)
def test_information_is_the_integral_of_the_gradients_spectra(b, direct):
    powers = [2.0, 0.5][: len(b)]
    bound = dw.models.cramer_rao(
        *POSED, b or None, samples=50, direct=direct, noise_variance=0.3, input_variance=powers or 1.0
    )
    expected = 50 * information_by_integral(*POSED, b, direct, powers, 0.3)
    np.testing.assert_allclose(bound.information, expected, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(bound.covariance, np.linalg.inv(expected), rtol=1e-7, atol=1e-12)
    assert len(bound.names) == len(expected)


def test_the_papers_second_test_says_not_to_trust_a():
    bound = dw.models.cramer_rao(*PAPER, samples=1000)
    np.testing.assert_allclose(bound.a_std_known, (0.031, 0.056, 0.031), atol=5e-4)
    np.testing.assert_allclose(bound.a_std, (5.4, 13.0, 7.8), atol=0.05)
    assert 176.5 < bound.ratio.min() < 177.5 and 254.5 < bound.ratio.max() < 255.5
    assert bound.names == ["a3", "a2", "a1", "d3", "d2", "d1"]
    assert "only as good as the assumed d" in bound.words
    known = dw.models.cramer_rao(*PAPER, samples=1000, d_known=True)
    np.testing.assert_allclose(known.std, bound.a_std_known)


def test_a_well_posed_system_may_be_trusted():
    bound = dw.models.cramer_rao(*POSED, samples=1000)
    assert np.all(bound.ratio < 1.5)
    assert "can be trusted" in bound.words


def test_maximum_likelihood_reaches_the_bound():
    """A first-order moving average: the estimate of d by its likelihood, 400 records."""
    d, T, records = 0.4, 400, 400
    bound = dw.models.cramer_rao([0.0], [d], samples=T)
    assert bound.covariance.shape == (2, 2)
    np.testing.assert_allclose(bound.information, T * np.array([[1, -1], [-1, 1 / (1 - d * d)]]), atol=1e-9)
    v = np.random.default_rng(1).standard_normal((records, T))
    y = lfilter([1, d], [1], v)
    grid = np.linspace(0.0, 0.8, 401)
    best = grid[np.argmin([np.sum(lfilter([1], [1, g], y) ** 2, axis=1) for g in grid], axis=0)]
    expected = np.sqrt((1 - d * d) / T)  # the bound with a known
    assert np.std(best) == pytest.approx(expected, rel=4 / np.sqrt(2 * records))


def test_a_pole_under_a_zero_of_c_leaves_a_unknown():
    bound = dw.models.cramer_rao([-0.5], [-0.5], samples=100)
    assert np.all(np.isinf(bound.ratio)) and np.isfinite(bound.a_std_known).all()
    assert "cannot be estimated" in bound.words


def residuals(y, u, n, k, directs, p):
    """v(t) from the state recursion itself, for p = [x(0) ; a ; b of each input ; b_n ; d] in Salut's order."""
    x, a, d = p[:n].copy(), p[n : 2 * n], p[len(p) - n :]
    b, b_n = p[2 * n : n * (k + 2)].reshape(k, n), p[n * (k + 2) : n * (k + 2) + directs]
    out = np.empty(len(y))
    for t in range(len(y)):
        out[t] = y[t] - x[-1] - (b_n @ u[t] if directs else 0.0)
        x = np.append(0.0, x[:-1]) - a * y[t] + b.T @ u[t] + d * out[t]
    return out


@pytest.mark.parametrize(("k", "directs"), [(0, 0), (1, 0), (2, 2)])
def test_record_information_by_finite_differences(k, directs):
    rng = np.random.default_rng(k)
    n, T = 2, 60
    y, u = rng.standard_normal(T), rng.standard_normal((T, k))
    b = rng.standard_normal((k, n))
    b_n = rng.standard_normal(k) if directs else None
    bound = dw.models.cramer_rao_of_record(
        y, u if k else None, a=POSED[0], d=POSED[1], b=b if k else None, direct=b_n, noise_variance=0.7
    )
    theta = np.concatenate([POSED[0], b.ravel(), [] if b_n is None else b_n, POSED[1]])
    unit = np.eye(n)
    zero = np.concatenate([np.zeros(n), theta])
    base = residuals(y, u, n, k, directs, zero)
    x_columns = np.column_stack([residuals(y, u, n, k, directs, np.append(e, theta)) - base for e in unit])
    p = np.append(-np.linalg.lstsq(x_columns, base, rcond=None)[0], theta)  # at the best initial state
    h = 1e-6
    steps = h * np.eye(len(p))
    J = np.column_stack(
        [(residuals(y, u, n, k, directs, p + s) - residuals(y, u, n, k, directs, p - s)) / (2 * h) for s in steps]
    )
    full = J.T @ J / 0.7
    schur = full[n:, n:] - full[n:, :n] @ np.linalg.solve(full[:n, :n], full[:n, n:])
    np.testing.assert_allclose(bound.information, schur, rtol=1e-6, atol=1e-6 * abs(schur).max())


def test_record_and_asymptotic_bound_agree_on_a_long_record():
    T = 40_000
    y, _ = dw.simulate(POSED[0][::-1], d=POSED[1][::-1], samples=T, noise_std=2.0, seed=2)
    record = dw.models.cramer_rao_of_record(y, a=POSED[0], d=POSED[1])
    theory = dw.models.cramer_rao(*POSED, samples=T)
    np.testing.assert_allclose(record.std, theory.std, rtol=0.03)
    np.testing.assert_allclose(record.ratio, theory.ratio, rtol=0.03)


def test_record_warns_where_a_is_not_to_be_trusted():
    """Near a cancellation the noise of the sample information makes the ratio too small, but the verdict is right."""
    ratios = []
    for seed in range(4):
        y, _ = dw.simulate(PAPER[0][::-1], d=PAPER[1][::-1], samples=2000, noise_std=1.0, seed=seed)
        bound = dw.models.cramer_rao_of_record(y, a=PAPER[0], d=PAPER[1])
        assert "only as good as the assumed d" in bound.words
        ratios.append(bound.ratio)
    assert 13 < np.min(ratios) < 15 and 89 < np.max(ratios) < 91  # the docstring's numbers


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: dw.models.cramer_rao([-0.5], [-1.5], samples=10), "moduli 1.5.*minimum_phase"),
        (lambda: dw.models.cramer_rao([-0.5], [1.0], samples=10), "inside the unit circle"),
        (lambda: dw.models.cramer_rao([-1.5], [0.5], samples=10), "zeros of a"),
        (lambda: dw.models.cramer_rao([-0.5, 0.1], [0.5], samples=10), "2 finite"),
        (lambda: dw.models.cramer_rao([-0.5], [0.5], samples=0), "positive"),
        (lambda: dw.models.cramer_rao([-0.5], [0.5], [1.0, 2.0], samples=9), "b must list 1"),
        (lambda: dw.models.cramer_rao([-0.5], [0.5], direct=[1.0], samples=9), "no b"),
        (lambda: dw.models.cramer_rao([-0.5], [0.5], [1.0], direct=[1.0, 2.0], samples=9), "direct must list 1"),
        (lambda: dw.models.asymptotic_bias([-0.5], [0.5], [2.0]), "d_assumed.*minimum_phase"),
        (lambda: dw.models.asymptotic_bias([-0.5], [0.5], []), "order of the filter"),
        (lambda: dw.models.asymptotic_bias([-0.5], [0.5, 0.1], [0.0]), "one order"),
        (lambda: dw.models.asymptotic_bias([-0.5], [0.5], [0.0], var_v=-1), "var_v"),
        (lambda: dw.models.cramer_rao_of_record([1.0, np.nan] * 9, a=[0.0], d=[0.1]), "complete stretch"),
        (lambda: dw.models.cramer_rao_of_record([1.0, 2.0], a=[0.0], d=[0.1]), "too few"),
        (lambda: dw.models.cramer_rao_of_record(np.zeros(40), a=[0.0], d=[0.1]), "residuals are zero"),
        (lambda: dw.models.cramer_rao_of_record(np.zeros(40), np.zeros(40), a=[0.0], d=[0.1]), "as b says"),
    ],
)
def test_bad_input_has_a_clear_answer(call, says):
    with pytest.raises(dw.InputError, match=says):
        call()


def test_reflecting_makes_a_usable_polynomial():
    d, gain = dw.models.minimum_phase([-1.5])
    assert gain == pytest.approx(2.25)
    assert np.isfinite(dw.models.cramer_rao([-0.5], d, samples=10, noise_variance=gain).std).all()
