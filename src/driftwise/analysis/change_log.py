"""What changed in a plant, and when, in the terms of an engineer: gain, speed, level and noise."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..results.numbers import odds_words, percent
from .answer_times import Slowed, slowed_by
from .change_effects import SPEED
from .events import Event, samples, when
from .growing_noise import STEADY
from .noise_jumps import LEAST
from .segmentation import ALL, GAIN, LEVEL, Hindsight, Jump, Visible, hindsight
from .unseen_inputs import expected

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
    input: int = -1  # whose gain it was
    share: str = ""  # what moved, as a share of what it was: where the gain itself is not known
    events: tuple[Event, ...] = ()  # what was done then

    @property
    def beside(self) -> str:
        """What moved, and what was done then."""
        return self.moved + when(self.events)

    @property
    def what(self) -> str:
        """The same with the odds, without the time."""
        return f"{self.beside} (odds {odds_words(self.odds)})"

    def spans_any(self, times) -> bool:
        """Whether it may have happened at one of some times."""
        return any(self.times[0] <= time <= self.times[1] for time in times)


class ChangeLog:
    """Changes of a record that comes in pieces; the end of the last piece is looked at together with the next."""

    def __init__(self, inputs=(), is_held=False, seasons: tuple[int, ...] = (), table: Any = None, events=()):
        self.table = table  # which says how long so many seconds are
        self.seasons = seasons  # that the level may have, or with which the noise comes and goes, in samples
        self.events: tuple[Event, ...] = events  # which the table says that were done
        self.inputs, self.count = inputs, 0
        self.changes: list[Change] = []
        self.is_held = is_held  # whether inputs are known at some rows alone, and were held between them
        self.last: Change | None = None
        self.hindsight: Hindsight | None = None  # of the last piece
        self.visible: Visible | None = None  # the smallest jumps that would have been told of it
        self.growth = STEADY  # of its noise with the level
        self.waits = np.zeros(0)
        self._tail: tuple | None = None
        self.samples = 0

    def add(self, y, u, time) -> None:
        """Take in the next piece: y (T,), u (T, k), and its times."""
        before = 0
        if self._tail is not None:
            before = len(self._tail[0])
            y, u, time = (np.concatenate(pair) for pair in zip(self._tail, (y, u, time)))
        first = self.samples - before
        known = -math.inf if self.last is None else self.last.since + 2 * LEAST
        readings = [u, unheld(y, u)] if self.is_held and u.shape[1] else [u]
        self.hindsight = hindsight(y, *readings, seasons=self.seasons, events=samples(self.events, time))
        for jump in self.hindsight.jumps() if self.hindsight else []:
            if jump.at + first > known:
                self._tell(jump, first, time)
        self.samples += len(y) - before
        self.waits = waits(y, u)
        self.visible = self.hindsight.visible() if self.hindsight else None
        self.growth = self.hindsight.growth() if self.hindsight else STEADY
        if self.visible and self.is_held and np.isinf(self.waits).any():  # what inputs do unseen is as loud as before
            self.visible = self.visible._replace(noise=math.inf)
        self._tail = y[-BEFORE:], u[-BEFORE:], time[-BEFORE:]

    def _tell(self, jump: Jump, first: int, time) -> None:
        low, high = jump.interval
        self.last = Change(
            jump.at + first, float(time[jump.at]), (low + first, high + first), (float(time[low]), float(time[high])),
            math.exp(min(jump.log_odds, 700.0)), self._moved(jump), jump.input if jump.kind == GAIN else -1,
            self._moved(jump.as_factor()) if jump.kind == GAIN else "",
            tuple(event for event in self.events if any(low <= at <= high for at in samples([event], time))),
        )  # fmt: skip
        self.count += 1
        self.changes = surest([*self.changes, self.last])

    def _moved(self, jump: Jump) -> str:
        """Return what jumped, as a phrase."""
        if jump.rival is not None:
            either = f"{moved(jump, self.inputs)}, or {moved(jump.rival, self.inputs)}"
            return f"the plant's response changed: {either}; the record cannot tell which"
        if jump.kind != SPEED or self.hindsight is None:
            return moved(jump, self.inputs)
        return faster_or_slower(slowed_by(self.hindsight.response, jump.input), self.inputs, self.table)


def faster_or_slower(found: Slowed, inputs, table=None) -> str:
    """Return how much longer, or less long, a plant takes to answer, as a phrase; ``table`` says how long that is."""
    way, (low, high) = "slower" if found.factor > 1 else "faster", found.interval
    if found.before is None or found.after is None:
        return f"{became(way, found.is_alone, found.factor)} ({low:.3g} to {high:.3g})"
    after, before = (_span(one, table) for one in (found.after, found.before))
    return (
        f"the plant became {way}: 63 % of the answer to a step of {inputs[found.input]} took {after}, before {before}"
    )


def became(way: str, is_alone: bool, factor: float) -> str:
    """Return that all time constants of a plant, or the slowest alone, are another."""
    which = "slowest time constant" if is_alone else "time constants"
    return f"the plant became {way}, its {which} {factor:.3g} times as long"


def _span(span, table) -> str:
    """Return a number of samples and its interval."""
    if table is None:
        return f"{span.time:.3g} ({span.low:.3g} to {span.high:.3g}) samples"
    said, between = table.lasting_between(*(table.dt * moment for moment in span))
    return f"{said} ({between})"


def unheld(y, u) -> np.ndarray:
    """Return inputs (T, k) that were held between the rows of an irregular clock as they are expected there."""
    rows = np.flatnonzero(np.isfinite(y) | (np.diff(u, axis=0, prepend=np.nan) != 0).any(axis=1))
    return np.column_stack([expected(x, rows) for x in u.T])


def waits(y, u) -> np.ndarray:
    """Return the mean time between measured outputs, for each input; infinite for one that moves at most of them."""
    measured = np.isfinite(y)
    gap = len(y) / max(int(measured.sum()), 1)
    moves = np.count_nonzero(np.diff(u, axis=0) != 0, axis=0)
    return np.where(moves > 0.5 * measured.sum(), np.inf, gap)


def where_known(change: Change, effects) -> Change:
    """Return a change; of a gain that is not known itself, as a share of what it was."""
    is_known = change.input < 0 or not effects or effects[change.input].is_known
    return change if is_known else replace(change, moved=change.share)


def surest(changes, most: int = MOST) -> list[Change]:
    """Return the surest of some changes, in order of time."""
    best = sorted(changes, key=lambda change: change.odds, reverse=True)[:most]
    return sorted(best, key=lambda change: change.since)


def moved(jump: Jump, inputs) -> str:
    """Return what jumped, as a phrase."""
    a, b = jump.before, jump.after
    if jump.kind == SPEED:
        return became("slower" if b > a else "faster", jump.is_alone, b / a)
    if jump.kind == LEVEL:
        of_it = "" if jump.share is None else f" ({percent(abs(jump.share))})"
        return f"the level {'rose' if b > a else 'fell'} by {abs(b - a):.3g}{of_it}"
    if jump.kind == GAIN and jump.input == ALL:
        return f"all gains {way(a, b)} to {b:.3g} of what they were"
    if jump.kind == GAIN and jump.is_factor:
        return f"the gain from {inputs[jump.input]} {way(a, b)} to {b:.3g} of what it was"
    before, after = apart(a, b)
    if jump.kind == GAIN:
        return f"the gain from {inputs[jump.input]} {way(a, b)} from {before} to {after}"
    return f"the noise {way(a, b)} from {before} to {after}"


def apart(a: float, b: float) -> list[str]:
    """Return two numbers with three digits, or as many more as tell them apart."""
    digits = next((k for k in range(3, 16) if f"{a:.{k}g}" != f"{b:.{k}g}"), 17)
    return [f"{value:.{digits}g}" for value in (a, b)]


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
