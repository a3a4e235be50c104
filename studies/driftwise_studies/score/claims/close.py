"""A level and a gain that change close together: how often both are told, and how their dates lie in their intervals.

Run: python -m driftwise_studies.score.claims.close [--records 30] [--seed 0]

Plants, inputs and noise are those of the claims (`drawing`), without their troubles; the level moves by .3 to 2
deviations, the gain of an input by a quarter to threefold, 4 to 64 samples before it or after it. Odds are not asked:
some of them nobody could tell.
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np

from driftwise.analysis.segmentation import hindsight

from .checking import SLACK
from .drawing import draw
from .plant import Jump, Plant
from .simulation import Record, record
from .wander import DYNAMICS


def close(seed: int, number: int) -> tuple[Plant, Record]:
    """Return a plant whose level and a gain of which change close together, and its record."""
    plant = draw(seed, number)
    rng, T = np.random.default_rng([seed, number, 28]), plant.samples
    gap, first = int(np.exp(rng.uniform(np.log(4), np.log(64)))), int(T * rng.uniform(0.25, 0.75))
    ends = (first, first + gap) if rng.random() >= 0.5 else (first + gap, first)
    rng.random()
    factor, which = float(np.exp(rng.choice([-1, 1]) * rng.uniform(0.25, 1.1))), int(rng.integers(len(plant.gains)))
    size = float(rng.uniform(0.3, 2.0) * rng.choice([-1.0, 1.0]))
    plant = Plant(number, frozenset(), *(getattr(plant, name) for name in DYNAMICS))
    plant = replace(plant, jumps=(Jump("level", ends[0], size), Jump("gain", ends[1], factor, which)))
    return plant, record(plant, seed)


def told(plant: Plant, data: Record) -> tuple[int, int, int]:
    """Return how many of both are told, how many of their intervals hold them, and changes that are none of them."""
    seen = hindsight(data.y, data.u)
    jumps = seen.jumps() if seen else []
    reach = SLACK + 2 * plant.time_constants[0] + max(plant.delays)

    def is_of(jump, true: Jump) -> bool:
        is_kind = jump.kind == true.what and (true.what != "gain" or jump.input == true.input)
        return is_kind and abs(jump.at - true.at) <= reach

    found = [(true.at, jump) for true in plant.jumps if (jump := next((j for j in jumps if is_of(j, true)), None))]
    held = sum(jump.interval[0] - 1 <= at <= jump.interval[1] + 1 for at, jump in found)
    return len(found), held, sum(not any(is_of(jump, true) for true in plant.jumps) for jump in jumps)


def table(seed: int, records: int) -> str:
    """Return of how many records both changes, or one, are told, as a table of Markdown."""
    found = [told(*close(seed, number)) for number in range(records)]
    many, held, false = zip(*found)
    rows = [
        "| records | both told | one | dates held by their interval | other changes |",
        "| --- | --- | --- | --- | --- |",
        f"| {records} | {many.count(2)} | {many.count(1)} | {sum(held)} of {sum(many)} | {sum(false)} |",
    ]
    return "\n".join(rows)


def main(arguments=None) -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--records", type=int, default=30)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args(arguments)
    print(table(asked.seed, asked.records))


if __name__ == "__main__":
    main()
