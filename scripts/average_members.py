"""Is the forecast of all models worse than its best member, and are its bars right? Drawn plants: two tables of
docs/decisions/model-average.md.

    python scripts/average_members.py [plants [seed]]

Plants are those of the claims audit, their columns told. Points are of the fit, 100 (1 - |e|/|y - mean y|), behind the
member with the smallest squared errors in hindsight, from the sample on from which models are compared. NIS and the
share of samples within 95 % bands are those of the second half.
"""

from __future__ import annotations

import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np
from driftwise_studies.score.claims.audit import write
from driftwise_studies.score.claims.drawing import draw
from driftwise_studies.score.claims.simulation import record

from driftwise.analysis.directions import read_settled
from driftwise.analysis.identifier import Identifier
from driftwise.engine.errors import InputError
from driftwise.estimators.model_average.step import NAIVE
from driftwise.tables.autoread import gathered

LEAST = 80  # samples that count
MISSES = {"irregular", "sparse"}
GROUPS = {
    "all": lambda troubles: True,
    "none of these": lambda troubles: not troubles & {*MISSES, "outliers"},
    "outliers": lambda troubles: "outliers" in troubles,
    "irregular or sparse": lambda troubles: bool(troubles & MISSES),
}


def points(y, u, dt) -> tuple[float, ...] | None:
    """Return how far the forecast is behind the best member and the last value; then NIS, coverage and log score."""
    identifier = Identifier(u.shape[1], dt)
    trace = identifier.add(y, u if u.shape[1] else None)
    average, state = identifier._average, identifier._state
    used = np.flatnonzero(trace.is_used)[average.task.settle :]
    if len(used) < LEAST:
        return None
    squares = average.squares(state)
    errors = np.sqrt([np.square(trace.innovation[used]).sum(), squares.min(), squares[-len(NAIVE)]])
    errors *= 100 / np.sqrt(np.square(y[used] - y[used].mean()).sum())
    half = len(y) // 2
    score = float(np.nanmean(trace.log_score[half:]))
    return errors[0] - errors[1], errors[0] - errors[2], trace.nis(half), trace.coverage(first=half), score


def plant(seed: int, number: int):
    """Return the troubles of a plant, and its record as it is read: y, u and the time between samples."""
    drawn = draw(seed, number)
    with tempfile.TemporaryDirectory() as folder:
        written = write(drawn, record(drawn, seed), seed, Path(folder))
        table, pieces = read_settled(written.path, written.outputs[0], list(written.inputs), None)
        _, y, u = next(iter(gathered(pieces)))[:3]
    return set(drawn.troubles), y, u, table.dt


def main(plants: int = 150, seed: int = 0) -> None:
    warnings.simplefilter("ignore")
    found = []
    for number in range(plants):
        try:
            troubles, *rest = plant(seed, number)
        except InputError:  # a table that is refused
            continue
        behind = points(*rest)
        if behind:
            found.append((troubles, *behind))
    print("| troubles | plants | points behind the best member | more than .3 | more than 1 | worse than last value |")
    print("|---|---|---|---|---|---|")
    for name, belongs in GROUPS.items():
        some = np.array([row[1:] for row in found if belongs(row[0])])
        best, last = some.T[:2]
        cells = f"{len(some)} | {best.mean():.2f} | {(best > 0.3).mean():.2f} | {(best > 1).mean():.2f}"
        print(f"| {name} | {cells} | {np.count_nonzero(last > 0.3)} |")
    print("\n| troubles | NIS, median | in .8-1.25 | held by 95 % bands | by 92-97 | log score |")
    print("|---|---|---|---|---|---|")
    for name, belongs in GROUPS.items():
        nis, held, score = np.array([row[3:] for row in found if belongs(row[0])]).T
        cells = f"{np.median(nis):.2f} | {((nis > 0.8) & (nis < 1.25)).mean():.2f} | {100 * held.mean():.1f} %"
        print(f"| {name} | {cells} | {((held > 0.92) & (held < 0.97)).mean():.2f} | {score.mean():.3f} |")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
