"""The DC motor of Tian (2009) without noise, at any instants: each mode in closed form, no step, no grid.

    x1' = x2,   J x2' = K1 x3 + torque,   L x3' = -R x3 - K2 x2 + 24 sin t + (L J/K1) (q1 + q2 cos w t),   y = x1

Every forcing is a sum of exponentials f exp(mu t), so a mode z' = lam z + f exp(mu t) is known exactly, a double root
included. Only a drifting R needs an integrator.
"""

from cmath import exp
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm

K1, K2, L, J, VOLTS = 1.0, 1.0, 0.1, 5.0, 24.0
START = np.array([1.0, 0.0, 3.0])
OSCILLATOR = np.array([[0.0, 1.0], [-1.0, 0.0]])  # generator of [sin t, cos t]


class Motor(NamedTuple):
    x: np.ndarray  # (T, 3)
    y3: np.ndarray  # (T,), y''' = K1 x3'/J where the torque is constant
    u: np.ndarray  # (T,)


def matrix(R=1.0):
    return np.array([[0, 1, 0], [0, 0, K1 / J], [0, -K2 / L, -R / L]])


def forcing(q1, q2, w, torque):
    """Exponents mu (5,) and vectors f (3, 5) of the forcing sum f exp(mu t)."""
    mu = np.array([1j, -1j, 0, 1j * w, -1j * w])
    f = np.zeros((3, 5), dtype=complex)
    f[2] = [VOLTS / L / 2j, -VOLTS / L / 2j, J / K1 * q1, J / K1 * q2 / 2, J / K1 * q2 / 2]
    f[1, 2] = torque / J
    return mu, f


def from_instant(A, x0, t0, t, mu, f):
    """States at the instants t of x' = A x + sum f exp(mu t), x(t0) = x0."""
    lam, V = np.linalg.eig(A)
    modes, pushed = np.linalg.solve(V, x0.astype(complex)), np.linalg.solve(V, f)
    s = (np.asarray(t) - t0)[:, None, None]
    gap = (mu - lam[:, None])[None]
    safe = np.where(gap == 0, 1, gap)
    response = np.exp(lam[:, None] * s) * np.where(gap == 0, s, np.expm1(safe * s) / safe)
    z = np.exp(lam * s[:, :, 0]) * modes + (response * pushed * np.exp(mu * t0)).sum(axis=-1)
    return (z @ V.T).real


def dc_motor(t, *, R=1.0, q1=1.0, q2=1.0, w=50.0, torque=0.0, jump=None, drift=0.0):
    """Exact `Motor` at the instants t >= 0. `jump` = (time, R from then on); R(t) = R + drift t."""
    t = np.asarray(t, dtype=float)
    mu, f = forcing(q1, q2, w, torque)
    resistance = np.full(t.shape, float(R)) + drift * t
    if drift:
        x = integrated(t, R, drift, mu, f)
    else:
        x = from_instant(matrix(R), START, 0.0, t, mu, f)
    if jump is not None:
        when, after = jump
        at_jump = from_instant(matrix(R), START, 0.0, np.array([when]), mu, f)[0]
        late = t >= when
        x[late] = from_instant(matrix(after), at_jump, when, t[late], mu, f)
        resistance[late] = after
    u = VOLTS * np.sin(t)
    push = (np.exp(mu * t[:, None]) * f[2]).sum(axis=1).real
    return Motor(x, K1 / J * (-K2 / L * x[:, 1] - resistance / L * x[:, 2] + push), u)


def integrated(t, R, drift, mu, f):
    """The states with R(t) = R + drift t, by an integrator of order 8 that lands on every instant."""

    omega, size = mu.imag.tolist(), f.tolist()

    def slope(s, x):
        torque, volts = ((sum(c * exp(1j * w * s) for c, w in zip(row, omega))).real for row in size[1:])
        return [x[1], K1 / J * x[2] + torque, -K2 / L * x[1] - (R + drift * s) / L * x[2] + volts]

    kept, x, now = [], START, 0.0
    for when in t:  # ascending
        if when > now:
            x = solve_ivp(slope, (now, when), x, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
        kept.append(x)
        now = when
    return np.array(kept)


def by_exponential(t, **plant):
    """States at one instant by the exponential of the autonomous system [x, sin, cos, 1, cos w, sin w]."""
    R, w = plant.get("R", 1.0), plant.get("w", 50.0)
    q1, q2, torque = plant.get("q1", 1.0), plant.get("q2", 1.0), plant.get("torque", 0.0)
    M = np.zeros((8, 8))
    M[:3, :3] = matrix(R)
    M[2, [3, 5, 6]] = VOLTS / L, J / K1 * q1, J / K1 * q2
    M[1, 5] = torque / J
    M[3, 4], M[4, 3] = 1, -1
    M[6, 7], M[7, 6] = -w, w
    return (expm(M * t) @ np.concatenate([START, [0, 1, 1, 1, 0]]))[:3]


def augmented(R=1.0, *, constant=True, frequency=50.0, torque=False):
    """A of [x1 x2 x3, q1, qc qs, torque], as asked: qc' = -w qs, qs' = w qc; B of the voltage; H of y = x1."""
    blocks = [(2, J / K1, None)] * constant + [(2, J / K1, frequency)] * (frequency is not None)
    blocks += [(1, 1 / J, None)] * torque
    n = 3 + sum(1 if w is None else 2 for _, _, w in blocks)
    A = np.zeros((n, n))
    A[:3, :3] = matrix(R)
    at = 3
    for row, gain, w in blocks:
        A[row, at] = gain
        if w is not None:
            A[at, at + 1], A[at + 1, at] = -w, w
        at += 1 if w is None else 2
    return A, np.eye(n)[:, [2]] / L, np.eye(n)[[0]]
