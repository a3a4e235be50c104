"""What happened in a run besides ordinary samples: events, jumps among them with what moved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..engine.status import MEANING, Status
from ..models.markup import columns as table
from .numbers import odds_words
from .sentences import SOMETHING, alarm_words, direction_words, step_words, weighed_words

SAMPLES_LATER = 6  # for each parameter, until a jump is judged by what it did to the estimates
RESTS = 10  # samples at rest that are reported; regressors are all small at once by chance, too
MOVED = 3.0  # deviations by which an estimate has moved


@dataclass(frozen=True)
class Event:
    """Something that happened at a sample.

    A jump also has ``statistic`` (the detector's, over its threshold), ``since`` (the first sample after the change, as
    the detector dates it), ``parameter`` (if it names one; in fewer samples than parameters it can only guess),
    ``direction`` (1 up, -1 down, 0 not known), ``moved`` (the last two in words) and, where explanations were weighed,
    ``odds``. `AutoMemory` and `BayesianChangePoint` wait a few samples more and name the parameter whose estimate moved
    most.
    """

    sample: int
    time: float
    kind: str
    text: str
    statistic: float | None = None
    since: int | None = None
    parameter: str | None = None
    direction: int = 0
    moved: str = ""
    odds: float | None = None

    @property
    def weighed(self) -> str:
        """What a jump moved and at what odds, where explanations were weighed."""
        if self.odds is None:
            return ""
        return f"{self.moved}, odds {odds_words(self.odds)}" if self.parameter else f"odds {odds_words(self.odds)}"


class Events(list[Event]):
    """What happened, in order: a list; a notebook shows it as a table, ``print`` a line for each."""

    def __str__(self):
        return "\n".join(f"{event.sample}  {event.kind}  {event.text}" for event in self)

    def _repr_html_(self):
        named = ("sample", "time", "kind", "text", "odds")
        return table({name: [getattr(event, name) for event in self] for name in named})


def events_of(columns, limit: int) -> Events:
    """Return what happened in the columns of one output (a `Trace`, an `Output`), in order."""
    status, found = columns.status, jumps_of(columns, limit)
    for bit, text in MEANING.items():
        if bit == Status.JUMP:
            continue
        for k, end in runs(status, bit)[:limit].tolist():
            more = f" ({end - k + 1} samples)" if end > k else ""
            found.append(Event(int(k), float(columns.time[k]), str(bit.name), text + more))
    return Events(sorted(found, key=lambda event: event.sample)[:limit])


def runs(status, bit: Status) -> np.ndarray:
    """Return first and last sample of each run of a status bit, (runs, 2); of rest, those that are no chance."""
    on = (status & int(bit)) != 0
    starts = np.flatnonzero(on & ~np.concatenate([[False], on[:-1]]))
    ends = np.flatnonzero(on & ~np.concatenate([on[1:], [False]]))
    found = np.column_stack([starts, ends])
    return found[ends - starts >= RESTS - 1] if bit == Status.AT_REST else found


def jumps_of(columns, limit: int) -> list[Event]:
    """Return an event for each alarm."""
    where = np.flatnonzero(columns.status & int(Status.JUMP))[:limit]
    if not len(where):
        return []
    if columns.odds is not None and columns.has_bars:
        return [weighed(columns, int(k), int(end)) for k, end in zip(where, [*where[1:], len(columns)])]
    return [jump(int(k), float(columns.time[k]), columns.names, columns.alarm(k), columns.watches) for k in where]


def jump(sample, time, names, alarm, watches: str = "level") -> Event:
    """Return what a detector said at an alarm."""
    kind = str(Status.JUMP.name)
    if alarm is None:
        return Event(sample, time, kind, MEANING[Status.JUMP])
    statistic, since, which = alarm
    name, direction = names[int(which)] if which >= 0 else None, int(np.sign(since)) if watches else 0
    moved = SOMETHING if since else MEANING[Status.JUMP]
    if watches and since:
        moved = direction_words(watches, since, name, len(names))
    text = alarm_words(moved, statistic, since)
    first = max(sample + 1 - max(int(abs(since)), 1), 0)
    return Event(sample, time, kind, text, float(statistic), first, name, direction, moved)


def weighed(columns, sample: int, end: int) -> Event:
    """Return a jump that won against other explanations, with the parameter whose estimate it moved most.

    The estimate is that of some samples later (before ``end``), against the last one before the jump, in units of both
    their deviations; below three of them no parameter is named.
    """
    alarm = columns.alarm(sample)  # the joint filters say no more than that there was one
    statistic, since, _ = (None, 1.0, -1.0) if alarm is None else alarm
    odds = None if statistic is None else float(columns.odds ** min(statistic, 100.0))
    first = max(sample + 1 - int(since), 0)
    theta, std = columns.parameters, columns.parameters_std
    later = min(sample + SAMPLES_LATER * len(columns.names), end - 1)
    before, name, way, moved = max(first - 1, 0), None, 0, SOMETHING
    change, spread = theta[later] - theta[before], np.hypot(std[later], std[before])
    z = np.divide(change, spread, out=np.zeros(len(change)), where=spread > 0)
    most = int(np.argmax(abs(z)))
    if later > sample and abs(z[most]) > MOVED:
        name, way = columns.names[most], int(np.sign(change[most]))
        moved = step_words(name, theta[before, most], theta[later, most], int(sum(abs(z) > MOVED)) - 1)
    text = f"jump: {moved}" if odds is None else weighed_words(moved, since, odds)
    kind, time = str(Status.JUMP.name), float(columns.time[sample])
    return Event(
        sample, time, kind, text, None if statistic is None else float(statistic), first, name, way, moved, odds
    )
