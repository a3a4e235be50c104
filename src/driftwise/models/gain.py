"""A plant known but for its noise, x+ = Phi x + B u + w, y = H x + e: its gain, and what gain and noise say.

For a scalar state (H = 1) the mean field of Hampton's scheme: Perriot-Mathonna (1981), after Hampton.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .canonical import Canonical


@dataclass(frozen=True)
class GainPlant:
    """Phi (n, n), H (n,), B (n, k); the parameters are the n entries of the gain K."""

    Phi: np.ndarray
    H: np.ndarray
    B: np.ndarray

    coloured = False
    direct = False

    @property
    def n(self) -> int:
        """Number of states."""
        return len(self.H)

    @property
    def N(self) -> int:
        """Number of unknowns, state and gain."""
        return 2 * self.n

    @property
    def inputs(self) -> int:
        """Number of inputs."""
        return self.B.shape[1]

    @property
    def salut(self) -> np.ndarray:
        """Index that takes numbers in the user's order to the kernel's; they are the same here."""
        return np.arange(self.N)

    kernel = salut

    @property
    def names(self) -> list[str]:
        """Names of the parameters: K, or K1, K2, .."""
        return ["K"] if self.n == 1 else [f"K{i + 1}" for i in range(self.n)]

    @cached_property
    def rank(self) -> int:
        """Number of directions of K that the prediction of y depends on: n where all can be learnt."""
        return int(np.linalg.matrix_rank(self._observability @ self.Phi))

    @property
    def _observability(self) -> np.ndarray:
        rows = [self.H]
        for _ in range(self.n - 1):
            rows.append(rows[-1] @ self.Phi)
        return np.array(rows)

    @cached_property
    def dead_beat(self) -> np.ndarray:
        """The gain (n,) that knows the state after n samples without noise (Ackermann's formula for poles at 0)."""
        last = np.eye(self.n)[-1]
        return np.linalg.matrix_power(self.Phi, self.n - 1) @ np.linalg.solve(self._observability, last)

    def poles(self, K) -> np.ndarray:
        """Return the poles (n,) of the filter with gain K: the eigenvalues of Phi (I - K H)."""
        return np.linalg.eigvals(self.Phi - self.Phi @ np.outer(K, self.H))

    @cached_property
    def closed(self) -> tuple[np.ndarray, np.ndarray]:
        """Return a (n,) and M (n, n): the characteristic polynomial of the filter is 1, a + M K (affine in K)."""

        def polynomial(K):
            return np.real(np.poly(self.Phi - self.Phi @ np.outer(K, self.H)))[1:]

        a = polynomial(np.zeros(self.n))
        return a, np.array([polynomial(unit) - a for unit in np.eye(self.n)]).T

    def gain(self, ratio) -> np.ndarray:
        """Return the Kalman gain (n,) for Q = ratio R I / (H H'): every state walks, as much as ``ratio`` says."""
        return kalman_gain(self.Phi, self.H, ratio * np.eye(self.n) / (self.H @ self.H), 1.0)

    def canonical(self, K, covariance):
        """Return Salut's form, values (a, b, c) and their covariance for a gain: y = B/A u + C/A e."""
        n, k = self.n, self.inputs
        a, M = self.closed
        full, impulse = np.concatenate([[1.0], a]), [self.H]
        for _ in range(n - 1):
            impulse.append(impulse[-1] @ self.Phi)
        b = np.array([np.convolve(full, np.array(impulse) @ self.B[:, l])[:n] for l in range(k)]).reshape(-1)
        J = np.zeros((n * (k + 2), n))
        J[-n:] = M
        return Canonical(n, k, coloured=True), np.concatenate([a, b, a + M @ K]), J @ covariance @ J.T


def kalman_gain(Phi, H, Q, R) -> np.ndarray:
    """Return the filter gain K (n,) of the steady Kalman filter for noise covariances Q (n, n) and R."""
    from scipy.linalg import solve_discrete_are

    H = np.atleast_1d(H)
    P = solve_discrete_are(np.atleast_2d(Phi).T, H[:, None], np.atleast_2d(Q), np.atleast_2d(R))
    return P @ H / (H @ P @ H + R)


# --- scalar state, H = 1 ---------------------------------------------------------------------------------------


def noise_of_gain(K, Phi, R=1.0):
    """Return the Q at which K is the optimal gain (broadcasts).

    Examples
    --------
    >>> round(float(noise_of_gain(0.3, Phi=0.99)), 6)
    0.134541
    """
    return R * K / (1 - K) * (1 - Phi**2 * (1 - K))


def error_variance(K, Phi, Q, R=1.0):
    """Return the variance P of the prediction of x by the filter with constant gain K (broadcasts)."""
    return (Q + Phi**2 * K**2 * R) / (1 - Phi**2 * (1 - K) ** 2)


def mean_pull(K, Phi, Q, R=1.0):
    """Return the mean of Z at gain K: where the data pull it, K*(K) - K with K* = P/(P + R) (broadcasts).

    It is not the error of K: from .1 to .3 the pull is .31, back only -.14, so the two need different tests.
    """
    P = error_variance(K, Phi, Q, R)
    return P / (P + R) - K
