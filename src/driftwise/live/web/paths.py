"""Where the parameters of a series have been: what a history of outputs does not hold."""

from __future__ import annotations

import heapq
from typing import Any

from driftwise.live.board import SeriesView

from .encode import finite

POINTS = 300  # of a path
SERIES = 1000  # that have one; the others have theirs now, and no past


class Paths:
    """Parameters over time, since the service began, of the first series that came.

    A path holds at most ``POINTS`` points: when it is full every second one goes and the next are taken half as often,
    so memory is bounded and the whole time is covered. Lost at the end of the service.
    """

    def __init__(self, points: int = POINTS, series: int = SERIES):
        self.points, self.series = points, series
        self._paths: dict[str, _Path] = {}
        self._looks = 0

    def take(self, view: SeriesView) -> None:
        """Note the parameters of `view`, if it is time."""
        if not view.parameters or view.time is None:
            return
        names = [p.name for p in view.parameters]
        path = self._paths.get(view.key)
        if path is None and len(self._paths) >= self.series:
            return
        if path is None or path.names != names:
            path = self._paths[view.key] = _Path(names)
        self._looks += 1
        path.taken = self._looks
        path.take(view, self.points)

    def due(self, keys: list[str], most: int) -> list[str]:
        """Return the keys among `keys` whose parameters were noted longest ago, those never noted first."""
        known = self._paths
        if len(known) >= self.series:
            keys = [key for key in keys if key in known]
        return heapq.nsmallest(most, keys, key=lambda key: known[key].taken if key in known else 0)

    def told(self, key: str) -> dict[str, Any]:
        """Return times, and values and deviations by parameter."""
        path = self._paths.get(key)
        if path is None:
            return {"time": [], "parameters": []}
        columns = [
            {"name": name, "value": [r[1][k] for r in path.rows], "std": [r[2][k] for r in path.rows]}
            for k, name in enumerate(path.names)
        ]
        return {"time": [r[0] for r in path.rows], "parameters": columns}


class _Path:
    def __init__(self, names: list[str]):
        self.names, self.rows = names, []  # type: list[str], list[tuple[float, list, list]]
        self.least = 0.0  # s between two points
        self.taken = 0  # the look that noted it last

    def take(self, view: SeriesView, points: int) -> None:
        time = float(view.time or 0.0)
        if self.rows and time < self.rows[-1][0] + max(self.least, 1e-9):
            return
        values, stds = ([finite(getattr(p, name)) for p in view.parameters] for name in ("value", "std"))
        self.rows.append((time, values, stds))
        if len(self.rows) > points:
            self.least = 2.0 * (self.rows[-1][0] - self.rows[0][0]) / points
            self.rows = self.rows[::2]
