"""Plots from lines of CSV or JSON as they come, the same that reading the whole file at once would give."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from typing import Any

from driftwise.engine.errors import InputError
from driftwise.tracking.plots import Fault

PATIENCE = 100  # lines that may be unreadable at the beginning
OBJECTS = 3000  # whose last line is remembered
PAST = 3000  # frames from which the position of an aircraft is known
FRAMES = "frames"
MESSAGES = FRAMES, "AIS", "NMEA"  # kinds without a head: what a line means, those before it say
DAY = 86400.0


class LivePlots:
    """Turns lines into `Plots`.

    Each stretch of lines is read below the head of the file and the last line of every object, so that what repeats is
    left out, and midnights are counted, as in the whole file. That holds for files in order of time.

    Parameters
    ----------
    title : what the file is called in faults
    site : (latitude, longitude[, height]) of a radar whose ranges and azimuths these are
    """

    def __init__(self, title: str, site=None):
        self.title, self.site = title, site
        self.kind = ""
        self.origin: tuple[float, float] | None = None
        self._waiting: list[bytes] = []
        self._head: list[bytes] = []
        self._last: dict[str, bytes] = {}  # of every object its last line, in the order in which they came
        self._past: list[bytes] = []  # frames that were used
        self._line = 0  # lines that were taken in
        self._faults: list[Fault] = []  # of lines that were left out, not told yet
        self._newest: float | None = None

    def take(self, data: bytes, begins: bool = False):
        """Return the plots of complete lines; None where there is nothing yet. ``begins``: of another file."""
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
        lines = [line + b"\n" for line in data.removesuffix(b"\n").split(b"\n")] if data else []
        if begins:
            self._line = 0
            if self._head and lines[: len(self._head)] == self._head:
                lines, self._line = lines[len(self._head) :], len(self._head)
        torn = [i for i, line in enumerate(lines) if b"\0" in line]  # what a logger leaves that lost its power
        if self.kind or 2 * len(torn) < len(lines):
            for i in torn:
                at = self._line + len(self._waiting) + i + 1
                self._faults.append(Fault(self.title, at, "the line holds bytes that are zero: it is left out"))
                lines[i] = b"\n"
        lines = self._waiting + lines
        self._waiting = []
        if not any(line.strip() for line in lines) and not (self.kind and torn):
            return None
        if not self.kind:
            if not self._is_begun(lines):
                return None
            lines, self._line = lines[len(self._head) :], len(self._head)
        if not lines:
            return None
        first, self._line = self._line + 1, self._line + len(lines)
        try:
            found = self._decoded(lines, first) if self.kind in MESSAGES else self._plots(lines, first)
        except InputError as error:
            if self._newest is not None:
                return self._with_faults(self._nothing(Fault(self.title, first, str(error))))
            if len(lines) > PATIENCE:
                raise
            self._waiting, self._line = lines, first - 1
            return None
        return self._with_faults(found)

    def leave_out(self, why: str) -> None:
        """Count a line that was never handed over."""
        self._line += 1
        self._faults.append(Fault(self.title, self._line + len(self._waiting), why))

    def leave_out_many(self, count: int, why: str) -> None:
        """Count several of them."""
        for _ in range(min(count, PATIENCE)):
            self.leave_out(why)

    def nothing(self, why: str = ""):
        """Return no plots, for this reason, and those of what was left out."""
        return self._with_faults(self._nothing(*[Fault(self.title, self._line, why)] if why else ()))

    def _nothing(self, *faults: Fault):
        """Return no plots, for these reasons."""
        import numpy as np

        from driftwise.tracking.plots import plots

        return plots(np.empty(0), np.empty((0, 2)), origin=self.origin, faults=faults)

    def _with_faults(self, found):
        """Return plots with the faults of lines that were left out before anything was read of them."""
        torn, self._faults = tuple(self._faults), []
        return replace(found, faults=(*found.faults, *torn))

    def _is_begun(self, lines: list[bytes]) -> bool:
        """Say whether the lines are enough to tell what they are; then the head is known."""
        from driftwise.tracking.read import kind_of
        from driftwise.tracking.tables import frames_of

        data = b"".join(lines)
        kind = kind_of(data, self.title)
        if kind == "Mode S" or (kind == "JSON" and _has_frames(data, self.title)):
            self.kind = FRAMES
            return True
        if kind in MESSAGES:
            self.kind = kind
            return True
        if kind not in ("CSV", "JSON"):
            raise InputError(
                f"{self.title} is {kind}; --follow reads CSV with a header, a JSON object, a Mode S frame, an AIS or "
                "NMEA sentence on a line"
            )
        try:
            table = self._table(data, kind)
        except InputError:
            if len(lines) > PATIENCE:
                raise
            self._waiting = lines
            return False
        if frames_of(table):
            raise InputError(f"{self.title}: --follow takes Mode S frames one on a line, not in a table")
        self.kind = kind
        self._head = lines[: int(table.rows[0]) - 1] if kind == "CSV" else []
        return True

    def _table(self, data: bytes, kind: str):
        from driftwise.tracking.records import json_records, record_table
        from driftwise.tracking.tables import csv_table

        if kind == "CSV":
            return csv_table(data, self.title)
        records, at, faults = json_records(data, self.title)
        return record_table(records, at, self.title, faults)

    def _plots(self, lines: list[bytes], first: int):
        """Return the plots of lines, the first of which has this number in the file."""
        from driftwise.tracking.tables import read_table

        above = [*self._head, *self._last.values()]
        known = len(above)
        table = self._table(b"".join([*above, *lines]), self.kind)
        found, used = read_table(table, site=self.site, origin=self.origin)
        old = table.rows <= known
        if old.any():
            before, _ = read_table(_chosen(table, old), site=self.site, origin=self.origin or found.origin)
            found = without(found, before)
            if len(before) and self._newest is not None and used["time"].unit in ("time of day", "s of day", "s"):
                days = round((self._newest - float(before.time.max())) / DAY)
                found = replace(found, time=found.time + DAY * days)
        faults = [replace(f, offset=f.offset - known + first - 1) for f in found.faults if f.offset > known]
        self.origin = self.origin or found.origin
        self._seen(found)
        self._remember(table, ~old, [*above, *lines], used)
        return replace(found, faults=tuple(faults))

    def _decoded(self, lines: list[bytes], first: int):
        """Return the plots of frames or sentences; those before them say where each aircraft was, and the day."""
        above = self._past
        found = self._frames([*above, *lines])
        before = self._frames(above) if above else found[:0]
        self._past = [*above, *lines][-PAST:]
        self.origin = self.origin or found.origin
        self._seen(found)
        new = [f for f in found.faults if f.offset > len(above) and "lacks its last part" not in f.what]  # it may come
        faults = [replace(f, offset=f.offset - len(above) + first - 1) for f in new]
        return replace(without(found, before), faults=tuple(faults))

    def _frames(self, lines: list[bytes]):
        from driftwise.tracking.formats.modes import read_frames, read_lines
        from driftwise.tracking.records import json_records

        data = b"".join(lines)
        if self.kind != FRAMES:
            from driftwise.tracking.formats.ais import read_ais
            from driftwise.tracking.formats.logs import read_nmea

            return (read_ais if self.kind == "AIS" else read_nmea)(data, self.title, origin=self.origin)
        if not data.lstrip().startswith(b"{"):
            return read_lines(data, self.title, origin=self.origin)
        records, at, faults = json_records(data, self.title)
        return read_frames(records, at, self.title, origin=self.origin, faults=faults)

    def _seen(self, found) -> None:
        if len(found):
            self._newest = float(found.time.max()) if self._newest is None else max(self._newest, found.time.max())

    def _remember(self, table, new, lines: list[bytes], used) -> None:
        """Keep the last line of every object."""
        column = used.get("key") or used.get("name")
        keys = table.columns[column.name].to_pylist() if column else [""] * len(table.rows)
        for row in new.nonzero()[0]:
            key, at = str(keys[row]), int(table.rows[row]) - 1
            if at < len(lines):  # a cell over several lines hides where it lies
                self._last.pop(key, None)
                self._last[key] = lines[at]
        for key in list(self._last)[:-OBJECTS]:
            del self._last[key]


def _has_frames(data: bytes, title: str) -> bool:
    """Say whether lines of JSON hold Mode S frames."""
    from driftwise.tracking.formats.modes import is_frames
    from driftwise.tracking.records import json_records

    try:
        return is_frames(json_records(data, title)[0])
    except InputError:
        return False


def _chosen(table, rows) -> Any:
    """Return some rows of a table."""
    import pyarrow as pa

    mask = pa.array(rows)
    columns = {name: column.filter(mask) for name, column in table.columns.items()}
    return replace(table, columns=columns, rows=table.rows[rows], faults=())


def without(found, before):
    """Return plots less those that were there before: of the same time, object and sensor, and nearest to them."""
    import numpy as np

    keep, rows = np.ones(len(found), bool), defaultdict(list)
    for k, mark in enumerate(_marks(found)):
        rows[mark].append(k)
    for mark, position in zip(_marks(before), before.position):
        if rows[mark]:
            off = np.linalg.norm(found.position[rows[mark]] - position, axis=1)
            keep[rows[mark].pop(int(off.argmin()))] = False
    return found[keep]


def _marks(plots):
    return list(zip(plots.time.tolist(), plots.key.tolist(), plots.sensor.tolist()))
