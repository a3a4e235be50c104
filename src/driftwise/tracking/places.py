"""Where the live tracks are: a table in which the ones near a plot are found at once."""

from __future__ import annotations

import math

import numpy as np

from .live import Live, Plot

FREE = math.inf, 0.0, 0.0, 0.0  # time, East, North, allowance of a place where no track is: nothing is near


class Places:
    """A row for each live track: time and position of its last plot, and what a plot may lie beyond its reach."""

    def __init__(self):
        self.table = np.tile(FREE, (8, 1))
        self.free = list(range(8))[::-1]
        self.who: list[Live | None] = [None] * 8

    def add(self, track: Live) -> None:
        """Give a track a place."""
        if not self.free:
            n = len(self.table)
            self.table = np.concatenate([self.table, np.tile(FREE, (n, 1))])
            self.free = list(range(n, 2 * n))[::-1]
            self.who += [None] * n
        track.place = self.free.pop()
        self.who[track.place] = track

    def move(self, track: Live) -> None:
        """Write down where a track was seen last."""
        self.table[track.place] = track.sure.time, track.sure.east, track.sure.north, track.allowance

    def remove(self, track: Live) -> None:
        """Take a track's place back."""
        self.table[track.place] = FREE
        self.who[track.place] = None
        self.free.append(track.place)

    def within_reach(self, plot: Plot, fastest: float, more: float = 0.0) -> list[Live]:
        """Return the tracks whose objects can have come to a plot, or near it by ``more`` (m)."""
        time, east, north, allowance = self.table.T
        past = plot.time - time
        near = (past > 0) & (np.hypot(plot.east - east, plot.north - north) <= fastest * past + allowance + more)
        return [track for place in np.flatnonzero(near).tolist() if (track := self.who[place])]
