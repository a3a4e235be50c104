"""Objects that are reported more often from one plot on, or less: a ship gets under way, a radar hands over.

Scenes are those of `drawing`, one object and one sensor, with rests and lost plots alone; the time between plots
changes by a factor of 3 to 18 after 30 to 150 of them. Ours is held against two on the same plots: this tracker when it
begins with the new pace, and a Kalman filter of constant velocity that is told the variance of plots, whose white
acceleration is the best in hindsight for all of its class.

Run: python -m driftwise_studies.score.motions.handovers [--seed 0] [--scenes 120]
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from driftwise.estimators.track.estimator import TrackEstimator

from . import drawing
from .field import mean, number, table
from .scene import Scene
from .simulation import simulate

CLASSES = "flight", "jet", "helicopter", "glider", "uav", "boat", "walker"
FACTORS = 3.0, 18.0
OFTENER = 0.6  # of the scenes
BEFORE, AFTER = (30.0, 150.0), (40.0, 150.0)  # plots
SPANS = (1, 5), (5, 20), (20, 40), (40, 150)  # plots after the change
YOUNG = 5  # plots with which who begins anew is no opponent
WHITE = 10.0 ** np.arange(-3.0, 4.5, 0.5)  # q, in squares of the acceleration of manoeuvres
CAP = 16.0  # of e^2/S where q is chosen


class Drawn(NamedTuple):
    """One object's plots with their truth."""

    scene: Scene
    time: np.ndarray
    plots: np.ndarray
    velocity: np.ndarray
    at: int  # the first plot of the new pace


def draw(seed: int, n: int) -> Scene:
    """Return scene ``n`` of ``seed``, whose plots come at another pace from one on.

    Examples
    --------
    >>> from driftwise_studies.score.motions import handovers
    >>> print(handovers.draw(0, 2))
    2: glider, 168 plots, 12 s, 4.2 m; handover
    """
    rng = np.random.default_rng([seed, n, 31])
    scene = next(s for s in (drawing.draw(seed, 100 * n + k) for k in range(100)) if s.name in CLASSES)
    factor, sensor = drawing.between(rng, FACTORS), scene.sensors[0]
    before, after = int(drawing.between(rng, BEFORE)), int(drawing.between(rng, AFTER))
    if rng.random() > OFTENER:
        factor, sensor = 1 / factor, sensor._replace(scan=min(sensor.scan * factor**0.5, scene.kind.scan[1]))
    return scene._replace(
        number=n, seed=(seed, n), troubles=(*(t for t in scene.troubles if t in ("rests", "gaps")), "handover"),
        plots=before + after, sensors=(sensor,), objects=1, keyed=True, single=False, lattice=0.0, wild=0.0,
        pauses=0, precise=(0, 1.0), uneven=0.05, heavy=False, stated=0.0, handover=(before, factor),
    )  # fmt: skip


def drawn(scene: Scene) -> Drawn:
    """Return the plots of a scene."""
    seen, (before, factor), scan = simulate(scene), scene.handover, scene.sensors[0].scan
    at = int(np.searchsorted(seen.plots.time, scan * factor * before + 0.5 * scan))
    return Drawn(scene, seen.plots.time, seen.plots.position, seen.velocity, at)


def straight(one: Drawn, q: float) -> np.ndarray:
    """Return what constant velocity under white acceleration forecasts, told the variance of plots: (2, 2, T)."""
    from ...papers.kalman import interacting

    r, time = one.scene.sensors[0].deviation ** 2, one.time - one.time[0]
    told = np.zeros(1), np.array([q]), 0.0, 0.0, one.scene.kind.told, 0.0
    return np.stack([interacting(time, y, r, *told) for y in one.plots.T], axis=1)


def opponents(all_drawn: list[Drawn]) -> list[np.ndarray]:
    """Return each one's forecast by the filter that is best for all of its class: mean and variance, (2, 2, T)."""
    best = {}
    for name in {one.scene.name for one in all_drawn}:
        own = [one for one in all_drawn if one.scene.name == name]
        unit = np.prod(own[0].scene.kind.acceleration)
        best[name] = min(unit * WHITE, key=lambda q: sum(surprise(one, straight(one, q)) for one in own))
    return [straight(one, best[one.scene.name]) for one in all_drawn]


def surprise(one: Drawn, told: np.ndarray) -> float:
    """Return minus the log likelihood of plots, an error counted as four deviations at most."""
    z2 = np.minimum((one.plots.T - told[0]) ** 2 / told[1], CAP)
    return float(np.sum((z2 + np.log(told[1]))[:, 3:]))


def judged(one: Drawn, other: np.ndarray) -> list[list[float]]:
    """Return for each span: mean NIS, mean squared normal score, log density, errors and velocities over others'."""
    est = TrackEstimator(one.scene.kind.told)
    ours, anew = est.scan(one.time, one.plots), est.scan(one.time[one.at :], one.plots[one.at :])
    unit, rows = 2 * np.log(one.scene.sensors[0].deviation), []
    for begin, end in SPANS:
        now, then = slice(one.at + begin, one.at + end), slice(begin, end)
        if len(one.time) <= now.start:
            rows.append([np.nan] * 9)
            continue
        y, v = one.plots[now], one.velocity[now]
        errors = [size(y - said) for said in (ours.prediction[now], other[0].T[now], anew.prediction[then])]
        speeds = [size(v - said) for said in (ours.velocity[now], anew.velocity[then])]
        known = begin >= YOUNG
        log_other = -0.5 * ((y - other[0].T[now]) ** 2 / other[1].T[now] + np.log(2 * np.pi * other[1].T[now]))
        rows.append([
            float(ours.nis[now].mean()), float(np.mean(ours.normal_score[now] ** 2)),
            float(ours.log_score[now].sum(axis=1).mean() + unit), float(log_other.sum(axis=1).mean() + unit),
            float(anew.log_score[then].sum(axis=1).mean() + unit) if known else np.nan,
            errors[0] / errors[1], errors[0] / errors[2] if known else np.nan,
            speeds[0] / max(speeds[1], 1e-9) if known else np.nan,
            float(anew.nis[then].mean()) if known else np.nan,
        ])  # fmt: skip
    return rows


def size(errors: np.ndarray) -> float:
    """Return the root of the mean squared length."""
    return float(np.sqrt(np.mean(np.sum(errors**2, axis=1))))


HEAD = (
    "", "plots after", "tracks", "NIS, median", "NIS in .5 to 1.5", "who begins anew", "normal score in", "density",
    "of constant velocity", "of who begins anew", "error over constant velocity's", "over who begins anew",
    "velocity over who begins anew",
)  # fmt: skip


def main(arguments=None) -> None:
    """Print the table."""
    seed, scenes = drawing.asked(__doc__, arguments, scenes=120)
    found = [drawn(draw(seed, n)) for n in range(scenes)]
    told = np.array([judged(one, other) for one, other in zip(found, opponents(found))])
    factor, rows = np.array([one.scene.handover[1] for one in found]), []
    for name, chosen in (("more often", factor > 1.0), ("less often", factor < 1.0)):
        for k, (begin, end) in enumerate(SPANS):
            nis, normal, *densities, error, to_anew, velocity, anew = told[chosen, k].T
            inside = [mean((x >= 0.5) & (x <= 1.5)) for x in (c[np.isfinite(c)] for c in (nis, anew, normal))]
            ratios = [float(np.exp(mean(np.log(c)))) for c in (error, to_anew, velocity)]
            rows.append([
                name, f"{begin + 1} to {end}", str(int(np.isfinite(nis).sum())), number(float(np.nanmedian(nis)), 2),
                *map(number, inside), *(number(mean(c), 2) for c in densities), *map(number, ratios),
            ])  # fmt: skip
    print(table(rows, HEAD))


if __name__ == "__main__":
    main()
