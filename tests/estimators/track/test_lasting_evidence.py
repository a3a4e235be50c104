"""Between plots that lie farther apart than any manoeuvre lasts, who was right stays so: evidence is kept longer."""

import numpy as np
from driftwise_studies.score.motions import draw, simulate
from driftwise_studies.score.motions.jets import alone

from driftwise import TrackEstimator


def test_fixes_of_animals_hours_apart_are_believed():
    """Steps are as large as the range, and only many plots tell them from errors."""
    off = []
    for scene in (draw(0, number) for number in range(250)):
        if scene.name == "animal":
            scene = alone(scene)
            seen = simulate(scene)
            trace = TrackEstimator(scene.kind.told).scan(seen.plots.time, seen.plots.position)
            off.append(np.sqrt(np.mean((trace.position - seen.truth)[20:] ** 2)) / scene.sensors[0].deviation)
    assert len(off) == 25
    assert np.exp(np.mean(np.log(off))) < 6.4  # 6.9 while ten plots were remembered, now 6.0
