"""How loud what a response leaves is after an input has moved: what it has wrong of the plant shows there."""

from __future__ import annotations

import numpy as np

from .change_places import LEVEL, NEAR, Place, part_of
from .response import Response
from .response_record import HUBER

AFTER = 10  # samples after a move in which it is louder
MOVES = 10  # moves by which that is told, at least: those as large as half of it, or the largest


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
    T, v, near = len(now.used), np.ones(len(now.used)), np.full(len(now.used), np.nan)
    size = abs(now.left)
    near[now.rows] = np.minimum(size, HUBER) * (2 * size - np.minimum(size, HUBER))
    later = np.append(near, np.full(AFTER, np.nan))
    for u, delay in zip(now.record.u.T, now.nk):
        moved = abs(np.diff(u, prepend=u[:1]))
        first = max(at - delay - AFTER, 0)
        inside = moved[first : max(at - delay + 1, first)]
        if not inside.max(initial=0.0) > 0:
            continue
        start = first + int(np.argmax(inside))
        others = np.where(abs(np.arange(T) - start) < NEAR, 0.0, moved)
        least = min(moved[start] / 2, np.sort(others)[-MOVES:].min())
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
