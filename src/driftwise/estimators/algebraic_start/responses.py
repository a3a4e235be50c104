"""Exact responses of A(p) y = B(p) u + d between samples, and their slopes in A."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from .exponential import exponentials


class Plan(NamedTuple):
    """What does not change while a is sought: instants, inputs, and what is linear."""

    n: int
    m: int
    steps: np.ndarray  # (1,) where all are alike, else (T - 1,)
    which: np.ndarray  # (T - 1,) index of each step's kind
    u: np.ndarray  # (T, k)
    hold: str
    S: np.ndarray  # w' = S w, d = w summed over ``shown``: the disturbance
    shown: np.ndarray
    drifts: int  # terms of its polynomial, the first in w

    @property
    def columns(self) -> int:
        """How many unknowns are linear: b of each input, x(0), and the disturbance's amplitudes."""
        return self.u.shape[1] * (self.m + 1) + self.n + len(self.S)


def plan(t, u, n: int, m: int, hold: str, degree: int, frequencies) -> Plan:
    """Return what the responses need; instants that are regular but for round-off count as regular."""
    h = np.diff(t)
    is_regular = np.all(abs(h - h.mean()) <= 1e-9 * h.mean())
    steps, which = (np.array([h.mean()]), np.zeros(len(h), int)) if is_regular else np.unique(h, return_inverse=True)
    drifts = [np.eye(degree + 1, k=1)] if degree >= 0 else []
    S = block_diag(*drifts, *(w * np.array([[0.0, 1.0], [-1.0, 0.0]]) for w in frequencies))
    S = S if drifts or len(frequencies) else np.zeros((0, 0))
    shown = np.zeros(len(S))
    shown[[0] * (degree >= 0) + [degree + 1 + 2 * i for i in range(len(frequencies))]] = 1.0
    return Plan(n, m, steps, which, u, hold, S, shown, degree + 1)


def responses(plan: Plan, a) -> tuple[np.ndarray, np.ndarray]:
    """Return Z (T, d, c): the state [x; w; v] of each linear unknown alone, and Phi of each kind of step.

    x' = (E - a e_1')x + B u + e_n d and y = x_1. v is the chain of A(p) v = y: the slope of y in a_i is -v_(n-i+1),
    times whatever the linear unknowns are.
    """
    n, p, k, m = plan.n, len(plan.S), plan.u.shape[1], plan.m
    d, inputs = 2 * n + p, m + 1
    F = np.zeros((d, d))
    F[:n, :n] = np.eye(n, k=1)
    F[:n, 0] -= a
    F[n - 1, n : n + p] = plan.shown
    F[n : n + p, n : n + p] = plan.S
    F[n + p :, n + p :] = np.eye(n, k=1)
    F[-1, n + p :] -= a[::-1]
    F[-1, 0] = 1.0
    wide = np.zeros((d + 2 * inputs, d + 2 * inputs))  # value of an input, and its slope
    wide[:d, :d] = F
    wide[range(n - inputs, n), range(d, d + inputs)] = 1.0
    wide[range(d, d + inputs), range(d + inputs, d + 2 * inputs)] = 1.0
    E = exponentials(wide, plan.steps)[:, :d]
    Phi, held, sloped = E[..., :d], E[..., d : d + inputs], E[..., d + inputs :] / plan.steps[:, None, None]

    u, which = plan.u, plan.which
    Z = np.zeros((len(u), d, k * inputs + n + p))
    Z[0, : n + p, k * inputs :] = np.eye(n + p)
    for l in range(k):
        at = slice(l * inputs, (l + 1) * inputs)
        Z[1:, :, at] = held[which] * u[:-1, l, None, None]
        if plan.hold == "foh":
            Z[1:, :, at] += sloped[which] * np.diff(u[:, l])[:, None, None]
    add_up(Z, Phi, which)
    return Z, Phi


def add_up(Z, Phi, which) -> None:
    """Z[k] <- Z[k] + Phi[k-1] Z[k-1], all k, by doubling: after log2(T) sweeps each holds everything before it."""
    M = Phi[0] if len(Phi) == 1 else np.concatenate([np.zeros_like(Phi[:1]), Phi[which]])
    reach = 1
    while reach < len(Z):
        if M.ndim == 2:
            Z[reach:] = Z[reach:] + M @ Z[:-reach]
            M = M @ M
        else:
            Z[reach:] = Z[reach:] + M[reach:] @ Z[:-reach]
            M[reach:] = M[reach:] @ M[:-reach]
        reach *= 2
