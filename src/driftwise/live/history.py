"""The past: samples and parameters, the latest in the store, all else in Parquet, a folder a day."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from datetime import UTC, date, datetime, timedelta
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..engine.atomic import replaced

WIDTH = 6  # numbers of a row: series, time, and four more
SAMPLES = "output", "prediction", "std", "status"
PARAMETERS = "group", "index", "value", "std"  # whose model, which of its parameters
WHOLE = "status", "group", "index"  # numbers that are whole
UNDATED = "undated"  # the folder of instants that are no dates
FIRST_DATE, LAST_DATE = 1e8, 4e9  # s since 1970 that are taken for dates
LARGE = 500_000  # samples that are enough for a part


class Part(NamedTuple):
    """Rows (n, 6) that are to become Parquet, with the numbers of their commits, first and last."""

    first: int
    last: int
    rows: np.ndarray

    @property
    def numbers(self) -> list[int]:
        """Numbers of the series in it."""
        return np.unique(self.rows[:, 0]).astype(int).tolist()


class History:
    """The past of all series; ``add`` what was committed, and ``write`` it when it is worth a file.

    Rows are a series, an instant, and four ``columns``: `SAMPLES`, or `PARAMETERS`. A part is named after the first
    commit in it: one that was written and not yet forgotten by the store when the process was killed is written again
    under its name, so that nothing is there twice.
    """

    def __init__(self, folder: str | Path, days: int = 0, columns: tuple[str, ...] = SAMPLES):
        self.folder, self.days = Path(folder) / ("history" if columns == SAMPLES else "parameters"), days
        self.columns = columns
        self.recent: list[tuple[int, np.ndarray]] = []
        self.samples = 0

    def add(self, number: int, blob: bytes) -> None:
        """Take rows of a commit."""
        rows = np.frombuffer(blob).reshape(-1, WIDTH)
        self.recent.append((number, rows))
        self.samples += len(rows)

    def part(self) -> Part | None:
        """Return what is to be written, None where nothing is."""
        if not self.recent:
            return None
        some = list(self.recent)
        return Part(some[0][0], some[-1][0], np.concatenate([rows for _, rows in some]))

    def write(self, part: Part, keys: Mapping[int, str], names: Sequence[Sequence[str]] = ()) -> None:
        """Write a part, a file for each day in it, with keys by number; it may be called in a thread.

        ``names`` are those of the parameters of each group.
        """
        import pyarrow as pa
        import pyarrow.parquet as pq

        numbers, time = part.rows[:, 0].astype(np.int64), part.rows[:, 1]
        order = np.lexsort([time, numbers])
        days = _days(time)
        for day in np.unique(days):
            at = order[days[order] == day]
            name = UNDATED if day < 0 else (date(1970, 1, 1) + timedelta(int(day))).isoformat()
            folder = self.folder / name
            folder.mkdir(parents=True, exist_ok=True)
            columns: dict[str, Any] = dict(zip(self.columns, part.rows[at, 2:].T))
            columns |= {name: columns[name].astype(np.int32) for name in WHOLE if name in columns}
            if names:
                columns["name"] = pa.array([names[i][j] for i, j in zip(columns["group"], columns["index"])])
                columns["name"] = columns["name"].dictionary_encode()
            used, codes = np.unique(numbers[at], return_inverse=True)
            key = pa.DictionaryArray.from_arrays(codes.astype(np.int32), pa.array([keys[i] for i in used]))
            table = pa.table({"key": key, "time": time[at], **columns})
            with replaced(folder / f"part-{part.first:012d}.parquet") as beside:
                pq.write_table(table, beside, row_group_size=1 << 16)

    def written(self, part: Part) -> None:
        """Forget what was written."""
        gone = sum(1 for number, _ in self.recent if number <= part.last)
        self.recent = self.recent[gone:]
        self.samples -= len(part.rows)

    def sweep(self, today: date) -> list[str]:
        """Delete days that are older than is told; return their names."""
        if not self.days or not self.folder.is_dir():
            return []
        first = (today - timedelta(self.days)).isoformat()
        old = [path for path in self.folder.iterdir() if path.name != UNDATED and path.name < first]
        for path in old:
            shutil.rmtree(path, ignore_errors=True)
        return [path.name for path in old]

    def read(self, number: int, key: str, start: float | None, end: float | None) -> np.ndarray:
        """Return the rows (n, 5) of a series between two instants, without its number, oldest first."""
        recent, low, high = list(self.recent), -np.inf if start is None else start, np.inf if end is None else end
        found = [rows[rows[:, 0] == number, 1:] for _, rows in recent]
        found += [self._parquet(key, low, high)]
        rows = np.concatenate(found)
        rows = rows[(rows[:, 0] >= low) & (rows[:, 0] <= high)]
        identity = rows[:, : 1 if self.columns == SAMPLES else 3]
        return rows[np.unique(identity, axis=0, return_index=True)[1]]  # a part that was just written is there twice

    def _parquet(self, key: str, low: float, high: float) -> np.ndarray:
        import pyarrow.dataset as ds

        days = [path for path in sorted(self.folder.glob("*")) if path.is_dir() and _meets(path.name, low, high)]
        files = [str(path) for day in days for path in sorted(day.glob("part-*.parquet"))]
        if not files:
            return np.zeros((0, WIDTH - 1))
        names = ["time", *self.columns]
        table = ds.dataset(files).to_table(names, filter=ds.field("key") == key)
        return np.column_stack([np.asarray(table[name], float) for name in names])


def _days(time) -> np.ndarray:
    """Return the day since 1970 of each instant, -1 where it is no date."""
    is_dated = (time >= FIRST_DATE) & (time <= LAST_DATE)
    return np.where(is_dated, np.floor_divide(np.where(is_dated, time, 0.0), 86_400), -1).astype(int)


def _meets(name: str, low: float, high: float) -> bool:
    """Say whether the folder of a day may hold instants of a range."""
    if name == UNDATED:
        return low < FIRST_DATE
    begin = datetime.fromisoformat(name).replace(tzinfo=UTC).timestamp()
    return begin <= high and begin + 86_400 > low
