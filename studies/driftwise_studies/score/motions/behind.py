"""Positions that stay behind and catch up: what is told again, or late, is stamped when it comes.

A receiver, a transponder or a network repeats a position for a moment; the plots that follow catch up. They err along
the path, one after the other to the same side, as plots do that a manoeuvre leads away. Scenes are those of `drawing`
without other wild plots.

Run: python -m driftwise_studies.score.motions.behind [--seed 0] [--scenes 150]
"""

from __future__ import annotations

import numpy as np

from . import drawing
from .field import by_kind
from .measured import Found, one
from .scene import Scene

SHARE = 0.005, 0.05  # of the plots at which one stays behind


def draw(seed: int, number: int) -> Scene:
    """Return scene ``number`` of ``seed`` whose positions now and then stay behind."""
    scene = drawing.draw(seed, number)
    share = drawing.between(np.random.default_rng([seed, number, 29]), SHARE)
    troubles = *(name for name in scene.troubles if name != "wild"), "behind"
    return scene._replace(troubles=troubles, wild=0.0, along=False, behind=share)


def play(seed: int, scenes: int) -> list[Found]:
    """Return what was found in so many scenes."""
    return [one(draw(seed, number)) for number in range(scenes)]


def main(arguments=None) -> None:
    """Print the table: all, and each class."""
    seed, scenes = drawing.asked(__doc__, arguments)
    print(by_kind(play(seed, scenes), has_all=True))


if __name__ == "__main__":
    main()
