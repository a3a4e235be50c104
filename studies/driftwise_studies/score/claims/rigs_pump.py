"""A pump on a loop of water, by its physics, with what goes wrong on one: what is told of its columns.

Run: python -m driftwise_studies.score.claims.rigs_pump [--records 25] [--seed 0]

A pump lifts `speed^2 - flow^2`, as much as the loop takes: its static head, and the square of the flow by what the
valves resist. The motor takes `speed^3` and `speed^2 flow`; it and the water warm up by what is lost, late by some
tenths of the record; vibration grows with the square of the speed. The mains, and the load of half of the benches, a
controller that holds the flow by the speed, move all of it. Sensors have noise, white and slow, and some digits.

From .35 to .6 of the record on, for a fifth to two fifths of it, somebody or something changes it. "Valve": one before
or behind the pump is turned within 5 to 200 rows, in one to five moves, and back. "Set point": of speed or flow, at
once; the drive follows within rows, half of them beyond it first. "Imbalance": vibration, and how it scatters, at once.
"Cavitation": vibration, pressure and flow scatter while little else moves, mostly in bursts. "Leak": the water falls
along a line, and is filled up. "Friction": a bearing takes more, in one to three moves; current, then temperatures.
Sizes are such that the largest movement of a column is one to twenty deviations of what is quick in it, or its noise
1.3 to 6 times as loud. "Steady": the same benches without any.

Told is a fault of which a change begins within sixty rows of its beginning or of its end; "beside" counts changes that
begin within sixty rows of neither, of which a temperature that is late has some. "Flow named": the beginnings that are
told where somebody named the flow, without what is left to its model then (`is_news`), and what the model tells.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import NamedTuple

import numpy as np
from scipy.signal import lfilter

from driftwise.analysis.table_together import is_news
from driftwise.analysis.together import together
from driftwise.tables.recognise import recognise

from .command import show
from .rigs_bench import NEAR, first_order, shape
from .rigs_gradual import moves

KINDS = VALVE, SET_POINT, IMBALANCE, CAVITATION, LEAK, FRICTION = (
    "valve", "set point", "imbalance", "cavitation", "leak", "friction",
)  # fmt: skip
STEADY = "steady"
SENSORS = {  # deviation of the white noise in shares of the level, and of digits in those of the noise
    "vibration 1": (0.03, 0.01), "vibration 2": (0.03, 0.01), "current": (0.02, 0.05), "pressure": (0.03, 3.0),
    "motor temperature": (0.001, 1.0), "water temperature": (0.0005, 1.0), "voltage": (0.01, 0.05), "flow": (0.01, 1.0),
}  # fmt: skip
PUMP, STATIC, RESISTS = 1.5, 0.2, 0.5  # head at rest, that of the loop, and what its valves resist, of flow 1
SMALL, MOST = 0.01, 0.6  # size of a fault that others are measured by; the largest
WARM = "motor temperature", "water temperature"
LOUDER = {IMBALANCE: ("vibration 1", "vibration 2"), CAVITATION: ("vibration 1", "vibration 2", "pressure", "flow")}
FOLLOWS = 5.0  # rows in which a drive follows


class Pump(NamedTuple):
    """Columns (p, T), and rows at which a fault begins and ends; its length 0 without one."""

    columns: dict[str, np.ndarray]
    first: int
    length: int


class Moved(NamedTuple):
    """What is other than usual, (T,): speed, resistance, suction, vibration, friction, and how noises scatter."""

    speed: np.ndarray
    resists: np.ndarray
    head: np.ndarray
    vibrates: np.ndarray
    rubs: np.ndarray
    louder: np.ndarray


def usual(T: int) -> Moved:
    """Return what nothing moves."""
    return Moved(*(np.ones(T) for _ in Moved._fields))


def flows(moved: Moved, holds: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return flow and speed, (T,), of one that holds the flow where something else moves, or not."""
    resists = 1.0 + RESISTS * moved.resists - RESISTS
    if holds:
        flow = moved.speed
        return flow, np.sqrt((STATIC + resists * flow**2) / (moved.head * PUMP)) / math.sqrt((STATIC + 1.0) / PUMP)
    lift = (STATIC + 1.0) * moved.speed**2 * moved.head - STATIC
    return np.sqrt(np.maximum(lift, 1e-3) / resists), moved.speed


def signals(moved: Moved, holds: bool, late: tuple[float, float]) -> dict[str, np.ndarray]:
    """Return what the columns would be without noise, about one."""
    flow, speed = flows(moved, holds)
    power = (0.6 * speed**3 + 0.4 * speed**2 * flow) * moved.rubs
    return {
        "vibration 1": speed**2 * moved.vibrates, "vibration 2": speed**2 * (1 + 0.5 * (moved.vibrates - 1)),
        "current": power, "pressure": PUMP * speed**2 * moved.head - 0.5 * flow**2,
        "motor temperature": 1 + 0.3 * (lagged(power * moved.rubs, late[0]) - 1),
        "water temperature": 1 + 0.2 * (lagged(power, late[1]) - 1),
        "voltage": np.ones_like(flow), "flow": flow,
    }  # fmt: skip


def lagged(x, rows: float) -> np.ndarray:
    """Return what follows x (T,) within some rows, from rest at its first value."""
    keeps = math.exp(-1 / rows)
    return lfilter([1 - keeps], [1, -keeps], x, zi=[keeps * x[0]])[0]


def fault(rng, kind: str, T: int, first: int, length: int, size: float, factor: float) -> Moved:
    """Return what a fault of a kind moves, by a relative size and a factor of noises."""
    t, one = np.arange(T) - first, usual(T)
    there = shape(t, 1.0, length)
    if kind == VALVE:
        closed, opened = (moves(rng, int(np.exp(rng.uniform(math.log(5), math.log(200))))) for _ in range(2))
        by = np.concatenate([closed, np.ones(max(length - len(closed), 0)), 1 - opened, [0.0]])
        by = np.where(t < 0, 0.0, by[np.clip(t, 0, len(by) - 1)])
        return one._replace(resists=1 + 4 * abs(size) * by)
    if kind == SET_POINT:
        beyond = rng.choice([0.0, 0.3])
        step = lagged(there, FOLLOWS) + beyond * (lagged(there, FOLLOWS) - lagged(there, 3 * FOLLOWS))
        return one._replace(speed=1 + size * step)
    if kind == IMBALANCE:
        return one._replace(vibrates=1 + abs(size) * there, louder=factor**there)
    if kind == CAVITATION:
        edges = np.sort(rng.uniform(0, length, 2 * int(rng.integers(0, 4))))
        bursts = there * (np.searchsorted(edges, np.clip(t, 0, length), "right") % 2 == 0)
        return one._replace(louder=factor**bursts, vibrates=1 + abs(size) * bursts, head=1 - 0.1 * abs(size) * bursts)
    if kind == LEAK:
        filled = int(rng.integers(10, 120))
        falls = np.interp(t, [0, length, length + filled], [0.0, 1.0, 0.0])
        return one._replace(head=1 - min(abs(size), 0.5) * falls)
    steps = moves(rng, int(np.exp(rng.uniform(0, math.log(60)))))
    return one._replace(rubs=1 + abs(size) * np.where(t < 0, 0.0, steps[np.clip(t, 0, len(steps) - 1)]) * (t < length))


def drawn(seed: int, number: int, kind: str) -> Pump:
    """Return a bench with a fault of a kind, or steady."""
    rng = np.random.default_rng([seed, number, (*KINDS, STEADY).index(kind), 59])
    T, holds = int(rng.integers(800, 1300)), bool(rng.uniform() < 0.3)
    first, length = int(T * rng.uniform(0.35, 0.6)), int(T * rng.uniform(0.2, 0.4))
    late = T * rng.uniform(0.05, 0.3), T * rng.uniform(0.2, 1.0)
    deviation, factor = (float(np.exp(rng.uniform(*np.log(ends)))) for ends in ((1, 20), (1.3, 6)))
    quick = {name: share * math.exp(rng.uniform(-0.7, 0.7)) for name, (share, _) in SENSORS.items()}
    moved = usual(T)
    if kind != STEADY:
        begun, small = rng.bit_generator.state, fault(rng, kind, T, first, length, SMALL, factor)
        largest = max(np.ptp(x) / quick[name] for name, x in signals(small, holds, late).items() if name not in WARM)
        size = min(SMALL * deviation / max(largest, 1e-9), MOST) * rng.choice([-1, 1])
        rng.bit_generator.state = begun  # the same moves of another size
        moved = fault(rng, kind, T, first, length, size, factor)
    mains, load = (first_order(rng, T, math.exp(-1 / np.exp(rng.uniform(1, math.log(0.2 * T))))) for _ in range(2))
    loaded = 0.01 * rng.choice([0, 1]) * rng.uniform() * load
    clean = signals(moved._replace(speed=moved.speed * (1 + loaded)), holds, late)
    begins = 1 - np.exp(-np.arange(T) / late[0])
    columns = {}
    for name, x in clean.items():
        white, grain = quick[name], SENSORS[name][1] * quick[name] * math.exp(rng.uniform(-1, 0.5))
        noise = rng.standard_normal(T) * (moved.louder if name in LOUDER.get(kind, ()) else 1.0)
        own = rng.choice([0, 0.5, 1.0]) * first_order(rng, T, math.exp(-1 / np.exp(rng.uniform(0, 5))))
        follows = rng.normal(0, {"voltage": 2.0, "current": 1.0}.get(name, 0.2))
        x = x + white * (noise + own + follows * mains)
        if name in WARM:
            x = x + white * rng.uniform(0, 30) * begins
        columns[name] = np.round(x / grain) * grain
    return Pump(columns, first, length if kind != STEADY else 0)


def count(pump: Pump, seen: Counter) -> None:
    """Count what is told of a bench."""
    changes = together(pump.columns)
    table = recognise({"time_s": np.arange(float(len(pump.columns["flow"]))), **pump.columns}, output="flow")
    found, news = ([one.since for one in part] for part in (changes, [one for one in changes if is_news(one, table)]))
    ends = [pump.first, pump.first + pump.length] if pump.length else []
    near = [[abs(row - end) <= NEAR for row in found] for end in ends]
    seen["begins"] += bool(ends) and any(near[0])
    seen["named"] += bool(ends) and any(abs(row - pump.first) <= NEAR for row in news)
    seen["either"] += any(map(any, near))
    seen["beside"] += sum(not any(hits) for hits in zip(*near)) if ends else len(found)
    seen["any"] += bool(found)


def table(seed: int, records: int, kinds=(*KINDS, STEADY)) -> str:
    """Return what is told of each kind, as a table of Markdown."""
    rows = ["| fault | benches | beginning told | flow named | beginning or end | beside | any |", "| --- " * 7 + "|"]
    for kind in kinds:
        seen = Counter[str]()
        for number in range(records):
            count(drawn(seed, number, kind), seen)
        cells = (seen["begins"], seen["named"], seen["either"], seen["beside"], seen["any"])
        rows.append(f"| {kind} | {records} | " + " | ".join(map(str, cells)) + " |")
    return "\n".join(rows)


if __name__ == "__main__":
    show(table, __doc__, 25)
