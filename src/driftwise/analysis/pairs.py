"""Two changes close together, dated and named together: alone, each is dated where it explains both by half."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np

from .change_effects import GAIN, LEVEL, NUMBERS, effects, kinds
from .change_places import APART, LONG, NEAR, Place, located
from .noise_jumps import SURE
from .response import Response
from .response_orders import cleaned

PLACES, CLOSER = 48, 8  # dates of each that are tried; samples about it at which all are
FITS = 3  # pairs that are fitted, the likeliest
QUANTILES = 0.025, 0.5, 0.975  # of a date
RIDGE = 1e-6  # of what one change does beside the other, below which it does the same


class One(NamedTuple):
    """A change of a response: its kind, its input, its first sample."""

    kind: str
    i: int
    at: int

    @property
    def what(self) -> tuple[str, int]:
        """Its kind and its input."""
        return self.kind, self.i

    def of(self, now: Response) -> tuple[str, int]:
        """Return the part of a response and the place in it where the change is."""
        return ("levels", now.levels.index(self.at)) if self.kind == LEVEL else ("gains", now.gains.index(self[1:]))


class Pair(NamedTuple):
    """Two changes, and what both take off half the squares, (p, q), at dates of the first and of the second."""

    kinds: tuple[tuple[str, int], tuple[str, int]]
    dates: tuple[np.ndarray, np.ndarray]
    taken: np.ndarray

    @property
    def ones(self) -> tuple[One, One]:
        """The likeliest."""
        p, q = np.unravel_index(int(np.argmax(self.taken)), self.taken.shape)
        (a, b), (first, second) = self.kinds, self.dates
        return One(*a, int(first[p])), One(*b, int(second[q]))

    @property
    def worth(self) -> float:
        """What they take there."""
        return float(self.taken.max())


def changes(now: Response) -> list[One]:
    """Return the changes of a response in order of time."""
    found = [One(LEVEL, 0, at) for at in now.levels] + [One(GAIN, i, at) for i, at in now.gains]
    return sorted(found, key=lambda one: one.at)


def close(now: Response) -> Iterator[tuple[One, One]]:
    """Yield neighbouring changes that are less than `NEAR` samples apart."""
    yield from (pair for pair in pairwise(changes(now)) if pair[1].at - pair[0].at < NEAR)


def joined(now: Response) -> Response:
    """Return a response with two changes in the place of two, or of one that stood for both, where that is likelier.

    A long record is left as it is: its changes are dated by scores.
    """
    if len(now.used) >= LONG:
        return now
    groups = list[tuple[One, ...]](close(now))
    groups += [(one,) for one in changes(now) if not any(one in group for group in groups)]
    for group in groups:
        if not set(group) <= set(changes(now)):
            continue
        less = without(now, group)
        pairs = looked_for(less, group)
        n = len(less.rows)
        price = [sum(NUMBERS[kind] for kind, _ in pair.kinds) * 0.5 * math.log(n) for pair in pairs]
        likely = sorted(zip(pairs, price), key=lambda one: one[1] - one[0].worth)[:FITS]
        for pair, _ in likely:
            if set(pair.ones) == set(group):
                continue
            other = cleaned(beside(less, pair.ones).settled(1))
            if other.dated_criterion < now.dated_criterion - 1e-9 and (len(group) > 1 or are_sure(other, pair.ones)):
                now = other
    return now


def are_sure(now: Response, ones) -> bool:
    """Say whether a response has changes, each of which is sure beside the other: they stand for one that was."""
    has = set(changes(now))
    places = (located(now, *one.of(now)) if one in has else None for one in ones)
    return all(where is not None and where.log_odds > SURE for where in places)


def without(now: Response, group) -> Response:
    """Return a response without some of its changes, all samples about which count."""
    about = NEAR // 2 if len(group) == 1 else 0  # what lasts but from one to the other looks like outliers
    less = now = now.with_all_near(group[0].at - about, group[-1].at + about)
    for one in group:
        less = less.without(*one.of(less))
    apart = (now.rows < group[0].at - about) | (now.rows > group[-1].at + about)
    less.cache["weight"] = np.where(apart, now.weight, 1.0)
    return less


def beside(now: Response, ones) -> Response:
    """Return a response with more changes, not fitted yet."""
    for kind, i, at in ones:
        now = now.with_level(at) if kind == LEVEL else now.with_gain(i, at)
    return now


def looked_for(less: Response, group) -> list[Pair]:
    """Return the likeliest pair of each two kinds about the changes of a group, which ``less`` is without."""
    seen = np.flatnonzero(less.used)
    seen = seen[(seen > group[0].at - NEAR) & (seen < group[-1].at + NEAR)]
    if len(seen) < 4:
        return []
    some = seen[np.unique(np.linspace(0, len(seen) - 1, PLACES).astype(int))]
    places = {way: seen if way[0] == LEVEL else some for way in kinds(less)}  # the onset of a step is sharp
    ways, found = {way: directions(less, way, places[way]) for way in places}, []
    same = {one.what for one in group} if len(group) == 2 else set()  # a gain that goes and comes back is looked for
    again = [(way, way) for way in same] if len(same) == 1 else []  # where it was found: moves that act late look so
    for a, b in (*combinations(places, 2), *again):
        dates = places[a], places[b]
        coarse = Pair((a, b), dates, both(less, (a, b), dates, ways[a], ways[b]))
        first, second = (nearby(seen, known, one.at) for known, one in zip(dates, coarse.ones))
        taken = both(less, (a, b), (first, second), directions(less, a, first), directions(less, b, second))
        found.append(Pair((a, b), (first, second), taken))
    return found


def together(now: Response, places: dict[One, Place]) -> dict[One, Place]:
    """Return the places of changes with intervals that hold wherever a change close by is."""
    for one, two in close(now):
        if not {one, two} <= set(places):
            continue
        found = places[one], places[two]
        ends = min(where.interval[0] for where in found), max(where.interval[1] for where in found)
        for way, dated in zip((one, two), intervals(now, one, two, ends, max(where.calm for where in found))):
            places = places | {way: places[way]._replace(**dated)}
    return places


def intervals(now: Response, one: One, two: One, ends, calm: float) -> list[dict]:
    """Return interval and middle of each of two changes, wherever between ``ends``, or near it, the other one is."""
    less = without(now, (one, two))
    seen = np.flatnonzero(less.used)
    seen = seen[(seen >= min(ends[0], one.at - NEAR // 2)) & (seen <= max(ends[1], two.at + NEAR // 2))]
    some = seen[np.unique(np.linspace(0, len(seen) - 1, PLACES).astype(int))]
    dates = [np.unique(np.concatenate([some, seen[abs(seen - way.at) <= CLOSER], [way.at]])) for way in (one, two)]
    ways = [directions(less, way.what, places) for way, places in zip((one, two), dates)]
    taken = both(less, (one.what, two.what), dates, *ways) / calm
    width = [np.maximum(np.gradient(np.searchsorted(seen, places).astype(float)), 0.5) for places in dates]
    weight = np.exp(taken - taken.max()) * np.multiply.outer(*width)
    found = []
    for axis, places in zip((1, 0), dates):
        total = np.cumsum(weight.sum(axis=axis)) / weight.sum()
        low, middle, high = (int(places[min(int(np.searchsorted(total, q)), len(places) - 1)]) for q in QUANTILES)
        found.append({"interval": (low, high), "middle": middle})
    return found


def nearby(seen, places, at: int) -> np.ndarray:
    """Return the samples from the place before one to the place after it."""
    k = int(np.searchsorted(places, at))
    return seen[(seen >= places[max(k - 1, 0)]) & (seen <= places[min(k + 1, len(places) - 1)])]


def directions(less: Response, what: tuple[str, int], places) -> np.ndarray:
    """Return what a change at each place does to the rows beside all else, (numbers, places, rows), of size one."""
    found = np.array(effects(less, *what, places)) * less.weight
    found -= (found @ less.basis) @ less.basis.T
    size = np.sqrt(np.einsum("mpt,mpt->mp", found, found))[..., None]
    return np.where(size > 1e-4 * math.sqrt(found.shape[-1]), found / np.maximum(size, 1e-300), 0.0)


def both(less: Response, kinds, dates, one, two) -> np.ndarray:
    """Return what two changes of these kinds and directions take off half the squares, (p, q), at their dates."""
    r = less.left * less.weight  # the directions are beside all else
    (a, p), (b, q) = one.shape[:2], two.shape[:2]
    M, g = np.zeros((p, q, a + b, a + b)), np.zeros((p, q, a + b))
    M[..., :a, :a] = np.einsum("apt,bpt->pab", one, one)[:, None]
    M[..., a:, a:] = np.einsum("aqt,bqt->qab", two, two)
    cross = np.tensordot(one, two, axes=(2, 2))
    M[..., :a, a:], M[..., a:, :a] = cross.transpose(1, 3, 0, 2), cross.transpose(1, 3, 2, 0)
    g[..., :a], g[..., a:] = (one @ r).T[:, None], (two @ r).T
    M += RIDGE * np.eye(a + b)
    taken = 0.5 * np.einsum("pqm,pqm->pq", g, np.linalg.solve(M, g[..., None])[..., 0])
    if kinds[0] == kinds[1]:  # what is another for a few samples is an outlier
        taken[dates[0][:, None] > dates[1] - APART] = 0.0
    return taken
