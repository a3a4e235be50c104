"""An unknown noise polynomial inside the joint filter: moments, accuracy, and what it cannot do."""

import numpy as np
import pytest
from draws import draws, slow
from oracle import armax, golden

import driftwise as dw
from driftwise.estimators.joint import step as joint_step  # noqa: F401
from driftwise.models.stability import is_inside, shrink_inside

METHODS = ["ekf", "rml", "els"]


def problem(seed, n=2, inputs=1, direct=True, scale=0.02):
    rng = np.random.default_rng(seed)
    N = n * (3 + inputs) + inputs * direct
    root = rng.standard_normal((N, N)) / np.sqrt(N)
    s0 = rng.standard_normal(N) * 0.3
    return rng, n, inputs, direct, s0, scale * (root @ root.T + 0.1 * np.eye(N))


def joint(n, inputs, direct, s0, P0, R, method, **options):
    noise = dw.models.UnknownPolynomial(method=method, variance=R, radius=0.999999)
    return dw.Joint(n, inputs, direct, noise=noise, s0=s0, P0=P0, **options)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("inputs, direct", [(0, False), (1, False), (2, True)])
def test_equals_the_dense_form(method, inputs, direct):
    rng, n, inputs, direct, s, P = problem(1, 3, inputs, direct)
    est = joint(n, inputs, direct, s, P, 0.4, method)
    y, u = rng.standard_normal(25), rng.standard_normal((25, inputs))
    y[[4, 11, 12]] = np.nan
    state = est.start()
    for t in range(len(y)):
        state, _ = est.update(state, y[t], u[t])
        s, P = armax.step(n, inputs, direct, 0.4, s, P, y[t], u[t], method)
        golden.assert_close(est.mean(state), s, 1e-10, f"mean at {t}")
        golden.assert_close(est.covariance(state), P, 1e-10, f"covariance at {t}")


def test_a_learnt_scale_multiplies_second_order_terms():
    rng, n, inputs, direct, s, P = problem(2)
    noise = dw.models.UnknownPolynomial(radius=0.999999)
    est = dw.Joint(n, inputs, direct, noise=noise, scale=dw.models.InverseGamma(3.0, 6.0), s0=s, P0=P)
    state, alpha, beta = est.start(), 3.0, 6.0
    for y, u in zip(rng.standard_normal(20), rng.standard_normal((20, 1)), strict=True):
        H = armax.row(n, inputs, direct, u)
        e, T, sigma2 = y - H @ s, H @ P @ H + 1.0, beta / alpha
        s, P = armax.step(n, inputs, direct, 1.0, s, P, y, u, "ekf", sigma2)
        alpha, beta = alpha + 0.5, beta + e * e / (2 * T)
        state, _ = est.update(state, y, u)
    golden.assert_close(est.mean(state), s, 1e-10)
    golden.assert_close(est.covariance(state), P, 1e-10)


@draws("batches", 1, 8)
@pytest.mark.parametrize("y", [0.8, np.nan])
def test_moments_are_those_of_the_equation(y, batches):
    """Four million draws of one step, or an eighth of them; every mean and covariance within 5 standard errors."""
    rng, n, inputs, direct, s, P = problem(3, scale=0.5)
    s_next, P_next = armax.step(n, inputs, direct, 0.4, s, P, y, [0.7])
    means, squares, count = 0.0, 0.0, 0
    for _ in range(batches):
        S = armax.draw_next(n, inputs, direct, 0.4, s, P, y, [0.7], 500_000, rng) - s_next
        means, squares, count = means + S.sum(0), squares + S.T @ S, count + len(S)
    spread = np.sqrt(np.diag(P_next))
    assert np.max(np.abs(means / count) / spread) < 5 / np.sqrt(count)
    # products of Gaussians have heavier tails than Gaussians: twice the Gaussian standard error of a covariance
    assert np.max(np.abs(squares / count - P_next) / np.outer(spread, spread)) < 2 * 5 * np.sqrt(2 / count)


def fleet(a, b, c, noise, *, seeds, samples=1000):
    records = [dw.simulate(a, b, d=c, samples=samples, noise_std=1.0, seed=s) for s in range(seeds)]
    y = np.stack([r[0] for r in records])
    u = None if b is None else np.stack([r[1] for r in records])[..., None]
    est = dw.Joint(len(a), int(b is not None), noise=noise).scaled_to(
        y.ravel(), None if u is None else u.reshape(-1, 1)
    )
    states, _ = est.update_batch(est.start(seeds), y, u)
    return est, states


POLES = 0.9 * np.exp([0.2j * np.pi, -0.2j * np.pi])
A, C = np.real(np.poly(POLES))[1:], np.poly([-0.6, 0.3])[1:]


@pytest.mark.parametrize("method, worst, honest", [("ekf", 1.25, 1.5), slow("rml", 1.3, 1.6), slow("els", 1.25, 1.5)])
def test_reaches_the_cramer_rao_bound_where_the_system_is_well_posed(method, worst, honest):
    """Poles .9 exp(+-i pi/5), zeros -.6, .3; C starts at 1 with known variance."""
    est, states = fleet(A, None, C, dw.models.UnknownPolynomial(method=method, variance=1.0), seeds=100)
    error = states["theta"] - np.concatenate([A, C])
    rmse = np.sqrt(np.mean(error**2, axis=0))
    bound = dw.models.cramer_rao(A[::-1], C[::-1], samples=1000)
    assert np.all(rmse[:2] <= worst * bound.a_std[::-1])
    assert np.all(rmse[:2] >= 0.8 * bound.a_std[::-1])
    nees = [e @ np.linalg.solve(est._theta_covariance(s), e) / 4 for e, s in zip(error, states, strict=True)]
    assert np.mean(nees) < honest


def test_prediction_is_repaired_although_nearly_cancelling_parameters_are_not():
    """Section 3.2's system from the wrong C: no method finds a, every method predicts."""
    a, c = np.array([-1.9, 1.18, -0.24]), np.array([-1.3, 0.5, -0.056])
    wrong = (0.5, 0.06, 0.5)
    y = np.stack([dw.simulate(a, d=c, samples=1000, noise_std=1.0, seed=s)[0] for s in range(50)])
    fixed = dw.Joint(3, noise=dw.models.NoisePolynomial(wrong, 1.0))
    freed = dw.Joint(3, noise=dw.models.UnknownPolynomial(wrong, variance=1.0))
    excess = [np.mean(est.update_batch(est.start(50), y)[1].innovation[:, 500:] ** 2) - 1 for est in (fixed, freed)]
    assert excess[0] > 0.08
    assert excess[1] < 0.25 * excess[0]


def test_a_prior_on_d_does_the_work():
    a, c = np.array([-1.9, 1.18, -0.24]), np.array([-1.3, 0.5, -0.056])
    vague, informed = (
        dw.models.UnknownPolynomial(variance=1.0),
        dw.models.UnknownPolynomial((-0.125, 0.75, -1.5), 0.2, 1.0),
    )
    rmse = []
    for noise in (vague, informed):
        _, states = fleet(a, None, c, noise, seeds=50)
        rmse.append(np.sqrt(np.mean((states["theta"][:, :3] - a) ** 2, axis=0)))
    assert np.all(rmse[1][:2] < 0.4 * rmse[0][:2])
    assert np.all(rmse[1] < 0.35)


def test_c_is_held_until_the_scale_is_known_and_its_bar_says_so():
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], d=[-0.8, 0.3], samples=3000, noise_std=0.7, missing=0.1, seed=2)
    est = dw.Joint(2, 1, noise=dw.models.UnknownPolynomial(std=0.5)).scaled_to(y, u)
    wait = 2 * est.model.N
    trace = est.scan(y, u)
    waiting = np.cumsum(trace.is_used) <= wait
    assert np.all(trace.parameters[waiting, 4:] == 0)
    assert np.allclose(trace.parameters_std[waiting, 4:], 0.5)
    full = est.scan(y[:200], u[:200], keep="covariance")
    assert np.allclose(full.parameters_std[waiting[:200], 4:], 0.5)
    early = est.scan(y[:wait], u[:wait])
    assert np.allclose(np.sqrt(np.diag(early.model().covariance))[4:], 0.5)
    assert {"c1", "c2"} <= set(" ".join(words for words, _ in early.summary().unlearned).split())
    assert not trace.summary().unlearned


@pytest.mark.parametrize("noise_std", [1.0, 0.03])
def test_learnt_scale_is_honest(noise_std):
    """60 records: NEES per parameter and NIS near one, whatever the size of the noise beside y."""
    nees, nis = [], []
    for seed in range(60):
        y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], d=[-0.8, 0.3], samples=1500, noise_std=noise_std, seed=seed)
        trace = dw.Joint(2, 1, noise=dw.models.UnknownPolynomial()).scaled_to(y, u).scan(y, u)
        model = trace.model()
        error = model.values - [-1.5, 0.7, 1.0, 0.5, -0.8, 0.3]
        nees.append(error @ np.linalg.solve(model.covariance, error) / 6)
        nis.append(trace.summary().nis)
    assert 0.75 < np.mean(nees) < 1.4
    assert 0.85 < np.mean(nis) < 1.15


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_a_constant_c_is_smoothed_to_one_value(method):
    """C's zeros lie near the radius, so d is drawn back again and again: that is no motion of the true d."""
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], d=[-1.8, 0.9], samples=400, noise_std=1.0, seed=1)
    for noise in (
        dw.models.UnknownPolynomial(method=method, radius=0.97),
        dw.models.UnknownPolynomial(None, 1.0, 1.0, method, 0.97),
    ):
        est = dw.Joint(2, 1, noise=noise).scaled_to(y, u)
        filtered, smoothed = est.scan(y, u), est.smooth(y, u)
        assert np.allclose(smoothed.parameters, filtered.parameters[-1], rtol=1e-6, atol=1e-7)
        assert np.allclose(smoothed.parameters_std, filtered.parameters_std[-1], rtol=1e-4)


def test_zeros_of_c_stay_inside():
    """Data that ask for a zero outside the circle: C ends within the radius at every sample."""
    y, _ = dw.simulate([-0.5], d=[2.0], samples=300, noise_std=1.0, seed=4)
    trace = dw.Joint(1, noise=dw.models.UnknownPolynomial(radius=0.9)).scan(y)
    assert np.all(np.abs(trace.state["theta"][1]) <= 0.9)


@pytest.mark.parametrize("seed", range(20))
def test_shrinking_agrees_with_the_roots(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 6))
    c = rng.standard_normal(n) * rng.uniform(0.2, 2)
    p, q = np.empty(n), np.empty(n)
    inside = np.all(np.abs(np.roots([1, *c])) < 0.95)
    assert is_inside(c, 0.95, p, q) == inside
    before = c.copy()
    assert shrink_inside(c, 0.95, p, q) == (not inside)
    assert np.all(np.abs(np.roots([1, *c])) < 0.95)
    assert inside == np.array_equal(before, c)


@pytest.mark.parametrize(
    "noise, words",
    [
        (dw.models.UnknownPolynomial(method="magic"), "ekf"),
        (dw.models.UnknownPolynomial(radius=1.5), "between 0 and 1"),
        (dw.models.UnknownPolynomial(variance=0.0), "positive"),
        (dw.models.UnknownPolynomial(std=-0.2), "std"),
        (dw.models.UnknownPolynomial((1.5, 0.2)), "minimum_phase"),
        (dw.models.UnknownPolynomial((1.0,), variance=1.0), "d must list the 2"),
    ],
)
def test_bad_settings_are_told(noise, words):
    with pytest.raises(dw.InputError, match=words):
        dw.Joint(2, noise=noise)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("direct", [False, True])
def test_a_held_input_takes_its_share_of_the_residual(method, direct):
    """With C known the mean is that of `NoisePolynomial`, a lost input included."""
    u = np.array([0.3, -1.0, 0.7, -0.2, 0.9, np.nan])
    y = np.array([0.1, 0.4, -1.1, 0.6, 0.2, 1.5])
    s0 = np.concatenate([[0.2, -0.1], [0.5, -1.2], [0.5, 1.0], [0.1, 0.3], [0.8] * direct])
    given = np.concatenate([s0[:6], s0[8:]])
    unknown = dw.Joint(2, 1, direct, noise=dw.models.UnknownPolynomial(method=method, variance=0.3), s0=s0, P0=0.0)
    known = dw.Joint(2, 1, direct, noise=dw.models.NoisePolynomial((0.1, 0.3), 0.3), s0=given, P0=0.0)
    got, expected = unknown.scan(y, u).state, known.scan(y, u).state
    assert expected["input_variance"][0] > 0.01
    assert np.allclose(got["x"], expected["x"], rtol=1e-12)


def test_shrinking_moves_every_zero_towards_the_origin_alike():
    zeros = np.array([1.4, -0.9, 0.5 + 0.6j, 0.5 - 0.6j])
    c = np.poly(zeros).real[1:].copy()
    assert shrink_inside(c, 0.95, np.empty(4), np.empty(4))
    ratio = np.sort_complex(np.roots(np.append(1.0, c))) / np.sort_complex(zeros)
    assert np.allclose(ratio, ratio[0], rtol=1e-9)
    assert 0.95 * 0.98 < abs(1.4 * ratio[0]) <= 0.95
