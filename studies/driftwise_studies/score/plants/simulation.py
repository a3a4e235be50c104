"""What a plant answers to inputs that are held between samples: exact where it is linear, integrated where it is not.

`response` does it for many parameter vectors at once, complex ones too, so that one pass gives all derivatives by
complex steps (Squire and Trapp 1998); `simulate` makes a drawn record, its truth by SciPy's DOP853.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from .drawing import Drawn
from .physics import Plant

TINY = 1e-30  # a complex step
FINE = 0.07  # of the fastest time constant: a step of Runge and Kutta


def named(plant: Plant, theta):
    """Return parameters by name."""
    return dict(zip(plant.starts, theta, strict=True))


def clocks(plant: Plant, theta, x, u) -> tuple[float, float]:
    """Return the fastest and the slowest time constant in s at a state: of the eigenvalues of the slopes."""
    n, p = len(x), named(plant, theta)
    J = np.array([np.imag(plant.slopes(x + 1j * TINY * np.eye(n)[j], u, p)) / TINY for j in range(n)]).T
    sizes = np.abs(np.linalg.eigvals(J))
    sizes = sizes[sizes > 1e-9 * sizes.max()]
    return float(1 / sizes.max()), float(1 / sizes.min())


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
    dt = np.diff(t)
    rows, which = np.unique(np.column_stack([np.round(dt, 12), u[:-1]]), axis=0, return_inverse=True)
    made = np.zeros((len(rows), width, n + 1, n + 1), x.dtype)
    for r, row in enumerate(rows):
        held = row[1:, None]
        b = np.array([np.broadcast_to(v, width) for v in plant.slopes(np.zeros((n, width)), held, p)])
        for j in range(n):
            each = plant.slopes(np.repeat(np.eye(n)[:, j : j + 1], width, 1), 0 * held + held, p)
            made[r, :, :n, j] = (np.array([np.broadcast_to(v, width) for v in each]) - b).T * row[0]
        made[r, :, :n, n] = b.T * row[0]
    steps = exponential(made)
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
    """Return outputs (T, p) and the last state of one parameter vector, as exactly as doubles allow."""
    p, x, path, n = named(plant, theta), np.array(x0, float), [], len(x0)
    for k, now in enumerate(t):
        path.append(np.ravel(plant.outputs(x, u[k], p)))
        if k + 1 == len(t):
            break

        def slopes(_, x, held=u[k]):
            return np.ravel(plant.slopes(x, held, p))

        if plant.is_linear:
            b = slopes(0.0, np.zeros(n))
            A = np.array([slopes(0.0, one) - b for one in np.eye(n)]).T
            M = np.block([[A, b[:, None]], [np.zeros((1, n + 1))]])
            x = (expm((t[k + 1] - now) * M) @ np.append(x, 1.0))[:n]
        else:
            x = solve_ivp(slopes, (now, t[k + 1]), x, method="DOP853", rtol=1e-10, atol=1e-12).y[:, -1]
    return np.array(path), x


def simulate(drawn: Drawn, jumps: bool = False):
    """Return the outputs (T, p) of a drawn record, NaN where missing, and the deviation of the noise of each (p,).

    With ``jumps`` its parameter jumps at its sample; all else is the same.
    """
    plant, at = drawn.plant, drawn.at if jumps else len(drawn.t)
    y, x = truth(plant, drawn.theta, drawn.x0, drawn.t[: at + 1], drawn.u[: at + 1])
    clean, _ = truth(plant, drawn.theta, drawn.x0, drawn.t, drawn.u) if jumps else (y, x)
    if jumps:
        y = np.vstack([y[:at], truth(plant, drawn.after, x, drawn.t[at:], drawn.u[at:])[0]])
    noise = drawn.noise * np.std(clean, axis=0)
    rng = np.random.default_rng([*drawn.key, 2])
    drift = np.concatenate([[0.0], np.cumsum(rng.standard_normal(len(y) - 1) * np.sqrt(np.diff(drawn.t)))])
    y = y + plant.walk * drift[:, None] + noise * rng.standard_normal(y.shape)
    y[rng.random(y.shape) < drawn.missing] = np.nan
    return y, noise
