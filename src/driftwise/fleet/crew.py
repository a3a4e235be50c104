"""Samples of many series, in any order, through the compiled loop: sorted by row, split over threads."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import numpy as np

from ..engine import compile, simd_fleet
from ..engine.errors import InputError
from ..estimators.common.vectorizable import FIT
from .grouping import group_samples, place

FEW = 1_000_000  # samples up to which a loop of the fleet's own, seconds to compile once, is not worth having
STRETCHES = 50_000  # of samples of one series: up to which a step of Python for each is not too many
SMALL = 4096  # samples for which a second thread is not worth waking
MANY = 5_000_000  # samples after which the lanes' loop, which takes seconds to compile once, is worth having
LINE = 8  # numbers in a line of a processor's cache


class Crew:
    """The compiled loop of one form of estimator, and the threads that share it."""

    def __init__(self, estimator, threads: int | None = None, lanes: bool | None = None):
        policies = estimator.policies
        self.fits_lanes = all(type(policy) in FIT for policy in policies)
        self.lanes, self.seen = lanes, 0
        self.kinds, self.sizes = tuple(map(type, policies)), compile.sizes(policies[0])
        self.width = estimator.dtype.itemsize // 8
        self.outputs, self.inputs = estimator.outputs or 1, estimator.model.inputs
        self.numbers, self.room = len(estimator.spec), estimator.scratch_size
        self.columns = estimator.n_columns
        self.drive = estimator.drive if estimator.pauses else None
        self.threads = threads or os.cpu_count() or 1
        self._brief: dict[int, bool] = {}  # by columns: the loop of one series is there, the fleet's own is not
        self._stretches = 0
        self._pool: ThreadPoolExecutor | None = None

    def shapes(self, columns: int) -> tuple[int, ...]:
        """Return the sizes that a loop is compiled for, where it writes so many columns."""
        if columns != 4 * self.outputs and columns < self.columns:  # the loop would write beyond a row
            raise InputError(f"columns must be {4 * self.outputs}, or {self.columns} and more, got {columns}")
        return self.width, self.outputs, self.inputs, columns, self.numbers, self.room

    def loop(self, columns: int) -> Any:
        """Return the compiled loop that writes so many columns."""
        return compile.crew(self.kinds, self.sizes, self.shapes(columns))

    @property
    def is_wide(self) -> bool:
        """Whether eight series at a time shall take the next samples."""
        return self.fits_lanes and (self.seen > MANY if self.lanes is None else self.lanes)

    def is_brief(self, members: int, columns: int) -> bool:
        """Say whether the loop of one series shall do, which is there: the fleet's own is not, and there is little."""
        self._stretches += members
        if self.seen > FEW or self._stretches > STRETCHES:
            return False
        if columns not in self._brief:  # asked once: it takes a look at the disk
            has_own = compile.has_crew(self.kinds, self.sizes, self.shapes(columns))
            self._brief[columns] = not has_own and compile.has_driver(self.kinds)
        return self._brief[columns]

    def fetch(self, rows) -> None:
        """Bring the rows here: they are."""

    def advance(self, rows, at, ys, us, specs, group, columns: int) -> np.ndarray:
        """Advance ``rows`` in place, sample i belonging to row ``at[i]``; return what each showed, (n, columns).

        Samples of one row are taken in the order they stand in; rows may be mixed in any way. Each thread takes series
        that have about as many samples as those of the others, and nothing is copied: the loop finds a sample by its
        number.
        """
        outs = table(len(at), columns)
        if not len(at):
            return outs
        at = np.ascontiguousarray(at, np.int64)
        members, starts, order, is_open = group_samples(at, len(rows))
        self.seen += len(at)
        shapes, lanes = self.shapes(columns), None
        if self.is_wide and not self.drive:
            lanes = simd_fleet.lane_crew(self.kinds, self.sizes, shapes)
        if self.drive:
            loop = one_by_one(self.drive)
        elif lanes is None and self.is_brief(len(members), columns):
            loop = one_by_one(compile.driver(*self.kinds))
        else:
            loop = lanes or self.loop(columns)
        count = 1 if len(at) < SMALL or self.drive else min(self.threads, len(members))

        def part(first, last):
            if first < last:
                own = members[first:last], starts[first : last + 1]
                if is_open:
                    place(at, *own, order)
                space: tuple[np.ndarray, ...] = ()
                if lanes:
                    space = simd_fleet.turns(*own, group), *simd_fleet.room(shapes)
                loop(rows, *own, order, ys, us, outs, specs, group, np.empty(self.room), *space)

        if count == 1:
            part(0, len(members))
        else:
            cuts = np.searchsorted(starts, np.linspace(0, len(at), count + 1)).clip(0, len(members))
            self._pool = self._pool or ThreadPoolExecutor(self.threads - 1)
            others = [self._pool.submit(part, *cut) for cut in pairwise(cuts[1:])]
            part(cuts[0], cuts[1])  # this thread takes its share
            for other in others:
                other.result()
        return outs


def table(rows: int, columns: int) -> np.ndarray:
    """Return an empty table that begins with a line of the cache: no row of four numbers, or of eight, lies in two.

    Samples of a fleet in order of time are far apart, and the loop fetches the line in which a row begins.
    """
    room = np.empty(rows * columns + LINE)
    first = -(room.ctypes.data // room.itemsize) % LINE
    return room[first : first + rows * columns].reshape(rows, columns)


def one_by_one(drive):
    """Return the loop of a fleet, made of the one of a series: the same bits."""

    def go(rows, members, starts, order, ys, us, outs, specs, group, scratch):
        for row, first, last in zip(members, starts, starts[1:]):
            part = order[first:last] if order.size else slice(first, last)
            told = outs[None, part]
            drive(rows[row : row + 1], ys[None, part], us[None, part], told, specs[group[row]], scratch)
            if order.size:  # it was a copy
                outs[part] = told[0]

    return go
