"""Changes of the columns of a table, whichever is the output: by little each, at one date, beside noise that is learnt.

Each column is a level, one of many noises (`together_noise`), and perhaps a step, or a stretch that goes again, at once
or when it has grown, of a size that nobody knows, and it may be louder or quieter meanwhile: what it says of each date
is the ratio of the likelihoods, over all noises, by itself or by what it does not follow the other columns in
(`together_evidence`). Of a change each column may take part or not; as likely beforehand is that one moves alone. It is
told where it is `SURE`. A column that changes `OFTEN` is one that is moved by somebody: nothing is told of it.

Bad at: sizes below the noise, changes within `SHORT` of a record, columns that only walk, noise that comes and goes;
columns that follow one that moved may be named beside it.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from .events import Event
from .together_evidence import STEADY, Evidence, blocks, evidence, loudness, moved, odds_of, unstuck
from .together_loudness import Loudness
from .together_noise import Shapes, shapes_of
from .together_white import scaled, shared, whitened

BLOCKS, LEAST = 64, 2  # in which a record is looked at; rows that each has at least
TAKES = math.log(0.5)  # log of the chance that a column takes part, and that it does not
LEVEL, NOISE, EACH = (math.log(share) for share in (0.5, 0.25, 0.25))  # that its level moves, its noise, both
SURE = math.log(100.0)  # log of the odds that a change has to have
SEVERAL = math.log(20.0)  # of those of several columns against one, that several are named
OUTSIDE = np.array([0.025, 0.975])  # shares of dates below and above an interval
NAMED = 0.9  # from which chance on a column is said to take part
OFTEN, MOST, PASSES = 3, 3, 8  # changes of a column from which on they are how it is run; that are told; looked for
SHARED = 1, 3  # of what other columns share, that a column may follow alone
MOST_COLUMNS = 16  # that are looked at
NEXT = 2  # blocks within which two changes are one
AROUND = 4  # blocks on either side of a change, that say between which levels it goes
LOST = 0.3  # of the values of a column that may be missing
RESTS = 0.98  # of the rows that a set point, or a switch, keeps its value
FINE = 1e-6  # of its size, that a column has to move by


@dataclass(frozen=True)
class Together:
    """A change of columns, which several may have in common.

    since, interval : its first row, and rows between which that lies, 95 %
    until : the row from which on it is gone; None where it stays
    moves : the size in each column whose level takes part
    odds : against none
    noises : the factor of the noise of each column that is louder, or quieter
    time, times, end : ``since``, ``interval`` and ``until`` on a clock
    events : what was done then
    """

    since: int
    interval: tuple[int, int]
    until: int | None
    moves: dict[str, float]
    odds: float
    noises: dict[str, float] = field(default_factory=dict)
    time: float = math.nan
    times: tuple[float, float] = (math.nan, math.nan)
    end: float | None = None
    events: tuple[Event, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """The columns that take part."""
        return tuple(dict.fromkeys((*self.moves, *self.noises)))

    def spans_any(self, times) -> bool:
        """Whether it may have begun at one of some times."""
        return any(self.times[0] <= time <= self.times[1] for time in times)


class Look(NamedTuple):
    """What is seen of a column: its level by itself, beside those before it, and beside all others; its loudness.

    Beside others it is seen in several ways, beside what these share and, last, beside each of them (`beside`).
    """

    level: Evidence
    former: tuple[Evidence, ...]
    others: tuple[Evidence, ...]
    noise: Evidence | None

    @property
    def likelier(self) -> Evidence:
        """The level by itself or beside all others, whichever makes it likelier: of a change of several columns."""
        return max((self.level, *self.others[-1:]), key=lambda way: way.none)

    def likeliest(self, k: int) -> Evidence:
        """The level as shape k of this column alone makes it likeliest."""
        return max((self.level, *self.others), key=lambda way: float(way.shapes[k]))

    @property
    def joint(self) -> np.ndarray:
        """Log odds that it takes part, by shape, where those before it may, too."""
        return _either(odds_of(self.level, *self.former), self.noise)

    @property
    def alone(self) -> np.ndarray:
        """Log odds that it moves, by shape, and no other does."""
        return _either(odds_of(self.level, *self.others), self.noise)


def _either(level, noise: Evidence | None):
    if noise is None:
        return level
    return np.logaddexp.reduce([LEVEL + level, NOISE + noise.odds, EACH + level + noise.odds], axis=0)


def together(columns: dict[str, np.ndarray], done: Iterable[int] = ()) -> list[Together]:
    """Return the changes of columns (T,), in order of time; NaN where missing. Something was ``done`` at some rows.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> moved = np.where(np.arange(600) < 350, 0.0, 1.0)
    >>> found = together({name: rng.normal(size=600) + 2 * moved for name in "abc"})
    >>> [sorted(one.moves) for one in found], abs(found[0].since - 350) < 10
    ([['a', 'b', 'c']], True)
    """
    T = max(map(len, columns.values()), default=0)
    usable = {name: x for name, x in columns.items() if is_usable(x)} if T >= LEAST * BLOCKS else {}
    usable = {name: unstuck(values) for name, values in list(usable.items())[:MOST_COLUMNS]}
    x = {name: blocks(values, BLOCKS) for name, values in usable.items()}
    x = {name: means for name, means in x.items() if np.ptp(means) > FINE * abs(means).max()}
    loud = {name: loudness(usable[name], BLOCKS) for name in x}
    chance = shapes_of(BLOCKS).expected([row * BLOCKS / T for row in done])
    found: list[Together] = []
    took = Counter[str]()
    for _ in range(PASSES):
        one = likeliest(looks(x, loud), T, chance) if x else None
        if one is None:
            break
        change, parts, shape, lasts = one
        if not any(abs(change.since - before.since) <= NEXT * T / BLOCKS for before in found):
            found.append(sharp(change, usable, lasts))
            took.update(change.names)
        for name, part in parts.items():
            x[name] = x[name] - part.share * part.size * shape
            before = loud[name]
            loud[name] = None if before is None else before.less(part.noise_share * part.louder * shape)
            if took[name] == OFTEN:
                del x[name]
    rare = [one for one in found if all(took[name] < OFTEN for name in one.names)]
    return sorted(sorted(rare, key=lambda one: -one.odds)[:MOST], key=lambda one: one.since)


def is_usable(x) -> bool:
    """Say whether a column is a signal of which enough is known, that moves by itself and does not only rest."""
    there = x[np.isfinite(x)]
    if len(there) < (1 - LOST) * len(x) or not np.ptp(there) > FINE * abs(there).max():
        return False
    return bool(np.mean(np.diff(there) == 0) < RESTS)


def looks(x: dict[str, np.ndarray], loud: dict[str, Loudness | None]) -> dict[str, Look]:
    """Return what is seen of each column, in blocks."""
    p, found = len(x), {}
    heard = {name: now for name in x if (now := loud[name]) is not None}
    noise = {}
    if heard:
        white = whitened(np.column_stack([now.blocks for now in heard.values()]))
        noise = {
            name: evidence(white, j, steady=STEADY, halves=now.halves) for j, (name, now) in enumerate(heard.items())
        }
    former, others = [tuple(range(j)) for j in range(p)], [(*range(j), *range(j + 1, p)) for j in range(p)]
    X, ways = with_shared(np.column_stack(list(x.values())), {*former, *others})
    white = whitened(X)
    for j, name in enumerate(x):
        by = {way: evidence(white, j, way) for way in {*ways[former[j]], *ways[others[j]]}}
        by_former, by_others = (tuple(by[way] for way in ways[group]) for group in (former[j], others[j]))
        found[name] = Look(evidence(white, j), by_former, by_others, noise.get(name))
    return found


Group = tuple[int, ...]  # places of columns


def with_shared(X, groups: Iterable[Group]) -> tuple[np.ndarray, dict[Group, tuple[Group, ...]]]:
    """Return columns (n, p) and behind them what groups share; and beside which of all these one is seen, by group.

    That is beside what its columns share, more or less of it, and beside all of them.
    """
    parts, p, ways, about = [X], X.shape[1], {}, scaled(X)[0]
    for group in groups:
        counts = [q for q in SHARED if q < len(group)]
        ways[group] = (*(tuple(range(p, p + q)) for q in counts), group) if group else ()
        if counts:
            parts.append(shared(about[:, group], counts[-1]))
            p += counts[-1]
    return np.column_stack(parts), ways


class Part(NamedTuple):
    """What a change does to a column: to its level and to its loudness, and how likely it is that it does."""

    size: float
    share: float
    louder: float
    noise_share: float


def likeliest(seen: dict[str, Look], T: int, expected) -> tuple[Together, dict[str, Part], np.ndarray, int] | None:
    """Return the surest change of T rows, what it does to each column, its shape (n,), and in how many blocks it comes.

    ``expected`` (shapes,) is the log of how likely each is beforehand. None where none is sure; no blocks where it
    grows from its beginning to its end.
    """
    shapes, p = shapes_of(BLOCKS), len(seen)
    joint = np.array([look.joint for look in seen.values()])
    alone = np.array([look.alone for look in seen.values()])
    several = _minus(np.logaddexp(TAKES, TAKES + joint).sum(axis=0), p * TAKES) - math.log1p(-(0.5**p))
    one = np.logaddexp.reduce(alone, axis=0) - math.log(p)
    chance = np.logaddexp(several, one) - math.log(2) + expected
    odds = total(chance)
    if odds < SURE:
        return None
    k = int(np.argmax(chance))
    parts = {name: part_of(look.likelier, look.noise, k) for name, look in seen.items()}
    moves = {name: part.size for name, part in parts.items() if part.share > NAMED}
    noises = {name: math.exp(part.louder / 2) for name, part in parts.items() if part.noise_share > NAMED}
    if several[k] - one[k] < SEVERAL or not (moves or noises):
        name = list(seen)[int(np.argmax(alone[:, k]))]
        part = part_of(seen[name].likeliest(k), seen[name].noise, k)
        moves = {name: part.size} if part.share > min(NAMED, part.noise_share) else {}
        noises = {name: math.exp(part.louder / 2)} if part.noise_share > min(NAMED, part.share) else {}
        parts = {name: part}
    elif len(moves) > 1:
        parts |= {name: parts[name]._replace(size=size_of(name, seen, moves, k)) for name in moves}
        moves = {name: parts[name].size for name in moves}
    change = Together(*dated(chance, k, shapes, T / BLOCKS), moves, math.exp(min(odds, 700.0)), noises)
    return change, parts, shapes.shape(k, BLOCKS), shapes.lasts(k, BLOCKS)


def size_of(name: str, seen: dict[str, Look], moves: Iterable[str], k: int) -> float:
    """Return by how much shape k moves a column, by itself or beside those that do not move, which it may follow."""
    level, still = seen[name].level, [seen[other].level.j for other in seen if other not in moves]
    ways = (level, evidence(level.white, level.j, still)) if still else (level,)
    return moved(max(ways, key=lambda way: float(way.shapes[k])), k)[0] * level.size


def part_of(level: Evidence, noise: Evidence | None, k: int) -> Part:
    """Return what shape k does to a column, each as likely as not."""
    by_level = float(level.odds[k])
    by_noise = -math.inf if noise is None else float(noise.odds[k])
    ways = np.array([0.0, LEVEL + by_level, NOISE + by_noise, EACH + by_level + by_noise])
    ways = np.exp(ways - total(ways))
    louder = 0.0 if noise is None else moved(noise, k)[0] * noise.size
    return Part(moved(level, k)[0] * level.size, float(ways[1] + ways[3]), louder, float(ways[2] + ways[3]))


def dated(log_chance, k: int, shapes: Shapes, rows: float) -> tuple[int, tuple[int, int], int | None]:
    """Return where shape k begins, between which rows that lies, and where it goes again; a block has some rows."""
    chance = np.exp(log_chance - total(log_chance))
    begins = np.cumsum(np.bincount(shapes.begin, chance, len(shapes.dates)))
    low, high = shapes.dates[np.searchsorted(begins, OUTSIDE)] + (-1, 1)
    stays = float(chance[shapes.end < 0].sum())
    until = round(rows * shapes.dates[shapes.end[k]]) if shapes.end[k] >= 0 and stays < OUTSIDE[0] else None
    return round(rows * shapes.dates[shapes.begin[k]]), (max(round(rows * low), 0), round(rows * high)), until


def sharp(change: Together, columns: dict[str, np.ndarray], lasts: int) -> Together:
    """Return a change that comes within some blocks with its dates by rows, where levels move.

    Of one that grows, in no number of blocks, the end alone.
    """
    moved_ones = [columns[name] for name in change.moves]
    if not moved_ones:
        return change
    since = _row(change.since, lasts, moved_ones) if lasts else change.since
    until = None if change.until is None else _row(change.until, max(lasts, 1), moved_ones)
    low, high = change.interval
    return replace(change, since=since, until=until, interval=(min(low, since), max(high, since)))


def _row(at: int, lasts: int, columns) -> int:
    """Return the row about ``at`` from which columns (T,) go from one level to another, at once or within blocks."""
    row = len(columns[0]) // BLOCKS
    first, last = max(at - 2 * row, 1), min(at + (lasts + 1) * row, len(columns[0]) - 1)
    rows = np.arange(first, last)
    ways = [np.clip((rows[:, None] - rows + 1) / within, 0.0, 1.0) for within in {1, lasts * row}]
    gained = [np.zeros(len(rows)) for _ in ways]
    for x in columns:
        sides = x[max(first - AROUND * row, 0) : first], x[last : last + AROUND * row]
        if not all(np.isfinite(side).any() for side in sides):
            continue
        before, later = (float(np.nanmean(side)) for side in sides)
        spread = float(np.nanvar(sides[0]) + np.nanvar(sides[1])) / 2 + (later - before) ** 2 / 100
        there, by = np.isfinite(x[first:last]), np.nan_to_num(x[first:last] - before)
        for gain, way in zip(gained, ways):
            gain += ((later - before) * (by @ way) - (later - before) ** 2 * (there @ way**2) / 2) / max(spread, 1e-300)
    best = max(gained, key=lambda gain: float(gain.max()))
    return int(rows[np.argmax(best)])


def total(log_odds) -> float:
    """Return the logarithm of a sum."""
    return float(np.logaddexp.reduce(log_odds))


def _minus(a, b):
    """Return log(exp(a) - exp(b))."""
    return a + np.log(np.maximum(-np.expm1(np.minimum(b - a, 0.0)), 1e-12))
