"""Plots without keys: those of one instant are shared out among the tracks, or begin new ones."""

from __future__ import annotations

import math

from .association import Forecast, Pair, best_pairs
from .clutter import Density
from .live import TENTATIVE, Live, Plot
from .lives import Lives
from .reach import LONGEST

LEAST = 1.0  # log likelihood ratio that a plot in a track has at least: a wrong one costs more than one missed
EARLY = 12.0  # log likelihood that a plot loses at once after its sensor saw a track; none after the shortest scan


def share_out(lives: Lives, plots: list[Plot]) -> None:
    """Give the plots of one instant to their tracks."""
    known, scan = lives.existence, _turn(lives, plots[0])
    known.sees_at_once |= len(plots) > 1
    density = known.density(plots[0].time, scan, lives.estimator.speed * scan)
    forecasts: dict[int, tuple[Forecast, float, float]] = {}
    pairs = []
    for k, plot in enumerate(plots):
        around = density.at(plot)
        for track in lives.places.within_reach(plot, lives.rules.fastest):
            if not lives.may_take(track, plot, False):
                continue
            if track.id not in forecasts:
                missed = known.missed(track, plot.time, scan)
                forecasts[track.id] = Forecast(lives.estimator, track, plot.time), missed, known.odds(track, missed)
            forecast, missed, odds = forecasts[track.id]
            ratio = forecast.log_density(plot) - around.beside(track) - _haste(lives, track, plot)
            score = math.log(known.detection) + ratio
            gain = known.gain(odds, ratio, track)
            if gain > 0 and score > LEAST:
                pairs.append(Pair(gain, k, track, odds, missed, score))
    made = best_pairs(pairs, len(plots))
    for pair in made:
        if pair is not None:
            known.scored(pair.track, pair.odds, pair.score, pair.missed)
    for plot, pair in zip(plots, made):
        give(lives, plot, None if pair is None else pair.track, density)


def give(lives: Lives, plot: Plot, found: Live | None, density: Density) -> None:
    """Give a plot without a key to a track, or to a new one."""
    known = lives.existence
    if found is None:
        found = lives.begin(plot)
        births = math.log(known.births(plot.time, _turn(lives, plot)) / density.field)
        found.odds = known.first_odds(density.at(plot).all, births)
        found.quiet = known.quiet
    elif old := _rivalled(lives, found):
        lives.end(found, plot.time, f"it is track {old.id}")
        known.is_somebody(found, False)
        for one in (*lives.since(found, old.last.time), plot):
            lives.extend(old, one)
            lives.counts["discarded"] -= one is not plot
    else:
        lives.extend(found, plot)
    if found.status == TENTATIVE:
        known.clutter.append(plot, found)


def _rivalled(lives: Lives, track: Live) -> Live | None:
    """Return the track that a new one is really of: the nearest not seen since, if that is near enough."""
    if track.status != TENTATIVE:
        return None
    near = lives.places.within_reach(track.last, lives.rules.fastest, LONGEST * lives.rules.fastest)
    unseen = [t for t in near if t.status != TENTATIVE and t.last.time < track.last.time and not lives.has_key(t)]
    unseen = [t for t in unseen if lives.reaches(t.sure, track.last, t.allowance)]
    best, found, first, known = 0.0, None, track.last, lives.existence
    scan = _turn(lives, first)
    births = math.log(known.births(first.time, scan) / known.field(lives.estimator.speed * scan))
    for old in unseen:
        odds = known.odds(old, known.missed(old, first.time, scan))
        gain = known.gain(odds, Forecast(lives.estimator, old, first.time).log_density(first) - births, old)
        if gain > best:
            best, found = gain, old
    return found


def _haste(lives: Lives, track: Live, plot: Plot) -> float:
    """Return by how much a plot is less likely of a track because its sensor saw that one in this scan."""
    seen = track.clock.get(plot.sensor)
    shortest = lives.scans.shortest(plot.sensor)
    if not seen or not shortest or lives.existence.sees_at_once:
        return 0.0
    return EARLY * max(1.0 - (plot.time - seen[0]) / shortest, 0.0)


def _turn(lives: Lives, plot: Plot) -> float:
    """Return the scan period of the sensor of a plot, s."""
    return lives.scans.usual(plot.sensor) or lives.unknown
