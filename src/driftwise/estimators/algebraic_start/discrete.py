"""A continuous model at its samples: Salut's canonical parameters, and their exact slopes."""

from __future__ import annotations

import numpy as np

from ...models.canonical import Canonical
from .exponential import exponentials

TINY = 2.0**-300  # step of the complex derivative: nothing is subtracted, so it is exact


def sampled(a, b, dt: float, hold: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the coefficients a1..an and b0..bn of each input (k, n + 1) of the sampled model, analytic in a and b."""
    n, k = len(a), len(b)
    F = np.kron(np.eye(3, k=1), np.eye(n)).astype(np.result_type(a, float))  # x, what drives it, and how that slopes
    F[:n, :n] = np.eye(n, k=1)
    F[:n, 0] -= a
    F[:n] *= dt
    E = exponentials(F, np.ones(1))[0, :n]
    Phi, G, sloped = E[:, :n], E[:, n : 2 * n] @ b.T, E[:, 2 * n :] @ b.T
    direct = np.zeros(k, G.dtype)
    if hold == "foh":  # x - sloped u is a state that does not look ahead
        G, direct = G - sloped + Phi @ sloped, sloped[0]
    alpha, markov = _characteristic(Phi), [direct]
    for _ in range(n):
        markov.append(G[0])
        G = Phi @ G
    h = np.stack(markov)
    return alpha[1:], np.stack([sum(alpha[j] * h[i - j] for j in range(i + 1)) for i in range(n + 1)], axis=1)


def _characteristic(Phi) -> np.ndarray:
    """Return the coefficients of det(z - Phi), highest first (Faddeev and LeVerrier)."""
    n = len(Phi)
    c, M = [np.ones((), Phi.dtype)], np.zeros_like(Phi)
    for k in range(1, n + 1):
        M = Phi @ M + c[-1] * np.eye(n)
        c.append(-np.trace(Phi @ M) / k)
    return np.array(c)


def canonical(form: Canonical, values, dt: float, hold: str) -> np.ndarray:
    """Return the parameters of ``form`` (a1..an, b1..bn of each input, b0) from continuous a and b."""
    n = form.n
    a, b = sampled(values[:n], values[n : n * (form.inputs + 1)].reshape(form.inputs, n), dt, hold)
    return np.concatenate([a, b[:, 1:].ravel(), b[:, 0] if form.direct else b[:0, 0]])


def slopes(form: Canonical, values, dt: float, hold: str) -> np.ndarray:
    """Return the derivatives of `canonical` in the continuous parameters, by complex steps."""
    wanted = range(form.n * (form.inputs + 1))
    step = TINY * np.exp2(np.frexp(values)[1])  # powers of two: data in other units, the same digits
    columns = [canonical(form, values + 1j * step * (np.arange(len(values)) == i), dt, hold).imag for i in wanted]
    return np.stack(columns, axis=1) / step
