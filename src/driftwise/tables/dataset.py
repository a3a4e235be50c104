"""Long tables of many series: files, folders and frames in batches of so many rows, keys as small numbers."""

from __future__ import annotations

from collections.abc import Iterator
from copy import copy
from pathlib import Path
from typing import Any, NamedTuple

from driftwise.engine.errors import InputError
from driftwise.tables.cells import are_beyond, instants, trimmed
from driftwise.tables.checks import refuse_text
from driftwise.tables.csvfile import CsvSource
from driftwise.tables.filling import Filling, Piece
from driftwise.tables.keys import Keys
from driftwise.tables.parts import Part, parts_of
from driftwise.tables.source import Source, resolve_all

ROWS = 1 << 18


class Batch(NamedTuple):
    """Some rows of a long table.

    first : number of its first row in the table, from 0
    names : keys met so far, in order of appearance: one list for all batches of a pass, which grows
    codes : (n,) int64 index of the key of each row in ``names``, -1 where the row has none
    time : (n,) seconds since 1970, or the table's own numbers; NaN where missing; None without a clock
    ys, us : (n, p), (n, k) float64, NaN where missing
    bad : (n,) bool: some cell was text, infinite or beyond 1e100, or the row was ragged
    source : (n,) int64 rows of the table, where they do not follow each other from ``first`` on
    """

    first: int
    names: list[Any]
    codes: Any
    time: Any
    ys: Any
    us: Any
    bad: Any
    source: Any = None


class Dataset:
    """A long table, as `open_dataset` found it.

    Attributes
    ----------
    title : where it comes from
    by, outputs, inputs, time : names of the columns
    rows : how many, None where only reading to the end can tell
    units : unit per column name, where the table gives one
    are_stamps : whether its times are time stamps, None without a clock
    missing : values that stand for a missing one
    passed_over : files of its folder that are no tables
    """

    def __init__(self, source, by: str, outputs: list[str], inputs: list[str], time: str | None, missing=()):
        self.missing = tuple(missing)
        self.by, self.outputs, self.inputs, self.time = by, outputs, inputs, time
        self.parts, self.passed_over = parts_of(source)
        self.title = str(source) if isinstance(source, str | Path) else self.parts[0].title
        self.units: dict[str, str] = {}
        self._counts: list[int | None] = []
        self._source: Source | None = None
        self._done, self._part = 0, 0  # sizes of parts read; the part being read, and its reader
        for part in self.parts:
            opened, _ = self._opened(part)
            self._counts.append(opened.rows)
            self.units = self.units or opened.units
        self.are_stamps = self._look()

    @property
    def rows(self) -> int | None:
        return None if None in self._counts else sum(count or 0 for count in self._counts)

    @property
    def fraction(self) -> float:
        """Share of the table that the last pass has read so far."""
        reader: Any = self._source
        now = self.parts[self._part].size * reader.position / reader.size if reader is not None and reader.size else 0
        return min((self._done + now) / sum(part.size for part in self.parts), 1.0)

    def only(self, number: int) -> Dataset:
        """Return the table that one of the ``parts`` is: to be read elsewhere, it can be pickled (cloudpickle)."""
        one = copy(self)
        one.parts, one._counts = [self.parts[number]], [self._counts[number]]
        return one

    @property
    def counts(self) -> list[int | None]:
        """Rows of each of the ``parts``, None where only reading to the end can tell."""
        return list(self._counts)

    def batches(self, rows: int = ROWS, skip: int = 0) -> Iterator[Batch]:
        """Yield batches of exactly ``rows`` rows, the last one shorter, from row ``skip`` on.

        How files and row groups are cut does not show. Row groups before ``skip`` are not read.
        """
        if rows < 1 or skip < 0:
            raise InputError(f"batches have at least 1 row and begin at row 0 or later, got rows={rows}, skip={skip}")
        keys, first, filling = Keys(), skip, self._filling(rows)
        for piece in self._pieces(skip):
            at = 0
            while at < len(piece.ragged):
                part = min(len(piece.ragged) - at, filling.room)
                filling.add(piece.slice(at, part), self.are_stamps)
                at += part
                if not filling.room:
                    yield self._batch(first, filling, keys)
                    first, filling = first + rows, self._filling(rows)
        if filling.size:
            yield self._batch(first, filling, keys)

    # --- reading -------------------------------------------------------------------------------------------

    def _filling(self, rows: int) -> Filling:
        return Filling(len(self.outputs), len(self.inputs), self.time is not None, rows)

    def _batch(self, first: int, filling: Filling, keys: Keys) -> Batch:
        import numpy as np

        n = filling.size
        try:
            codes = keys.codes(filling.keys)
        except InputError as error:
            raise InputError(f"{self.title}: column {self.by!r}: {error}") from None
        time = None if filling.time is None else filling.time[:n]
        ys, us = filling.ys[:n], filling.us[:n]
        if self.missing:
            for values in (ys, us):
                values[np.isin(values, self.missing)] = np.nan
        return Batch(first, keys.names, codes, time, ys, us, filling.bad[:n])

    def _opened(self, part: Part) -> tuple[Source, list[str]]:
        """Return a fresh reader of a part, and what it calls its columns: key, outputs, inputs, time."""
        try:
            reader = part.reader(self.by)
            names = (*reader.names, *(name for name in part.fixed if name not in reader.names))
            found = resolve_all(names, self.outputs, self.inputs, self.time, self.by)
            if found[0] != self.by:  # it was given as a number
                reader = part.reader(found[0])
        except InputError as error:
            text = str(error)
            raise InputError(text if text.startswith(part.title) else f"{part.title}: {text}") from None
        return reader, found

    def _pieces(self, skip: int = 0) -> Iterator[Piece]:
        """Yield the rows from ``skip`` on as the readers hand them over."""
        import pyarrow as pa

        self._done, self._source = 0, None
        for number, (part, count) in enumerate(zip(self.parts, self._counts)):
            self._part = number
            if count is None or skip < count:
                reader, columns = self._opened(part)
                self._source = reader
                if count is not None:
                    reader.position, skip = skip, 0
                try:
                    for piece in _read(part, reader, columns):
                        length = len(piece.ragged)
                        if skip < length:
                            yield piece.slice(skip, length - skip) if skip else piece
                        skip = max(skip - length, 0)
                except (pa.ArrowException, OSError) as error:
                    raise InputError(f"{part.title} cannot be read to its end ({error}). Is it damaged?") from None
            else:
                skip -= count
            self._done, self._source = self._done + part.size, None

    def _look(self) -> bool | None:
        """Refuse first rows without numbers or keys; return whether their time is written as stamps."""
        import numpy as np

        for piece in self._pieces():
            filling = self._filling(len(piece.ragged))
            bad = filling.add(piece, None)
            for name, count, array in zip(piece.columns[1:], bad, piece.arrays[1:]):
                if 2 * count > len(array) - array.null_count:
                    beyond = are_beyond(array, piece.decimal)
                    refuse_text(name, count, len(array), name == self.time, f"{piece.title}: ", beyond)
            if np.all(self._batch(0, filling, Keys()).codes < 0):
                raise InputError(f"{piece.title}: column {self.by!r} has no key in its first {filling.size} rows.")
            self._done, self._source = 0, None
            if filling.time is None or not np.isfinite(filling.time).any():
                return None
            return instants(piece.arrays[-1], piece.decimal, piece.day_first)[2]
        raise InputError(f"{self.title}: the table has columns but no rows. Was the recording stopped before it began?")


def _read(part: Part, reader: Source, columns: list[str]) -> Iterator[Piece]:
    """Yield the rows of a part, with the columns that the names of its folders stand for."""
    import pyarrow as pa

    fixed = {name: part.fixed[name] for name in columns if name not in reader.names}
    for arrays, ragged in reader.batches([name for name in columns if name not in fixed]):
        if isinstance(reader, CsvSource) and columns[0] not in fixed:
            arrays[0] = trimmed(arrays[0])
        rest = iter(arrays)
        whole = [pa.repeat(_scalar(fixed[name]), len(ragged)) if name in fixed else next(rest) for name in columns]
        yield Piece(part.title, columns, whole, ragged, reader.decimal, reader.day_first)


def _scalar(value):
    """Return a key as its column would hold it."""
    import pyarrow as pa

    return pa.scalar(value, pa.int64() if isinstance(value, int) else pa.large_string())


def open_dataset(source, by: str, output, inputs=(), time: str | None = None, missing=()) -> Dataset:
    """Return a long table, ready to be read in batches.

    Parameters
    ----------
    source : a Parquet or CSV file, a folder of them (flat, or ``asset=7/part-0.parquet``), a list of files, a pyarrow
        Dataset or Table, a data frame, or a mapping from name to array
    by : column of the keys, or a level of folders such as ``asset=7``
    output : column to predict, or several
    inputs : columns, one name or several
    time : column of the clock, optional
    missing : values of outputs and inputs that stand for a missing one, such as -9999

    Returns
    -------
    Dataset

    Raises
    ------
    InputError
        No such file or column, a file that cannot be read, a table without rows, a column that holds no numbers.

    Notes
    -----
    Rows keep their order: files of a folder by name, numbers in names as numbers; a list as it stands. Names that begin
    with . or _ are left out, and where there is Parquet so is all that is not. Memory is that of a batch, whatever the
    size of the table. Keys are whole numbers or text; in a CSV file always text, as written. Time stamps are seconds
    since 1970, UTC where they name no zone, to about a quarter of a microsecond.

    Bad at: very many small files (each is opened twice), and frames of other libraries that are
    not yet in memory, which are collected first.

    Examples
    --------
    >>> table = open_dataset({"pump": ["b", "a", "b"], "y": [1.0, 2.0, None]}, by="pump", output="y")
    >>> for batch in table.batches(rows=2):
    ...     print(batch.first, batch.names, batch.codes, batch.ys[:, 0])
    0 ['b', 'a'] [0 1] [1. 2.]
    2 ['b', 'a'] [0] [nan]
    """
    outputs = [output] if isinstance(output, str) else list(output)
    return Dataset(source, by, outputs, [inputs] if isinstance(inputs, str) else list(inputs), time, missing)
