"""Small test benches with a fault, or without: what is told of their columns, and what somebody could who knows all.

Run: python -m driftwise_studies.score.claims.rigs_bench [--records 25] [--seed 0]

A pump or a motor on a bench, 800 to 1300 rows a second apart: six to ten sensors of vibration, current, pressure,
temperature, voltage and flow. Beside its own noise, white and of the first order, each follows what all share, more or
less: the mains, the load, and the warming up of the whole. Temperatures are slow; pressures, flows and temperatures
have few digits. For a fifth to two fifths of the record a fault moves the mean of some columns, by half to five
deviations of what is quick in them, the noise of some, by a factor of 1.3 to 4, or both, at once or within 10 to 60
rows, and mostly goes again. "One mean", "few means": of one column, or of two to four; "noise": of one to three columns
the noise alone; "both": means and noises. "Steady": none.

"Who knows" is told every covariance, size and shape: all but the date; it tells what has odds of 20:1 against none.
Told is a fault of which a change begins within sixty rows.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import NamedTuple

import numpy as np
from scipy.signal import lfilter

from driftwise.analysis.together import together

from .command import show

KINDS = ONE, FEW, NOISE, BOTH = "one mean", "few means", "noise", "both"
SENSORS = "vibration", "current", "pressure", "temperature", "voltage", "flow"
NEAR, EDGE, STEP = 60, 30, 6  # rows: within which a fault is dated; from an end, and between dates, of who knows
SURE = math.log(20.0)
FREE = 1000.0  # variance of a level that nobody knows, in those of the white noise
MAINS, LOAD = 0, 1  # what all share
FOLLOWS = {  # most that a sensor follows mains and load by, in deviations of its own noise
    "vibration": (0.3, 1.0), "current": (2.0, 2.0), "pressure": (0.5, 2.0), "temperature": (0.0, 0.3),
    "voltage": (4.0, 0.3), "flow": (0.5, 2.0),
}  # fmt: skip
LEVELS = {"vibration": 0.03, "current": 1.5, "pressure": 0.4, "temperature": 60.0, "voltage": 230.0, "flow": 30.0}
SPREADS = {"vibration": 1e-3, "current": 0.2, "pressure": 0.15, "temperature": 0.1, "voltage": 5.0, "flow": 0.4}


class Bench(NamedTuple):
    """Columns (p, T), their sensors, and all that is to be known of them.

    first, length, lasts : row at which the fault begins, rows until it goes, and rows within which it comes
    sizes, factors : what it adds to each column, and what it multiplies its white noise by, (p,)
    white, own, keeps : deviations of both noises of a column, and what the coloured one keeps from row to row
    follows, shared : (p, 2), and what mains and load keep from row to row
    warm : (p, T), what warming up adds
    units : the digits of each sensor
    pattern : what is there of the fault from its first row on; None: as ``shape`` has it
    """

    columns: np.ndarray
    sensors: tuple[str, ...]
    first: int
    length: int
    lasts: float
    sizes: np.ndarray
    factors: np.ndarray
    white: np.ndarray
    own: np.ndarray
    keeps: np.ndarray
    follows: np.ndarray
    shared: np.ndarray
    warm: np.ndarray
    units: np.ndarray
    pattern: np.ndarray | None = None

    def moved(self, since) -> np.ndarray:
        """Return what is there of the fault so many rows after its beginning."""
        if self.pattern is None:
            return shape(since, self.lasts, self.length)
        return np.where(since < 0, 0.0, self.pattern[np.clip(since, 0, len(self.pattern) - 1)])

    @property
    def is_steady(self) -> bool:
        """Whether there is no fault."""
        return not self.sizes.any() and bool((self.factors == 1).all())


def shape(since, lasts: float, length: int) -> np.ndarray:
    """Return what comes within some rows, and goes again after ``length``."""
    return np.clip((since + 1) / lasts, 0, 1) - np.clip((since + 1 - length) / lasts, 0, 1)


def first_order(rng, T: int, keeps: float) -> np.ndarray:
    """Return noise of the first order, (T,), of deviation one."""
    start = rng.standard_normal()
    return lfilter([math.sqrt(1 - keeps**2)], [1, -keeps], rng.standard_normal(T), zi=[keeps * start])[0]


def drawn(seed: int, number: int, kind: str, is_faulty: bool) -> Bench:
    """Return a bench, with a fault of a kind, or steady."""
    rng = np.random.default_rng([seed, number, KINDS.index(kind), 47])
    T, p = int(rng.integers(800, 1300)), int(rng.integers(6, 11))
    sensors = tuple(str(one) for one in rng.permutation([*SENSORS, *rng.choice(SENSORS, p - len(SENSORS))]))
    is_slow = np.array([one == "temperature" for one in sensors])
    scale = np.array([SPREADS[one] for one in sensors]) * np.exp(rng.uniform(-1, 1, p))
    white = scale * np.where(is_slow, rng.uniform(0.2, 1, p), 1.0)
    own = scale * rng.choice([0.0, 0.4, 1.0], p) * rng.uniform(0.5, 1.5, p)
    keeps = np.where(is_slow, np.exp(-1 / (T * rng.uniform(0.05, 0.3, p))), np.exp(-1 / np.exp(rng.uniform(0, 5, p))))
    follows = scale[:, None] * np.array([FOLLOWS[one] for one in sensors]) * rng.uniform(0, 1, (p, 2))
    follows *= rng.choice([-1, 1], (p, 2))
    shared = np.exp(-1 / np.exp(rng.uniform([math.log(10), 0], [math.log(0.3 * T), math.log(100)])))
    shared_ones = np.array([first_order(rng, T, keep) for keep in shared])
    rate = T * rng.uniform(0.3, 3)
    heat = (1 - np.exp(-np.arange(T) / rate)) / (1 - math.exp(-T / rate))
    warm = (scale * np.where(is_slow, rng.uniform(0, 30, p), rng.choice([0, 1], p) * rng.normal(0, 1.5, p)))[:, None]
    quick = np.hypot(white, np.where(keeps < 0.95, own, 0.0))
    first, length = int(T * rng.uniform(0.35, 0.6)), int(T * rng.uniform(0.2, 0.4))
    length = length if rng.uniform() < 0.85 else 10 * T
    lasts = 1.0 if rng.uniform() < 0.4 else rng.uniform(10, 60)
    order = rng.permutation(p)
    many = {ONE: (1, 0), NOISE: (0, int(rng.integers(1, 4))), FEW: (int(rng.integers(2, 5)), 0)}
    means, noisy = many.get(kind, (int(rng.integers(1, 5)), int(rng.integers(1, 4))))
    sizes = quick * (order < means) * np.exp(rng.uniform(math.log(0.5), math.log(5), p)) * rng.choice([-1, 1], p)
    order = rng.permutation(p)
    factors = np.exp(rng.uniform(math.log(1.3), math.log(4), p) * rng.choice([1, 1, 1, -1], p) * (order < noisy))
    sizes, factors = sizes * is_faulty, factors if is_faulty else np.ones(p)
    moved = shape(np.arange(T) - first, lasts, length)
    x = warm * heat + sizes[:, None] * moved + follows @ shared_ones
    x += own[:, None] * np.array([first_order(rng, T, keep) for keep in keeps])
    x += white[:, None] * factors[:, None] ** moved * rng.standard_normal((p, T))
    digits = {"vibration": 0.01, "current": 0.05, "voltage": 0.05}
    coarse = np.exp(rng.uniform(math.log(0.3), math.log(4), p))
    units = scale * np.array([digits.get(one, coarse[j]) for j, one in enumerate(sensors)])
    x += np.array([LEVELS[one] for one in sensors])[:, None]
    x = np.round(x / units[:, None]) * units[:, None]
    return Bench(
        x, sensors, first, length, lasts, sizes, factors, white, own, keeps, follows, shared, warm * heat, units
    )


def evidence(bench: Bench, fault: Bench) -> tuple[np.ndarray, np.ndarray]:
    """Return dates, and the log likelihood of the ``fault`` at each of them against none, of who knows all else.

    A Kalman filter for each date, side by side: the state has the shared noises and those of each column. The first
    is of the means about the levels, the last row of dates is "none".
    """
    p, T = bench.columns.shape
    dates = np.arange(EDGE, T - EDGE, STEP)
    every = np.append(dates, 10 * T)
    moved = fault.moved(np.arange(T)[:, None] - every)  # (T, dates)
    unit = bench.white[:, None]
    keeps = np.concatenate([bench.shared, bench.keeps, np.ones(p)])  # of mains, load, coloured noises and levels
    C = np.hstack([bench.follows / unit, np.diag(bench.own / bench.white), np.eye(p)])
    Q = np.diag(1 - keeps**2)
    y = ((bench.columns - bench.warm - bench.columns.mean(axis=1, keepdims=True)) / unit).T
    sizes, m = fault.sizes / bench.white, len(every)
    P = np.tile(np.diag(np.where(keeps < 1, 1.0, FREE)), (m, 1, 1))
    z, total = np.zeros((m, len(keeps))), np.zeros(m)
    for t in range(T):
        R = fault.factors ** (2 * moved[t][:, None]) + (bench.units / bench.white) ** 2 / 12
        e = y[t] - sizes * moved[t][:, None] - z @ C.T
        PC = P @ C.T
        S = C @ PC
        S[:, np.arange(p), np.arange(p)] += R
        gain = np.linalg.solve(S, PC.transpose(0, 2, 1))
        total -= 0.5 * (np.linalg.slogdet(S)[1] + np.einsum("mp,mp->m", e, np.linalg.solve(S, e[..., None])[..., 0]))
        z = (z + np.einsum("mpn,mp->mn", gain, e)) * keeps
        P = (P - PC @ gain) * np.outer(keeps, keeps) + Q
        P = (P + P.transpose(0, 2, 1)) / 2
    return dates, total[:-1] - total[-1]


def knows(bench: Bench, fault: Bench) -> tuple[bool, bool]:
    """Return whether who knows all but the date tells the fault, and dates it."""
    dates, odds = evidence(bench, fault)
    is_told = float(np.logaddexp.reduce(odds)) - math.log(len(odds)) > SURE
    return is_told, is_told and abs(int(dates[np.argmax(odds)]) - bench.first) <= NEAR


def count(bench: Bench, seen: Counter) -> None:
    """Count what is told of a bench."""
    found = together({f"{name} {j}": x for j, (name, x) in enumerate(zip(bench.sensors, bench.columns))})
    right = not bench.is_steady and any(abs(one.since - bench.first) <= NEAR for one in found)
    ends = bench.first + bench.length
    seen["told"] += right
    seen["any"] += bool(found)
    seen["beside"] += sum(abs(one.since - bench.first) > NEAR and abs(one.since - ends) > NEAR for one in found)


def table(seed: int, records: int, kinds=KINDS, is_known: bool = True) -> str:
    """Return what is told of each kind, as a table of Markdown."""
    rows = [
        "| fault | benches | told and dated | told beside | steady with one | who knows | steady |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for kind in kinds:
        seen, false = Counter[str](), Counter[str]()
        for number in range(records):
            fault, steady = (drawn(seed, number, kind, is_faulty) for is_faulty in (True, False))
            count(fault, seen)
            count(steady, false)
            if is_known:
                seen["known"] += knows(fault, fault)[1]
                false["known"] += knows(steady, fault)[0]
        rows.append(
            f"| {kind} | {records} | {seen['told']} | {seen['beside']} | {false['any']} "
            f"| {seen['known']} | {false['known']} |"
        )
    return "\n".join(rows)


if __name__ == "__main__":
    show(table, __doc__, 25)
