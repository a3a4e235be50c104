"""Tables read otherwise than they stand: years by months as one column, one of several recordings row by row."""

from __future__ import annotations

import re
from unicodedata import normalize

import numpy as np

from .calendar import PARTS
from .dates import MONTHS
from .source import Source

VALUE = "value"  # what the column of all months is called


class Reshaped(Source):
    """A source whose rows are those of another, read otherwise."""

    def __init__(self, source: Source, names: tuple[str, ...], units: dict[str, str]):
        super().__init__()
        self.source, self.title, self.names, self.units = source, source.title, names, units
        self.decimal, self.day_first, self.size = source.decimal, source.day_first, source.size

    def _rows(self, columns):
        """Yield (arrays, ragged) of the other source, and be as far as it is."""
        for arrays, ragged in self.source.batches(columns):
            self.position, self.ragged = self.source.position, self.source.ragged
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
            kind = arrays[1].type if len({array.type for array in arrays[1:]}) == 1 else pa.string()
            cells = pa.concat_arrays([array.cast(kind) for array in arrays[1:]])
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
