"""What makes a record useless is found in its first chunks, before anything is estimated."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from driftwise.engine.errors import InputError
from driftwise.tables.source import title_of

PATIENCE = 1 << 20  # rows read in search of an output that moves


def first_chunks(record: Any, chunks: Iterator) -> list:
    """Return the chunks up to the one where the output has moved and every input was seen.

    Raises InputError where that does not happen in the first million rows, or where a column is mostly text.
    """
    import numpy as np

    first: list[Any] = []
    rows, signals = 0, [record.output, *record.inputs]
    low, high = dict.fromkeys(signals, np.inf), dict.fromkeys(signals, -np.inf)
    try:
        for chunk in chunks:
            first.append(chunk)
            rows += chunk.rows
            for name in signals:
                low[name] = np.fmin.reduce(chunk.columns[name], initial=low[name])
                high[name] = np.fmax.reduce(chunk.columns[name], initial=high[name])
            if len(first) == 1:
                _refuse_strangers(record, chunk, signals)
            if low[record.output] < high[record.output] and all(low[name] <= high[name] for name in signals):
                return first
            if rows >= PATIENCE:
                break
        _refuse_silence(record, rows, signals, low, high)
    except InputError as error:
        raise InputError(f"{title_of(record.path)}: {error}") from None
    return first


def _refuse_strangers(record, chunk, signals) -> None:
    """Refuse columns of which most cells are something else than numbers."""
    import numpy as np

    for name in [*signals, *([record.time] if record.time else [])]:
        bad = int(chunk.bad_cells[name].sum())
        good = int(np.isfinite(chunk.columns[name]).sum()) if name != record.time else chunk.rows - bad
        if bad > good:
            refuse_text(name, bad, chunk.rows, name == record.time, are_beyond=name in record.beyond)


def refuse_text(name: str, bad: int, rows: int, is_time: bool, where: str = "", are_beyond: bool = False) -> None:
    """Raise `InputError` about a column whose cells are no numbers, or beyond 1e100."""
    if are_beyond:
        raise InputError(
            f"{where}column {name!r}: most of its first {rows} cells are numbers beyond 1e100, of which no square is a "
            "number. Is it the wrong column, or are they counted in a unit that is far too small?"
        )
    what = "neither numbers nor time stamps" if is_time else "not numbers"
    raise InputError(
        f"{where}column {name!r}: {bad} of the first {rows} cells are {what}. Is it the wrong column, or are the "
        "numbers written in another way (thousands separators, units in the cells, a decimal comma beside decimal "
        "points)?"
    )


def _refuse_silence(record, rows: int, signals, low, high) -> None:
    where = f"its first {rows} rows" if rows >= PATIENCE else f"all {rows} rows" if rows > 1 else "its only row"
    if not rows:
        raise InputError("the table has a header but no rows. Was the recording stopped before it began?")
    for name in signals:
        if low[name] > high[name]:
            raise InputError(
                f"column {name!r} is empty in {where}: nothing can be learned from it. Was that sensor connected?"
            )
    if low[record.output] == high[record.output]:
        raise InputError(
            f"output column {record.output!r} is {low[record.output]:g} in {where}: a constant tells nothing about "
            "the system. Is it a set point, or was the sensor stuck?"
        )
