"""The offset of `Joint`: against dense least squares, against a constant input, wherever zero is."""

import numpy as np
import pytest

import driftwise as dw


def record(samples=300, seed=1, **options):
    return dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=samples, noise_std=0.1, seed=seed, **options)


def test_it_is_one_more_column_of_ones():
    """Least squares of y on its lags, u's, ones and, for the first samples, the state: prior and all, in one go."""
    y, u = record(noise="equation")
    y, u, R, P0 = y + 7.0, u - 3.0, 0.01, np.array([5.0, 4.0, 1.0, 2.0, 3.0, 2.5, 9.0])  # Salut's order, offset last
    est = dw.Joint(2, 1, offset=True, noise=dw.models.EquationError(R), P0=P0)
    trace = est.scan(y, u)
    past = np.concatenate([[0.0, 0.0], y]), np.concatenate([[0.0, 0.0], u])
    lags = [-past[0][1:-1], -past[0][:-2], past[1][1:-1], past[1][:-2]]
    X = np.column_stack([np.eye(len(y))[:, :2], *lags, np.ones(len(y))])
    prior = np.array([4.0, 5.0, 2.0, 1.0, 2.5, 3.0, 9.0])  # measured state first, lags upwards
    P = np.linalg.inv(np.diag(1 / prior) + X.T @ X / R)
    np.testing.assert_allclose(trace.parameters[-1], (P @ X.T @ y / R)[2:], rtol=1e-8)
    np.testing.assert_allclose(trace.parameters_std[-1], np.sqrt(np.diag(P))[2:], rtol=1e-7)


@pytest.mark.parametrize("noise", [dw.models.UnknownPolynomial, dw.models.OutputError, dw.models.EquationError])
def test_it_is_the_direct_term_of_a_constant_input(noise):
    """An input that is 1 and acts at once only, its other coefficients known to be zero, is the same number."""
    y, u = record(missing=0.1)
    noise, one_P0 = noise(variance=0.01), np.full(8 + 2 * (noise is dw.models.UnknownPolynomial), 10.0)
    est = dw.Joint(2, 1, direct=True, offset=True, noise=noise, P0=one_P0)
    two = dw.Joint(2, 2, direct=True, noise=noise, P0=np.insert(one_P0, 6, [0.0, 0.0]))  # behind x, a and b
    one, other = est.scan(y, u), two.scan(y, np.column_stack([u, np.ones(len(u))]))
    np.testing.assert_allclose(one.prediction, other.prediction, rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(one.parameters[-1, -1], other.parameters[-1, -1], rtol=1e-6)


def test_where_zero_is_does_not_matter():
    """With the prior out of the way model and predictions are those of the record without the offset."""
    y, u = record(2000)
    wide = dict(noise=dw.models.EquationError(0.01), P0=1e8)
    here = dw.Joint(2, 1, offset=True, **wide).scan(y, u)
    there = dw.Joint(2, 1, offset=True, **wide).scan(y + 40.0, u - 20.0)
    np.testing.assert_allclose(here.prediction[50:] + 40.0, there.prediction[50:], atol=1e-3)
    np.testing.assert_allclose(here.model().dc_gain, there.model().dc_gain, rtol=1e-4)
    moved = 40.0 * here.parameters[-1, :2].sum() + 40.0 + 20.0 * here.parameters[-1, 2:4].sum()
    assert there.parameters[-1, -1] - here.parameters[-1, -1] == pytest.approx(moved, rel=1e-3)


def test_the_smoother_knows_it_and_the_model_does_not():
    y, u = record(200)
    est = dw.Joint(2, 1, offset=True, memory=dw.RandomWalk([0, 0, 0, 0, 1e-3]))
    smoothed, trace = est.smooth(y + 5.0, u), est.scan(y + 5.0, u)
    np.testing.assert_allclose(smoothed.parameters[-1], trace.parameters[-1], rtol=1e-9)
    assert smoothed.parameters_std[100, -1] < trace.parameters_std[100, -1]
    assert trace.model().names == ["a1", "a2", "b1", "b2"] and trace.names[-1] == "offset"
    assert "offset" in [name for name, *_ in trace.summary().parameters]


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda: dw.Joint(1, offset=True).batch(np.ones(9)), "no column for an offset"),
        (lambda: dw.Joint(1, 1, offset=True, noise=dw.models.OutputError(), start="algebraic"), "without an offset"),
        (lambda: dw.Joint(1, offset="yes"), "offset must be"),
    ],
)
def test_what_it_does_not_go_with_is_said(call, words):
    with pytest.raises(dw.InputError, match=words):
        call()
