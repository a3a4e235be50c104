"""`JointMIMO` against full matrices: random structures, every option on together, gaps in outputs and inputs."""

import numpy as np
import pytest
from draws import slow
from oracle import dense_mimo
from oracle.by_name import by_name

import driftwise as dw

TOLERANCE = 1e-9
SAMPLES = 25
STRUCTURES = [((2, 1), 1, False), ((2, 1), 1, True), ((1, 2), 0, False), ((3, 1, 2), 2, True), ((1, 3, 2), 1, False)]


def covariance(rng, size):
    root = rng.standard_normal((size, size)) / np.sqrt(size)
    return root @ root.T + 0.1 * np.eye(size)


def problem(structure, seed, lost_y, lost_u):
    nu, inputs, direct = structure
    rng = np.random.default_rng(seed)
    plant = dense_mimo.plant(nu, inputs, direct)
    y, u = rng.standard_normal((SAMPLES, len(nu))), rng.standard_normal((SAMPLES, inputs))
    y[rng.random(y.shape) < lost_y] = np.nan
    u[rng.random(u.shape) < lost_u] = np.nan
    s0, q = 0.3 * rng.standard_normal(plant.size), rng.uniform(0, 0.01, plant.size - plant.n)
    return rng, plant, y, u, s0, q


def coupled(rng, plant):
    n = plant.n
    joint = covariance(rng, n + len(plant.nu))
    noise = dense_mimo.Noise(joint[:n, :n], joint[:n, n:], joint[n:, n:])
    return noise, dw.models.NoiseCovariance(*noise), 0.3 * covariance(rng, plant.size)


def separate(rng, plant):
    p = len(plant.nu)
    R, d = rng.uniform(0.1, 1, p), [0.4 * rng.standard_normal(nu) for nu in plant.nu]
    D = np.zeros((plant.n, p))
    for i, column in enumerate(d):
        D[dense_mimo.state(plant, i, 1) : dense_mimo.state(plant, i, plant.nu[i]) + 1, i] = column
    noise = dense_mimo.Noise(D * R @ D.T, D * R, np.diag(R))
    return noise, dw.models.NoisePolynomial(tuple(d), R), np.diag(rng.uniform(0.1, 0.5, plant.size))


def by_lag(est, q):
    """From Salut's order of the parameters to the public one."""
    n = est.model.n
    return q[est.model.salut[n:] - n]


def is_close(found, expected):
    """Say whether all numbers are within the tolerance: as ``pytest.approx``, which looks at them one by one."""
    bound = TOLERANCE * np.maximum(abs(expected), 1.0)
    return found.shape == expected.shape and bool(np.all(abs(found - expected) <= bound))


@pytest.mark.parametrize("structure", STRUCTURES, ids=str)
@pytest.mark.parametrize("lost_y, lost_u", [(0.0, 0.0), slow(0.25, 0.0), slow(0.0, 0.2), (0.25, 0.2)])
@pytest.mark.parametrize("kind", [coupled, separate])
def test_follows_the_oracle(structure, lost_y, lost_u, kind):
    rng, plant, y, u, s0, q = problem(structure, 5, lost_y, lost_u)
    matrices, noise, P0 = kind(rng, plant)
    plain = dw.JointMIMO(*structure)
    assert plain.model.N == plant.size
    prior = dict(s0=by_name(plain, s0), P0=by_name(plain, P0))
    est = dw.JointMIMO(*structure, noise=noise, memory=dw.RandomWalk(by_lag(plain, q)), floor=0.0, **prior)
    assert est.is_split == (kind is separate)
    expected = dense_mimo.run(plant, matrices, s0, P0, y, u, q, est.is_split)
    trace = est.scan(y, u if plant.inputs else None, keep="covariance")
    assert trace.prediction == pytest.approx(np.array(expected.prediction), rel=TOLERANCE, abs=TOLERANCE)
    assert trace.variance == pytest.approx(np.array(expected.variance), rel=TOLERANCE)
    state = est.start()
    for t in range(SAMPLES):
        state, _ = est.update(state, y[t], u[t] if plant.inputs else None)
        standard = np.sqrt(np.diag(expected.P[t]))
        assert np.all(abs(est.mean(state) - expected.s[t]) <= TOLERANCE * (standard + abs(expected.s[t])))
        assert np.all(abs(est.covariance(state) - expected.P[t]) <= TOLERANCE * np.outer(standard, standard))
        back = est.model.salut
        now, P = np.concatenate([trace.x[t], trace.parameters[t]]), trace.covariance[t]
        assert is_close(now, expected.now[t][0][back])
        assert is_close(P, expected.now[t][1][np.ix_(back, back)])
    assert est.loglik(state) == pytest.approx(expected.loglik, rel=TOLERANCE)


@pytest.mark.parametrize("structure", STRUCTURES, ids=str)
def test_outputs_in_order_are_all_outputs_at_once(structure):
    """The oracle's moments against theorem 3 in block matrices (chain rule), for complete samples."""
    rng, plant, y, u, s0, _ = problem(structure, 6, 0.0, 0.0)
    noise, _, P0 = coupled(rng, plant)
    run = dense_mimo.run(plant, noise, s0, P0, y, u)
    s, P, loglik = s0, P0, 0.0
    for t in range(SAMPLES):
        s, P, e, T = dense_mimo.theorem3(plant, noise, s, P, y[t], u[t])
        loglik -= 0.5 * (np.linalg.slogdet(2 * np.pi * T)[1] + e @ np.linalg.solve(T, e))
        assert run.s[t] == pytest.approx(s, rel=1e-10, abs=1e-10)
        assert run.P[t] == pytest.approx(P, rel=1e-10, abs=1e-10)
    assert run.loglik == pytest.approx(loglik, rel=1e-11)


def test_moments_of_a_product_are_those_of_draws():
    """Isserlis in the oracle against 10^6 draws, within five standard errors."""
    rng = np.random.default_rng(0)
    mean, cov = rng.standard_normal(3), covariance(rng, 3)
    functions = [(0.5, [(0, 1.0)], [(2.0, 0, 1), (-1.0, 1, 1)]), (0.0, [(2, -1.0)], [(1.0, 0, 2)])]
    m, C, _ = dense_mimo.Moments(mean, cov).of(functions)
    v = rng.multivariate_normal(mean, cov, 10**6).T
    draws = np.array([0.5 + v[0] + 2 * v[0] * v[1] - v[1] ** 2, -v[2] + v[0] * v[2]])
    products = np.array([(a - a.mean()) * (b - b.mean()) for a in draws for b in draws])
    error = np.concatenate([draws.std(axis=1), products.std(axis=1)]) / 1e3
    got = np.concatenate([draws.mean(axis=1), products.mean(axis=1)])
    assert np.all(abs(got - np.concatenate([m, C.ravel()])) < 5 * error)
