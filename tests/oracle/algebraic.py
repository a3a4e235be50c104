"""Finite-memory estimation by brute force: dense least squares on z' = A z + B u, y = H z + noise.

The input is given as the state v of its own generator, u = first columns of B: z' = A z + B v, v' = G v. G = 0 is an
input held from one instant to the next; a sine is an oscillator. So transition and input integral are one matrix
exponential. The unknown is the state at the START of the window; a prior is a standard deviation of each state there
(infinite: none). NaN in y is missing. The `digits` of the exact version make conditioning no question.
"""

from typing import NamedTuple

import mpmath
import numpy as np
from scipy.linalg import cho_factor, cho_solve, expm

from .exact import long


class Estimate(NamedTuple):
    """Estimate and covariance of the state at the last instant."""

    z: np.ndarray
    P: np.ndarray

    @property
    def std(self):
        return np.sqrt(np.diag(self.P))


def transitions(A, B, G, t):
    """Phi (T-1, n, n) and input matrices (T-1, n, k) of each interval, one exponential for each different length."""
    n, k = B.shape
    M = np.zeros((n + k, n + k))
    M[:n, :n], M[:n, n:], M[n:, n:] = A, B, G
    steps, which = np.unique(np.round(np.diff(t), 14), return_inverse=True)
    E = np.array([expm(M * step) for step in steps]).reshape(-1, n + k, n + k)[which]
    return E[:, :n, :n], E[:, :n, n:]


def without_input(A, t):
    """A generator and its states where there is no input."""
    return np.zeros((len(A), 1)), np.zeros((1, 1)), np.zeros((len(t), 1))


def responses(A, B, G, t, v):
    """F (T, n, n) from the first instant to each, and what the input alone has done until then (T, n)."""
    Phi, Gamma = transitions(A, B, G, t)
    F, forced = [np.eye(len(A))], [np.zeros(len(A))]
    for k in range(len(t) - 1):
        F.append(Phi[k] @ F[-1])
        forced.append(Phi[k] @ forced[-1] + Gamma[k] @ v[k])
    return np.array(F), np.array(forced)


def window_estimate(A, H, t, y, sigma, *, B=None, G=None, v=None, prior=None):
    """Weighted least squares over all samples (orthogonal, columns scaled).

    y (T,) or (T, m); sigma a number or (m,); prior (n,) standard deviations at t[0], infinite where unknown; the prior
    mean is zero. v (T, k) are the states of the input's generator, G = 0 (held) if omitted.
    """
    A, H, t = np.asarray(A, float), np.asarray(H, float), np.asarray(t, float)
    if B is None:
        B, G, v = without_input(A, t)
    G = np.zeros((B.shape[1],) * 2) if G is None else G
    F, forced = responses(A, B, G, t, v)
    y = np.reshape(y, (len(t), len(H)))
    weight = 1 / np.broadcast_to(sigma, (len(t), len(H)))
    rows = (H @ F) * weight[..., None]
    target = (y - forced @ H.T) * weight
    seen = np.isfinite(target)
    rows, target = rows[seen], target[seen]
    if prior is not None:
        informed = np.isfinite(prior)
        rows = np.vstack([rows, np.diag(1 / np.asarray(prior, float))[informed]])
        target = np.concatenate([target, np.zeros(informed.sum())])
    scale = np.linalg.norm(rows, axis=0)
    Q, R = np.linalg.qr(rows / scale)
    z0, root = np.linalg.solve(R, Q.T @ target) / scale, np.linalg.inv(R) / scale[:, None]
    root = F[-1] @ root
    return Estimate(F[-1] @ z0 + forced[-1], root @ root.T)


def window_estimate_exact(A, H, t, y, sigma, *, B=None, G=None, v=None, prior=None, digits=60):
    """Return the same with `digits` digits, from the normal equations; rounded once at the end. One sigma."""
    with mpmath.workdps(digits):
        A = np.asarray(A)
        if B is None:
            B, G, v = without_input(A, t)
        n, k = np.shape(B)
        M = np.full((n + k, n + k), mpmath.mpf(0))
        M[:n, :n], M[:n, n:] = long(A), long(B)
        if G is not None:
            M[n:, n:] = long(G)
        t, v, H, y = long(t), long(v), long(H), np.reshape(y, (len(t), -1))
        F, forced, cache = long(np.eye(n)), long(np.zeros(n)), {}
        information, score = long(np.zeros((n, n))), long(np.zeros(n))
        for i in range(len(t)):
            if i:
                step = t[i] - t[i - 1]
                if step not in cache:
                    cache[step] = np.array(mpmath.expm(mpmath.matrix(M * step)).tolist(), dtype=object)
                E = cache[step]
                F, forced = E[:n, :n] @ F, E[:n, :n] @ forced + E[:n, n:] @ v[i - 1]
            for row, value in zip(H, y[i]):
                if np.isfinite(float(value)):
                    h = row @ F / mpmath.mpf(sigma)
                    information += np.outer(h, h)
                    score += h * ((mpmath.mpf(value) - row @ forced) / mpmath.mpf(sigma))
        if prior is not None:
            information += np.diag([1 / mpmath.mpf(s) ** 2 for s in prior])
        P0 = np.array(mpmath.inverse(mpmath.matrix(information)).tolist(), dtype=object)
        return Estimate((F @ (P0 @ score) + forced).astype(float), (F @ P0 @ F.T).astype(float))


def process_noise(A, walk, seconds):
    """Integral of exp(A s) W exp(A' s), W = diag(walk^2), by Van Loan; walk in units per square root of a second."""
    n = len(A)
    M = np.zeros((2 * n, 2 * n))
    M[:n, :n], M[:n, n:], M[n:, n:] = -A, np.diag(np.square(walk)), A.T
    E = expm(M * seconds)
    return E[n:, n:].T @ E[:n, n:]


def growing_estimates(A, H, t, y, sigma, walk, *, B=None, G=None, v=None, prior=None):
    """An `Estimate` at every instant from the samples so far, disturbances walking at random; None while undetermined.

    The joint Gaussian written out: y = O z0 + e, cov e dense, z(t) = F z0 + (accumulated noise). z0 is unknown (its
    prior is rows of the regression), the noise is predicted from the residuals.
    """
    A, H, t = np.asarray(A, float), np.asarray(H, float), np.asarray(t, float)
    if B is None:
        B, G, v = without_input(A, t)
    G = np.zeros((B.shape[1],) * 2) if G is None else G
    T, n, m = len(t), len(A), len(H)
    F, forced = responses(A, B, G, t, v)
    Phi, _ = transitions(A, B, G, t)
    noise = np.zeros((T, T, n, n))  # cov(w(i), w(j)) of the accumulated noise
    for i in range(1, T):
        noise[i, i] = Phi[i - 1] @ noise[i - 1, i - 1] @ Phi[i - 1].T
        noise[i, i] += process_noise(A, walk, t[i] - t[i - 1])
        for j in range(i):
            noise[i, j] = Phi[i - 1] @ noise[i - 1, j]
            noise[j, i] = noise[i, j].T
    y = np.reshape(y, (T, m))
    covariance = np.einsum("ai,stij,bj->satb", H, noise, H).reshape(T * m, T * m)
    covariance += np.diag(np.broadcast_to(np.square(sigma), (T, m)).ravel())
    cross = np.einsum("stij,bj->sitb", noise, H).reshape(T, n, T * m)
    O, target = (H @ F).reshape(T * m, n), (y - forced @ H.T).ravel()
    informed = np.zeros(n) if prior is None else np.where(np.isinf(prior), 0, 1 / np.square(prior))
    kept: list[Estimate | None] = []
    for k in range(T):
        seen = np.flatnonzero(np.isfinite(target[: (k + 1) * m]))
        information = np.diag(informed)
        if len(seen):
            V = cho_factor(covariance[np.ix_(seen, seen)])
            information = information + O[seen].T @ cho_solve(V, O[seen])
        scale = 1 / np.sqrt(np.maximum(np.diag(information), 1e-300))
        if np.linalg.eigvalsh(information * scale * scale[:, None])[0] < 1e-13:
            kept.append(None)
            continue
        P0 = np.linalg.inv(information * scale * scale[:, None]) * scale * scale[:, None]
        Fk, Pk, zk = F[k], noise[k, k], forced[k]
        if len(seen):
            c = cross[k][:, seen]
            weights = cho_solve(V, c.T).T
            z0 = P0 @ (O[seen].T @ cho_solve(V, target[seen]))
            zk = zk + Fk @ z0 + weights @ (target[seen] - O[seen] @ z0)
            Fk, Pk = Fk - weights @ O[seen], Pk - weights @ c.T
        kept.append(Estimate(zk, Pk + Fk @ P0 @ Fk.T))
    return kept


def two_window_parity(A, H, t, y, sigma, split, *, B=None, G=None, v=None):
    """Return d'(S^-1)d of two windows, samples before `split` and from it on: chi2 with n degrees without a change.

    d = zhat(new) - [zhat(old) carried to the last instant]; the data are disjoint, so S is the sum. Only without prior.
    """
    if B is None:
        B, G, v = without_input(np.asarray(A), t)
    old = window_estimate(A, H, t[:split], y[:split], sigma, B=B, G=G, v=v[:split])
    new = window_estimate(A, H, t[split:], y[split:], sigma, B=B, G=G, v=v[split:])
    F, forced = responses(A, B, np.zeros((B.shape[1],) * 2) if G is None else G, t[split - 1 :], v[split - 1 :])
    d = new.z - F[-1] @ old.z - forced[-1]
    S = new.P + F[-1] @ old.P @ F[-1].T
    return d @ np.linalg.solve(S, d), d, S


def polynomial_weights(L, degree, at, derivative=0):
    """Least-squares weights (L,) of the derivative at index `at`, per step: polynomials orthogonal on the points.

    Stieltjes recursion p(k+1) = (x - a) p(k) - b p(k-1) on the index scaled to [-1, 1]; the derivatives at `at` follow
    the same recursion, differentiated.
    """
    half = (L - 1) / 2
    x = (np.arange(L) - half) / half
    here = (at - half) / half
    p, before = np.ones(L), np.zeros(L)
    d, d_before = np.eye(1, derivative + 1)[0], np.zeros(derivative + 1)  # p(here), p'(here), ..
    weights, b = np.zeros(L), 0.0
    for _ in range(degree + 1):
        norm = p @ p
        weights += d[derivative] / norm * p
        a = (x * p) @ p / norm
        raised = (here - a) * d - b * d_before
        raised[1:] += np.arange(1, derivative + 1) * d[:-1]
        p_next = (x - a) * p - b * before
        b = (p_next @ p_next) / norm
        p, before, d, d_before = p_next, p, raised, d
    return weights / half**derivative
