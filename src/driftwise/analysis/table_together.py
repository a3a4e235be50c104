"""What several columns of a table have in common, whichever of them is the output."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from ..results.numbers import listed, odds_words
from ..tables.cleaning import judged
from ..tables.column_roles import SCORES, of_motion, parse
from ..tables.recognise import Table
from .events import Event, clock_of, events_of, samples, when
from .seasons import of_table, unseasoned
from .together import MOST_COLUMNS, Together, together

BEFORE = 8  # parts of a record, one of which says at what level a column was before it changed
SIGNALS = "output", "input", "spare"  # parts of columns that may take part
RESTS = "constant", "empty", "text"  # parts of those that do not say where a body is


def together_of(head: dict[str, Any], table: Table) -> tuple[Together, ...]:
    """Return the changes that several columns have in common in the first rows of a table, on its clock.

    Columns are seen without the seasons of the clock, counts and amounts by their logarithms. Rows that come as they
    like, and recordings one below the other, are not looked at.
    """
    if table.sampling.kind == "irregular" or table.sampling.restarts or table.stacked:
        return ()
    columns, levels = unseasonal(believed(head, table), of_table(table))
    moving = of_motion((one.name, one.unit) for one in table.columns if one.role not in RESTS)
    clock, events = clock_of(head, table), events_of(head, table)
    found = (one for one in together(columns, samples(events, clock)) if is_news(one, table, moving))
    return tuple(_on_clock(_in_units(one, levels), clock, events) for one in found)


def believed(head: dict[str, Any], table: Table) -> dict[str, np.ndarray]:
    """Return the columns that may take part, a copy each, in the order of the table; NaN where not to be believed."""
    order = sorted(table.columns, key=lambda one: SIGNALS.index(one.role) if one.role in SIGNALS else len(SIGNALS))
    few = {one.name for one in [one for one in order if one.role in SIGNALS][:MOST_COLUMNS]}
    columns = {one.name: np.array(head[one.name], float) for one in table.columns if one.name in few}
    for name, (_, doubt) in judged(columns).items():
        columns[name][doubt] = np.nan
        for segment in table[name].stuck:
            columns[name][segment.start : segment.stop] = np.nan
    return columns


def unseasonal(columns: dict[str, np.ndarray], seasons) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Return columns without seasons, some of them by their logarithms, and these as they stand in the table."""
    found, levels = {}, {}
    for name, x in columns.items():
        usual = unseasoned(x, seasons)
        relative = _logarithms(x, usual, seasons)
        if relative is not None:
            levels[name] = x
        found[name] = usual if relative is None else relative
    return found, levels


def is_news(one: Together, table: Table, moving=frozenset()) -> bool:
    """Say whether a change is to be told, and not what the answer is about, nor how a body moves, by some columns.

    Where parts are known, the level of an input by which somebody acts, with the output or without, is what the model
    is about, nor is what moves the output alone told, unless inputs were found that may have answered. That a body
    turns, or climbs, its record shows all along.
    """
    return not moving.issuperset(one.names) and (table.is_ambiguous or not _is_answer(one, table))


def _logarithms(x, usual, seasons) -> np.ndarray | None:
    """Return the logarithms of a column (T,), without seasons, where they are likelier to move by steps of one size.

    ``usual`` is the column without seasons. As counts and amounts are: the larger, the louder.
    """
    there = np.isfinite(x)
    if not there.any() or x[there].min() <= 0.0:
        return None
    logs = unseasoned(np.log(x), seasons)
    before, after = (float(np.sum(np.diff(part[there]) ** 2)) / max(there.sum() - 1, 1) for part in (usual, logs))
    if not (before > 0.0 and after > 0.0):
        return None
    gained = 0.5 * there.sum() * math.log(before / after) - np.log(x[there]).sum()
    return logs if gained > 0.0 else None


def _in_units(one: Together, levels: dict[str, np.ndarray]) -> Together:
    """Return a change with sizes in the units of its columns, those of which the logarithms moved included."""
    first = max(one.since - len(next(iter(levels.values()), ())) // BEFORE, 0)
    usual = {name: float(np.nanmedian(x[first : max(one.since, 1)])) for name, x in levels.items() if name in one.moves}
    return replace(one, moves={n: usual[n] * math.expm1(by) if n in usual else by for n, by in one.moves.items()})


def _is_answer(one: Together, table: Table) -> bool:
    """Say whether a change is one of which the answer speaks: an input that acts is at another level, perhaps with what
    the output makes of it; or the output alone changed, and no input was found that may have answered to it.

    Inputs that were named act, and those whose name says that they are set; of those that were found by what they do,
    one that moves by itself is news of the table. Currents and voltages are measured as often as set: one that moves
    while the output does nothing is news, too.
    """
    others = {name for name in one.names if name != table.output}
    if not others:
        return "inputs" in table.given or not table.inputs
    return len(others) == 1 and others <= acting(table, table.output in one.names) and others <= one.moves.keys()


def acting(table: Table, is_answered: bool) -> set[str]:
    """Return the inputs that act, by who named them or by their own names, where the output answers or does not."""
    causes = SCORES["source"] if is_answered else SCORES["command"]
    return {name for name in table.inputs if "inputs" in table.given or parse(name, table[name].unit).score <= causes}


def apart(found: Iterable[Together], changes, output: str, grows: bool = False) -> tuple[Together, ...]:
    """Return the changes of columns but those of the output alone that the answer tells itself.

    These are within the dates of one of its ``changes``; or of the noise, where it says that this grows with the level.
    """
    return tuple(one for one in found if one.names != (output,) or not _is_told(one, changes, grows))


def _is_told(one: Together, changes, grows: bool) -> bool:
    dates = any(one.times[0] <= change.times[1] and change.times[0] <= one.times[1] for change in changes)
    return dates or (grows and bool(one.noises))


def _on_clock(one: Together, clock, events: Iterable[Event]) -> Together:
    low, high, since = (float(clock[min(row, len(clock) - 1)]) for row in (*one.interval, one.since))
    done = tuple(event for event in events if low <= event.time <= high)
    end = None if one.until is None else float(clock[one.until])
    return replace(one, time=since, times=(low, high), end=end, events=done)


def together_words(one: Together, table: Table, origin: str | None = None) -> str:
    """Return what moved, when and how sure that is, as a sentence."""
    begin, low, high = (table.at(time, origin) for time in (one.time, *one.times))
    between = f" ({low.removeprefix('at ')} to {high.removeprefix('at ')})"
    moves = [f"{name!r} {'rose' if by > 0 else 'fell'} by {abs(by):.2g}" for name, by in one.moves.items()]
    moves += [
        f"the noise of {name!r} {'grew' if by > 1 else 'fell'} to {by:.2g} times" for name, by in one.noises.items()
    ]
    until = "" if one.end is None else f", until {table.at(one.end, origin).removeprefix('at ')}"
    what, them = ("several columns changed together: ", "them") if len(one.names) > 1 else ("", "it")
    cause = "." if one.events else f"; what moved {them} the table does not say."
    changed = f"{what}{listed(moves)}{until}{when(one.events)} (odds {odds_words(one.odds)})"
    return f"{begin[0].upper()}{begin[1:]}{between} {changed}{cause}"
