"""Records whose changes are labelled: alarms before a change, and how long after it the first one came."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from . import records
from .records import Record


class Change(NamedTuple):
    """A labelled change: alarms count as false from ``clean`` on; the change begins at sample ``at``."""

    name: str
    record: str
    clean: int
    at: int
    until: int | None = None  # alarms after this sample are about something else


class Found(NamedTuple):
    """What a detector did about a change."""

    before: int  # alarms in the clean stretch
    clean: int  # its length
    delay: int | None  # samples from the change to the first alarm; None: missed

    @property
    def per_thousand(self) -> float:
        """False alarms per 1000 samples."""
        return 1000 * self.before / max(self.clean, 1)

    @property
    def words(self) -> str:
        """Alarms per 1000 samples before the change / delay in samples."""
        return f"{self.per_thousand:.1f} / {'missed' if self.delay is None else self.delay}"


CHANGES = (
    Change("hanging load, lifting to lowering", "hydraulic_hanging_load", 900, 1806),
    Change("motor drive, direction reverses", "dc_motor_hoop", 2000, 4100),
    Change("heat exchanger, k = 800", "heat_exchanger", 500, 800, 1400),
    Change("heat exchanger, k = 2000", "heat_exchanger", 1400, 2000),
    Change("groundwater, the dam", "river_only", 105, 621),
    Change("the Nile, 1899", "nile", 0, 28),
)
READ: dict[str, Callable[[Path], Record]] = {**records.ROWS, "river_only": records.river_only}

STAGE = 2.8  # m, of the river: where the level of the groundwater is read
FIRST_ORDER = {"river_only": (0, STAGE), "dc_motor_hoop": (1, 0.0)}  # whose true gain is known: delay, input at rest

PUMP = 400  # samples after the onset within which an alarm counts
CLEAN_DAYS = ("2017-09-20", "2017-09-23")  # what a monitor of the air handler learns on
FAULTS = {"09-11": 120, "09-12": 10, "09-14": 10, "09-15": 10, "09-22": 10}  # minutes of work by which it is to be told
NO_FAULT = ("09-18", "09-19", "09-21", "09-24")  # two that these inputs cannot show, two clean days
DAY, START = 1440, 360  # minutes of a day; when the air handler starts to work, faults being there since midnight


def look(alarms, clean: int, at: int, until: int | None = None) -> Found:
    """Return what a list of alarms (samples) amounts to.

    Examples
    --------
    >>> look([3, 12, 57, 70], clean=10, at=50)
    Found(before=1, clean=40, delay=7)
    >>> look([3, 12], clean=10, at=50).words
    '25.0 / missed'
    """
    alarms = np.asarray(alarms, int)
    after = alarms[(alarms >= at) & (alarms < (np.inf if until is None else until))]
    before = int(np.sum((alarms >= clean) & (alarms < at)))
    return Found(before, at - clean, int(after[0]) - at if after.size else None)


def cusum(z, k: float = 0.5, h: float = 5.0) -> np.ndarray:
    """Return the alarms of Page's two-sided sum of z, begun afresh after each one."""
    up = down = 0.0
    found = []
    for t, value in enumerate(np.nan_to_num(z)):
        up, down = max(0.0, up + value - k), max(0.0, down - value - k)
        if max(up, down) > h:
            found.append(t)
            up = down = 0.0
    return np.array(found, int)


def running_score(e, forgetting: float = 0.99) -> np.ndarray:
    """Return innovations in units of a running standard deviation, each square counted ninefold at most."""
    known = e[np.isfinite(e)]
    v, z = float(np.median(known[:50] ** 2)) if known.size else 1.0, np.full(len(e), np.nan)
    for t in np.flatnonzero(np.isfinite(e)):
        z[t] = e[t] / np.sqrt(v) if v > 0 else 0.0
        v = forgetting * v + (1 - forgetting) * min(e[t] ** 2, 9 * v if v > 0 else np.inf)
    return z


def pump_onset(where: Path, file: str) -> int:
    """Return the first sample that is labelled anomalous in a file of the pump rig."""
    return int(np.argmax(records.anomaly(where, file)))
