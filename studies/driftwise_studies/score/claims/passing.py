"""Levels that change and come back: how often both ends are told, on plants whose level does nothing else.

Run: python -m driftwise_studies.score.claims.passing [--records 40] [--seed 0]

Plants, inputs and noise are those of the claims (`drawing`), without their troubles; the level is another by .3 to 2
deviations of what the inputs do, for a twelfth to a third of the record. Beside its inputs; of the noise alone, by .7
to 1.5 of the same in deviations of the noise; or that rounded to a half of its deviation to twice it, and brought to
another clock between each two rows.
"""

from __future__ import annotations

import numpy as np

from driftwise.analysis.segmentation import LEVEL, hindsight

from .command import show
from .drawing import draw
from .plant import Plant
from .simulation import record
from .wander import DYNAMICS

KINDS = "beside inputs", "alone", "alone, rounded, another clock"
NEAR, ELSEWHERE = 10, 30  # samples that a date may be off its interval; from which on a change is another one


def passing(seed: int, number: int, kind: str):
    """Return y (T,), u (T, k), and the two samples at which the level changes."""
    plant = draw(seed, number)
    plant = Plant(number, frozenset(), *(getattr(plant, name) for name in DYNAMICS))
    data, rng, T = record(plant, seed), np.random.default_rng([seed, number, 27]), plant.samples
    length = int(T * rng.uniform(0.08, 0.33))
    first = int(T * rng.uniform(0.2, 0.9 - length / T))
    step = np.zeros(T)
    step[first : first + length] = rng.uniform(0.3, 2) * rng.choice([-1.0, 1.0])
    ends = first, first + length
    if kind == KINDS[0]:
        return data.y + data.unit * step, data.u, ends
    noise = data.y - data.clean
    y = noise / noise.std() + rng.uniform(0.7, 1.5) * step
    if kind == KINDS[2]:
        unit, part = rng.uniform(0.5, 2.0), rng.uniform(0.0, 0.5)
        y = np.round(y / unit) * unit
        y = (1 - part) * y + part * np.append(y[1:], y[-1])
    return y, data.u[:, :0], ends


def told(y, u, ends) -> tuple[int, int]:
    """Return how many ends are told, and how many changes that are none of them."""
    seen = hindsight(y, u)
    jumps = seen.jumps() if seen else []
    reach = [range(jump.interval[0] - NEAR, jump.interval[1] + NEAR + 1) for jump in jumps]
    levels = [where for jump, where in zip(jumps, reach) if jump.kind == LEVEL]
    false = [
        jump
        for jump, where in zip(jumps, reach)
        if not any(end in where or abs(jump.at - end) <= ELSEWHERE for end in ends)
    ]
    return sum(any(end in where for where in levels) for end in ends), len(false)


def table(seed: int, records: int) -> str:
    """Return of how many records both ends, or one, are told, and changes that are none, as a table of Markdown."""
    rows = [
        "| a level that comes back | records | both ends | one | other changes |",
        "| --- | --- | --- | --- | --- |",
    ]
    for kind in KINDS:
        found = [told(*passing(seed, number, kind)) for number in range(records)]
        ends = [end for end, _ in found]
        rows.append(f"| {kind} | {records} | {ends.count(2)} | {ends.count(1)} | {sum(n for _, n in found)} |")
    return "\n".join(rows)


if __name__ == "__main__":
    show(table, __doc__, 40)
