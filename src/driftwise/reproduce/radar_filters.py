"""The filters that meet on the radar: fixed dynamics (plain Kalman filters) and the joint form, in several guises."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import expm, solve_discrete_are
from scipy.optimize import minimize

import driftwise as dw

SPEED = 250.0  # m/s, how fast an aircraft may be before anything is known
NULL = np.array([0.0, 1.0, -2.0])  # Salut's a of y(t) = 2 y(t-1) - y(t-2): two poles at 1, one at 0
ALONG = np.array([-1.0, 2.0, -1.0])  # a = NULL + phi ALONG: the poles at 1 stay, the third is phi


class Outcome(NamedTuple):
    """One-step predictions of one coordinate, their variances, and the half-widths of 95 % intervals."""

    prediction: np.ndarray
    variance: np.ndarray
    band: np.ndarray


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


class Fixed(NamedTuple):
    """A fixed filter with its tuned numbers."""

    name: str
    numbers: dict
    r: float
    F: np.ndarray
    Q: np.ndarray
    P0: np.ndarray

    def __call__(self, y):
        """Return an `Outcome` per coordinate."""
        prediction, variance = fixed(self.F, self.Q, self.r, self.P0, y)
        return [Outcome(prediction[:, i], variance, 1.96 * np.sqrt(variance)) for i in range(y.shape[1])]


def build(kind, logs, period) -> Fixed:
    """Return the constant-velocity or Singer filter with the logarithms of its numbers."""
    values = np.exp(logs)
    if kind == "constant velocity":
        q, r = values
        F, Q = constant_velocity(q, period)
        return Fixed(kind, {"q": q, "r": r}, r, F, Q, np.diag([r, SPEED**2]))
    alpha, q, r = values
    F, Q = singer(alpha, q, period)
    return Fixed("Singer", {"alpha": alpha, "q": q, "r": r}, r, F, Q, np.diag([r, SPEED**2, q]))


def tuned(kind, y, period) -> Fixed:
    """Return the filter with the numbers most likely on this very record (hindsight; e2/S capped at 16)."""

    def loss(logs):
        if np.any(np.abs(logs) > 20):
            return 1e9
        flt = build(kind, logs, period)
        prediction, variance = fixed(flt.F, flt.Q, flt.r, flt.P0, y)
        chi2 = np.minimum((y - prediction) ** 2 / variance[:, None], 16.0)
        return 0.5 * np.nansum(chi2 + np.log(variance)[:, None] * np.isfinite(chi2))

    starts = {"constant velocity": [[3.0, 10.0]], "Singer": [[-3.0, 1.0, 10.0]]}[kind]
    best = min(
        (minimize(loss, start, method="Nelder-Mead", options=dict(xatol=0.02, fatol=0.02)) for start in starts),
        key=lambda result: result.fun,
    )
    return build(kind, best.x, period)


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


def joint(y, period, rho, m, poles_held) -> dw.Joint:
    """Return Salut's third-order form for one coordinate; ``poles_held`` puts two poles at 1 and learns one.

    Holding poles is a prior: a = NULL + phi ALONG is a covariance of rank one on the a's.
    """
    P0 = np.zeros((6, 6))
    P0[:3, :3] = (SPEED * period) ** 2 * np.eye(3)
    P0[3:, 3:] = 0.2 * (np.outer(ALONG, ALONG) if poles_held else np.eye(3))
    return dw.Joint(
        3,
        noise=dw.NoisePolynomial(polynomial(rho, m)),
        scale=dw.UnknownScale(1.5, 1.5),
        s0=[0, 0, 0, *NULL],
        P0=P0,
        y_scale=start_noise(y),
        dt=period,
    )


def joint_of_singer(flt: Fixed, period) -> dw.Joint:
    """Return the joint form with the noise polynomial of a Singer filter, a started there and free (P_a = .1)."""
    d, variance = canonical_noise(flt.F, flt.Q, flt.r)
    phi = np.exp(-flt.numbers["alpha"] * period)
    P0 = np.diag([*[(SPEED * period) ** 2] * 3, 0.1, 0.1, 0.1])
    return dw.Joint(3, noise=dw.NoisePolynomial(d, variance), s0=[0, 0, 0, *(NULL + phi * ALONG)], P0=P0, dt=period)


def canonical_noise(F, Q, r):
    """Return d (d_0 first) and var v of the canonical form: C(z) = det(z I - F + K H), K the steady predictor gain."""
    H = np.zeros(len(F))
    H[0] = 1.0
    P = solve_discrete_are(F.T, H[:, None], Q, np.array([[r]]))
    variance = float(P[0, 0] + r)
    return np.poly(F - np.outer(F @ P[:, 0] / variance, H))[:0:-1], variance


def follow(est, y):
    """Return the trace of one coordinate, centred on its first plot, and its `Outcome`."""
    trace = est.scan(y - y[0])
    return trace, Outcome(trace.prediction + y[0], trace.variance, trace.band(0.95))


def joint_of_differences(y, period, rho, m, walk=0.0) -> dw.Joint:
    """Return the same two poles at 1 in w(t) = y(t) - 2 y(t-1) + y(t-2): only phi is left in a, and may walk.

    In positions x stores phi times old positions, so a walk of phi would have to move x with it; differences have no
    such trap.
    """
    sigma = start_noise(y)
    P0 = np.diag([25 * sigma**2] * 3 + [0.0, 0.0, 0.2])
    memory = dw.Walk([walk, 0.0, 0.0]) if walk else dw.Never()
    return dw.Joint(
        3,
        noise=dw.NoisePolynomial(polynomial(rho, m)),
        memory=memory,
        scale=dw.UnknownScale(1.5, 1.5),
        P0=P0,
        y_scale=sigma,
        dt=period,
    )


def follow_differences(est, y):
    """Return phi (T,) and the `Outcome` of one coordinate; a missed scan is filled with its prediction."""
    from scipy.special import stdtrit

    T, past = len(y), y.copy()
    prediction, variance, band, phi = (np.full(T, np.nan) for _ in range(4))
    state = est.start()
    for t in range(2, T):
        base = 2 * past[t - 1] - past[t - 2]
        dof = 2 * est.scale_posterior(state)[0]
        state, step = est.update(state, y[t] - base)
        prediction[t], variance[t] = base + step.prediction, step.variance
        band[t] = stdtrit(dof, 0.975) * np.sqrt(step.variance)
        if y[t] != y[t]:
            past[t] = prediction[t]
        phi[t] = -state["theta"][0]
    return phi, Outcome(prediction, variance, band)
