"""The factors of P = U D U' against dense matrices, and against rational numbers where a digit decides."""

from fractions import Fraction

import numpy as np
import pytest

from driftwise.engine import ud


def factored(P):
    """U packed and D of a covariance, by Cholesky's factor of the matrix turned round."""
    L = np.linalg.cholesky(P[::-1, ::-1])[::-1, ::-1]
    scale = np.diag(L)
    return (L / scale)[ud.packed_indices(len(P))], scale**2


def dense(U, D):
    full = np.eye(len(D))
    for j in range(len(D)):
        for i in range(j):
            full[i, j] = U[j * (j - 1) // 2 + i]
    return full @ np.diag(D) @ full.T


def drawn(N, seed):
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((N, N + 2))
    return root @ root.T, rng


def rank(rows):
    """Rank of a matrix of rational numbers, by elimination without rounding."""
    rows, found = [[Fraction(x) for x in row] for row in rows], 0
    for column in range(len(rows[0])):
        pivot = next((i for i in range(found, len(rows)) if rows[i][column]), None)
        if pivot is None:
            continue
        rows[found], rows[pivot] = rows[pivot], rows[found]
        for i in range(found + 1, len(rows)):
            factor = rows[i][column] / rows[found][column]
            rows[i] = [x - factor * y for x, y in zip(rows[i], rows[found])]
        found += 1
    return found


def test_what_exact_measurements_tell_is_known_exactly():
    """A row that depends on the two below it: rounding leaves 1e-33 of it, and exactness takes that for nothing."""
    rng, leftover = np.random.default_rng(1), 0
    for _ in range(20):
        below = rng.integers(1, 9, (2, 5)).astype(float)
        Y = np.vstack([below[0] / 4 - 3 * below[1] / 8, below])  # without rounding in binary
        d = rng.integers(1, 5, 5).astype(float)
        assert rank(Y.tolist()) == 2
        P, found = Y @ np.diag(d) @ Y.T, {}
        for is_exact in (True, False):
            U, D = np.zeros(3), np.zeros(3)
            ud.orthogonalise(Y.copy(), d, np.zeros(5), 3, 5, U, D, is_exact)
            np.testing.assert_allclose(dense(U, D), P, rtol=1e-12, atol=1e-12 * P.max())
            found[is_exact] = D
        assert found[True][0] == 0.0 and (found[True][1:] > 0).all()
        leftover += found[False][0] > 0.0
    assert leftover > 5  # without it there would be nothing to take for nothing


def test_what_is_almost_exact_is_not_thrown_away():
    Y = np.array([[1.0, 1.0, 1e-9], [1.0, 1.0, 0.0]])
    U, D = np.zeros(1), np.zeros(2)
    ud.orthogonalise(Y, np.ones(3), np.zeros(3), 2, 3, U, D, True)
    assert D[0] == pytest.approx(1e-18, rel=1e-6) and D[1] == 2.0


@pytest.mark.parametrize("N, last, seed", [(1, 0, 0), (4, 3, 1), (5, 2, 2)])
def test_a_rank_one_update_is_the_sum(N, last, seed):
    P, rng = drawn(N, seed)
    U, D = factored(P)
    a = np.where(np.arange(N) <= last, rng.standard_normal(N), 0.0)
    ud.widen_along(U, D, a.copy(), 0.7, last)
    np.testing.assert_allclose(dense(U, D), P + 0.7 * np.outer(a, a), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("R", [0.3, 0.0])
def test_a_measurement_is_the_conditional_gaussian(R):
    P, rng = drawn(4, 3)
    U, D = factored(P)
    h, b = rng.standard_normal(4), np.zeros(4)
    f = np.zeros(4)
    ud.project(U, h, f)
    T = ud.correct(U, D, f, R, b)
    assert T == pytest.approx(h @ P @ h + R)
    np.testing.assert_allclose(b, P @ h, rtol=1e-12)
    np.testing.assert_allclose(dense(U, D), P - np.outer(P @ h, P @ h) / T, atol=1e-12)
    if R == 0.0:
        assert np.count_nonzero(D == 0.0) == 1  # one direction is known, without a digit of doubt


def test_what_was_known_stays_so_when_nothing_else_is_uncertain():
    """An exact column in front: the first informative one keeps its direction."""
    U, D = np.array([0.5, -0.25, 2.0]), np.array([0.0, 3.0, 0.0])
    P, h, b, f = dense(U, D), np.array([1.0, 2.0, -1.0]), np.zeros(3), np.zeros(3)
    ud.project(U, h, f)
    T = ud.correct(U, D, f, 0.0, b)
    np.testing.assert_allclose(b, P @ h)
    np.testing.assert_allclose(dense(U, D), P - np.outer(P @ h, P @ h) / T, atol=1e-15)
    assert D.tolist() == [0.0, 0.0, 0.0]


def test_packed_factors_of_a_singular_matrix_are_exactly_singular():
    """The pivot that is left is round-off, and its column would be noise divided by noise."""
    rng = np.random.default_rng(5)
    for _ in range(20):
        root = rng.standard_normal((4, 2))
        P = root @ root.T
        packed = np.array([P[i, j] for j in range(4) for i in range(j + 1)])
        U, D = np.zeros(6), np.zeros(4)
        ud.factor_within(packed.copy(), U, D)
        assert np.count_nonzero(D) == 2
        np.testing.assert_allclose(dense(U, D), P, atol=1e-12)
        again = np.zeros(10)
        ud.expand(U, D, again)
        np.testing.assert_allclose(again, packed, atol=1e-12)


def test_variances_are_the_diagonal():
    P, _ = drawn(5, 7)
    U, D = factored(P)
    p = np.zeros(5)
    ud.variances(U, D, p)
    np.testing.assert_allclose(p, np.diag(P), rtol=1e-12)
    assert ud.variance(U, D, 2) == pytest.approx(P[2, 2], rel=1e-12)
    marginal = np.zeros(3)
    ud.marginal(U, 2, 3, marginal)
    np.testing.assert_allclose(dense(marginal, D[2:]), P[2:, 2:], rtol=1e-12, atol=1e-12)
    q, f, psi = np.zeros(5), np.zeros(5), np.arange(1.0, 6.0)
    ud.project(U, psi, f)
    ud.covariances(U, D, f, q)
    np.testing.assert_allclose(q, P @ psi, rtol=1e-12)


def test_a_covariance_of_low_rank_is_factored_whatever_its_units_and_its_rounding():
    rng = np.random.default_rng(0)
    for _ in range(300):
        n = rng.integers(2, 7)
        root = rng.standard_normal((n, rng.integers(1, n + 1))) * 10.0 ** rng.integers(-6, 6, (n, 1))
        P = rng.uniform(0.5, 2) * (root @ root.T)
        U, D = ud.factor(P)
        assert (D >= 0).all()
        size = np.sqrt(np.diag(P))
        np.testing.assert_allclose((U * D) @ U.T / np.outer(size, size), P / np.outer(size, size), atol=1e-13)
    for wrong in ([[1.0, 1.0 + 1e-9], [1.0 + 1e-9, 1.0]], [[0.0, 1e-3], [1e-3, 1.0]], [[-1e-9, 0.0], [0.0, 1.0]]):
        with pytest.raises(ValueError, match="negative eigenvalue"):
            ud.factor(np.array(wrong))
