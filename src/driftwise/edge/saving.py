"""Write a trace piece by piece, to Parquet or CSV."""

from __future__ import annotations

from typing import Any

__all__ = ["Saver"]


class Saver:
    """An open Parquet or CSV file that takes tables of the same columns one after another.

    What was saved is readable after every chunk as CSV, and once closed as Parquet.
    """

    def __init__(self, path: str):
        self.path = path
        self.rows = 0
        self._writer: Any = None

    def add(self, table) -> None:
        """Append a pyarrow Table."""
        if self._writer is None:
            if self.path.lower().endswith(".csv"):
                from pyarrow import csv

                self._writer = csv.CSVWriter(self.path, table.schema)
            else:
                import pyarrow.parquet as pq

                self._writer = pq.ParquetWriter(self.path, table.schema)
        self._writer.write_table(table)
        self.rows += table.num_rows

    def close(self) -> None:
        if self._writer is not None:
            self._writer.close()
