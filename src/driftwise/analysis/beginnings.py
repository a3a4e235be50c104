"""What a response of a record is begun beside: nothing, or what an order of it is surely without."""

from __future__ import annotations

import math

import numpy as np

from .change_effects import LEVEL, kinds
from .change_places import colourless, look_for, place, sized, under_each_noise, worth
from .change_search import lines, wave
from .noise_jumps import LEAST, SURE
from .onsets import abrupt
from .response import Response
from .response_mean import dies_out
from .response_orders import begun_at, cleaned, lags, likeliest, linear, orders, plainest, respond, without_outliers
from .response_record import Record
from .seasonal_level import beside_seasons

STARTS = 2  # changes beside which a response is begun
LATE, CREEPS = 4, 0.2  # samples that an input is waited for; part of its variance that it moves by in one, at most
SLOW = 8.0  # time constants in a record, at most, of a mode that may be but a step beside an input that walks


def beginnings(record: Record, seasons: tuple[int, ...] = ()) -> list[Response]:
    """Return the response of a record, and one beside what an order of it is surely without, where likelier.

    All are beside those of the ``seasons``, in samples, with which the response is likelier.
    A step that is not there yet is taken for an answer of the plant: by poles too slow, delays too long, one order
    more. Once it is taken for that, nothing is left of it to be found. A wrong one, though, hides the right one.
    """
    if (plain := without_outliers(plainest(record))) is None:
        return []
    if not len(plain.b):
        alone = respond(plain)
        beside = [respond(one) for one in beside_seasons(plain, alone, seasons)] if alone is not None else []
        return [one for one in [alone, *beside] if one is not None]
    if not (found := orders(plain)):
        return []
    bare = cleaned(likeliest(found))
    for one in beside_seasons(plain, bare, seasons):
        if (more := orders(one)) and (best := cleaned(likeliest(more))).criterion < bare.criterion:
            plain, found, bare = one, more, best
    begun = [some for one in (*beside_changes(plain, found), *beside_lines(plain, found)) if (some := orders(one))]
    likely = sorted(((cleaned(likeliest(some)), some) for some in begun), key=lambda pair: pair[0].dated_criterion)
    taken = [(bare, found), *(pair for pair in likely[:1] if pair[0].dated_criterion < bare.criterion)]
    return [one for best, some in taken for one in (best, *quicker(best, some))]


def quicker(bare: Response, found: list[Response]) -> list[Response]:
    """Return the likeliest of some orders without a slow mode, where the response has one: to be searched as well.

    Of an input that walks or grows, what an answer as long as the record makes is slow, and falls where it may: steps
    were taken for it, and beside it none of them stands out alone.
    """
    quick = [one for one in found if not is_slow(one)] if is_slow(bare) else []
    return [cleaned(likeliest(quick))] if quick else []


def prompt(plain: Response, found: list[Response]) -> list[Response]:
    """Return a response that answers at once, where an order waits for an input that walks.

    What such an input was long ago falls where it may, as a level does.
    """
    waits = {i for one in found for i, late in enumerate(one.nk) if late >= LATE and creeps(one.moved(i))}
    if not waits:
        return []
    late = tuple(0 if i in waits else d for i, d in enumerate(min(found, key=lambda one: one.criterion).nk))
    return [linear(plain, [], late, lags(0)).settled(1)]


def creeps(x) -> bool:
    """Say whether a signal hardly moves from one sample to the next, for all that it moves."""
    return float(np.mean(np.diff(x) ** 2)) < CREEPS * float(np.var(x))


def is_slow(now: Response) -> bool:
    """Say whether a mode of a response takes more than a part of the record to die out."""
    return len(now.a) > 0 and not dies_out(now.a.tolist(), math.exp(-SLOW / len(now.used)))


def beside_changes(plain: Response, found: list[Response]) -> list[Response]:
    """Return ``plain`` beside each of the changes that some orders are surest of, and beside a step seen by its onset.

    They are looked for under each noise and under a white one: what a noise has taken for its colour is there alone.
    """
    looks = [look for one in (*found, *prompt(plain, found)) for look in under_each_noise(one)]
    places = [(place(look, kind, i, least=SURE), kind, i) for look in looks for kind, i in kinds(look)]
    sure = sorted((-where.log_odds, where.at, kind, i) for where, kind, i in places if where is not None)
    taken = list[tuple[int, str, int]]()
    for odds, at, kind, i in sure:
        if -odds > SURE and len(taken) < STARTS and is_apart(at, taken):
            taken.append((at, kind, i))
    steps = abrupt(min(found, key=lambda one: one.criterion))
    taken += [(at, LEVEL, 0) for at, _ in steps[:1] if is_apart(at, taken)]
    if plain.record.is_scattered:
        taken += [one for one in before_any(plain) if one not in taken]
    near = [plain.with_all_near(at) for at, _, _ in taken]
    return [one.with_level(at) if kind == LEVEL else one.with_gain(i, at) for one, (at, kind, i) in zip(near, taken)]


def before_any(plain: Response) -> list[tuple[int, str, int]]:
    """Return the changes beside which poles that are merely tried leave least: (sample, kind, input) of each.

    Where few samples follow each other every order that is fitted without a change may have taken it for its answer.
    """
    found = list[tuple[float, int, str, int]]()
    for look in begun_at(plain):
        bare = sized(look)
        n, squares = len(bare.rows), float(((bare.left * bare.weight) ** 2).sum())
        for kind, i in kinds(bare):
            if where := look_for(bare, kind, i):
                left = max(squares - 2 * float(where.finer.max()), 1e-12 * squares)
                found.append((n * (math.log(left) + 2 * math.log(float(bare.sigma[0]))), where.best, kind, i))
    taken = list[tuple[int, str, int]]()
    for _, at, kind, i in sorted(found):
        if len(taken) < STARTS and is_apart(at, taken):
            taken.append((at, kind, i))
    return taken


def is_apart(at: int, taken) -> bool:
    """Say whether a place is not about that of another change."""
    return all(abs(at - other) >= LEAST for other, _, _ in taken)


def beside_lines(plain: Response, found: list[Response]) -> list[Response]:
    """Return ``plain`` beside the line that one pole is surely without: the pairs of others may imitate it."""
    bare = colourless(next((one for one in found if len(one.a)), found[0]))
    beside = [bare.with_columns(wave(w, len(plain.used))) for w in lines(bare)]
    best = max(beside, key=lambda one: worth(one, "columns", 2), default=None)
    return [plain.with_columns(best.columns[-2:])] if best is not None and worth(best, "columns", 2) > SURE else []
