"""The filters that meet on the radar: fixed dynamics (plain Kalman filters) and the joint form, in several guises."""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm, solve_discrete_are

import driftwise as dw

SPEED = 250.0  # m/s, how fast an aircraft may be before anything is known
NULL = np.array([0.0, 1.0, -2.0])  # Salut's a of y(t) = 2 y(t-1) - y(t-2): two poles at 1, one at 0
ALONG = np.array([-1.0, 2.0, -1.0])  # a = NULL + phi ALONG: the poles at 1 stay, the third is phi


# --- fixed dynamics ----------------------------------------------------------------------------------------


def van_loan(A, G, intensity, period):
    """Return exp(A T) and the covariance of the noise that white noise of this intensity leaves after T seconds."""
    n = len(A)
    M = expm(period * np.block([[-A, intensity * np.outer(G, G)], [np.zeros((n, n)), A.T]]))
    F = M[n:, n:].T
    return F, F @ M[:n, n:]


def constant_velocity(q, period):
    """Return F, Q of position and velocity under white acceleration of intensity q (m2/s3)."""
    return van_loan(np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([0.0, 1.0]), q, period)


def singer(alpha, q, period):
    """Return F, Q of position, velocity and an acceleration of variance q (m2/s4), forgotten at rate alpha (1/s).

    Through the matrix exponential, good for alpha T from 1e-6 to 5.
    """
    A = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -alpha]])
    return van_loan(A, np.array([0.0, 0.0, 1.0]), 2 * alpha * q, period)


def fixed(F, Q, r, P0, y):
    """Return one-step predictions (T, m) and their variance (T,) of a Kalman filter started on the first plot.

    All m coordinates share one gain: the covariance does not look at the data.
    """
    x, P = np.zeros((len(F), y.shape[1])), P0
    x[0] = y[0]
    prediction, variance = np.full(y.shape, np.nan), np.full(len(y), np.nan)
    for t in range(1, len(y)):
        x, P = F @ x, F @ P @ F.T + Q
        prediction[t], variance[t] = x[0], P[0, 0] + r
        if y[t, 0] == y[t, 0]:
            K = P[:, 0] / variance[t]
            x, P = x + np.outer(K, y[t] - x[0]), P - np.outer(K, P[0])
    return prediction, variance


# --- the joint form ----------------------------------------------------------------------------------------


def start_noise(y) -> float:
    """Return the standard deviation of the plots from the second differences of the first ten (one coordinate)."""
    second = np.diff(y[:10], n=2)
    second = second[np.isfinite(second)]
    return max(1.4826 * float(np.median(np.abs(second))) / np.sqrt(6), 0.1)


def polynomial(rho, m):
    """Return d of C = (1 - rho q)^m for order 3, d_0 first."""
    c = [-3 * rho, 3 * rho**2, -(rho**3)] if m == 3 else [-2 * rho, rho**2, 0.0]
    return c[::-1]


def joint(y, period, rho, m, speed=SPEED) -> dw.Joint:
    """Return Salut's third-order form for one coordinate: three free coefficients about two poles at 1."""
    return dw.Joint(
        3,
        noise=dw.models.NoisePolynomial(polynomial(rho, m)),
        scale=dw.models.InverseGamma(1.5, 1.5),
        s0=[0, 0, 0, *NULL],
        P0=np.diag(np.repeat([(speed * period) ** 2, 0.2], 3)),
        y_scale=start_noise(y),
        dt=period,
    )


def joint_of_singer(alpha, q, r, period) -> dw.Joint:
    """Return the joint form with the noise polynomial of a Singer filter, a started there and free (P_a = .1)."""
    F, Q = singer(alpha, q, period)
    d, variance = canonical_noise(F, Q, r)
    P0 = np.diag(np.repeat([(SPEED * period) ** 2, 0.1], 3))
    s0 = [0, 0, 0, *(NULL + np.exp(-alpha * period) * ALONG)]
    return dw.Joint(3, noise=dw.models.NoisePolynomial(d, variance), s0=s0, P0=P0, dt=period)


def canonical_noise(F, Q, r):
    """Return d (d_0 first) and var v of the canonical form: C(z) = det(z I - F + K H), K the steady predictor gain."""
    H = np.zeros(len(F))
    H[0] = 1.0
    P = solve_discrete_are(F.T, H[:, None], Q, np.array([[r]]))
    variance = float(P[0, 0] + r)
    return np.poly(F - np.outer(F @ P[:, 0] / variance, H))[:0:-1], variance
