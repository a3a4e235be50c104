"""What the states of a fleet amount to, in columns: parameters, deviations, noise, what was taught, what drifts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..memory import auto, auto_state
from ..memory.bank import open_bank
from ..memory.modes import WEIGHT, mode
from ..memory.unknown_drift import open_drift_state
from .fleet import Fleet

SLICE = 4096  # series whose covariances are in memory at a time


class Census(NamedTuple):
    """Numbers of every series, in the order of the fleet's keys; NaN where the estimator does not know."""

    names: list[str]  # of the parameters
    theta: np.ndarray  # (S, N)
    std: np.ndarray  # (S, N)
    noise: np.ndarray  # (S,) standard deviation of the noise, in units of y
    freedom: np.ndarray  # (S,) degrees of freedom behind it
    untaught: np.ndarray  # (S,) posterior over prior variance of the least known combination: near 1, nothing is known
    still: np.ndarray  # (S,) probability that no parameter drifts (`AutoMemory`)
    memory: np.ndarray  # (S, N) samples that each parameter remembers, where drift is learnt
    moves: np.ndarray  # (S, k) whether each input ever moved


def census(fleet: Fleet) -> Census:
    """Return the columns of a fleet, computed a slice of series at a time.

    Notes
    -----
    Bad at: several outputs, where each series is read on its own (some 0.2 ms), and noise is that of the first output.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> fleet = dw.Fleet(dw.AR(1), ["one", "two"])
    >>> y, _ = dw.simulate([-0.8], [0.0], samples=500, noise_std=0.5, seed=1)
    >>> _ = fleet.scan(np.repeat(["one", "two"], 500), np.concatenate([y, -y]))
    >>> found = census(fleet)
    >>> found.names, found.theta.round(1).tolist(), found.noise.round(1).tolist()
    (['a1'], [[-0.8], [-0.8]], [0.5, 0.5])
    """
    S, first = len(fleet), fleet.estimators[0]
    N, k, names = len(first.names), first.model.inputs, list(first.names)

    def unknown(*shape):
        return np.full((S, *shape), np.nan)

    found = Census(
        names, unknown(N), unknown(N), unknown(), unknown(), unknown(), unknown(), unknown(N), np.ones((S, k), bool)
    )
    states = fleet.states
    for number, est in enumerate(fleet.estimators):
        rows = np.flatnonzero(fleet._group[:S] == number)
        for at in np.split(rows, range(SLICE, len(rows), SLICE)):
            _fill(found, at, est, states[at])
    return found


def _fill(found: Census, at, est, states) -> None:
    """Fill the rows of some series of one setting."""
    found.theta[at] = states["theta"]
    if (est.outputs or 1) > 1:
        for row, state in zip(at, states):
            _, P = est.parameters_of(state)
            found.std[row] = np.sqrt(np.diag(P).clip(0))
            found.noise[row] = np.sqrt(np.atleast_1d(est.policies[1].R)[0] * est.sigma2(state)[0])
            found.freedom[row] = 2 * est.scale_posterior(state)[0][0]
            found.untaught[row] = max((ratio for ratio, _ in est.information_ratio(state)), default=np.nan)
    elif len(states):
        s2 = np.array([est.sigma2(state) for state in states])
        n = est.model.n
        P = est._covariance(states)[:, n:, n:]
        unit = np.array([est.unit_of(state) for state in states])
        found.std[at] = np.sqrt(np.einsum("sii->si", P).clip(0) * unit[:, None])
        found.noise[at] = np.sqrt(est.policies[1].R * s2)
        found.freedom[at] = [2 * est.scale_posterior(state)[0] for state in states]
        if est.model.coloured:
            found.untaught[at] = [max(ratio for ratio, _ in est.information_ratio(state)) for state in states]
        else:
            root = np.sqrt(np.diag(est.prior_covariance)[n:])
            free = np.flatnonzero(root > 0)
            scaled = (P / np.outer(root, root).clip(1e-300))[:, free][:, :, free]
            found.untaught[at] = np.linalg.eigvalsh(scaled)[:, -1].clip(0)
        _speeds(found, at, est, states)
    if found.moves.shape[1] and "steps" in (states.dtype.names or ()):
        found.moves[at] = (states["steps"] > 0) | (states["known"] < 2)


def _speeds(found: Census, at, est, states) -> None:
    """Fill how fast parameters drift, where the memory learns it: what `drift_of` reads from one state."""
    memory, N = est.policies[2], est.model.N
    if not hasattr(memory, "moving"):
        return
    cells = states["memory_state"]
    places = np.arange(cells.shape[1])  # views of these are where the numbers of each view are
    drift = open_drift_state(places, N)
    q, unit = cells[:, drift.q], cells[:, drift.unit]
    with np.errstate(divide="ignore", invalid="ignore"):
        found.memory[at] = np.sqrt(unit / q)
    if isinstance(memory, auto.AutoMemoryKernel):
        bank = open_bank(drift.own[auto_state.HEAD :], N, len(memory.levels)).bank
        found.still[at] = cells[:, mode(bank, 0, N).own[WEIGHT]]
