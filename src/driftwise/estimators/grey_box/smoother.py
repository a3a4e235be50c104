"""A record of a grey box in hindsight: the most probable path of its state and parameters, and the Gaussian about it.

The plant is made linear about a path, with the exact slopes of its steps and outputs; the smoother of `StateSpace` says
which path that makes the most probable, and the plant is made linear about that one. It is Gauss and Newton's method
for the path with the largest posterior (Bell, 1994, SIAM J. Optimization 4, 626-636), begun where the filter ends:
what the filter learnt from early samples by slopes that were taken far off is forgotten.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...engine import compile, ud
from ...engine.errors import InputError
from ...engine.holding import held
from ...engine.status import BAD_VALUE, MISSING_OUTPUT, REJECTED, UNDEFINED
from ...memory.constant import Constant
from ...memory.random_walk import RandomWalk
from ...models.formula_values import undefined
from ..state_space.estimator import StateSpace
from .transform import to_units

TURNS, SETTLED = 30, 1e-3  # plants that are made linear, at most; deviations by which a path then moves
BLOCK = 4096  # steps that are taken at once


class Linear(NamedTuple):
    """What a plant is about a path: s(t) = F s(t-1) + g + w of covariance Q, y = H s + d; (T, ..) each."""

    F: np.ndarray
    g: np.ndarray
    Q: np.ndarray
    H: np.ndarray
    d: np.ndarray


def smooth(est, trace, begun, keep: str) -> tuple[np.ndarray, float]:
    """Return s(t) given a whole record that was filtered, in rows as ``keep`` has them, and how far it moved at last.

    ``begun``: the state before its first sample.

    Parameters are transformed; covariances are what they are for white residuals.
    """
    N, s2 = est.model.N, float(est.sigma2(trace.state))
    walks, (s0, P0) = _walks(est, trace), _prior(est, trace, begun)
    u = held(np.asarray(trace.u, float).reshape(len(trace), est.model.inputs), begun["held"])
    y = np.where(trace.status & (MISSING_OUTPUT | REJECTED | BAD_VALUE | UNDEFINED), np.nan, trace.y).reshape(
        len(u), -1
    )
    R = s2 * np.diag(trace.state["noise"] ** 2)
    path, share, moved = _begun(est, trace, u, s0, P0), 1.0, np.inf
    best: Any = None
    for _ in range(TURNS):
        own = _linear(est, path, u, trace.time)
        found = None if own is None else _smoothed(est, own, s2, walks, R, s0, P0, y, keep)
        if found is None or not _is_number(est, found):
            if best is None:
                raise InputError(_refusal(est, path, u))
            share *= 0.5  # too far: half the way
        else:
            step, before = found.x - path, moved
            far = abs(step) / np.maximum(found.x_std, 1e-300)
            moved = float(np.max(np.where(step == 0, 0.0, far)))
            share *= 0.5 if moved > before else 1.0
            best = path, step, found
            if moved < SETTLED:
                break
        path = best[0] + share * best[1]
    table = best[2].table
    return table[:, :N] if keep == "means" else table, moved


def _smoothed(est, own, s2, walks, R, s0, P0, y, keep):
    """Return what the smoother of `StateSpace` makes of a plant that is linear."""
    n, N, T = est.model.n, est.model.N, len(y)
    model = StateSpace(np.eye(N), np.zeros((N, 1)), own.H[0], np.zeros((len(R), 1)), np.zeros(N), R, x0=s0, P0=P0)
    Q = s2 * own.Q
    Q[:, range(n, N), range(n, N)] += walks
    return model.smooth(
        y if est.outputs else y[:, 0], np.ones(T), keep="covariance" if keep == "covariance" else "std",
        F=own.F, G=own.g[:, :, None], H=own.H, D=own.d[:, :, None], Q=Q,
    )  # fmt: skip


def _is_number(est, found) -> bool:
    """Say whether a smoothed path, and its parameters in their units, are numbers."""
    values = to_units(est.formulas.free, found.x[:, est.model.n :])[0]
    return bool(np.isfinite(found.table).all() and np.isfinite(values).all())


def _refusal(est, path, u) -> str:
    """Return why a record cannot be looked back at."""
    values = to_units(est.formulas.free, path[:, est.model.n :])[0]
    for t, (x, inputs, own) in enumerate(zip(path[:, : est.model.n], u, values)):
        if said := undefined(est.formulas, x, inputs, own):
            return f"sample {t} cannot be looked back at: {said}"
    return "the record cannot be looked back at: where the filter ends, the plant's steps give no numbers"


def _walks(est, trace) -> np.ndarray:
    """Return the variance that each transformed parameter gains before each sample, (T, m)."""
    memory, steps = est.policies[2], np.diff(trace.time, prepend=trace.time[0])
    if not isinstance(memory, Constant | RandomWalk):
        raise InputError(
            f"memory = {est.options['memory']!r} forgets, and says not how parameters move: to look back, take "
            "Constant() or RandomWalk(q)"
        )
    m, T = est.model.N - est.model.n, len(trace)
    found = np.zeros((T, m))
    if isinstance(memory, RandomWalk):
        s2 = 1.0 if memory.is_absolute else float(est.sigma2(trace.state))
        found += s2 * np.asarray(memory.q) * (steps if est.policies[0].is_timed else np.ones(T))[:, None]
    for first, name in _jumps(est, trace):
        found[first, slice(None) if name is None else est.names.index(name)] += est.jumping.jumps.size**2
    return found


def _jumps(est, trace) -> list[tuple[int, str | None]]:
    return [(int(one.since), one.parameter) for one in trace.jumps()] if est.jumping else []


def _prior(est, trace, begun) -> tuple[np.ndarray, np.ndarray]:
    """Return what was expected at the first sample, before it."""
    if begun["samples"] == 0:
        return est._s0, float(est.sigma2(trace.state)) * est.prior_covariance
    nothing = np.full((1, est.outputs) if est.outputs else 1, np.nan)
    u = np.full((1, est.model.inputs), np.nan) if est.model.inputs else None
    state = est.scan(nothing, u, state=begun, time=trace.time[:1]).state
    return est.mean(state), float(est.sigma2(state)) * ud.unpack(state["U"], state["D"])


def _begun(est, trace, u, s0, P0) -> np.ndarray:
    """Return a path to begin with, (T, N): parameters as they are known at the end, or before the next jump."""
    n, T = est.model.n, len(trace)
    ends = sorted({*(first for first, _ in _jumps(est, trace) if 0 < first < T), T})
    state, path, at = est.bare.start(), np.empty((T, est.model.N)), 0
    U, D = ud.factor(P0[:n, :n])
    state["x"], state["U"][: n * (n - 1) // 2], state["D"] = s0[:n], U[ud.packed_indices(n)], 0.0
    state["D"][:n], state["noise"] = D, trace.state["noise"] * np.sqrt(est.sigma2(trace.state))
    for end in ends:
        theta = trace.state["theta"] if end == T else trace.transformed[0][end - 1]
        state["theta"] = theta
        part = slice(at, end)
        found = est.bare.scan(
            trace.y[part], u[part] if est.model.inputs else None, state=state, time=trace.time[part], keep="std"
        )
        path[part] = np.column_stack([found.x, np.broadcast_to(theta, (end - at, len(theta)))])
        state, at = found.state, end
    return path


def _linear(est, path, u, time) -> Linear | None:
    """Return the plant, made linear about a path; None where that gives no number."""
    n, N, p, k = est.model.n, est.model.N, est.model.outputs, est.model.inputs
    T, m = len(path), N - n
    F, g, Q = np.tile(np.eye(N), (T, 1, 1)), np.zeros((T, N)), np.zeros((T, N, N))
    for first in range(0, T - 1, BLOCK):
        part = slice(first, min(first + BLOCK, T - 1))
        after = slice(part.start + 1, part.stop + 1)
        ends, S, Q[after, :n, :n] = _stepped(est, path[part], u[part], time[part.start : after.stop], np.zeros((n, m)))
        F[after, :n, n:] = S
        for at in range(0, n, m):  # F e_l + S e_l, as many l as there are parameters
            own = np.eye(n)[:, at : at + m]
            _, both, _ = _stepped(
                est, path[part], u[part], time[part.start : after.stop], np.pad(own, ((0, 0), (0, m - own.shape[1])))
            )
            F[after, :n, at : at + own.shape[1]] = (both - S)[:, :, : own.shape[1]]
        g[after, :n] = ends - np.einsum("til,tl->ti", F[after, :n], path[part])
    values, rates = to_units(est.formulas.free, path[:, n:])
    rows = np.hstack([path[:, :n], u, values])
    out, none = np.zeros((T, (n + p) * (1 + rows.shape[1]))), np.zeros((1, 0))
    plant: Any = est.policies[1]
    kind: Any = type(plant)
    compile.passage(kind)(rows, none, none, out, np.zeros(0), compile.dispatch.flatten([plant]))
    shown, slopes = out[:, n : n + p], out[:, n + p + n * rows.shape[1] :].reshape(T, p, -1)
    H = np.concatenate([slopes[:, :, :n], slopes[:, :, n + k :] * rates[:, None]], axis=2)
    found = Linear(F, g, Q, H, shown - np.einsum("til,tl->ti", H, path))
    return found if all(np.isfinite(one).all() for one in found) else None


def _stepped(est, path, u, time, U) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return where each sample of a path leads (T, n), F U + S (T, n, m), and the noise of that step.

    It is the filter itself that takes these steps, one each, where only the parameters are uncertain.
    """
    bare, n, N, T = est.bare, est.model.n, est.model.N, len(path)
    states, factor = bare.start(T), np.eye(N)
    factor[:n, n:] = U
    states["x"], states["theta"], states["held"] = path[:, :n], path[:, n:], u
    states["U"], states["D"], states["samples"] = factor[ud.packed_indices(N)], 0.0, 1.0
    states["D"][:, n:], states["time"] = 1.0, time[:-1]
    outs = np.empty((T, 1, bare.n_columns))
    us = np.concatenate([u, time[1:, None]], axis=1)[:, None]
    with np.errstate(all="ignore"):
        nothing = np.full((T, 1, est.model.outputs), np.nan)
        bare.drive(states.view(float).reshape(T, -1), nothing, us, outs, bare.spec, bare.scratch())
    moved = np.tile(np.eye(N), (T, 1, 1))
    i, j = ud.packed_indices(N)
    moved[:, i, j] = states["U"]
    own = moved[:, :n, :n] * states["D"][:, None, :n]
    x = np.where(outs[:, 0, 3 * est.model.outputs, None].astype(int) & UNDEFINED, np.nan, states["x"])
    return x, moved[:, :n, n:], own @ moved[:, :n, :n].swapaxes(1, 2)
