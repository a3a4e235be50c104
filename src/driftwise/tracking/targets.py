"""The tracks that are followed: which of them a plot belongs to."""

from __future__ import annotations

import copy
import math
from typing import Any

from ..estimators.track.estimator import TrackEstimator
from .association import Forecast
from .inbox import Inbox
from .keyless import share_out
from .live import TENTATIVE, Live, Plot
from .lives import CODE, Lives, Rules
from .reach import miss

SUSPECTS = 8  # plots set aside that are remembered for a key


class Targets(Lives):
    """What a `Tracker` follows. Plots come in order of time."""

    def __init__(self, estimator: TrackEstimator, rules: Rules, inbox: Inbox):
        super().__init__(estimator, rules, inbox)
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
                self.end(track, self.time, "the clock went back")
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
        if plots:
            share_out(self, plots)

    def _use_key(self, plot: Plot) -> None:
        """Give a plot to the track of its key that it can belong to; set it aside, or begin a new one."""
        alive = self.of_key.get(plot.key)
        if not alive:
            track = self._best(plot) if CODE.match(plot.key) else None
            if track is None:
                self.begin(plot, *self.past.pop(plot.key, (None, {})))
                return
            track.code = plot.key
            self.of_key.setdefault(plot.key, []).append(track)
            self.extend(track, plot)
            return
        if fitting := [t for t in alive if self.reaches(t.sure, plot, t.allowance)]:
            best = max(fitting, key=lambda t: t.count)
            for other in fitting:  # where one plot is of both, they are one
                if other is not best:
                    self.end(other, plot.time, f"it is track {best.id}")
            self.extend(best, plot)
            return
        allowance = min(t.allowance for t in alive)
        suspects = self.suspects.setdefault(plot.key, [])
        suspects[:] = [s for s in suspects if plot.time - s.time <= self.rules.gap * (alive[0].period or self.unknown)]
        agreeing = [s for s in suspects if s.time < plot.time and self.reaches(s, plot, allowance)]
        if not agreeing:
            suspects.append(plot)
            del suspects[:-SUSPECTS]
            self.counts["outliers"] += 1
            track = min(alive, key=lambda t: miss(t, plot))
            self.tell(plot.time, track, "outlier", f"a plot {miss(track, plot) / 1e3:.1f} km off is set aside")
            return
        first = agreeing[-1]
        suspects.remove(first)
        self.counts["outliers"] -= 1
        old = alive[0]
        if len(alive) == 1 and old.last.time <= first.time and old.key == plot.key:
            known = old.status != TENTATIVE
            self.end(old, first.time, "two plots agree that it is elsewhere")
            new = self.begin(first, *self.past.pop(old.key))
            if known:
                self.tell(first.time, new, "split", f"track {old.id} goes on elsewhere, faster than it can be")
        else:
            new = self.begin(first)
            self.tell(first.time, new, "duplicate", f"{plot.key or 'it'} is in two places at once, see track {old.id}")
        self.extend(new, plot)

    def _best(self, plot: Plot) -> Live | None:
        """Return the addressed track in whose gate a plot is most likely."""
        found, best = None, -math.inf
        for track in self.places.within_reach(plot, self.rules.fastest):
            if self.may_take(track, plot, True):
                forecast = Forecast(self.estimator, track, plot.time)
                density = forecast.log_density(plot)
                if density > best and forecast.deviations(plot) <= self.rules.gate:
                    found, best = track, density
        return found
