"""Tables read otherwise than they stand: years by months, a quantity a row, one of several recordings row by row."""

from __future__ import annotations

import re
from unicodedata import normalize

import numpy as np

from .calendar import PARTS
from .cells import kind_of, numbers
from .dates import CENTURY, MONTHS
from .dialect import unique
from .parquetfile import MemorySource
from .source import Source

VALUE = "value"  # what the column of all months is called
# What names nothing but a number, and what names quantities or gives their units, where each row holds one of them.
VALUES = "value values wert valeur valor valore waarde varde state reading"
QUANTITIES = (
    "tag tagname field entity entityid variable series metric parameter param sensor sensorid sensorname channel point "
    "pointname signal name variablename quantity item itemid kanal signalname messstelle merkmal topic key"
)
QUANTITY_UNITS = "unit units uom einheit unite unidad unita"
NAMELESS = ("column1", "column2", "column3")
WHOLES = frozenset("sec secs second seconds s".split())
FRACTIONS = {
    **dict.fromkeys("nanosec nanosecs nsec nsecs nanosecond nanoseconds ns nanos".split(), 1e-9),
    **dict.fromkeys("usec usecs microsec microsecs microsecond microseconds us".split(), 1e-6),
    **dict.fromkeys("msec msecs millisec millisecs millisecond milliseconds ms millis".split(), 1e-3),
}  # seconds of what stands beside whole ones
MOST_QUANTITIES, MOST_ROWS = 16, 65_535
WHOLE = 0.9  # share of the stamps at which every quantity was taken


class Reshaped(Source):
    """A source whose rows are those of another, read otherwise."""

    def __init__(self, source: Source, names: tuple[str, ...], units: dict[str, str]):
        super().__init__()
        self.source, self.title, self.names, self.units = source, source.title, names, units
        self.decimal, self.day_first, self.size = source.decimal, source.day_first, source.size

    def _rows(self, columns):
        """Yield (arrays, ragged) of the other source, and be as far as it is."""
        for arrays, ragged in self.source.batches(columns):
            self.position, self.ragged, self.closing = self.source.position, self.source.ragged, self.source.closing
            yield arrays, ragged


class Unrolled(Reshaped):
    """The rows of a source of years as months: the year, the number of the month, and the value.

    ``months`` are the names of its twelve columns from January on. Other columns are left out.
    """

    def __init__(self, source: Source, year: str, months: list[str]):
        super().__init__(source, (year, "month", VALUE), {})
        self.columns = [year, *months]
        others = [name for name in source.names if name not in self.columns]
        self.notes = (
            f"{months[0]!r} to {months[-1]!r} are the months of a year side by side: they are read as one column, "
            f"{VALUE!r}, a row a month" + (f", without {', '.join(map(repr, others))}." if others else "."),
        )

    def _read(self, columns):
        import pyarrow as pa

        for arrays, ragged in self._rows(self.columns):
            years, months = np.repeat(np.arange(len(ragged)), 12), np.tile(np.arange(1.0, 13.0), len(ragged))
            cells = _end_to_end(arrays[1:])
            across = cells.take(pa.array(np.arange(12 * len(ragged)).reshape(12, -1).T.ravel()))
            found = dict(zip(self.names, (arrays[0].take(pa.array(years)), pa.array(months), across)))
            yield [found[name] for name in columns], ragged[years]


class Kept(Reshaped):
    """The rows of a source with one cell in a column, which names one of several recordings that share their stamps."""

    def __init__(self, source: Source, name: str, cell):
        super().__init__(source, source.names, source.units)
        self.name, self.cell = name, cell

    def _read(self, columns):
        import pyarrow as pa

        for arrays, ragged in self._rows([*columns, self.name]):
            kept = np.array([cell == self.cell for cell in arrays[-1].to_pylist()], bool)
            yield [array.filter(pa.array(kept)) for array in arrays[:-1]], ragged[kept]


class WithFractions(Reshaped):
    """The rows of a source with a column of seconds, and their fractions in another, as one column of seconds.

    ``fraction`` counts in ``size`` seconds.
    """

    def __init__(self, source: Source, whole: str, fraction: str, size: float):
        super().__init__(source, tuple(name for name in source.names if name != fraction), source.units)
        self.whole, self.part, self.part_size = whole, fraction, size
        self.notes = (*source.notes, f"{fraction!r} are fractions of the seconds of {whole!r}: they are added.")

    def _read(self, columns):
        import pyarrow as pa

        for arrays, ragged in self._rows([*columns, *([self.part] if self.whole in columns else [])]):
            if self.whole in columns:
                at, more = columns.index(self.whole), numbers(arrays.pop(), self.decimal)[0]
                arrays[at] = pa.array(numbers(arrays[at], self.decimal)[0] + self.part_size * more)
            yield arrays, ragged


def with_fractions(source: Source, named=()) -> Source:
    """Return a table with seconds and their fractions, as ROS and C write them, as one of seconds; any other as it is.

    >>> from driftwise.tables.parquetfile import MemorySource
    >>> table = {"stamp.sec": [7, 7, 8], "stamp.nanosec": [0, 500_000_000, 0], "temp": [20.5, 20.7, 20.6]}
    >>> with_fractions(MemorySource(table)).names
    ('stamp.sec', 'temp')
    """
    words = {name: re.findall(r"[a-z]+", name.lower()) for name in source.names}
    pairs = [
        (whole, part, FRACTIONS[words[part][-1]])
        for part in source.names
        if words[part] and words[part][-1] in FRACTIONS and part not in named
        for whole in source.names
        if words[whole] and words[whole][-1] in WHOLES and words[whole][:-1] == words[part][:-1]
    ]
    for whole, part, size in pairs:
        arrays = source.look(1)[0][0]
        cells = [arrays[source.names.index(name)] for name in (whole, part)]
        if any(kind_of(array, source.decimal, source.day_first) != "number" for array in cells):
            continue
        seconds, rest = (numbers(array, source.decimal)[0] for array in cells)
        fine = np.isfinite(seconds) & np.isfinite(rest)
        is_whole = not np.any(np.r_[seconds[fine], rest[fine]] % 1)
        if is_whole and fine.any() and rest[fine].min() >= 0 and 0 < size * rest[fine].max() < 1:
            return WithFractions(source, whole, part, size)
    return source


def _end_to_end(arrays):
    """Return pyarrow arrays as one, of text where they are not alike."""
    import pyarrow as pa

    kinds = {array.type for array in arrays}
    is_alike = len(kinds) == 1 and not any(map(pa.types.is_dictionary, kinds))
    return pa.concat_arrays(arrays if is_alike else [array.cast(pa.string()) for array in arrays])


def widened(source: Source, named=()) -> Source:
    """Return a table of one quantity a row as one of a column each; any other, or where its value is named, as it is.

    A column of words names the quantities, and a column that names nothing holds the values. Where they do not share
    their stamps, or the table is long, it is the table of that one alone which was taken most often.

    >>> from driftwise.tables.parquetfile import MemorySource
    >>> days, tags = ["2024-01-01", "2024-01-01", "2024-01-02", "2024-01-02"], ["heater", "temp"] * 2
    >>> widened(MemorySource({"time": days, "tag": tags, "value": [1.0, 20.5, 2.0, 20.7]})).names
    ('time', 'heater', 'temp')
    >>> widened(MemorySource({"time": days, "station": tags, "level": [1.0, 20.5, 2.0, 20.7]})).names
    ('time', 'station', 'level')
    """
    import pyarrow as pa
    import pyarrow.compute as pc

    words = {name: re.sub(r"[^a-z]", "", name.lower()) for name in source.names}
    if NAMELESS == tuple(source.names):  # mosquitto_sub, and others that print a topic and its value
        words = dict(zip(NAMELESS, ("time", "topic", "value")))
    called = {what: [n for n in source.names if words[n] in what.split()] for what in (VALUES, QUANTITIES)}
    if len(called[VALUES]) != 1 or not called[QUANTITIES] or called[VALUES][0] in named:
        return source
    batches = source.look(MOST_ROWS + 1)
    columns = {n: _end_to_end([arrays[j] for arrays, _ in batches]) for j, n in enumerate(source.names)}
    kinds = {name: kind_of(array, source.decimal, source.day_first) for name, array in columns.items()}
    clocks = [name for name, kind in kinds.items() if kind == "stamp" and len(columns[name].unique()) > 1]
    if not clocks and NAMELESS == tuple(source.names) and _count_seconds(columns[NAMELESS[0]], source.decimal):
        clocks = [NAMELESS[0]]
    keys = [name for name in called[QUANTITIES] if kinds[name] in ("text", "switch")]
    keys = [name for name in keys if 1 < len(columns[name].drop_null().unique()) <= MOST_QUANTITIES]
    if len(clocks) != 1 or len(keys) != 1 or kinds[called[VALUES][0]] != "number":
        return source
    stamps, quantities = (columns[name].dictionary_encode() for name in (clocks[0], keys[0]))
    at, which = (pc.fill_null(array.indices, -1).to_numpy() for array in (stamps, quantities))
    rows = np.full((len(quantities.dictionary), len(stamps.dictionary)), -1)
    fine = (at >= 0) & (which >= 0)
    if not fine.any():
        return source
    rows[which[fine], at[fine]] = np.flatnonzero(fine)
    count = f"{keys[0]!r} names {len(rows)} quantities, of which each row holds one"
    if len(at) > MOST_ROWS or np.mean((rows >= 0).all(axis=0)) < WHOLE or np.sum(rows >= 0) < WHOLE * len(at):
        most = quantities.dictionary[int(np.argmax(np.bincount(which[fine])))].as_py()
        kept = Kept(source, keys[0], most)
        kept.notes = (*source.notes, f"{count}: {most!r} alone is read; put others beside it.")
        return kept
    names = unique([clocks[0], *map(str, quantities.dictionary.to_pylist())], 1 + len(rows))
    cells = [columns[called[VALUES][0]].take(pa.array(row, mask=row < 0)) for row in rows]
    wide = MemorySource(pa.table(dict(zip(names, (stamps.dictionary, *cells)))))
    wide.title, wide.decimal, wide.day_first = source.title, source.decimal, source.day_first
    for name in (n for n in source.names if words[n] in QUANTITY_UNITS.split()):
        units = [columns[name][int(row[row >= 0][0])].as_py() for row in rows]
        wide.units = {n: unit for n, unit in zip(names[1:], units) if isinstance(unit, str) and unit}
    wide.notes = (*source.notes, f"{count}: they are read side by side.")
    return wide


def _count_seconds(array, decimal: str) -> bool:
    """Whether cells are seconds since 1970, of this century."""
    values = numbers(array, decimal)[0]
    return bool(np.all((CENTURY[0] <= values) & (values < CENTURY[1])))


def unrolled(source: Source, named=()) -> Source:
    """Return a table of years by months as one of months; any other, or where ``named`` has a column of it, as it is.

    Twelve columns are called as the months, in one language or another, in their order, and one as a year, of which no
    two rows have the same: marks of the month that a row is of are no values.

    >>> from driftwise.tables.parquetfile import MemorySource
    >>> table = {"Year": [2001, 2002]} | {month: [1.0, 2.0] for month in "Jan Feb Mar Apr May Jun Jul".split()}
    >>> unrolled(MemorySource(table)).names[-1]
    'Jul'
    >>> table |= {month: [1.0, 2.0] for month in "Aug Sep Oct Nov Dec".split()}
    >>> unrolled(MemorySource(table | {"Annual": [1.0, 2.0]})).names
    ('Year', 'month', 'value')
    """
    words = {name: re.sub(r"[^a-z]", "", normalize("NFKD", name.lower())) for name in source.names}
    years = [name for name, word in words.items() if word in PARTS["year"][0].split()]
    months = [name for name, word in words.items() if any(word in names.split("|") for names in MONTHS)]
    is_year = len(years) == 1 and len(months) == 12
    if not is_year or set(named) & {*months} or not all(words[n] in m.split("|") for n, m in zip(months, MONTHS)):
        return source
    first = [cell for arrays, _ in source.look(1) for cell in arrays[source.names.index(years[0])].to_pylist()]
    return Unrolled(source, years[0], months) if len(set(first)) == len(first) else source
