"""Read the columns of a record from CSV, Parquet or standard input, chunk by chunk, in constant memory.

Nothing stops a run half-way: what cannot be read as a finite number becomes NaN, is flagged in
`Chunk.bad_cells` and counted. What makes a record useless is found before the first chunk is handed over, and
raised as `InputError`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import chain
from typing import Any, NamedTuple

from driftwise.engine.errors import CommandError, InputError
from driftwise.tables.checks import first_chunks
from driftwise.tables.clock import Clock
from driftwise.tables.source import resolve, source_of, title

__all__ = ["Chunk", "Record", "open_record"]

CHUNK_ROWS = 65_536
DAY = 86_400.0  # seconds


class Chunk(NamedTuple):
    """A stretch of rows.

    columns : float64 array per column, NaN where missing or bad
    bad_cells : boolean array per column, True where a cell was text, infinite or part of a ragged row
    first_row : index of the first row, from 0
    bad : number of bad cells
    """

    columns: dict[str, Any]
    bad_cells: dict[str, Any]
    first_row: int
    bad: int

    @property
    def rows(self) -> int:
        return len(next(iter(self.columns.values())))


@dataclass
class Record:
    """The chosen columns of a table; iterate once to get its chunks.

    Attributes
    ----------
    output, inputs, time : names of the columns
    units : unit per column name, where the file gives one
    rows : rows in the file, None when only reading it to the end can tell
    clock : the `Clock` of the time column
    bad, first_bad, ragged : bad cells so far, where the first one is, and ragged rows so far
    raw : whether codes for a missing value, such as -9999, are taken as they stand
    codes, coded : those codes per output and input, by its first rows, and how many values were taken as missing so far
    """

    path: str
    output: str
    inputs: tuple[str, ...]
    time: str | None
    source: Any
    chunk_rows: int = CHUNK_ROWS
    clock: Clock = field(default_factory=Clock)
    bad: int = 0
    first_bad: str = ""
    raw: bool = False
    codes: dict[str, tuple[float, ...]] = field(default_factory=dict)
    coded: dict[str, int] = field(default_factory=dict)

    @property
    def rows(self) -> int | None:
        return self.source.rows

    @property
    def ragged(self) -> int:
        return self.source.ragged

    @property
    def units(self) -> dict[str, str]:
        return self.source.units

    @property
    def fraction(self) -> float | None:
        """Share of the file read so far; None for a pipe."""
        return self.source.position / self.source.size if self.source.size else None

    @property
    def columns(self) -> list[str]:
        return [self.output, *self.inputs, *([self.time] if self.time else [])]

    def moment(self, option: str, said: float | str, is_end: bool = False) -> float:
        """Return the time that an option says: a number as it is, a date since the first stamp, written as the file's.

        ``is_end``: a date without a time of day is the end of its day.
        """
        import pyarrow as pa

        from driftwise.tables.cells import seconds

        try:
            return float(said)
        except ValueError:
            values, bad, is_stamp = seconds(pa.array([said]), self.source.decimal, self.source.day_first)
        if bad[0] or not is_stamp:
            raise CommandError(
                f"{option} takes a number, or a date such as 2024-03-30 or 2024-03-30T12:00; got {said!r}."
            )
        if self.time is None:
            raise CommandError(f"{option} {said} is a date; which column holds the time stamps (--time)?")
        if self.clock.origin is None:
            raise CommandError(
                f"{option} {said} is a date, and column {self.time!r} holds numbers: give a number in their unit."
            )
        return float(self.clock.stamps(values)[0]) + (DAY - 1e-9) * (is_end and ":" not in str(said))

    def __iter__(self) -> Iterator[Chunk]:
        chunks = self._chunks()
        first = first_chunks(self, chunks)
        self.codes = {} if self.raw else _codes(first[0], [self.output, *self.inputs])
        for chunk in chain(first, chunks):
            self._decode(chunk)
            yield chunk

    def _decode(self, chunk: Chunk) -> None:
        """Make codes for a missing value missing, and count them."""
        import numpy as np

        for name, codes in self.codes.items():
            found = np.isin(chunk.columns[name], codes)
            if found.any():
                chunk.columns[name] = np.where(found, np.nan, chunk.columns[name])
                self.coded[name] = self.coded.get(name, 0) + int(found.sum())

    def code_notes(self) -> list[str]:
        """Return a sentence for each column in which codes for a missing value stood."""
        return [
            f"{count} value{'s' * (count > 1)} of {name!r} {'are' if count > 1 else 'is'} "
            f"{' or '.join(f'{code:g}' for code in self.codes[name])}, far outside the others: a code for a missing "
            "value, and taken as missing."
            for name, count in self.coded.items()
        ]

    def _chunks(self) -> Iterator[Chunk]:
        """Yield chunks of exactly `chunk_rows` rows, the last shorter: results do not depend on the file."""
        import numpy as np

        row, held, parts = 0, 0, []
        for values, bad in self._converted():
            parts.append((values, bad))
            held += values.shape[1]
            if held < self.chunk_rows:
                continue
            values = np.concatenate([v for v, _ in parts], axis=1) if len(parts) > 1 else values
            bad = np.concatenate([b for _, b in parts], axis=1) if len(parts) > 1 else bad
            start = 0
            while held - start >= self.chunk_rows:
                stop = start + self.chunk_rows
                yield self._chunk(values[:, start:stop], bad[:, start:stop], row)
                row, start = row + self.chunk_rows, stop
            parts, held = [(values[:, start:], bad[:, start:])], held - start
        if held:
            yield self._chunk(
                np.concatenate([v for v, _ in parts], axis=1),
                np.concatenate([b for _, b in parts], axis=1),
                row,
            )

    def _chunk(self, values, bad, row) -> Chunk:
        import numpy as np

        columns = self.columns
        count = int(bad.sum())
        self.bad += count
        if count and not self.first_bad:
            first, j = min((int(np.argmax(bad[j])), j) for j in range(len(columns)) if bad[j].any())
            self.first_bad = f"row {row + first + 1}, column {columns[j]!r}"
        data = {name: values[j] for j, name in enumerate(columns)}
        if self.time:
            data[self.time] = self.clock.push(data[self.time], row)
        return Chunk(data, {name: bad[j] for j, name in enumerate(columns)}, row, count)

    def _converted(self):
        """Yield (values, bad), each (columns, rows), batch by batch as the file hands them over."""
        import numpy as np

        from driftwise.tables.cells import numbers

        columns = self.columns
        stamps = None
        for arrays, ragged in self.source.batches(columns):
            rows = len(arrays[0]) + len(ragged)
            values, bad = np.empty((len(columns), rows)), np.zeros((len(columns), rows), bool)
            keep = np.ones(rows, bool)
            keep[ragged] = False
            everything = not ragged
            for j, (name, array) in enumerate(zip(columns, arrays, strict=True)):
                if name == self.time:
                    found, wrong, stamps = self._clocked(array, stamps)
                else:
                    found, wrong = _numbers(name, array, self.source.decimal, numbers)
                if everything:
                    values[j], bad[j] = found, wrong
                else:
                    values[j, ~keep], bad[j, ~keep] = np.nan, True
                    values[j, keep], bad[j, keep] = found, wrong
            yield values, bad

    def _clocked(self, array, stamps):
        import numpy as np

        from driftwise.tables.cells import seconds

        try:
            values, bad, is_stamp = seconds(array, self.source.decimal, self.source.day_first)
        except InputError as error:
            raise InputError(f"time column {self.time!r}: {error}.") from None
        if stamps is not None and is_stamp != stamps:  # a batch of nothing but holes or rubbish looks like numbers
            return np.full(len(values), np.nan), np.ones(len(values), bool) if is_stamp else bad, stamps
        seen = is_stamp or bool(np.isfinite(values).any())
        return (self.clock.stamps(values) if is_stamp else values), bad, (is_stamp if seen else stamps)


def open_record(
    path, output: str, inputs=(), time: str | None = None, chunk_rows: int = CHUNK_ROWS, raw: bool = False
) -> Record:
    """Return the chosen columns of a table as a `Record` to iterate over.

    Parameters
    ----------
    path : file name of a CSV (plain or compressed) or Parquet table, or "-" for CSV on standard input
    output, inputs, time : column names; a number counts columns from 1 where no column has that name
    chunk_rows : rows of a chunk
    raw : leave codes for a missing value as they are

    Raises
    ------
    InputError
        no such file or column, an empty table, a column without numbers, an output that never changes
    """
    source = source_of(path)
    try:
        roles = [resolve(source.names, output, "output")]
        roles += [resolve(source.names, name, "input") for name in inputs]
        clock = resolve(source.names, time, "time") if time is not None else None
        twice = {name for name in [*roles, clock] if name and [*roles, clock].count(name) > 1}
        if twice:
            raise InputError(
                f"column {min(twice)!r} is given two parts to play; output, inputs and time must be different columns."
            )
    except InputError as error:
        raise InputError(f"{title(path)}: {error}") from None
    return Record(str(path), roles[0], tuple(roles[1:]), clock, source, chunk_rows, Clock(clock or ""), raw=raw)


def _codes(chunk: Chunk, names) -> dict[str, tuple[float, ...]]:
    """Return the codes for a missing value in each column that has one."""
    from driftwise.tables.cleaning import codes_in

    return {name: codes for name in names if (codes := codes_in(chunk.columns[name]))}


def _numbers(name, array, decimal, numbers):
    try:
        return numbers(array, decimal)
    except InputError as error:
        raise InputError(f"column {name!r}: {error}.") from None
