"""Where a response might change, and the odds that it does: by the scores of what is left of it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from ..models.filtering import filter_rows, linear_filter
from .noise_jumps import EDGE, LEAST
from .response import Response
from .response_record import delayed, huber, long_run, long_run_of

APART = 10  # samples between two changes
ENOUGH = 6  # samples after a change, at least, for each of its numbers: fewer may all be outliers
PLACES, NEAR = 64, 64  # at which a change is looked for, and about the likeliest of them
LONG = 8192  # samples from which on changes are dated by scores alone, and outliers are no question: fits take long
LIKELY = 10.0  # nats from the likeliest place within which others are looked at as closely
ROUND_OFF = 1e-9  # of what a change takes
KNOWN = 0.7  # of the size of what is left beside white noise, to which a level that is fitted anew must bring it
ENDS = 0.5  # log odds that the ends of a grid may add
LEVEL, GAIN = "level", "gain"
NUMBERS = {LEVEL: 1, GAIN: 2}  # of a change: a gain has the point about which it turns


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


def kinds(now: Response) -> list[tuple[str, int]]:
    """Return what may change in a response: its level, and the gain of each input."""
    return [(LEVEL, 0), *((GAIN, i) for i in range(len(now.b)))]


def effects(now: Response, kind: str, i: int, places) -> list[np.ndarray]:
    """Return what a change at each of some samples does to y per unit, whitened, (places, rows) each.

    A gain turns about a point that nobody knows: the second is what the level moves with it.
    """
    places, step = np.asarray(places)[:, None], np.ones((len(now.record.y), 1))
    if kind == LEVEL:
        return [later(now, step, places)]
    driven = now.drives[i] * (np.arange(len(step)) >= places)
    own = now.whitened(linear_filter([1.0], now.denominator, driven.T).T)
    return [own, later(now, linear_filter([1.0], now.denominator, step), places)]


def later(now: Response, response, places) -> np.ndarray:
    """Return what comes of the first sample, (T, 1), whitened, as it comes of each of the places (.., 1): shifted."""
    first, T = linear_filter(now.white, [1.0], response), len(response)
    return now.scaled(np.append(np.zeros(T), first)[T - places + now.needed])


def scanner(now: Response, kind: str, i: int, r) -> Callable[[np.ndarray], np.ndarray]:
    """Return what a change at places takes off half the squares of ``r``, (places,), beside all else, as a function.

    It is a response that begins there, `effects`: its product with a signal, for each place, is that signal filtered by
    it from the end of the record on.
    """
    if now.bridge is not None or now.mixing is not None:  # what comes of one place is not shifted to another
        return partial(one_by_one, now, kind, i, r)
    T, n, Q, F, A = len(now.used), len(now.rows), now.basis, now.white, np.ones(1)
    size, targets = np.zeros(T), np.zeros((1 + Q.shape[1], T))
    size[now.rows] = scale = now.weight / now.deviations
    ago = T - 1 - now.rows  # what is filtered from the end of the record on lies backwards, too
    targets[0, ago], targets[1:, ago] = scale * r, scale * Q.T
    if kind == GAIN:
        A = now.denominator
    steps, inside = np.convolve(A, [1.0, -1.0]), Q.T @ r
    step, power = filter_rows(F, steps, np.eye(1, T))[0], size * size
    of_step, squared = filter_rows(F, steps, targets), step * step
    of_input = driven_from(now, i, targets, power, step) if kind == GAIN else None

    def scanned(places) -> np.ndarray:
        d = of_step[:, T - 1 - places]
        free = np.array([squared[: T - p] @ power[p:] for p in places.tolist()]) - squares(d[1:])
        product = d[0] - inside @ d[1:]
        taken = 0.5 * share(product, free, n) * product
        if of_input:  # beside the level that moves with it
            own, own_squares, shared = of_input(places)
            own_free, own_product = own_squares - squares(own[1:]), own[0] - inside @ own[1:]
            shared = shared - np.einsum("ij,ij->j", own[1:], d[1:])
            part = share(shared, free, n)
            own_free, own_product = own_free - part * shared, own_product - part * product
            taken = taken + 0.5 * share(own_product, own_free, n) * own_product
        return taken

    return scanned


def squares(x) -> np.ndarray:
    """Return the sum of squares of each column."""
    return np.einsum("ij,ij->j", x, x)


def one_by_one(now: Response, kind: str, i: int, r, places) -> np.ndarray:
    """Return the same by what a change at each of the places does to each row."""
    Q, taken, own = now.basis, np.zeros(len(places)), np.zeros(0)
    for j, d in enumerate(reversed(effects(now, kind, i, places))):
        d = d * now.weight
        d -= (d @ Q) @ Q.T
        if j:
            d -= share(np.einsum("pt,pt->p", d, own), np.einsum("pt,pt->p", own, own), len(r))[:, None] * own
        product = d @ r
        taken += 0.5 * share(product, np.einsum("pt,pt->p", d, d), len(r)) * product
        own = d
    return taken


def driven_from(now: Response, i: int, targets, power, step) -> Callable:
    """Return the products of what an input does from places on with targets (m, T), itself, and steps from there.

    ``targets`` lie backwards, the last sample first.

    What it does from p on is y, what it does in all, less what goes on of all before p: some impulses at p, p + 1, ..
    through 1/A. ``power`` (T,) weighs squares.
    """
    T, F, A, x = len(now.used), now.white, now.denominator, now.drives[i]
    y, many = filter_rows(F, A, x[None])[0], max(len(F), len(A)) - 1
    before, weighted = np.arange(1, many + 1), (power * y)[::-1]
    impulse = filter_rows(np.ones(1), A, np.eye(1, T))[0]
    targets = np.concatenate([targets, weighted[None]])
    later = filter_rows(np.ones(1), A, targets)
    sums = (targets * y[::-1]).cumsum(axis=1)
    beside = filter_rows(F, np.convolve(A, [1.0, -1.0]), targets[-1:])[0]
    lasts = min(np.flatnonzero(abs(impulse) > 1e-20 * abs(impulse).max())[-1] + many + 1, T)
    impulses = np.array([delayed(impulse[:lasts], lag) for lag in range(many)]).reshape(many, lasts)
    windows = np.lib.stride_tricks.sliding_window_view(np.append(power, np.zeros(lasts)), lasts)

    def from_places(places):
        past = [np.where(places[:, None] >= before, one[places[:, None] - before], 0.0) for one in (y, x)]
        q = np.zeros((len(places), many))
        for lag in range(many):
            for coefficients, signal in ((A, past[0]), (-F, past[1])):
                rest = coefficients[lag + 1 :]
                q[:, lag] -= signal[:, : len(rest)] @ rest
        at = T - 1 - places
        ago = at[:, None] - np.arange(many)
        on, whole = np.where(ago >= 0, later[:, ago], 0.0), sums[:, at]
        products, own = whole[:-1] - np.einsum("pl,mpl->mp", q, on[:-1]), whole[-1]
        tails, weights = q @ impulses, windows[places]
        own = own - 2 * np.einsum("pl,pl->p", q, on[-1]) + np.einsum("pt,pt,pt->p", tails, tails, weights)
        return products, own, beside[at] - np.einsum("pt,pt->p", tails * step[:lasts], weights)

    return from_places


def part_of(now: Response, kind: str, i: int, at: int, r) -> tuple[np.ndarray, np.ndarray]:
    """Return the part of ``r`` (rows,) that a change takes, and what a unit of it does to the rows beside all else."""
    Q, part, own = now.basis, np.zeros(len(r)), np.zeros(0)
    for j, d in enumerate(reversed(effects(now, kind, i, [at]))):
        d = d[0] * now.weight
        d -= Q @ (Q.T @ d)
        if j:
            d -= share(d @ own, own @ own, len(d)) * own
        part, own = part + share(d @ r, d @ d, len(d)) * d, d
    return part, own


def share(product, free, rows: int):
    """Return products with directions as multiples of these, whose squares are ``free``; 0 of what is not free."""
    is_free = free > 1e-9 * rows
    return np.where(is_free, product / np.where(is_free, free, 1.0), 0.0)


class Look(NamedTuple):
    """What a change takes off half the squares at some places: of a coarse grid, and of what is near the likeliest.

    seen : the samples at which one may be
    left : (rows,) what it has to explain
    """

    seen: np.ndarray
    left: np.ndarray
    grid: np.ndarray
    taken: np.ndarray
    fine: np.ndarray
    finer: np.ndarray


def onsets_of(now: Response, kind: str, low: int, high: int) -> np.ndarray:
    """Return the samples from one to another at which a change may begin, each with effects of its own.

    A level that steps while nothing is seen is as well a step at the next sample that is. A gain is not: what it did to
    the plant meanwhile is seen afterwards. An onset may be no row: what whitens it was not measured.
    """
    every = np.arange(low, high + 1)
    return every if kind == GAIN else every[now.used[low : high + 1]]


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
    edge = min(LEAST, n // EDGE)  # what a plant begins with looks like a step
    low, high = int(rows[edge]), int(rows[n - min(edge, ENOUGH * NUMBERS[kind])])
    seen = onsets_of(now, kind, low, high)
    others = now.dates
    r = now.left * now.weight
    r = r - now.basis @ (now.basis.T @ r)
    grid = seen[np.linspace(0, len(seen) - 1, min(PLACES, len(seen))).astype(int)]
    if hint >= 0:
        about = int(np.searchsorted(seen, hint))
        grid = np.concatenate([grid, seen[max(about - NEAR // 4, 0) : about + NEAR // 4]])
    grid = apart(np.unique(grid), others, hint)
    if not len(grid):
        return None
    scanned = scanner(now, kind, i, r)
    taken = scanned(grid)
    best = int(np.argmax(taken))
    likely = np.flatnonzero(taken > taken[best] - LIKELY)
    looks = [between(seen, grid, *ends) for ends in ((best, best), (likely[0], likely[-1]))]
    fine = apart(np.unique(np.concatenate([*looks, grid[best : best + 1]])), others, hint)
    return Look(seen, r, grid, taken, fine, scanned(fine))


def place(now: Response, kind: str, i: int, hint: int = -1, least: float = -math.inf) -> Place | None:
    """Return the likeliest place of a change and the odds that there is one; None where those are below ``least``."""
    found = look_for(now, kind, i, hint)
    if found is None:
        return None
    (seen, r, grid, taken, fine, finer), n = found, len(now.rows)
    most = float(finer.max())
    tried, paid = math.log(2 + len(now.b)), NUMBERS[kind] * 0.5 * math.log(n)
    if not most > 0 or max(most, taken.max()) + ENDS - paid - tried < least:  # at most, with calm scores
        return None
    at = int(np.flatnonzero(finer >= (1 - ROUND_OFF) * most)[-1])  # of places without a row between them the last
    d, own = part_of(now, kind, i, int(fine[at]), r)
    calm = max(long_run(d * (r - d)) / max(float(np.mean(d**2)), 1e-300), 1.0)
    lone = 0.5 * float(r[int(np.argmax(abs(d)))] ** 2)  # what a shock of one sample would explain
    beside = (grid < fine[0]) | (grid > fine[-1])
    where = np.concatenate([grid[beside], fine])
    order = np.argsort(where)
    where, gain = where[order], np.concatenate([taken[beside], finer])[order] / calm
    width = np.gradient(np.searchsorted(seen, where).astype(float)) if len(where) > 1 else np.ones(1)
    weight = width * np.exp(gain - gain.max())
    total = np.cumsum(weight) / weight.sum()
    first, middle, last = (int(where[min(int(np.searchsorted(total, q)), len(where) - 1)]) for q in (0.025, 0.5, 0.975))
    whole = float(gain.max()) + math.log(weight.sum() / len(seen)) - paid
    odds = whole
    if kind == GAIN:  # what the level moves with it is no evidence that the gain did
        odds = min(odds, float(0.5 * share(own @ r, own @ own, n) * (own @ r)) / calm - 0.5 * math.log(n))
    slow, odds = odds - tried, min(odds, (float(finer[at]) - lone) / calm) - tried
    return Place(int(fine[at]), (first, last), odds, float(finer[at]), calm, whole - tried, slow, middle)


def between(seen, grid, first: int, last: int) -> np.ndarray:
    """Return `NEAR` of the samples seen from one place of a grid before two of them to one after."""
    a, b = grid[max(first - 1, 0)], grid[min(last + 1, len(grid) - 1)]
    found = seen[(seen >= a) & (seen <= b)]
    return found[:: max(len(found) // NEAR, 1)]


def apart(places, others, own: int = -1) -> np.ndarray:
    """Return the places that are not beside another change: what is left there is what its date is wrong by.

    ``own`` : the place of a change that is fitted beside them
    """
    return places[np.all(abs(places[:, None] - others) >= APART, axis=1) | (places == own)]


def lacking(now: Response, part: str, j: int) -> Response:
    """Return a response without a change, all else as it is beside it: what counts how much as well."""
    less = now.without(part, j)
    less.cache["weight"] = now.weight
    return less


def located(now: Response, part: str, j: int) -> Place | None:
    """Return where a change of a response is, beside all else of it, and its odds."""
    kind, i = (LEVEL, 0) if part == "levels" else (GAIN, now.gains[j][0])
    less = lacking(now, part, j)
    return place(less, kind, i, now.levels[j] if kind == LEVEL else now.gains[j][1])


def standing(now: Response, part: str, j: int) -> Place | None:
    """Return the same with no more than is lost where all else is fitted without the change."""
    found = located(now, part, j)
    if found is None:
        return None
    other = now.without(part, j).refined()
    lost = max(other.loss() - now.loss(), 0.0)
    least = found.whole - max(found.taken - lost, 0.0) / found.calm
    stays = beside_shock(other, found.at) - now.loss()  # by few samples: their scores have no long run
    slow = min(found.slow, least)
    return found._replace(log_odds=min(slow, stays), slow=slow)


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
