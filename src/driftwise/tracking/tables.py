"""Plots from tables: rows of CSV, Parquet, JSON or a data frame, whatever their columns are called."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..engine.errors import InputError
from ..tables.cells import is_text, numbers
from .clock import clock
from .columns import FRAMES, METRES, Column, altitude_unit, is_receiver, meaning, position_roles, recognise
from .placed import outside, placed, repeats
from .plots import Fault, Plots, own_name, plots
from .ranges import of_ranges

BEARINGS = {"deg": np.pi / 180, "rad": 1.0}


@dataclass(frozen=True)
class Table:
    """Columns of cells, and where its rows lie.

    columns : pyarrow array per name
    rows : (T,) number of each row in the file, for `Fault.offset`
    faults : rows that were lost already
    """

    title: str
    columns: dict[str, Any]
    rows: np.ndarray
    units: dict[str, str] = field(default_factory=dict)
    faults: tuple[Fault, ...] = ()
    decimal: str = "."
    day_first: bool = True

    @cached_property
    def names(self) -> list[str]:
        return list(self.columns)

    def number(self, column: Column):
        """Return (values, bad) of a column as numbers."""
        try:
            return numbers(self.columns[column.name], self.decimal)
        except InputError as error:
            raise InputError(f"{self.title}: column {column.name!r}: {error}") from None

    def words(self, column: Column):
        """Return a column as words, "" where there is none; numbers without a needless fraction."""
        array = self.columns[column.name]
        if is_text(array.type):
            return np.array([(cell or "").strip() for cell in array.to_pylist()], object)
        return np.array([_word(cell) for cell in array.to_pylist()], object)


def read_table(table: Table, *, site=None, sites=None, origin=None, columns=None) -> tuple[Plots, dict[str, Column]]:
    """Return the plots of a table, and which column was taken for what.

    Parameters
    ----------
    table : Table
    site : (latitude, longitude) or (latitude, longitude, height m), optional
        Of the radar, for columns of range and azimuth.
    sites : see `driftwise.tracking.sites.read_sites`, optional
        Of several radars, by what the column of sensors says.
    origin : (latitude, longitude), optional
    columns : dict from part to name or (name, unit), optional
    """
    try:
        return _Reading(table, recognise(table.names, columns, table.units)).plots(site, sites, origin)
    except InputError as error:
        words = str(error)
        raise InputError(words if words.startswith(table.title) else f"{table.title}: {words}") from None


class _Reading:
    """One table on its way to plots: which rows are good, and what was taken for what."""

    def __init__(self, table: Table, taken):
        self.table, self.taken = table, taken
        self.used: dict[str, Column] = {}
        self.good = np.ones(len(table.rows), bool)
        self.faults = list(table.faults)

    def plots(self, site, sites, origin):
        table = self.table
        first, second, frame = position_roles(self.taken, table.names)
        time, bad, used = clock(table.columns.__getitem__, self.taken, table.decimal, table.day_first)
        self.used.update(used)
        self.drop(bad, lambda k: f"{used_time(used)!r} is no time: {cell(table, used_time(used), k)}")
        a, b = (self.coordinate(column, role) for column, role in zip((first, second), frame))
        self.drop(~np.isfinite(time), "rows without a time", counted=True)
        self.drop(~(np.isfinite(a) & np.isfinite(b)), "rows without a position", counted=True)
        altitude = self.altitude()
        key, name, sensor = (self.label(role) for role in ("key", "name", "sensor"))
        if not self.taken["key"]:
            key = name
        if not (self.taken["key"] or self.taken["name"]) and is_receiver(table.names):
            key = np.full(len(table.rows), own_name(table.title), object)
        self.drop(sensor == "anchor", "anchors of a track, not measured (sensor 'anchor')", counted=True)
        if frame[0] == "latitude":
            wrong = outside(a, b)
            if (wrong[self.good] != "").mean() > 0.5 if self.good.any() else False:
                raise InputError(
                    f"most positions of {first.name!r}, {second.name!r} are not on earth in degrees, the first "
                    f"{a[self.good][0]:g}, {b[self.good][0]:g}. Are they swapped, scaled or metres? Give "
                    "columns={'east': ..., 'north': ...} for metres"
                )
            self.drop(wrong != "", lambda k: wrong[k])
        self.drop_repeats(time, np.stack([a, b], axis=-1), key, sensor)
        good = self.good
        rest = dict(altitude=altitude[good], key=key[good], name=name[good], sensor=sensor[good])
        rest["faults"] = tuple(self.faults)
        if frame[0] == "latitude":
            return placed(time[good], a[good], b[good], origin=origin, **rest), self.used
        if frame[0] == "east":
            return plots(time[good], np.stack([a, b], axis=-1)[good], origin=origin, **rest), self.used
        at = of_ranges(a[good], b[good], altitude[good], sensor[good], site, sites)
        if at.radar is None:
            return plots(time[good], at.position, **rest), self.used
        return placed(time[good], *at.position.T, origin=origin or at.radar, **rest), self.used

    def drop(self, which, what, counted=False):
        """Take rows out: a fault each, or one that counts them."""
        rows = np.flatnonzero(which & self.good)
        self.good[rows] = False
        title, at = self.table.title, self.table.rows
        if counted and rows.size:
            self.faults.append(Fault(title, int(at[rows[0]]), f"{what}: {rows.size}, this is the first"))
        elif not counted:
            self.faults += [Fault(title, int(at[k]), what(k)) for k in rows]

    def coordinate(self, column, role):
        values, bad = self.table.number(column)
        unit = column.unit
        if role in ("latitude", "longitude", "azimuth"):
            unit = unit if unit in BEARINGS else "deg"
            turned = BEARINGS[unit] if role == "azimuth" else BEARINGS[unit] * 180 / np.pi
            values = values if turned == 1.0 else values * turned
        else:
            unit = unit if unit in METRES else "m"
            values = values * METRES[unit]
        self.used[role] = Column(column.name, unit)
        self.drop(bad, lambda k: f"{column.name!r} is no number below 1e100: {cell(self.table, column.name, k)}")
        return values

    def altitude(self):
        """Return metres; of several columns of altitude the first that has a number."""
        out = np.full(len(self.table.rows), np.nan)
        for column in self.taken["altitude"]:
            values = self.table.number(column)[0]
            if np.isfinite(values[self.good]).any():
                unit = altitude_unit(column, self.taken)
                self.used["altitude"] = Column(column.name, unit)
                return values * METRES[unit]
        return out

    def label(self, role):
        for column in self.taken[role][:1]:
            self.used[role] = Column(column.name)
            words = self.table.words(column)
            if role == "key" and meaning(column.name)[0] in ("icao24", "icao", "icaoaddress", "hexident", "hex"):
                words = np.array([word.upper() for word in words], object)
            return words
        return np.full(len(self.table.rows), "", object)

    def drop_repeats(self, time, position, key, sensor):
        rows = np.flatnonzero(self.good)
        if not rows.size:
            return
        speed = self.table.number(self.taken["speed"][0])[0][rows] if self.taken["speed"] else None
        for mask, what in zip(
            repeats(time[rows], position[rows], key[rows], sensor[rows], speed),
            ("rows at a time that their object has already", "stale rows, which repeat the position before them"),
        ):
            which = np.zeros(len(self.good), bool)
            which[rows] = mask
            self.drop(which, what, counted=True)


def _word(cell) -> str:
    if cell is None or cell != cell:
        return ""
    return f"{cell:.15g}" if isinstance(cell, float) else str(cell)


def used_time(used):
    return used["time"].name if "time" in used else used["position_time"].name


def cell(table, name, row):
    """Return a cell as it is shown in a fault."""
    return repr(str(table.columns[name][int(row)].as_py())[:40])


def frames_of(table: Table, columns=None):
    """Return (records, where they lie) of a table of Mode S frames; None of one that has positions, or no frames."""
    from .formats.modes import HEX

    taken = recognise(table.names, columns, table.units)
    if not taken["frame"] or any(all(taken[role] for role in frame) for frame in FRAMES):
        return None
    time = clock(table.columns.__getitem__, taken, table.decimal, table.day_first)[0]
    frames = table.words(taken["frame"][0])
    if not any(HEX.fullmatch(frame) for frame in frames):  # numbers of pictures, of a camera
        return None
    return [{"timestamp": t, "frame": frame} for t, frame in zip(time.tolist(), frames)], table.rows


def csv_table(data: bytes, title: str) -> Table:
    """Return the table of a delimited text in any dialect; rows are numbered by lines."""
    import pyarrow as pa

    from ..tables.csvfile import CsvSource

    data = _utf8(data)

    def source():
        found = CsvSource(pa.BufferReader(data), len(data))
        found.dialect = replace(found.dialect, texts=frozenset(found.names))  # codes such as 3e1234 are no numbers
        return found

    table, ragged, skip = _of_source(source, title)
    lines = _lines(data, skip, len(ragged))
    columns = {name: column.filter(pa.array(~ragged)) for name, column in table.columns.items()}
    faults = tuple(Fault(title, int(line), "more or fewer cells than the header") for line in lines[ragged])
    return replace(table, columns=columns, rows=lines[~ragged], faults=faults)


def _utf8(data: bytes) -> bytes:
    """Return text in UTF-8; lines that are not are taken as Latin-1, as files joined of several can be both."""
    try:
        data.decode()
        return data
    except UnicodeDecodeError:
        return b"\n".join(_line_utf8(line) for line in data.split(b"\n"))


def _line_utf8(line: bytes) -> bytes:
    try:
        line.decode()
        return line
    except UnicodeDecodeError:
        return line.decode("latin-1").encode()


def _lines(data, skip, count):
    """Return the line, from 1, of each row: blank lines and comments hold none."""
    lines = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n")
    found = [n + 1 for n, line in enumerate(lines) if n >= skip and line.strip() and line.lstrip()[:1] not in b"#%"]
    found += range(len(lines) + 1, len(lines) + 1 + count - len(found))  # cells over several lines
    return np.array(found[:count], int)


def parquet_table(data: bytes, title: str) -> Table:
    """Return the table of a Parquet file; rows are numbered from 1."""
    import pyarrow as pa

    from ..tables.parquetfile import ParquetSource

    return _of_source(lambda: ParquetSource(pa.BufferReader(data)), title)[0]


def memory_table(data, title: str) -> Table:
    """Return the table of a data frame or of a mapping from name to array; rows are numbered from 1."""
    from ..tables.parquetfile import MemorySource

    return _of_source(lambda: MemorySource(data), title)[0]


def _of_source(opened, title) -> tuple[Table, np.ndarray, int]:
    """Return all that a reader has as a table, the mask of its ragged rows, and the lines before them."""
    import pyarrow as pa

    try:
        source = opened()
        names = list(source.names)
        parts = list(source.batches(names))
        if all(mask.all() for _, mask in parts):
            raise InputError("the table has a header but no rows. Was the recording stopped before it began?")
        columns = {name: pa.concat_arrays([_plain(arrays[j]) for arrays, _ in parts]) for j, name in enumerate(names)}
    except (InputError, pa.ArrowException, OSError) as error:
        raise InputError(f"{title}: {error}") from None
    ragged = np.concatenate([mask for _, mask in parts])
    table = Table(title, columns, np.arange(1, len(ragged) + 1), dict(source.units))
    table = replace(table, decimal=source.decimal, day_first=source.day_first)
    return table, ragged, source.dialect.skip if hasattr(source, "dialect") else 0


def _plain(array):
    """Return a column in one piece; of words coded by numbers, the words."""
    import pyarrow as pa

    array = array.combine_chunks() if isinstance(array, pa.ChunkedArray) else array
    return array.dictionary_decode() if pa.types.is_dictionary(array.type) else array
