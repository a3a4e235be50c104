"""What a response asks for, one thing after the other: changes, bends, ramps of a gain, lines of the spectrum."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from .change_places import GAIN, LEVEL, Place, colourless, located, place, worth
from .noise_jumps import LEAST, PIECES, SURE, noisy
from .response import Response
from .response_orders import respond, stripped
from .response_record import HUBER, local_size

HOPE = 3.0  # log odds from which a change is tried
REACH = 5  # samples by which a level before and after is compared


def searched(now: Response) -> Response:
    """Return a response with all that it asks for; where something was added, its order is chosen again."""
    for _ in range(2):
        before, now = now.parts, noisy(changed(noisy(now)))
        if now.parts == before:
            break
        if len(now.b) and (again := respond(stripped(now))) is not None and again.criterion < now.criterion:
            now = again
    return pruned(now)


def changed(now: Response) -> Response:
    """Return a response with the changes, bends and lines that it asks for, one after the other, the surest first."""
    for _ in range(PIECES):
        tried = [other for other in alternatives(now) if other is not None]
        if not tried:
            break
        odds, other = max(tried, key=lambda pair: pair[0])
        if odds <= SURE:
            break
        now = other
    return now


def pruned(now: Response) -> Response:
    """Return a response without changes that the others explain."""
    for part in ("levels", "gains"):
        j = 0
        while j < len(getattr(now, part)):
            found = located(now, part, j)
            if found is None or found.log_odds <= SURE:
                now = now.without(part, j).settled(1)
                continue
            dates: list[Any] = list(getattr(now, part))
            new = found.at if part == "levels" else (dates[j][0], found.at)
            if dates[j] != new:
                dates[j] = new
                dated: dict[str, Any] = {part: tuple(dates)}
                moved = replace(now, cache={}, **dated).settled(1)
                now = moved if moved.loss() < now.loss() else now
            j += 1
    return now


def alternatives(now: Response):
    """Yield (log odds, response) of what might be added to a response."""
    bare = colourless(now)
    for kind, i in [(LEVEL, 0), *((GAIN, i) for i in range(len(now.b)))]:
        seen: list[int] = []
        for look in (now, bare):  # a noise that was learnt beside a jump has taken it for its colour
            found = place(look, kind, i, look.left)
            if found is None or found.log_odds < HOPE - SURE or any(abs(found.at - at) < LEAST for at in seen):
                continue
            result = tried(look, kind, i, found.at)
            if result is not None and result[0] > SURE:
                seen.append(found.at)
                yield result
    if (step := abrupt(now)) is not None:
        at, size = step
        yield tried(now, LEVEL, 0, at, size)
    for i in range(len(now.b)):
        if i not in now.bent and len(now.record.shapes[i]):
            yield weighed(now.with_bend(i), "bends", len(now.record.shapes[i]))
        if i not in now.ramps:
            yield weighed(now.with_ramp(i), "ramps", 1)
    for line in lines(now):
        other = now.with_columns(line).settled(1)
        yield 0.5 * (now.criterion - other.criterion) - math.log(len(now.rows)), other


def tried(now: Response, kind: str, i: int, at: int, size: float = 0.0):
    """Return the log odds of a change, once all else is fitted with it, and that response."""
    found: Place | None = None
    now = now.with_all_near(at)
    for _ in range(2):
        other = (now.with_level(at, size) if kind == LEVEL else now.with_gain(i, at, size)).settled(1)
        part, j = ("levels", len(now.levels)) if kind == LEVEL else ("gains", len(now.gains))
        found = located(other, part, j)
        if found is None:
            return None
        if found.at == at:
            break
        at, size = found.at, float(other.more[other.placed()[part].stop - 1])
    if found and (less := other.without_outliers()) is not other:  # what stands out beside the change is none of it
        other = less.settled(1)
        found = located(other, part, j)
    return (found.log_odds, other) if found else None


def weighed(other: Response, part: str, many: int):
    """Return the log odds of the last ``many`` numbers of a part, fitted, and the response; None without a hope."""
    if max(worth(look, part, many) for look in (other, colourless(other))) < HOPE - SURE:
        return None
    other = other.settled(1)
    return worth(other, part, many), other


def abrupt(now: Response) -> tuple[int, float] | None:
    """Return where the level of what is left steps most, and by how much."""
    seen = np.flatnonzero(np.isfinite(now.record.y))
    seen = seen[seen >= now.rows[0]] if len(now.rows) else seen[:0]
    if len(seen) < 2 * LEAST + REACH:
        return None
    left = now.record.y[seen] - now.mean[seen]
    middles = np.median(np.lib.stride_tricks.sliding_window_view(left, REACH), axis=1)
    steps = middles[REACH:] - middles[:-REACH]
    steps[: LEAST - REACH] = steps[len(steps) - LEAST + REACH :] = 0.0
    at = int(np.argmax(abs(steps)))
    about = np.arange(at, at + 2 * REACH)  # of those samples, that of the largest single step
    at = int(about[1 + np.argmax(np.diff(left[about]) * np.sign(steps[at]))])
    return int(seen[at]), float(steps[np.argmax(abs(steps))])


def lines(now: Response) -> list[np.ndarray]:
    """Return sines and cosines, (2, T) each, of the lines of a spectrum that stand out most of what is left."""
    if len(now.columns) > 4:
        return []
    T, bare = len(now.used), colourless(now)
    x = np.zeros(T)
    r = bare.left
    size = HUBER * local_size(r)
    x[bare.rows] = np.clip(r, -size, size)
    power = abs(np.fft.rfft(x, 4 * T)) ** 2
    k = np.arange(len(power))
    usable = (k >= 6) & (k < 4 * T // 6)
    found: list[tuple[int, np.ndarray]] = []
    t = np.arange(T)
    for scaled in (power, power * np.minimum(k, T) ** 2):
        scaled = np.where(usable, scaled, 0.0)
        at = int(np.argmax(scaled))
        if scaled[at] > 0 and not any(abs(at - other) < 6 for other, _ in found):
            around = 2 * np.pi * (at + np.linspace(-2, 2, 41)) / (4 * T)
            rows = bare.rows
            w = float(around[int(np.argmax(abs(np.exp(1j * np.outer(around, rows)) @ x[rows])))])
            found.append((at, np.array([np.sin(w * t), np.cos(w * t)])))
    return [line for _, line in found]
