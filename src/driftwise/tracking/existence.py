"""Whether a track is an object, and how dense plots of nobody are: what plots without keys are weighed by.

    odds of an object       after a plot z    odds <- odds P_D p(z) / beta(z)
                            after a miss      by the chance that it was not seen, or has left

beta is the density of plots that are of no known object, per scan and m^2. Beta, P_D and the odds of a new track are
learnt. (Sittler 1964; the chance to have left: Musicki, Evans and Stankovic 1994.)
"""

from __future__ import annotations

import math

from .clutter import Clutter, Density, chance
from .live import TENTATIVE, Live, Plot
from .stillness import Errors

SEEN = 0.9, 10.0  # what is assumed of P_D, and the scans that it counts for
LEARNT = 1000.0  # scans of objects by which P_D is known
FIELD = 20.0  # of what is fast in a scan, is the field wide, at least
STAYS = 0.95  # probability to be there in the next scan
BORN = 1.0, 20.0, -4.5, 3.0  # objects that appear, in so many scans: what is assumed; least and most log odds of one
SURE, UNLIKELY = 14.0, 1e-6  # log odds are no larger: a long life is no proof for ever; and odds no smaller
PAUSE = 1.5  # scans in which nobody is seen are none


class Existence:
    """What a tracker has learnt of plots without keys."""

    def __init__(self):
        self.clutter, self.errors = Clutter(), Errors()
        self.box = [math.inf, math.inf, -math.inf, -math.inf]  # that plots span
        self.hits = self.chances = 0.0
        self.born = 0
        self.begun = math.nan  # time of the first plot
        self.sees_at_once = False  # several plots at one instant: those of a scan
        self.quiet = 0.0  # s in which nobody was seen at all

    @property
    def detection(self) -> float:
        """P_D: the probability that an object is seen in a scan."""
        return (SEEN[0] * SEEN[1] + self.hits) / (SEEN[1] + self.chances)

    def note(self, plot: Plot, gap: float, scan: float) -> None:
        """Take notice of a plot that came ``gap`` seconds after the one before it."""
        if not self.begun <= plot.time:
            self.begun = plot.time
        if scan and PAUSE * scan < gap < math.inf:
            self.quiet += gap - scan
        low_e, low_n, high_e, high_n = self.box
        self.box = [min(low_e, plot.east), min(low_n, plot.north), max(high_e, plot.east), max(high_n, plot.north)]

    def missed(self, track: Live, time: float, scan: float) -> float:
        """Return the scans in which a track was not seen, though somebody was."""
        if not scan:
            return 0.0
        past = time - track.last.time - (self.quiet - track.quiet)
        return max(round(past / scan) - 1.0, 0.0)

    def odds(self, track: Live, missed: float) -> float:
        """Return the log odds that a track is an object which is still there, after so many misses."""
        unseen = STAYS * (1.0 - self.detection)
        r, stays = chance(track.odds), unseen**missed
        here = r * stays * STAYS
        gone = (1.0 - r) + r * (1.0 - STAYS) * (1.0 - stays) / (1.0 - unseen) + r * stays * (1.0 - STAYS)
        return math.log(max(here / gone, UNLIKELY))

    def scored(self, track: Live, odds: float, gain: float, missed: float) -> None:
        """Let a plot count for the track that it is given to."""
        track.odds = max(min(odds + gain, SURE), -SURE)
        track.quiet = self.quiet
        if track.status == TENTATIVE:
            self.clutter.weigh(track)
        else:
            mine = chance(gain)
            self.hits += mine
            self.chances += 1.0 + missed
            if self.chances > LEARNT:
                self.hits, self.chances = 0.5 * self.hits, 0.5 * self.chances

    def gave_up(self, track: Live) -> None:
        """Learn that a track was never confirmed: its plots are nobody's."""
        track.odds = -SURE
        self.clutter.weigh(track)

    def gain(self, odds: float, density: float, track: Live) -> float:
        """Return what a plot in a track is more likely than both alone."""
        r = 0.5 if track.status == TENTATIVE else max(chance(odds), UNLIKELY)
        return math.log(self.detection * r / (1.0 - self.detection * r)) + density

    def births(self, time: float, scan: float) -> float:
        """Return the objects that appear in a scan."""
        return (self.born + BORN[0]) / (max((time - self.begun) / scan, 0.0) + BORN[1])

    def first_odds(self, density: float, births: float) -> float:
        """Return the log odds that a plot of no known object is the first of a new one, by densities (births: log)."""
        return min(max(births - density, BORN[2]), BORN[3])

    def density(self, time: float, scan: float, reach: float) -> Density:
        """Return the density of plots of nobody at a time."""
        nobody, scans = self.clutter.since(self.begun, time, scan)
        return Density(nobody, scans, self.field(reach))

    def field(self, reach: float) -> float:
        """Return the area that is seen, m^2, of what is fast by ``reach`` (m) in a scan."""
        east, north = self.box[2] - self.box[0], self.box[3] - self.box[1]
        return max(east, FIELD * reach) * max(north, FIELD * reach)

    def is_somebody(self, track: Live, is_new: bool) -> None:
        """Learn that a track is an object after all, a new one or one known."""
        self.born += is_new
        self.clutter.remove(track)
