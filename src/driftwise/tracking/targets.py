"""The tracks that are followed: which of them a plot belongs to, and how they begin, coast and end."""

from __future__ import annotations

import copy
import heapq
import math
import re
from typing import Any, NamedTuple

import numpy as np

from ..engine.status import OUTLIER
from ..estimators.track.bank import TRACK_SAMPLE
from ..estimators.track.estimator import TrackEstimator
from .association import Forecast, Pair, best_pairs
from .existence import Density, Existence
from .inbox import Inbox
from .live import COASTING, CONFIRMED, ENDED, TENTATIVE, Event, Live, Plot
from .places import Places
from .reach import LONGEST, error, miss, reaches
from .scans import Scans

UNKNOWN = 30.0  # s: the scan period assumed before one is known, where plots are not rarer
REPEAT = 0.02, 0.05  # scan periods, s: within both, a second plot of a track tells the first one again
SUSPECTS = 8  # plots set aside that are remembered for a key
TWICE = 0.08, 0.5  # scan periods, and shortest of the last scans: no sensor sees an object twice in less
NAMED = 4.0  # times as many scans without a plot may a track have that its plots name, or while nobody was seen
ALLOWED = 5.0, 0.25, 3.0  # deviations of a forecast that are allowed; s of what is fast, at least; and scans, at most
LEAST = 1.0  # log likelihood ratio that a plot in a track has at least: a wrong one costs more than one missed
EARLY = 12.0  # log likelihood that a plot loses at once after its sensor saw a track; none after the shortest scan
REAL = 4.0  # log odds from which a track without a key may be confirmed
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


class Targets:
    """What a `Tracker` follows. Plots come in order of time."""

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
        self.suspects: dict[str, list[Plot]] = {}
        self.past: dict[str, tuple[int | None, dict]] = {}  # of a key: its last track, and that track's clock
        self.due: list[tuple[float, int]] = []  # a heap: when to look at which track
        self.numbers: dict[str, int] = {"": 0}  # of keys, names and sensors in the rows
        self.existence = Existence()
        self.at_once: list[Plot] = []  # without keys, of one instant, whose other plots may yet come

    def copy(self) -> Targets:
        """Return another one that goes on from here; rows that never change again are shared."""
        shared: dict[int, Any] = {id(self.estimator): self.estimator}
        shared |= {id(self.events): list(self.events), id(self.ended): list(self.ended)}
        for track in self.live.values():
            shared |= {id(track.table): track.rows, id(track.events): list(track.events)}
        return copy.deepcopy(self, shared)

    def use(self, plot: Plot) -> None:
        """Give a plot to its track, whichever that is."""
        self.counts["plots"] += 1
        if self.at_once and (plot.time != self.time or plot.key or self.rules.single):
            self.share_out()
        if plot.time < self.time:
            if plot.time > self.time - self.inbox.leap:
                self.counts["late"] += 1
                return
            for track in list(self.live.values()):
                self._end(track, self.time, "the clock went back")
        self.before, self.time = self.time, plot.time
        self.look(plot.time)
        if plot.key or self.rules.single:
            self._use_key(plot)
            return
        self.existence.note(plot, plot.time - self.before, self.scans.usual(plot.sensor))
        self.at_once.append(plot)

    def share_out(self) -> None:
        """Give the plots of one instant to their tracks."""
        plots, self.at_once = self.at_once, []
        if not plots:
            return
        known, scan = self.existence, self._turn(plots[0])
        known.sees_at_once |= len(plots) > 1
        density = known.density(plots[0].time, scan, self.estimator.speed * scan)
        forecasts: dict[int, tuple[Forecast, float, float]] = {}
        pairs = []
        for k, plot in enumerate(plots):
            around = density.at(plot)
            for track in self.places.within_reach(plot, self.rules.fastest):
                if not self._may_take(track, plot, False):
                    continue
                if track.id not in forecasts:
                    missed = known.missed(track, plot.time, scan)
                    forecasts[track.id] = Forecast(self.estimator, track, plot.time), missed, known.odds(track, missed)
                forecast, missed, odds = forecasts[track.id]
                ratio = forecast.log_density(plot) - around.beside(track) - self._haste(track, plot)
                score = math.log(known.detection) + ratio
                gain = known.gain(odds, ratio, track)
                if gain > 0 and score > LEAST:
                    pairs.append(Pair(gain, k, track, odds, missed, score))
        made = best_pairs(pairs, len(plots))
        for pair in made:
            if pair is not None:
                known.scored(pair.track, pair.odds, pair.score, pair.missed)
        for plot, pair in zip(plots, made):
            self._give(plot, None if pair is None else pair.track, density)

    def _turn(self, plot: Plot) -> float:
        """Return the scan period of the sensor of a plot, s."""
        return self.scans.usual(plot.sensor) or self._unknown

    def _haste(self, track: Live, plot: Plot) -> float:
        """Return by how much a plot is less likely of a track because its sensor saw that one in this scan."""
        seen = track.clock.get(plot.sensor)
        shortest = self.scans.shortest(plot.sensor)
        if not seen or not shortest or self.existence.sees_at_once:
            return 0.0
        return EARLY * max(1.0 - (plot.time - seen[0]) / shortest, 0.0)

    def _give(self, plot: Plot, found: Live | None, density: Density) -> None:
        """Give a plot without a key to a track, or to a new one."""
        known = self.existence
        if found is None:
            found = self._begin(plot)
            found.odds = known.first_odds(density, known.births(plot.time, self._turn(plot)))
            found.quiet = known.quiet
        elif old := self._rivalled(found):
            self._end(found, plot.time, f"it is track {old.id}")
            known.is_somebody(found, False)
            for one in (*self._since(found, old.last.time), plot):
                self._extend(old, one)
                self.counts["discarded"] -= one is not plot
        else:
            self._extend(found, plot)
        if found.status == TENTATIVE:
            known.is_nobody(plot, found)

    def _use_key(self, plot: Plot) -> None:
        """Give a plot to the track of its key that it can belong to; set it aside, or begin a new one."""
        alive = self.of_key.get(plot.key)
        if not alive:
            track = self._best(plot) if CODE.match(plot.key) else None
            if track is None:
                self._begin(plot, *self.past.pop(plot.key, (None, {})))
                return
            track.code = plot.key
            self.of_key.setdefault(plot.key, []).append(track)
            self._extend(track, plot)
            return
        if fitting := [t for t in alive if self._reaches(t.sure, plot, t.allowance)]:
            best = max(fitting, key=lambda t: t.count)
            for other in fitting:  # where one plot is of both, they are one
                if other is not best:
                    self._end(other, plot.time, f"it is track {best.id}")
            self._extend(best, plot)
            return
        allowance = min(t.allowance for t in alive)
        suspects = self.suspects.setdefault(plot.key, [])
        suspects[:] = [s for s in suspects if plot.time - s.time <= self.rules.gap * (alive[0].period or self._unknown)]
        agreeing = [s for s in suspects if s.time < plot.time and self._reaches(s, plot, allowance)]
        if not agreeing:
            suspects.append(plot)
            del suspects[:-SUSPECTS]
            self.counts["outliers"] += 1
            track = min(alive, key=lambda t: miss(t, plot))
            self._tell(plot.time, track, "outlier", f"a plot {miss(track, plot) / 1e3:.1f} km off is set aside")
            return
        first = agreeing[-1]
        suspects.remove(first)
        self.counts["outliers"] -= 1
        old = alive[0]
        if len(alive) == 1 and old.last.time <= first.time and old.key == plot.key:
            known = old.status != TENTATIVE
            self._end(old, first.time, "two plots agree that it is elsewhere")
            new = self._begin(first, *self.past.pop(old.key))
            if known:
                self._tell(first.time, new, "split", f"track {old.id} goes on elsewhere, faster than it can be")
        else:
            new = self._begin(first)
            self._tell(first.time, new, "duplicate", f"{plot.key or 'it'} is in two places at once, see track {old.id}")
        self._extend(new, plot)

    def _reaches(self, a: Plot, b: Plot, allowance: float) -> bool:
        """Say whether one object can give both plots."""
        return reaches(a, b, self.rules.fastest, allowance)

    def _best(self, plot: Plot) -> Live | None:
        """Return the addressed track in whose gate a plot is most likely."""
        found, best = None, -math.inf
        for track in self.places.within_reach(plot, self.rules.fastest):
            if self._may_take(track, plot, True):
                distance, size = self._miss(track, plot)
                if distance <= self.rules.gate**2 and -distance - size > best:
                    found, best = track, -distance - size
        return found

    def _miss(self, track: Live, plot: Plot) -> tuple[float, float]:
        """Return by how many deviations, squared, a plot misses a forecast, and the log of its variance; inf: none."""
        mean, S = self.estimator.predict(track.state.view(self.estimator.dtype)[0], plot.time)
        (a, b), (_, d) = S.tolist()
        e, n = plot.east - float(mean[0]), plot.north - float(mean[1])
        det = a * d - b * b
        if not 0 < det < math.inf:
            return math.inf, math.inf  # the forecast says nothing
        return (d * e * e - 2 * b * e * n + a * n * n) / det, math.log(det)

    def _rivalled(self, track: Live) -> Live | None:
        """Return the track that a new one is really of: the nearest not seen since, if that is near enough."""
        if track.status != TENTATIVE:
            return None
        near = self.places.within_reach(track.last, self.rules.fastest, LONGEST * self.rules.fastest)
        unseen = [t for t in near if t.status != TENTATIVE and t.last.time < track.last.time and not self._has_key(t)]
        unseen = [t for t in unseen if self._reaches(t.sure, track.last, t.allowance)]
        best, found, first, known = 0.0, None, track.last, self.existence
        scan = self._turn(first)
        births = math.log(known.births(first.time, scan) / known.field(self.estimator.speed * scan))
        for old in unseen:
            odds = known.odds(old, known.missed(old, first.time, scan))
            gain = known.gain(odds, Forecast(self.estimator, old, first.time).log_density(first) - births, old)
            if gain > best:
                best, found = gain, old
        return found

    def _since(self, track: Live, time: float) -> list[Plot]:
        """Return the plots of a track after a time."""
        words = list(self.numbers)
        made = []
        for t, east, north, *R, altitude, key, name, sensor in track.rows[track.rows[:, 0] > time, :11].tolist():
            made.append(Plot(t, east, north, tuple(R), altitude, *(words[int(k)] for k in (key, name, sensor))))
        return made

    def _may_take(self, track: Live, plot: Plot, addressed: bool) -> bool:
        """Say whether a plot that does not name the track may be of it."""
        if addressed and (not track.key or track.code or CODE.match(track.key)):
            return False
        seen = track.clock.get(plot.sensor)
        past = plot.time - track.last.time
        usual, least = TWICE
        if seen and plot.time - seen[0] < min(usual * track.period, least * min(seen[1:], default=math.inf)):
            return False  # this sensor has already seen it in this scan
        return not abs(plot.altitude - track.last.altitude) > LEVELS + CLIMB * past  # unknown altitudes agree

    # --- the life of a track -------------------------------------------------------------------------------

    def _begin(self, plot: Plot, follows: int | None = None, clock: dict | None = None) -> Live:
        self.begun += 1
        track = Live(self.begun, plot.key, self.estimator.start().reshape(-1).view(float), follows, clock or {})
        track.allowance = self.rules.fastest
        self.live[track.id] = track
        if self._has_key(track):
            self.of_key.setdefault(track.key, []).append(track)
        self.places.add(track)
        after = f", follows track {follows}" if follows else ""
        self._tell(plot.time, track, "initiated", f"{plot.key or 'no key'}{after}")
        self._extend(track, plot)
        return track

    def _extend(self, track: Live, plot: Plot) -> None:
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
            self._tell(plot.time, track, "resumed", "it is seen again")
        elif track.status == TENTATIVE:
            self._confirm(track)
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
        if track.count < N or (track.odds < REAL and not self._has_key(track)):
            return
        if track.last.time - track.rows[-N, 0] <= (M - 0.5) * self._scan(track):
            track.status = CONFIRMED
            self.existence.is_somebody(track, True)
            self._tell(track.last.time, track, "confirmed", f"{N} plots within {M} scans")

    def _scan(self, track: Live) -> float:
        """Return the scan period by which a track is confirmed, s; one of wild plots has a long one of its own."""
        if self._has_key(track):
            period = min((t.period for t in self.of_key.get(track.key, ()) if t.period), default=track.period)
        else:
            period = min(track.period, self.scans.usual(track.last.sensor) or track.period)
        return period or self._unknown

    @property
    def _unknown(self) -> float:
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
        period = track.period or self._unknown
        if track.status == TENTATIVE:
            scans = M - N + 1.5
        elif track.status == CONFIRMED:
            scans = self.rules.coast + 0.5
        else:
            is_silent = self.before <= track.last.time + self.rules.coast * period
            scans = self.rules.gap * (NAMED if self._has_key(track) or is_silent else 1.0)
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
                self._tell(due, track, "coasting", f"no plot for {self.rules.coast:g} scans")
                self._plan(track)
            else:
                self._end(track, due, "no plot for too long")

    def _end(self, track: Live, time: float, why: str) -> None:
        del self.live[track.id]
        for key in ({track.key} if self._has_key(track) else set()) | ({track.code} if track.code else set()):
            self.of_key[key].remove(track)
            if not self.of_key[key]:
                del self.of_key[key]
                self.suspects.pop(key, None)
        self.places.remove(track)
        kept = track.status != TENTATIVE
        if self._has_key(track):
            self.past[track.key] = (track.id if kept else track.follows), track.clock
        self._tell(time, track, "ended" if kept else "discarded", why)
        track.status = ENDED
        if kept:
            self.ended.append(track)
        else:
            self.counts["discarded"] += track.count

    def _has_key(self, track: Live) -> bool:
        return bool(track.key) or self.rules.single

    def _tell(self, time: float, track: Live, kind: str, words: str) -> None:
        event = Event(time, track.id, kind, words)
        track.events.append(event)
        self.events.append(event)
