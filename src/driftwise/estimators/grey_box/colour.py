"""How much wider the bars of a grey box are where what its model leaves over is not white.

An estimate that sums g_t = P psi_t e_t / S_t over samples, e_t the innovations of the filter that knows theta, psi_t
their slopes by theta and S_t their variance, has the variance of that sum: P where the nu_t = e_t / sqrt(S_t) are as
white as the model says, P J P with J the long-run covariance of psi_t nu_t / sqrt(S_t) where they are not. Along each
parameter, with w_t = sum_a P_ja / P_jj psi_a / sqrt(S_t), that is the variance of sum w_t nu_t over sum w_t^2. First
what a regression of nu on the one before explains: where nu_t = rho nu_t+1 + eta_t (a stationary process is the same
backwards),

    sum w_t nu_t = sum h_t (nu_t - rho nu_t+1),    h_t = rho h_t-1 + w_t

(prewhitening: Andrews and Monahan, 1992). Then what is left: these terms c_t are summed over blocks of 1, 2, 4, ..
samples; the sum of c^2 over that of v = w^2 tends to the factor of the variance as blocks become longer than what is
correlated (Flyvbjerg and Petersen, 1989; the blocks are Bartlett's window). Of (sum v)^2 / sum v^2 blocks it is
uncertain by sqrt(2 / blocks): a factor counts where it is beyond that.
"""

from __future__ import annotations

import math

import numpy as np

from ...engine.dispatch import kernel
from ...engine.ud import entry, variance

LEVELS = 16  # lengths of blocks: 1, 2, 4, .. samples
FIRST, EXPECTED, TOTAL, MEAN, SQUARE = range(5)  # of each: c and v of a first half; sums of c^2, v and v^2
KEPT = 5
TAKEN, LAGGED, POWER, LAST, WEIGHTS = range(5)  # an output's: how many nu, sums of nu nu' and nu^2, the last, h, w^2
MOST = 0.99  # correlation of nu with the one before, that is believed
LARGEST = 1e60  # of nu and w: the fourth power of more is no number, and says nothing of bars
BLOCKS = 48.0  # that count, at least, to say how far they scatter
EVERY = 16  # samples after which the factors are taken anew
BEYOND = 3.0  # deviations of a factor from 1, from which it is not chance


@kernel
def correlation(taken, lagged, power):
    """Return the correlation of nu with the one before, of so many; 0 where that may be chance, or is negative."""
    rho = lagged / power if power > 0.0 else 0.0
    return min(rho, MOST) if rho > 0.0 and rho * rho * taken > BEYOND * BEYOND else 0.0


@kernel
def add_output(state, scratch, n, i, nu, own):
    """Add output i to each parameter's c and v: ``own`` = S, and scratch.b is what P psi was before it."""
    if not abs(nu) < LARGEST:
        return
    m, before = state.wide.size, state.chain[i, LAST]
    rho = correlation(state.chain[i, TAKEN], state.chain[i, LAGGED], state.chain[i, POWER])
    for j in range(m):
        p, at = variance(state.U, state.D, n + j), WEIGHTS + j
        w = scratch.b[n + j] / p / math.sqrt(own) if p > 0.0 else 0.0
        if not abs(w) < LARGEST:
            w = 0.0
        scratch.c_part[j] += state.chain[i, at] * (before - rho * nu)
        scratch.v_part[j] += state.chain[i, at + m]
        state.chain[i, at] = rho * state.chain[i, at] + w
        state.chain[i, at + m] = w * w
    state.chain[i, TAKEN] += 1.0
    state.chain[i, LAGGED] += before * nu
    state.chain[i, POWER] += nu * nu
    state.chain[i, LAST] = nu


@kernel
def take_blocks(blocks, count, c, v):
    """Take the c and v of sample number ``count`` (from 1) into the blocks (LEVELS * KEPT, m); c, v are destroyed."""
    number = int(count)
    for level in range(blocks.shape[0] // KEPT):
        at, is_first = KEPT * level, number % 2 == 1
        for j in range(c.size):
            blocks[at + TOTAL, j] += c[j] * c[j]
            blocks[at + MEAN, j] += v[j]
            blocks[at + SQUARE, j] += v[j] * v[j]
            if is_first:
                blocks[at + FIRST, j], blocks[at + EXPECTED, j] = c[j], v[j]
            else:
                c[j] += blocks[at + FIRST, j]
                v[j] += blocks[at + EXPECTED, j]
        if is_first:
            break
        number //= 2


@kernel
def factor_of(blocks, j):
    """Return by how much the variance of parameter j is larger than of white residuals; 1 where that may be chance.

    It is that of the longest blocks of which there are enough, once blocks of any length are beyond chance; 0 where
    there are not enough of any.
    """
    factor, is_beyond = 0.0, False
    for level in range(blocks.shape[0] // KEPT):
        at = KEPT * level
        total, mean, square = blocks[at + TOTAL, j], blocks[at + MEAN, j], blocks[at + SQUARE, j]
        if not mean * mean >= BLOCKS * square or not square > 0.0:
            break
        ratio = total / mean
        if ratio > 1.0 + BEYOND * math.sqrt(2.0 * square) / mean:
            is_beyond = True
        factor = max(ratio, 1.0) if is_beyond else 1.0
    return factor


@kernel
def covariance(U, D, i, j):
    """Return P[i, j]."""
    total = 0.0
    for k in range(max(i, j), D.size):
        total += entry(U, i, k) * D[k] * entry(U, j, k)
    return total


@kernel
def weigh_blocks(form, state):
    """Fill ``wide``, the factors of the parameters' variances: of what samples say, not of what was believed before.

    Where there are not enough samples (since a jump), they stay what they were.
    """
    n, m = int(form.n), state.wide.size
    for j in range(m):
        factor = factor_of(state.blocks, j)
        if factor > 1.0:
            prior, p = 0.0, variance(state.U, state.D, n + j)
            for i in range(m):
                q = covariance(state.U, state.D, n + i, n + j) / form.spread[i]
                prior += q * q
            factor = 1.0 + (factor - 1.0) * max(1.0 - prior / p, 0.0)
        if factor > 0.0:
            state.wide[j] = factor


@kernel
def take_colour(form, state, scratch):
    """Take what a sample added to c and v; every few samples, weigh it."""
    state.counted[0] += 1.0
    take_blocks(state.blocks, state.counted[0], scratch.c_part, scratch.v_part)
    if int(state.counted[0]) % EVERY == 0:
        weigh_blocks(form, state)


def fill(state, nu, w) -> None:
    """Write the chains and blocks of samples into a state: nu (T, p), NaN where missing, and w (T, p, m)."""
    T, _, m = w.shape
    c, v = np.zeros((T, m)), np.zeros((T, m))
    for i, chain in enumerate(state["chain"]):
        at = np.flatnonzero(np.isfinite(nu[:, i]))
        own, weight, h = nu[at, i], w[at, i], np.zeros(m)
        chain[:WEIGHTS] = len(own), own[1:] @ own[:-1], own @ own, own[-1] if len(own) else 0.0
        rho = correlation(*chain[:LAST])
        for k, t in enumerate(at[:-1]):
            h = rho * h + weight[k]
            c[t] += h * (own[k] - rho * own[k + 1])
            v[t] += weight[k] ** 2
        if len(own):
            chain[WEIGHTS:] = np.concatenate([rho * h + weight[-1], weight[-1] ** 2])
    is_taken = np.isfinite(nu).any(axis=1)
    state["counted"], state["blocks"] = is_taken.sum(), _blocks(c[is_taken], v[is_taken])


def _blocks(c, v) -> np.ndarray:
    """Return the blocks (LEVELS * KEPT, m) of samples' c and v, (T, m) each."""
    blocks = np.zeros((LEVELS, KEPT, c.shape[1]))
    for own in blocks:
        if len(c):
            own[FIRST], own[EXPECTED] = c[-1], v[-1]
        own[TOTAL], own[MEAN], own[SQUARE] = (c * c).sum(axis=0), v.sum(axis=0), (v * v).sum(axis=0)
        half = 2 * (len(c) // 2)
        c, v = (one[:half:2] + one[1:half:2] for one in (c, v))
    return blocks.reshape(LEVELS * KEPT, -1)
