"""Theorem 3 (Salut, Aguilar, Favier, Alengrin 1979, corrected) as a textbook writes it: full matrices.

    x(t+1) = E x(t) - a y(t) + b u(t) + w(t),    y(t) = x_n(t) + b_n u(t) + w_n(t)
    s = [x_1..x_n ; a_0..a_{n-1} ; b_0..b_{n-1} of each input ; b_n of each input]
    Q = cov [w ; walk of r] (N, N),  S = its covariance with w_n (N,),  R = var w_n

`s` and `P` are always the moments of s(t | t-1), the one-step predictor. `step` works on float64 and equally
on object arrays of `fractions.Fraction` or `mpmath.mpf`. Slow and, in float64, fragile for huge priors: an
oracle, not an engine.
"""

from math import lgamma
from typing import NamedTuple

import numpy as np

SETTLED = 1e-6  # variance of a below which the filter of an output error leaves out the spread T P_aa


class Structure(NamedTuple):
    """Order, number of inputs, and whether the inputs reach y directly."""

    n: int
    inputs: int = 0
    direct: bool = False

    @property
    def size(self):
        return self.n * (2 + self.inputs) + self.inputs * self.direct


class Noise(NamedTuple):
    Q: np.ndarray
    S: np.ndarray
    R: float


class OutputError(NamedTuple):
    """White noise of variance R on y alone; the state follows the undisturbed x_n, so it multiplies a."""

    R: float


class Step(NamedTuple):
    s: np.ndarray
    P: np.ndarray
    e: float
    T: float
    K: np.ndarray


class Run(NamedTuple):
    """Per sample: e, T, K, s(t+1|t), P(t+1|t); before each sample: alpha, beta; and the log evidence."""

    e: list
    T: list
    K: list
    s: list
    P: list
    scale: list
    loglik: float


def transition(st, y, u):
    n, directs = st.n, st.inputs * st.direct
    E, I = np.eye(n, k=-1, dtype=int), np.eye(n, dtype=int)
    columns_a = [I * -y]
    columns_b = [I * u_j for u_j in u]
    G = np.hstack(columns_a + columns_b + [np.zeros((n, directs), int)])
    lower_block = np.eye(G.shape[1], dtype=int)
    return np.block([[E, G], [np.zeros_like(G.T), lower_block]])


def row(st, u):
    directs = list(u) if st.direct else []
    return np.array([0] * (st.n - 1) + [1] + [0] * (st.size - st.n - len(directs)) + directs)


def step(st, noise, s, P, y, u):
    """Section 1.5: one measured sample."""
    Q, S, R = noise
    F, H = transition(st, y, u), row(st, u)
    T = H @ P @ H + R
    e = y - H @ s
    L = F @ P @ H + S
    K = L / T if T > 0 else 0 * L
    s_next = F @ s + K * e
    P_next = F @ P @ F.T + Q - np.outer(K, K) * T
    return Step(s_next, P_next, e, T, K)


def missing_step(st, noise, s, P, u, sigma2=1.0, settled=0.0):
    """Section 7.1: exact first two moments of s(t+1) when y(t) is missing.

    `sigma2` matters only when P, Q, S, R are relative to it: a product of two covariances carries it twice.
    Below the variance `settled` of every a, the spread T P_aa of the product is left out.
    """
    Q, S, R = noise
    n, N = st.n, st.size
    x, a = slice(0, n), slice(n, 2 * n)
    H = row(st, u)
    T, y_hat, c = H @ P @ H + R, H @ s, (P @ H)[a]
    F = transition(st, y_hat, u)
    B = np.concatenate([-s[a], np.zeros(N - n)])
    A = F + np.outer(B, H)
    s_next = F @ s
    s_next[x] -= c * sigma2
    P_next = A @ P @ A.T + Q + np.outer(B, S) + np.outer(S, B) + np.outer(B, B) * R
    spread = T * P[a, a] if sigma2 * np.diag(P)[a].max() >= settled else 0
    P_next[x, x] += (spread + np.outer(c, c)) * sigma2
    return s_next, P_next


def output_error_step(st, R, s, P, y, u, sigma2=1.0):
    """Correct with y, then move the simulation model x+ = E x - a (H s) + b u: exact moments of a Gaussian s(t | t).

    The noise on y never enters x, so a missing y (NaN) only skips the correction.
    """
    H = row(st, u)
    T, e, K = H @ P @ H + R, y - H @ s, np.zeros(st.size)
    if y == y:
        K = P @ H / T
        s, P = s + K * e, P - np.outer(K, K) * T
    silent = Noise(np.zeros((st.size, st.size)), np.zeros(st.size), 0.0)
    return Step(*missing_step(st, silent, s, P, u, sigma2, SETTLED), e, T, K)


def walk(st, P, q, P0):
    """Random walk of the parameters, each held at its prior variance: no wind-up without excitation."""
    room = np.diag(P0 - P)[st.n :]
    P = P.copy()
    P[range(st.n, st.size), range(st.n, st.size)] += np.minimum(q, np.maximum(0.0, room))
    return P


def gaussian(e, T):
    return -0.5 * (np.log(2 * np.pi * T) + e * e / T)


def student(e, T, alpha, beta):
    """Section 7.4: log density of e when e | sigma2 ~ N(0, sigma2 T), sigma2 ~ IG(alpha, beta)."""
    tail = (alpha + 0.5) * np.log1p(e * e / (2 * beta * T))
    return lgamma(alpha + 0.5) - lgamma(alpha) - 0.5 * np.log(2 * np.pi * beta * T) - tail


def run(st, noise, s, P, y, u=None, *, scale=None, q=None):
    """A record, NaN where y is missing; with `scale=(alpha, beta)` all is relative to sigma2 ~ IG.

    `noise` is a `Noise` or an `OutputError`, whose K is the gain of the correction, not of the predictor.
    """
    u = np.zeros((len(y), 0)) if u is None else np.asarray(u).reshape(len(y), st.inputs)
    alpha, beta = scale or (None, None)
    P0, loglik, rows = P, 0.0, []
    for t in range(len(y)):
        before, sigma2 = (alpha, beta), beta / alpha if scale else 1.0
        if isinstance(noise, OutputError):
            s, P, e, T, K = output_error_step(st, noise.R, s, P, y[t], u[t], sigma2)
        elif y[t] == y[t]:
            s, P, e, T, K = step(st, noise, s, P, y[t], u[t])
        else:
            s, P = missing_step(st, noise, s, P, u[t], sigma2)
            e, T, K = float("nan"), float("nan"), np.zeros(st.size)
        if y[t] == y[t]:
            if scale:
                loglik += student(e, T, alpha, beta)
                alpha, beta = alpha + 0.5, beta + e * e / (2 * T)
            elif T > 0:
                loglik += gaussian(e, T)
        if q is not None:
            P = walk(st, P, q, P0)
        rows.append((e, T, K, s, P, before))
    return Run(*(list(column) for column in zip(*rows, strict=True)), loglik)


def smooth(st, noise, s, P, y, u):
    """Section 7.6: modified Bryson-Frazier, s(t | all samples) and its covariance, for a complete record."""
    forward = run(st, noise, s, P, y, u)
    before = list(zip([s, *forward.s], [P, *forward.P], strict=True))
    lam, Lam, out = np.zeros(st.size), np.zeros((st.size, st.size)), []
    for t in reversed(range(len(y))):
        H, (s, P) = row(st, u[t]), before[t]
        A = transition(st, y[t], u[t]) - np.outer(forward.K[t], H)
        lam = H * forward.e[t] / forward.T[t] + A.T @ lam
        Lam = np.outer(H, H) / forward.T[t] + A.T @ Lam @ A
        out.append((s + P @ lam, P - P @ Lam @ P))
    means, covariances = zip(*reversed(out), strict=True)
    return means, covariances
