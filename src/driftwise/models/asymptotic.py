"""Where estimates settle under a wrong noise model, and how far they scatter there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..engine.errors import InputError
from .spectral import inside, noise_polynomial


@dataclass(frozen=True)
class WrongNoiseLimit:
    """Where the estimate of a settles when the noise polynomial is not the true one.

    Attributes
    ----------
    a : (m,)
        Limit a_0 .. a_{m-1} (Salut's order; the 1979 paper lists -a).
    prediction_variance : float
        Asymptotic variance of the one-step prediction error.
    covariance : (m, m)
        True covariance of the estimate, times the number of samples: divide by T. (M^-1 V M^-1, Gaussian noise.)
    reported : (m, m)
        What a filter that believes its noise model reports instead, times the number of samples.
    """

    a: np.ndarray
    prediction_variance: float
    covariance: np.ndarray
    reported: np.ndarray


def asymptotic_bias(a, d_true, d_assumed, var_v: float = 1.0) -> WrongNoiseLimit:
    """Return the limit of `Joint` with ``NoisePolynomial(d_assumed)`` on long records of A(q) y = C(q) v.

    Parameters
    ----------
    a, d_true : (n,)
        The true system in Salut's order: a_0 .. a_{n-1}, d_0 .. d_{n-1}.
    d_assumed : (m,)
        What the filter takes for d; its length is the order of the filter, which may differ from n.
    var_v : float
        Variance of v.

    Returns
    -------
    WrongNoiseLimit

    Raises
    ------
    InputError
        Where a zero of A, or of the assumed C, is not inside the circle.

    Notes
    -----
    The filter is least squares on y filtered by 1/C, so the limit solves the normal equations of that process; the
    long-run covariance of its score is summed by discrete Lyapunov equations. Bad at: short records (the covariance is
    asymptotic), and noise that is not Gaussian, whose kurtosis enters under a wrong model.

    Examples
    --------
    >>> limit = asymptotic_bias([-0.8], [0.5], [0.0])
    >>> print(limit.a.round(4), round(limit.prediction_variance, 4))
    [-0.8878] 1.2061
    """
    a, d_true = inside("a", a), noise_polynomial("d_true", d_true)
    d_assumed = inside("d_assumed", d_assumed)
    if len(d_true) != len(a):
        raise InputError(f"a and d_true must be of one order, got {len(a)} and {len(d_true)} coefficients")
    if not len(d_assumed):
        raise InputError("d_assumed is empty: its length is the order of the filter, zeros for C = 1")
    try:
        var_v = float(var_v)
    except (TypeError, ValueError):
        var_v = np.nan
    if not 0 < var_v < np.inf:
        raise InputError("var_v must be a positive finite variance")
    A, C, believed = (np.append(1.0, p[::-1]) for p in (a, d_true, d_assumed))
    m = len(d_assumed)
    den = np.convolve(A, believed)
    p = len(den) - 1
    F, g = companion(den)
    P = lyapunov(F, np.outer(g, g))
    # y_f(t-k), k = m..1, and y_f(t), as combinations of xi(t-1), .., xi(t-p), where den(q) xi = v
    psi = np.zeros((m, p))
    for row, k in enumerate(range(m, 0, -1)):
        psi[row, k - 1 : k + len(C) - 1] = -C
    now = output_row(C, den)
    M = psi @ P @ psi.T
    limit = np.linalg.solve(M, psi @ P @ now)
    residual = output_row(np.convolve(np.append(1.0, limit[::-1]), C), den)
    variance = residual @ P @ residual + 1
    h = F @ P @ residual + g  # covariance of the next state with the residual
    total = variance * M
    S = np.zeros((m, m))
    for j in range(m):
        X = lyapunov(F, np.outer(h, F @ P @ psi[j]))
        S[:, j] = psi @ (X + X.T) @ residual
    V = total + S + S.T
    inverse = np.linalg.inv(M)
    return WrongNoiseLimit(limit, float(var_v * variance), inverse @ V @ inverse, variance * inverse)


def companion(den):
    """State xi(t-1) .. xi(t-p) of den(q) xi = e: next state F x + g e."""
    p = len(den) - 1
    F = np.eye(p, k=-1)
    F[:1] = -den[1:]
    return F, np.eye(p, 1)[:, 0]


def output_row(num, den):
    """Row c with num(q) xi = c x + num[0] e on the state of `companion`."""
    num = np.append(num, np.zeros(len(den) - len(num)))
    return num[1:] - num[0] * den[1:]


def lyapunov(F, Q):
    from scipy.linalg import solve_discrete_lyapunov

    return solve_discrete_lyapunov(F, Q, method="direct" if len(F) <= 24 else None)
