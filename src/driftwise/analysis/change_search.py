"""What a response asks for, one thing after the other: changes, bends, ramps of a gain, lines of the spectrum."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from .change_effects import GAIN, LEVEL, SLOWEST, SPEED, has_others, ways
from .change_places import LONG, NEAR, Place, colourless, levelled, located, place, standing, worth
from .noise_jumps import LEAST, PIECES, SURE, noisy
from .onsets import abrupt
from .pairs import joined
from .response import Response
from .response_orders import cleaned, respond, stripped
from .response_record import HUBER, local_size
from .stretches import stretch
from .walks import walk

HOPE = 3.0  # log odds from which a change is tried
STEPS = 4  # by which the frequency of a line is sharpened
MOVES = 3  # times that dates are moved at the end
CHANGES = {LEVEL: "levels", GAIN: "gains", SPEED: "speeds"}  # the part of a response that has those of a kind
EVEN = 6.0  # of the criterion: of changes no further apart, the surest is taken


def searched(now: Response) -> Response:
    """Return a response with all that it asks for; where something was added, its order is chosen again."""
    for _ in range(2):
        before, now = now.parts, noisy(joined(at_once(changed(noisy(now)))))
        if now.parts == before:
            break
        if (
            len(now.b)
            and (again := respond(stripped(now), is_again=True)) is not None
            and again.criterion < now.criterion
        ):
            now = again
    return pruned(of_modes(now))


def changed(now: Response) -> Response:
    """Return a response with the changes, bends and lines that it asks for, one by one, the likeliest first.

    One that is sure but not worth its numbers is kept where the next one is: a noise that has taken two things for its
    colour keeps it until both are there.
    """
    best, is_worse = now, False
    for _ in range(PIECES):
        sure = [pair for pair in alternatives(now) if pair is not None and pair[0] > SURE]
        least = min((one.criterion for _, one in sure), default=math.inf)
        was_worse, is_worse = is_worse, least >= now.criterion
        if least > now.criterion + (0.0 if was_worse else 2 * math.log(len(now.rows))):
            break  # they have gone astray
        _, now = max((pair for pair in sure if pair[1].criterion < least + EVEN), key=lambda pair: pair[0])
        best = min(best, now, key=lambda one: one.criterion)
    return best


def at_once(now: Response) -> Response:
    """Return a response whose gains jump where they were taken to move along a line, if a jump is likelier.

    A line has most of a jump and a number less: it is found first, and hides what is left. As a walk does (`walk`), it
    pays here what the numbers of a jump pay.
    """
    for i in now.ramps:
        less = now.without("ramps", now.ramps.index(i)).settled(1)
        hint = place(less, GAIN, i, least=HOPE)
        found = tried(less, GAIN, i, hint.at) if hint else None
        where = standing(found[1], "gains", len(found[1].gains) - 1) if found else None
        line = 0.5 * (less.criterion - now.criterion - math.log(len(now.rows)))
        if found and where and where.log_odds > SURE and where.whole > line:
            now = found[1]
    return now


def of_modes(now: Response) -> Response:
    """Return a response all modes of which become faster or slower, or the slowest alone, whichever is likelier."""
    if not now.speeds or not has_others(now):
        return now
    other = replace(now, is_alone=not now.is_alone, cache=now.of_noise()).settled(1)
    return min(now, other, key=lambda one: one.criterion)


def pruned(now: Response) -> Response:
    """Return a response without changes that the others explain, the least sure first; each where it is likeliest.

    Where dates move, they are looked at again: of two that have come to the same one explains the other.
    """
    for _ in range(MOVES):
        now, found = without_weak(now)
        before = now.parts
        for part, j, where in found:
            now = dated(now, part, j, where.at)
        if now.parts == before:
            break
    return now


def without_weak(now: Response) -> tuple[Response, list[tuple[str, int, Place]]]:
    """Return a response without changes that are not sure beside the others, and the places of those that are."""
    while True:
        found: list[tuple[str, int, Place]] = []
        changes = [(part, j) for part in CHANGES.values() for j in range(len(getattr(now, part)))]
        for part, j in changes:
            where = standing(now, part, j)
            if where is None:
                now = now.without(part, j).settled(1)
                break
            found.append((part, j, where))
        else:
            weakest = min(found, key=lambda one: one[2].log_odds, default=None)
            if weakest is None or weakest[2].log_odds > SURE:
                return now, found
            now = now.without(*weakest[:2]).settled(1)


def redated(now: Response, part: str, j: int) -> Response:
    """Return a response whose changes about one of them are where they are likeliest beside it."""
    for other, k in near(now, part, j):
        if where := located(now, other, k):
            now = dated(now, other, k, where.at)
    return now


def near(now: Response, part: str, j: int) -> Iterator[tuple[str, int]]:
    """Yield the changes that are less than `NEAR` samples from one of them."""
    yield from (one for one in beside(now, date(now, part, j)) if one != (part, j))


def beside(now: Response, at: int) -> Iterator[tuple[str, int]]:
    """Yield the changes that are less than `NEAR` samples from a sample; none of a long record."""
    if len(now.used) >= LONG:
        return
    for part in CHANGES.values():
        for k in range(len(getattr(now, part))):
            if abs(date(now, part, k) - at) < NEAR:
                yield part, k


def date(now: Response, part: str, j: int) -> int:
    """Return the first sample of a change."""
    return now.gains[j][1] if part == "gains" else getattr(now, part)[j]


def dated(now: Response, part: str, j: int, at: int) -> Response:
    """Return a response with one of its changes at another sample, where it is likelier there."""
    dates: list[Any] = list(getattr(now, part))
    new = (dates[j][0], at) if part == "gains" else at
    if dates[j] == new:
        return now
    dates[j] = new
    others: dict[str, Any] = {part: tuple(dates)}
    moved = replace(now, cache={}, **others).settled(1)
    return moved if moved.criterion < now.criterion else now


def alternatives(now: Response):
    """Yield (log odds, response) of what might be added to a response."""
    bare = colourless(now)
    for kind, i in ways(now):
        seen: list[int] = []
        # a noise that was learnt beside a jump has taken it for its colour; beside none, what is slow looks like one
        anew = [(levelled(now), SURE)] if kind == LEVEL else []
        for look, least in ((now, HOPE - SURE), (bare, SURE), *anew):
            found = place(look, kind, i, least=least)
            if found is None or found.log_odds < least or any(abs(found.at - at) < LEAST for at in seen):
                continue
            result = tried(look, kind, i, found.at)
            if result is None and look is now and kind == SPEED:  # the colour has what a plant did that was faster
                result = tried(bare, kind, i, found.at)
            if result is not None and result[0] > SURE:
                seen.append(found.at)
                yield result
    yield from (tried(now, LEVEL, 0, at, size) for at, size in abrupt(now))
    yield from passing(now, bare)
    for i in range(len(now.b)):
        if i not in now.bent and len(now.record.shapes[i]):
            yield weighed(now.with_bend(i), "bends", len(now.record.shapes[i]))
        if i not in now.ramps:
            yield weighed(now.with_ramp(i), "ramps", 1)
    for w in lines(bare):
        looks = [look.with_columns(wave(w, len(now.used))) for look in (now, bare)]
        if max(worth(look, "columns", 2) for look in looks) > HOPE - SURE:
            other = swinging(now, looks, w)
            yield 0.5 * (now.criterion - other.criterion) - math.log(len(now.rows)), other


def passing(*looks: Response) -> Iterator[tuple[float, Response]]:
    """Yield (log odds, response) of two steps that show only together.

    They are looked for under the noise of each look, of which one may have taken them for its colour. The odds are
    those of the less sure one, or of both beside a gain that walks, which looks like levels that come and go.
    """
    seen = set()
    for look in looks if len(looks[0].used) < LONG else ():
        if (ends := stretch(look)) is None or ends in seen:
            continue
        seen.add(ends)
        j = len(look.levels)
        first = look.with_all_near(ends[0]).with_level(ends[0]).settled(1)
        second = tried(first, LEVEL, 0, ends[1])
        if second is None or (where := located(second[1], "levels", j)) is None:
            continue
        both = dated(second[1], "levels", j, where.at)
        down, up = (located(both, "levels", k) for k in (j, j + 1))
        if down is None or up is None:
            continue
        calm = max(down.calm, up.calm)
        neither = both.without("levels", j + 1).without("levels", j).refined()
        paid = sum(one.taken / one.calm - one.whole for one in (down, up))
        together = (neither.loss() - both.loss()) / calm - paid
        walked = max((walk(neither, i, calm) for i in range(len(neither.b))), default=-math.inf)
        yield min(down.log_odds, up.log_odds, together - walked), both


def tried(now: Response, kind: str, i: int, at: int, size: float = 0.0):
    """Return the log odds of a change, once all else is fitted with it, and that response."""
    found: Place | None = None
    is_long = len(now.used) >= LONG
    about = [at, *(date(now, *one) for one in beside(now, at))]
    now = now.with_all_near(min(about), max(about))  # what lasts but from one change to the next looks like outliers
    for _ in range(2):
        part = CHANGES[kind]
        j = len(getattr(now, part))
        other = with_change(now, kind, i, at, size).settled(1)
        found = located(other, part, j)
        if (found is None or found.log_odds < SURE) and (again := redated(other, part, j)) is not other:
            other = again
            found = located(other, part, j)
        if found is None or found.log_odds < HOPE - SURE:
            return None
        if found.at == at:
            break
        at, size = found.at, float(other.more[other.placed()[part].stop - 1])
    less = other.without_outliers() if is_long else cleaned(other)  # what stands out beside the change is none of it
    if less is not other:
        other = less.settled(1) if is_long else less
        found = located(other, part, j)
    return (found.log_odds, other) if found else None


def with_change(now: Response, kind: str, i: int, at: int, size: float = 0.0) -> Response:
    """Return a response with one change more, not fitted yet."""
    if kind == GAIN:
        return now.with_gain(i, at, size)
    return now.with_level(at, size) if kind == LEVEL else now.with_speed(at, size, i == SLOWEST)


def weighed(other: Response, part: str, many: int):
    """Return the log odds of the last ``many`` numbers of a part, fitted, and the response; None without a hope."""
    if max(worth(look, part, many) for look in (other, colourless(other))) < HOPE - SURE:
        return None
    other = other.settled(1)
    return worth(other, part, many), other


def swinging(now: Response, looks, w: float) -> Response:
    """Return a response beside a line of about that frequency (radians a sample); sharpened, where it is worth it.

    It begins with that line beside the noise of ``now``, which may have taken it for its colour, and beside white.
    """
    T, before = len(now.used), now.columns
    other = min((look.settled(1) for look in looks), key=lambda one: one.criterion)
    for _ in range(STEPS if other.criterion < now.criterion else 0):
        at = other.placed()["columns"]
        size, (sine, cosine) = other.more[at.stop - 2 : at.stop], other.columns[-2:]
        by_w = np.arange(T) * (size[0] * cosine - size[1] * sine)  # what the line moves by with its frequency
        w += float(np.clip(other.with_columns(by_w[None]).refined(1).more[at.stop], -np.pi / T, np.pi / T))
        again = replace(other, columns=np.vstack([before, wave(w, T)]), cache={}).settled(1)
        if not again.criterion < other.criterion - 0.1:
            break
        other = again
    return other


def wave(w: float, T: int) -> np.ndarray:
    """Return sine and cosine, (2, T)."""
    return np.array([np.sin(w * np.arange(T)), np.cos(w * np.arange(T))])


def lines(bare: Response) -> list[float]:
    """Return the frequencies of the lines of a spectrum that stand out most of what is left, radians a sample."""
    if len(bare.columns) > 4:
        return []
    T, r = len(bare.used), bare.left
    x, size = np.zeros(T), HUBER * local_size(r, bare.record.floor / bare.deviations)
    x[bare.rows] = np.clip(r, -size, size)
    most = float(abs(x).max(initial=0.0))
    if not 0.0 < most < math.inf:
        return []
    power = abs(np.fft.rfft(x / most, 4 * T)) ** 2
    k = np.arange(len(power))
    usable = (k >= 6) & (k < 4 * T // 6)
    found: list[int] = []
    for scaled in (power, power * np.minimum(k, T) ** 2):
        scaled = np.where(usable, scaled, 0.0)
        at = int(np.argmax(scaled))
        if scaled[at] > 0 and not any(abs(at - other) < 6 for other in found):
            found.append(at)
    return [2 * np.pi * at / (4 * T) for at in found]
