"""How loud what a response leaves is after an input has moved: what it has wrong of the plant shows there."""

from __future__ import annotations

import math

import numpy as np

from .change_effects import GAIN, LEVEL, SPEED, effects, part_of, share, speed_of
from .change_places import NEAR, Place, lacking
from .response import Response
from .response_record import HUBER

AFTER = 10  # samples after a move in which it is louder
MOVES = 10  # moves by which that is told, at least: those as large as half of it, or the largest
FIRST, MISSED = 3, 1.75  # samples after a move, and variance of them, to that of all else, from which moves are missed
HELD = 10  # samples between two moves, on average, of an input that moves from time to time


def beside_moves(now: Response, j: int, where: Place) -> Place:
    """Return the place of a level's step with the odds that it has beside what other moves of inputs leave.

    A plant that is no response, as of friction, is missed by most where an input moves, and to a noise that nearly
    integrates each such miss is a step. Evidence is divided by the variance that is left after other moves as large.
    """
    own = part_of(now.without("levels", j), LEVEL, 0, where.at, now.left)[1] ** 2
    loud = float(own @ loudness(now, where.at)) / max(float(own.sum()), 1e-300)
    if not loud > where.calm:
        return where
    paid = where.taken / where.calm - where.whole
    odds, slow = ((one + paid) * where.calm / loud - paid for one in (where.log_odds, where.slow))
    return where._replace(log_odds=odds, slow=slow, calm=loud)


def loudness(now: Response, at: int) -> np.ndarray:
    """Return the variance of what is left at the rows, (rows,), that moves just before ``at`` let expect; one or more.

    It is twice Huber's loss there, as evidence is counted.
    """
    T, v = len(now.used), np.ones(len(now.used))
    later = np.append(squares(now), np.full(AFTER, np.nan))
    for i, delay in enumerate(now.nk):
        size = moved(now, i)
        first = max(at - delay - AFTER, 0)
        inside = size[first : max(at - delay + 1, first)]
        if not inside.max(initial=0.0) > 0:
            continue
        start = first + int(np.argmax(inside))
        others = np.where(abs(np.arange(T) - start) < NEAR, 0.0, size)
        least = min(size[start] / 2, np.sort(others)[-MOVES:].min())
        found = np.flatnonzero(others >= max(least, 1e-300))
        found = found[found + delay < T]
        if len(found) < MOVES // 2:
            continue
        looks = later[found[:, None] + delay + np.arange(AFTER)]
        seen = np.isfinite(looks)
        loud = np.sum(looks, axis=0, where=seen) / np.maximum(seen.sum(axis=0), 1)
        inside = v[start + delay : start + delay + AFTER]
        inside[:] = np.maximum(inside, loud[: len(inside)])
    return v[now.rows]


def squares(now: Response) -> np.ndarray:
    """Return twice Huber's loss at each sample, (T,), NaN where none was measured."""
    found, size = np.full(len(now.used), np.nan), abs(now.left)
    found[now.rows] = np.minimum(size, HUBER) * (2 * size - np.minimum(size, HUBER))
    return found


def by_moves(now: Response, j: int, where: Place) -> Place:
    """Return the place of a gain's step with the odds that it has where each move of its input is one observation.

    A plant that is no response is missed by some other part of each move, and a gain that is another for a few moves
    explains these. So where moves are missed, the sums of scores from one move to the next are compared with each other
    (Liang and Zeger, 1986; divided by what is left of their leverage, Bell and McCaffrey, 2002), and the evidence is
    Student's, of as many as there are.
    """
    i = now.gains[j][0]
    if not are_missed(now, i):
        return where
    return _by_moves(now, lacking(now, "gains", j), GAIN, i, i, where)


def speed_by_moves(now: Response, j: int, where: Place) -> Place:
    """Return the same of a plant that becomes faster or slower, by the moves of inputs of which some are missed."""
    for i in range(len(now.b)):
        if are_missed(now, i):
            where = _by_moves(now, now.without("speeds", j).refined(), SPEED, speed_of(now), i, where)
    return where


def _by_moves(now: Response, less: Response, kind: str, what: int, i: int, where: Place) -> Place:
    """Return the place of a change that ``less`` is without, counted by moves of input i.

    A few moves after a change say little of how moves are missed: all of the record do, beside the change.
    """
    r = less.left * less.weight
    r = r - less.basis @ (less.basis.T @ r)
    taken, own = part_of(less, kind, what, where.at, r)
    r = r - taken + own * share(own @ r, own @ own, len(r))  # the level that moves with a gain has scores of its own
    after = np.searchsorted(np.flatnonzero(moved(now, i)) + now.nk[i], now.rows, side="right")
    free, score = (np.bincount(after, own * x) for x in (own, r))
    part = free / max(float(free.sum()), 1e-300)
    apart = (score - part * score.sum()) ** 2 / np.maximum(1 - part, 1e-9)
    every = effects(now, kind, what, [0])[0][0] * now.weight
    power, missed = (np.bincount(after, every * x) for x in (every, now.left * now.weight))
    whole = max(float(power.sum()), 1e-300)
    loud = max(float(missed @ missed) / whole, 1.0)
    t2 = score.sum() ** 2 / max(apart.sum(), loud * free.sum(), 1e-300)
    freedom = max(whole**2 / max(float(power @ power), 1e-300) - 1, 1e-9)
    most = 0.5 * (freedom + 1) * math.log1p(t2 / freedom) - (where.taken / where.calm - where.whole)
    return where._replace(log_odds=min(where.log_odds, most), slow=min(where.slow, most))


def are_missed(now: Response, i: int) -> bool:
    """Whether an input moves from time to time, and the first samples after large moves are louder than all others."""
    T, v, size = len(now.used), squares(now), moved(now, i)
    if not MOVES // 2 <= np.count_nonzero(size) <= T // HELD:
        return False
    large = np.flatnonzero(size >= max(min(size.max() / 2, np.sort(size)[-MOVES:].min()), 1e-300))
    first = large[:, None] + now.nk[i] + np.arange(FIRST)
    is_seen, is_first = np.isfinite(v), np.isin(np.arange(T), first)
    after, others = v[is_seen & is_first], v[is_seen & ~is_first]
    if len(after) < FIRST * MOVES // 2 or not len(others):
        return False
    return float(after.mean()) > MISSED * float(others.mean())


def moved(now: Response, i: int) -> np.ndarray:
    """Return by how much an input moves at each sample, (T,)."""
    return abs(np.diff(now.record.u[:, i], prepend=now.record.u[:1, i]))
