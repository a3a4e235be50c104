"""Are the variance and the bands of the average of all models right where records are not as models have them?

    python scripts/average_worlds.py [seed [of each kind [kind ..]]]

Draws records of `driftwise_studies.score.rigs`. What is told of each, one step ahead, is judged on its second half: a
table of docs/decisions/model-average.md. What the variance needs was chosen on seed 0.
"""

from __future__ import annotations

import sys
import warnings

import numpy as np
from driftwise_studies.score.rigs import KINDS, draw

from driftwise.analysis.identifier import Identifier
from driftwise.estimators.model_average.step import NAIVE


def judged(y, u) -> tuple[float, ...]:
    """Return points behind the best member, NIS, whether it may be, coverage, whether it may be, log score."""
    identifier, half = Identifier(u.shape[1], 1.0), len(y) // 2
    trace = identifier.add(y, u)
    average, state = identifier._average, identifier._state
    used = np.flatnonzero(trace.is_used)[average.task.settle :]
    least = average.squares(state)[: -len(NAIVE)].min()
    errors = np.sqrt([np.square(trace.innovation[used]).sum(), least]) * 100
    behind = (errors[0] - errors[1]) / np.sqrt(np.square(y[used] - y[used].mean()).sum())
    nis, held, seen = trace.nis(half), trace.coverage(first=half), np.isfinite(y[half:]).sum()
    chance, chance_held = (2.576 * np.sqrt(v / seen) for v in (2.0, 0.05 * 0.95))
    is_right = min(0.8, 1 - chance) <= nis <= max(1.25, 1 + chance)
    is_held = min(0.92, 0.95 - chance_held) <= held <= max(0.97, 0.95 + chance_held)
    return behind, nis, is_right, held, is_held, float(np.nanmean(trace.log_score[half:]))


def moves(y) -> bool:
    """Say whether y is not one number in either half."""
    return all(np.nanmax(part) > np.nanmin(part) for part in np.array_split(y, 2))


def main(seed: int = 1, each: int = 14, *kinds: str) -> None:
    warnings.simplefilter("ignore")
    found = {}
    for name in kinds or KINDS:
        records = (draw(name, seed, number) for number in range(each))
        found[name] = [judged(y, u) for y, u in records if moves(y)]
    found["all"] = [row for rows in found.values() for row in rows]
    print("| kind | records | points behind | NIS, median | in .8-1.25 | 95 % bands hold 92-97 | log score |")
    print("|---|---|---|---|---|---|---|")
    for name, rows in found.items():
        behind, nis, right, _, holds, score = np.array(rows).T
        cells = f"{behind.clip(-20, 20).mean():.2f} | {np.median(nis):.2f} | {int(right.sum())} | {int(holds.sum())}"
        print(f"| {name} | {len(rows)} | {cells} | {score.mean():.3f} |")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]), *sys.argv[3:])
