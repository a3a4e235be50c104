"""How soon a manoeuvre can be told: by exact filters that know all laws and less, by ours; plots are 1 to 4 s apart.

The exact filter (`exact`, with the law of every plot's error) tells an onset where its probability of a manoeuvre rises
above a threshold, and may tell the next once it was below `OVER`; the threshold is the lowest with at most `MOST_FALSE`
false onsets of 1000 quiet plots. Who knows less of motions: not how long legs last (`laws.Forgetful`); of the class
what is fast, and nothing else, as a tracker (`laws.Stranger`).

Objects of one sensor, 30 to 320 plots, no animals. Delays are from the true beginning, the median of those told: what
nobody can shorten is the time that a manoeuvre takes to lead away from straight flight. A median of those told is later
for who tells more, so the others are of all, told or not: who tells seven of ten with a median of 6 s has .35 of all
within 6 s.

Run: python -m driftwise_studies.score.motions.soonest [--seed 0] [--scenes 1000]
"""

from __future__ import annotations

from collections import defaultdict

import numpy as np

from driftwise.estimators.track.estimator import TrackEstimator

from .bound import EDGES
from .drawing import asked, draw
from .errors import known
from .exact import exact
from .field import SCANS, SHARES, SOON, table, told_by
from .laws import Forgetful, Law, Stranger
from .measured import FIRST, onsets
from .scene import Scene
from .simulation import Seen, simulate

MOST = 320  # plots of a track
THRESHOLDS, OVER = np.arange(0.2, 0.99, 0.01), 0.3  # of the probability of a manoeuvre
MOST_FALSE = 1.0  # onsets of 1000 quiet plots
WORK, PARTICLES = 250_000, (1000, 3000)  # particles times plots of a track, and particles
KNOWS = {
    "exact": Law,
    "not told how long legs last": Forgetful,
    "nor of the class but what is fast": Stranger,
}
HEAD = (
    *("onset", "quiet plots", "false onsets, of 1000", "told", "median delay, s", f"within {SOON:g} s, of all"),
    *(f"{100 * share:g} % by, s" for share in SHARES),
)


def risen(probability: np.ndarray, threshold: float) -> np.ndarray:
    """Return where an onset is told, (T,): the threshold is passed, and one told before is over.

    >>> np.flatnonzero(risen(np.array([0, 0, 0, 0, 0, 0, 0.9, 0.6, 0.9, 0.1, 0.9]), 0.8)).tolist()
    [6, 10]
    """
    told, lasts = np.zeros(len(probability), bool), False
    for k, p in enumerate(probability):
        told[k] = not lasts and p > threshold and k >= FIRST + 3
        lasts = told[k] or (lasts and p > OVER)
    return told


def followed(scene: Scene, seen: Seen, who: int) -> dict[str, list[tuple]]:
    """Return quiet plots, false onsets and delays of one object by who tells them, at each threshold."""
    at = np.flatnonzero(seen.object == who)
    time, position, variance = seen.plots.time[at], seen.plots.position[at], seen.plots.covariance[at]
    errors = known(scene, np.zeros(len(at), int), variance[:, 0, 0], seen.wild[at])
    estimator, scan = TrackEstimator(scene.kind.told), scene.sensors[0].scan
    told = {}
    for words, law in KNOWS.items():
        said = exact(scene, time, position, int(np.clip(WORK // len(at), *PARTICLES)), errors, law)
        told[words] = [risen(said.moving, p) for p in THRESHOLDS]
    told["ours"] = [estimator.scan(time, position).onset]
    told["ours, told the variance"] = [estimator.scan(time, position, variance).onset]
    return {name: [onsets(scene, time, one, seen.paths[who], scan) for one in some] for name, some in told.items()}


def main(arguments=None) -> None:
    """Print the table."""
    seed, scenes = asked(__doc__, arguments, scenes=1000)
    found = defaultdict[str, list[list[tuple]]](list)
    for scene in (draw(seed, k) for k in range(scenes)):
        if scene.name == "animal" or len(scene.sensors) > 1 or not SCANS[0] <= scene.sensors[0].scan < SCANS[1]:
            continue
        seen = simulate(scene, stated=True)
        for who in range(scene.objects):
            if EDGES[0] <= np.sum(seen.object == who) <= MOST:
                for name, one in followed(scene, seen, who).items():
                    found[name].append(one)
    print(table([row(name, allowed(some)) for name, some in found.items()], HEAD))


def allowed(found: list[list[tuple]]) -> list[tuple]:
    """Return what each track has at the lowest threshold with at most ``MOST_FALSE`` false onsets, else at the last."""
    for some in zip(*found):
        if 1000 * sum(one[1] for one in some) <= MOST_FALSE * sum(one[0] for one in some):
            break
    return list(some)


def row(name: str, some: list[tuple]) -> list[str]:
    """Return a row of the table."""
    quiet, false, delays = sum(one[0] for one in some), sum(one[1] for one in some), [d for one in some for d in one[2]]
    told, rate = np.isfinite(delays), 1000 * false / quiet
    median = float(np.median(np.array(delays)[told]))
    return [
        *(name, f"{quiet}", f"{rate:.2f}", f"{told.mean():.2f} of {len(told)}", f"{median:.1f}"),
        *told_by(np.array(delays)),
    ]


if __name__ == "__main__":
    main()
