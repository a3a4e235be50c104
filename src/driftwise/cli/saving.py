"""Write a trace piece by piece, to Parquet or CSV."""

from __future__ import annotations

from contextlib import ExitStack
from typing import Any

from driftwise.engine.atomic import replaced

BLOCK = 1 << 24  # bytes of a CSV read at a time


class Saver:
    """A Parquet or CSV file, open while it is a context, that takes columns of the same names again and again.

    What was there is replaced at the end, by the whole; where the context ends in an error it stays.
    """

    def __init__(self, path: str | None):
        self.path = path
        self._writer: Any = None
        self._open = ExitStack()
        self._rows = 0

    @property
    def has_begun(self) -> bool:
        """Whether rows were taken, or none are to be saved: who is asked to stop before leaves nothing."""
        return not self.path or self._rows > 0

    def __enter__(self) -> Saver:
        return self

    def __exit__(self, *error) -> Any:
        return self._open.__exit__(*error)

    def add(self, columns: dict[str, Any]) -> None:
        """Append columns of equal length, by their names."""
        import pyarrow as pa

        table = pa.table(columns)
        if self._writer is None:
            with ExitStack() as opened:  # interrupted here, it has not begun
                beside = opened.enter_context(replaced(self.path))
                file = opened.enter_context(open(beside, "wb"))  # Python's: signals are heard where nobody reads a pipe
                writer = opened.enter_context(_kind(self.path)(file, table.schema))
                self._open, self._writer = opened.pop_all(), writer
        self._writer.write_table(table)
        self._rows += table.num_rows


def _kind(path) -> Any:
    """Return what writes files of this name."""
    from pyarrow import csv
    from pyarrow import parquet as pq

    return csv.CSVWriter if str(path).lower().endswith(".csv") else pq.ParquetWriter


def smoothed_columns(smoothed) -> dict:
    """Return the columns that smoothing adds to a saved table."""
    n = smoothed.estimator.model.n  # none for recursive models: they have no state but the parameters
    names = [*(f"x{n - i}" for i in range(n)), *smoothed.names]
    values = [*(smoothed.x.T if n else []), *smoothed.parameters.T]
    stds = [*(smoothed.x_std.T if n else []), *smoothed.parameters_std.T]
    columns = {f"{name}_smoothed": column for name, column in zip(names, values)}
    return columns | {f"{name}_smoothed_std": column for name, column in zip(names, stds)}


def widen(path: str, columns: dict) -> None:
    """Add columns to a saved table, piece by piece."""
    first = 0
    with Saver(path) as saver:
        for piece in _pieces(path):
            part = slice(first, first + piece.num_rows)
            whole = dict(zip(piece.schema.names, piece.columns))
            saver.add(whole | {name: values[part] for name, values in columns.items()})
            first = part.stop


def _pieces(path):
    """Yield record batches of a saved table; NaN stays NaN."""
    if not path.lower().endswith(".csv"):
        import pyarrow.parquet as pq

        with pq.ParquetFile(path) as file:
            yield from file.iter_batches()
        return
    from pyarrow import csv

    names = csv.open_csv(path).schema.names
    types = {name: "int64" if name == "status" else "float64" for name in names}
    convert = csv.ConvertOptions(column_types=types, null_values=[""], strings_can_be_null=False)
    with csv.open_csv(path, csv.ReadOptions(block_size=BLOCK), convert_options=convert) as reader:
        yield from reader
