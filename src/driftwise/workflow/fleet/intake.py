"""`Intake`: rows of long tables become samples of a fleet, each series in its own units and in order of time."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from .tally import Tally

LONGEST = 10_000  # missing samples in a row that are taken as such


class Taken(NamedTuple):
    """Samples ready to advance: those of a series stand together, in order of time; series in the order of the fleet.

    at : (n,) int64 row of the fleet, ascending
    ys, us : (n, p) outputs and (n, k) inputs less their levels (`Intake.level`), NaN where missing
    time : (n,) seconds; number of the sample in its series (times dt) where the table has no clock
    source : (n,) int64 row of the table; of a filled sample the row that showed the gap
    filled : (n,) bool: no row of the table, a tick without one
    bad : (n,) bool: a cell of the row could not be read
    """

    at: np.ndarray
    ys: np.ndarray
    us: np.ndarray
    time: np.ndarray
    source: np.ndarray
    filled: np.ndarray
    bad: np.ndarray


class Intake:
    """Takes batches of a long table, and hands out samples that a fleet can advance.

    ``for taken in intake.take(batch): outs = fleet.advance(taken.at, taken.ys, taken.us)``, and after the last batch the
    same with ``intake.rest()``. What a series gets does not depend on how the table is cut into batches, bit for bit.

    Parameters
    ----------
    fleet : Fleet
        Keys that are new are added to it, in order of appearance. Series it has already keep their settings.
    dt : float, optional
        Step of the clock in the units of the time column. Ticks without a row become samples without values. If omitted,
        samples are taken one after the other whatever time lies between.
    first : int
        Rows of a series held back until they tell its units; 0: the estimator's own settings for all.
    center : bool
        Subtract the mean of the first rows.
    longest : int
        Missing ticks in a row that are filled; those beyond are counted as jumped.
    tally : Tally, optional
        Where rows that are not used are counted; ``intake.tally``.
    """

    def __init__(self, fleet, dt=None, first: int = 32, center: bool = True, longest: int = LONGEST, tally=None):
        self.fleet, self.dt, self.first, self.center, self.longest = fleet, dt, first, center, longest
        self.tally = Tally(fleet) if tally is None else tally
        self.keyless = 0  # rows without a key: not used

    @property
    def level(self) -> tuple[np.ndarray, np.ndarray]:
        """What is subtracted from outputs (S, p) and inputs (S, k) of each series of the fleet."""
        raise NotImplementedError

    def take(self, batch) -> Iterator[Taken]:
        """Return the samples of a batch, in stretches of bounded length: rows held back come with those that free them.

        ``batch`` has ``first`` (number of its first row), ``names`` (keys), ``codes`` (n,) into them, -1 where there is
        none, ``time`` (n,) or None, ``ys`` (n, p), ``us`` (n, k) and ``bad`` (n,).
        """
        raise NotImplementedError

    def rest(self) -> Iterator[Taken]:
        """Return the samples still held back, of series shorter than ``first``."""
        raise NotImplementedError

    def snapshot(self) -> dict[str, np.ndarray]:
        """Return all it remembers between two batches as arrays."""
        raise NotImplementedError

    def restore(self, found: dict[str, np.ndarray]) -> None:
        """Go on from a snapshot, with the fleet as it was then."""
        raise NotImplementedError
