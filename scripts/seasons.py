"""How much seasons that the clock suggests help `identify`, and what they cost where there is none.

    python scripts/seasons.py [seed [of each kind [kind ..]]]

Draws records of `driftwise_studies.score.seasonal_worlds`. Squared errors of the second half over those without
seasonal candidates, geometric means over the records: a table of docs/decisions/seasons.md. Which candidates there are
was chosen on seeds 1 to 3.
"""

from __future__ import annotations

import sys
import warnings

import numpy as np
from driftwise_studies.score.seasonal_worlds import WORLDS

from driftwise.analysis.identifier import Identifier

ORIGINS = 12  # forecasts of several samples, of the second half


def seasonal(y, s) -> np.ndarray:
    """Return what y last was at this time of the season, before each sample."""
    found, last = np.full(len(y), np.nan), np.full(s, np.nan)
    for t, value in enumerate(y):
        found[t] = last[t % s]
        last[t % s] = value if np.isfinite(value) else last[t % s]
    return found


def drifting(y, s) -> np.ndarray:
    """Return the same, moved by what the last sample was above its own season."""
    before = seasonal(y, s)
    off = np.concatenate([[np.nan], seasonal(y - before, 1)[1:]])
    return before + off


def ahead(identifier, y, horizon) -> np.ndarray:
    """Return squared errors of the chosen model's forecasts from each origin, (origins, horizon)."""
    est, center, half = identifier.estimator, identifier.center[0], len(y) // 2
    state, done, found = None, 0, []
    for at in np.linspace(half, len(y) - horizon, ORIGINS).astype(int):
        state, done = est.scan(y[done:at] - center, state=state).state, at
        found.append((est.predict(state, horizon=horizon)[0] + center - y[at : at + horizon]) ** 2)
    return np.array(found)


def judged(name, seed, number) -> list[float]:
    """Return ratios of squared errors one step ahead, then of the chosen models' several steps ahead, then seconds."""
    rng = np.random.default_rng([seed, list(WORLDS).index(name), number])
    y, told, seasons = WORLDS[name](rng)
    half, shortest = slice(len(y) // 2, None), seasons[0]
    horizon = 2 * shortest if shortest <= 12 else shortest
    plain, ours = Identifier(), Identifier(seasons=seasons)
    innovations = [found.add(y).innovation for found in (plain, ours)]
    naive = [y - seasonal(y, s) for s in (1, shortest, seasons[-1])]
    errors = [naive[0], *naive[1:], y - drifting(y, shortest), y - told, innovations[1]]
    usual, *others = (np.nanmean(e[half] ** 2) for e in (innovations[0], *errors))
    one, last, long, drift, known, new = (value / usual for value in others)
    far = [np.nanmean(ahead(found, y, horizon)) for found in (plain, ours)]
    origins = np.linspace(len(y) // 2, len(y) - horizon, ORIGINS).astype(int)
    repeated = [y[at : at + horizon] - np.resize(y[at - shortest : at], horizon) for at in origins]
    row = [one, np.nanmin([last, long]), drift, known, new]
    return [*row, np.nanmean(np.square(repeated)) / far[0], far[1] / far[0]]


def main(seed: int = 4, each: int = 20, *kinds: str) -> None:
    warnings.simplefilter("ignore")
    print("| kind | last value | season before | and drift | who is told | now | worst | ahead: season before | now |")
    print("|---|---|---|---|---|---|---|---|---|")
    for name in kinds or WORLDS:
        rows = np.array([judged(name, seed, number) for number in range(each)])
        means = np.exp(np.nanmean(np.log(rows), axis=0))
        cells = [*means[:5], rows[:, 4].max(), *means[5:]]
        print(f"| {name} | {' | '.join(f'{value:.3f}' for value in cells)} |", flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]), *sys.argv[3:])
