"""A plant that becomes faster or slower: what is told of it, and what of plants that do not.

Run: python -m driftwise_studies.score.claims.lags [--records 20] [--seed 0]

Plants, inputs and noise are those of the claims (`drawing`), without their troubles. "Lag": all time constants become
1.1 to 3 times as long, or as short, at once, gains stay; "slowest mode": that one alone; "pole": a coefficient of a
plant of first order jumps, so that its gain moves with its lag; "gain": that of an input becomes 1.1 to 3 times as
large or small. "Steady", "square", "saturation": nothing changes, the last two bend. "Reversal": a motor beside dry
friction turns one way for the first part of the record, the other way after.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np

from driftwise.analysis.segmentation import hindsight

from .checking import SLACK
from .command import show
from .drawing import draw
from .plant import SLOWEST, Jump, Plant
from .simulation import record
from .wander import DYNAMICS

KINDS = "lag", "slowest mode", "pole", "gain", "steady", "square", "saturation", "reversal", "friction"


def plain(seed: int, number: int) -> Plant:
    """Return a plant of the claims without troubles."""
    plant = draw(seed, number)
    return Plant(number, frozenset(), *(getattr(plant, name) for name in DYNAMICS))


def motor(rng, T: int, turns: bool):
    """Return the speed (T,) of a motor beside dry friction, its voltage (T, 1), and when it turns round."""
    at, hold = int(T * rng.uniform(0.3, 0.7)), int(rng.integers(15, 60))
    u = np.repeat(rng.uniform(0.5, 2.0, T // hold + 1) if turns else rng.uniform(-2, 2, T // hold + 1), hold)[:T]
    u = u * np.where(np.arange(T) >= at, -1.0, 1.0) if turns else u
    a, dry, way = np.exp(-1 / rng.uniform(3, 20)), rng.uniform(0.05, 0.3), rng.uniform(0.8, 1.2)
    x = np.zeros(T)
    for t in range(1, T):
        force = (way if u[t - 1] < 0 else 1.0) * u[t - 1]
        push = force - dry * np.sign(x[t - 1] or force)
        x[t] = a * x[t - 1] + (1 - a) * (push if abs(x[t - 1]) > 1e-9 or abs(force) > dry else 0.0)
        if x[t] * x[t - 1] < 0:
            x[t] = 0.0
    return x + x.std() / np.exp(rng.uniform(np.log(10), np.log(50))) * rng.standard_normal(T), u[:, None], at


def changing(seed: int, number: int, kind: str):
    """Return y (T,), u (T, k), when something changes (0: never), by which factor, and the slack of a date."""
    plant, rng = plain(seed, number), np.random.default_rng([seed, number, 29])
    T, at = plant.samples, int(plant.samples * rng.uniform(0.25, 0.75))
    factor = float(np.exp(rng.choice([-1, 1]) * np.log(1.1) * (np.log(3) / np.log(1.1)) ** rng.uniform(0, 1)))
    if kind in ("reversal", "friction"):
        y, u, at = motor(rng, T, kind == "reversal")
        return y, u, at if kind == "reversal" else 0, 1.0, 50.0
    if kind in ("square", "saturation", "steady"):
        plant, at = replace(plant, nonlinearity="" if kind == "steady" else kind), 0
    elif kind == "gain":
        plant = replace(plant, jumps=(Jump("gain", at, factor, int(rng.integers(len(plant.gains)))),))
    elif kind == "pole":
        p = abs(plant.poles[0])
        after = p ** (1 / factor)
        plant = replace(plant, poles=(complex(p),))
        jumps = [Jump("gain", at, (1 - p) / (1 - after), i) for i in range(len(plant.gains))]
        plant = replace(plant, jumps=(Jump("lag", at, factor), *jumps))
    else:
        plant = replace(plant, jumps=(Jump("lag", at, factor, SLOWEST if kind == "slowest mode" else 0),))
    data, slack = record(plant, seed), SLACK + 2 * plant.slowest + max(plant.delays)
    return data.y, data.u, at, factor, slack


def table(seed: int, records: int) -> str:
    """Return of how many records what is told near the change, and elsewhere, as a table of Markdown."""
    rows = ["| kind | records | lag told there | gain there | level there | others | records with others |"]
    rows.append("| --- " * 7 + "|")
    for kind in KINDS:
        told = Counter[str]()
        for number in range(records):
            y, u, at, _, slack = changing(seed, number, kind)
            seen = hindsight(y, u)
            jumps = seen.jumps() if seen else []
            there = {jump.kind for jump in jumps if at and abs(jump.at - at) <= slack}
            others = [jump for jump in jumps if not at or abs(jump.at - at) > slack]
            told.update([*there, *["others"] * len(others), *(["with"] if others else [])])
        rows.append(
            f"| {kind} | {records} | "
            + " | ".join(str(told[k]) for k in ("speed", "gain", "level", "others", "with"))
            + " |"
        )
    return "\n".join(rows)


if __name__ == "__main__":
    show(table, __doc__, 20)
