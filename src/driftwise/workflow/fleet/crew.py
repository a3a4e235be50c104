"""Samples of many series, in any order, through the compiled loop: grouped by row, split over threads."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from ...kernel import compose

SMALL = 4096  # samples for which a second thread is not worth waking


class Crew:
    """The compiled loop of one form of estimator, and the threads that share it."""

    def __init__(self, estimator, threads: int | None = None):
        policies = estimator.policies
        self.kinds, self.sizes = tuple(map(type, policies)), compose.sizes(policies[0])
        self.width = estimator.dtype.itemsize // 8
        self.outputs, self.inputs = getattr(estimator.model, "outputs", 1), estimator.model.inputs
        self.numbers, self.room = len(estimator.spec), estimator.scratch_size
        self.threads = threads or os.cpu_count() or 1
        self._pool: ThreadPoolExecutor | None = None

    def loop(self, columns: int) -> Any:
        """Return the compiled loop that writes so many columns."""
        shapes = self.width, self.outputs, self.inputs, columns, self.numbers, self.room
        return compose.crew(self.kinds, self.sizes, shapes)

    def fetch(self, rows) -> None:
        """Bring the rows here: they are."""

    def advance(self, rows, at, ys, us, specs, group, columns: int) -> np.ndarray:
        """Advance ``rows`` in place, sample i belonging to row ``at[i]``; return what each showed, (n, columns).

        Samples of one row are taken in the order they stand in; rows may be mixed in any way.
        """
        outs = np.empty((len(at), columns))
        if not len(at):
            return outs
        order = None if np.all(at[1:] >= at[:-1]) else stable_order(at, len(rows))
        if order is not None:
            at, ys, us = at[order], ys[order], us[order]
        first = np.flatnonzero(np.append(True, at[1:] != at[:-1]))
        members, starts = np.ascontiguousarray(at[first]), np.append(first, len(at))
        self._share(rows, members, starts, ys, us, outs, specs, group)
        if order is None:
            return outs
        back = np.empty_like(outs)
        back[order] = outs
        return back

    def _share(self, rows, members, starts, ys, us, outs, specs, group) -> None:
        """Let each thread take members that have about as many samples as those of the others."""
        loop, samples = self.loop(outs.shape[1]), len(ys)
        count = 1 if samples < SMALL else min(self.threads, len(members))
        cuts = np.searchsorted(starts, np.linspace(0, samples, count + 1)).clip(0, len(members))

        def part(first, last):
            loop(
                rows, members[first:last], starts[first : last + 1], ys, us, outs, specs, group, np.empty(self.room)
            )  # fmt: skip

        if count == 1:
            part(0, len(members))
            return
        self._pool = self._pool or ThreadPoolExecutor(self.threads)
        list(self._pool.map(part, cuts[:-1], cuts[1:]))


def stable_order(at, count: int) -> np.ndarray:
    """Return the order that sorts row numbers below ``count`` and keeps samples of one row as they stand."""
    order = np.argsort((at & 0xFFFF).astype(np.uint16), kind="stable")  # by counting: NumPy does so for 16 bits
    digit = 16
    while count > 1 << digit:
        high = ((at[order] >> digit) & 0xFFFF).astype(np.uint16)
        order = order[np.argsort(high, kind="stable")]
        digit += 16
    return order
