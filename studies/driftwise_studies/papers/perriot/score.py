"""What a run over the plates is worth: error of the gain, of the state, jumps seen, delays, false alarms."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .hampton import SEGMENT, Path, Plant


class Score(NamedTuple):
    """Mean over records; errors of K times 1000; ``seen`` and ``delay`` of each jump."""

    error: float
    deviation: float  # standard error of ``error``
    segments: np.ndarray
    state: float  # mean square error of the filtered state over that of the filter that knows Q and R
    seen: np.ndarray
    delay: np.ndarray
    false: float


def score(path: Path, plant: Plant, x, best) -> Score:
    """Return the score of a path; ``x`` is the true state and ``best`` the optimal filter's."""
    squares = 1e3 * (path.K - plant.K[:, None]) ** 2
    runs = squares.mean(axis=0)
    seen, delay, false = detection(path.alarms, plant)
    return Score(
        float(runs.mean()),
        float(runs.std() / np.sqrt(len(runs))),
        squares.reshape(-1, SEGMENT, len(runs)).mean(axis=(1, 2)),
        float(np.mean((path.x - x) ** 2) / np.mean((best - x) ** 2)),
        seen,
        delay,
        false,
    )


def detection(alarms, plant: Plant):
    """Return the share of records that see each jump, their mean delay, and false alarms per record.

    Seen: any alarm of the right sign before the next jump; every other alarm is a false one.
    """
    jumps = SEGMENT + np.flatnonzero(np.diff(plant.K[::SEGMENT])) * SEGMENT
    seen, delay = np.zeros(len(jumps)), np.full(len(jumps), np.nan)
    for i, jump in enumerate(jumps):
        right = alarms[jump : jump + SEGMENT] == np.sign(plant.K[jump] - plant.K[jump - 1])
        found = right.any(axis=0)
        seen[i] = found.mean()
        if found.any():
            delay[i] = right.argmax(axis=0)[found].mean()
    return seen, delay, float((alarms != 0).sum(axis=0).mean() - seen.sum())


def delays(values) -> str:
    """Return mean delays as words; a jump that no record saw has none."""
    return ", ".join("–" if np.isnan(value) else f"{value:.0f}" for value in values)
