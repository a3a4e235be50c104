"""What a tracker found: tracks with their plots, estimates and events."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ..estimators.track.trace import TrackTrace
from ..models.markup import columns
from ..results import verbs
from .live import PLOT, Event, Live
from .plots import Fault, Plots
from .vertical import vertical

LEARNING = 3  # plots before predictions are scored: the first has none, the next two learn speed and noise
OFF_TURN, IN_TURN = (
    0.2,
    0.8,
)  # of a turn by which a plot may be off whole ones; share of the plots of a sensor that turns


@dataclass(frozen=True, eq=False)
class Track:
    """One object: its plots, what the estimator said at each of them, and what happened.

    Attributes
    ----------
    id : int
    key, name : str
        Who it is: address or identifier, and callsign; "" is unknown.
    status : str
        "tentative", "confirmed", "coasting" or "ended".
    plots : Plots
        Those that the estimator used.
    events : tuple of Event
    origin : (latitude, longitude) or None
        Degrees, of East = North = 0.
    follows : int or None
        The track of the same key that ended before this one began.
    period : float
        Its scan period, s; 0 is unknown.
    state
        Of the estimator after the last plot.
    is_smoothed : bool
        Whether the motion at each plot is told given all plots; else given those so far.
    """

    id: int
    key: str
    name: str
    status: str
    plots: Plots
    events: tuple[Event, ...] = field(repr=False)
    origin: tuple[float, float] | None
    follows: int | None
    period: float
    state: Any = field(repr=False)
    estimator: Any = field(repr=False)
    table: np.ndarray = field(repr=False)
    is_smoothed: bool = False

    def __len__(self):
        return len(self.plots)

    def __repr__(self):
        who = " ".join(w for w in (self.key, self.name) if w)
        return f"Track({self.id}{', ' + who if who else ''}, {self.status}, {len(self)} plots)"

    @property
    def sensors(self) -> tuple[str, ...]:
        """The sensors that saw it, in order of the first plot."""
        return tuple(dict.fromkeys(self.plots.sensor))

    @property
    def sensor(self) -> str:
        """The sensors that saw it, in one line."""
        return " ".join(self.sensors)

    @property
    def altitude(self) -> np.ndarray:
        """m, NaN where a plot had none, (T,)."""
        return self.plots.altitude

    @cached_property
    def trace(self) -> TrackTrace:
        """What the estimator said: a `TrackTrace` with a row for each plot."""
        return self.estimator.trace_of(self.plots.time, self.plots.position, self.table, self.state)

    @cached_property
    def vertical(self) -> TrackTrace | None:
        """What an estimator of one coordinate says of the altitude, a row for each plot; None where it is unknown.

        ``position`` is the altitude, ``velocity`` the vertical rate (m/s, upwards); each with its deviation. It is of
        the kind that was measured: pressure altitudes of Mode S, geometric ones of a satellite receiver.
        """
        return vertical(self)

    def smoothed(self, lag: int | None = None) -> Track:
        """Return the track with its motion told given all plots, or the next ``lag``: `TrackEstimator.smooth`."""
        plots = self.plots
        found = self.estimator.smooth(plots.time, plots.position, plots.covariance, lag=lag)
        return replace(self, table=found.table, is_smoothed=True)

    def predict(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Return mean (2,) and covariance (2, 2) of a plot at a later time, East and North; so a track coasts."""
        return self.estimator.predict(self.state, time)

    @property
    def missed(self) -> int:
        """Scans without a plot between the first and the last one; 0 where it is not seen in scans."""
        if not self.is_scanned:
            return 0
        return int(np.maximum(np.round(np.diff(self.plots.time) / self.period) - 1, 0).sum())

    @property
    def is_scanned(self) -> bool:
        """Whether plots come in turns of about one period, as of an antenna; not those of who reports as it likes."""
        if not self.period or len(self) < 3:
            return bool(self.period)
        turns = np.diff(self.plots.time) / self.period
        return bool(np.mean(abs(turns - np.maximum(np.round(turns), 1)) < OFF_TURN) > IN_TURN)

    def summary(self) -> dict[str, Any]:
        """Return the row of this track in `Tracks.table`."""
        trace, late = self.trace, slice(LEARNING, None)
        rate = np.abs(trace.turn_rate)
        return {
            "id": self.id,
            "key": self.key,
            "name": self.name,
            "sensors": self.sensor,
            "status": self.status,
            "start": float(self.plots.time[0]),
            "end": float(self.plots.time[-1]),
            "plots": len(self),
            "missed": self.missed,
            "speed": _told(np.nanmedian, trace.speed[late]),
            "turn_rate": float(np.max(rate, where=rate > 2 * trace.turn_rate_sd, initial=0.0)),
            "manoeuvres": int(np.sum(trace.onset)),
            "nis": _told(np.nanmean, trace.nis[late]),
            "coverage": trace.coverage(first=LEARNING),
            "follows": self.follows,
        }


def _told(of, values) -> float:
    return float(of(values)) if np.isfinite(values).any() else float("nan")


class Tracks(Sequence):
    """Tracks, in order of their beginning; `table` has a row for each, `write` makes files.

    ``origin`` is where East and North count from, ``faults`` what could not be read, ``counts`` says how many plots
    came, were late, repeated others, were set aside as outliers, lay in tracks never confirmed, or had a wild clock.

    ``events`` tell what happened to the whole.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> t = 4.0 * np.arange(30)
    >>> tracks = dw.track({"time": t, "east": 150 * t, "north": 80 * t})
    >>> len(tracks), tracks[0].trace.speed[-1].round().item()
    (1, 170.0)
    """

    def __init__(self, tracks, origin=None, faults: tuple[Fault, ...] = (), counts=None, events=()):
        self._tracks = tuple(tracks)
        self.origin, self.faults, self.counts, self.events = origin, faults, dict(counts or {}), tuple(events)

    def __len__(self):
        return len(self._tracks)

    def __getitem__(self, index):
        if isinstance(index, slice):
            return Tracks(self._tracks[index], self.origin, self.faults, self.counts, self.events)
        return self._tracks[index]

    def __repr__(self):
        n = len(self)
        return f"Tracks({n} track{'' if n == 1 else 's'}, {sum(map(len, self._tracks))} plots)"

    def _repr_html_(self):
        return columns(self.table())

    def of(self, key: str) -> Tracks:
        """Return the tracks of a key."""
        return Tracks([t for t in self if t.key == key], self.origin, self.faults, self.counts, self.events)

    def smoothed(self, lag: int | None = None) -> Tracks:
        """Return the tracks with their motion told given all plots, or the next ``lag`` of each."""
        return Tracks([t.smoothed(lag) for t in self], self.origin, self.faults, self.counts, self.events)

    def table(self) -> dict[str, list]:
        """Return columns with an entry for each track.

        id, key, name, sensors, status, start, end (s), plots, missed (scans in which nobody saw it), speed (median,
        m/s), turn_rate (the largest that is more than twice its standard deviation, rad/s), manoeuvres (onsets), nis
        (mean over plots and coordinates; 1 is right), coverage (of the 95 % band), follows (the track that it goes on
        with).
        """
        rows = [t.summary() for t in self]
        return {name: [row[name] for row in rows] for name in (rows[0] if rows else ())}

    def write(self, folder, formats=("csv",)) -> list[Path]:
        """Write ``tracks.csv``, .parquet, .geojson, .kml, .gpx or .cat062 into a folder, and return the paths."""
        return verbs.call("write", self, folder, formats)

    def report(self, path, title: str = "Tracks", **options) -> Path:
        """Write a page to look at: plan view, tracks over time, a table; options of `report.tracks_page.write`."""
        return verbs.call("report", self, path, title, **options)


def track_of(live: Live, estimator, words: list[str], origin) -> Track:
    """Return what a growing track is now."""
    rows, names = live.rows, np.array(words, object)
    key, name, sensor = (names[rows[:, c].astype(int)] for c in (PLOT - 3, PLOT - 2, PLOT - 1))
    plots = Plots(rows[:, 0], rows[:, 1:3], rows[:, 3:7].reshape(-1, 2, 2), rows[:, 7], key, name, sensor, origin)
    state = live.state.copy().view(estimator.dtype)[0]
    return Track(
        live.id, live.key, live.name, live.status, plots, tuple(live.events), origin, live.follows, live.period, state,
        estimator, rows[:, PLOT:],
    )  # fmt: skip
