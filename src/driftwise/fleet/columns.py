"""Numbers of each series of a fleet under names, in columns that grow with the fleet."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..engine.errors import InputError


class Columns:
    """Named columns (S,) of float64, one number per series of a fleet; ``fresh`` is what each begins with."""

    def __init__(self, fresh: Mapping[str, float], size: int = 0):
        self.names = tuple(fresh)
        self._at = {name: i for i, name in enumerate(fresh)}
        self._fresh = np.array(list(fresh.values()))[:, None]
        self._numbers = np.empty((len(fresh), 0))
        self._size = 0
        self.grow(size)

    def __repr__(self):
        return f"{type(self).__name__}({len(self)} series)"

    def __len__(self) -> int:
        return self._size

    def __getitem__(self, name: str) -> np.ndarray:
        """The column of that name, (S,): a view, good until the columns grow."""
        if name not in self._at:
            raise InputError(f"there is no column {name!r}; there are {', '.join(self.names)}")
        return self._numbers[self._at[name], : self._size]

    @property
    def table(self) -> np.ndarray:
        """All of them, (S, columns), in the order of ``names``: a view, good until the columns grow."""
        return self._numbers[:, : self._size].T

    def restore(self, table) -> None:
        """Go on from a ``table`` that was kept; columns that it does not have yet, the last ones, begin."""
        self._size = 0
        self.grow(len(table))
        self._numbers[: np.shape(table)[1], : self._size] = np.asarray(table).T

    def keep(self, is_kept) -> None:
        """Forget series, (S,) True for those that stay, in order; the memory of the others is given back."""
        self._numbers = self._numbers[:, : self._size].compress(is_kept, axis=1)
        self._size = self._numbers.shape[1]

    def grow(self, size: int) -> None:
        """Make room for so many series."""
        room = self._numbers.shape[1]
        if size > room:
            wider = np.empty((len(self.names), max(size, room + room // 4)))
            wider[:, : self._size] = self._numbers[:, : self._size]
            self._numbers = wider
        self._numbers[:, self._size : size] = self._fresh
        self._size = max(size, self._size)
