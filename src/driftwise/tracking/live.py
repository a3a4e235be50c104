"""A track while it grows: its plots and what the estimator said, a row of numbers for each plot."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

PLOT = 11  # columns of a plot: time, East, North, covariance (4), altitude; then the numbers of key, name, sensor
TENTATIVE, CONFIRMED, COASTING, ENDED = "tentative", "confirmed", "coasting", "ended"


class Event(NamedTuple):
    """Something that happened to a track: when (s), to which, what kind, and in words."""

    time: float
    track: int
    kind: str
    words: str


class Plot(NamedTuple):
    """One plot on its way through the tracker."""

    time: float
    east: float
    north: float
    covariance: tuple[float, ...]  # row by row; NaN is unknown
    altitude: float
    key: str
    name: str
    sensor: str


class Live:
    """A growing track.

    ``clock`` is what `Scans` keeps of it, ``place`` its row among the live ones, ``due`` when it is looked at next.
    """

    __slots__ = (
        "allowance", "clock", "code", "count", "due", "events", "follows", "id", "key", "last", "motion", "name",
        "odds", "period", "place", "quiet", "state", "status", "sure", "table",
    )  # fmt: skip

    def __init__(self, id: int, key: str, state: np.ndarray, follows: int | None, clock: dict[str, list[float]]):
        self.id, self.key, self.state, self.follows, self.clock = id, key, state, follows, clock
        self.name = self.code = ""
        self.status = TENTATIVE
        self.period = 0.0  # s, 0 is unknown
        self.table = np.empty((0, 0))
        self.count = 0
        self.last: Plot = None  # type: ignore[assignment]  # a track has a plot from the beginning
        self.sure: Plot = None  # type: ignore[assignment]  # the last that does not seem wild
        self.motion = 0.0, 0.0  # m/s East and North
        self.allowance = 0.0  # m: what a plot may lie beyond the reach of its class
        self.events: list[Event] = []
        self.place = -1
        self.odds = 0.0  # log odds that it is an object
        self.quiet = 0.0  # s, what `Existence` had counted
        self.due = float("inf")

    @property
    def rows(self) -> np.ndarray:
        """The rows so far: a view of numbers that never change again."""
        return self.table[: self.count]

    def append(self, plot: tuple[float, ...], out: np.ndarray) -> None:
        """Add a row; the table doubles when it is full."""
        n = self.count
        if n == len(self.table):
            table = np.empty((max(8, 2 * n), PLOT + len(out)))
            if n:
                table[:n] = self.table
            self.table = table
        row = self.table[n]
        row[:PLOT] = plot
        row[PLOT:] = out
        self.count = n + 1
