"""Records on an even clock that nobody saw so: plots between two reports were drawn on the line between them.

Publishers of flights resample, and bridge pauses. A filter that takes such plots for measurements learns that they do
not err, and the first report that turns is a million of its deviations off. Scenes are those of `drawing`, of which a
share of the plots was seen; without wild plots and lattices, and without animals, whose legs lead around the earth.

Run: python -m driftwise_studies.score.motions.resampled [--seed 0] [--scenes 150]
"""

from __future__ import annotations

import numpy as np

from . import drawing
from .field import by_kind
from .measured import Found, one
from .scene import Scene

SHARE = 0.15, 0.8  # of the plots that were seen


def draw(seed: int, number: int) -> Scene | None:
    """Return scene ``number`` of ``seed``, resampled; None where it cannot be."""
    scene = drawing.draw(seed, number)
    if scene.name == "animal":
        return None
    share = drawing.between(np.random.default_rng([seed, number, 27]), SHARE)
    troubles = *(name for name in scene.troubles if name not in ("wild", "lattice")), "resampled"
    return scene._replace(troubles=troubles, lattice=0.0, wild=0.0, along=False, resampled=share)


def play(seed: int, scenes: int) -> list[Found]:
    """Return what was found in so many scenes."""
    drawn = (draw(seed, number) for number in range(scenes))
    return [one(scene) for scene in drawn if scene is not None]


def main(arguments=None) -> None:
    """Print the table: all, and each class."""
    seed, scenes = drawing.asked(__doc__, arguments)
    print(by_kind(play(seed, scenes), has_all=True))


if __name__ == "__main__":
    main()
