"""Records: the chosen columns of a table, read once, chunk by chunk.

Nothing stops a run half-way: what cannot be read as a finite number becomes NaN and is counted. What makes a record
useless is found before its first chunk is handed over, and raised as `InputError`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import chain
from typing import Any, NamedTuple

from driftwise.engine.errors import InputError
from driftwise.tables import checks
from driftwise.tables.cells import are_beyond, converted, kind_of, numbers, seconds
from driftwise.tables.chunks import CHUNK_ROWS, rechunked
from driftwise.tables.cleaning import codes_in
from driftwise.tables.clock import Clock, TimeOfDay
from driftwise.tables.moments import moment
from driftwise.tables.parts import source_of
from driftwise.tables.source import Source, resolve_all, title_of
from driftwise.tables.tens import in_tens, ten_of


class Chunk(NamedTuple):
    """Some rows of a record.

    columns : float64 array per column, NaN where missing or bad
    bad_cells : boolean array per column, True where a cell was text, infinite or part of a ragged row
    first_row : index of the first row, from 0
    rows, bad : number of rows, and of bad cells
    """

    columns: dict[str, Any]
    bad_cells: dict[str, Any]
    first_row: int
    rows: int
    bad: int

    def pick(self, inside) -> Chunk:
        """Return the rows where a mask is true, which is one stretch of them."""
        columns = {name: values[inside] for name, values in self.columns.items()}
        bad_cells = {name: cells[inside] for name, cells in self.bad_cells.items()}
        first = self.first_row + int(inside.argmax())
        return Chunk(columns, bad_cells, first, int(inside.sum()), int(sum(c.sum() for c in bad_cells.values())))


@dataclass
class Record:
    """The chosen columns of a table; iterate once to get its chunks.

    Attributes
    ----------
    output, inputs, time : names of the columns
    source : the reader; it knows units, the rows of the file, those that were ragged, and how far it is
    clock : the `Clock` of the time column
    bad, first_bad : bad cells so far, and where the first one is
    raw : whether codes for a missing value, such as -9999, and very large or small numbers are taken as they stand
    is_of_plant : whether the numbers are in the units of a known plant, and stay in them
    codes, coded : those codes per output and input, by its first rows, and how many values were taken as missing so far
    tens : power of ten that an output or input is counted in, where its numbers are very large or very small
    beyond : outputs and inputs whose numbers are beyond 1e100
    table : the whole `Table`, where it was looked at for a clock
    otherwise : how its rows are read, where that is not as they stand; a sentence each
    """

    path: str
    output: str
    inputs: tuple[str, ...]
    time: str | None
    source: Source
    chunk_rows: int = CHUNK_ROWS
    clock: Clock = field(default_factory=Clock)
    bad: int = 0
    first_bad: str = ""
    raw: bool = False
    is_of_plant: bool = False
    codes: dict[str, tuple[float, ...]] = field(default_factory=dict)
    coded: dict[str, int] = field(default_factory=dict)
    tens: dict[str, int] = field(default_factory=dict)
    beyond: set[str] = field(default_factory=set)
    table: Any = None
    otherwise: tuple[str, ...] = ()
    _kind: str = ""  # of the clock's cells
    _day: TimeOfDay | None = None  # where they tell the time of day alone, or of an hour

    @property
    def columns(self) -> list[str]:
        return [self.output, *self.inputs, *([self.time] if self.time else [])]

    def moment(self, option: str, said: float | str, is_end: bool = False) -> float:
        """Return the time that an option says, as `moment` does."""
        return moment(self.clock, self.time, self.source, option, said, is_end)

    def __iter__(self) -> Iterator[Chunk]:
        chunks = self._chunks()
        first = checks.first_chunks(self, chunks)
        names = [] if self.raw else [self.output, *self.inputs]
        self.codes = {name: codes for name in names if (codes := codes_in(first[0].columns[name]))}
        signals = () if self.raw or self.is_of_plant else (self.output, *self.inputs)
        self.tens = {name: ten for name in signals if (ten := ten_of(first[0].columns[name]))}
        for chunk in chain(first, chunks):
            self._decode(chunk)
            chunk.columns.update((name, in_tens(chunk.columns[name], ten)) for name, ten in self.tens.items())
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

    def unit_notes(self) -> list[str]:
        """Return a sentence for each column whose numbers are so large or small that they have a unit of their own."""
        return [f"{name!r} is counted in units of 1e{ten}." for name, ten in self.tens.items()]

    def _chunks(self) -> Iterator[Chunk]:
        """Yield chunks of exactly `chunk_rows` rows, the last shorter: results do not depend on the file."""
        import numpy as np

        columns, row = self.columns, 0
        for values, bad in rechunked(self._converted(), self.chunk_rows):
            count = int(bad.sum())
            self.bad += count
            if count and not self.first_bad:
                first, j = min((int(np.argmax(bad[j])), j) for j in range(len(columns)) if bad[j].any())
                self.first_bad = f"row {row + first + 1}, column {columns[j]!r}"
            data = dict(zip(columns, values))
            if self.time:
                data[self.time] = self.clock.push(data[self.time], row)
            yield Chunk(data, dict(zip(columns, bad)), row, values.shape[1], count)
            row += values.shape[1]

    def _converted(self):
        """Yield (values, bad), each (columns, rows), batch by batch as the file hands them over."""
        import numpy as np

        stamps = None
        for arrays, ragged in self.source.batches(self.columns):
            found = [self._numbers(*one) for one in zip([self.output, *self.inputs], arrays)]
            if self.time:
                *clocked, stamps = self._clocked(arrays[-1], stamps)
                found.append(tuple(clocked))
            values, bad = np.stack([v for v, _ in found]), np.stack([wrong for _, wrong in found]) | ragged
            values[:, ragged] = np.nan
            yield values, bad

    def _numbers(self, name, array):
        try:
            values, bad = numbers(array, self.source.decimal)
            if 2 * bad.sum() > len(bad) and are_beyond(array, self.source.decimal):
                self.beyond.add(name)
            return values, bad
        except InputError as error:
            raise InputError(f"column {name!r}: {error}.") from None

    def _clocked(self, array, stamps):
        import numpy as np

        if stamps is None and self._day is None:
            how = self.source.decimal, self.source.day_first
            self._kind = kind_of(array, *how, self.source.said_of(self.time or ""))
            self._day = TimeOfDay.of(self._kind)
        if self._day is not None:
            values = self._day.push(converted(array, self._kind)[0])
            return values, np.isnan(values) & array.is_valid().to_numpy(zero_copy_only=False), False
        try:
            values, bad, is_stamp = seconds(array, self.source.decimal, self.source.day_first)
        except InputError as error:
            raise InputError(f"time column {self.time!r}: {error}.") from None
        if stamps is not None and is_stamp != stamps:  # a batch of nothing but holes or rubbish looks like numbers
            return np.full(len(values), np.nan), np.ones(len(values), bool) if is_stamp else bad, stamps
        seen = is_stamp or bool(np.isfinite(values).any())
        return (self.clock.stamps(values) if is_stamp else values), bad, (is_stamp if seen else stamps)


def open_record(
    path,
    output: str,
    inputs=(),
    time: str | None = None,
    chunk_rows: int = CHUNK_ROWS,
    raw: bool = False,
    source: Source | None = None,
) -> Record:
    """Return the chosen columns of a table as a `Record` to iterate over.

    Parameters
    ----------
    path : file name of a CSV (plain or compressed) or Parquet table, or "-" for CSV on standard input
    output, inputs, time : column names; a number counts columns from 1 where no column has that name
    chunk_rows : rows of a chunk
    raw : leave codes for a missing value as they are
    source : the table itself, where it is read otherwise than it stands

    Raises
    ------
    InputError
        no such file or column, an empty table, a column without numbers, an output that never changes
    """
    source = source_of(path) if source is None else source
    try:
        names = resolve_all(source.names, [output], inputs, time)
    except InputError as error:
        raise InputError(f"{title_of(path)}: {error}") from None
    clock = names.pop() if time is not None else None
    return Record(str(path), names[0], tuple(names[1:]), clock, source, chunk_rows, Clock(clock or ""), raw=raw)
