"""What a run of a fleet writes: estimates and events in parts while it goes on, a row for each series at the end."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

from driftwise.engine.atomic import replaced
from driftwise.engine.errors import InputError
from driftwise.fleet.events import nothing
from driftwise.fleet.fleet_parts import Parts
from driftwise.fleet.fleet_sums import Sums

FLEET, FINAL, EVENTS, ESTIMATES, REPORTED = "fleet.parquet", "final.parquet", "events.parquet", "estimates", ".events"
WORDS = "kind", "text", "parameter"  # of an event
INSTANTS = "time", "first_time", "last_time", "last_jump"


class FleetOut:
    """The folder of a run: ``fleet.parquet``, ``estimates/part-*.parquet``, ``events.parquet``, ``final.parquet``.

    ``SHA256SUMS`` has the checksums of all but the first, which has its own.

    Where times are dates (``is_dated``: seconds since 1970), they are written as time stamps, in microseconds.
    """

    def __init__(self, folder, fleet, is_dated: bool = False):
        self.folder, self.fleet, self.is_dated = Path(folder), fleet, is_dated
        self.sums = Sums(self.folder)
        self.estimates, self.reported = (Parts(self.folder / name, self.sums) for name in (ESTIMATES, REPORTED))
        self._keys: Any = None

    @property
    def saved(self) -> Path:
        """The file of the fleet, with all that is needed to go on."""
        return self.folder / FLEET

    # --- while it runs -------------------------------------------------------------------------------------

    def take(self, found) -> None:
        """Take estimates (`workflow.fleet.run.Estimates`)."""
        est, p = self.fleet.estimators[0], found.y.shape[1]
        columns = {"time": found.time, "sample": found.sample, "row": found.source}
        for name in ("y", "prediction", "innovation", "std", "status"):
            values = getattr(found, name)
            columns |= {f"{name}.{j + 1}" if p > 1 else name: values[:, j] for j in range(p)}
        columns |= dict(zip(est.names, found.parameters.T))
        columns |= {f"{name}_std": values for name, values in zip(est.names, found.parameters_std.T)}
        self.estimates.add(self._table(found.at, columns))

    def happened(self, at, seen) -> None:
        """Take events (`workflow.fleet.events.Seen`) of these rows of the fleet."""
        self.reported.add(self._reported(at, seen))

    def _reported(self, at, seen):
        import pyarrow as pa

        columns = seen._asdict() | {name: pa.array(getattr(seen, name), pa.string()) for name in WORDS}
        return self._table(at, columns)

    def close(self, row: int, long: bool = False) -> None:
        """Write all that came before a row of the input, or what is ``long`` enough of it."""
        for parts in (self.estimates, self.reported):
            parts.reached(row) if long else parts.close(row)

    def cut(self, row: int) -> None:
        """Forget what came from a row of the input on."""
        for parts in (self.estimates, self.reported):
            parts.cut(row)

    def _table(self, at, columns):
        """Return columns as a table, with the keys of these rows of the fleet in front."""
        import pyarrow as pa

        if self._keys is None or len(self._keys) < len(self.fleet):
            self._keys = key_column(self.fleet.keys)
        if self.is_dated:
            columns = columns | {name: _stamps(columns[name]) for name in INSTANTS if name in columns}
        return pa.table({"key": self._keys.take(pa.array(at)), **columns})

    # --- at the end, and before the beginning ----------------------------------------------------------------

    def finish(self, final) -> None:
        """Write the last tables; ``final`` are columns of some series each, with their rows in the fleet."""
        _gather(self.folder / FINAL, (self._table(at, columns) for at, columns in final))
        self.sums.add(self.folder / FINAL)
        if self.reported.paths() or not (self.folder / EVENTS).exists():
            tables = self.reported.tables() if self.reported.paths() else [self._reported(*nothing())]
            _gather(self.folder / EVENTS, tables)
            self.sums.add(self.folder / EVENTS)
        self.reported.remove()

    def verify(self) -> None:
        """Refuse to go on where something of what was written was altered; the last table can be made again."""
        if not (self.folder / FINAL).exists():
            self.sums.forget([self.folder / FINAL])
        self.sums.verify()

    @property
    def is_finished(self) -> bool:
        """Whether the last tables are there."""
        return all((self.folder / name).exists() for name in (FINAL, EVENTS)) and not self.reported.paths()

    def there(self) -> list[Path]:
        """Return what a run would write, as far as it is there."""
        files = [self.folder / name for name in (FLEET, FINAL, EVENTS)]
        return [path for path in files if path.exists()] + self.estimates.paths() + self.reported.paths()

    def clear(self) -> None:
        """Delete what a run has written here, and nothing else; the file of the fleet last."""
        self.cut(0)
        for parts in (self.estimates, self.reported):
            with suppress(OSError):  # not there, or something of somebody else's in it
                parts.folder.rmdir()
        self.sums.forget([self.folder / FINAL, self.folder / EVENTS])
        for name in (FINAL, EVENTS, FLEET):
            (self.folder / name).unlink(missing_ok=True)


def _stamps(seconds):
    """Return seconds since 1970 as Arrow's time stamps, null where there is none."""
    import numpy as np
    import pyarrow as pa

    mask = ~np.isfinite(seconds)
    ticks = np.rint(np.where(mask, 0.0, seconds) * 1e6).astype(np.int64)
    return pa.array(ticks, mask=mask).cast(pa.timestamp("us", "UTC"))


def _gather(path, tables: Iterable) -> None:
    """Write tables, at least one, into a file."""
    import pyarrow.parquet as pq

    tables = iter(tables)
    first = next(tables)
    with replaced(path) as beside, pq.ParquetWriter(beside, first.schema) as writer:
        for table in itertools.chain([first], tables):
            writer.write_table(table)


def key_column(keys):
    """Return keys as Arrow has them: whole numbers, or text."""
    import pyarrow as pa

    numbers = sum(isinstance(key, int) for key in keys)
    if 0 < numbers < len(keys):
        one = next(key for key in keys if isinstance(key, int) != isinstance(keys[0], int))
        raise InputError(
            f"keys are text or whole numbers, not both: there are {keys[0]!r} and {one!r}. Write all as text"
        )
    return pa.array(keys, pa.int64() if numbers else pa.string())
