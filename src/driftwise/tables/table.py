"""Whole tables: to look at without naming a column, and then to read, once, chunk by chunk."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from driftwise.engine.errors import InputError
from driftwise.results.numbers import listed
from driftwise.tables.calendar import calendar_of, is_part, joined
from driftwise.tables.cells import (
    OF_DAY,
    are_beyond,
    converted,
    kind_of,
    numbers,
    seconds,
    zone_of,
)
from driftwise.tables.chunks import CHUNK_ROWS, rechunked
from driftwise.tables.clock import DAY, Clock, TimeOfDay
from driftwise.tables.moments import moment
from driftwise.tables.parts import source_of
from driftwise.tables.reshaped import Kept, unrolled, widened, with_fractions
from driftwise.tables.source import Source, title_of
from driftwise.tables.tens import in_tens, ten_of

MOST_COLUMNS = 4096  # among which it is found out what they are; a few milliseconds each
APART = 0.98  # share of the rows of a stamp that are of one recording each, at least
FEW, MORE = 4, 4  # recordings, beyond which one in so many may begin without that the clock shows it
HEAD_ROWS = 65_536  # rows by which a table is recognised, whatever its chunks


class OpenTable:
    """A table to look at and then to read, once.

    Attributes
    ----------
    names : of all columns
    source : the reader; it knows units, the rows of the file, those that were ragged, and how far it is
    kinds : "number", "stamp" (also a time of day), "switch" (on and off) or "text" per column name
    head : the first rows: float64 per column of numbers (NaN where missing), seconds per column of time stamps, None
        per column of text. A column of dates takes in the time of day that a column of its own holds.
    calendar : part -> name of the columns that make up a date between them; seconds then stand in that of the year
    time_of_day : the column of times of day that the column of dates takes in, None where there is none
    tens : power of ten that a column is counted in, where its numbers are very large or very small
    bad : cells so far that were no finite number, per column of numbers that was read
    otherwise : how its rows are read, where that is not as they stand; a sentence each
    """

    def __init__(self, title: str, source: Source, chunk_rows: int = CHUNK_ROWS, head_rows: int = HEAD_ROWS):
        import numpy as np

        self.title, self.source, self.chunk_rows, self.names = title, source, chunk_rows, tuple(source.names)
        self.bad: dict[str, int] = {}
        self.tens: dict[str, int] = {}
        self.time_of_day: str | None = None
        self._date: str | None = None  # the column of dates that takes them in
        self.calendar: dict[str, str] = {}
        self.otherwise: list[str] = []
        self._is_turned = False
        first = source.look(head_rows)
        if not first:
            raise InputError(f"{title}: the table has a header but no rows. Was the recording stopped before it began?")
        self.otherwise += source.notes
        if source.closing:
            self.otherwise.append(
                f"Lines below the rows are no samples: {listed([*map(repr, source.closing)])} left out."
            )
        self._how = source.decimal, source.day_first
        self._cells = {
            name: kind_of(array, *self._how, source.said_of(name))
            for name, array in zip(self.names, first[0][0], strict=True)
        }
        texts = {name: array for name, array in zip(self.names, first[0][0]) if self._cells[name] == "text"}
        self.beyond = {name for name, array in texts.items() if are_beyond(array, source.decimal)}
        self._clocks = {name: Clock(name) for name, kind in self._cells.items() if kind == "stamp"}
        self.kinds = {name: "stamp" if kind in OF_DAY else kind for name, kind in self._cells.items()}
        self._pair(dict(zip(self.names, first[0][0])))
        self.calendar = self._parts_of_dates(dict(zip(self.names, first[0][0])))
        parts = list(self._converted(list(self.names), first))
        self._first = {name: [part[0][j] for part in first] for j, name in enumerate(self.names)}
        self._is_whole = sum(len(ragged) for _, ragged in first) < head_rows
        self.head = {name: np.concatenate([part[name] for part in parts])[:head_rows] if kind != "text" else None
                     for name, kind in self.kinds.items()}  # fmt: skip
        numbers = {name: values for name, values in self.head.items() if self.kinds[name] == "number"}
        self.tens = {name: ten for name, values in numbers.items() if (ten := ten_of(values))}
        self.head |= {name: in_tens(self.head[name], ten) for name, ten in self.tens.items()}
        self.bad = {}

    def recordings(self, count: int) -> tuple[tuple[str, ...], int]:
        """Return the columns that tell recordings apart, one below the other, and how many there are; () where none do.

        ``count`` recordings are told by the clock, which starts again; a few more may begin when the one before ended.
        """
        most = count + max(count // MORE, 1) if count > FEW else count
        whole = {}
        for name in self._first:
            cells = self._texts(name) if self.kinds[name] != "stamp" else []
            begins = [k for k, cell in enumerate(cells) if not k or cell != cells[k - 1]]
            if count <= len(begins) == len({cells[k] for k in begins}) <= most:
                return (name,), len(begins)
            if len(begins) <= count and len(set(cells)) > 1:
                whole[name] = cells
        rows = list(zip(*whole.values()))
        runs = [row for k, row in enumerate(rows) if not k or row != rows[k - 1]]
        return (tuple(whole), count) if len(runs) == len(set(runs)) == count else ((), 0)

    def keep_one(self, clock: str | None, but=()) -> bool:
        """Keep the rows of the first of several recordings that share their stamps; whether a column names them.

        It tells the rows of each stamp apart, by few names all along, and is none of ``but``.
        """
        stamps = list(zip(*map(self._texts, self._stamped(clock)))) if clock is not None else []
        most = max(Counter(stamps).values(), default=0)
        for name in [one for one in self._first if one not in but and self.kinds[one] != "stamp"]:
            cells = self._texts(name)
            many = len(set(cells))
            if 1 < many <= most and len(set(zip(stamps, cells))) >= APART * len(cells):
                self._keep(name, cells, many)
                return True
        return False

    def _stamped(self, clock: str) -> list[str]:
        """Return the columns that make up the stamps of a clock: parts of a date, or a date and a time of day."""
        if clock == self.calendar.get("year"):
            return list(self.calendar.values())
        return [clock, self.time_of_day] if clock == self._date and self.time_of_day else [clock]

    def _keep(self, name: str, cells: list[Any], many: int) -> None:
        first = cells[-1 if self._is_turned else 0]
        self.source = Kept(self.source, name, first)
        kept = [cell == first for cell in cells][:: -1 if self._is_turned else 1]
        self.head = {n: None if values is None else values[kept[: len(values)]] for n, values in self.head.items()}
        self.otherwise.append(
            f"{name!r} names {many} recordings that share their stamps, and the first of them, "
            f"{str(first).removesuffix('.0')}, is read: keep the rows of another to learn of that one."
        )

    def _texts(self, name: str) -> list[Any]:
        """Return the cells of the first rows of a column as they stand."""
        return [cell for part in self._first[name] for cell in part.to_pylist()]

    def moment(self, name: str | None, option: str, said: float | str, is_end: bool = False) -> float:
        """Return the time of a column that an option says, as `moment` does."""
        return moment(self._clocks.get(name or "", Clock()), name, self.source, option, said, is_end)

    def origin(self, name: str | None) -> str | None:
        """Return the first time stamp of a column, None for one of numbers."""
        return self._clocks[name].origin if name in self._clocks else None

    def moments(self, name: str, time, origin: str | None):
        """Return stamps of seconds since the first of a column's, or since another ``origin``; None without either."""
        import numpy as np

        if name in self._clocks:
            return self._clocks[name].moments(time)
        return None if origin is None else np.datetime64(origin, "us") + np.rint(1e6 * time).astype("timedelta64[us]")

    def chunks(self, names=None) -> Iterator[dict[str, Any]]:
        """Yield the chosen columns, first rows first, in chunks of `chunk_rows` rows, the last one shorter."""
        names = [name for name in (self.names if names is None else names) if self.kinds[name] != "text"]
        for (values,) in rechunked(self._parts(names) if names else (), self.chunk_rows):
            yield dict(zip(names, values))

    def _parts(self, names):
        """Yield the chosen columns (columns, rows), batch by batch as the file hands them over."""
        import numpy as np

        asked = list(dict.fromkeys([*names, *(part for name in names for part in self._stamped(name))]))
        found = self._converted(asked, self.source.batches(asked))
        parts = (np.stack([columns[name] for name in names]) for columns in found)
        if self._is_turned:
            yield (np.concatenate(list(parts), axis=1)[:, ::-1],)
        else:
            yield from ((part,) for part in parts)

    def as_read(self, names: list[str], clock: str | None) -> Iterator[tuple[list[Any], Any]]:
        """Yield (pyarrow arrays of the chosen columns as they stand, mask of ragged rows), as rows are read.

        Of a clock they hold what `chunks` has of it: seconds since its origin, or its numbers.
        """
        import pyarrow as pa

        stamped = self._stamped(clock) if clock in names else []
        asked = list(dict.fromkeys([*names, *stamped]))
        seen: list[tuple[list[Any], Any]] = []

        def clocked():
            for arrays, ragged in self.source.batches(asked):
                seen.append((arrays, ragged))
                yield [arrays[asked.index(name)] for name in stamped], ragged

        turned = []
        for columns in self._converted(stamped, clocked()):
            arrays, ragged = seen.pop()
            found = [pa.array(columns[n]) if n == clock else arrays[asked.index(n)] for n in names]
            if self._is_turned:
                back = pa.array(range(len(ragged) - 1, -1, -1))
                turned.append(([array.take(back) for array in found], ragged[::-1]))
            else:
                yield found, ragged
        yield from reversed(turned)

    def note_zone(self, clock: str | None) -> None:
        """Note that stamps of a clock are told in UTC, where they are written in another zone."""
        first = self._first[clock][0] if clock in self._clocks and clock not in self.calendar.values() else None
        if first is not None and (zone := zone_of(first)):
            self.otherwise.append(f"{clock!r} is written in the zone {zone}: dates are told in UTC.")

    def turn(self, clock: str) -> None:
        """Turn round the rows of a table whose newest row comes first; refuse one that is too long for that."""
        if not self._is_whole:
            raise InputError(
                f"{clock!r} runs backwards, the newest row first, and the table is too long to be turned round here: "
                "sort its rows by time and save it again."
            )
        self._is_turned = True
        self.otherwise.append(f"{clock!r} runs backwards, the newest row first: the rows were turned round.")
        self.head = {name: None if column is None else column[::-1] for name, column in self.head.items()}

    def _pair(self, arrays) -> None:
        """Find a column of dates and a column of times of day that belong together."""
        import numpy as np

        hours = [name for name, kind in self._cells.items() if kind == "time of day"]
        if len(hours) != 1:
            return
        dates = []
        for name in self._clocks:
            stamps, bad, _ = seconds(arrays[name], *self._how)
            if not np.any(stamps[~bad] % int(DAY * 1e9)):
                dates.append(name)
        if len(dates) == 1:
            self._date, self.time_of_day = dates[0], hours[0]
            self.kinds[hours[0]] = "text"

    def _parts_of_dates(self, arrays) -> dict[str, str]:
        """Find columns of numbers that are year, month, day, .. of one date, where no column holds it whole."""
        if self._clocks:
            return {}
        kinds = [name for name, kind in self._cells.items() if kind == "number"]
        found = calendar_of({name: numbers(arrays[name], self._how[0])[0] for name in kinds if is_part(name)})
        if found:
            self._clocks[found["year"]] = Clock(found["year"])
            self.kinds[found["year"]] = "stamp"
        return found

    def _converted(self, names, batches) -> Iterator[dict[str, Any]]:
        """Yield float64 columns of each batch, NaN where a row is ragged; count bad cells."""
        days = {name: day for name, kind in self._cells.items() if (day := TimeOfDay.of(kind))}
        for arrays, _ in batches:
            cells = zip(names, arrays)
            found = {n: converted(a, self._cells[n], *self._how) for n, a in cells if self._cells[n] != "text"}
            columns = {name: values for name, (values, _) in found.items()}
            if self.calendar and self.calendar["year"] in columns:
                year = self.calendar["year"]
                stamps = joined({part: columns[name] for part, name in self.calendar.items()})
                columns[year] = self._clocks[year].stamps(stamps, "s")
            for name, (values, bad) in found.items():
                if name in self.calendar.values():
                    continue
                if name in self._clocks:
                    columns[name] = self._clocks[name].stamps(values)
                elif name in days:
                    columns[name] = values if self._date else days[name].push(values)
                else:
                    self.bad[name] = self.bad.get(name, 0) + int(bad.sum())
            columns |= {name: in_tens(columns[name], ten) for name, ten in self.tens.items() if name in columns}
            if self._date in columns:
                columns[self._date] = columns[self._date] + columns.pop(self.time_of_day)
            yield columns


def open_table(data, chunk_rows: int = CHUNK_ROWS, head_rows: int = HEAD_ROWS, named=()) -> OpenTable:
    """Open a whole table: a CSV or Parquet file, a data frame, or a mapping from column name to array.

    Parameters
    ----------
    data : file name ("-" for CSV on standard input), data frame (through narwhals) or mapping
    chunk_rows : rows of a chunk
    head_rows : rows of the first look
    named : columns that somebody asked for; without one of them, months side by side are read as one column, and
        quantities one below the other as one column each

    Examples
    --------
    >>> table = open_table({"t": [0.0, 0.1, 0.2], "y": [1.0, None, 3.0], "note": ["a", "b", "c"]}, chunk_rows=2)
    >>> table.kinds
    {'t': 'number', 'y': 'number', 'note': 'text'}
    >>> [chunk["y"].tolist() for chunk in table.chunks(["y"])]
    [[1.0, nan], [3.0]]
    """
    what = "the mapping" if isinstance(data, Mapping) else "the data frame"
    title = title_of(data) if isinstance(data, str | Path) else what
    source = with_fractions(widened(unrolled(source_of(data), named), named), named)
    if len(source.names) > MOST_COLUMNS:
        raise InputError(
            f"{title}: of more than {MOST_COLUMNS} columns it is not found out what they are, and there are "
            f"{len(source.names)}: name the output and its inputs, and the model (--output, --input, --model)."
        )
    return OpenTable(title, source, chunk_rows, head_rows)
