"""Once over a record of regressions with drifting parameters: the filter, its way back, and what the record can tell.

    y(k) = psi(k)' theta(k) + e(k),    s(k+1) = A s(k) + w(k),    var w = Q(k) diagonal

with s = theta and A = diag(phi) for a walk, s = [theta ; slope] and A = [phi I ; 0 I] for an integrated one. Variances
are relative to sigma^2. Nothing is inverted on the way back: r and N are the derivatives of the likelihood

    r(k) = d log L / d s(k|k-1) sigma^2,     r r'/sigma^2 - N = 2 d log L / d P(k|k-1)

so that s(k | T) = s + P r, P(k | T) = P - P N P, and the exact score is d log L / d Q_ii(k) = (r_i^2/sigma^2 - N_ii)/2,
whatever Q: zeros are welcome. Bryson and Frazier (1963); de Jong (1989); Koopman and Shephard (1992). P - P N P has no
digits left where P is wide, so `moments` takes another way back.
"""

from typing import NamedTuple

import numpy as np

from ...engine.dispatch import Vector, kernel, pass_over
from ...engine.ud import correct, entry, project, widen
from ...memory.gauss_markov import relax

NONE = np.zeros((1, 1))  # where a pass has nothing to write
EPS, VARIANCE, GAIN = range(3)  # a note begins with them: innovation, its variance (0: nothing was learnt), m gains


class Forward(NamedTuple):
    """The filter: notes in ``kept``, where they are wide enough also s and the factors of P after each sample.

    ``numbers`` begins with s, D and packed U before the first sample and ends with those after the last.
    """

    n: float  # parameters
    phi: Vector  # (m,), 1 for a slope


class Disturbances(NamedTuple):
    """The way back, for the score and the jumps: a row of ``out`` (T, 2m) is r and diag N for a sample's next step."""

    n: float
    phi: Vector


class Information(NamedTuple):
    """Fisher's information about (log of the n quiet variances, log sigma^2), given the past at each sample: ``out``.

    1/2 dS_i dS_j/S^2 + de_i de_j/(sigma^2 S), summed from sample ``first`` on; ``q`` are the quiet variances.
    """

    n: float
    phi: Vector
    quiet: Vector
    s2: float
    first: float


def note_size(m: int, keeps_states: bool) -> int:
    """Return how wide ``kept`` is."""
    return GAIN + m + (2 * m + m * (m - 1) // 2 if keeps_states else 0)


def forward_numbers(s, D, U) -> np.ndarray:
    """Return a start for `Forward`: the state, and scratch behind it."""
    m = len(s)
    return np.concatenate([s, D, U, np.zeros(2 * m)])


def back_size(m: int) -> int:
    """Return the size of the scratch of a way back."""
    return 2 * m + m * m


@kernel
def move(task, s):
    """S <- A s."""
    n = int(task.n)
    for i in range(s.size):
        s[i] = task.phi[i] * s[i] + (s[n + i] if n + i < s.size else 0.0)


@kernel
def move_back(task, r):
    """R <- A' r."""
    n = int(task.n)
    for i in range(r.size - 1, -1, -1):
        r[i] = task.phi[i] * r[i] + (r[i - n] if i >= n else 0.0)


@kernel
def between_samples(task, s, U, D, q, a):
    """S <- A s, P <- A P A' + diag(q), with A = [I I ; 0 I] diag(phi) where there are slopes; a is scratch."""
    m, n, is_still = D.size, int(task.n), True
    for i in range(n):
        is_still = is_still and task.phi[i] == 1.0
    if not is_still:
        relax(s, U, D, task.phi, a)
    for j in range(n, m):
        s[j - n] += s[j]
        for i in range(j - n + 1):
            U[j * (j - 1) // 2 + i] += entry(U, n + i, j)
    for i in range(m):
        if q[i] > 0.0:
            widen(U, D, i, q[i], a)


@pass_over.on(Forward)
def pass_over_forward(task, rows, q, kept, out, numbers):
    m = q.shape[1]
    u, e = 2 * m, 2 * m + m * (m - 1) // 2
    s, D, U = numbers[:m], numbers[m:u], numbers[u:e]
    f, b = numbers[e : e + m], numbers[e + m : e + 2 * m]
    for t in range(rows.shape[0]):
        y, psi, note = rows[t, 0], rows[t, 1:], kept[t]
        note[EPS], note[VARIANCE] = 0.0, 0.0
        if y == y:
            project(U, psi, f)
            eps = y
            for i in range(m):
                eps -= psi[i] * s[i]
            S = correct(U, D, f, 1.0, b)
            note[EPS], note[VARIANCE] = eps, S
            for i in range(m):
                note[GAIN + i] = b[i] / S
                s[i] += note[GAIN + i] * eps
        if note.size > GAIN + m:
            for i in range(e):
                note[GAIN + m + i] = numbers[i]
        between_samples(task, s, U, D, q[t], b)


@kernel
def open_back(numbers, m):
    """Return r, N and a scratch vector; nothing is known beyond the end."""
    for i in range(m + m * m):
        numbers[i] = 0.0
    return numbers[:m], numbers[m : m + m * m].reshape(m, m), numbers[m + m * m : 2 * m + m * m]


@kernel
def before_motion(task, r, N):
    """Take r and N from after a motion to before it: A' r, A' N A."""
    move_back(task, r)
    m = r.size
    for _ in range(2):
        for i in range(m):
            move_back(task, N[i])
        for i in range(m):
            for j in range(i):
                N[i, j], N[j, i] = N[j, i], N[i, j]


@kernel
def before_sample(psi, note, r, N, w):
    """Take r and N from after a sample to before it: with L = I - K psi', psi eps/S + L' r and psi psi'/S + L' N L."""
    if note[VARIANCE] == 0.0:
        return
    m = r.size
    step, size = note[EPS] / note[VARIANCE], 1.0 / note[VARIANCE]
    for i in range(m):
        w[i] = 0.0
        for j in range(m):
            w[i] += N[i, j] * note[GAIN + j]
        size += note[GAIN + i] * w[i]
        step -= note[GAIN + i] * r[i]
    for i in range(m):
        r[i] += psi[i] * step
        for j in range(i + 1):
            N[i, j] += psi[i] * psi[j] * size - psi[i] * w[j] - w[i] * psi[j]
            N[j, i] = N[i, j]


@pass_over.on(Disturbances)
def pass_over_disturbances(task, rows, q, kept, out, numbers):
    m = q.shape[1]
    r, N, w = open_back(numbers, m)
    for t in range(rows.shape[0] - 1, -1, -1):
        for i in range(m):
            out[t, i], out[t, m + i] = r[i], N[i, i]
        before_motion(task, r, N)
        before_sample(rows[t, 1:], kept[t], r, N, w)


@pass_over.on(Information)
def pass_over_information(task, rows, q, kept, out, numbers):
    n, m = int(task.n), q.shape[1]
    ds = numbers[: n * m].reshape(n, m)
    dP = numbers[n * m : n * m + n * m * m].reshape(n, m, m)
    dS, de, v = numbers[n * m * (m + 1) :][:n], numbers[n * m * (m + 1) + n :][:n], numbers[n * m * (m + 1) + 2 * n :]
    for t in range(rows.shape[0]):
        psi, note = rows[t, 1:], kept[t]
        S, gain = note[VARIANCE], note[GAIN:]
        if S > 0.0:
            for j in range(n):
                dS[j] = de[j] = 0.0
                for i in range(m):
                    v[i] = 0.0
                    for k in range(m):
                        v[i] += dP[j, i, k] * psi[k]
                    dS[j] += psi[i] * v[i]
                    de[j] -= psi[i] * ds[j, i]
                for i in range(m):
                    ds[j, i] += (v[i] - gain[i] * dS[j]) * note[EPS] / S + gain[i] * de[j]
                    for k in range(m):
                        dP[j, i, k] += gain[i] * gain[k] * dS[j] - gain[i] * v[k] - v[i] * gain[k]
            if t >= task.first:
                for i in range(n):
                    for j in range(n):
                        out[i, j] += 0.5 * dS[i] * dS[j] / (S * S) + de[i] * de[j] / (task.s2 * S)
                    out[i, n] += 0.5 * dS[i] / S
                    out[n, i] += 0.5 * dS[i] / S
                out[n, n] += 0.5
        for j in range(n):
            move(task, ds[j])
            for _ in range(2):
                for i in range(m):
                    move(task, dP[j, i])
                for i in range(m):
                    for k in range(i):
                        dP[j, i, k], dP[j, k, i] = dP[j, k, i], dP[j, i, k]
            dP[j, m - n + j, m - n + j] += task.quiet[j]


def information_size(n: int, m: int) -> int:
    """Return the size of the scratch of `Information`, zeros at the start."""
    return n * m * (m + 1) + 2 * n + m
