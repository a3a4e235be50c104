"""What an exact filter has: one that knows the laws by which objects of a class move, and how their plots err.

Particles carry what is not Gaussian, the legs: which one lasts, since when, where it ends. Position, velocity and the
sharpness of a manoeuvre are a Gaussian of each particle's own, carried by an extended Kalman filter (Rao-Blackwellised;
Doucet, de Freitas, Murphy and Russell 2000). Each goes on as its leg lasts and as its leg ends within the scan, so that
what is rare is weighed and not left to chance; where few explain a plot they are drawn anew, up to 64 times as many.
Its mean squared normal score is 1 but for the number of particles: a test of the filter, printed with it. A track that
runs out of particles is counted as lost. No animals: they turn many times between two fixes, and no Gaussian follows.

Who draws a motion has of mean NIS within .5 to 1.5, track by track, what turns that nobody announces leave.

Run: python -m driftwise_studies.score.motions.exact [--seed 0] [--scenes 100]
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from driftwise.estimators.track.estimator import TrackEstimator
from driftwise.results.bands import normal_score

from .bound import EDGES
from .drawing import asked, draw
from .field import number, table
from .jets import alone
from .laws import ACROSS, STRAIGHT, Law, Legs, move
from .measured import FIRST
from .scene import Scene
from .simulation import simulate

WORK = 600_000  # particles times plots of a track ..
PARTICLES = 2000, 8000  # .. and particles, least and most
LOST = 2.0  # mean squared normal score of an exact filter that has run out of particles
MORE, FEW = (1, 8, 64), 10.0  # times as many where fewer than so many explain a plot
CALM = 0.2  # of objects never manoeuvre
KERNEL = 0.05  # of the speed: half the way between two particles at first


def predict(law: Law, legs: Legs, x: np.ndarray, P: np.ndarray, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return mean and covariance d seconds on, in the same leg."""
    n = len(x)
    step = 1e-3 * np.sqrt(np.maximum(np.diagonal(P, axis1=1, axis2=2), 1e-18))
    at = move(legs, x, d)
    F = np.empty((n, 5, 5))
    for j in range(5):
        moved = x.copy()
        moved[:, j] += step[:, j]
        F[:, :, j] = (move(legs, moved, d) - at) / step[:, j : j + 1]
    P = F @ P @ np.swapaxes(F, 1, 2)
    v = np.maximum(np.hypot(at[:, 1], at[:, 3]), 1e-12)
    across = np.stack([at[:, 3] / v, -at[:, 1] / v], axis=1)
    q = law.wobble**2
    for i in range(2):
        for j in range(2):
            both = q * across[:, i] * across[:, j]
            P[:, 2 * i, 2 * j] += both * d**3 / 3
            P[:, 2 * i, 2 * j + 1] += both * d**2 / 2
            P[:, 2 * i + 1, 2 * j] += both * d**2 / 2
            P[:, 2 * i + 1, 2 * j + 1] += both * d
    legs.age[:] += np.where(legs.mode == STRAIGHT, d, np.where(legs.mode == ACROSS, np.exp(x[:, 4]) * d / v, 0.0))
    return at, P


def ahead(rng, law: Law, legs: Legs, x, P, d: float, left: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Take all particles d seconds on, through the ends of legs; ``left``: what the first still lasts."""
    x, P = predict(law, legs, x, P, np.minimum(left, d))
    over, rest = np.flatnonzero(left < d), (d - left)[left < d]
    while len(over):
        some, at, V = legs.take(over), x[over], P[over]
        law.begin(rng, some, at, V, np.arange(len(over)))
        left = law.remaining(some, at, rng.random(len(over)))
        at, V = predict(law, some, at, V, np.minimum(left, rest))
        x[over], P[over] = at, V
        for whole, part in zip(legs, some):
            whole[over] = part
        go_on = left < rest
        over, rest = over[go_on], (rest - left)[go_on]
    return x, P


class Said(NamedTuple):
    """Forecasts of one track: of each plot and coordinate."""

    mean: np.ndarray
    variance: np.ndarray
    normal_score: np.ndarray
    log_score: np.ndarray


def spread_out(rng, law: Law, legs: Legs, x, P, weight, d: float, more: int):
    """Return the particles d seconds on, each as its leg lasts and ``more`` times as it ends."""
    n, share = len(x), law.share_ending(legs, x, d)
    which = np.concatenate([np.arange(n), np.repeat(np.arange(n), more)])
    ends = np.arange(len(which)) >= n
    w = np.where(ends, share[which] / more, 1 - share[which]) * weight[which]
    used = np.flatnonzero(w > 1e-12 * w.max())
    which, ends, w = which[used], ends[used], w[used]
    u, s = rng.random(len(used)), share[which]
    legs, x, P = legs.take(which), x[which], P[which]
    left = law.remaining(legs, x, np.where(ends, u * s, s + u * (1 - s)))
    left = np.where(ends, np.minimum(left, d * (1 - 1e-9)), np.maximum(left, d))
    x, P = ahead(rng, law, legs, x, P, d, left)
    return legs, x, P, w / w.sum()


def exact(scene: Scene, time, position, particles: int) -> Said:
    """Filter the plots of a scene without troubles."""
    rng, law = np.random.default_rng([*scene.seed, 5]), Law(scene.kind, scene.sensors[0].scan)
    R, n = scene.sensors[0].deviation ** 2, particles
    made = Said(*(np.full((len(time), 2), np.nan) for _ in Said._fields))
    u = (rng.permutation(n) + rng.random(n)) / n
    v, way = np.exp(law.speed[0] + u * (law.speed[1] - law.speed[0])), 2 * np.pi * rng.random(n)
    x = np.zeros((n, 5))
    x[:, 0], x[:, 2] = position[0]
    x[:, 1], x[:, 3] = v * np.sin(way), v * np.cos(way)
    P = np.zeros((n, 5, 5))
    P[:, 0, 0] = P[:, 2, 2] = R
    P[:, 1, 1] = P[:, 3, 3] = (KERNEL * v) ** 2
    zero = np.zeros(n)
    legs = Legs(np.zeros(n, int), zero.copy(), np.ones(n), np.ones(n, int), rng.random(n) < CALM)
    weight = np.full(n, 1.0 / n)
    for k in range(1, len(time)):
        d = time[k] - time[k - 1]
        for more in MORE:
            legs1, x1, P1, w = spread_out(rng, law, legs, x, P, weight, d, more)
            mean, S = x1[:, [0, 2]], P1[:, [0, 2], [0, 2]] + R
            C, e = P1[:, 0, 2], position[k] - mean
            det = S[:, 0] * S[:, 1] - C**2
            z2 = (S[:, 1] * e[:, 0] ** 2 - 2 * C * e[:, 0] * e[:, 1] + S[:, 0] * e[:, 1] ** 2) / det
            log = np.log(w) - 0.5 * (z2 + np.log(det))
            after = np.exp(log - log.max())
            after /= after.sum()
            if 1 / np.sum(after**2) > FEW and z2.min() < 9.0:
                break
        m = w @ mean
        made.mean[k], made.variance[k] = m, w @ (S + (mean - m) ** 2)
        off = e / np.sqrt(S)
        made.normal_score[k] = normal_score(w @ ndtr(off), w @ ndtr(-off))
        made.log_score[k] = np.log(np.maximum(w @ (np.exp(-0.5 * off**2) / np.sqrt(2 * np.pi * S)), 1e-300))
        legs, x, P, w = legs1, x1, P1, after
        H = P[:, :, [0, 2]]
        inverse = np.empty((len(x), 2, 2))
        inverse[:, 0, 0], inverse[:, 1, 1] = S[:, 1] / det, S[:, 0] / det
        inverse[:, 0, 1] = inverse[:, 1, 0] = -C / det
        K = H @ inverse
        x = x + np.einsum("nij,nj->ni", K, e)
        P = P - K @ np.swapaxes(H, 1, 2)
        P = 0.5 * (P + np.swapaxes(P, 1, 2))
        q = np.sqrt(w)
        q /= q.sum()
        places = (np.arange(n) + rng.random()) / n
        chosen = np.minimum(np.searchsorted(np.cumsum(q), places), len(w) - 1)
        legs, x, P = legs.take(chosen), x[chosen], P[chosen]
        weight = w[chosen] / q[chosen] / np.sum(w[chosen] / q[chosen])
    return made


HEAD = (
    "plots", "tracks", "lost", "exact: NIS in .5 to 1.5", "median", "normal score in",
    "ours: NIS in", "normal score in", "ours, told the variance: NIS in", "normal score in",
)  # fmt: skip


def means(innovation, variance, score) -> tuple[float, float]:
    """Return mean NIS and mean squared normal score of a track, without its first plots."""
    return float(np.mean((innovation**2 / variance)[FIRST:])), float(np.mean(score[FIRST:] ** 2))


def main(arguments=None) -> None:
    """Print the table."""
    seed, scenes = asked(__doc__, arguments, scenes=100)
    found = []
    for scene in (alone(draw(seed, k)) for k in range(scenes)):
        if scene.name == "animal":
            continue
        plots = simulate(scene).plots
        time, position, n = plots.time, plots.position, len(plots)
        best = exact(scene, time, position, int(np.clip(WORK // n, *PARTICLES)))
        row = [float(n), *means(position - best.mean, best.variance, best.normal_score)]
        for R in (None, scene.sensors[0].deviation ** 2 * np.eye(2)):
            trace = TrackEstimator(scene.kind.told).scan(time, position, R)
            row += means(trace.innovation, trace.variance, trace.normal_score)
        found.append(row)
        print(scene.number, scene.name, *(f"{x:.2f}" for x in row), flush=True)
    print(report(np.array(found)))


def report(found: np.ndarray) -> str:
    """Return the table of rows of plots and, of the exact filter, ours, and ours told: mean NIS, mean squared score."""
    rows, within = [], (found >= 0.5) & (found <= 1.5)
    for least, most in ((EDGES[0], EDGES[-1]), *pairwise(EDGES)):
        some = (found[:, 0] >= least) & (found[:, 0] < most)
        if not some.any():
            continue
        share = [number(float(value)) for value in within[some].mean(axis=0)]
        middle, lost = number(float(np.median(found[some, 1])), 2), int(np.sum(found[some, 2] > LOST))
        rows.append([f"{least} to {most - 1}", f"{some.sum()}", f"{lost}", share[1], middle, *share[2:]])
    return table(rows, HEAD) + f"mean squared normal score of those not lost: {score_of(found):.3f}\n"


def score_of(found: np.ndarray) -> float:
    """Return the mean squared normal score of the exact filter over all plots of tracks that are not lost."""
    kept = found[found[:, 2] <= LOST]
    return float(np.average(kept[:, 2], weights=kept[:, 0]))


if __name__ == "__main__":
    main()
