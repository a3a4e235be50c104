"""How well a change could be dated: by somebody who knows the plant, the noise and all that changed, but not when."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .oracle import sight, whitener
from .plant import Plant
from .simulation import Record, disturbance, response

OUT = 0.025  # chance of a date before the interval, and of one after it
LATER = np.unique(np.geomspace(1, 10_000, 60).astype(int))  # samples from the true date at which it is looked


def dates(plant: Plant, record: Record, k: int) -> tuple[int, int]:
    """Return the 95 % interval of the date of jump k for such a one, to whom each date was as likely before."""
    at = plant.jumps[k].at
    tried = np.sort(np.concatenate((at - LATER, [at], at + LATER)))
    tried = tried[(tried > 0) & (tried < plant.samples)]
    fits = np.array([*_log_likelihoods(plant, record, k, tried)])
    chances = np.exp(fits - fits.max()) * np.gradient(tried)
    before = np.cumsum(chances) / chances.sum()
    first, last = np.searchsorted(before, [OUT, 1 - OUT])
    return int(tried[first]), int(tried[min(last, len(tried) - 1)])


def _log_likelihoods(plant: Plant, record: Record, k: int, tried):
    record, seen, spread_of_y = sight(plant, record)
    whiten = whitener(plant, record, seen, spread_of_y)

    def noise(moved: Plant) -> np.ndarray:
        known = plant.level + disturbance(moved, record.unit) + response(moved, record.u)
        return whiten(np.nan_to_num(record.y) - known)

    if plant.jumps[k].what != "noise":
        yield from (-0.5 * np.sum(noise(_moved(plant, k, at)) ** 2) for at in tried)
        return
    new, t, jump = noise(plant), np.flatnonzero(seen), plant.jumps[k]
    for at in tried:
        ratio = jump.size ** ((t >= at) * 1.0 - (t >= jump.at))
        yield -0.5 * np.sum((new / ratio) ** 2) - np.sum(np.log(ratio))


def _moved(plant: Plant, k: int, at: int) -> Plant:
    jumps = list(plant.jumps)
    jumps[k] = replace(jumps[k], at=int(at))
    return replace(plant, jumps=tuple(jumps))
