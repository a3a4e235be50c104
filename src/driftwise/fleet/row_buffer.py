"""First rows of series, held back until there are enough of them to tell the units."""

from __future__ import annotations

import numpy as np

from .samples import Samples, rank_of


class RowBuffer:
    """Samples of each series that waits, in blocks of so many: a chain of them per series, known by its first.

    Blocks are used again.
    """

    def __init__(self, size: int, outputs: int, inputs: int):
        shapes: dict[str, tuple] = dict(time=((), float), ys=((outputs,), float), us=((inputs,), float))
        shapes |= dict(bad=((), bool), source=((), np.int64), gap=((), np.int32))
        self.size = size
        self.columns = {name: np.empty((0, size, *shape), kind) for name, (shape, kind) in shapes.items()}
        self._next = np.empty(0, np.int64)  # block after each, -1 where there is none
        self._free: list[int] = []

    def blocks(self, count: int) -> np.ndarray:
        """Return so many free blocks, each the only one of its chain."""
        short, room = count - len(self._free), len(self._next)
        if short > 0:
            wider = room + max(short, room // 4)
            for column in (*self.columns.values(), self._next):
                column.resize((wider, *column.shape[1:]), refcheck=False)  # in place where the system can
            self._free += range(wider - 1, room - 1, -1)
        found = np.array([self._free.pop() for _ in range(count)], np.int64)
        self._next[found] = -1
        return found

    def put(self, chains, places, samples: Samples) -> None:
        """Keep samples, each in a place of a chain."""
        blocks = self._blocks(chains, places // self.size)
        for name, column in self.columns.items():
            column[blocks, places % self.size] = getattr(samples, name)

    def read(self, at, chains, counts) -> Samples:
        """Return the first ``counts`` samples of each chain, under the rows ``at`` of the fleet."""
        places = rank_of(np.append(0, np.cumsum(counts)))
        blocks, places = self._blocks(np.repeat(chains, counts), places // self.size), places % self.size
        found = {name: column[blocks, places] for name, column in self.columns.items()}
        return Samples(np.repeat(at, counts), **found)

    def _blocks(self, chains, which) -> np.ndarray:
        """Return the blocks that are so far down their chains, which grow where they are too short."""
        blocks = chains.copy()
        for depth in range(1, which.max(initial=0) + 1):
            deeper = which >= depth
            ends = np.unique(blocks[deeper & (self._next[blocks] < 0)])
            self._next[ends] = self.blocks(len(ends))
            blocks[deeper] = self._next[blocks[deeper]]
        return blocks

    def empty(self, chains) -> None:
        """Give chains back; with the last of them, the memory."""
        while len(chains):
            self._free += chains.tolist()
            chains = self._next[chains]
            chains = chains[chains >= 0]
        if len(self._free) == len(self._next):
            for column in (*self.columns.values(), self._next):
                column.resize((0, *column.shape[1:]), refcheck=False)
            self._free = []
