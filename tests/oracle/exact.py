"""Oracles of other kinds: exact or long arithmetic, batch least squares, quadrature over a."""

from fractions import Fraction

import mpmath
import numpy as np

from . import dense


def rational(values):
    """Object array of exact fractions; decimals given as strings stay decimals."""
    return np.vectorize(Fraction, otypes=[object])(np.asarray(values, dtype=object))


def long(values):
    """Object array of mpmath numbers with the digits in force (`with mpmath.workdps(60): ...`)."""
    return np.vectorize(mpmath.mpf, otypes=[object])(np.asarray(values, dtype=object))


def final(st, noise, s, P, y, u=None, *, digits=60):
    """Last s(t+1 | t), its covariance, and every T(t), in `digits` digits and rounded once at the end."""
    with mpmath.workdps(digits):
        noise = dense.Noise(long(noise.Q), long(noise.S), mpmath.mpf(noise.R))
        s, P, y = long(s), long(P), long(y)
        u = long(np.zeros((len(y), 0)) if u is None else np.reshape(u, (len(y), st.inputs)))
        variances = []
        for t in range(len(y)):
            s, P, _, T, _ = dense.step(st, noise, s, P, y[t], u[t])
            variances.append(T)
        return s.astype(float), P.astype(float), np.array(variances, dtype=float)


def filtered(d, signal):
    """`signal / C` from rest, C(q) = 1 + d_{n-1} q^-1 + .. + d_0 q^-n."""
    n, out = len(d), np.zeros(len(signal))
    for t in range(len(signal)):
        out[t] = signal[t] - sum(d[n - k] * out[t - k] for k in range(1, min(n, t) + 1))
    return out


def regressors(st, y, u=None, d=None):
    """Rows of section 1.4 on [x(0) ; r], and the target, after prefiltering y and u by 1/C (section 7.9).

    y_f(t) = [impulse response of x(0)] + sum_k (-a_{n-k} y_f(t-k) + b_{n-k} u_f(t-k)) + b_n u_f(t) + v(t)
    """
    n, T = st.n, len(y)
    d = np.zeros(n) if d is None else np.asarray(d)
    u = np.zeros((T, 0)) if u is None else np.reshape(u, (T, st.inputs))

    def lagged(signal, k):
        return np.concatenate([np.zeros(min(k, T)), signal[: max(T - k, 0)]])

    impulse = filtered(d, np.eye(1, T)[0])
    y_f, u_f = filtered(d, y), [filtered(d, column) for column in u.T]
    columns = [lagged(impulse, n - 1 - i) for i in range(n)]
    columns += [-lagged(y_f, n - i) for i in range(n)]
    columns += [lagged(column, n - i) for column in u_f for i in range(n)]
    columns += u_f if st.direct else []
    return np.column_stack(columns), y_f


def ridge(st, R, s0, P0, y, u=None, d=None):
    """Posterior mean and covariance of [x(0) ; r]: one least squares by QR, penalty R P0^-1."""
    X, target = regressors(st, y, u, d)
    root = np.linalg.inv(np.linalg.cholesky(P0))
    rows = np.vstack([X / np.sqrt(R), root])
    Qm, Rm = np.linalg.qr(rows)
    inverse = np.linalg.inv(Rm)
    return inverse @ (Qm.T @ np.concatenate([target / np.sqrt(R), root @ s0])), inverse @ inverse.T


def evidence_by_quadrature(y, d, var_v, s0, P0, nodes=120):
    """log p(y), n = 1 without input: given a an ordinary Kalman filter, then a numerical integral over a."""
    (x0, a0), (Px, Pa) = s0, np.diag(P0)
    points, weights = np.polynomial.hermite_e.hermegauss(nodes)
    a = a0 + np.sqrt(Pa) * points
    x, P, loglik = np.full(nodes, x0), np.full(nodes, Px), np.zeros(nodes)
    Q, S, R = d * d * var_v, d * var_v, var_v
    for y_t in y:
        T, e = P + R, y_t - x
        loglik += -0.5 * (np.log(2 * np.pi * T) + e * e / T)
        x, P = -a * y_t + S / T * e, Q - S * S / T
    return np.log(weights @ np.exp(loglik) / weights.sum())
