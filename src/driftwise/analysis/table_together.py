"""What several columns of a table have in common, whichever of them is the output."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..engine.holding import held
from ..results.numbers import listed, odds_words
from ..tables.cleaning import judged
from ..tables.recognise import Table
from .together import MOST_COLUMNS, Together, together

SIGNALS = "output", "input", "spare"  # parts of columns that may take part


def together_of(head: dict[str, Any], table: Table) -> tuple[Together, ...]:
    """Return the changes that several columns have in common in the first rows of a table, on its clock.

    Where no part is known, those of a single column are told, too; where they are, what moves one column, or an input
    and the output alone, is what the model is about. Rows
    that come as they like, and recordings one below the other, are not looked at.
    """
    if table.sampling.kind == "irregular" or table.sampling.restarts or table.stacked:
        return ()
    order = sorted(table.columns, key=lambda one: SIGNALS.index(one.role) if one.role in SIGNALS else len(SIGNALS))
    names = [one.name for one in order if one.role in SIGNALS][:MOST_COLUMNS]
    columns = {name: np.array(head[name], float) for name in names}
    for name, (_, doubt) in judged(columns).items():
        columns[name][doubt] = np.nan
        for segment in table[name].stuck:
            columns[name][segment.start : segment.stop] = np.nan
    found = [one for one in together(columns) if table.is_ambiguous or not _is_answer(one, table)]
    if table.time is None:
        return tuple(_on_clock(one, np.arange(table.rows, dtype=float)) for one in found)
    clock = held(table.count.time(np.asarray(head[table.time], float)))
    return tuple(_on_clock(one, clock) for one in found)


def _is_answer(one: Together, table: Table) -> bool:
    """Say whether one column moved, of which the answer speaks, or one input, and the output with it."""
    is_pair = len(one.moves) == 2 and table.output in one.moves and bool(one.moves.keys() & set(table.inputs))
    return len(one.moves) == 1 or is_pair


def _on_clock(one: Together, clock) -> Together:
    low, high, since = (float(clock[min(row, len(clock) - 1)]) for row in (*one.interval, one.since))
    return replace(one, time=since, times=(low, high), end=None if one.until is None else float(clock[one.until]))


def together_words(one: Together, table: Table, origin: str | None = None) -> str:
    """Return what moved, when and how sure that is, as a sentence."""
    begin, low, high = (table.at(time, origin) for time in (one.time, *one.times))
    between = f" ({low.removeprefix('at ')} to {high.removeprefix('at ')})"
    moves = [f"{name!r} {'rose' if by > 0 else 'fell'} by {abs(by):.2g}" for name, by in one.moves.items()]
    until = "" if one.end is None else f", until {table.at(one.end, origin).removeprefix('at ')}"
    what, them = ("several columns changed together: ", "them") if len(moves) > 1 else ("", "it")
    return (
        f"{begin[0].upper()}{begin[1:]}{between} {what}{listed(moves)}{until} (odds {odds_words(one.odds)}); "
        f"what moved {them} the table does not say."
    )
