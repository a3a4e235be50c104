"""Matrices handed over with the samples: checked, and put in the order in which the step reads them."""

from __future__ import annotations

import numpy as np

from ...engine.errors import InputError
from ...engine.ud import packed_indices
from ...engine.validation import floats
from ...models.discretise import added, held
from ...models.state_space import LinearSystem, finite
from ..common.times import instants
from .row import sizes

NAMES = ("F", "G", "H", "D", "Q", "R")
SLACK = 1e-12


def with_matrices(est, u, state, time, matrices) -> np.ndarray:
    """Return inputs (T, k), and behind them the instant and the matrices of each sample, as the step reads them."""
    T = len(u)
    stamps, seconds = np.full(T, np.nan), np.full(T, est.dt)
    if time is not None:
        is_free = est.irregular or "F" in matrices
        time = np.atleast_1d(time)
        stamps = instants(time, (T,), state, repeats=True) if is_free else est._instants(time, T, state)
        seconds[1:] = np.diff(stamps)
        seconds[:1] = stamps[0] - state["time"] if T and state["samples"] > 0 else est.dt
    functions = est.functions | (_step_functions(est) if est.options["continuous"] else {})
    own = packed(est.system, matrices | over(est.system, seconds, functions, matrices), T)
    return np.concatenate([u, stamps[:, None], own], axis=1)


def _step_functions(est):
    """Return F, G and Q of a step of so many seconds, of a system in continuous time."""
    A, B, W = (getattr(est.given, name) for name in "FGQ")
    moves = {"F": lambda dt: held(A, B, dt)[0], "Q": lambda dt: added(A, W, dt)}
    return moves | ({"G": lambda dt: held(A, B, dt)[1]} if est.system.inputs else {})


def packed(system: LinearSystem, matrices, samples: int) -> np.ndarray:
    """Return F, G, H, D, the factors of Q, and R of so many samples, (T, ..); what is not given is constant."""
    for name in matrices:
        if name not in NAMES:
            raise InputError(f"{name!r} is no matrix of a sample: they are {', '.join(NAMES)}")
    found = {name: _each(name, matrices.get(name), getattr(system, name), samples) for name in NAMES}
    for name in ("Q", "R"):
        if matrices.get(name) is not None:
            found[name] = _covariances(name, found[name])
    n, k, p = system.n, system.inputs, system.outputs
    U, D = _factors(found["Q"])
    found["Uq"], found["Dq"] = U, D
    return np.concatenate([found[name].reshape(samples, size) for name, size in sizes(n, k, p).items()], axis=1)


def over(system: LinearSystem, seconds, functions, matrices) -> dict[str, np.ndarray]:
    """Return the matrices that are functions of dt over steps of so many seconds, (T, ..); each length once."""
    lengths, which = np.unique(seconds, return_inverse=True)
    found = {}
    for name, function in functions.items():
        if name not in matrices:
            made = [system.written(name, f"{name}({dt:g})", function(float(dt))) for dt in lengths]
            if wrong := [M.shape for M in made if M.shape != made[0].shape]:
                raise InputError(f"{name} returns matrices of several shapes: {made[0].shape} and {wrong[0]}")
            found[name] = np.stack(made)[which]
    return found


def _each(name, value, usual, samples) -> np.ndarray:
    if value is None:
        return np.broadcast_to(usual, (samples, *usual.shape))
    found, shape = floats(name, value), usual.shape
    if found.ndim and samples > 1 and found.shape[1:] == shape and found.shape[0] != samples:
        raise InputError(
            f"{name} has matrices for {found.shape[0]} samples, and y has {samples}: one for each is needed"
        )
    if found.shape not in (shape, (samples, *shape)):
        raise InputError(
            f"{name} must be {(samples, *shape)}, one matrix a sample, or {shape}, got shape {found.shape}"
        )
    return np.broadcast_to(finite(name, found), (samples, *shape))


def _covariances(name, found) -> np.ndarray:
    """Return symmetric matrices without negative eigenvalues."""
    size = np.abs(found).max(axis=(1, 2), initial=0.0)
    off = np.abs(found - found.swapaxes(1, 2)).max(axis=(1, 2), initial=0.0)
    bad = np.flatnonzero(off > 1e-8 * size)
    if len(bad):
        raise InputError(f"{name}[{bad[0]}] must be symmetric. Was its factor given instead of the matrix?")
    found = 0.5 * (found + found.swapaxes(1, 2))
    least = np.linalg.eigvalsh(found)[:, 0]
    bad = np.flatnonzero(least < -SLACK * np.maximum(size, 1e-300) * found.shape[1])
    if len(bad):
        raise InputError(
            f"{name}[{bad[0]}] must be a covariance, and it has the negative eigenvalue {least[bad[0]]:.3g}. Are "
            "standard deviations where variances belong?"
        )
    return found


def _factors(Q) -> tuple[np.ndarray, np.ndarray]:
    """Return packed U and D of each Q = U D U', as `driftwise.engine.ud.factor` does of one."""
    P, (T, n) = np.array(Q, float), Q.shape[:2]
    U, D = np.zeros((T, n, n)), np.zeros((T, n))
    size = np.sqrt(np.diagonal(P, axis1=1, axis2=2).clip(0))
    for j in range(n - 1, -1, -1):
        pivot = P[:, j, j]
        is_live = pivot > 8 * n * np.finfo(float).eps * size[:, j] ** 2
        D[:, j] = np.where(is_live, pivot, 0.0)
        U[:, :j, j] = np.where(is_live[:, None], P[:, :j, j] / np.where(is_live, pivot, 1.0)[:, None], 0.0)
        P[:, :j, :j] -= D[:, j, None, None] * U[:, :j, j, None] * U[:, None, :j, j]
    i, j = packed_indices(n)
    return U[:, i, j], D
