"""Signals of which many are others some samples later: what a filter makes of those says what it makes of all."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from ..models.filtering import filter_rows


class Copies(NamedTuple):
    """P signals: which of ``signals`` (m, T) each of them is, and after how many samples; zero before the record."""

    signals: np.ndarray
    places: tuple[tuple[int, int], ...]

    def filtered(self, b, a) -> Copies:
        """Return them through the filter b/a, which is at rest before the record; a[0] is one."""
        return self._replace(signals=filter_rows(np.asarray(b, float), np.asarray(a, float), self.signals))

    @property
    def table(self) -> np.ndarray:
        """The places as one row of integers, as `filtered_rows` takes them."""
        return np.array(self.places, np.int64).ravel()

    def only(self, places) -> Copies:
        """Return some of them."""
        needed = sorted({k for k, _ in places})
        return Copies(self.signals[needed], tuple((needed.index(k), late) for k, late in places))


def copies(found: Sequence[tuple[np.ndarray, Iterable[int]]]) -> Copies:
    """Return signals (T,), each of them after each of some numbers of samples."""
    places = tuple((k, late) for k, (_, lags) in enumerate(found) for late in lags)
    return Copies(np.array([x for x, _ in found]), places)
