"""The noise of several outputs: covariances of (w, w_n), factored for the kernel, and whether outputs separate."""

from typing import NamedTuple

import numpy as np

from ..engine import ud
from ..engine.dispatch import Vector
from ..engine.errors import InputError
from .noise import EquationError, NoiseCovariance, NoisePolynomial, OutputError


class Stacked(NamedTuple):
    """What the kernel sees: w_n = W v, w = kappa v + G xi, with independent v of variance R and xi of variance 1.

    ``W`` (p, p) is unit upper triangular, ``kappa`` (n, p), ``G`` the columns of each group of outputs in turn.
    """

    R: Vector
    W: Vector
    kappa: Vector
    G: Vector
    G_at: Vector


def covariances(noise, form, units) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return Q (n, n), S (n, p), R (p, p) in the kernel's order; ``units`` are R where the variance is to be learnt."""
    p, n = form.outputs, form.n
    if isinstance(noise, OutputError):
        raise InputError(
            "OutputError is not for several outputs. Run Joint(order, inputs, noise=OutputError()) on each output by "
            "itself, or give what is known of the disturbances as NoiseCovariance(Q, S, R)"
        )
    if isinstance(noise, NoiseCovariance):
        return _given(noise, form)
    if not isinstance(noise, EquationError | NoisePolynomial):
        raise InputError(
            "noise must be EquationError(), NoisePolynomial((d^1, .., d^p)) or NoiseCovariance(Q, S, R), "
            f"got {noise!r}; were the brackets forgotten?"
        )
    R = units if noise.variance is None else _variances(noise.variance, p)
    d = np.zeros((n, p))
    if isinstance(noise, NoisePolynomial):
        for i, column in enumerate(_polynomials(noise.d, form)):
            d[form.x_at[i] : form.x_at[i + 1], i] = column[::-1]
    return d * R @ d.T, d * R, np.diag(R)


def _variances(value, p) -> np.ndarray:
    try:
        R = np.asarray(value, float)
    except (TypeError, ValueError):
        R = np.full(0, np.nan)
    if R.shape not in ((), (p,)) or not np.all((R >= 0) & np.isfinite(R)):
        raise InputError(
            f"noise variance must be a number, or {p} (one per output), finite and not negative: {value!r}"
        )
    return np.full(p, R) if R.ndim == 0 else R


def _polynomials(d, form) -> list[np.ndarray]:
    """Return d^i (nu_i,) of each output; with one output d itself may be the list."""
    try:
        lists = (
            [np.asarray(d, float)] if form.outputs == 1 and np.ndim(d[0]) == 0 else [np.asarray(v, float) for v in d]
        )
    except (TypeError, ValueError, IndexError):
        lists = []
    shapes = [(nu,) for nu in form.nu]
    if [v.shape for v in lists] != shapes or not all(np.isfinite(v).all() for v in lists):
        raise InputError(
            f"d must list, for each of the {form.outputs} outputs, its nu_i = {form.nu} finite coefficients "
            f"d_0 .. d_(nu_i - 1); got {d!r}"
        )
    return lists


def _given(noise, form):
    p, n = form.outputs, form.n
    try:
        Q, S, R = (np.asarray(v, float) for v in noise)
    except (TypeError, ValueError):
        raise InputError(f"Q, S and R must hold numbers, got {noise!r}") from None
    if p == 1 and S.shape == (n,):
        S = S[:, None]
    if p == 1 and R.ndim == 0:
        R = R[None, None]
    if (Q.shape, S.shape, R.shape) != ((n, n), (n, p), (p, p)):
        raise InputError(
            f"Q must be ({n}, {n}), S ({n}, {p}) and R ({p}, {p}) for the stacked states and outputs; "
            f"got {Q.shape}, {S.shape} and {R.shape}. (Noise on the parameters is memory=RandomWalk(q).)"
        )
    if not all(np.isfinite(v).all() for v in (Q, S, R)) or not np.allclose(Q, Q.T) or not np.allclose(R, R.T):
        raise InputError("Q, S and R must be finite, Q and R symmetric")
    back = form.salut[:n]
    return Q[np.ix_(back, back)], S[back], R


def separates(P, owner) -> bool:
    """Say whether no entry of a covariance links unknowns of different outputs; ``owner`` names each one's output."""
    return not np.any(P[owner[:, None] != owner])


def factor(Q, S, R, form, groups) -> Stacked:
    """Return the kernel's policy; ``groups`` lists the outputs that are filtered together."""
    p, n = form.outputs, form.n
    diagonal, W, kappa, columns, at = np.zeros(p), np.eye(p), np.zeros((n, p)), [], [0]
    for group in groups:
        x = np.arange(form.x_at[group[0]], form.x_at[group[-1] + 1])
        joint = np.block([[Q[np.ix_(x, x)], S[np.ix_(x, group)]], [S[np.ix_(x, group)].T, R[np.ix_(group, group)]]])
        try:
            U, D = ud.factor(joint)
        except ValueError:
            raise InputError(
                "[[Q, S], [S', R]] has a negative eigenvalue, so it is no covariance: S must satisfy "
                "Q - S R^-1 S' >= 0 (and S = 0 where R = 0). Were standard deviations given for R?"
            ) from None
        m = len(x)
        diagonal[group], W[np.ix_(group, group)], kappa[np.ix_(x, group)] = D[m:], U[m:, m:], U[:m, m:]
        G = (U[:m, :m] * np.sqrt(D[:m]))[:, D[:m] > 0]
        columns.append(G.T.ravel())
        at.append(at[-1] + G.size)
    return Stacked(diagonal, W.ravel(), kappa.ravel(), np.concatenate(columns), np.array(at, float))
