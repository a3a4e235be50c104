"""A batch of a long table on its way: cells of pyarrow columns into float64, rows into a block of fixed size."""

from __future__ import annotations

from typing import Any, NamedTuple

from driftwise.engine.errors import InputError
from driftwise.tables.cells import instants, numbers


class Piece(NamedTuple):
    """Rows as a reader hands them over: a pyarrow array per column, key first, and where rows were ragged."""

    title: str
    columns: list[str]
    arrays: list[Any]
    ragged: Any
    decimal: str
    day_first: bool

    def slice(self, start: int, length: int) -> Piece:
        """Return some of the rows."""
        arrays = [array.slice(start, length) for array in self.arrays]
        return self._replace(arrays=arrays, ragged=self.ragged[start : start + length])


class Filling:
    """A block of rows that is being filled: outputs first, then inputs, then the clock if there is one."""

    def __init__(self, outputs: int, inputs: int, has_clock: bool, rows: int):
        import numpy as np

        self.ys, self.us = np.empty((rows, outputs)), np.empty((rows, inputs))
        self.time = np.empty(rows) if has_clock else None
        self.bad = np.zeros(rows, bool)
        self.keys: list[Any] = []
        self.rows, self.size = rows, 0

    @property
    def room(self) -> int:
        """Rows that are still free."""
        return self.rows - self.size

    def add(self, piece: Piece, are_stamps: bool | None) -> list[int]:
        """Take in some rows; return how many cells of each column, from the outputs on, were bad."""
        here = slice(self.size, self.size + len(piece.ragged))
        p, k = self.ys.shape[1], self.us.shape[1]
        self.keys.append(piece.arrays[0])
        self.bad[here] = piece.ragged
        found = []
        for j, (name, array) in enumerate(zip(piece.columns[1:], piece.arrays[1:])):
            try:
                if j == p + k:
                    values, bad, _ = instants(array, piece.decimal, piece.day_first, are_stamps)
                else:
                    values, bad = numbers(array, piece.decimal)
            except InputError as error:
                what = "time column" if j == p + k else "column"
                raise InputError(f"{piece.title}: {what} {name!r}: {error}.") from None
            if j < p:
                self.ys[here, j] = values
            elif j < p + k:
                self.us[here, j - p] = values
            elif self.time is not None:
                self.time[here] = values
            self.bad[here] |= bad
            found.append(int(bad.sum()))
        self.size = here.stop
        return found
