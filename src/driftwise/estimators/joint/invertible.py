"""An unknown noise polynomial must stay invertible: its zeros are drawn back inside, all else moves with them."""

import math

from ...engine.dispatch import choice, rare
from ...engine.ud import entry
from ...models.noise import Coloured, Sensor, Unknown, White
from ...models.stability import is_inside, shrink_inside
from .row import MEMO


@choice
def restrain(noise, state, scratch):
    """Move s to where the noise allows it to be."""


@restrain.on(White, Sensor, Coloured)
def restrain_white(noise, state, scratch):
    pass


@restrain.on(Unknown)
def restrain_unknown(noise, state, scratch):
    first, n = scratch.n * (scratch.inputs + 2), scratch.n
    for i in range(n):
        scratch.memo[MEMO + i] = 0.0
    if not is_inside(state.s[first : first + n], noise.radius, scratch.c, scratch.kappa):
        draw_back(noise, state, scratch, first)


@rare
def draw_back(noise, state, scratch, first):
    """s += P[:, d] P_dd^-1 delta: the posterior mean, were d known to be delta away from its estimate.

    What x, a and b owe to the old d goes with it. ``memo`` takes P_dd^-1 delta for the smoother.
    """
    s, U, D, n = state.s, state.U, state.D, scratch.n
    N, d, w, P, old = D.size, s[first : first + n], scratch.memo[MEMO:], scratch.Y, scratch.g
    for i in range(n):
        old[i] = d[i]
    shrink_inside(d, noise.radius, scratch.c, scratch.kappa)
    for i in range(n):
        w[i] = d[i] - old[i]
        d[i] = old[i]
    # Cholesky factor of P_dd, then two substitutions
    for i in range(n):
        for j in range(i + 1):
            p = 0.0
            for c in range(first + i, N):
                p += entry(U, first + i, c) * entry(U, first + j, c) * D[c]
            for k in range(j):
                p -= P[i, k] * P[j, k]
            if i == j:
                P[i, i] = math.sqrt(p) if p > 0.0 else 0.0
            else:
                P[i, j] = p / P[j, j] if P[j, j] > 0.0 else 0.0
    for i in range(n):
        for k in range(i):
            w[i] -= P[i, k] * w[k]
        w[i] = w[i] / P[i, i] if P[i, i] > 0.0 else 0.0
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            w[i] -= P[k, i] * w[k]
        w[i] = w[i] / P[i, i] if P[i, i] > 0.0 else 0.0
    for c in range(first, N):
        along = 0.0
        for i in range(min(n, c - first + 1)):
            along += entry(U, first + i, c) * w[i]
        along *= D[c]
        for i in range(c + 1):
            s[i] += entry(U, i, c) * along
