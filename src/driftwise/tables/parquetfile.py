"""Parquet, pyarrow Datasets and data in memory, batch by batch: any length in the memory of a few batches."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from driftwise.engine.errors import InputError
from driftwise.tables.cells import is_text
from driftwise.tables.dialect import unique
from driftwise.tables.source import Source

BATCH = 1 << 16


class ParquetSource(Source):
    """Rows of a Parquet file as batches of pyarrow columns; only the columns asked for are read.

    ``words`` are columns of text that come as dictionaries; ``least`` are the rows there must be.
    """

    def __init__(self, path, words=(), least: int = 1):
        super().__init__()
        import pyarrow as pa
        import pyarrow.parquet as pq

        self.title = str(path)
        try:
            self._file = pq.ParquetFile(path, pre_buffer=False, buffer_size=1 << 20)
            kinds = {field.name: field.type for field in self._file.schema_arrow}
            found = [name for name in words if name in kinds and is_text(kinds[name])]
            if found:
                options: Any = dict(pre_buffer=False, buffer_size=1 << 20, read_dictionary=found)
                self._file = pq.ParquetFile(path, metadata=self._file.metadata, **options)
        except (pa.ArrowException, UnicodeDecodeError, OSError) as error:  # a name that is no text is damage, too
            raise InputError(
                f"{path} begins like a Parquet file but cannot be read ({error}). Was the copy cut short?"
            ) from None
        self.rows = self._file.metadata.num_rows
        schema = self._file.schema_arrow
        self._written, self.names = list(schema.names), tuple(unique(schema.names, len(schema.names)))
        units = {
            name: f.metadata[b"unit"] for name, f in zip(self.names, schema) if f.metadata and b"unit" in f.metadata
        }
        self.units = {name: unit.decode("utf-8", "replace") for name, unit in units.items()}
        self.size = self.rows
        if self.rows < least:
            raise InputError(
                "the table is empty: it has columns but no rows. Was the recording stopped before it began?"
            )

    def _read(self, columns):  # row groups before ``position`` are not read
        import numpy as np

        taken, row, groups = self.position, 0, list(range(self._file.num_row_groups))
        while groups and row + self._file.metadata.row_group(groups[0]).num_rows <= taken:
            row += self._file.metadata.row_group(groups.pop(0)).num_rows
        which = [self.names.index(name) for name in columns]
        written = list(dict.fromkeys(self._written[j] for j in which))
        for batch in self._file.iter_batches(BATCH, row_groups=groups, columns=written, use_threads=False):
            row += batch.num_rows
            if row <= taken:
                continue
            batch = batch.slice(max(0, batch.num_rows - (row - taken)))
            self.position = row
            yield [self._column(batch, j) for j in which], np.zeros(batch.num_rows, bool)

    def _column(self, batch, j: int) -> Any:
        """Return column j of the file from a batch of some: of several by one name, as many are before it there."""
        name = self._written[j]
        return batch.column(batch.schema.get_all_field_indices(name)[self._written[:j].count(name)])


class MemorySource(Source):
    """Rows of a data frame (pandas, polars, pyarrow ...) or of a mapping from name to array, like a file."""

    def __init__(self, data):
        super().__init__()
        self._table = _mapped(data) if isinstance(data, Mapping) else _framed(data)
        self.rows = self.size = self._table.num_rows
        self.names = tuple(unique(list(map(str, self._table.column_names)), self._table.num_columns))
        if not self.rows:
            raise InputError("the data have no rows. Was a filter too strict?")

    def _read(self, columns):
        import numpy as np

        at = [self.names.index(name) for name in columns]
        while self.position < self._table.num_rows:
            part = self._table.slice(self.position, BATCH)
            self.position += part.num_rows
            yield [part.column(j).combine_chunks() for j in at], np.zeros(part.num_rows, bool)


class ScannedSource(Source):
    """Rows of a pyarrow Dataset, wherever it lies, in its own order."""

    def __init__(self, dataset):
        super().__init__()
        self._dataset = dataset
        self.names = tuple(dataset.schema.names)
        self.rows = self.size = dataset.count_rows()

    def _read(self, columns):  # from ``position`` on
        import numpy as np

        ahead: Any = dict(batch_readahead=1, fragment_readahead=1, use_threads=False)
        skip = self.position
        for batch in self._dataset.to_batches(columns=list(dict.fromkeys(columns)), batch_size=1 << 16, **ahead):
            if skip >= batch.num_rows:
                skip -= batch.num_rows
                continue
            batch, skip = batch.slice(skip), 0
            self.position += batch.num_rows
            yield [batch.column(name) for name in columns], np.zeros(batch.num_rows, bool)


def _mapped(data) -> Any:
    import numpy as np
    import pyarrow as pa

    columns = {}
    for name, values in data.items():
        array = np.asarray(values)
        if array.ndim != 1:
            raise InputError(
                f"column {name!r} has shape {array.shape}; a column is an array of one dimension. Is it a table?"
            )
        if array.dtype.kind == "M" and np.datetime_data(array.dtype)[0] in ("Y", "M", "W", "h", "m"):
            array = array.astype("datetime64[s]")  # units that pyarrow does not know
        try:
            columns[str(name)] = pa.array(array, from_pandas=array.dtype == object)
        except pa.ArrowException:
            raise InputError(f"column {name!r} of type {array.dtype} cannot be used as numbers or words.") from None
    lengths = {name: len(column) for name, column in columns.items()}
    if len(set(lengths.values())) > 1:
        raise InputError(f"the columns differ in length: {lengths}. Do they come from different recordings?")
    if not columns:
        raise InputError("the data have no columns; give a mapping from name to array.")
    return pa.table(columns)


def _framed(data) -> Any:
    import narwhals as nw
    import pyarrow as pa

    if isinstance(data, pa.Table):
        return data
    try:
        frame: Any = nw.from_native(data)
    except nw.exceptions.DuplicateError as error:
        raise InputError(f"the columns of a data frame must have different names. {error}") from None
    except TypeError:
        raise InputError(
            f"data must be a file name, a data frame or a mapping from column name to array, got "
            f"{type(data).__name__}. An array has no names: give {{'y': y, 'u': u}}."
        ) from None
    if isinstance(frame, nw.LazyFrame):
        frame = frame.collect()
    index: Any = nw.maybe_get_index(frame)
    table = nw.maybe_reset_index(frame).to_arrow()
    index = index.to_timestamp() if hasattr(index, "to_timestamp") else index  # months, quarters: their first day
    if index is not None and getattr(index, "nlevels", 1) == 1 and getattr(index.dtype, "kind", "") in "Mm":
        table = table.add_column(0, str(index.name or "time"), pa.array(index))  # pandas keeps its clock in the index
    return table
