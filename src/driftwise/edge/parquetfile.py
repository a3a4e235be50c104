"""Parquet, batch by batch: any length in the memory of a few batches."""

from __future__ import annotations

from collections.abc import Iterator

from driftwise.errors import InputError

__all__ = ["ParquetSource"]

BATCH = 1 << 16


class ParquetSource:
    """Rows of a Parquet file as batches of pyarrow columns; only the columns asked for are read."""

    decimal = "."
    ragged = 0

    def __init__(self, path):
        import pyarrow as pa
        import pyarrow.parquet as pq

        try:
            self._file = pq.ParquetFile(path, pre_buffer=False, buffer_size=1 << 20)
        except (pa.ArrowInvalid, OSError) as error:
            raise InputError(
                f"{path} begins like a Parquet file but cannot be read ({error}). Was the copy cut short?"
            ) from None
        self.rows = self._file.metadata.num_rows
        schema = self._file.schema_arrow
        self.names = tuple(schema.names)
        self.units = {f.name: f.metadata[b"unit"].decode() for f in schema if f.metadata and b"unit" in f.metadata}
        self.size, self.position = self.rows, 0
        if not self.rows:
            raise InputError(
                "the table is empty: it has columns but no rows. Was the recording stopped before it began?"
            )

    def batches(self, columns: list[str]) -> Iterator[tuple[list, list[int]]]:
        """Yield (pyarrow arrays in the order of `columns`, no ragged rows)."""
        for batch in self._file.iter_batches(BATCH, columns=columns, use_threads=False):
            self.position += batch.num_rows
            yield [batch.column(name) for name in columns], []
