"""Messages of one series that come apart are joined on the clock of its output; a pure function and its state."""

from __future__ import annotations

import math
from bisect import bisect_right, insort
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from .sender_clock import SenderClock

MOST = 10_000  # rows, and values of each input, that wait


@dataclass(frozen=True)
class Clock:
    """How messages are joined.

    Attributes
    ----------
    tolerance : s that an input may be later than the output it belongs to
    hold : s that the value of an input stays good; none older than this is used
    lag : s that a row waits for others that come out of order
    """

    tolerance: float = 0.0
    hold: float = math.inf
    lag: float = 0.0

    @property
    def wait(self) -> float:
        """Seconds by which the newest stamp of a series must be ahead of a row that is let go."""
        return self.tolerance + self.lag


class Row(NamedTuple):
    """An output with the inputs that belong to it."""

    time: float
    output: float
    inputs: tuple[float, ...]


@dataclass
class Waiting:
    """What is remembered of one series between two messages.

    rows : outputs that wait, [time, output], in order of time
    known : of each input, [time, value] in order of time: the last that is good, and those still to be used
    newest : the latest stamp of any of its messages
    sender : its clock
    """

    rows: list[list[float]] = field(default_factory=list)
    known: list[list[list[float]]] = field(default_factory=list)
    newest: float = -math.inf
    sender: SenderClock = field(default_factory=SenderClock)

    def as_json(self) -> Any:
        """Return it as JSON has it."""
        return [self.rows, self.known, None if math.isinf(self.newest) else self.newest, *self.sender.as_json()]

    @classmethod
    def of(cls, found: Any) -> Waiting:
        """Return what `as_json` gave."""
        rows, known, newest, *sender = found
        return cls(rows, known, -math.inf if newest is None else newest, SenderClock(*sender))


def join(
    state: Waiting, clock: Clock, times: list[float], output: list[float] | None, inputs: list[list[float] | None]
) -> list[Row]:
    """Take stamps with values of the output and of inputs (None: not in this message); return the rows that can go.

    A row is one output, with the newest value of each input that is no later than ``tolerance`` behind it and no older
    than ``hold``; NaN where there is none. It goes when a stamp of its series is ``wait`` seconds ahead of it, at once
    where nothing is to be waited for or all of it came in one message. Rows go in order of time; what comes after a
    later row has gone, goes at once, for the fleet to count as late. The rows do not depend on the order in which
    messages came, as long as it is within ``lag`` and ``tolerance``.

    Notes
    -----
    Bad at: an input that comes once a day, unless ``hold`` is longer; and the last row of a series that ends, which
    waits for a stamp that never comes, unless ``lag`` and ``tolerance`` are 0.
    """
    is_whole = output is not None and None not in inputs
    if is_whole and not clock.wait and not state.rows:
        _newest(state, times)
        return [Row(t, y, tuple(u)) for t, y, *u in zip(times, output or (), *(values or () for values in inputs))]
    if not state.known:
        state.known = [[] for _ in inputs]
    for known, values in zip(state.known, inputs):
        for pair in zip(times, values or ()):
            if not math.isnan(pair[1]):
                insort(known, list(pair))
        del known[:-MOST]
    for pair in zip(times, output or ()):
        insort(state.rows, list(pair))
    _newest(state, times)
    ready = bisect_right(state.rows, state.newest - clock.wait, key=lambda row: row[0])
    ready = max(ready, len(state.rows) - MOST)
    gone = [Row(t, y, tuple(_value(known, t, clock) for known in state.known)) for t, y in state.rows[:ready]]
    del state.rows[:ready]
    first = state.rows[0][0] if state.rows else state.newest - clock.wait
    for known in state.known:  # the last that is good for the next row stays
        del known[: max(bisect_right(known, first, key=lambda pair: pair[0]) - 1, 0)]
    return gone


def _newest(state: Waiting, times: list[float]) -> None:
    if times:
        state.newest = max(state.newest, max(times))


def _value(known: list[list[float]], time: float, clock: Clock) -> float:
    """Return the value of an input at an instant, NaN where none is good."""
    at = bisect_right(known, time + clock.tolerance, key=lambda pair: pair[0]) - 1
    return known[at][1] if at >= 0 and time - known[at][0] <= clock.hold else math.nan
