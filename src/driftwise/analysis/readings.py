"""Whether what changed was a gain or how fast a plant answers: each is tried in the place of the other."""

from __future__ import annotations

import math

from .change_effects import GAIN, SPEED, kinds, speed_of
from .change_places import Place, place
from .change_search import CHANGES, with_change
from .response import Response
from .response_covariance import covariance, without_end

EVEN = math.log(20.0)  # log odds below which two readings of one change cannot be told apart
CLOSE = 10.0  # nats that one takes off the squares less than the other, from which on it is not tried


def other_reading(now: Response, kind: str, j: int, where: Place) -> tuple[str, int, Response] | None:
    """Return kind, input and response of what might as well have changed instead; None where nothing might.

    By Schwarz's criterion: a gain has a number more than a speed, the level about which it turns. Where the end of an
    answer is not seen, a slower plant is one that answers less: there the other is always fitted, at the same date, and
    that number is free, since nobody knows at which input such a plant rests.
    """
    less, best = without(now, kind, j), None
    is_endless = endless(now)
    ways = [way for way in kinds(now) if way[0] == GAIN] if kind == SPEED else [(SPEED, speed_of(now))]
    for way in ways:
        is_one = is_endless[way[1] if kind == SPEED else now.gains[j][0]]
        at = where.at if is_one else dated(less, way, where)
        if at is None:
            continue
        other = with_change(less, *way, at).settled(1)
        odds = 0.5 * (other.criterion - now.criterion)
        if is_one:
            odds = by_fit(odds, other, now) / where.calm
        if best is None or odds < best[0]:
            best = (odds, *way, other)
    return best[1:] if best and best[0] < EVEN else None


def dated(less: Response, way: tuple[str, int], where: Place) -> int | None:
    """Return when the other would have changed; None where it explains too little to be tried."""
    found = place(less, *way, hint=where.at)
    return None if found is None or found.taken < where.taken - CLOSE else found.at


def by_fit(odds: float, other: Response, now: Response) -> float:
    """Return log odds without what the numbers of either cost."""
    return odds - 0.5 * (len(other.theta) + len(other.f) - len(now.theta) - len(now.f)) * math.log(now.measured)


def all_gains(now: Response, j: int, where: Place) -> bool:
    """Whether the gains of all inputs might as well have changed as the j-th speed: where no answer is seen to end."""
    if len(now.b) < 2 or not all(endless(now)):
        return False
    other = without(now, SPEED, j)
    for i in range(len(now.b)):
        other = other.with_gain(i, where.at)
    other = other.settled(1)
    return by_fit(0.5 * (other.criterion - now.criterion), other, now) / where.calm < EVEN


def without(now: Response, kind: str, j: int) -> Response:
    """Return the response without the j-th change of a kind, fitted again: worked out once."""
    key = f"without {kind} {j}"
    if key not in now.cache:
        now.cache[key] = now.without(CHANGES[kind], j).refined()
    return now.cache[key]


def endless(now: Response) -> list[bool]:
    """Say of each input whether its answer may never end: worked out once."""
    if "endless" not in now.cache:
        now.cache["endless"] = without_end(now, covariance(now))
    return now.cache["endless"]
