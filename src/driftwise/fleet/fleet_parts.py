"""A long table in a folder, part after part; each is there as a whole, or not at all."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from driftwise.engine.atomic import SUFFIX, replaced
from driftwise.fleet.fleet_sums import Sums

ROWS = 1 << 18  # of a part; so many are in memory
NAME = re.compile(r"part-(\d{15})\.parquet")


class Parts:
    """Takes tables one after the other and writes them in parts.

    A part is called after the row of the input at which it begins, so that a run that goes on from a row knows which
    parts lie beyond it.
    """

    def __init__(self, folder, sums: Sums, begun: int = 0):
        self.folder, self.sums, self._begun = Path(folder), sums, begun
        self._waiting: list[Any] = []

    def add(self, table) -> None:
        """Take a pyarrow Table."""
        if table.num_rows:
            self._waiting.append(table)

    def reached(self, row: int) -> None:
        """Write a part if it is long enough: all before that row of the input has been taken."""
        if sum(table.num_rows for table in self._waiting) >= ROWS:
            self.close(row)

    def close(self, row: int) -> None:
        """Write what has come so far; what comes next begins at that row of the input."""
        if self._waiting:
            import pyarrow as pa

            self.folder.mkdir(exist_ok=True)
            path = self.folder / f"part-{self._begun:015d}.parquet"
            write_table(pa.concat_tables(self._waiting), path)
            self.sums.add(path)
        self._waiting, self._begun = [], row

    def paths(self) -> list[Path]:
        """Return the parts that are there, in order."""
        return sorted(path for path in self.folder.glob("part-*.parquet") if NAME.fullmatch(path.name))

    def tables(self) -> Iterator:
        """Yield the parts as tables, in order."""
        import pyarrow.parquet as pq

        return (pq.read_table(path) for path in self.paths())

    def cut(self, row: int) -> None:
        """Delete the parts that begin at a row of the input or beyond, and what a killed process left half written."""
        named = [(path, NAME.fullmatch(path.name)) for path in self.paths()]
        beyond = [path for path, name in named if name and int(name[1]) >= row]
        self.sums.forget(beyond)
        for path in beyond:
            path.unlink()
        sweep(self.folder)
        self._waiting, self._begun = [], row

    def remove(self) -> None:
        """Delete all parts in one step."""
        if self.folder.is_dir():
            self.sums.forget(self.paths())
            sweep(self.folder.parent)
            self.folder.rename(self.folder.with_name(f".{self.folder.name.lstrip('.')}{SUFFIX}"))
            sweep(self.folder.parent)


def sweep(folder) -> None:
    """Delete what a killed process left half written, or half deleted, in a folder."""
    for path in Path(folder).glob(f".*{SUFFIX}"):
        if not path.is_dir():
            path.unlink()
            continue
        for part in path.iterdir():
            part.unlink()
        path.rmdir()


def write_table(table, path) -> None:
    """Write a pyarrow Table to a Parquet file, in place of what was there, in one step."""
    import pyarrow.parquet as pq

    words = [field.name for field in table.schema if str(field.type) == "string"]
    with replaced(path) as beside:
        pq.write_table(table, beside, use_dictionary=words, row_group_size=ROWS // 4)
