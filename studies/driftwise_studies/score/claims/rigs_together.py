"""Rigs of several columns that change together, and rigs that do not: what is told of their common changes.

Run: python -m driftwise_studies.score.claims.rigs_together [--records 25] [--seed 0]

"As who knows": the rigs of `common_dates`, on which somebody who is told every noise dates 22 faults of 25. "Own
noises": three to nine columns, 400 to 1500 rows, each with a noise of its own: white, of the first order, with heavy
tails, nearly integrated, a walk, beside something slow or that alone. "Shared": something slow besides that most
columns follow, some rows late; it walks, forgets, bends, swings or is a line. "Days": hours of two to six weeks with a
day in most columns. "Driven": columns that answer to an input of which there is no column, and which steps many times.
Sensors are rounded, stick, have outliers or are louder for a while. A fault moves half of the columns, at least two, by
half to five deviations of what is quick in them, within 1 to 60 samples and up to five samples late, and stays, or goes
again after 15 to 40 % of the record. "Alone": the same as own noises, of one column.

Told is a fault of which a change begins within sixty samples of it; "in the interval" counts how many of these
dates are, "columns" how many of those that are named moved that way, "beside" changes that are none of a fault's, and
not of the noise of a sensor that is louder from then on. "Steady": the same rigs without a fault.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import NamedTuple

import numpy as np
from scipy.signal import lfilter

from driftwise.analysis.together import Together, together

from . import common_dates
from .answering import coloured
from .command import show

KINDS = KNOWN, OWN, SHARED, DAYS, DRIVEN, ALONE = "as who knows", "own noises", "shared", "days", "driven", "alone"
NEAR = 60
NOISES = ("white", "coloured", "both", "nearly", "walk", "heavy", "slow"), (0.2, 0.25, 0.25, 0.07, 0.06, 0.1, 0.07)
SLOW = "forgets", "walks", "bends", "wave", "swings", "line"
LATE = 6  # samples by which a column follows late, at most


class Rig(NamedTuple):
    """Columns (p, T), the sample at which a fault begins, and what it does to each column; none where that is zero.

    ``louder`` are the samples from which on sensors are louder for a while, (p,); -1 where they are not.
    """

    columns: np.ndarray
    first: int
    sizes: np.ndarray
    louder: np.ndarray

    def is_of_sensors(self, one: Together) -> bool:
        """Whether a change that is told is that of sensors that are louder for a while."""
        at = self.louder[[int(name) for name in one.names]]
        return bool(((at >= 0) & (abs(at - one.since) <= NEAR)).all())


def slow(rng, T: int) -> np.ndarray:
    """Return something slow, (T,), of deviation one."""
    kind, t = rng.choice(SLOW), np.arange(T)
    if kind == "forgets":
        x = coloured(rng, T, math.exp(-1 / (T * rng.uniform(0.02, 0.3))))
    elif kind == "walks":
        x = np.cumsum(rng.standard_normal(T))
    elif kind == "bends":
        window = np.hanning(int(T * rng.uniform(0.1, 0.4)))
        x = np.convolve(rng.standard_normal(T + len(window) - 1), window, "valid")
    elif kind == "wave":
        x = np.sin(2 * np.pi * t * rng.uniform(1, 20) / T + rng.uniform(0, 2 * np.pi))
    elif kind == "swings":
        r, w = math.exp(-rng.uniform(1, 10) / T), 2 * np.pi * rng.uniform(2, 20) / T
        x = lfilter([1], [1, -2 * r * math.cos(w), r * r], rng.standard_normal(T + 2000))[2000:]
    else:
        x = t / T
    return (x - x.mean()) / x.std()


def own_noise(rng, T: int) -> np.ndarray:
    """Return the noise of one column, (T,)."""
    kind = rng.choice(NOISES[0], p=NOISES[1])
    if kind == "white":
        return rng.standard_normal(T)
    if kind == "coloured":
        return coloured(rng, T, rng.uniform(0, 0.9))
    if kind == "both":
        return coloured(rng, T, rng.uniform(0, 0.8)) + slow(rng, T) * math.exp(rng.uniform(-1.2, 1.5))
    if kind == "nearly":
        return coloured(rng, T, 1 - math.exp(rng.uniform(math.log(0.001), math.log(0.05))))
    if kind == "walk":
        return np.cumsum(rng.standard_normal(T)) + rng.standard_normal(T) * rng.choice([0, 1, 5])
    return rng.standard_t(2.5, T) if kind == "heavy" else slow(rng, T) + 0.05 * rng.standard_normal(T)


def followed(rng, x, common, delays: int = LATE) -> np.ndarray:
    """Return columns (p, T) most of which follow something common, (T,), some samples late."""
    p, T = x.shape
    load = (rng.uniform(size=p) < 0.7) * np.exp(rng.uniform(-1, 1.5, p)) * rng.choice([-1, 1], p) * quick(x) * 1.5
    late = rng.integers(0, delays, p)
    return x + load[:, None] * np.array([common[np.maximum(np.arange(T) - n, 0)] for n in late])


def quick(x) -> np.ndarray:
    """Return the deviation of what is quick in each column, (p,)."""
    return np.median(abs(np.diff(x, axis=1)), axis=1) * 1.05


def steps_of_input(rng, T: int) -> np.ndarray:
    """Return an input that holds its value for a fiftieth to a fifth of the record, (T,)."""
    x, t = np.zeros(T), 0
    while t < T:
        n = int(T * np.exp(rng.uniform(np.log(0.02), np.log(0.2))))
        x[t : t + n], t = rng.uniform(-2, 2), t + n
    return x


def drawn(seed: int, number: int, kind: str, is_faulty: bool) -> Rig:
    """Return a rig of a kind, with a fault or steady."""
    if kind == KNOWN:
        one = common_dates.rig(seed, number, is_faulty)
        return Rig(one.columns, one.first, one.sizes * is_faulty, np.full(len(one.columns), -1))
    rng = np.random.default_rng([seed, number, KINDS.index(kind), 43])
    T, p = int(rng.integers(400, 1500)), int(rng.integers(3, 10))
    x = np.array([own_noise(rng, T) for _ in range(p)])
    if kind == SHARED:
        x = followed(rng, x, slow(rng, T))
    elif kind == DAYS:
        hours = 2 * np.pi * np.arange(T) / 24
        x = followed(rng, x, np.clip(np.sin(hours) + rng.normal(0, 0.2, T), rng.uniform(-1, 0), None))
    elif kind == DRIVEN:
        pole = rng.uniform(0.3, 0.97)
        x = followed(rng, x, lfilter([1 - pole], [1, -pole], steps_of_input(rng, T)), 1)
    first, length = int(T * rng.uniform(0.2, 0.7)), int(T * rng.uniform(0.15, 0.4))
    length = 10 * T if rng.uniform() < 0.3 else length
    lasts, late = float(np.exp(rng.uniform(0, np.log(60)))), rng.integers(0, LATE, p)
    takes = rng.permutation(p) < (1 if kind == ALONE else max(rng.binomial(p, 0.5), 2))
    sizes = is_faulty * takes * np.exp(rng.uniform(np.log(0.5), np.log(5), p)) * rng.choice([-1, 1], p)
    since = np.arange(T) - first - late[:, None]
    x += (sizes * quick(x))[:, None] * common_dates.shape(since, lasts, length)
    seen, louder = zip(*(sensed(rng, one, size) for one, size in zip(x, quick(x))))
    return Rig(np.array(seen), first, sizes, np.array(louder))


def sensed(rng, x, size: float) -> tuple[np.ndarray, int]:
    """Return a column as its sensor has it, and from which sample on it is louder for a while; -1: it is not.

    Two of five are rounded, stick, have outliers or are louder.
    """
    kind, at, T = rng.uniform(), int(rng.integers(0, len(x) - 200)), len(x)
    if kind < 0.15:
        unit = size * rng.uniform(0.5, 8)
        return np.round(x / unit) * unit, -1
    x = x.copy()
    if kind < 0.25:
        x[at : at + int(rng.integers(20, 60))] = x[at]
    elif kind < 0.35:
        wild = rng.uniform(size=T) < 0.01
        x[wild] += 10 * size * rng.standard_normal(wild.sum())
    elif kind < 0.42:
        x[at : at + 200] += 3 * size * coloured(rng, 200, 0.5)
        return x, at
    return x, -1


def told(rig: Rig) -> list[Together]:
    """Return the changes that are told of a rig, but for those of sensors that are louder."""
    found = together({str(j): x for j, x in enumerate(rig.columns)})
    return [one for one in found if not rig.is_of_sensors(one)]


def count(rig: Rig, seen: Counter) -> None:
    """Count what is told of a rig with a fault."""
    found = told(rig)
    right = min((one for one in found), key=lambda one: abs(one.since - rig.first), default=None)
    if right is not None and abs(right.since - rig.first) > NEAR:
        right = None
    seen["beside"] += len(found) - (right is not None)
    if right is not None:
        seen["told"] += 1
        seen["dated"] += right.interval[0] <= rig.first + LATE and rig.first <= right.interval[1]
        seen["named"] += len(right.names)
        seen["moved"] += sum(rig.sizes[int(name)] * move > 0 for name, move in right.moves.items())


def table(seed: int, records: int, kinds=KINDS) -> str:
    """Return what is told of each kind, as a table of Markdown."""
    rows = [
        "| rigs | of each | faults told | in the interval | columns | beside | steady with one |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for kind in kinds:
        seen, false = Counter[str](), 0
        for number in range(records):
            count(drawn(seed, number, kind, True), seen)
            false += bool(told(drawn(seed, number, kind, False)))
        columns = f"{seen['moved']} of {seen['named']}"
        rows.append(
            f"| {kind} | {records} | {seen['told']} | {seen['dated']} | {columns} | {seen['beside']} | {false} |"
        )
    return "\n".join(rows)


if __name__ == "__main__":
    show(table, __doc__, 25)
