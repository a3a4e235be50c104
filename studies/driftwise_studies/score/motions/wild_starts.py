"""Objects whose first plots hold wild ones: what is learnt of errors then is several times too large.

Scenes are those of `drawing`, one object seen by one sensor, without lattices, precise starts, stated variances and
other wild plots; one to three of the first ten plots are wild, the very first as likely as any.

Run: python -m driftwise_studies.score.motions.wild_starts [--seed 0] [--scenes 150]
"""

from __future__ import annotations

import numpy as np

from . import drawing
from .field import Total, table
from .measured import Found, one
from .scene import Scene

MOST = 3  # of the first plots that are wild
OTHERS = "lattice", "wild", "precise start", "second sensor", "stated", "company"


def draw(seed: int, number: int) -> Scene:
    """Return scene ``number`` of ``seed`` with a wild start."""
    scene = drawing.draw(seed, number)
    early = int(np.random.default_rng([seed, number, 28]).integers(1, MOST + 1))
    troubles = *(name for name in scene.troubles if name not in OTHERS), "wild start"
    return scene._replace(
        troubles=troubles, early=early, lattice=0.0, wild=0.0, precise=(0, 1.0), stated=0.0, objects=1, keyed=True,
        single=False, sensors=scene.sensors[:1],
    )  # fmt: skip


def play(seed: int, scenes: int, is_wild: bool = True) -> list[Found]:
    """Return what was found in so many scenes, or in the same without their wild plots."""
    drawn = (draw(seed, number) for number in range(scenes))
    return [one(scene if is_wild else scene._replace(early=0)) for scene in drawn]


def main(arguments=None) -> None:
    """Print the table: all, by how many are wild, and the same scenes with none."""
    seed, scenes = drawing.asked(__doc__, arguments)
    found = play(seed, scenes)
    rows = [("all", found), *((str(n), [f for f in found if f.scene.early == n]) for n in range(1, MOST + 1))]
    rows.append(("none", play(seed, scenes, False)))
    print(table([Total(some).row(name) for name, some in rows if some]))


if __name__ == "__main__":
    main()
