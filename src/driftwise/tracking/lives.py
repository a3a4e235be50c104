"""The tracks that live: how they begin, grow, are confirmed, coast and end."""

from __future__ import annotations

import heapq
import math
import re
from typing import NamedTuple

import numpy as np

from ..engine.status import OUTLIER
from ..estimators.track.bank import TRACK_SAMPLE
from ..estimators.track.estimator import TrackEstimator
from .existence import Existence
from .inbox import Inbox
from .live import COASTING, CONFIRMED, ENDED, TENTATIVE, Event, Live, Plot
from .places import Places
from .reach import error, reaches
from .scans import Scans
from .stillness import moving

UNKNOWN = 30.0  # s: the scan period assumed before one is known, where plots are not rarer
REPEAT = 0.02, 0.05  # scan periods, s: within both, a second plot of a track tells the first one again
TWICE = 0.08, 0.5  # scan periods, and shortest of the last scans: no sensor sees an object twice in less
NAMED = 4.0  # times as many scans without a plot may a track have that its plots name, or while nobody was seen
ALLOWED = 5.0, 0.25, 3.0  # deviations of a forecast that are allowed; s of what is fast, at least; and scans, at most
REAL = 4.0  # log odds from which a track without a key may be confirmed ..
STILL = 0.0  # .. and those that it is no thing that stands still
WAITS = 2.0, 6  # what moves less surely waits for so many plots, where it is not known how much the sensor errs
CODE = re.compile(r"A[0-7]{4}$")  # a Mode A code
CLIMB, LEVELS = 50.0, 300.0  # m/s, m: altitudes that differ by more are two objects
AT = TRACK_SAMPLE.slices(2)  # of a trace's row
EAST_SPEED, NORTH_SPEED, SPREADING = AT["state"].start + 1, AT["state"].start + 4, AT["spreading"].start
STATUS, BASE = AT["status"].start, AT["base"].start


class Rules(NamedTuple):
    """The options of a `Tracker`."""

    confirm: tuple[int, int]
    coast: float
    gap: float
    gate: float
    single: bool
    delay: float
    fastest: float


class Lives:
    """The tracks of a `Tracker`. Time does not go back."""

    def __init__(self, estimator: TrackEstimator, rules: Rules, inbox: Inbox):
        self.estimator, self.rules, self.inbox = estimator, rules, inbox
        self.time = self.before = -math.inf  # of the last plot, and of the one before it
        self.begun = 0
        self.counts = dict.fromkeys(("plots", "late", "repeated", "outliers", "discarded"), 0)
        self.events: list[Event] = []
        self.scans = Scans()
        self.places = Places()
        self.live: dict[int, Live] = {}
        self.ended: list[Live] = []
        self.of_key: dict[str, list[Live]] = {}
        self.suspects: dict[str, list[Plot]] = {}  # of a key: plots set aside
        self.past: dict[str, tuple[int | None, dict]] = {}  # of a key: its last track, and that track's clock
        self.due: list[tuple[float, int]] = []  # a heap: when to look at which track
        self.numbers: dict[str, int] = {"": 0}  # of keys, names and sensors in the rows
        self.existence = Existence()

    def begin(self, plot: Plot, follows: int | None = None, clock: dict | None = None) -> Live:
        """Return a new track of a plot."""
        self.begun += 1
        track = Live(self.begun, plot.key, self.estimator.start().reshape(-1).view(float), follows, clock or {})
        track.allowance = self.rules.fastest
        self.live[track.id] = track
        if self.has_key(track):
            self.of_key.setdefault(track.key, []).append(track)
        self.places.add(track)
        after = f", follows track {follows}" if follows else ""
        self.tell(plot.time, track, "initiated", f"{plot.key or 'no key'}{after}")
        self.extend(track, plot)
        return track

    def extend(self, track: Live, plot: Plot) -> None:
        """Give a plot to a track."""
        if track.last is not None and self._is_told(track, plot):
            self.counts["repeated"] += 1
            return
        sample, R = (plot.time, plot.east, plot.north), (plot.covariance[0], plot.covariance[3])
        out = self.estimator.run_rows(track.state, np.array((sample,)), np.array((R,)))[0]
        number = self.numbers
        words = [number.setdefault(w, len(number)) for w in (plot.key, plot.name, plot.sensor)]
        track.append((plot.time, plot.east, plot.north, *plot.covariance, plot.altitude, *words), out)
        self.scans.tick(track.clock, plot.sensor, plot.time, self.inbox.leap)
        track.period = self.scans.period(track.clock)
        track.last, track.name = plot, plot.name or track.name
        if not int(out.item(STATUS)) & OUTLIER or track.count == 1:
            track.sure = plot
        track.motion = out.item(EAST_SPEED), out.item(NORTH_SPEED)
        variance = max(out.item(BASE), out.item(BASE + 1)) * out.item(SPREADING)  # of the forecast that there was
        if track.count > 1 and 0 <= variance < math.inf:
            deviations, least, scans = ALLOWED
            allowance = max(deviations * math.sqrt(variance), least * self.rules.fastest)
            most = scans * max(track.period, 1.0) * self.rules.fastest
            if allowance > most:
                allowance = min(allowance, max(most, deviations * error(track)))
            track.allowance = allowance
        self.places.move(track)
        if track.status == COASTING:
            track.status = CONFIRMED
            self.tell(plot.time, track, "resumed", "it is seen again")
        elif track.status == TENTATIVE:
            self._confirm(track)
        if not self.has_key(track):
            self.existence.errors.note(track)
        self._plan(track)

    def _is_told(self, track: Live, plot: Plot) -> bool:
        """Say whether a plot repeats the last one: at the same time, or at the same place though the track moves."""
        last = track.last
        past = plot.time - last.time
        if past <= min(REPEAT[0] * track.period, REPEAT[1]):
            return True
        stays = plot.east == last.east and plot.north == last.north
        return stays and math.hypot(*track.motion) * past > track.allowance

    def _confirm(self, track: Live) -> None:
        N, M = self.rules.confirm
        if track.count < N:
            return
        if not self.has_key(track) and (track.odds < REAL or not self._is_object(track)):
            return
        if track.last.time - track.rows[-N, 0] <= (M - 0.5) * self._scan(track):
            track.status = CONFIRMED
            self.existence.is_somebody(track, True)
            self.tell(track.last.time, track, "confirmed", f"{N} plots within {M} scans")

    def _is_object(self, track: Live) -> bool:
        """Say whether a track is no thing that stands still."""
        errors = self.existence.errors
        surely, plots = WAITS
        if track.last.sensor not in errors.seen and track.count < plots and moving(track.rows) < surely:
            return False
        return errors.object(track) >= STILL

    def _scan(self, track: Live) -> float:
        """Return the scan period by which a track is confirmed, s; one of wild plots has a long one of its own."""
        if self.has_key(track):
            period = min((t.period for t in self.of_key.get(track.key, ()) if t.period), default=track.period)
        else:
            period = min(track.period, self.scans.usual(track.last.sensor) or track.period)
        return period or self.unknown

    @property
    def unknown(self) -> float:
        """The scan period assumed before one is known, s."""
        return max(UNKNOWN, self.inbox.rare)

    def _plan(self, track: Live) -> None:
        """Say when to look at a track again."""
        due = self._deadline(track)
        if due < track.due or track.due == math.inf:
            track.due = due
            heapq.heappush(self.due, (due, track.id))

    def _deadline(self, track: Live) -> float:
        N, M = self.rules.confirm
        period = track.period or self.unknown
        if track.status == TENTATIVE:
            scans = M - N + 1.5
        elif track.status == CONFIRMED:
            scans = self.rules.coast + 0.5
        else:
            is_silent = self.before <= track.last.time + self.rules.coast * period
            scans = self.rules.gap * (NAMED if self.has_key(track) or is_silent else 1.0)
        return track.last.time + scans * period

    def look(self, time: float) -> None:
        """Let tracks coast and end that were not seen for long."""
        while self.due and self.due[0][0] < time:
            due, id = heapq.heappop(self.due)
            track = self.live.get(id)
            if track is None or due != track.due:
                continue
            track.due = math.inf
            due = self._deadline(track)
            if due >= time:
                self._plan(track)
            elif track.status == CONFIRMED:
                track.status = COASTING
                self.tell(due, track, "coasting", f"no plot for {self.rules.coast:g} scans")
                self._plan(track)
            else:
                self.end(track, due, "no plot for too long")

    def end(self, track: Live, time: float, why: str) -> None:
        """Take a track away: it has ended, or was never confirmed."""
        del self.live[track.id]
        for key in ({track.key} if self.has_key(track) else set()) | ({track.code} if track.code else set()):
            self.of_key[key].remove(track)
            if not self.of_key[key]:
                del self.of_key[key]
                self.suspects.pop(key, None)
        self.places.remove(track)
        kept = track.status != TENTATIVE
        if self.has_key(track):
            self.past[track.key] = (track.id if kept else track.follows), track.clock
        self.tell(time, track, "ended" if kept else "discarded", why)
        track.status = ENDED
        if kept:
            self.ended.append(track)
        else:
            self.counts["discarded"] += track.count
            if not self.has_key(track):
                self.existence.gave_up(track)

    def reaches(self, a: Plot, b: Plot, allowance: float) -> bool:
        """Say whether one object can give both plots."""
        return reaches(a, b, self.rules.fastest, allowance)

    def may_take(self, track: Live, plot: Plot, addressed: bool) -> bool:
        """Say whether a plot that does not name the track may be of it."""
        if addressed and (not track.key or track.code or CODE.match(track.key)):
            return False
        seen = track.clock.get(plot.sensor)
        past = plot.time - track.last.time
        usual, least = TWICE
        if seen and plot.time - seen[0] < min(usual * track.period, least * min(seen[1:], default=math.inf)):
            return False  # this sensor has already seen it in this scan
        return not abs(plot.altitude - track.last.altitude) > LEVELS + CLIMB * past  # unknown altitudes agree

    def since(self, track: Live, time: float) -> list[Plot]:
        """Return the plots of a track after a time."""
        words = list(self.numbers)
        made = []
        for t, east, north, *R, altitude, key, name, sensor in track.rows[track.rows[:, 0] > time, :11].tolist():
            made.append(Plot(t, east, north, tuple(R), altitude, *(words[int(k)] for k in (key, name, sensor))))
        return made

    def has_key(self, track: Live) -> bool:
        """Say whether plots name a track."""
        return bool(track.key) or self.rules.single

    def tell(self, time: float, track: Live, kind: str, words: str) -> None:
        """Write down what happened to a track."""
        event = Event(time, track.id, kind, words)
        track.events.append(event)
        self.events.append(event)
