"""Plots wait here until they are in order of time."""

from __future__ import annotations

import heapq
import math

from .live import Plot

LEAP = 600.0  # s: a clock that leaps farther needs a second plot that says so ..
STEPS = 20.0  # .. where plots do not come at such times anyway: the longest of the last steps, times this
KEPT = 15  # steps


class Inbox:
    """Plots held back for ``delay`` seconds, handed out in order of time.

    A plot more than a leap before or after the newest one waits until the next plot agrees with it, and is dropped when
    that one does not: one wrong clock does not end every track. A leap is `LEAP` seconds, or more where plots are rare:
    a fix a day is no wild clock, and the recording itself says so.
    """

    def __init__(self, delay: float):
        self.delay = delay
        self.newest = -math.inf  # time of the newest plot, or of the clock
        self.held: list[tuple[float, int, Plot]] = []  # a heap
        self.arrivals = 0
        self.strange: Plot | None = None
        self.dropped = 0
        self.remember([])

    def remember(self, steps: list[float]) -> None:
        """Keep the times between the last plots that were not at once, s, and what they say."""
        self.steps = steps
        self.rare = sorted(steps)[-2] if len(steps) > 1 else 0.0  # s until any plot comes, at most; 0 is unknown
        self.leap = max(LEAP, STEPS * self.rare)  # s that need a second plot

    def put(self, plot: Plot) -> list[Plot]:
        """Take a plot and return those whose turn has come."""
        ready = []
        if self.arrivals and abs(plot.time - self.newest) > self.leap:
            first, self.strange = self.strange, plot
            if first is None or not 0 <= plot.time - first.time <= max(self.leap, STEPS * (first.time - self.newest)):
                self.dropped += first is not None
                return []
            ready = self.finish()[:-1]
            self._note(first.time)
            self.newest = first.time
            self._hold(first)
        elif self.strange:
            self.strange = None
            self.dropped += 1
        self._hold(plot)
        self._note(plot.time)
        self.newest = max(self.newest, plot.time)
        return ready + self.take(self.newest - self.delay)

    def advance(self, time: float) -> list[Plot]:
        """Set the clock, and return the plots whose turn has come."""
        self.newest = max(self.newest, time)
        return self.take(self.newest - self.delay)

    def finish(self) -> list[Plot]:
        """Return all plots that are held."""
        strange, self.strange = self.strange, None
        return self.take(math.inf) + ([strange] if strange else [])

    def take(self, until: float) -> list[Plot]:
        """Return the plots up to a time."""
        ready = []
        while self.held and self.held[0][0] <= until:
            ready.append(heapq.heappop(self.held)[2])
        return ready

    def _note(self, time: float) -> None:
        if time > self.newest > -math.inf:
            self.remember([*self.steps[1 - KEPT :], time - self.newest])

    def _hold(self, plot: Plot) -> None:
        self.arrivals += 1
        heapq.heappush(self.held, (plot.time, self.arrivals, plot))
