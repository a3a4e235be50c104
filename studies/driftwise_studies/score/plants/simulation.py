"""What a plant answers to inputs that are held between samples: exact where it is linear, integrated where it is not.

`response` does it for many parameter vectors at once, complex ones too, so that one pass gives all derivatives by
complex steps (Squire and Trapp 1998); `simulate` makes a drawn record, its truth by SciPy's DOP853.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from .drawing import Drawn
from .physics import Plant, named

FINE = 0.07  # of the fastest time constant: a step of Runge and Kutta


def response(plant: Plant, theta, x0, t, u, fast: float = np.inf):
    """Return outputs (T, p, B) and the last state (n, B) of parameters (m, B) and initial states (n, B).

    ``fast`` is the fastest time constant in s, which a plant that is not linear needs.
    """
    p, x = named(plant, theta), np.array(x0, dtype=np.result_type(theta, x0))
    path = np.zeros((len(t), *x.shape), x.dtype)
    move = _exact(plant, p, x, t, u) if plant.is_linear else _runge_kutta(plant, p, t, u, fast)
    for k in range(len(t)):
        path[k] = x
        if k + 1 < len(t):
            x = move(k, x)
    every = plant.outputs(np.moveaxis(path, 1, 0), np.moveaxis(u[:, :, None], 1, 0), p)
    return np.stack([np.broadcast_to(one, (len(t), x.shape[1])) for one in every], axis=1), x


def _exact(plant, p, x, t, u):
    """Return the move over an interval by the exponential of [[A, b], [0, 0]]."""
    n, width = x.shape
    rows, which = np.unique(np.column_stack([np.round(np.diff(t), 12), u[:-1]]), axis=0, return_inverse=True)
    steps = np.zeros((len(rows), width, n + 1, n + 1), x.dtype)
    held, shape = rows.T[1:, :, None], (len(rows), width)

    def slopes(point):
        found = plant.slopes(np.broadcast_to(point[:, None, None], (n, *shape)), held, p)
        return np.stack([np.broadcast_to(v, shape) for v in found], axis=-1)

    steps[..., :n, n] = b = slopes(np.zeros(n))
    for j in range(n):
        steps[..., :n, j] = slopes(np.eye(n)[j]) - b
    steps = exponential(steps * rows[:, 0, None, None, None])
    A, b = steps[..., :n, :n], steps[..., :n, n]
    return lambda k, x: np.einsum("bij,jb->ib", A[which[k]], x) + b[which[k]].T


def exponential(M):
    """Return the exponentials of matrices (.., n, n): Taylor's series of a part, squared."""
    size = np.abs(M[..., :-1, :-1]).sum(axis=-1).max(initial=0.0)  # the last column is only added up
    halvings = max(0, int(np.ceil(np.log2(size / 0.5)))) if size else 0
    part, found = M / 2.0**halvings, np.eye(M.shape[-1]) + 0 * M
    for k in range(14, 0, -1):
        found = np.eye(M.shape[-1]) + part @ found / k
    for _ in range(halvings):
        found = found @ found
    return found


def _runge_kutta(plant, p, t, u, fast):
    """Return the move over an interval by Runge and Kutta's fourth order, in steps that are fine enough."""

    def move(k, x):
        steps = max(1, int(np.ceil((t[k + 1] - t[k]) / (FINE * fast))))
        h, held = (t[k + 1] - t[k]) / steps, u[k][:, None]
        for _ in range(steps):
            a = np.array(plant.slopes(x, held, p))
            b = np.array(plant.slopes(x + h / 2 * a, held, p))
            c = np.array(plant.slopes(x + h / 2 * b, held, p))
            d = np.array(plant.slopes(x + h * c, held, p))
            x = x + h / 6 * (a + 2 * b + 2 * c + d)
        return x

    return move


def truth(plant: Plant, theta, x0, t, u):
    """Return outputs (T, p) and states (T, n) of one parameter vector, as exactly as doubles allow."""
    p, n, path = named(plant, theta), len(x0), [np.array(x0, float)]
    ends = np.arange(len(t) - 1)

    def slopes(_, x, held):
        return np.ravel(plant.slopes(x, held, p))

    if plant.is_linear:
        M = np.zeros((len(ends), n + 1, n + 1))
        for k in ends:
            M[k, :n, n] = slopes(0.0, np.zeros(n), u[k])
            for j in range(n):
                M[k, :n, j] = slopes(0.0, np.eye(n)[j], u[k]) - M[k, :n, n]
        for E in expm(M * np.diff(t)[:, None, None]):
            path.append((E @ np.append(path[-1], 1.0))[:n])
    else:
        for k in ends:
            move = solve_ivp(slopes, t[k : k + 2], path[-1], method="DOP853", rtol=1e-10, atol=1e-12, args=(u[k],))
            path.append(move.y[:, -1])
    return np.array([np.ravel(plant.outputs(x, held, p)) for x, held in zip(path, u)]), np.array(path)


_KEPT: dict[tuple[int, ...], tuple] = {}  # of the last record that was simulated


def unmoved(drawn: Drawn):
    """Return outputs (T, p) and states (T, n) of a drawn record without its jump, before noise."""
    if drawn.key not in _KEPT:
        _KEPT.clear()
        _KEPT[drawn.key] = truth(drawn.plant, drawn.theta, drawn.x0, drawn.t, drawn.u)
    return _KEPT[drawn.key]


def simulate(drawn: Drawn, jumps: bool = False):
    """Return the outputs (T, p) of a drawn record, NaN where missing, and the deviation of the noise of each (p,).

    With ``jumps`` its parameter jumps at its sample; all else is the same.
    """
    plant, at = drawn.plant, drawn.at
    clean, path = unmoved(drawn)
    y = clean
    if jumps:
        y = np.vstack([y[:at], truth(plant, drawn.after, path[at], drawn.t[at:], drawn.u[at:])[0]])
    noise = drawn.noise * np.std(clean, axis=0)
    rng = np.random.default_rng([*drawn.key, 2])
    drift = np.concatenate([[0.0], np.cumsum(rng.standard_normal(len(y) - 1) * np.sqrt(np.diff(drawn.t)))])
    y = y + plant.walk * drift[:, None] + noise * rng.standard_normal(y.shape)
    y[rng.random(y.shape) < drawn.missing] = np.nan
    return y, noise
