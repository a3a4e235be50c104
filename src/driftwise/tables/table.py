"""A whole table, opened without naming a column: names, units, kinds, a first look, then chunks of what is wanted."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from driftwise.engine.errors import InputError
from driftwise.tables.clock import Clock
from driftwise.tables.daytime import DAY, TimeOfDay, of_day

__all__ = ["OpenTable", "open_table"]

CHUNK_ROWS = 65_536
HEAD_ROWS = 65_536  # rows by which a table is recognised, whatever its chunks
LOOK = 2000  # cells by which the kind of a column is settled


@dataclass
class OpenTable:
    """A table to look at and then to read, once.

    Attributes
    ----------
    names : all its columns
    units : unit per column name, where the table gives one
    kinds : "number", "stamp" (also a time of day), "switch" (on and off) or "text" per column name
    head : the first rows: float64 per column of numbers (NaN where missing), seconds per column of time stamps, None
        per column of text. A column of dates takes in the time of day that a column of its own holds.
    bad : cells that were no finite number, per column of numbers
    """

    title: str
    source: Any
    chunk_rows: int = CHUNK_ROWS
    head_rows: int = HEAD_ROWS
    kinds: dict[str, str] = field(default_factory=dict)
    head: dict[str, Any] = field(default_factory=dict)
    bad: dict[str, int] = field(default_factory=dict)
    _clocks: dict[str, Clock] = field(default_factory=dict)
    _days: dict[str, TimeOfDay] = field(default_factory=dict)  # columns of times of day
    _paired: tuple[str, str] | None = None  # a column of dates, and the one of the times of day
    _over: dict[str, Any] = field(default_factory=dict)  # rows read beyond the head
    _is_whole: bool = True  # whether all rows have been read

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.source.names)

    @property
    def units(self) -> dict[str, str]:
        return self.source.units

    @property
    def time_of_day(self) -> str | None:
        """The column of times of day that the column of dates takes in, None where there is none."""
        return self._paired[1] if self._paired else None

    @property
    def rows(self) -> int | None:
        return self.source.rows

    @property
    def ragged(self) -> int:
        return self.source.ragged

    @property
    def fraction(self) -> float | None:
        """Share of the table read so far; None for a pipe."""
        return self.source.position / self.source.size if self.source.size else None

    def origin(self, name: str) -> str | None:
        """Return the first time stamp of a column, None for one of numbers."""
        return self._clocks[name].origin if name in self._clocks else None

    def chunks(self, names=None) -> Iterator[dict[str, Any]]:
        """Yield the chosen columns, first rows first, in chunks of `chunk_rows` rows, the last one shorter."""
        import numpy as np

        names = [name for name in (self.names if names is None else names) if self.kinds[name] != "text"]
        parts = [{name: np.concatenate((self.head[name], self._over[name])) for name in names}] if names else []
        self._over = {}
        asked = [*names, self._paired[1]] if self._paired and self._paired[0] in names else names
        batches = self.source.batches(asked) if names else iter(())
        while parts:
            whole = {name: np.concatenate([part[name] for part in parts]) for name in names}
            rows, start = len(whole[names[0]]), 0
            while rows - start >= self.chunk_rows:
                yield {name: column[start : start + self.chunk_rows] for name, column in whole.items()}
                start += self.chunk_rows
            parts = [{name: column[start:] for name, column in whole.items()}]
            fresh = next(batches, None)
            if fresh is None:
                break
            parts.append(self._converted(asked, *fresh))
        if parts and len(parts[0][names[0]]):
            yield parts[0]

    def turn(self, clock: str) -> None:
        """Turn round the rows of a table whose newest row comes first; one that is too long for that is told so."""
        if not self._is_whole:
            raise InputError(
                f"{clock!r} runs backwards, the newest row first, and the table is too long to be turned round here: "
                "sort its rows by time and save it again."
            )
        for name, column in self.head.items():  # all rows are there: none is left over
            self.head[name] = None if column is None else column[::-1]

    def _look(self) -> None:
        """Read the first rows, and settle what kind each column is."""
        import numpy as np

        parts: list[dict[str, Any]] = []
        names = list(self.names)
        for arrays, ragged in self.source.batches(names):
            if not self.kinds:
                self.kinds = {name: self._kind(name, array) for name, array in zip(names, arrays, strict=True)}
                self._pair(dict(zip(names, arrays, strict=True)))
            parts.append(self._converted(names, arrays, ragged))
            if sum(map(_length, parts)) >= self.head_rows:
                self._is_whole = False
                break
        if not self.kinds:
            raise InputError(
                f"{self.title}: the table has a header but no rows. Was the recording stopped before it began?"
            )
        for name in names:
            if self.kinds[name] == "text":
                self.head[name] = None
                continue
            column = np.concatenate([part[name] for part in parts])
            self.head[name], self._over[name] = column[: self.head_rows], column[self.head_rows :]

    def _pair(self, arrays) -> None:
        """Find a column of dates and a column of times of day that belong together."""
        import numpy as np

        from driftwise.tables.cells import seconds

        dates = []
        for name, kind in self.kinds.items():
            if kind == "stamp" and name not in self._days:
                stamps, bad, _ = seconds(arrays[name], self.source.decimal, self.source.day_first)
                if not np.any(stamps[~bad] % int(DAY * 1e9)):
                    dates.append(name)
        if len(dates) == len(self._days) == 1:
            self._paired = (dates[0], next(iter(self._days)))
            self.kinds[self._paired[1]] = "text"

    def _kind(self, name, array) -> str:
        import numpy as np
        import pyarrow as pa

        from driftwise.tables.cells import is_text, numbers, seconds, switched

        kind = array.type.value_type if pa.types.is_dictionary(array.type) else array.type
        if pa.types.is_date(kind) or pa.types.is_timestamp(kind):
            return "stamp"
        array = array.drop_null().slice(0, LOOK)
        if 2 * of_day(array)[1] > len(array):
            self._days[name] = TimeOfDay()
            return "stamp"
        if is_text(array.type) and len(array) and not switched(array)[1].any():
            return "switch"
        try:
            values, bad, is_stamp = seconds(array, self.source.decimal, self.source.day_first)
            if is_stamp:
                return "stamp" if 2 * bad.sum() < len(array) else "text"
            values, bad = numbers(array, self.source.decimal)
        except InputError:
            return "text"
        return "number" if bad.sum() <= np.isfinite(values).sum() else "text"

    def _converted(self, names, arrays, ragged) -> dict[str, Any]:
        """Return float64 columns of one batch, with rows of NaN where the row was ragged."""
        import numpy as np

        from driftwise.tables.cells import numbers, seconds, switched

        columns: dict[str, Any] = {}
        rows = (len(arrays[0]) if arrays else 0) + len(ragged)
        keep = np.ones(rows, bool)
        keep[ragged] = False
        for name, array in zip(names, arrays, strict=True):
            if name in self._days:
                values = of_day(array)[0]
                if self._paired is None:
                    values = self._days[name].push(values)
            elif self.kinds[name] == "text":
                continue
            elif self.kinds[name] == "stamp":
                values, _, is_stamp = seconds(array, self.source.decimal, self.source.day_first)
                clock = self._clocks.setdefault(name, Clock(name))
                values = clock.stamps(values) if is_stamp else np.full(len(values), np.nan)
            else:
                is_switch = self.kinds[name] == "switch"
                values, bad = switched(array) if is_switch else numbers(array, self.source.decimal)
                self.bad[name] = self.bad.get(name, 0) + int(bad.sum())
            column = np.full(rows, np.nan)
            column[keep] = values
            columns[name] = column
        if self._paired and self._paired[0] in columns:
            date, hours = self._paired
            columns[date] = columns[date] + columns.pop(hours)
        return columns


def open_table(data, chunk_rows: int = CHUNK_ROWS, head_rows: int = HEAD_ROWS) -> OpenTable:
    """Open a whole table: a CSV or Parquet file, a data frame, or a mapping from column name to array.

    Parameters
    ----------
    data : file name ("-" for CSV on standard input), data frame (through narwhals) or mapping
    chunk_rows : rows of a chunk
    head_rows : rows of the first look

    Examples
    --------
    >>> table = open_table({"t": [0.0, 0.1, 0.2], "y": [1.0, None, 3.0], "note": ["a", "b", "c"]}, chunk_rows=2)
    >>> table.kinds
    {'t': 'number', 'y': 'number', 'note': 'text'}
    >>> [chunk["y"].tolist() for chunk in table.chunks(["y"])]
    [[1.0, nan], [3.0]]
    """
    from driftwise.tables.parquetfile import MemorySource
    from driftwise.tables.source import source_of

    if isinstance(data, str | Path):
        table = OpenTable("standard input" if str(data) == "-" else str(data), source_of(data), chunk_rows, head_rows)
    else:
        what = "mapping" if isinstance(data, Mapping) else "data frame"
        table = OpenTable(f"the {what}", MemorySource(data), chunk_rows, head_rows)
    table._look()
    return table


def _length(part: dict[str, Any]) -> int:
    return len(next(iter(part.values()))) if part else 0
