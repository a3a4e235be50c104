"""What changed in a plant, and when, in the terms of an engineer: gain, level and noise."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..results.numbers import odds_words
from .segmentation import GAIN, LEAST, LEVEL, NOISE, Jump, Visible, jumps, visible

MOST = 20  # changes that are kept, the surest
BEFORE = 1000  # samples of the piece before that are looked at again


@dataclass(frozen=True)
class Change:
    """A change of the plant: the first sample of it, where that may lie, the odds for it, and what moved."""

    since: int
    time: float  # of that sample
    interval: tuple[int, int]  # samples between which it happened, 95 %
    times: tuple[float, float]  # of these
    odds: float
    moved: str

    @property
    def what(self) -> str:
        """What moved, and the odds, without the time."""
        return f"{self.moved} (odds {odds_words(self.odds)})"


class ChangeLog:
    """Changes of a record that comes in pieces; the end of the last piece is looked at together with the next."""

    def __init__(self, inputs=()):
        self.inputs, self.changes, self.count = inputs, [], 0
        self.last: Change | None = None
        self.visible: Visible | None = None  # the smallest jumps that would have been told of the last piece
        self._tail: tuple | None = None
        self.samples = 0
        self.moved = 0  # the first sample after the last jump of level or gain; 0 where there was none

    def add(self, y, u, time, structure: tuple) -> None:
        """Take in the next piece: y (T,), u (T, k), its times, and (na, nb, nk) of the regression."""
        before = 0
        if self._tail is not None:
            before = len(self._tail[0])
            y, u, time = (np.concatenate(pair) for pair in zip(self._tail, (y, u, time)))
        first = self.samples - before
        known = -math.inf if self.last is None else self.last.interval[1] + 2 * LEAST
        for jump in jumps(y, u, *structure):
            if jump.interval[0] + first > known:
                self._tell(jump, first, time)
        self.samples += len(y) - before
        self.visible = visible(y, u, *structure)
        self._tail = y[-BEFORE:], u[-BEFORE:], time[-BEFORE:]

    def _tell(self, jump: Jump, first: int, time) -> None:
        low, high = jump.interval
        self.last = Change(
            jump.at + first, float(time[jump.at]), (low + first, high + first), (float(time[low]), float(time[high])),
            math.exp(min(jump.log_odds, 700.0)), moved(jump, self.inputs),
        )  # fmt: skip
        self.count += 1
        self.moved = self.moved if jump.kind == NOISE else self.last.since
        self.changes = surest([*self.changes, self.last])


def surest(changes, most: int = MOST) -> list[Change]:
    """Return the surest of some changes, in order of time."""
    best = sorted(changes, key=lambda change: change.odds, reverse=True)[:most]
    return sorted(best, key=lambda change: change.since)


def moved(jump: Jump, inputs) -> str:
    """Return what jumped, as a phrase."""
    a, b = jump.before, jump.after
    if jump.kind == LEVEL:
        return f"the level {'rose' if b > a else 'fell'} by {abs(b - a):.3g}"
    if jump.kind == GAIN:
        return f"the gain from {inputs[jump.input]} {way(a, b)} from {a:.3g} to {b:.3g}"
    return f"the noise {way(a, b)} from {a:.3g} to {b:.3g}"


def way(a: float, b: float) -> str:
    """Say how a number went from a to b."""
    if a * b < 0:
        return "changed its sign,"
    ratio = abs(b / a) if a else math.inf
    if 0.4 < ratio < 0.6:
        return "halved,"
    if 1.8 < ratio < 2.2:
        return "doubled,"
    return "rose" if b > a else "fell"
