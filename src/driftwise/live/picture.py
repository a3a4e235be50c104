"""`Picture`: the last of everything, series by series, and who needs a look."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..fleet.columns import Columns
from ..fleet.samples import rank_of
from ..models.quantities import NORMAL_95
from .board import SPARKLINE, EventView

WEIGHT = {
    "lost": 5.0,
    "jump": 4.0,
    "stuck": 4.0,
    "silent": 3.0,
    "drift": 3.0,
    "noise": 2.0,
    "outliers": 1.0,
    "model": 1.0,
    "clock": 1.0,
}
ONES = dict(time=np.nan, output=np.nan, prediction=np.nan, std=np.nan, status=0.0, count=0.0, revision=0.0)
ONES |= dict(number=-1.0, heard=0.0, silence=0.0, is_lost=0.0)


class Picture:
    """What is seen of each series, in columns by its slot; ``revision`` counts what has changed.

    ``number`` is that of the series, ``heard`` when something came last, ``silence`` the s after which it is lost, and
    ``is_lost`` whether it is.
    """

    def __init__(self):
        self.columns = Columns(ONES)
        self.lines = np.full((0, SPARKLINE), np.nan)
        self.last: dict[int, EventView] = {}
        self.open: dict[int, dict[int, EventView]] = {}  # of a series, events that nobody acknowledged
        self.revision = 0

    def enter(self, slot: int, number: int, silence: float) -> None:
        """Begin the picture of a series, in a slot that may have been another's."""
        self.grow(slot + 1)
        for name, value in (ONES | dict(number=number, silence=silence)).items():
            self.columns[name][slot] = value
        self.lines[slot] = np.nan
        self.last.pop(slot, None)
        self.open.pop(slot, None)

    def grow(self, size: int) -> None:
        """Make room for so many series."""
        self.columns.grow(size)
        if size > len(self.lines):
            wider = np.full((max(size, 2 * len(self.lines), 64), SPARKLINE), np.nan)
            wider[: len(self.lines)] = self.lines
            self.lines = wider

    def take(self, slots: np.ndarray, rows: np.ndarray, starts: np.ndarray) -> None:
        """Take samples (n, 6) as `History` has them, of ``slots``; those of a series stand between two ``starts``."""
        if not len(rows):
            return
        self.revision += 1
        ends = starts[1:] - 1
        series = slots[ends]
        count = self.columns["count"]
        place = (np.repeat(count[series], np.diff(starts)) + rank_of(starts)).astype(np.int64)
        self.lines[slots, place % SPARKLINE] = rows[:, 2]
        count[series] += np.diff(starts)
        for i, name in enumerate(("time", "output", "prediction", "std", "status"), 1):
            self.columns[name][series] = rows[ends, i]
        self.columns["revision"][series] = self.revision

    def recall(self, parts: list[np.ndarray], slots: dict[int, int]) -> None:
        """Show samples again that were counted before, (n, 6) each; ``slots`` are those of series by number."""
        parts = [rows[np.array([one in slots for one in rows[:, 0].tolist()], bool)] for rows in parts]
        places = [np.array([slots[one] for one in rows[:, 0].tolist()], np.int64) for rows in parts]
        for at in places:
            np.subtract.at(self.columns["count"], at, 1.0)
        for at, rows in zip(places, parts):
            order = np.argsort(at, kind="stable")
            edges = np.flatnonzero(np.append(True, np.diff(at[order]) != 0))
            self.take(at[order], rows[order], np.append(edges, len(at)))

    def lose(self, now: float) -> list[tuple[int, float]]:
        """Return the slots of which nothing has come for as long as was said, and for how long; they are lost now."""
        silence, is_lost, heard = (self.columns[name] for name in ("silence", "is_lost", "heard"))
        late = np.flatnonzero((silence > 0) & (is_lost == 0) & (heard > 0) & (now - heard > silence))
        is_lost[late] = 1.0
        return [(slot, float(silence[slot])) for slot in late.tolist()]

    def line(self, slot: int) -> tuple[float, ...]:
        """Return the last outputs of a series, oldest first."""
        count = int(self.columns["count"][slot])
        at = count % SPARKLINE
        line = self.lines[slot]
        return tuple((np.concatenate([line[at:], line[:at]]) if count > SPARKLINE else line[:count]).tolist())

    def happened(self, slot: int, event: EventView) -> None:
        """Take an event, or one that was acknowledged."""
        self.revision += 1
        self.columns["revision"][slot] = self.revision
        last = self.last.get(slot)
        if last is None or last.number <= event.number:
            self.last[slot] = event
        waiting = self.open.setdefault(slot, {})
        waiting.pop(event.number, None)
        if not event.acknowledged and event.kind != "back":
            waiting[event.number] = event
            if len(waiting) > SPARKLINE:  # bounded; all are in the store
                del waiting[next(iter(waiting))]

    def score(self, slot: int, nis: float | None) -> float:
        """Say how much a series needs a look: its gravest open event, how many, and error bars that are not true."""
        waiting = self.open.get(slot) or {}
        worst = max((WEIGHT.get(event.kind, 1.0) for event in waiting.values()), default=0.0)
        excess = abs(math.log(nis)) if nis and nis > 0 else 0.0
        return worst + 0.1 * math.log1p(len(waiting)) + max(excess - 0.5, 0.0)

    def seen(self, slot: int) -> dict[str, Any]:
        """Return fields of a `SeriesView`."""
        c = {name: float(self.columns[name][slot]) for name in ("time", "output", "prediction", "std")}
        known = {name: None if math.isnan(value) else value for name, value in c.items()}
        band = None
        if known["prediction"] is not None and known["std"] is not None:
            half = NORMAL_95 * c["std"]
            band = (c["prediction"] - half, c["prediction"] + half)
        return {
            "count": int(self.columns["count"][slot]), "time": known["time"], "output": known["output"],
            "prediction": known["prediction"], "band": band, "last_event": self.last.get(slot),
            "acknowledged": not self.open.get(slot),
        }  # fmt: skip
