"""A table that nobody described, read without a single option: recognised, cleaned, on a regular clock."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from driftwise.engine.errors import InputError
from driftwise.results.numbers import lasting
from driftwise.tables.chunks import CHUNK_ROWS
from driftwise.tables.source import Source
from driftwise.tables.table import HEAD_ROWS, OpenTable, open_table

SHARED = 0.2  # of the rows, that have the stamp of the one before, from which on rows may be of several recordings


class Segments:
    """Iterates over (time (T,), y (T,), u (T, k)), NaN where missing, cleaned and on a regular clock.

    Attributes
    ----------
    rows : row of the table that each sample of the last segment came from, from 0; -1 where it was put in
    table : the `OpenTable` that is read; its source says how far
    clock : the `Regular` clock; it counts the rows put in and left out
    cleaned : values taken as missing so far, per column name
    """

    def __init__(self, table: OpenTable, found: Any):
        from driftwise.tables.cleaning import Cleaner
        from driftwise.tables.sampling import Regular

        self.table, self.found = table, found
        self.signals = (found.output, *found.inputs)
        self._cleaner = Cleaner(found[name].belief for name in self.signals)
        self.clock = Regular(found.sampling, [False] + [True] * len(found.inputs))
        self.rows: Any = None
        self._segments = self._read()

    @property
    def origin(self) -> str | None:
        """The time stamp of second 0, if it is known."""
        return self.table.origin(self.found.time) or self.found.count.origin

    @property
    def cleaned(self) -> dict[str, int]:
        return dict(zip(self.signals, self._cleaner.cleaned.tolist(), strict=True))

    def source(self) -> AsRead:
        """Return the rows as they are read, not yet on a clock; instead of the segments."""
        return AsRead(self.table, self.found)

    def losses(self) -> list[str]:
        """Return which cells and rows could not be read so far, a sentence each."""
        notes = [
            f"{count} cell{'s' * (count > 1)} of {name!r} cannot be read as a number below 1e100: taken as missing."
            for name, count in self.table.bad.items()
            if count and name in self.signals
        ]
        if ragged := self.table.source.ragged:
            many = "1 row has" if ragged == 1 else f"{ragged} rows have"
            notes.append(f"{many} too many or too few cells: taken as missing.")
        return notes

    def notes(self) -> list[str]:
        """Return what reading the whole table has brought up, a sentence each; of the part read so far."""
        notes = self.losses()
        cleaned = ", ".join(f"{count} of {name!r}" for name, count in self.cleaned.items() if count)
        if cleaned:
            notes.append(f"Values not believed and taken as missing: {cleaned}.")
        clock = self.clock
        if clock.inserted or clock.dropped:
            notes.append(
                f"On the clock of {self.found.dt:.6g}, {clock.inserted} missing samples were put in and "
                f"{clock.dropped} rows left out; it started again {clock.restarts} times."
            )
        return notes

    def __iter__(self):
        return self

    def __next__(self):
        return next(self._segments)

    def _read(self):
        import numpy as np

        clock = self.found.time
        names = [*self.signals, *([clock] if clock else [])]
        waiting = np.empty(0)  # stamps of the rows that the cleaner holds back
        for chunk in self.table.chunks(names):
            values = self._cleaner.push(np.column_stack([chunk[name] for name in self.signals]))
            if clock:
                waiting = np.concatenate((waiting, self.found.count.time(chunk[clock])))
            yield from self._handed(self.clock.push(waiting[: len(values)] if clock else None, values))
            waiting = waiting[len(values) :]
        yield from self._handed(self.clock.push(waiting if clock else None, self._cleaner.flush()))
        yield from self._handed(self.clock.flush())

    def _handed(self, segment):
        time, values, self.rows = segment
        if len(time):
            yield time, values[:, 0].copy(), values[:, 1:].copy()


class AsRead(Source):
    """The rows of a recognised table in the order that it is read in, its clock one column of stamps, or of seconds."""

    def __init__(self, table: OpenTable, found: Any):
        super().__init__()
        whole = table.source
        self.table, self.clock, self.count = table, found.time, found.count
        self.title, self.names, self.units = table.title, whole.names, whole.units
        self.decimal, self.day_first, self.size = whole.decimal, whole.day_first, whole.size
        self.interval = whole.interval

    def _read(self, columns):
        for arrays, ragged in self.table.as_read(columns, self.clock):
            self.position, self.ragged = self.table.source.position, self.table.source.ragged
            yield [self._timed(a) if n == self.clock else a for n, a in zip(columns, arrays)], ragged

    def _timed(self, array):
        """Return the stamps of a clock, or its seconds where they have no date."""
        import pyarrow as pa

        time = self.count.time(array.to_numpy(zero_copy_only=False))
        stamps = self.table.moments(self.clock, time, self.count.origin)
        return pa.array(time if stamps is None else stamps)


def gathered(segments, rows: int = CHUNK_ROWS):
    """Yield the same as arrays of at least so many rows each, the last one shorter."""
    import numpy as np

    parts: list[Any] = []
    for segment in segments:
        parts.append(segment)
        if sum(len(part[0]) for part in parts) >= rows:
            yield tuple(map(np.concatenate, zip(*parts)))
            parts = []
    if parts:
        yield tuple(map(np.concatenate, zip(*parts)))


def read(data, output=None, inputs=None, time=None, chunk_rows: int = CHUNK_ROWS, head_rows: int = HEAD_ROWS, dt=None):
    """Return (`Table`, iterator of (time, y, u)) of a table that nobody described.

    Parameters
    ----------
    data : file name ("-" for standard input), data frame, or mapping from column name to array
    output, inputs, time : names of columns, where they are known; what is not given is recognised
    chunk_rows : rows that are read at a time; what comes out does not depend on it
    head_rows : rows by which the table is recognised. A shorter table is recognised as a whole: to score predictions
        of its later part, give the length of the earlier one. A drop-out is known only from up to 16 rows after it.
    dt : seconds between rows, where no clock of the table says so

    Returns
    -------
    table : what was recognised, with `words` and `notes`
    segments : `Segments`, to be iterated once

    Examples
    --------
    >>> import numpy as np
    >>> u = np.repeat([0.0, 1.0, 0.0, 2.0], 25)
    >>> y = np.convolve(u, 0.5 ** np.arange(1, 12))[:100]
    >>> table, segments = read({"time": np.arange(100.0), "valve": u, "level": y})
    >>> table.output, table.inputs
    ('level', ('valve',))
    >>> sum(len(y) for time, y, u in segments)
    100
    """
    table = open_table(data, chunk_rows, head_rows, asked(output, inputs, time))
    found = recognised(table, output, inputs, time, dt)
    return found, Segments(table, found)


def asked(output=None, inputs=None, time=None) -> list[str]:
    """Return the names of the columns that somebody asked for."""
    inputs = [inputs] if isinstance(inputs, str) else inputs or ()
    return [name for name in (output, time, *inputs) if name is not None]


def recognised(table: OpenTable, output=None, inputs=None, time=None, dt=None) -> Any:
    """Return the `Table` that was recognised by the first rows of an open one; arguments as those of `read`."""
    from driftwise.tables.recognise import on_clock, recognise, worded
    from driftwise.tables.source import resolve

    try:
        output = None if output is None else resolve(table.names, output, "output")
        time = None if time is None else resolve(table.names, time, "time")
        if inputs is not None:
            inputs = [inputs] if isinstance(inputs, str) else inputs
            inputs = tuple(resolve(table.names, name, "input") for name in inputs)
        if output is not None and output in (*(inputs or ()), time):
            part = "time" if output == time else "input"
            raise InputError(f"column {output!r} is asked for as output and as {part}; it can be one of them only.")
        stamps = [name for name, kind in table.kinds.items() if kind == "stamp"]
        _turn(table, time, stamps)
        how = time, table.source.units, stamps, table.tens, table.beyond, table.calendar.values()
        found = recognise(_head(table, time), output, inputs, *how)
        if found.sampling.duplicates > SHARED * found.rows and table.keep_one(found.time, asked(output, inputs)):
            found = recognise(_head(table, time), output, inputs, *how)
        table.note_zone(found.time)
        if dt is None and not found.timed and (dt := table.source.interval):
            said = f"Samples are {lasting(dt)} apart, as the lines above the rows say."
            table.otherwise += [said] if said not in table.otherwise else []
        found = found if dt is None else on_clock(found, dt)
        again = found.sampling.restarts
        stacked, recordings = table.recordings(again + 1) if again else ((), 0)
        return worded(replace(found, stacked=stacked, recordings=recordings, otherwise=tuple(table.otherwise)))
    except InputError as error:
        raise InputError(f"{table.title}: {error}") from None


def _head(table: OpenTable, time) -> dict[str, Any]:
    """Return the first rows of all columns but of that of times of day, which that of dates takes in."""
    return {name: column for name, column in table.head.items() if name != table.time_of_day or name == time}


def _turn(table: OpenTable, time, stamps) -> None:
    """Turn a table round whose newest row comes first."""
    import numpy as np

    from driftwise.tables.column_roles import parse

    kinds = {name: parse(name).kinds for name in ([time] if time is not None else table.names)}
    for name, known in kinds.items():
        values = table.head[name]
        if values is None or (name not in stamps and name != time and "time" not in known):
            continue
        steps = np.diff(values[np.isfinite(values)])
        if len(steps) > 1 and np.mean(steps < 0) > 0.9:
            table.turn(name)
            return
