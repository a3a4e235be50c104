"""What the share of tracks whose mean NIS is in .5 to 1.5 can be: ours beside one that knows the error of every plot.

A mean of squares is what its largest square is. The first plot after a precise start, of a manoeuvre that is large
beside the errors or after a rest in one cell is hundreds to millions of its variance, whoever waits for it unknowing.

Run: python -m driftwise_studies.score.motions.bound [--seed 0] [--scenes 600]
"""

from __future__ import annotations

import argparse

import numpy as np

from .drawing import draw
from .field import number, table
from .measured import FEW, LONG, Found, one
from .scene import ALONE

HEAD = (
    "",
    "tracks",
    "in",
    "below",
    "above",
    f"above by {FEW} plots",
    *(f"{where} who knows" for where in ("in", "below", "above")),
)


def shares(found: list[Found], trouble: str | None) -> tuple[int, list[float]]:
    """Return how many long tracks scenes with a trouble have, and the shares of them in, below and above the band."""
    chosen = [f for f in found if trouble is None or trouble in (f.scene.troubles or ("nothing",))]
    both = np.array([(t.nis, t.most_nis) for f in chosen for t in f.tracks if t.plots >= LONG]).reshape(-1, 2)
    low, high = both[:, 0] < 0.5, both[:, 0] > 1.5
    parts = ~(low | high), low, high, high & (both[:, 1] <= 1.5)
    return len(both), [float(np.mean(part)) if len(both) else np.nan for part in parts]


def main(arguments=None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--scenes", type=int, default=600)
    asked = parser.parse_args(arguments)
    scenes = [draw(asked.seed, k) for k in range(asked.scenes)]
    ours, knowing = [one(scene) for scene in scenes], [one(scene, stated=True) for scene in scenes]
    rows = []
    for trouble in (None, *ALONE):
        (n, mine), (_, theirs) = shares(ours, trouble), shares(knowing, trouble)
        rows.append([trouble or "all", str(n), *map(number, mine), *map(number, theirs[:3])])
    print(table(rows, HEAD))


if __name__ == "__main__":
    main()
