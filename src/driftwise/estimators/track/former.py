"""Rows and tables of tracks as they were before one of the members went by legs: what was learnt goes on.

Members that are none any more are left out. Those that are keep their state; legs begin from the turn that stays. Later
rows had no pace: what was typical of the time between plots is taken for it. Tables had no column for what is
unforeseen: their forecasts gave it nothing. Rows did not keep the plot that was called wild: none was. Nor what the
target may do: that begins with the next plot; and members of constant velocity kept an acceleration of 0. Nor by how
many plots the noise is known: by all.
"""

from __future__ import annotations

import numpy as np

from . import bank, circle, legs

LINEAR, KEPT_LINEAR = 13, (*range(10), 12)  # members there were, and those that stay
CIRCLES, KEPT_CIRCLE = 2, 1
POLES, KEPT_POLES = 5, (0, 2, 4)
NUMBERS, LINE = 10, (0, 1, 3, 4, 6, 9)  # of a coordinate of a linear member there were; those of constant velocity
CURVE = (*LINE, 2, 5, 7, 8)


def members(C: int) -> int:
    """Return how many members there were."""
    return LINEAR + (CIRCLES if C == 2 else 0) + POLES


def sizes(C: int) -> tuple[int, ...]:
    """Return how many numbers a row had before each of what is above: legs, a pace, what was wild, courses, known."""
    last = bank.row_at(C).courses + (NUMBERS - len(LINE)) * bank.LINES * C
    kept = last - 1 - C
    return size(C), kept - 1, kept, last, bank.row_size(C) - 1


def size(C: int) -> int:
    """Return how many numbers a row had before one went by legs."""
    circular = CIRCLES * bank.circle_size(C) if C == 2 else 0
    return _weights(C) + members(C) + LINEAR * NUMBERS * C + circular + POLES * bank.pole_size(C)


def rows(C: int, found: np.ndarray) -> np.ndarray:
    """Return rows of states, (.., numbers), with today's members; those of any other size as they are."""
    if found.ndim and found.shape[-1] == size(C):
        found = _of_today(C, found)
    if found.ndim and found.shape[-1] == sizes(C)[1]:
        found = np.insert(found, bank.PACE, found[..., bank.PERIOD], axis=-1)
    if found.ndim and found.shape[-1] == sizes(C)[2]:
        each = bank.EACH - 1  # of a coordinate
        places = [bank.REFUSED, *(bank.REFUSED + each * c + bank.ASIDE for c in range(C))]
        found = np.insert(found, places, 0.0, axis=-1)
    if found.ndim and found.shape[-1] == sizes(C)[3]:
        found = _with_courses(C, found)
    if found.ndim and found.shape[-1] == sizes(C)[4]:
        found = np.concatenate([found, found[..., bank.SEEN : bank.SEEN + 1]], axis=-1)
    return found


def _with_courses(C: int, found: np.ndarray) -> np.ndarray:
    """Return rows with what the target may do, which begins with the next plot."""
    first = int(bank.row_at(C).linear)
    head, linear, rest = np.split(found, [first, first + bank.KALMAN * NUMBERS * C], axis=-1)
    members = linear.reshape(*found.shape[:-1], bank.KALMAN, C, NUMBERS)
    parts = [members[..., : bank.LINES, :, LINE], members[..., bank.LINES :, :, CURVE]]
    parts = [part.reshape(*found.shape[:-1], -1) for part in parts]
    return np.concatenate([head, *parts, rest, np.zeros((*found.shape[:-1], bank.courses_size(C)))], axis=-1)


def _weights(C: int) -> int:
    """Return where the weights stood: a row had no pace, and no plot that was called wild."""
    return bank.row_at(C).weights - 2 - C


def _of_today(C: int, found: np.ndarray) -> np.ndarray:
    """Return rows with today's members."""
    ends = np.cumsum([_weights(C), members(C), LINEAR * NUMBERS * C, size(C)])
    head, weights, linear, rest = np.split(found, ends[:3], axis=-1)
    last = rest.shape[-1] - POLES * bank.pole_size(C)
    weights = _chosen(weights, C, weights[..., LINEAR + KEPT_CIRCLE : LINEAR + KEPT_CIRCLE + 1])
    parts = [head, weights - weights.max(axis=-1, keepdims=True), _some(linear, LINEAR, KEPT_LINEAR)]
    if C == 2:
        turn = _some(rest[..., :last], CIRCLES, (KEPT_CIRCLE,))
        parts += [turn, _legs(turn)]
    return np.concatenate([*parts, _some(rest[..., last:], POLES, KEPT_POLES)], axis=-1)


def table(C: int, found: np.ndarray) -> np.ndarray:
    """Return tables of traces, (.., columns), with today's columns: one for each member, and what is unforeseen."""
    first, added = bank.sample_at(C).shares + bank.TAILS, bank.sample_at(C).unforeseen
    if found.ndim < 2 or found.shape[-1] not in (first + members(C), added):
        return found
    nothing = np.zeros((*found.shape[:-1], bank.columns(C) - added))
    if found.shape[-1] == added:
        return np.concatenate([found, nothing], axis=-1)
    weights = _chosen(found[..., first:], C, np.zeros((*found.shape[:-1], 1)))
    total = weights.sum(axis=-1, keepdims=True)
    return np.concatenate([found[..., :first], weights / np.where(total > 0.0, total, 1.0), nothing], axis=-1)


def _chosen(weights: np.ndarray, C: int, of_legs: np.ndarray) -> np.ndarray:
    """Return the weights of today's members among those there were."""
    turning = [LINEAR + KEPT_CIRCLE] if C == 2 else []
    poles = [members(C) - POLES + k for k in KEPT_POLES]
    return np.concatenate(
        [weights[..., [*KEPT_LINEAR, *turning]], *([of_legs] if C == 2 else []), weights[..., poles]], axis=-1
    )


def _some(numbers: np.ndarray, count: int, kept: tuple[int, ...]) -> np.ndarray:
    """Return what some of so many members keep."""
    each = numbers.reshape(*numbers.shape[:-1], count, -1)[..., kept, :]
    return each.reshape(*numbers.shape[:-1], -1)


def _legs(turn: np.ndarray) -> np.ndarray:
    """Return legs of which any may have begun, where a member that turns has position and velocity."""
    each = np.zeros((*turn.shape[:-1], bank.LEG, bank.LEGS))
    P = turn[..., circle.P : bank.CIRCULAR]
    variance = lambda a, b: 0.5 * (P[..., circle.index(a, b)] + P[..., circle.index(a + 2, b + 2)])  # noqa: E731
    is_begun = P[..., 0] > 0.0
    each[..., 0, :] = np.where(is_begun[..., None], bank.LEG_SHARES, 0.0)
    each[..., 1:5, :] = turn[..., :4, None]
    for k, number in ((legs.PP, variance(0, 0)), (legs.RE, variance(0, 1)), (legs.VV, variance(1, 1))):
        each[..., k // bank.LEGS, :] = number[..., None]
    return np.concatenate([each.reshape(*turn.shape[:-1], -1), turn[..., bank.CIRCULAR :]], axis=-1)
