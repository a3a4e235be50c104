"""Newcomers and clutter: objects without names that appear and leave, seen now and then, among plots of nobody.

The plain model of the field (Bar-Shalom and Li 1995, and the simulators of Stone Soup): in each scan so many objects
are born (Poisson), each leaves with a probability, or where it leaves the field of view, each is seen with a
probability, and so many plots are of nobody (Poisson), anywhere in the field; in patchy crowds most of them in places.

Run: python -m driftwise_studies.score.motions.crowd [--seed 0] [--scenes 150] [--patchy]
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from driftwise.tracking.plots import Plots, plots
from driftwise.tracking.tracker import Tracker

from . import patches
from .drawing import asked, between
from .field import number, table
from .measured import belong
from .scene import KINDS, Scene, Sensor
from .simulation import itinerary, walk

NOBODY = -1
SEEN_ENOUGH = 8  # plots of an object that counts
LEVELS = (0.0, 1.0, 3.0, 10.0, 100.0)  # plots of nobody in a scan, between which scenes are told apart
HEAD = (
    "plots of nobody in a scan", "scenes", "objects", "seen by its track", "in one piece", "confirmed tracks",
    "of them false", "breaks", "swaps",
)  # fmt: skip


class Crowd(NamedTuple):
    """A scene as data, in the words of Stone Soup's simulators."""

    seed: tuple[int, int]
    name: str  # of the class of all objects
    scans: int
    scan: float  # s
    deviation: float  # m
    side: float  # m, of the field of view
    birth_rate: float  # objects a scan
    death_probability: float  # of each, a scan
    detection_probability: float
    clutter_rate: float  # plots of nobody a scan, anywhere
    patches: tuple[patches.Patch, ...] = ()  # and in places

    @property
    def nobody(self) -> float:
        """Plots of nobody a scan."""
        return self.clutter_rate + sum(patch.rate for patch in self.patches)


class Gathered(NamedTuple):
    """Plots in order of time, the truth of each, and whose it is."""

    plots: Plots
    object: np.ndarray  # (T,) which, or `NOBODY`
    truth: np.ndarray  # (T, 2)


class Counted(NamedTuple):
    """What a tracker made of a scene: sums, of objects that are seen often enough."""

    objects: int
    whole: int  # of them in one track
    plots: int  # of them
    held: int  # in a track that is of its object
    tracks: int  # confirmed
    false: int  # with plots of nobody for the most part
    breaks: int  # another track of the same object
    swaps: int  # another object in the same track


def draw(seed: int, number: int, patchy: bool = False) -> Crowd:
    """Return crowd ``number`` of ``seed``; every fifth one has no clutter, unless it is ``patchy``.

    Examples
    --------
    >>> from driftwise_studies.score.motions import crowd
    >>> scene = crowd.draw(0, 1)
    >>> scene.name, scene.scans, round(scene.clutter_rate, 1)
    ('walker', 75, 0.9)
    """
    rng = np.random.default_rng([seed, number, 28])
    name = str(rng.choice([k for k in KINDS if k != "animal"]))  # a collar says whose it is
    kind, lasts, present = KINDS[name], between(rng, (20.0, 60.0)), between(rng, (1.0, 5.0))
    scan, deviation = between(rng, kind.scan), between(rng, kind.deviation)
    side = kind.told * scan * between(rng, (30.0, 100.0)) + 100 * deviation
    made = Crowd(
        (seed, number), name, int(between(rng, (60.0, 200.0))), scan, deviation, side, present / lasts, 1 / lasts,
        float(rng.uniform(0.6, 1.0)), 0.0 if number % 5 == 0 else between(rng, (0.1, 10.0)),
    )  # fmt: skip
    if not patchy:
        return made
    rng = np.random.default_rng([seed, number, 29])
    return made._replace(patches=patches.draw(rng, side, deviation))


def simulate(crowd: Crowd) -> Gathered:
    """Return the plots of a crowd; those of one scan come in any order."""
    rng = np.random.default_rng([*crowd.seed, 2])
    kind, sensors = KINDS[crowd.name], (Sensor("A", crowd.scan, crowd.deviation),)
    scene = Scene(0, crowd.seed, crowd.name, kind, (), crowd.scans, sensors)
    time = crowd.scan * np.arange(crowd.scans)
    births = rng.poisson(crowd.birth_rate, crowd.scans)
    births[0] += max(rng.poisson(crowd.birth_rate / crowd.death_probability), 1)
    parts: list[tuple[np.ndarray, ...]] = []
    for k, first in enumerate(np.repeat(np.arange(crowd.scans), births)):
        stays = time[first : first + rng.geometric(crowd.death_probability)]
        path = walk(rng, scene, itinerary(rng, scene, float(stays[-1] - stays[0])), stays)
        truth = path.position - path.position[0] + rng.uniform(0, crowd.side, 2)
        inside = np.cumprod(((truth >= 0) & (truth <= crowd.side)).all(axis=1)) > 0
        kept = inside & (rng.random(len(stays)) < crowd.detection_probability)
        position = truth + crowd.deviation * rng.standard_normal(truth.shape)
        parts.append((stays[kept], position[kept], truth[kept], np.full(kept.sum(), k)))
    false = np.repeat(time, rng.poisson(crowd.clutter_rate, crowd.scans))
    anywhere = rng.uniform(0, crowd.side, (len(false), 2))
    parts.append((false, anywhere, anywhere, np.full(len(false), NOBODY)))
    for patch in crowd.patches:
        which, places = patches.returns(rng, patch, crowd.scans)
        parts.append((time[which], places, places, np.full(len(which), NOBODY)))
    columns = [np.concatenate(c) for c in zip(*parts)]
    order = np.lexsort((rng.random(len(columns[0])), columns[0]))
    when, position, truth, who = (c[order] for c in columns)
    return Gathered(plots(when, position), who, truth)


def count(crowd: Crowd) -> Counted:
    """Track a crowd, told the class and nothing else, and hold the tracks against the truth."""
    seen = simulate(crowd)
    tracker = Tracker(KINDS[crowd.name].told)
    tracker.feed(seen.plots)
    tracker.finish()
    mine = [seen.object[belong(track, seen.plots)] for track in tracker.tracks]
    return tally(seen.object, mine)


def tally(objects: np.ndarray, tracks: Sequence[np.ndarray]) -> Counted:
    """Return the counts: whose each plot is, and whose are the plots of each track."""
    plots_of = np.bincount(objects[objects >= 0])
    counted = np.flatnonzero(plots_of >= SEEN_ENOUGH)
    pieces, held, false, swaps = np.zeros(len(plots_of), int), 0, 0, 0
    for who in tracks:
        true = who[who >= 0]
        if 2 * len(true) <= len(who):
            false += 1
            continue
        owner = np.bincount(true).argmax()
        pieces[owner] += 1
        swaps += int(np.sum(true[1:] != true[:-1]))
        held += int(np.sum(true == owner)) if owner in counted else 0
    pieces = pieces[counted]
    return Counted(
        len(counted), int(np.sum(pieces == 1)), int(plots_of[counted].sum()), held, len(tracks), false,
        int(np.maximum(pieces - 1, 0).sum()), swaps,
    )  # fmt: skip


def by_clutter(crowds: Sequence[Crowd], counted: Sequence[Counted]) -> str:
    """Return the table, all scenes first."""
    rates = np.array([crowd.nobody for crowd in crowds])
    spans = [("any", rates >= 0.0), ("none", rates == 0.0)]
    spans += [(f"{a:g} to {b:g}", (rates > a) & (rates <= b)) for a, b in pairwise(LEVELS)]
    rows = []
    for words, used in spans:
        if not used.any():
            continue
        some = Counted(*np.array([c for c, u in zip(counted, used) if u]).reshape(-1, len(Counted._fields)).sum(axis=0))
        share, one_piece = some.held / max(some.plots, 1), some.whole / max(some.objects, 1)
        rest = map(str, (some.tracks, some.false, some.breaks, some.swaps))
        rows.append([words, f"{used.sum()}", f"{some.objects}", number(share), number(one_piece), *rest])
    return table(rows, HEAD)


def play(seed: int, scenes: int, patchy: bool = False) -> str:
    """Return the table of so many crowds."""
    crowds = [draw(seed, k, patchy) for k in range(scenes)]
    return by_clutter(crowds, [count(crowd) for crowd in crowds])


def main(arguments=None) -> None:
    """Print the table."""
    print(play(*asked(__doc__, arguments, patchy="clutter is dense in places")))


if __name__ == "__main__":
    main()
