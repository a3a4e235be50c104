"""Whether what changed was a gain or how fast a plant answers: each is tried in the place of the other."""

from __future__ import annotations

import math

from .change_effects import GAIN, SPEED, kinds
from .change_places import Place, place
from .change_search import CHANGES, with_change
from .response import Response

EVEN = math.log(20.0)  # log odds below which two readings of one change cannot be told apart
CLOSE = 10.0  # nats that one takes off the squares less than the other, from which on it is not tried


def other_reading(now: Response, kind: str, j: int, where: Place) -> tuple[str, int, Response] | None:
    """Return kind, input and response of what might as well have changed instead; None where nothing might.

    By Schwarz's criterion: a gain has a number more than a speed, the level about which it turns.
    """
    less, best = now.without(CHANGES[kind], j).refined(), None
    ways = [way for way in kinds(now) if way[0] == GAIN] if kind == SPEED else [(SPEED, 0)]
    for way in ways:
        found = place(less, *way, hint=where.at)
        if found is None or found.taken < where.taken - CLOSE:
            continue
        other = with_change(less, *way, found.at).settled(1)
        if best is None or other.criterion < best[2].criterion:
            best = (*way, other)
    return best if best and 0.5 * (best[2].criterion - now.criterion) < EVEN else None
