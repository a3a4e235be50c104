"""Long tables of many series: files, folders and frames in batches of so many rows, keys as small numbers."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

__all__ = ["Batch", "Dataset", "open_dataset"]

ROWS = 1 << 18


class Batch(NamedTuple):
    """A stretch of rows.

    first : number of its first row in the table, from 0
    names : keys met so far, in order of appearance: one list for all batches of a pass, which grows
    codes : (n,) int64 index of the key of each row in ``names``, -1 where the row has none
    time : (n,) seconds since 1970, or the table's own numbers; NaN where missing; None without a clock
    ys, us : (n, p), (n, k) float64, NaN where missing
    bad : (n,) bool: some cell was text, infinite or beyond 1e100, or the row was ragged
    """

    first: int
    names: list[Any]
    codes: Any
    time: Any
    ys: Any
    us: Any
    bad: Any


class Dataset:
    """A long table, as `open_dataset` found it.

    Attributes
    ----------
    by, output, inputs, time : names of the columns (output may be several)
    rows : how many, None where only reading to the end can tell
    units : unit per column name, where the table gives one
    """

    rows: int | None = None
    units: dict[str, str]

    def batches(self, rows: int = ROWS, skip: int = 0) -> Iterator[Batch]:
        """Yield batches of exactly ``rows`` rows, the last one shorter, from row ``skip`` on."""
        raise NotImplementedError

    @property
    def fraction(self) -> float | None:
        """Share of the table that the last pass has read so far."""
        raise NotImplementedError


def open_dataset(source, by: str, output, inputs=(), time: str | None = None) -> Dataset:
    """Return a long table, ready to be read in batches.

    Parameters
    ----------
    source : a Parquet or CSV file, a folder of them (flat, or `asset=7/part-0.parquet`), a list of files, a pyarrow
        Dataset or Table, a data frame, a mapping from name to array
    by : name of the column of keys (or of a folder level `asset=7`)
    output : name of the column to predict, or several
    inputs : names
    time : name of the clock's column, optional
    """
    raise NotImplementedError
