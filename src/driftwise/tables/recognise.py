"""Roles of the columns of a table that nobody described: the clock, the output, what drives it, what is neither."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from driftwise.engine.errors import InputError

from ..engine.validation import size
from ..results.numbers import instant, lasting, reading, usual_unit
from .calendar import starts_over
from .cleaning import judged
from .column_candidates import propose_inputs, propose_output
from .column_roles import SECONDS, Name, parse
from .counts import Count, counted
from .derived import derived, is_copy
from .one_column import Column, barred_by_itself, is_event, measured
from .sampling import Sampling, judge_sampling, skips_ticks
from .stuck_sensor import stuck
from .table_words import notes_of, words_of

SHOWN = 8  # columns that a message lists
LARGE = "numbers beyond 1e100"
OUT_OF_STEP = 0.05  # share of stamps that may go back


class Reading(NamedTuple):
    """One way to read a table: its output and inputs, what speaks for it, and how likely it is, from 0 to 1."""

    output: str
    inputs: tuple[str, ...]
    evidence: str
    share: float


@dataclass(frozen=True)
class Table:
    """What was recognised of a table from its first rows.

    Attributes
    ----------
    columns : `Column` of each column, in the order of the table
    output, inputs, time : the names that play a part; time None where there is no clock
    sampling : `Sampling`, in seconds where the unit of the clock is known
    count : `Count`: what the numbers of the time column count
    timed : whether the clock is in seconds; if not, its unit is not known
    rows : rows that were looked at
    given : the parts that the caller gave
    stacked, recordings : the columns that tell recordings apart that stand one below the other, () where there are
        none, and how many they are
    otherwise : how its rows are read, where that is not as they stand; a sentence each
    rivals : columns that may be the output as well, as far as their names go; () where names decide
    alternatives : `Reading` of each that the evidence leaves open, the likelier first; () where it decides
    notes : what an engineer should know, a sentence each
    words : the proposal in one paragraph
    """

    columns: tuple[Column, ...]
    output: str
    inputs: tuple[str, ...]
    time: str | None
    sampling: Sampling
    count: Count
    timed: bool
    rows: int
    given: frozenset[str] = frozenset()
    stacked: tuple[str, ...] = ()
    recordings: int = 0
    otherwise: tuple[str, ...] = ()
    rivals: tuple[str, ...] = ()
    alternatives: tuple[Reading, ...] = ()
    notes: tuple[str, ...] = ()
    words: str = ""

    @property
    def is_ambiguous(self) -> bool:
        """Whether two readings of the table are about as likely: a person should say which."""
        return len(self.alternatives) > 1

    @property
    def dt(self) -> float:
        """Step of the clock; 1 without a time column."""
        return self.sampling.dt

    @property
    def step(self) -> str:
        """How often a sample comes, in words."""
        if self.timed:
            return f"every {lasting(self.dt)}"
        return "no clock" if self.time is None else f"clock {self.time!r}, unit unknown"

    def lasting(self, span: float) -> str:
        """Return a span of the clock as one would say it: in samples where its unit is not known."""
        said = lasting(span) if self.timed else f"{span / self.dt:.3g} samples"
        return "1 sample" if said == "1 samples" else said

    def lasting_between(self, span: float, low: float, high: float) -> tuple[str, str]:
        """Return a span as `lasting` does and its interval in the same unit, which is said once."""
        unit, size = usual_unit(span) if self.timed else ("samples", self.dt)
        return self.lasting(span), f"{low / size:.3g} to {high / size:.3g} {unit}"

    def at(self, time: float, origin: str | None = None) -> str:
        """Return an instant of the clock as a phrase; ``origin`` is the time stamp of second 0."""
        if self.timed or origin is not None:
            return f"at {instant(time, origin)}"
        return f"at {self.time} = {reading(time)}" if self.sampling.kind != "none" else f"at sample {time:.0f}"

    def __getitem__(self, name: str) -> Column:
        return next(column for column in self.columns if column.name == name)

    def __str__(self) -> str:
        return "\n".join([self.words, *self.notes])


def recognise(
    columns: Mapping[str, Any],
    output: str | None = None,
    inputs=None,
    time: str | None = None,
    units: Mapping[str, str] | None = None,
    stamps=(),
    tens: Mapping[str, int] | None = None,
    beyond=(),
    parts=(),
) -> Table:
    """Recognise a table by the first rows of its columns.

    Names decide first, statistics where they are silent; what is proposed is said in `words`, and is a proposal.

    Parameters
    ----------
    columns : name -> float array (T,), NaN where missing; None for a column of text
    output, inputs, time : names, where they are known; `inputs=()` for none
    units : unit per name, where a row of units gives one
    stamps : names of the columns that were time stamps and are seconds now
    tens : power of ten per name that the numbers of a column were divided by
    beyond : names of columns of numbers that are beyond 1e100, which are None among ``columns``
    parts : names of the columns that stamps are made of: years, days, hours

    Examples
    --------
    >>> t = np.arange(300) * 0.5
    >>> heat = np.sign(np.sin(t)) + 2
    >>> table = recognise({"t_s": t, "heater [%]": heat, "temp [degC]": 20 + np.cumsum(heat - 2), "fault": 0 * t})
    >>> table.time, table.inputs, table.output, table.dt
    ('t_s', ('heater [%]',), 'temp [degC]', 0.5)
    """
    units = units or {}
    rows = max((len(values) for values in columns.values() if values is not None), default=0)
    if not rows:
        unusual = f"Some are {LARGE}: is their unit far too small?" if beyond else "Is the decimal mark unusual?"
        raise InputError(f"the table has no column of numbers: nothing can be estimated. {unusual}")
    given = {"output": output, "inputs": inputs, "time": time}
    inputs = (inputs,) if isinstance(inputs, str) else inputs
    for name in (output, time, *(inputs or ())):
        if name is not None and columns.get(name) is None:
            there = ", ".join(n for n, values in columns.items() if values is not None)
            if name in beyond:
                raise InputError(
                    f"column {name!r} has {LARGE}, of which no square is a number. Is its unit far too small?"
                )
            raise InputError(f"no column of numbers {name!r}; those of numbers are: {there}.")
    names = {name: parse(name, units.get(name, "")) for name in columns}
    numbers = {name: np.asarray(values, float) for name, values in columns.items() if values is not None}
    beliefs = judged(numbers)
    clean = {name: np.where(beliefs[name][1], np.nan, values) for name, values in numbers.items()}
    found = {
        name: Column(name, "text", LARGE if name in beyond else "words, not numbers", names[name].unit)
        for name in columns
    }
    found |= {name: measured(name, values, names[name].unit, *beliefs[name]) for name, values in numbers.items()}
    for name in (output, time):
        if name is not None and found[name].role in ("constant", "empty"):
            raise InputError(
                f"column {name!r} in the first {rows} rows: {found[name].why}, which tells nothing. Is it "
                "a set point, or was the sensor not connected?"
            )
    wanted = {name for name in (output, *(inputs or ())) if name is not None}
    if time is None:
        time = _clock(columns, names, frozenset(stamps), wanted)
    clock = columns[time] if time is not None else None
    known = counted(clock, names[time]) if time is not None and time not in stamps else None
    count = known or Count(1.0)
    _take_stuck(found, clean, names, {time, *stamps})
    barred = {name: barred_by_itself(names[name], found[name], clean[name]) for name in clean if name != time}
    barred |= {name: ("counter", "a part of the dates") for name in parts if name in clean and not barred.get(name)}
    signals = {name: clean[name] for name in clean if name not in {time, *stamps} and not barred[name]}
    why = derived(signals, {name: _standing(names[name]) + 20.0 * (name in wanted) for name in signals})
    barred |= {name: ("duplicate" if is_copy(reason) else "computed", reason) for name, reason in why.items()}
    barred = {name: bar for name, bar in barred.items() if name not in wanted}
    for stamp in stamps:
        barred[stamp] = ("counter", "a second clock" if time else "dates that go back as often")
    free = [name for name in clean if name != time and not barred.get(name)]
    done = [name for name in free if is_event(names[name], clean[name])]
    chosen = "given"
    rivals: tuple[str, ...] = ()
    if output is None and not set(free) - set(inputs or ()):
        why = {n: barred[n][1] if barred.get(n) else "the clock" if n == time else "an input" for n in clean}
        why |= {name: found[name].why for name in columns if name not in why}
        shown = [f"{name!r} ({reason})" for name, reason in why.items()][:SHOWN]
        more = f" and {len(why) - SHOWN} more" if len(why) > SHOWN else ""
        raise InputError(f"no column looks like an output: {', '.join(shown)}{more}. If one is, name it as the output.")
    if output is None:
        switches = [name for name in free if np.unique(clean[name][np.isfinite(clean[name])]).size <= 2 or name in done]
        output, chosen, rivals = propose_output(free, {n: names[n] for n in free}, set(inputs or ()), switches)
    if inputs is None and free == [output]:  # a step and its response: the mark may be the input
        marks = [name for name, bar in barred.items() if bar and bar[0] == "label" and names[name].may_act]
        free += marks
        barred = {name: bar for name, bar in barred.items() if name not in marks}
    if inputs is None:
        others = [name for name in free if name != output]
        acting = [name for name in others if name not in done] or others  # alone it may be a test by one step
        inputs, why, helps = propose_inputs(output, acting, names, clean)
    else:
        why, helps = {}, {}
    final = []
    for name, column in found.items():
        role, reason = barred.get(name) or (column.role, column.why)
        if name == time:
            role, reason = "time", "given" if given["time"] else "the clock"
        elif name == output:
            role, reason = "output", chosen
        elif name in inputs:
            role, reason = "input", "given" if given["inputs"] is not None else why.get(name, "")
        elif role == "spare" and name in done:
            role, reason = "event", "says when something was done"
        elif role == "spare":
            reason = why.get(name, reason)
        ten = (tens or {}).get(name, 0)
        final.append(replace(column, role=role, why=reason, helps=helps.get(name, 0.0), ten=ten))
    timed = time in stamps or known is not None
    rows_of = np.column_stack([clean[name] for name in (output, *inputs)])
    every = np.column_stack(list(signals.values())) if signals else None
    sampling = judge_sampling(count.time(clock), rows_of, every) if clock is not None else Sampling("none", 1.0)
    said = frozenset(key for key, value in given.items() if value is not None)
    return worded(Table(tuple(final), output, tuple(inputs), time, sampling, count, timed, rows, said, rivals=rivals))


def on_clock(table: Table, dt: float) -> Table:
    """Return the table with rows ``dt`` seconds apart; an error where its clock says otherwise.

    Examples
    --------
    >>> on_clock(recognise({"y": np.sin(np.arange(50.0))}), 0.1).step
    'every 0.1 s'
    """
    dt = size("dt", dt)
    if table.timed and abs(table.dt - dt) > 0.01 * dt:
        raise InputError(f"dt is {dt:g} s, but {table.time!r} steps by {table.dt:g} s. Leave dt out, or that column.")
    if table.timed:
        return table
    s, unit = table.sampling, dt / table.dt
    s = s._replace(dt=dt, longest=unit * s.longest, low=unit * s.low, high=unit * s.high)
    return worded(replace(table, sampling=s, count=Count(unit * table.count.seconds), timed=True))


def worded(table: Table) -> Table:
    """Return the table with what is to be said of it."""
    return replace(table, notes=tuple(notes_of(table)), words=words_of(table))


def _take_stuck(found: dict[str, Column], clean, names: dict[str, Name], clocks) -> None:
    """Take the readings of stuck sensors out of the columns, and note them; what is set by somebody may rest."""
    moving = {n: v for n, v in clean.items() if n not in clocks and not np.all(np.diff(v[np.isfinite(v)]) >= 0)}
    sensors = [n for n in moving if not names[n].kinds & {"setpoint", "actuator", "label", "counter"}]
    segments = {n: stuck(moving[n], [v for other, v in moving.items() if other != n]) for n in sensors}
    for name in sensors:
        belief = found[name].belief
        if segments[name] and belief is not None:
            still = min(int(np.isfinite(clean[name][one.start : one.stop]).sum()) for one in segments[name])
            found[name] = replace(found[name], stuck=tuple(segments[name]), belief=belief._replace(still=still))
            for one in segments[name]:
                clean[name][one.start : one.stop] = np.nan


def _clock(columns, names: dict[str, Name], stamps: frozenset[str], wanted) -> str | None:
    """Return the name of the time column, None if there is none."""
    best, best_score = None, 0.0
    filled = (n for n, v in columns.items() if v is not None and np.isfinite(v[len(v) // 2 :]).any())
    first = next(filled, None)  # column of numbers
    for name, values in columns.items():
        if values is None or name in wanted:
            continue
        score = 3.0 if name in stamps else 2.0 if "time" in names[name].kinds else 0.0
        steps = np.diff(values[np.isfinite(values)])
        if not np.any(steps > 0):
            continue
        if np.mean(steps < 0) > OUT_OF_STEP and not (score >= 2.0 and starts_over(values)):
            continue
        if score == 0.0 and "calendar" in names[name].kinds and np.all(steps >= 0) and np.mean(steps > 0) > 0.5:
            score = 1.5  # hours that go on, not those of the day
        if score == 0.0 and names[name].unit in SECONDS and np.all(steps > 0) and name == first:
            score = 1.25  # a row of units says so
        if score == 0.0:  # no word for it: the first column, if it ticks, each row or not
            ticks = name == first and np.all(steps > 0) and np.ptp(steps) <= 0.02 * np.median(steps)
            ticks &= not (np.all(steps == 1) and values[0] in (0, 1))  # an index, not a clock
            ticks |= name == first and skips_ticks(values[np.isfinite(values)])
            if not ticks or names[name].kinds:
                continue
            score = 1.0
        score += 0.5 * (np.mean(steps > 0) > 0.9) + 0.25 * (score >= 3.0 and not np.any(steps < 0))
        if score > best_score:
            best, best_score = name, score
    return best


def _standing(name: Name) -> float:
    """Return how much a name speaks for a signal of its own, where one of several is computed from the others."""
    order = ("computed", "output", "quantity", "setpoint", "disturbance", "drive", "device", "command")
    kind = next((kind for kind in order if kind in name.kinds), "")
    return -5.0 * bool(kind) if kind in ("", "computed") else 10.0 - order.index(kind)
