"""`Joint` in both forms against the textbook oracle: random problems, every option switched on together."""

from typing import NamedTuple

import numpy as np
import pytest
from draws import draws
from hypothesis import given, settings
from hypothesis import strategies as some
from oracle import dense

import driftwise as dw

TOLERANCE = 1e-9
SAMPLES = 30
KINDS = ["equation error", "output error", "polynomial", "state covariances", "full covariances"]


class Problem(NamedTuple):
    structure: dense.Structure
    noise: object  # what the user writes
    matrices: dense.Noise | dense.OutputError  # what it means
    s0: np.ndarray
    P0: np.ndarray
    y: np.ndarray
    u: np.ndarray
    walk: object
    scale: object


def covariance(rng, size):
    root = rng.standard_normal((size, size)) / np.sqrt(size)
    return root @ root.T + 0.1 * np.eye(size)


def stable(rng, n):
    """A monic polynomial with its zeros inside the circle, lowest power first, without the leading 1."""
    return np.poly(rng.uniform(-0.8, 0.8, n))[:0:-1]


def noise_of(kind, st, rng):
    n, N = st.n, st.size
    Q, S, R = np.zeros((N, N)), np.zeros(N), rng.uniform(0.1, 2.0)
    if kind == "equation error":
        return dw.models.EquationError(R), dense.Noise(Q, S, R)
    if kind == "output error":
        return dw.models.OutputError(R), dense.OutputError(R)
    if kind == "polynomial":
        S[:n] = d = stable(rng, n)
        return dw.models.NoisePolynomial(d, R), dense.Noise(np.outer(S, S) * R, S * R, R)
    if kind == "state covariances":
        joint = covariance(rng, n + 1)
        Q[:n, :n], S[:n], R = joint[:n, :n], joint[:n, n], joint[n, n]
    if kind == "full covariances":
        joint = covariance(rng, N + 1) * 0.3
        Q, S, R = joint[:N, :N], joint[:N, N], joint[N, N]
    return dw.models.NoiseCovariance(Q, S, R), dense.Noise(Q, S, R)


@some.composite
def problems(draw):
    n, inputs = draw(some.integers(1, 4)), draw(some.integers(0, 3))
    st = dense.Structure(n, inputs, bool(inputs) and draw(some.booleans()))
    rng = np.random.default_rng(draw(some.integers(0, 2**32 - 1)))
    kind = draw(some.sampled_from(KINDS))
    noise, matrices = noise_of(kind, st, rng)
    y = rng.standard_normal(SAMPLES)
    y[rng.random(SAMPLES) < draw(some.sampled_from([0.0, 0.2]))] = np.nan
    u = rng.standard_normal((SAMPLES, inputs))
    parameters = st.size - n
    walk = draw(some.sampled_from([None, 1e-3, rng.uniform(0, 0.02, parameters)]))
    scale = draw(some.sampled_from([None, (2.5, 1.5)]))
    width = draw(some.sampled_from([1.0, 1.0, 1e-6]))  # the last is on both sides of what counts as settled
    s0, P0 = rng.standard_normal(st.size) * 0.3, covariance(rng, st.size) * width
    return Problem(st, noise, matrices, s0, P0, y, u, walk, scale), kind


def newest_first(st, q):
    """From Salut's order of the parameters (a_0.., b_0..) to the public one (a1.., b1..): blocks reversed."""
    if np.ndim(q) == 0:
        return q
    blocks = np.reshape(q[: st.n * (1 + st.inputs)], (-1, st.n))[:, ::-1]
    return np.concatenate([blocks.ravel(), q[blocks.size :]])


def estimator(problem, form, **options):
    st = problem.structure
    return dw.Joint(
        *(st.n, st.inputs, st.direct),
        noise=problem.noise,
        memory=dw.Constant() if problem.walk is None else dw.RandomWalk(newest_first(st, problem.walk)),
        scale=None if problem.scale is None else dw.models.InverseGamma(*problem.scale),
        **{"s0": problem.s0, "P0": problem.P0, "form": form, **options},
    )


def assert_follows_the_oracle(problem, form):
    p, est = problem, estimator(problem, form)
    expected = dense.run(
        p.structure, p.matrices, p.s0, p.P0, p.y, p.u, scale=p.scale, q=0.0 if p.walk is None else p.walk
    )
    state = est.start()
    for t in range(SAMPLES):
        sample = (p.y[t], p.u[t]) if p.structure.inputs else (p.y[t],)
        state, step = est.update(state, *sample)
        standard = np.sqrt(np.diag(expected.P[t]))
        assert np.all(np.abs(est.mean(state) - expected.s[t]) <= TOLERANCE * (standard + np.abs(expected.s[t])))
        assert np.all(np.abs(est.covariance(state) - expected.P[t]) <= TOLERANCE * np.outer(standard, standard))
        if np.isnan(p.y[t]):
            assert np.isnan(step.innovation)
            continue
        alpha, beta = expected.scale[t] if p.scale else (1.0, 1.0)
        T = expected.T[t] * beta / alpha
        assert abs(step.variance - T) <= TOLERANCE * T
        assert abs(step.innovation - expected.e[t]) <= TOLERANCE * (np.sqrt(T) + abs(expected.e[t]))
    assert abs(est.loglik(state) - expected.loglik) <= TOLERANCE * (1 + abs(expected.loglik))


def every_option_together(drawn):
    problem, kind = drawn
    for form in ["array", None] if kind == "full covariances" else ["array", "ud"]:
        assert_follows_the_oracle(problem, form)


@draws("examples", 25, 80)
def test_every_option_together(examples):
    settings(max_examples=examples, deadline=None, derandomize=True)(given(problems())(every_option_together))()


@pytest.mark.parametrize("form", ["ud", "array"])
def test_walk_stops_at_the_prior(form):
    """Without excitation a variance climbs back to its prior and stays there."""
    st, q = dense.Structure(2, 1, True), np.array([0.3, 0.0, 0.1, 0.2, 0.05])
    rng = np.random.default_rng(3)
    y, u = rng.standard_normal(SAMPLES), rng.standard_normal((SAMPLES, 1))
    y[10:], u[10:] = 0.0, 0.0
    _, matrices = noise_of("equation error", st, rng)
    noise = dw.models.EquationError(matrices.R)
    problem = Problem(st, noise, matrices, np.zeros(7), np.diag([1.0, 1, 2, 2, 1, 1, 1]), y, u, q, None)
    assert_follows_the_oracle(problem, form)
    est = estimator(problem, form)
    state = est.scan(y, u).state
    variances = np.diag(est.covariance(state))[2:]
    assert variances == pytest.approx([2, variances[1], 1, 1, 1], rel=1e-12)
    assert variances[1] < 2
    assert int(state["status"]) & dw.Status.CAPPED


@pytest.mark.parametrize("form", ["ud", "array"])
@pytest.mark.parametrize("gaps", ["no gaps", "outputs", "inputs"])
def test_a_certain_unknown_scale_is_a_known_scale(form, gaps):
    """With sigma2 all but given, relative covariances times sigma2 are the covariances, gaps included."""
    rng = np.random.default_rng(8)
    sigma2, certain = 0.25, 1e13
    y, u = rng.standard_normal(SAMPLES), rng.standard_normal((SAMPLES, 1))
    holes = [6, 13, 14, 21]
    y[holes if gaps == "outputs" else []] = np.nan
    u[holes if gaps == "inputs" else []] = np.nan
    known = dw.Joint(
        2, 1, True, noise=dw.models.EquationError(sigma2), P0=sigma2, memory=dw.RandomWalk(1e-3 * sigma2), form=form
    )
    scale = dw.models.InverseGamma(certain, certain * sigma2)
    unknown = dw.Joint(
        2, 1, True, noise=dw.models.EquationError(1.0), P0=1.0, scale=scale, memory=dw.RandomWalk(1e-3), form=form
    )
    expected, got = known.scan(y, u), unknown.scan(y, u)
    assert got.prediction == pytest.approx(expected.prediction, rel=TOLERANCE, abs=TOLERANCE)
    assert got.variance == pytest.approx(expected.variance, rel=TOLERANCE)
    assert unknown.mean(got.state) == pytest.approx(known.mean(expected.state), rel=TOLERANCE, abs=TOLERANCE)
    covariance = sigma2 * unknown.covariance(got.state)
    assert np.abs(covariance - known.covariance(expected.state)).max() <= TOLERANCE * np.abs(covariance).max()


@pytest.mark.parametrize("form", ["ud", "array"])
def test_gated_outlier_is_a_missing_sample(form):
    rng = np.random.default_rng(5)
    st = dense.Structure(2, 1, False)
    y, u = rng.standard_normal(SAMPLES), rng.standard_normal((SAMPLES, 1))
    noise, matrices = noise_of("equation error", st, rng)
    problem = Problem(st, noise, matrices, np.zeros(6), np.eye(6), y, u, 1e-3, None)
    spoiled, gap = y.copy(), y.copy()
    spoiled[17], gap[17] = 1e3, np.nan
    gated = estimator(problem, form, gate=dw.InnovationGate(sigmas=8.0, patience=5, settle=0))
    plain = estimator(problem, form)
    got, expected = gated.scan(spoiled, u), plain.scan(gap, u)
    assert got.status[17] & dw.Status.REJECTED
    assert np.array_equal(gated.mean(got.state), plain.mean(expected.state))
    assert np.array_equal(gated.covariance(got.state), plain.covariance(expected.state))
