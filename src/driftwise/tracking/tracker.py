"""Plots to tracks: by address where there is one, by the best fit in a gate where there is none."""

from __future__ import annotations

import heapq
import math
import re
from typing import NamedTuple

import numpy as np

from ..errors import InputError
from ..estimators.track import bank
from ..estimators.track.estimator import TrackEstimator
from .frames import east_north, geographic
from .inbox import LEAP, Inbox
from .keep import restore, save
from .live import COASTING, CONFIRMED, ENDED, TENTATIVE, Event, Live, Plot
from .plots import Plots
from .read import read_plots
from .scans import Scans
from .tracks import Tracks, track_of

FASTEST = {250.0: 400.0, 60.0: 150.0, 40.0: 150.0, 20.0: 60.0, 8.0: 40.0}  # m/s: typical speed of a class to its limit
UNKNOWN = 30.0  # s: the scan period assumed before one is known
REPEAT = 0.02  # scan periods: a second plot of a track within them tells the first one again
SUSPECTS = 8  # plots set aside that are remembered for a key
BASE = bank.column(2, bank.OUTPUTS.index("base"), 0), bank.column(2, bank.OUTPUTS.index("base"), 1)  # of a trace's row
VELOCITY = bank.at_state(2) + 1, bank.at_state(2) + 4
SPREADING = bank.at_told(2) + bank.SPREADING
FREE = math.inf, 0.0, 0.0, 0.0, 0.0, 0.0  # a place where no track is
CODE = re.compile(r"A[0-7]{4}$")  # a Mode A code
CLIMB, LEVELS = 50.0, 300.0  # m/s, m: altitudes that differ by more are two objects


class Rules(NamedTuple):
    """The options of a `Tracker`."""

    confirm: tuple[int, int]
    coast: float
    gap: float
    gate: float
    single: bool
    delay: float


class Tracker:
    """Tracks from plots, one estimator for each object; the rules stand in ``docs/tracker.md``.

    It is made for objects that say who they are, and for few that do not. Clutter, merged plots and crossing targets
    without an address are what it is bad at: a plot goes to the track that it fits best, one after the other.

    Parameters
    ----------
    estimator : TrackEstimator, float or str
        The estimator of each track, or the class of its speed: "aircraft", "boat", .., or a typical speed in m/s.
    confirm : (N, M)
        A track is confirmed by N plots within M scan periods.
    coast : float
        Scan periods without a plot after which a confirmed track is coasting.
    gap : float
        Scan periods without a plot after which it has ended; what comes later is a new track that follows it.
    gate : float
        Standard deviations within which a plot without a key belongs to a track.
    single : bool
        All plots without a key belong to one object.
    delay : float
        s. Plots are held back so long and put in order of time; what comes later still is counted and skipped.
    fastest : float, optional
        m/s; a plot that implies more is not of its track. From the class when omitted.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> from driftwise.tracking.plots import plots
    >>> time = 4.0 * np.arange(20)
    >>> tracker = dw.Tracker()
    >>> events = tracker.feed(plots(time, np.stack([200 * time, 50 * time], axis=1), key="4BAA5F"))
    >>> [(e.time, e.kind) for e in events]
    [(0.0, 'initiated'), (8.0, 'confirmed')]
    >>> tracker.tracks
    Tracks(1 track, 20 plots)
    """

    def __init__(
        self,
        estimator: TrackEstimator | float | str = "aircraft",
        *,
        confirm=(3, 5),
        coast: float = 3.0,
        gap: float = 8.0,
        gate: float = 4.0,
        single: bool = False,
        delay: float = 0.0,
        fastest: float | None = None,
    ):
        if isinstance(estimator, str | float | int):
            estimator = TrackEstimator(speed=estimator)
        if not isinstance(estimator, TrackEstimator) or estimator.coordinates != 2:
            raise InputError(f"estimator must be a TrackEstimator of two coordinates or a speed, got {estimator!r}")
        N, M = confirm
        if not 1 <= N <= M:
            raise InputError(f"confirm must be (N, M), N plots within M scans with 1 <= N <= M, got {confirm!r}")
        if not 0 < coast < gap:
            raise InputError(f"coast must be positive and below gap, in scan periods; got coast={coast}, gap={gap}")
        for name, value in dict(gate=gate, fastest=1.0 if fastest is None else fastest).items():
            if not 0 < value < math.inf:
                raise InputError(f"{name} must be a positive number, got {value!r}")
        if not 0 <= delay < LEAP:
            raise InputError(f"delay must be within 0 and {LEAP:.0f} s, got {delay!r}")
        self.estimator = estimator
        speed = float(estimator.speed)
        self.fastest = float(fastest or FASTEST.get(speed, 3 * speed))
        self.rules = Rules((int(N), int(M)), float(coast), float(gap), float(gate), bool(single), float(delay))
        self.origin: tuple[float, float] | None = None
        self.faults: list = []
        self.counts = dict.fromkeys(("plots", "late", "repeated", "outliers", "discarded"), 0)
        self.events: list[Event] = []
        self.scans = Scans()
        self.time = -math.inf  # of the last plot that was used
        self.inbox = Inbox(float(delay))
        self._begun = 0
        self._live: dict[int, Live] = {}
        self._ended: list[Live] = []
        self._of_key: dict[str, list[Live]] = {}
        self._suspects: dict[str, list[Plot]] = {}
        self._past: dict[str, tuple[int | None, dict]] = {}  # of a key: its last track, and that track's clock
        self._due: list[tuple[float, int]] = []
        self._numbers: dict[str, int] = {"": 0}
        self._where = np.tile(FREE, (8, 1))  # of the live ones: time, East, North, velocity (2), allowance
        self._places: list[int] = list(range(8))[::-1]
        self._who: list[Live | None] = [None] * 8

    def __repr__(self):
        return f"Tracker({len(self._live)} live, {len(self._ended)} ended, {self.counts['plots']} plots)"

    # --- what comes in -------------------------------------------------------------------------------------

    def feed(self, plots: Plots) -> list[Event]:
        """Take plots in order of time, any number at once, and return what happened."""
        if not isinstance(plots, Plots):
            raise InputError(f"feed takes Plots, got {type(plots).__name__}; driftwise.track reads files")
        before = len(self.events)
        self.faults += plots.faults
        for plot in zip(
            plots.time.tolist(),
            *self._here(plots).T.tolist(),
            map(tuple, _stated(plots.covariance).tolist()),
            plots.altitude.tolist(),
            plots.key,
            plots.name,
            plots.sensor,
        ):
            for ready in self.inbox.put(Plot(*plot)):
                self._use(ready)
        return self.events[before:]

    def advance(self, time: float) -> list[Event]:
        """Say what time it is (s) where no plots come, so that tracks coast and end."""
        before = len(self.events)
        for ready in self.inbox.advance(float(time)):
            self._use(ready)
        self.time = max(self.time, self.inbox.newest - self.inbox.delay)
        self._look(self.time)
        return self.events[before:]

    def finish(self) -> list[Event]:
        """Use the plots that are held back, and return what happened; more may be fed later."""
        before = len(self.events)
        for ready in self.inbox.finish():
            self._use(ready)
        return self.events[before:]

    def _here(self, plots: Plots) -> np.ndarray:
        """Return positions relative to the origin of the first plots."""
        if not self.inbox.arrivals:
            self.origin = plots.origin
        if plots.origin == self.origin or not len(plots):
            return plots.position
        if plots.origin is None or self.origin is None:
            raise InputError("plots with a place on earth and plots without one cannot be mixed: give both an origin")
        latitude, longitude = geographic(plots.position, plots.origin).T
        return east_north(latitude, longitude, self.origin)

    # --- whose plot it is ----------------------------------------------------------------------------------

    def _use(self, plot: Plot) -> None:
        self.counts["plots"] += 1
        if plot.time < self.time:
            if plot.time > self.time - LEAP:
                self.counts["late"] += 1
                return
            for track in list(self._live.values()):
                self._end(track, self.time, "the clock went back")
        self.time = plot.time
        self._look(plot.time)
        if plot.key or self.rules.single:
            self._use_key(plot)
        elif found := self._best(plot):
            self._extend(found, plot)
        else:
            self._begin(plot)

    def _use_key(self, plot: Plot) -> None:
        """Give a plot to the track of its key that it can belong to; set it aside, or begin a new one."""
        alive = self._of_key.get(plot.key)
        if not alive:
            track = self._best(plot, addressed=True) if CODE.match(plot.key) else None
            if track is None:
                self._begin(plot, *self._past.pop(plot.key, (None, {})))
                return
            track.code = plot.key
            self._of_key.setdefault(plot.key, []).append(track)
            self._extend(track, plot)
            return
        if fitting := [t for t in alive if self._reaches(t.last, plot, t.allowance)]:
            self._extend(min(fitting, key=lambda t: _miss(t, plot)) if fitting[1:] else fitting[0], plot)
            return
        allowance = min(t.allowance for t in alive)
        suspects = self._suspects.setdefault(plot.key, [])
        suspects[:] = [s for s in suspects if plot.time - s.time <= self.rules.gap * (alive[0].period or UNKNOWN)]
        agreeing = [s for s in suspects if s.time < plot.time and self._reaches(s, plot, allowance)]
        if not agreeing:
            suspects.append(plot)
            del suspects[:-SUSPECTS]
            self.counts["outliers"] += 1
            track = min(alive, key=lambda t: _miss(t, plot))
            self._tell(plot.time, track, "outlier", f"a plot {_miss(track, plot) / 1e3:.1f} km off is set aside")
            return
        first = agreeing[-1]
        suspects.remove(first)
        self.counts["outliers"] -= 1
        old = alive[0]
        if len(alive) == 1 and old.last.time <= first.time and old.key == plot.key:
            self._end(old, first.time, "two plots agree that it is elsewhere")
            new = self._begin(first, *self._past.pop(old.key))
            self._tell(first.time, new, "split", f"track {old.id} goes on elsewhere, faster than it can be")
        else:
            new = self._begin(first)
            self._tell(first.time, new, "duplicate", f"{plot.key or 'it'} is in two places at once, see track {old.id}")
        self._extend(new, plot)

    def _reaches(self, a: Plot, b: Plot, allowance: float) -> bool:
        """Say whether one object can give both plots."""
        return math.hypot(b.east - a.east, b.north - a.north) <= self.fastest * (b.time - a.time) + allowance

    def _best(self, plot: Plot, addressed: bool = False) -> Live | None:
        """Return the live track in whose gate a plot is most likely, if there is one."""
        where = self._where
        past = plot.time - where[:, 0]
        off = np.hypot(plot.east - where[:, 1], plot.north - where[:, 2])
        found, best = None, -math.inf
        for place in np.flatnonzero((past > 0) & (off <= self.fastest * past + where[:, 5])).tolist():
            track = self._who[place]
            if track is None or not self._may_take(track, plot, addressed):
                continue
            mean, S = self.estimator.predict(track.state.view(self.estimator.dtype)[0], plot.time)
            (a, b), (_, d) = S.tolist()
            e, n = plot.east - float(mean[0]), plot.north - float(mean[1])
            det = a * d - b * b
            distance = (d * e * e - 2 * b * e * n + a * n * n) / det
            likelihood = -distance - math.log(det)
            if distance <= self.rules.gate**2 and likelihood > best:
                found, best = track, likelihood
        return found

    def _may_take(self, track: Live, plot: Plot, addressed: bool) -> bool:
        """Say whether a plot that does not name the track may be of it."""
        if addressed and (not track.key or track.code or CODE.match(track.key)):
            return False
        seen = track.clock.get(plot.sensor)
        past = plot.time - track.last.time
        if seen and plot.time - seen[0] < 0.5 * track.period:
            return False  # this sensor has already seen it in this scan
        return not abs(plot.altitude - track.last.altitude) > LEVELS + CLIMB * past  # unknown altitudes agree

    # --- the life of a track -------------------------------------------------------------------------------

    def _begin(self, plot: Plot, follows: int | None = None, clock: dict | None = None) -> Live:
        self._begun += 1
        track = Live(self._begun, plot.key, self.estimator.start().reshape(-1).view(float), follows, clock or {})
        track.allowance = self.fastest
        self._live[track.id] = track
        self._of_key.setdefault(track.key, []).append(track)
        if not self._places:
            n = len(self._where)
            self._where = np.concatenate([self._where, np.tile(FREE, (n, 1))])
            self._places = list(range(n, 2 * n))[::-1]
            self._who += [None] * n
        track.place = self._places.pop()
        self._who[track.place] = track
        after = f", follows track {follows}" if follows else ""
        self._tell(plot.time, track, "initiated", f"{plot.key or 'no key'}{after}")
        self._extend(track, plot)
        return track

    def _extend(self, track: Live, plot: Plot) -> None:
        """Give a plot to a track."""
        if track.last is not None and self._is_told(track, plot):
            self.counts["repeated"] += 1
            return
        time, position = np.array((plot.time,)), np.array(((plot.east, plot.north),))
        out = self.estimator.run(track.state, time, position, np.array(((plot.covariance[0], plot.covariance[3]),)))[0]
        number = self._numbers
        words = [number.setdefault(w, len(number)) for w in (plot.key, plot.name, plot.sensor)]
        track.append((plot.time, plot.east, plot.north, *plot.covariance, plot.altitude, *words), out)
        self.scans.tick(track.clock, plot.sensor, plot.time)
        track.period = self.scans.period(track.clock)
        track.last, track.name = plot, plot.name or track.name
        track.motion = float(out[VELOCITY[0]]), float(out[VELOCITY[1]])
        if track.count > 1:
            sd = math.sqrt(max(out[BASE[0]], out[BASE[1]]) * out[SPREADING])
            track.allowance = min(max(5 * sd, 0.25 * self.fastest), self.fastest * max(track.period, 1.0))
        self._where[track.place] = plot.time, plot.east, plot.north, *track.motion, track.allowance
        if track.status == COASTING:
            track.status = CONFIRMED
            self._tell(plot.time, track, "resumed", "it is seen again")
        elif track.status == TENTATIVE:
            self._confirm(track)
        self._plan(track)

    def _is_told(self, track: Live, plot: Plot) -> bool:
        """Say whether a plot repeats the last one: at the same time, or at the same place though the track moves."""
        last = track.last
        past = plot.time - last.time
        if past <= REPEAT * track.period:
            return True
        stays = plot.east == last.east and plot.north == last.north
        return stays and math.hypot(*track.motion) * past > track.allowance

    def _confirm(self, track: Live) -> None:
        N, M = self.rules.confirm
        if track.count < N:
            return
        if track.last.time - track.rows[-N, 0] <= (M - 0.5) * (track.period or UNKNOWN):
            track.status = CONFIRMED
            self._tell(track.last.time, track, "confirmed", f"{N} plots within {M} scans")

    def _plan(self, track: Live) -> None:
        """Say when to look at a track again."""
        due = self._deadline(track)
        if due < track.due or track.due == math.inf:
            track.due = due
            heapq.heappush(self._due, (due, track.id))

    def _deadline(self, track: Live) -> float:
        N, M = self.rules.confirm
        scans = {TENTATIVE: M - N + 1.5, CONFIRMED: self.rules.coast + 0.5, COASTING: self.rules.gap}
        return track.last.time + scans[track.status] * (track.period or UNKNOWN)

    def _look(self, time: float) -> None:
        """Let tracks coast and end that were not seen for long."""
        while self._due and self._due[0][0] < time:
            due, id = heapq.heappop(self._due)
            track = self._live.get(id)
            if track is None or due != track.due:
                continue
            track.due = math.inf
            if self._deadline(track) >= time:
                self._plan(track)
            elif track.status == CONFIRMED:
                track.status = COASTING
                self._tell(due, track, "coasting", f"no plot for {self.rules.coast:g} scans")
                self._plan(track)
            else:
                self._end(track, due, "no plot for too long")

    def _end(self, track: Live, time: float, why: str) -> None:
        del self._live[track.id]
        for key in {track.key, track.code} if track.code else {track.key}:
            self._of_key[key].remove(track)
            if not self._of_key[key]:
                del self._of_key[key]
                self._suspects.pop(key, None)
        self._where[track.place] = FREE
        self._who[track.place] = None
        self._places.append(track.place)
        kept = track.status != TENTATIVE
        if track.key or self.rules.single:
            self._past[track.key] = (track.id if kept else track.follows), track.clock
        self._tell(time, track, "ended" if kept else "discarded", why)
        track.status = ENDED
        if kept:
            self._ended.append(track)
        else:
            self.counts["discarded"] += track.count

    def _tell(self, time: float, track: Live, kind: str, words: str) -> None:
        event = Event(time, track.id, kind, words)
        track.events.append(event)
        self.events.append(event)

    # --- what comes out ------------------------------------------------------------------------------------

    def _tracks(self, tracks: list[Live]) -> Tracks:
        words = list(self._numbers)
        made = tuple(track_of(t, self.estimator, words, self.origin) for t in sorted(tracks, key=lambda t: t.id))
        return Tracks(
            made, self.origin, tuple(self.faults), self.counts | {"clock": self.inbox.dropped}, tuple(self.events)
        )

    @property
    def tracks(self) -> Tracks:
        """The tracks that are or were confirmed."""
        return self._tracks(self._ended + [t for t in self._live.values() if t.status != TENTATIVE])

    @property
    def tentative(self) -> Tracks:
        """The tracks that wait to be confirmed."""
        return self._tracks([t for t in self._live.values() if t.status == TENTATIVE])

    def release(self) -> Tracks:
        """Return the tracks that have ended and forget them, and the events and faults so far."""
        ended = self._tracks(self._ended)
        self._ended, self.events, self.faults = [], [], []
        return ended

    def save(self, path) -> None:
        """Write the tracker, all its tracks included, to a file that `load` reads; every bit survives."""
        save(self, path)

    @classmethod
    def load(cls, path) -> Tracker:
        """Return a tracker as saved; it goes on as if it had never stopped."""
        return restore(cls, path)


def _stated(covariance: np.ndarray) -> np.ndarray:
    """Return covariances as rows of four numbers, NaN where the variances cannot be what they are."""
    variances = covariance[:, [0, 1], [0, 1]]
    good = (variances > 0).all(axis=1) & np.isfinite(covariance).all(axis=(1, 2))
    return np.where(good[:, None], covariance.reshape(-1, 4), np.nan)


def _miss(track: Live, plot: Plot) -> float:
    """Return how far a plot lies from where a track would be by now, m."""
    past, last = plot.time - track.last.time, track.last
    return math.hypot(plot.east - last.east - past * track.motion[0], plot.north - last.north - past * track.motion[1])


def track(plots, *, site=None, sites=None, progress=None, **options) -> Tracks:
    """Return the tracks in plots, or in files of plots; `Tracker` says how and what the options are.

    Parameters
    ----------
    plots : Plots, or what ``read_plots`` reads: a path, several, a data frame or columns
    site, sites, progress : optional
        Of ``read_plots``.
    **options
        Of `Tracker`.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> from driftwise.tracking.plots import plots
    >>> time = 12.0 * np.arange(40)
    >>> dw.track(plots(time, np.stack([120 * time, 90 * time], axis=1)), single=True)
    Tracks(1 track, 40 plots)
    """
    tracker = Tracker(**options)
    tracker.feed(plots if isinstance(plots, Plots) else read_plots(plots, site=site, sites=sites, progress=progress))
    tracker.finish()
    return tracker.tracks
