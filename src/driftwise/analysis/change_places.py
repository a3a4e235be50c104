"""Where a response might change, and the odds that it does: by the scores of what is left of it."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from .change_effects import GAIN, LEVEL, NUMBERS, SPEED, part_of, scanner, share
from .noise_jumps import EDGE, LEAST
from .response import Response
from .response_record import huber, long_run, long_run_of

APART = 10  # samples between two changes
ENOUGH = 6  # samples after a change, at least, for each of its numbers: fewer may all be outliers
PLACES, NEAR = 64, 64  # at which a change is looked for, and about the likeliest of them
LONG = 8192  # samples from which on changes are dated by scores alone, and outliers are no question: fits take long
LIKELY = 10.0  # nats from the likeliest place within which others are looked at as closely
ROUND_OFF = 1e-9  # of what a change takes
KNOWN = 0.7  # of the size of what is left beside white noise, to which a level that is fitted anew must bring it
SETTLES = 1.5, 3.0, 6.0, 12.0, 24.0, 48.0  # samples, of a level that begins elsewhere and comes back
ENDS = 0.5  # log odds that the ends of a grid may add


class Place(NamedTuple):
    """Where a change would be, as a sample, in which interval, and its log odds.

    taken, calm : what it takes off half the squares, and by how much such a sum is too large (the log odds count it)
    whole : the log odds that anything changed there: of a gain, with what the level moves beside it
    slow : the log odds against what is slower than a change; beside a shock of a sample they may be less
    middle : the sample before and after which it is as likely
    """

    at: int
    interval: tuple[int, int]
    log_odds: float
    taken: float
    calm: float
    whole: float
    slow: float
    middle: int


class Look(NamedTuple):
    """What a change takes off half the squares at some places: of a coarse grid, and of what is near the likeliest.

    seen : the samples at which one may be
    events : those of them at which the table says that something was done
    left : (rows,) what it has to explain
    """

    seen: np.ndarray
    events: np.ndarray
    left: np.ndarray
    grid: np.ndarray
    taken: np.ndarray
    fine: np.ndarray
    finer: np.ndarray

    @property
    def best(self) -> int:
        """The likeliest; of places without a row between them the last."""
        likely = self.finer + np.log(expected(self.fine, self.seen, self.events))
        return int(self.fine[np.flatnonzero(likely >= likely.max() - ROUND_OFF * self.finer.max())[-1]])


def onsets_of(now: Response, kind: str, low: int, high: int) -> np.ndarray:
    """Return the samples from one to another at which a change may begin, each with effects of its own.

    A level that steps while nothing is seen is as well a step at the next sample that is. A gain is not: what it did to
    the plant meanwhile is seen afterwards. An onset may be no row: what whitens it was not measured.
    """
    every = np.arange(low, high + 1)
    return every if kind != LEVEL else every[now.used[low : high + 1]]


def expected(places, seen, events) -> np.ndarray:
    """Return how much likelier a change is at each of some places, beforehand, than where nothing was done.

    That one of the ``events`` changed something is as likely as that something changed at any of the samples ``seen``.
    """
    return 1.0 + np.isin(places, events) * len(seen) / max(len(events), 1)


def next_seen(seen, samples) -> np.ndarray:
    """Return the first of those ``seen`` from each of some samples on, where one was before it, too."""
    at = np.searchsorted(seen, [one for one in samples if seen[0] < one <= seen[-1]])
    return seen[at.astype(int)]


def look_for(now: Response, kind: str, i: int, hint: int = -1) -> Look | None:
    """Return where a change might be; None where no place is left for one.

    Every sample near the ``hint`` is looked at, for a change whose onset says all leaves nothing to be seen between the
    places of a coarse look. Without a hint it is looked for once.
    """
    if hint >= 0:
        return _look_for(now, kind, i, hint)
    if (kind, i) not in now.cache:
        now.cache[kind, i] = _look_for(now, kind, i, hint)
    return now.cache[kind, i]


def _look_for(now: Response, kind: str, i: int, hint: int) -> Look | None:
    """Return the same, looked for anew."""
    rows, n = now.rows, len(now.rows)
    if n < 2 * LEAST + 1:
        return None
    edge = beginning(n)
    last = min(edge, ENOUGH * NUMBERS[kind])
    first = last if kind == LEVEL else edge
    if kind == SPEED:  # few moves say little of how fast a plant is
        first = last = n // EDGE
    low, high = int(rows[first]), int(rows[n - last])
    seen = onsets_of(now, kind, low, high)
    others = now.dates
    r = beside_all(now)
    grid = seen[np.linspace(0, len(seen) - 1, min(PLACES, len(seen))).astype(int)]
    if hint >= 0:
        about = int(np.searchsorted(seen, hint))
        grid = np.concatenate([grid, seen[max(about - NEAR // 4, 0) : about + NEAR // 4]])
    events = next_seen(seen, now.record.events)
    own = [hint, *events, *(now.speeds if kind == GAIN else (at for _, at in now.gains) if kind == SPEED else ())]
    grid = apart(np.unique([*grid, *(at for at in own if low <= at <= high)]), others, own)
    return looked(grid, seen, events, r, scanner(now, kind, i, r), others, own) if len(grid) else None


def looked(grid, seen, events, r, scanned, others, own) -> Look:
    """Return what a change takes at a grid of places, and near the likeliest of them."""
    taken = scanned(grid)
    odds = taken + np.log(expected(grid, seen, events))
    best = int(np.argmax(odds))
    likely = np.flatnonzero(odds > odds[best] - LIKELY)
    looks = [between(seen, grid, *ends) for ends in ((best, best), (likely[0], likely[-1]))]
    near = events[(events >= grid[likely[0]]) & (events <= grid[likely[-1]])]
    fine = apart(np.unique(np.concatenate([*looks, grid[best : best + 1], near])), others, own)
    return Look(seen, events, r, grid, taken, fine, scanned(fine))


def place(now: Response, kind: str, i: int, hint: int = -1, least: float = -math.inf) -> Place | None:
    """Return the likeliest place of a change and the odds that there is one; None where those are below ``least``."""
    found = look_for(now, kind, i, hint)
    if found is None:
        return None
    most, tried = float(found.finer.max()), math.log(2 + len(now.b))
    paid, ends = NUMBERS[kind] * 0.5 * math.log(len(now.rows)), ENDS + math.log1p(len(found.events) > 0)
    if not most > 0 or max(most, found.taken.max()) + ends - paid - tried < least:  # at most, with calm scores
        return None
    d, own = part_of(now, kind, i, found.best, found.left)
    return judged(found, kind, d, own, tried)


def judged(found: Look, kind: str, d, own, tried: float) -> Place:
    """Return the likeliest place of a look and its odds; ``d`` (rows,) is what the change takes there of what is left.

    ``own`` (rows,) is what a unit of it does beside the level that moves with it, ``tried`` what its odds pay for.
    """
    seen, events, r, grid, taken, fine, finer = found
    n, at = len(r), found.best
    paid = NUMBERS[kind] * 0.5 * math.log(n)
    most = float(finer[fine == at][0])
    calm = max(long_run(d * (r - d)) / max(float(np.mean(d**2)), 1e-300), 1.0)
    lone = 0.5 * float(r[int(np.argmax(abs(d)))] ** 2)  # what a shock of one sample would explain
    beside = (grid < fine[0]) | (grid > fine[-1])
    where = np.concatenate([grid[beside], fine])
    order = np.argsort(where)
    where, gain = where[order], np.concatenate([taken[beside], finer])[order] / calm
    width = np.gradient(np.searchsorted(seen, where).astype(float)) if len(where) > 1 else np.ones(1)
    width += expected(where, seen, events) - 1.0
    weight = width * np.exp(gain - gain.max())
    total = np.cumsum(weight) / weight.sum()
    first, middle, last = (int(where[min(int(np.searchsorted(total, q)), len(where) - 1)]) for q in (0.025, 0.5, 0.975))
    whole = float(gain.max()) + math.log(weight.sum() / len(seen)) - paid
    odds = whole
    if kind == GAIN:  # what the level moves with it is no evidence that the gain did
        odds = min(odds, float(0.5 * share(own @ r, own @ own, n) * (own @ r)) / calm - 0.5 * math.log(n))
    slow, odds = odds - tried, min(odds, (most - lone) / calm) - tried
    return Place(at, (first, last), odds, most, calm, whole - tried, slow, middle)


def beside_all(now: Response) -> np.ndarray:
    """Return what is left at the rows, weighed, and not explained by any number of the response, (rows,)."""
    r = now.left * now.weight
    return r - now.basis @ (now.basis.T @ r)


def between(seen, grid, first: int, last: int) -> np.ndarray:
    """Return `NEAR` of the samples seen from one place of a grid before two of them to one after."""
    a, b = grid[max(first - 1, 0)], grid[min(last + 1, len(grid) - 1)]
    found = seen[(seen >= a) & (seen <= b)]
    return found[:: max(len(found) // NEAR, 1)]


def apart(places, others, own=()) -> np.ndarray:
    """Return the places that are not beside another change: what is left there is what its date is wrong by.

    ``own`` : places that are looked at all the same: of a change that is fitted beside them, or that may come with one
    """
    return places[np.all(abs(places[:, None] - others) >= APART, axis=1) | np.isin(places, own)]


def lacking(now: Response, part: str, j: int) -> Response:
    """Return a response without a change, all else as it is beside it: what counts how much as well."""
    less = now.without(part, j)
    less.cache["weight"] = now.weight
    return less


def located(now: Response, part: str, j: int) -> Place | None:
    """Return where a change of a response is, beside all else of it, and its odds."""
    if part == "speeds":
        return located_speed(now, j)
    kind, i = (LEVEL, 0) if part == "levels" else (GAIN, now.gains[j][0])
    less = lacking(now, part, j)
    return place(less, kind, i, now.levels[j] if kind == LEVEL else now.gains[j][1])


def located_speed(now: Response, j: int) -> Place | None:
    """Return where a response becomes faster or slower, and the odds against one that does not, fitted anew.

    How fast a plant is moves it by no straight line: each date is tried as it is, the size of the change kept.
    """
    rows, n = now.rows, len(now.rows)
    if n < 2 * LEAST + 1:
        return None
    less = now.without("speeds", j).refined()
    less.cache["weight"] = now.weight
    edge, at, Q = n // EDGE, now.speeds[j], now.basis
    seen, r = np.arange(rows[edge], rows[n - edge] + 1), beside_all(less)

    def left(place: int) -> np.ndarray:
        speeds = (*now.speeds[:j], place, *now.speeds[j + 1 :])
        found = replace(now, speeds=speeds, cache=now.of_noise()).left * now.weight
        return found - Q @ (Q.T @ found)

    def scanned(places) -> np.ndarray:
        return 0.5 * (r @ r - np.array([one @ one for one in map(left, places.tolist())]))

    own = [at, *(since for _, since in now.gains)]
    grid = seen[np.linspace(0, len(seen) - 1, min(PLACES, len(seen))).astype(int)]
    grid = np.unique([*grid, *range(max(at - NEAR // 4, seen[0]), min(at + NEAR // 4, seen[-1] + 1))])
    grid = apart(grid, np.delete(now.dates, len(now.levels) + len(now.gains) + j), own)
    if not len(grid):
        return None
    events = next_seen(seen, now.record.events)
    found = looked(grid, seen, events, r, scanned, np.delete(now.dates, len(now.levels) + len(now.gains) + j), own)
    if not found.finer.max() > 0:
        return None
    d = r - left(found.best)
    return judged(found, SPEED, d, d, math.log(2 + len(now.b)))


def standing(now: Response, part: str, j: int) -> Place | None:
    """Return the same with no more than is lost where all else is fitted without the change."""
    found = located(now, part, j)
    if found is None:
        return None
    other = now.without(part, j).refined()
    lost = max(other.loss() - now.loss(), 0.0)
    least = found.whole - max(found.taken - lost, 0.0) / found.calm
    stays = beside_shock(other, found.at) - now.loss()  # by few samples: their scores have no long run
    if part == "levels" and found.at < early(now):
        stays = min(stays, beside_settling(now, j, other) / found.calm)
    slow = min(found.slow, least)
    return found._replace(log_odds=min(slow, stays), slow=slow)


def beginning(n: int) -> int:
    """Return in how many of n rows what a plant begins with looks like a step."""
    return min(LEAST, n // EDGE)


def early(now: Response) -> int:
    """Return the row before which that is so."""
    return int(now.rows[beginning(len(now.rows))])


def beside_settling(now: Response, j: int, other: Response) -> float:
    """Return the log odds of the j-th step of a level to a level that settles: which begins elsewhere, and comes back.

    ``other`` : the response without the step
    """
    t = np.maximum(np.arange(len(now.used)) - now.record.first, 0)
    ways = [other.with_columns(np.exp(-t / tau)[None]).refined() for tau in SETTLES]
    best = min(ways, key=lambda one: one.loss()).settled(1)
    return 0.5 * (best.criterion - now.criterion) - math.log(early(now))


def beside_shock(now: Response, at: int) -> float:
    """Return the loss of a response beside the shock that explains most: of its noise, or of a sample, about ``at``.

    A step beside a slow noise is nearly that; but it stays.
    """
    T, least = len(now.used), now.loss()
    for near in range(max(at - 1, 0), min(at + 2, T)):
        spike = np.eye(1, T, near)[0]
        for way in (np.where(now.rows == near, 1.0, 0.0), now.whitened(spike)):
            size = float(share(way @ now.left, way @ way, 1))
            least = min(least, huber(now.left - size * way))
    return least


def worth(now: Response, part: str, many: int) -> float:
    """Return the log odds of the last ``many`` numbers of a part beside all others, by the scores' own covariance."""
    last = len(now.a) + now.b.size + now.placed()[part].stop
    own = np.arange(last - many, last)
    J, size = now.jacobian()
    Q = np.linalg.qr(np.delete(J, own, axis=1))[0]
    d = J[:, own] - Q @ (Q.T @ J[:, own])
    U, value, _ = np.linalg.svd(d, full_matrices=False)
    U = U[:, value > 1e-2]
    if not U.shape[1]:
        return -math.inf
    r = now.left * now.weight
    r = r - Q @ (Q.T @ r)
    z = U.T @ (r + d @ (size[own] * now.theta[own]))
    spread = long_run_of(U * (r - U @ (U.T @ r))[:, None] * math.sqrt(len(r)))
    return 0.5 * float(z @ np.linalg.solve(spread, z)) - 0.5 * U.shape[1] * math.log(len(r)) - math.log(2 + len(now.b))


def colourless(now: Response) -> Response:
    """Return a response whose noise is white, of the size of what is left."""
    if not len(now.f):
        return now
    if "bare" not in now.cache:
        now.cache["bare"] = sized(replace(now, f=np.zeros(0), sigma=np.ones(len(now.used)), cache=now.of_mean()))
    return now.cache["bare"]


def under_each_noise(now: Response) -> tuple[Response, ...]:
    """Return a response, and the same under white noise where its own has a colour."""
    return (now, colourless(now)) if len(now.f) else (now,)


def levelled(now: Response) -> Response:
    """Return the same with its level fitted anew; as it is where that was known.

    Beside a noise that nearly integrates the level is known to nobody, and what it is wrong by counts as noise.
    """
    bare = colourless(now)
    if bare is now or "levelled" in now.cache:
        return now.cache.get("levelled", now)
    own, more = bare.placed()["columns"].start, bare.more.copy()
    more[own:] += np.linalg.lstsq(bare.beside[:, bare.rows].T, bare.unscaled, rcond=None)[0]
    cache = {name: value for name, value in now.of_mean().items() if name != "mean"}
    other = sized(replace(bare, more=more, sigma=np.ones(len(now.used)), cache=cache))
    now.cache["levelled"] = other if other.sigma[0] < KNOWN * bare.sigma[0] else bare
    return now.cache["levelled"]


def sized(bare: Response) -> Response:
    """Return a response beside white noise of deviation one with the size of what is left."""
    size = max(1.4826 * float(np.median(abs(bare.left))), bare.record.floor, 1e-300)
    return replace(bare, sigma=np.full(len(bare.used), size), cache=bare.of_mean())
