"""Stamps that several rows share, as they show too few digits: to the minute, of a logger that writes every 15 s."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

SOME = 0.05  # of the rows, that have the stamp of the one before
AS_OFTEN = 0.1  # as the others, at least, that rows of one stamp differ from the row before: else they came twice
APART = 0.25  # of the squares of moves from row to row, that those from stamp to stamp have where things share stamps
WHOLE = 0.02  # by which rows to a stamp may be off a whole number
EVEN, WINDOW = 0.8, 4  # share of so many stamps in a row that hold as many rows as most do
MOST = 0.05  # of the stamps, that may be left out


class Coarse(NamedTuple):
    """Stamps come every ``tick`` s, rows every ``step`` s; the first row came ``lead`` s after its stamp."""

    tick: float
    step: float
    lead: float = 0.0

    def spread(self, stamps, stamp: float = -math.inf, time: float = -math.inf) -> np.ndarray:
        """Return when the rows of stamps (T,) came, each a step after the row before as far as its stamp allows.

        ``stamp`` and ``time`` are those of the row before. Rows that come late keep their stamps.

        >>> Coarse(60.0, 25.0).spread([0.0, 0, 0, 60, 60, 180]).tolist()
        [0.0, 25.0, 50.0, 75.0, 100.0, 180.0]
        """
        found = np.array(stamps, float)
        if math.isinf(time) and len(found):
            time = float(found[0]) + self.lead - self.step
        for k, now in enumerate(found.tolist()):
            if now >= stamp:
                end, before = now + self.tick, time
                time = max(now, before + self.step)
                if time >= end:
                    time = 0.5 * (max(now, before) + end)
                stamp, found[k] = now, time
        return found


def coarse(stamps, tick: float, values=None) -> Coarse | None:
    """Return how rows share their stamps (T,), multiples of a ``tick``; None where they do not, or came twice.

    Rows of several things are not meant, nor such as are there twice: that the ``values`` (T, k) say.

    >>> coarse(60.0 * (np.arange(200) // 4), 60.0)
    Coarse(tick=60.0, step=15.0, lead=0.0)
    """
    steps = np.diff(stamps)
    if not tick > 0 or np.mean(steps == 0) <= SOME or (values is not None and not _differ(values, steps == 0)):
        return None
    first = np.flatnonzero(np.concatenate(([True], steps != 0)))
    many = np.diff(np.append(first, len(stamps)))  # rows to each stamp
    if values is not None and _are_several(values, many):
        return None
    follows = np.isclose(np.diff(stamps[first]), tick)
    whole = many[1:-1][follows[1:]]  # stamps that began and ended
    if not len(whole):
        return None
    step = tick / float(many.max())
    if _is_even(many[1:-1]) and np.mean(follows) >= 1 - MOST:
        rows = float(np.mean(whole))
        is_whole = abs(rows - round(rows)) <= WHOLE * rows
        step = tick / round(rows) if is_whole else _roundest(tick / rows, tick / len(stamps))
        return Coarse(tick, step, float(max(tick - many[0] * step, 0.0)) if follows[0] else 0.0)
    return Coarse(tick, step)


def _roundest(x: float, within: float) -> float:
    """Return the number of fewest digits that is near enough.

    >>> _roundest(54.983, 0.1)
    55.0
    """
    return next((v for n in range(1, 10) if abs((v := float(f"{x:.{n}g}")) - x) <= within), x)


def _differ(values, again) -> bool:
    """Say whether rows of one stamp differ from the row before about as often as others do."""
    x = np.nan_to_num(np.asarray(values, float), nan=math.inf)
    moves = np.any(x[1:] != x[:-1], axis=1)
    return bool(np.mean(moves[again]) > AS_OFTEN * np.mean(moves[~again]))


def _are_several(values, many) -> bool:
    """Say whether rows at the same place of each stamp belong together, and not those of a stamp."""
    m = int(many.max())
    if m < 2 or np.mean(many == m) < EVEN:
        return False
    for x in np.asarray(values, float).T:
        near, far = np.nanmean(np.diff(x) ** 2), np.nanmean((x[m:] - x[:-m]) ** 2)
        if near > np.nanvar(x) and far < APART * near:
            return True
    return False


def _is_even(many) -> bool:
    """Say whether stamps in a row hold about as many rows, as they do where these come at one pace."""
    if len(many) < WINDOW:
        return bool(np.ptp(many) <= 1) if len(many) else False
    sums = np.convolve(many, np.ones(WINDOW), "valid")
    return bool(np.mean(abs(sums - np.median(sums)) <= 1) >= EVEN)
