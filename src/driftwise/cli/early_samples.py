"""The first rows of a run, kept whole, as they were estimated: for what cannot be done sample by sample."""

from __future__ import annotations

import numpy as np

ROWS = 2_000_000  # rows that are smoothed at most
NUMBERS = 50_000_000  # numbers that smoothing may return, 400 MB of them


def smoothing_rows(estimator) -> int:
    """Return how many rows can be smoothed in a memory that every machine has."""
    model = estimator.model
    each = 2 * model.N if model.n else 6 * model.N**2 + 12 * model.N  # covariances, for each drift that is tried
    return min(ROWS, NUMBERS // each)


class EarlySamples:
    """The first rows of a run, up to a limit; `rows` counts all of them."""

    def __init__(self, limit: int):
        self.limit, self.rows = limit, 0
        self._parts: list[tuple[np.ndarray, np.ndarray]] = []

    def add(self, trace) -> None:
        """Take in the next part of the run."""
        room = self.limit - self.rows
        if room > 0:
            self._parts.append((trace.y[:room].copy(), trace.u[:room].copy()))
        self.rows += len(trace.y)

    @property
    def is_whole(self) -> bool:
        """Whether nothing had to be left out."""
        return self.rows <= self.limit

    def record(self, rows: int | None = None):
        """Return y (T,) and u (T, k) of the first rows."""
        y, u = (np.concatenate(part) for part in zip(*self._parts))
        return y[:rows], u[:rows]
