"""Aircraft whose positions are stamped when they come: single ones late, runs of late ones, two stations in turn.

Scenes are those of `drawing` in which something flies, seen by one sensor every .1 to 4 s, without other wild plots;
each has one of the ways of `latency`.

Run: python -m driftwise_studies.score.motions.receivers [--seed 0] [--scenes 300]
"""

from __future__ import annotations

import numpy as np

from . import drawing
from .field import Total, table
from .latency import WAYS
from .measured import Found, one
from .scene import Scene

FLYING = "flight", "jet", "helicopter", "glider", "uav"
SCAN, PLOTS = (0.1, 4.0), (200.0, 1000.0)
OTHERS = "rests", "wild", "second sensor"


def draw(seed: int, number: int) -> Scene | None:
    """Return scene ``number`` of ``seed`` with late stamps; None where nothing flies."""
    scene = drawing.draw(seed, number)
    if scene.name not in FLYING:
        return None
    rng = np.random.default_rng([seed, number, 31])
    way = str(rng.choice(list(WAYS)))
    sensor = scene.sensors[0]._replace(scan=drawing.between(rng, SCAN))
    return scene._replace(
        troubles=(*(name for name in scene.troubles if name not in OTHERS), f"late: {way}"), wild=0.0, along=False,
        sensors=(sensor,), plots=int(drawing.between(rng, PLOTS)), late=way,
    )  # fmt: skip


def play(seed: int, scenes: int) -> list[Found]:
    """Return what was found in those of so many scenes in which something flies."""
    drawn = (draw(seed, number) for number in range(scenes))
    return [one(scene) for scene in drawn if scene is not None]


def main(arguments=None) -> None:
    """Print the table: all, and each way."""
    seed, scenes = drawing.asked(__doc__, arguments, scenes=300)
    found = play(seed, scenes)
    rows = [("all", found), *((way, [f for f in found if f.scene.late == way]) for way in WAYS)]
    print(table([Total(some).row(name) for name, some in rows if some]))


if __name__ == "__main__":
    main()
