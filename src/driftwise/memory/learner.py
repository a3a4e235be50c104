"""How fast does each parameter drift? Recursive maximum likelihood of log NVR, one for each parameter.

A filter whose theta and P come with their derivatives with respect to eta_i = log NVR_i climbs the likelihood

    -1/2 sum [ log(sigma^2 T) + e^2/(sigma^2 T) ]

by a Newton step at every sample, with the information of the last samples. Everything is relative to sigma^2, so that
theta and P do not depend on it; where sigma^2 is learnt, its own column is taken out of the information (Schur).
"""

import math
from typing import NamedTuple

import numpy as np

from ..kernel.compose import kernel, rare

START, SPREAD = 1e-2, 4.0  # of the NVRs: where they begin (high: the gradient vanishes with q), prior deviation of eta
ALIKE = 2.0  # deviation of eta from the mean of all: weakly identified NVRs follow the others
SAMPLES = 300.0  # memory
LEAST, MOST = 1e-6, 10.0  # bounds of an NVR


class Learner(NamedTuple):
    """Views of what it keeps: derivatives dtheta (N, N) and dP (N, N, N) by eta_i, information, scratch."""

    corner: np.ndarray  # information about log sigma^2
    eta: np.ndarray
    q: np.ndarray
    cross: np.ndarray  # information about log sigma^2 and each eta
    slope: np.ndarray
    dT: np.ndarray
    de: np.ndarray
    v: np.ndarray
    dtheta: np.ndarray
    J: np.ndarray
    A: np.ndarray
    dP: np.ndarray


def learner_cells(N: int) -> int:
    """Return how many numbers a learner keeps."""
    return 1 + 6 * N + 4 * N * N + N**3


@kernel
def open_learner(cells, N):
    """Return the views."""
    m = 1 + 6 * N
    p = m + 4 * N * N
    a, s = cells[1:m].reshape(6, N), cells[m:p].reshape(4, N, N)
    return Learner(
        cells[:1], a[0], a[1], a[2], a[3], a[4], a[5], s[0], s[1], s[2], s[3], cells[p : p + N**3].reshape(N, N, N)
    )


@kernel
def begin_learner(learner):
    """Start in the middle of what is expected of NVRs."""
    for i in range(learner.eta.size):
        learner.eta[i] = math.log(START)
        learner.J[i, i] = 1.0 / (SPREAD * SPREAD)


@kernel
def forget_slopes(learner):
    """Let theta and P depend on eta no longer: they are new."""
    for i in range(learner.eta.size):
        for j in range(learner.eta.size):
            learner.dtheta[i, j] = 0.0
            for k in range(learner.eta.size):
                learner.dP[i, j, k] = 0.0


@kernel
def differentiate(learner, e, T, b, psi, share):
    """Take a ``share`` of the correction by e (gain b/T) into the derivatives of theta and P; leave dT and de."""
    N = psi.size
    for i in range(N):
        v, dtheta, dP = learner.v[i], learner.dtheta[i], learner.dP[i]
        dT, de = 0.0, 0.0
        for j in range(N):
            v[j] = 0.0
            for k in range(N):
                v[j] += dP[j, k] * psi[k]
            dT += v[j] * psi[j]
            de -= psi[j] * dtheta[j]
        learner.dT[i], learner.de[i] = dT, de
        for j in range(N):
            K = b[j] / T
            dtheta[j] += share * ((v[j] - K * dT) * (e / T) + K * de)
            for k in range(j + 1):
                dP[j, k] -= share * (K * v[k] + (v[j] - K * dT) * (b[k] / T))
                dP[k, j] = dP[j, k]


@rare
def study(memory, learner, e, T, s2, share, b, psi, climbs):
    """Take one sample in, as far as it is none of an outlier (``share``); eta moves where ``climbs`` says so.

    e is the filter's innovation, of variance s2 T, and b = P psi.
    """
    differentiate(learner, e, T, b, psi, share)
    if climbs:
        climb(memory, learner, e, T, s2, share)


@kernel
def climb(memory, learner, e, T, s2, share):
    """Score and information of this sample; eta moves by at most one."""
    V = s2 * T
    N, dT, de, g, J, A = learner.eta.size, learner.dT, learner.de, learner.slope, learner.J, learner.A
    keep, center, spread = 1.0 - 1.0 / SAMPLES, 0.0, 1.0 / (SPREAD * SPREAD)
    for i in range(N):
        center += learner.eta[i] / N
    corner = learner.corner
    corner[0] = keep * corner[0] + 0.5
    for i in range(N):
        g[i] = -0.5 * share * (dT[i] / T * (1.0 - e * e / V) + 2.0 * e * de[i] / V)
        g[i] -= (learner.eta[i] - math.log(START)) * spread / SAMPLES
        g[i] -= (learner.eta[i] - center) / (ALIKE * ALIKE * SAMPLES)
        learner.cross[i] = keep * learner.cross[i] + 0.5 * dT[i] / T
    for i in range(N):
        for j in range(i + 1):
            J[i, j] = keep * J[i, j] + share * (0.5 * (dT[i] / T) * (dT[j] / T) + de[i] * de[j] / V)
            if i == j:
                J[i, j] += spread / SAMPLES
            A[i, j] = J[i, j] + ((1.0 if i == j else 0.0) - 1.0 / N) / (ALIKE * ALIKE)
            if memory.learns > 0.0:
                A[i, j] -= learner.cross[i] * learner.cross[j] / (corner[0] + spread)
    solve(A, g)
    for i in range(N):
        step = min(max(g[i], -1.0), 1.0)
        learner.eta[i] = min(max(learner.eta[i] + step, math.log(LEAST)), math.log(MOST))


@kernel
def solve(A, x):
    """x <- A^-1 x for a positive definite A, given by its lower triangle, which is destroyed (Cholesky)."""
    N = x.size
    for j in range(N):
        for k in range(j):
            A[j, j] -= A[j, k] * A[j, k]
        A[j, j] = math.sqrt(max(A[j, j], 1e-300))
        for i in range(j + 1, N):
            for k in range(j):
                A[i, j] -= A[i, k] * A[j, k]
            A[i, j] /= A[j, j]
    for i in range(N):
        for k in range(i):
            x[i] -= A[i, k] * x[k]
        x[i] /= A[i, i]
    for i in range(N - 1, -1, -1):
        for k in range(i + 1, N):
            x[i] -= A[k, i] * x[k]
        x[i] /= A[i, i]


@kernel
def speed_up(learner, unit):
    """Fill q with the variances that the NVRs stand for."""
    for i in range(unit.size):
        learner.q[i] = math.exp(learner.eta[i]) * unit[i]


@kernel
def move_on(learner, phi):
    """Predict the derivatives."""
    N = phi.size
    for i in range(N):
        for j in range(N):
            learner.dtheta[i, j] *= phi[j]
            for k in range(N):
                learner.dP[i, j, k] *= phi[j] * phi[k]
        learner.dP[i, i, i] += learner.q[i]
