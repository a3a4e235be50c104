"""What was done to a plant, by columns of its table that step: a law, a repair, another batch.

Interventions (Box and Tiao, 1975, J. Amer. Statist. Assoc. 70, 70-79), whose effect, if any, the record tells: that one
of them did something is as likely beforehand as that something changed at any sample (`change_places`).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..engine.holding import held
from ..results.numbers import listed
from ..tables.one_column import seldom_steps
from ..tables.recognise import Table


class Event(NamedTuple):
    """A step of a column that takes no part: when, on the clock of the table, and from which value to which."""

    column: str
    time: float
    before: float
    after: float

    def __str__(self) -> str:
        return f"{self.column!r} went from {self.before:g} to {self.after:g}"


def events_of(head: dict[str, Any], table: Table) -> tuple[Event, ...]:
    """Return what was done by the first rows of a table; nothing of recordings one below the other, or other clocks.

    What somebody marked by looking at the output, an anomaly or a class, says nothing of its own, and is no event.
    """
    if table.sampling.restarts or table.stacked:
        return ()
    clock = clock_of(head, table)
    names = [one.name for one in table.columns if one.role == "event"]
    return tuple(
        Event(name, float(clock[at]), float(x[at - 1]), float(x[at]))
        for name in names
        for x in [held(np.asarray(head[name], float))]
        for at in seldom_steps(x)
    )


def when(events: Sequence[Event]) -> str:
    """Return what was done, to be said behind what changed then; "" where nothing was."""
    return f", when {listed(list(map(str, events)))}" if events else ""


def samples(events: Iterable[Event], time) -> tuple[int, ...]:
    """Return the samples, of those at some times (T,), that are the first after each event; none of those outside."""
    at = {int(np.searchsorted(time, event.time)) for event in events}
    return tuple(sorted(k for k in at if 0 < k < len(time)))


def clock_of(head: dict[str, Any], table: Table) -> np.ndarray:
    """Return the times of the first rows of a table."""
    if table.time is None:
        return table.dt * np.arange(table.rows)
    return held(table.count.time(np.asarray(head[table.time], float)))
