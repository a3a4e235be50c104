"""What a change of a response does to what is left of it, wherever it comes: its level, a gain, how fast it answers."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from ..models.filtering import filter_rows, linear_filter
from .response import Response
from .response_record import delayed
from .speeds import is_slowest, passed

LEVEL, GAIN, SPEED = "level", "gain", "speed"
EVERY, SLOWEST = 0, 1  # of a speed, in the place of the input of a gain: all modes, or the slowest alone
NUMBERS = {LEVEL: 1, GAIN: 2, SPEED: 1}  # of a change: a gain has the point about which it turns


def kinds(now: Response) -> list[tuple[str, int]]:
    """Return what may change in a response: its level, and the gain of each input."""
    return [(LEVEL, 0), *((GAIN, i) for i in range(len(now.b)))]


def ways(now: Response) -> list[tuple[str, int]]:
    """Return the same with how fast it answers, all gains as they are: all modes of it, or the slowest alone."""
    if not len(now.a) or not len(now.b):
        return kinds(now)
    if now.speeds:
        return [*kinds(now), (SPEED, speed_of(now))]
    return [*kinds(now), (SPEED, EVERY), *([(SPEED, SLOWEST)] if has_others(now) else [])]


def has_others(now: Response) -> bool:
    """Whether a response has modes beside its slowest, or the slowest pair."""
    return not is_slowest(abs(np.roots(now.denominator))).all()


def speed_of(now: Response) -> int:
    """Return which speed of a response changes: of all modes, or of the slowest alone."""
    return SLOWEST if now.is_alone else EVERY


def effects(now: Response, kind: str, i: int, places) -> list[np.ndarray]:
    """Return what a change at each of some samples does to y per unit, whitened, (places, rows) each.

    A gain turns about a point that nobody knows: the second is what the level moves with it. The unit of a speed is the
    logarithm of its time constants.
    """
    places, step = np.asarray(places)[:, None], np.ones((len(now.record.y), 1))
    if kind == LEVEL:
        return [later(now, step, places)]
    since = np.arange(len(step)) >= places
    if kind == SPEED:
        return [now.whitened(passed(now.stretches, now.faster(i == SLOWEST) * since, is_held=False))]
    own = now.whitened(now.answered(now.drives[i] * since))
    if now.speeds:  # what comes of one place is not shifted to another
        return [own, now.whitened(now.answered(since.astype(float)))]
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
    is_one_filter = now.bridge is None and now.mixing is None and (kind == LEVEL or not now.speeds)
    if not is_one_filter:  # what comes of one place is not shifted to another
        return partial(one_by_one, now, kind, i, r)
    T, n, Q, F, A = len(now.used), len(now.rows), now.basis, now.white, np.ones(1)
    size, targets = np.zeros(T), np.zeros((1 + Q.shape[1], T))
    size[now.rows] = scale = now.weight / now.deviations
    ago = T - 1 - now.rows  # what is filtered from the end of the record on lies backwards, too
    targets[0, ago], targets[1:, ago] = scale * r, scale * Q.T
    if kind != LEVEL:
        A = now.denominator
    steps, inside = np.convolve(A, [1.0, -1.0]), Q.T @ r
    step, power = filter_rows(F, steps, np.eye(1, T))[0], size * size
    of_step, squared = filter_rows(F, steps, targets), step * step
    of_input = None
    if kind != LEVEL:
        of_input = driven_from(now, now.faster(i == SLOWEST) if kind == SPEED else now.drives[i], targets, power, step)

    def scanned(places) -> np.ndarray:
        if of_input and kind == SPEED:
            return taken_by([of_input(places)], inside, n)
        free = np.array([squared[: T - p] @ power[p:] for p in places.tolist()])
        level = of_step[:, T - 1 - places], free, None
        return taken_by([level, of_input(places)] if of_input else [level], inside, n)

    return scanned


def one_by_one(now: Response, kind: str, i: int, r, places) -> np.ndarray:
    """Return the same by what a change at each of the places does to each row."""
    Q, moves, last = now.basis, [], None
    targets = np.column_stack([r, Q])
    for d in reversed(effects(now, kind, i, places)):
        d *= now.weight
        moves.append(((d @ targets).T, squares(d.T), None if last is None else np.einsum("pt,pt->p", d, last)))
        last = d
    return taken_by(moves, Q.T @ r, len(r))


def taken_by(moves, inside, rows: int) -> np.ndarray:
    """Return what changes take off half the squares of what is left, (places,), beside all else.

    ``moves`` are what a change does, the level that goes with a gain first: products of each with what is left and with
    a basis (1 + P, places) of all else, squares (places,), and products with the one before. ``inside`` (P,) is what is
    left in that basis.
    """
    taken, was = np.zeros(len(moves[0][1])), None
    for products, whole, shared in moves:
        product, free = products[0] - inside @ products[1:], whole - squares(products[1:])
        if was:
            before, its_product, its_free = was
            shared = shared - np.einsum("ij,ij->j", products[1:], before[1:])
            part = share(shared, its_free, rows)
            product, free = product - part * its_product, free - part * shared
        taken = taken + 0.5 * share(product, free, rows) * product
        was = products, product, free
    return taken


def squares(x) -> np.ndarray:
    """Return the sum of squares of each column."""
    return np.einsum("ij,ij->j", x, x)


def driven_from(now: Response, x, targets, power, step) -> Callable:
    """Return the products of what a signal does from places on with targets (m, T), itself, and steps from there.

    ``targets`` lie backwards, the last sample first; x (T,) is what the signal is before 1/A.

    What it does from p on is y, what it does in all, less what goes on of all before p: some impulses at p, p + 1, ..
    through 1/A. ``power`` (T,) weighs squares.
    """
    T, F, A = len(now.used), now.white, now.denominator
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
