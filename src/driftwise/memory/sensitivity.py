"""How estimate and covariance of a filter answer to a change of its noise variances: exact derivatives, step by step.

For a hyper-parameter j whose part of Q is dQ_j and of the noise variance d_j (its logarithm: q_j in entry jj; 0):

    v = dP psi,  dT = psi' v + d,  de = -psi' dtheta
    dtheta <- Phi (dtheta + (v - K dT) e/T + K de),   dP <- Phi (dP - K v' - v K' + K K' dT) Phi' + dQ

P, T, Q are relative to sigma^2 where that is learnt: theta and P then do not depend on it. dP is packed
(`kernel.dense`).
Source: Gupta and Mehra (1974), with the measurement update written out.
"""

from ..engine.dense import at, multiply, rescale
from ..engine.dispatch import kernel


@kernel
def follow_covariance(dP, psi, K, d, part, v):
    """Take a ``part`` of the correction P - K T K' into dP; return dT, and v = dP psi as it was before."""
    dT = multiply(dP, psi, v) + d
    start = 0
    for j in range(psi.size):
        g, h = part * (K[j] * dT - v[j]), part * K[j]
        for i in range(j + 1):
            dP[start + i] += K[i] * g - v[i] * h
        start += j + 1
    return dT


@kernel
def follow_mean(dtheta, psi, K, z, dT, part, v):
    """Take a ``part`` of the correction theta + K e into dtheta, z = e/T; return de."""
    de = 0.0
    for i in range(psi.size):
        de -= psi[i] * dtheta[i]
    for i in range(psi.size):
        dtheta[i] += part * ((v[i] - K[i] * dT) * z + K[i] * de)
    return de


@kernel
def stays(phi):
    """Say whether a diagonal Phi is 1: then nothing is to be done."""
    for j in range(phi.size):
        if phi[j] != 1.0:
            return False
    return True


@kernel
def pass_time(dtheta, dP, phi):
    """dtheta <- Phi dtheta, dP <- Phi dP Phi' for a diagonal Phi; theta and P themselves go the same way."""
    if stays(phi):
        return
    for j in range(phi.size):
        dtheta[j] *= phi[j]
    rescale(dP, phi)


@kernel
def add_variance(dP, i, q):
    """Add q to entry ii."""
    dP[at(i, i)] += q
