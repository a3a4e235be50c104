"""First rows of series, held back until there are enough of them to tell the units."""

from __future__ import annotations

import numpy as np

from .samples import Samples, rank_of


class Held:
    """Room for so many samples of each series that waits, by slot; slots are used again."""

    def __init__(self, first: int, outputs: int, inputs: int):
        shapes: dict[str, tuple] = dict(time=((), float), ys=((outputs,), float), us=((inputs,), float))
        shapes |= dict(bad=((), bool), source=((), np.int64), gap=((), np.int32))
        self.columns = {name: np.empty((0, first, *shape), kind) for name, (shape, kind) in shapes.items()}
        self._free: list[int] = []
        self._room = 0

    def slots(self, count: int) -> np.ndarray:
        """Return so many empty slots."""
        short = count - len(self._free)
        if short > 0:
            room = self._room + max(short, self._room // 4)
            for column in self.columns.values():
                column.resize((room, *column.shape[1:]), refcheck=False)  # in place where the system can
            self._free += range(room - 1, self._room - 1, -1)
            self._room = room
        found = np.array([self._free.pop() for _ in range(count)], np.int64)
        for name in ("ys", "us"):
            self.columns[name][found] = np.nan
        return found

    def put(self, slots, places, samples: Samples) -> None:
        """Keep samples, each in a place of a slot."""
        for name, column in self.columns.items():
            column[slots, places] = getattr(samples, name)

    def read(self, at, slots, counts) -> Samples:
        """Return the first ``counts`` samples of each slot, under the rows ``at`` of the fleet."""
        places = rank_of(np.append(0, np.cumsum(counts)))
        slots = np.repeat(slots, counts)
        return Samples(np.repeat(at, counts), **{name: column[slots, places] for name, column in self.columns.items()})

    def empty(self, slots) -> None:
        """Give slots back; with the last of them, the memory."""
        self._free += slots.tolist()
        if len(self._free) == self._room:
            for column in self.columns.values():
                column.resize((0, *column.shape[1:]), refcheck=False)
            self._free, self._room = [], 0
