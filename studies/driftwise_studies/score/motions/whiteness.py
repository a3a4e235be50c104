"""Whether the errors of forecasts are white: drawn objects without troubles, all as long, every class but animals.

An exact filter's are, and Ljung and Box (1978) over five lags refuse one series in twenty. Who follows noise, as if it
were motion, overshoots: the next error has the other sign.

Run: python -m driftwise_studies.score.motions.whiteness [--seed 0] [--scenes 200]
"""

from __future__ import annotations

from itertools import groupby

import numpy as np

from driftwise.estimators.track.estimator import TrackEstimator

from ...papers.records import ljung_box
from .drawing import asked, draw
from .field import number, table
from .jets import alone
from .simulation import simulate

FIRST = 12  # plots that are not scored
PLOTS = 284
LAGS = 5
REFUSED = 0.05
HEAD = "", "series", "refused", *(f"correlation at {k}" for k in range(1, LAGS + 1))


def series(seed: int, number: int) -> tuple[str, list[tuple[float, ...]]]:
    """Return the class, and of each coordinate whether its errors are refused as white and their correlations."""
    scene = alone(draw(seed, number))._replace(plots=PLOTS)
    seen = simulate(scene).plots
    trace = TrackEstimator(scene.kind.told).scan(seen.time, seen.position)
    found = []
    for z in (trace.innovation / np.sqrt(trace.variance))[FIRST:].T:
        away = z - z.mean()
        lags = (float(away[k:] @ away[:-k] / (away @ away)) for k in range(1, LAGS + 1))
        found.append((float(ljung_box(z, LAGS)[0] < REFUSED), *lags))
    return scene.name, found


def row(name: str, found: list[tuple[float, ...]]) -> list[str]:
    """Return the cells of a table's row."""
    return [name, f"{len(found)}", *(number(float(value)) for value in np.mean(found, axis=0))]


def main(arguments=None) -> None:
    """Print the table: each class, and all."""
    seed, scenes = asked(__doc__, arguments, scenes=200)
    drawn = sorted(series(seed, k) for k in range(scenes) if draw(seed, k).name != "animal")
    kinds = {name: [one for _, found in group for one in found] for name, group in groupby(drawn, lambda pair: pair[0])}
    rows = [row(name, found) for name, found in kinds.items()]
    print(table([row("all", [one for found in kinds.values() for one in found]), *rows], HEAD))


if __name__ == "__main__":
    main()
