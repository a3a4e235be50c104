"""Drawn jets: our tracks beside an interacting multiple model of three Kalman filters, tuned by hand for them.

The three are constant velocity and two of Singer's (1970), gentle and sharp, mixed as Blom and Bar-Shalom (1988) say;
they are told the standard deviation of a plot, ours are told the class. Each setting of the grid is one tuning for all
jets; the best of them in hindsight, over all scenes judged, is the opponent.

Run: python -m driftwise_studies.score.motions.jets [--seed 1] [--scenes 600]
"""

from __future__ import annotations

from itertools import product

import numpy as np

from driftwise.estimators.track.estimator import TrackEstimator
from driftwise.models.manoeuvre import response, spread

from .drawing import asked, draw
from .scene import Scene
from .simulation import simulate

FIRST = 10  # plots that are not scored
GRID = tuple(product((0.3, 1.0, 3.0), (5.0, 15.0), (25.0, 50.0), (4.0, 12.0), (0.85, 0.93, 0.97)))
NAMES = "straight, m/s^2", "gentle", "sharp, m/s^2", "lasts, s", "stays, per plot"


def alone(scene: Scene) -> Scene:
    """Return a scene without its troubles: one jet, one sensor."""
    return scene._replace(
        troubles=(), sensors=scene.sensors[:1], objects=1, keyed=True, heavy=False, lattice=0.0, wild=0.0,
        missing=0.0, pauses=0, precise=(0, 1.0), uneven=0.0, stated=0.0,
    )  # fmt: skip


def imm(time, position, deviation: float, speed: float, grid=GRID) -> np.ndarray:
    """Return the forecast of each plot by each tuning, (T, G, 2); states of a coordinate are position, velocity, a."""
    setting = np.array(grid)
    G, R = len(setting), deviation**2
    x = np.zeros((G, 3, 2, 3))  # tuning, model, coordinate, state
    x[..., 0] = position[0]
    P = np.zeros((G, 3, 3, 3)) + np.diag([R, speed**2, 0.0])  # both coordinates have the same
    P[:, 1:, 2, 2] = setting[:, 1:3] ** 2
    stay = setting[:, 4, None, None]
    chain = np.where(np.eye(3, dtype=bool), stay, (1 - stay) / 2)
    mu, said = np.full((G, 3), 1 / 3), np.full((len(time), G, 2), np.nan)
    for k in range(1, len(time)):
        d = time[k] - time[k - 1]
        F, Q = models(setting, d)
        share = chain * mu[:, :, None]  # from, to
        ahead = share.sum(axis=1)
        share = share / ahead[:, None]
        mixed = np.einsum("gij,gics->gjcs", share, x)
        apart = x[:, :, None] - mixed[:, None]  # from, to, coordinate, state
        spread_of = np.einsum("gij,gijcs,gijct->gjst", share, apart, apart) / 2
        P = np.einsum("gij,gist->gjst", share, P) + spread_of
        x = np.einsum("gjst,gjct->gjcs", F, mixed)
        P = F @ P @ np.swapaxes(F, -1, -2) + Q
        said[k] = np.einsum("gj,gjc->gc", ahead, x[..., 0])
        S, e = P[..., 0, 0] + R, position[k] - x[..., 0]
        log = np.log(ahead) - np.log(S) - 0.5 * (e**2).sum(axis=2) / S
        mu = np.exp(log - log.max(axis=1, keepdims=True))
        mu = np.maximum(mu / mu.sum(axis=1, keepdims=True), 1e-12)
        K = P[..., 0] / S[..., None]
        x = x + e[..., None] * K[:, :, None]
        P = P - K[..., None] * P[:, :, None, 0]
    return said


def models(setting: np.ndarray, d: float) -> tuple[np.ndarray, np.ndarray]:
    """Return transitions and noises of the three models of each tuning over d seconds, (G, 3, 3, 3) each."""
    G = len(setting)
    F, Q = np.zeros((G, 3, 3, 3)), np.zeros((G, 3, 3, 3))
    F[:, 0, :2, :2] = [[1.0, d], [0.0, 1.0]]
    Q[:, 0, :2, :2] = (setting[:, 0] ** 2 * d)[:, None, None] * [[d * d / 3, d / 2], [d / 2, 1.0]]
    for lasts in np.unique(setting[:, 3]):
        used, alpha = setting[:, 3] == lasts, 1.0 / lasts
        s, g, f = response(alpha, d)
        pp, pv, pa, vv, va, aa = spread(alpha, d)
        F[used, 1:] = [[1.0, d, s], [0.0, 1.0, g], [0.0, 0.0, f]]
        for i in (1, 2):
            size = 2 * alpha * setting[used, i] ** 2
            Q[used, i] = size[:, None, None] * np.array([[pp, pv, pa], [pv, vv, va], [pa, va, aa]])
    return F, Q


def main(arguments=None) -> None:
    """Print the ratio, and the tuning that it is held against."""
    seed, scenes = asked(__doc__, arguments, seed=1, scenes=600)
    drawn = (draw(seed, k) for k in range(scenes))
    logs = []
    for scene in (alone(s) for s in drawn if s.name == "jet"):
        seen = simulate(scene)
        time, plots = seen.plots.time, seen.plots.position
        ours = TrackEstimator(scene.kind.told).scan(time, plots).prediction
        told = imm(time, plots, scene.sensors[0].deviation, scene.kind.told)
        error = np.concatenate([told, ours[:, None]], axis=1)[FIRST:] - seen.truth[FIRST:, None]
        logs.append(0.5 * np.log(np.mean(np.sum(error**2, axis=2), axis=0)))
    each = np.array(logs)
    best = int(each[:, :-1].mean(axis=0).argmin())
    behind = each[:, -1] - each[:, best]
    print(f"seed {seed}, {len(each)} jets; of {len(GRID)} tunings the best in hindsight:")
    print(", ".join(f"{name} {value:g}" for name, value in zip(NAMES, GRID[best])))
    mean, middle, worst = np.exp((behind.mean(), np.median(behind), behind.max()))
    print(f"error of our forecasts over its: {mean:.3f} on average, median {middle:.3f}, worst {worst:.2f}")


if __name__ == "__main__":
    main()
