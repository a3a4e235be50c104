"""What a record says of the walks of disturbances and of the noise, or of the length of a window: likelihood."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize

from ...engine import ud, validation
from ...engine.errors import InputError
from . import growing

PER_DECADE = 2  # walks looked at
LITTLE, MUCH = 1e-2, 1e2  # the range of walks: y moves by so many noise deviations in the whole record, in one sample
FACTORS = 10.0 ** np.arange(-4.0, 2.5, 0.5)  # noise deviations looked at, relative to the one given
NEAR = 1e-3  # of the log-likelihood: a walk that gains no more is none
LONGER = 1.1  # a window relative to the one tried before
AROUND, CLOSELY = 1.5, 60  # so far around the best, so many more: where outputs are rounded, neighbours differ much
FAR = 10  # windows so many times as long as the best so far are not tried
SHARE = 0.25  # of a record, which the longest window tried takes; the rest tells how well each predicts


class Tuned(NamedTuple):
    """What was found, and how likely the record is under everything else that was tried.

    Attributes
    ----------
    walk : (number of disturbances,) walks; 0 where the record shows none
    noise_std : (p,), or None where it is learnt on the way
    window : seconds
    loglik : log-likelihood of the record under these
    gain : by how much it exceeds that without any walk (of a window: that of the shortest one tried)
    tried : walks, one row for each that was tuned, or windows (one row)
    logliks : log-likelihoods, shaped like ``tried``: all else as found
    words : the same in a sentence
    """

    walk: np.ndarray
    noise_std: Any
    window: float
    loglik: float
    gain: float
    tried: np.ndarray
    logliks: np.ndarray
    words: str


class Record:
    """A record ready to be run over again and again: the numbers of the walks change, all else is made once."""

    def __init__(self, est, y, u, time):
        disturbances = [q._replace(walk=1.0) for q in est.plant.disturbances]
        self.est = est.replace(disturbances=tuple(disturbances)) if disturbances else est
        alone = [_alone(est, i) for i in range(len(disturbances))]
        self.units = [one.noise(est.dt) for one in alone]  # what a walk of one adds to the covariance in a dt
        self.walks = np.array([one.walk for one in alone])  # and the states it moves
        self.ys, us = validation.record(y, u, est.model.inputs, est.model.outputs)
        self.seconds = est.dt * len(self.ys)
        if time is not None:
            time = est._instants(time, len(self.ys), est.start())
            self.seconds, us = float(time[-1] - time[0]), np.column_stack([us, time])
        self.us, self.table = us, np.empty((1, len(self.ys), est.n_columns))

    def loglik(self, walks, factor) -> float:
        """Return the log-likelihood of the record under these walks and so many times the noise deviation."""
        est, form = self.est, self.est.policies[0]
        form = form._replace(r=form.r * factor**2)
        if len(walks):
            U, D = ud.factor(np.tensordot(walks**2, self.units, 1))
            form = form._replace(Uq=U[ud.packed_indices(len(D))], Dq=D, W=np.diag((walks @ self.walks) ** 2).ravel())
        rows = est._rows(est.start())
        spec = est.spec_of((form, *est.policies[1:]))
        est.drive(rows, self.ys[None], self.us[None], self.table, spec, est.scratch())
        return growing.loglik(est, rows.view(est.dtype).reshape(()))


def _alone(est, i):
    """Return the augmented plant with a walk of one of disturbance i, and no other."""
    walks = [q._replace(walk=float(j == i)) for j, q in enumerate(est.plant.disturbances)]
    return type(est.plant)(est.plant.plant, walks)


def tune_walks(est, y, u, time, which, noise):
    """Return the estimator with the walks (and the noise) under which the record is most likely."""
    count = len(est.plant.disturbances)
    which = list(range(count)) if which is None else sorted(set(np.atleast_1d(which).tolist()))
    if not count and not noise:
        raise InputError("there is no disturbance whose walk could be tuned: disturbances=, or noise=True")
    if not all(i in range(count) for i in which):
        raise InputError(f"which must name disturbances by number, 0 to {count - 1}, got {which!r}")
    if est.noise_std is None:
        raise InputError("tune needs noise_std to start from; noise=True then finds it with the walks")
    record = Record(est, y, u, time)
    ranges = [_range(est, i, record.seconds) for i in which]
    ranges += [FACTORS] if noise else []

    def split(values):
        """Return the walk of each disturbance, and the factor of the noise."""
        walks = np.array([q.walk for q in est.plant.disturbances], float)
        walks[which] = values[: len(which)]
        return walks, values[-1] if noise else 1.0

    def likelihood(values):
        return record.loglik(*split(values))

    best = np.array([grid[len(grid) // 2] for grid in ranges])
    for _ in range(2 if len(ranges) > 1 else 1):
        for i, grid in enumerate(ranges):
            best[i] = grid[np.argmax(_along(likelihood, best, i, grid))]
    box = [(math.log(grid[0]), math.log(grid[-1])) for grid in ranges]
    start = np.log(best)
    simplex = np.vstack([start, start + np.diag([-1.0 if s > b[1] - 1 else 1.0 for s, b in zip(start, box)])])
    options = {"initial_simplex": simplex, "xatol": 1e-3, "fatol": NEAR, "maxfev": 300 * len(box)}
    found = minimize(lambda v: -likelihood(np.exp(v)), start, method="Nelder-Mead", bounds=box, options=options)
    best, value = np.exp(found.x), -float(found.fun)
    for i in range(len(which)):
        without = np.where(np.arange(len(best)) == i, 0.0, best)
        if likelihood(without) > value - NEAR:
            best, value = without, likelihood(without)
    none = np.where(np.arange(len(best)) < len(which), 0.0, best)
    walks, factor = split(best)
    changed = [q._replace(walk=float(walk)) for q, walk in zip(est.plant.disturbances, walks, strict=True)]
    std = (factor * est.noise_std).tolist()
    tuned = est.replace(disturbances=tuple(changed), noise_std=std)
    gain = value - likelihood(none)
    tried = np.array(ranges[: len(which)])
    logliks = np.array([_along(likelihood, best, i, grid) for i, grid in enumerate(tried)])
    words = _words(est.plant.disturbances, which, walks, tuned.noise_std if noise else None, gain, len(y))
    tuned.tuned = Tuned(walks, tuned.noise_std, math.inf, value, gain, tried, logliks, words)
    return tuned


def tune_window(est, y, u, time):
    """Return the estimator with the window that predicts the next sample best: its log predictive density is highest.

    Lengths grow by a tenth; around the best all are tried, or sixty. They are compared on the same samples.
    """
    first = int(SHARE * len(y))
    logliks: dict[int, float] = {}

    def made(length):
        return est.replace(window=length * est.dt)

    def likelihood(length):
        if length not in logliks:
            trace = made(length).scan(y, u, time=time, keep="innovations")
            e, T = trace.innovation[first:], trace.variance[first:]
            known = ~np.isnan(e)
            if np.any(T[known] == 0):
                raise InputError("y is exactly what the plant says: without noise every window predicts alike")
            logliks[length] = float(-0.5 * np.sum(np.log(2 * math.pi * T[known]) + e[known] ** 2 / T[known]))
        return logliks[length]

    length = best = shortest = _shortest(made, est.plant.m, first)
    while length <= min(first, FAR * best):
        best = max(best, length, key=likelihood)
        length = max(length + 1, round(LONGER * length))
    low, high = max(shortest, int(best / AROUND)), min(first, math.ceil(best * AROUND))
    stride = max(1, (high - low) // CLOSELY)
    best = max((*range(low, high + 1, stride), best), key=likelihood)
    best = max(range(max(shortest, best - stride + 1), min(first, best + stride - 1) + 1), key=likelihood)
    tried = np.array(sorted(logliks))
    values, tuned = np.array([logliks[n] for n in tried]), made(best)
    gain = logliks[best] - logliks[shortest]
    at_end = {
        shortest: "; it is the shortest that tells the unknowns apart",
        int(tried[-1]): "; it is the longest tried, the record is short for it",
    }
    words = (
        f"A window of {tuned.window:.4g} s, {best} samples, predicts the next of {len(y) - first} samples best"
        f"{at_end.get(best, '')}. Lengths from {shortest} to {tried[-1]} were tried."
    )
    walks = np.zeros(len(est.plant.disturbances))
    tuned.tuned = Tuned(
        walks, est.noise_std, tuned.window, logliks[best], gain, tried[None] * est.dt, values[None], words
    )
    return tuned


def _shortest(made, least, most) -> int:
    """Return the smallest number of samples that makes a window."""
    for length in range(least + 1, most):
        try:
            made(length)
        except InputError:
            continue
        return length
    raise InputError(
        f"the record is too short to tune a window: a quarter of it, {most} samples, tells no unknowns apart"
    )


def _along(likelihood, best, i, grid):
    """Return the likelihoods along one axis through ``best``."""
    return [likelihood(np.where(np.arange(len(best)) == i, value, best)) for value in grid]


def _range(est, i, seconds) -> np.ndarray:
    """Return walks of one disturbance, from one that the record cannot show to one that outweighs the noise at once."""
    system = _alone(est, i)
    growth = max(float(system.modes.real.max()), 0.0)
    horizon = min(seconds, 3.0 / growth) if growth > 0 else seconds
    reach = [np.sqrt(np.diag(system.H @ system.noise(t) @ system.H.T)) / est.noise_std for t in (horizon, est.dt)]
    low, high = LITTLE / reach[0].max(), MUCH / reach[1].max()
    return np.geomspace(low, high, max(int(PER_DECADE * math.log10(high / low)) + 1, 2))


def _words(given, which, walks, noise_std, gain, samples) -> str:
    names = [q.name or ("the disturbance" if len(walks) == 1 else f"disturbance {i}") for i, q in enumerate(given)]
    moving = [f"{names[i]} walks by {walks[i]:.3g} in one second" for i in which if walks[i] > 0]
    still = [names[i] for i in which if walks[i] == 0]
    parts = ["; ".join(moving)] if moving else []
    parts += [f"{' and '.join(still)}: the walk is at its lower limit, the record shows none"] if still else []
    parts += [f"noise deviation {', '.join(f'{s:.3g}' for s in noise_std)}"] if noise_std is not None else []
    text = ". ".join(p[0].upper() + p[1:] for p in parts)
    return f"{text}. The log-likelihood of {samples} samples is {gain:.4g} higher than without any walk."
