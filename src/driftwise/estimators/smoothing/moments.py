"""Once back over a record: the parameters at every sample given those that came after.

In the coordinates of the factors of P, as `joint.smooth` explains: nothing is inverted, and no digit is lost to a wide
prior.
"""

import math
from typing import NamedTuple

from ...engine.dispatch import Vector, kernel, pass_over
from ...engine.ud import entry, project
from ..joint.smooth import before_correction, before_prediction, in_coordinates
from .passes import EPS, GAIN, VARIANCE, between_samples


class Backward(NamedTuple):
    """The way back, for the moments: a row of ``out`` holds theta and P (upper triangle, by columns) given all samples.

    With ``lag`` >= 0 given the samples up to that many later instead.
    """

    n: float
    phi: Vector
    lag: float


def moments_size(m: int) -> int:
    """Return the size of the scratch of `Backward`."""
    return 8 * m + 4 * m * m


@kernel
def step_back(task, psi, q, note, before, mu, C, X, Z, v):
    """Take mu and C from after a sample to after the one before it, whose note is ``before``; X, Z, v are scratch."""
    m, n = mu.size, int(task.n)
    s, D, g, weight, shrink, a = v[0], v[1], v[2], v[3], v[4], v[5]
    U, U_before, D_before = (
        Z[m : 2 * m].reshape(m * m)[: m * (m - 1) // 2],
        before[3 * m + GAIN :],
        before[GAIN + 2 * m :],
    )
    for i in range(m):
        s[i], D[i] = 0.0, D_before[i]
    for i in range(U.size):
        U[i] = U_before[i]
    between_samples(task, s, U, D, q, a)
    if note[VARIANCE] > 0.0:
        project(U, psi, a)
        for i in range(m):
            g[i] = math.sqrt(D[i]) * a[i]
        before_correction(mu, C, g, weight, shrink, 1.0, note[EPS] / note[VARIANCE])
    for i in range(m):
        for j in range(m):
            X[i, j] = task.phi[i] * (entry(U_before, i, j) if i <= j else 0.0)
            if n + i < m and n + i <= j:
                X[i, j] += entry(U_before, n + i, j)
    in_coordinates(U, D, D_before, m, X)
    before_prediction(mu, C, m, X, Z[:m], g)


@kernel
def look_back(note, n, mu, C, X, Z, out):
    """Write theta and P from the state after a sample and what later samples teach: s + S mu, S C S'."""
    m = mu.size
    s, D, U = note[GAIN + m :], note[GAIN + 2 * m :], note[GAIN + 3 * m :]
    for i in range(n):
        out[i] = s[i]
        for j in range(i, m):
            X[i, j] = entry(U, i, j) * math.sqrt(D[j])
            out[i] += X[i, j] * mu[j]
        for j in range(m):
            Z[i, j] = 0.0
            for k in range(i, m):
                Z[i, j] += X[i, k] * C[k, j]
    at = n
    for j in range(n):
        for i in range(j + 1):
            p = 0.0
            for k in range(j, m):
                p += Z[i, k] * X[j, k]
            out[at] = max(p, 0.0) if i == j else p
            at += 1


@pass_over.on(Backward)
def pass_over_backward(task, rows, q, kept, out, numbers):
    T, m = q.shape
    mu, v = numbers[:m], numbers[m : 8 * m].reshape(7, m)
    C, X = numbers[8 * m : 8 * m + 2 * m * m].reshape(2, m, m)
    Z = numbers[8 * m + 2 * m * m : 8 * m + 4 * m * m].reshape(2 * m, m)
    for t in range(T - 1, -1, -1):
        last = min(t + int(task.lag), T - 1) if task.lag >= 0.0 else min(t + 1, T - 1)
        if task.lag >= 0.0 or t == T - 1:  # nothing is known beyond
            for i in range(m):
                mu[i] = 0.0
                for j in range(m):
                    C[i, j] = 1.0 if i == j else 0.0
        for j in range(last, t, -1):
            step_back(task, rows[j, 1:], q[j - 1], kept[j], kept[j - 1], mu, C, X, Z, v)
        look_back(kept[t], int(task.n), mu, C, X, Z, out[t])
