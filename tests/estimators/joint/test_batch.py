"""One least squares against the recursion and against an oracle that shares no code with either."""

import tracemalloc

import numpy as np
import pytest
from oracle import dense, exact, golden

import driftwise as dw

A, B = [-1.5, 0.7], [1.0, 0.5]
C = (0.1, -0.6)
NOISES = [
    dw.models.EquationError(),
    dw.models.EquationError(0.01),
    dw.models.NoisePolynomial(C),
    dw.models.NoisePolynomial(C, 0.01),
]
COUNTERS = ["samples", "observed", "status", "in_a_row", "peak", "top"]
COUNTERS += ["held", "input_variance", "known", "sums", "squares", "steps"]


def record(samples, inputs=1, direct=False, seed=1):
    b = [B, [0.4, -0.2]][:inputs]
    y, u = dw.simulate(
        A,
        b or None,
        samples=samples,
        noise_std=0.1,
        d=C[::-1],
        direct=[0.3, 0.1][:inputs] if direct else None,
        seed=seed,
    )
    return (y, u) if inputs else (y,)


def assert_same(est, got, expected, tolerance):
    """Mean in standard deviations, covariance entry by entry relative to them, the rest relative."""
    P = est.covariance(expected)
    size = np.sqrt(np.diag(P))
    size = np.where(size > 0, size, 1.0)
    assert np.max(abs(est.mean(got) - est.mean(expected)) / np.maximum(size, 1e-3)) < tolerance
    assert np.max(abs(est.covariance(got) - P) / np.outer(size, size)) < tolerance
    for name in ("chi2", "logdet"):
        assert got[name] == pytest.approx(float(expected[name]), rel=tolerance)
    assert est.loglik(got) == pytest.approx(est.loglik(expected), rel=tolerance, nan_ok=True)
    assert est.sigma2(got) == pytest.approx(est.sigma2(expected), rel=tolerance)
    for name in COUNTERS:
        np.testing.assert_allclose(got[name], expected[name], rtol=1e-11, atol=1e-9)


@pytest.mark.parametrize("noise", NOISES, ids=repr)
@pytest.mark.parametrize("samples", [1, 5, 30, 31, 700, 100_000])
def test_state_is_the_recursions(noise, samples):
    data = record(samples, direct=True)
    est = dw.Joint(2, 1, True, noise=noise)
    got, expected = est.batch(*data), est.scan(*data, keep="innovations").state
    assert got.dtype == expected.dtype and got.shape == ()
    assert_same(est, got, expected, 1e-9)


@pytest.mark.parametrize(("order", "inputs", "direct"), [(1, 0, False), (2, 0, False), (3, 2, True), (4, 1, False)])
def test_every_shape(order, inputs, direct):
    data = record(3000, inputs, direct)
    rng = np.random.default_rng(order)
    d = np.poly(rng.uniform(-0.9, 0.9, order))[:0:-1]
    est = dw.Joint(order, inputs, direct, noise=dw.models.NoisePolynomial(tuple(d)))
    N = est.model.N
    root = rng.standard_normal((N, N)) / 3
    est = dw.Joint(
        order,
        inputs,
        direct,
        noise=dw.models.NoisePolynomial(tuple(d)),
        s0=rng.standard_normal(N) / 5,
        P0=root @ root.T,
    )
    assert_same(est, est.batch(*data), est.scan(*data, keep="innovations").state, 1e-9)


def test_state_is_the_ridge_regressions():
    """Parameters and their covariance from one dense least squares written elsewhere."""
    y, u = record(400)
    st = dense.Structure(2, 1)
    s0, P0 = np.linspace(-0.5, 0.5, 6), np.diag([1.0, 2, 3, 4, 5, 6])
    est = dw.Joint(2, 1, noise=dw.models.NoisePolynomial(C, 0.01), s0=s0, P0=P0)
    mean, covariance = exact.ridge(st, 0.01, s0, P0, y, u, C)
    state = est.batch(y, u)
    golden.assert_close(est.mean(state)[2:], mean[2:], 1e-10)
    golden.assert_close(est.covariance(state)[2:, 2:], covariance[2:, 2:], 1e-12)
    # and the state itself by the textbook recursion
    w = np.array([*C, 0, 0, 0, 0])
    run = dense.run(st, dense.Noise(np.outer(w, w) * 0.01, w * 0.01, 0.01), s0, P0, y, u[:, None])
    golden.assert_close(est.mean(state), run.s[-1], 1e-10)
    golden.assert_close(est.covariance(state), run.P[-1], 1e-12)
    assert est.loglik(state) == pytest.approx(run.loglik, rel=1e-11)


def test_goes_on_from_a_state_and_is_gone_on_from():
    y, u = record(2000)
    est = dw.Joint(2, 1, noise=dw.models.NoisePolynomial(C))
    state = est.scan(y[:800], u[:800]).state
    before = state.copy()
    state = est.batch(y[800:1500], u[800:1500], state=state)
    assert before == est.scan(y[:800], u[:800]).state  # the old state is left alone
    end = est.scan(y[1500:], u[1500:], state=state).state
    assert_same(est, end, est.scan(y, u).state, 1e-9)


def test_known_parameters_and_ill_conditioned_priors():
    y, u = record(500)
    theta = [0.7, -1.5, 0.5, 1.0]
    for P0 in ([1, 1, 0, 0, 0, 0], [1, 1, 0, 1, 1, 1], [1e12] * 6, [1e-12, 1, 1e6, 1e-6, 1, 1]):
        est = dw.Joint(2, 1, noise=dw.models.NoisePolynomial(C, 0.01), s0=[0, 0, *theta], P0=P0)
        assert_same(est, est.batch(y, u), est.scan(y, u).state, 1e-9)


def test_what_is_exact_stays_exact():
    """With an equation error x is a function of theta and the data: its D are zero, not small."""
    y, u = record(500)
    est = dw.Joint(2, 1)
    state = est.batch(y, u)
    assert np.all(state["D"][:2] == 0) and np.all(state["D"][2:] > 0)


def test_memory_is_that_of_the_record():
    est = dw.Joint(2, 1, noise=dw.models.NoisePolynomial(C))

    def peak(samples):
        y, u = np.ones(samples), np.sin(np.arange(samples))
        y = y + np.cos(0.7 * np.arange(samples) ** 1.1)
        est.batch(y[:200], u[:200])
        tracemalloc.start()
        est.batch(y, u)
        held = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return held / (8 * samples)

    assert peak(400_000) < 3  # columns, where the rows of the least squares would have seven


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (dict(noise=dw.models.OutputError()), "not OutputError; use scan"),
        (dict(noise=dw.models.NoiseCovariance(np.eye(2), [0, 0], 1.0)), "not NoiseCovariance; use scan"),
        (dict(memory=dw.RandomWalk(1e-6)), "stay constant"),
        (dict(gate=dw.InnovationGate()), "no gate"),
        (dict(noise=dw.models.EquationError(0.0)), "needs noise"),
        (dict(noise=dw.models.NoisePolynomial((0.5, 1.6))), "moduli.*minimum_phase.*scan does not mind"),
        (dict(noise=dw.models.NoisePolynomial((1.0, 0.0))), "inside the unit circle"),
    ],
)
def test_refuses_what_it_cannot_do(options, says):
    with pytest.raises(dw.InputError, match=says):
        dw.Joint(2, 1, **options).batch(*record(100))


def test_refuses_records_it_cannot_take():
    y, u = record(100)
    est = dw.Joint(2, 1)
    with pytest.raises(dw.InputError, match="samples are missing"):
        est.batch(np.where(np.arange(100) == 50, np.nan, y), u)
    with pytest.raises(dw.InputError, match="beyond 1e\\+100"):
        est.batch(np.where(np.arange(100) == 50, 1e200, y), u)
    with pytest.raises(dw.InputError, match="u was not given"):
        est.batch(y)
    with pytest.raises(dw.InputError, match="belongs to another estimator"):
        est.batch(y, u, state=dw.Joint(3, 1).start())
    with pytest.raises(dw.InputError, match="round-off of y"):
        dw.Joint(2, 1, noise=dw.models.EquationError(1e-12)).batch(1e8 * y, u)
    assert np.isfinite(dw.Joint(2, 1, noise=dw.models.EquationError(1e-12), floor=0.0).batch(1e8 * y, u)["theta"]).all()


def test_an_empty_record_changes_nothing():
    est = dw.Joint(2, 1)
    assert est.batch([], np.zeros((0, 1))) == est.start()
