"""A whole table, opened without naming a column: names, units, kinds, a first look, then chunks of what is wanted."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from driftwise.edge.clock import Clock
from driftwise.errors import InputError

__all__ = ["OpenTable", "open_table"]

CHUNK_ROWS = 65_536
LOOK = 2000  # cells by which the kind of a column is settled


@dataclass
class OpenTable:
    """A table to look at and then to read, once.

    Attributes
    ----------
    names : all its columns
    units : unit per column name, where the table gives one
    kinds : "number", "stamp" or "text" per column name
    head : the first rows: float64 per column of numbers (NaN where missing), seconds since the first stamp per column
        of time stamps, None per column of text
    bad : cells that were no finite number, per column of numbers
    """

    title: str
    source: Any
    chunk_rows: int = CHUNK_ROWS
    kinds: dict[str, str] = field(default_factory=dict)
    head: dict[str, Any] = field(default_factory=dict)
    bad: dict[str, int] = field(default_factory=dict)
    _clocks: dict[str, Clock] = field(default_factory=dict)
    _over: dict[str, Any] = field(default_factory=dict)  # rows read beyond the head

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.source.names)

    @property
    def units(self) -> dict[str, str]:
        return self.source.units

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
        yield {name: self.head[name] for name in names}
        parts, held = [{name: self._over[name] for name in names}], len(self._over[names[0]]) if names else 0
        self._over = {}
        for arrays, ragged in self.source.batches(names) if names else ():
            parts.append(self._converted(names, arrays, ragged))
            held += len(parts[-1][names[0]])
            while held >= self.chunk_rows:
                whole = {name: np.concatenate([part[name] for part in parts]) for name in names}
                yield {name: column[: self.chunk_rows] for name, column in whole.items()}
                parts = [{name: column[self.chunk_rows :] for name, column in whole.items()}]
                held -= self.chunk_rows
        if held:
            yield {name: np.concatenate([part[name] for part in parts]) for name in names}

    def _look(self) -> None:
        """Read the first rows, and settle what kind each column is."""
        import numpy as np

        parts: list[dict[str, Any]] = []
        names = list(self.names)
        for arrays, ragged in self.source.batches(names):
            if not self.kinds:
                self.kinds = {name: self._kind(array) for name, array in zip(names, arrays, strict=True)}
            parts.append(self._converted(names, arrays, ragged))
            if sum(map(_length, parts)) >= self.chunk_rows:
                break
        if not sum(map(_length, parts)):
            raise InputError(
                f"{self.title}: the table has a header but no rows. Was the recording stopped before it began?"
            )
        for name in names:
            if self.kinds[name] == "text":
                self.head[name] = None
                continue
            column = np.concatenate([part[name] for part in parts])
            self.head[name], self._over[name] = column[: self.chunk_rows], column[self.chunk_rows :]

    def _kind(self, array) -> str:
        import numpy as np
        import pyarrow as pa

        from driftwise.edge.cells import numbers, seconds

        kind = array.type.value_type if pa.types.is_dictionary(array.type) else array.type
        if pa.types.is_date(kind) or pa.types.is_timestamp(kind):
            return "stamp"
        array = array.drop_null().slice(0, LOOK)
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

        from driftwise.edge.cells import numbers, seconds

        columns: dict[str, Any] = {}
        rows = (len(arrays[0]) if arrays else 0) + len(ragged)
        keep = np.ones(rows, bool)
        keep[ragged] = False
        for name, array in zip(names, arrays, strict=True):
            if self.kinds[name] == "text":
                continue
            if self.kinds[name] == "stamp":
                values, _, is_stamp = seconds(array, self.source.decimal, self.source.day_first)
                clock = self._clocks.setdefault(name, Clock(name))
                values = clock.stamps(values) if is_stamp else np.full(len(values), np.nan)
            else:
                values, bad = numbers(array, self.source.decimal)
                self.bad[name] = self.bad.get(name, 0) + int(bad.sum())
            column = np.full(rows, np.nan)
            column[keep] = values
            columns[name] = column
        return columns


def open_table(data, chunk_rows: int = CHUNK_ROWS) -> OpenTable:
    """Open a whole table: a CSV or Parquet file, a data frame, or a mapping from column name to array.

    Parameters
    ----------
    data : file name ("-" for CSV on standard input), data frame (through narwhals) or mapping
    chunk_rows : rows of a chunk, and of the first look

    Examples
    --------
    >>> table = open_table({"t": [0.0, 0.1, 0.2], "y": [1.0, None, 3.0], "note": ["a", "b", "c"]}, chunk_rows=2)
    >>> table.kinds
    {'t': 'number', 'y': 'number', 'note': 'text'}
    >>> [chunk["y"].tolist() for chunk in table.chunks(["y"])]
    [[1.0, nan], [3.0]]
    """
    from driftwise.edge.parquetfile import MemorySource
    from driftwise.edge.tables import _source

    if isinstance(data, str | Path):
        table = OpenTable("standard input" if str(data) == "-" else str(data), _source(data), chunk_rows)
    else:
        what = "mapping" if isinstance(data, Mapping) else "data frame"
        table = OpenTable(f"the {what}", MemorySource(data), chunk_rows)
    table._look()
    return table


def _length(part: dict[str, Any]) -> int:
    return len(next(iter(part.values()))) if part else 0
