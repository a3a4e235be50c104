"""What a continuous system does over one step of given length, in NumPy: its transition, its input held, its noise."""

from __future__ import annotations

import numpy as np
import scipy  # scipy.linalg loads where it is used

SHORT = 0.5  # |A| t up to which Van Loan's matrix is well behaved


def held(A, B, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Return exp(A t) and int_0^t exp(A r) dr B: x(t) = F x(0) + G u where u is held."""
    n, k = len(A), B.shape[1]
    M = np.zeros((n + k, n + k))
    M[:n, :n], M[:n, n:] = A, B
    E = scipy.linalg.expm(M * seconds)
    return E[:n, :n], E[:n, n:]


def added(A, W, seconds: float) -> np.ndarray:
    """Return int_0^t exp(A r) W exp(A' r) dr, the covariance that white noise of density W adds (Van Loan, 1978)."""
    n, short, doublings = len(A), seconds, 0
    while np.linalg.norm(A, 1) * short > SHORT:  # in a long step, exp(-A t) of what decays would overflow
        short, doublings = short / 2, doublings + 1
    unit = 2.0 ** np.frexp(np.max(np.diag(W), initial=0.0))[1]  # in other units the numbers are the same
    M = np.zeros((2 * n, 2 * n))
    M[:n, :n], M[:n, n:], M[n:, n:] = -A, W / unit, A.T
    E = scipy.linalg.expm(M * short)
    Phi = E[n:, n:].T
    Q = Phi @ E[:n, n:]
    for _ in range(doublings):
        Q = Q + Phi @ Q @ Phi.T
        Phi = Phi @ Phi
    return (Q + Q.T) * (unit / 2)
