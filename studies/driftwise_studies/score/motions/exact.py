"""What an exact filter has: one that knows the laws by which objects of a class move, and how their plots err.

Particles carry what is not Gaussian, the legs: which one lasts, since when, where it ends. Position, velocity and the
sharpness of a manoeuvre are a Gaussian of each particle's own, carried by an extended Kalman filter (Rao-Blackwellised;
Doucet, de Freitas, Murphy and Russell 2000). Each goes on as its leg lasts and as its leg ends within the scan, so that
what is rare is weighed and not left to chance; where few explain a plot they are drawn anew, up to 64 times as many.
Its mean squared normal score is 1 but for the number of particles: a test of the filter, printed with it. A track that
runs out of particles is counted as lost. No animals: they turn many times between two fixes, and no Gaussian follows.

Who draws a motion has of mean NIS within .5 to 1.5, track by track, what turns that nobody announces leave.

With ``--troubles`` scenes keep their troubles, and the filter knows the law of every plot's error (see `errors`): how
precise it is, how likely it is wild, its lattice, its sensor's offset and clock; and that objects rest. What it is not
told is when a leg ends and which plots are wild.

Run: python -m driftwise_studies.score.motions.exact [--seed 0] [--scenes 100] [--troubles]
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from driftwise.estimators.track.estimator import TrackEstimator
from driftwise.results.bands import normal_score

from .bound import EDGES
from .drawing import asked, draw
from .errors import Errors, alike, known, measure
from .field import number, of_kinds, table
from .jets import alone
from .laws import ACROSS, STRAIGHT, Law, Legs, halt, move
from .measured import FIRST
from .scene import ALONE, Scene
from .simulation import Seen, simulate

WORK = 600_000  # particles times plots of a track ..
PARTICLES = 2000, 8000  # .. and particles, least and most
LOST = 2.0  # mean squared normal score of an exact filter that has run out of particles
MORE, FEW = (1, 8, 64), 10.0  # times as many where fewer than so many explain a plot
NEAR = 9.0, 30.0  # .. or none is so many squared deviations off: normal errors, heavy tails
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
    q = (law.wobble * np.minimum(v / law.kind.speed[0], 1.0)) ** 2
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
    """Forecasts of one track: of each plot and coordinate, plots that are wild left aside."""

    mean: np.ndarray
    variance: np.ndarray
    normal_score: np.ndarray
    log_score: np.ndarray  # (T,) of the whole plot
    moving: np.ndarray  # (T,) probability that a manoeuvre lasts, that plot included


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


def exact(scene: Scene, time, position, particles: int, errors: Errors | None = None, knows: type[Law] = Law) -> Said:
    """Filter the plots of one object: without troubles, or with such ``errors``; by what one ``knows`` of motions."""
    errors = errors or alike(len(time), scene.sensors[0].deviation)
    rests, n = "rests" in scene.troubles, particles
    rng, law = np.random.default_rng([*scene.seed, 5]), knows(scene.kind, scene.sensors[0].scan, rests)
    nothing = np.full((len(time), 2), np.nan)
    made = Said(nothing.copy(), nothing.copy(), nothing.copy(), nothing[:, 0].copy(), np.zeros(len(time)))
    u = (rng.permutation(n) + rng.random(n)) / n
    v, way = np.exp(law.speed[0] + u * (law.speed[1] - law.speed[0])), 2 * np.pi * rng.random(n)
    x = np.zeros((n, 5))
    x[:, 0], x[:, 2] = position[0]
    x[:, 1], x[:, 3] = v * np.sin(way), v * np.cos(way)
    P = np.zeros((n, 5, 5))
    P[:, 0, 0] = P[:, 2, 2] = errors.deviation[0] ** 2 + errors.lattice**2 / 12
    P[:, 1, 1] = P[:, 3, 3] = (KERNEL * v) ** 2
    if rests:
        halt(x, P, np.flatnonzero(rng.random(n) < 0.5))
    zero = np.zeros(n)
    legs = Legs(np.zeros(n, int), zero.copy(), np.ones(n), np.ones(n, int), rng.random(n) < CALM)
    weight = np.full(n, 1.0 / n)
    for k in range(1, len(time)):
        d = time[k] - time[k - 1]
        for more in MORE:
            legs1, x1, P1, w = spread_out(rng, law, legs, x, P, weight, d, more)
            seen = measure(x1, P1, position[k], errors, k, rng)
            log = np.log(w) + seen.log
            after = np.exp(log - log.max())
            after /= after.sum()
            near = np.min(np.sum((position[k] - seen.mean) ** 2 / seen.variance, axis=1)) < NEAR[errors.heavy]
            if 1 / np.sum(after**2) > FEW and (near or errors.wild[k] > 0.0):
                break
        m = w @ seen.mean
        made.mean[k], made.variance[k] = m, w @ (seen.variance + (seen.mean - m) ** 2)
        made.normal_score[k] = normal_score(w @ seen.below, w @ seen.above)
        made.log_score[k] = log.max() + np.log(np.sum(np.exp(log - log.max())))
        legs, x, P, w = legs1, seen.x, seen.P, after
        made.moving[k] = w[legs.mode != STRAIGHT].sum()
        P = 0.5 * (P + np.swapaxes(P, 1, 2))
        q = np.sqrt(w)
        q /= q.sum()
        places = (np.arange(n) + rng.random()) / n
        chosen = np.minimum(np.searchsorted(np.cumsum(q), places), len(w) - 1)
        legs, x, P = legs.take(chosen), x[chosen], P[chosen]
        weight = w[chosen] / q[chosen] / np.sum(w[chosen] / q[chosen])
    return made


HEAD = (
    "", "tracks", "lost", "exact: NIS in .5 to 1.5", "in .8 to 1.5", "median", "normal score in",
    "ours: NIS in", "in .8 to 1.5", "normal score in",
    "ours, told the variance: NIS in", "in .8 to 1.5", "normal score in",
)  # fmt: skip


class Found(NamedTuple):
    """One track: mean NIS and mean squared normal score of the exact filter, of ours, of ours told the variance."""

    scene: Scene
    plots: int
    means: tuple[float, ...]


def means(innovation, variance, score, tame) -> tuple[float, float]:
    """Return mean NIS and mean squared normal score of a track, without its first plots and wild ones."""
    used = tame & (np.arange(len(tame)) >= FIRST)
    return float(np.mean((innovation**2 / variance)[used])), float(np.mean(score[used] ** 2))


def filtered(scene: Scene, told: Seen, who: int, work: int = WORK) -> Found:
    """Filter the plots of one object of a scene, each ``told`` with the variance of its error, by all three."""
    at = np.flatnonzero(told.object == who)
    time, position, wild = told.plots.time[at], told.plots.position[at], told.wild[at]
    sensor = (told.plots.sensor[at] == "B").astype(int)
    variance = told.plots.covariance[at][:, 0, 0]
    errors = known(scene, sensor, variance, wild)
    when = time - np.array([s.clock for s in scene.sensors])[sensor]  # it was where the plot says
    where = position - np.array([s.offset for s in scene.sensors])[sensor]
    order = np.argsort(when, kind="stable")
    ordered = errors._replace(**{f: getattr(errors, f)[order] for f in ("deviation", "wild", "size")})
    best = exact(scene, when[order], where[order], int(np.clip(work // len(at), *PARTICLES)), ordered)
    innovation = where[order] - best.mean
    row = list(means(innovation, best.variance, best.normal_score, ~wild[order]))
    for R in (
        np.full_like(variance, scene.stated * scene.sensors[0].deviation ** 2) if scene.stated else None,
        variance,
    ):
        stated = None if R is None else R[:, None, None] * np.eye(2)
        trace = TrackEstimator(scene.kind.told).scan(time, position, stated)
        row += means(trace.innovation, trace.variance, trace.normal_score, ~wild)
    return Found(scene, int(np.sum(~wild)), tuple(row))


def main(arguments=None) -> None:
    """Print the table."""
    words = "leave the scenes their troubles"
    seed, scenes, troubles = asked(__doc__, arguments, scenes=100, troubles=words)
    found = []
    for scene in (draw(seed, k) if troubles else alone(draw(seed, k)) for k in range(scenes)):
        if scene.name == "animal":
            continue
        told = simulate(scene, stated=True)
        for who in range(scene.objects):
            if np.sum(told.object == who) >= EDGES[0]:
                one = filtered(scene, told, who)
                found.append(one)
                print(scene, *(f"{x:.2f}" for x in one.means), flush=True)
    print(report(found))


def report(found: list[Found]) -> str:
    """Return the table: by number of plots, by trouble, by class."""
    parts = {f"{a} to {b - 1} plots": [f for f in found if a <= f.plots < b] for a, b in pairwise(EDGES)}
    parts |= {f"with {t}": [f for f in found if t in f.scene.troubles] for t in ALONE}
    parts |= of_kinds(found)
    rows = [line("all", found)] + [line(words, some) for words, some in parts.items() if some]
    kept = [f for f in found if f.means[1] <= LOST]
    score = np.average([f.means[1] for f in kept], weights=[f.plots for f in kept])
    return table(rows, HEAD) + f"mean squared normal score of those not lost: {score:.3f}\n"


def line(words: str, found: list[Found]) -> list[str]:
    """Return a row of the table."""
    m = np.array([f.means for f in found])
    row = [words, f"{len(found)}", f"{np.sum(m[:, 1] > LOST)}"]
    for k in range(0, 6, 2):
        row += [number(float(np.mean((m[:, k] >= least) & (m[:, k] <= 1.5)))) for least in (0.5, 0.8)]
        row += [number(float(np.median(m[:, 0])), 2)] if k == 0 else []
        row += [number(float(np.mean((m[:, k + 1] >= 0.5) & (m[:, k + 1] <= 1.5))))]
    return row


if __name__ == "__main__":
    main()
