"""Whether rows go on where their clock goes back."""

from __future__ import annotations

import numpy as np

PAST = 4000  # rows, an hour by the second, by which a clock may be set back while rows go on
MOVES = 100  # rows whose moves are what a move from row to row is held against


def goes_on(stamps, values, k: int, dt: float) -> bool:
    """Whether row k + 1 goes on from row k of values (T, k), though its stamp is one of those before.

    A clock that is set back gives stamps again that it gave before, to other values, and from row to row these move
    no further than they did. A row that came late has a stamp that no row had yet; one that came twice has the values
    of the first; one of another recording has values somewhere else. Bad at: a column of white noise, which tells
    nothing, so that another recording of the same is taken for one that goes on.

    >>> stamps, level = np.r_[0:50, 30:80.0], np.sin(0.1 * np.arange(100.0))[:, None]
    >>> goes_on(stamps, level, 49, 1.0), goes_on(stamps, np.sin(0.1 * stamps)[:, None], 49, 1.0)
    (True, False)
    """
    first = max(k + 1 - PAST, 0)
    same = first + int(np.argmin(abs(stamps[first : k + 1] - stamps[k + 1])))
    if abs(stamps[same] - stamps[k + 1]) > 0.5 * dt:
        return False
    old, new = values[k], values[k + 1]
    seen = np.isfinite(old) & np.isfinite(new)
    came_again = np.array_equal(new, values[same], equal_nan=True) and not np.array_equal(new, old, equal_nan=True)
    if came_again or not seen.any():
        return False
    moves = np.nan_to_num(abs(np.diff(values[max(k - MOVES, first) : k + 1], axis=0)))
    most = moves.max(axis=0, initial=0.0)
    return bool((abs(new - old)[seen] <= most[seen]).all())
