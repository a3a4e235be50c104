"""Scenes with their truth: where objects were, how they moved, when they manoeuvred, and what sensors said of it."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from driftwise.tracking.frames import east_north, geographic
from driftwise.tracking.plots import Plots, plots

from .drawing import between
from .latency import WAYS
from .scene import Scene, Sensor

STEPS = 8  # between two plots, at least
WOBBLE = 0.02  # acceleration of what goes straight, of the least that its manoeuvres have
WILDEST = 8.0, 100.0  # deviations
EARLY = 10  # plots of a start
LEAST_LEG = 4.0  # scans
STAYED, CAUGHT_UP = (0.5, 2.0), (2, 6)  # scans that a position is old, plots until it is of now
BRIDGED = 30  # plots of the longest pause that a publisher bridges, at most
PLACE = 48.0, 11.0  # degrees, where he does


class Leg(NamedTuple):
    """A stretch of one motion: acceleration along the path and across it, m/s^2; it ends at this time."""

    end: float
    along: float
    across: float
    target: float  # m/s, where hurrying or slowing stops


class Path(NamedTuple):
    """Truth of one object at the times asked for."""

    position: np.ndarray  # (T, 2)
    velocity: np.ndarray
    manoeuvres: np.ndarray  # (M, 2) begin and end, s
    sizes: np.ndarray  # (M,) m that it leads away from going on straight


class Seen(NamedTuple):
    """Plots of a scene in order of time, and the truth of each."""

    plots: Plots
    object: np.ndarray  # (T,) which
    truth: np.ndarray  # (T, 2) position at the time of the stamp
    velocity: np.ndarray  # (T, 2)
    wild: np.ndarray  # (T,) bool
    paths: tuple[Path, ...]


def simulate(scene: Scene, stated: bool = False) -> Seen:
    """Return the plots of a scene and their truth; ``stated``: each with the variance that its error was drawn with."""
    rng = np.random.default_rng([*scene.seed, 1])
    times = [stamps(rng, scene, s) for s in scene.sensors]
    span, parts, paths = times[0][-1] - times[0][0], [], []
    times = [t[t <= times[0][-1]] for t in times]
    for k in range(scene.objects):
        legs = itinerary(rng, scene, span)
        instants = [t - s.clock for t, s in zip(times, scene.sensors)]  # when it was where the plot says
        path = walk(rng, scene, legs, np.concatenate([*times, *instants]))
        paths.append(path)
        at = 0
        for i, sensor in enumerate(scene.sensors):
            now = slice(at, at + len(times[i]))
            then = slice(now.start + sum(map(len, times)), now.stop + sum(map(len, times)))
            parts.append(seen(rng, scene, sensor, k, times[i], path, now, then, stated))
            at = now.stop
    table = [np.concatenate(c) for c in zip(*parts)]
    order = np.argsort(table[0], kind="stable")
    time, position, truth, velocity, wild, who, which, variance = (c[order] for c in table)
    made = plots(
        time, position, covariance=variance[:, None, None] * np.eye(2) if stated or scene.stated else None,
        key=[f"K{k}" for k in who] if scene.keyed else None, sensor=np.where(which == 0, "A", "B"),
    )  # fmt: skip
    return Seen(made, who, truth, velocity, wild, tuple(paths))


def stamps(rng, scene: Scene, sensor: Sensor) -> np.ndarray:
    """Return the times of a sensor's plots; objects are seen at nearly the same ones."""
    n, steps = scene.plots, np.ones(scene.plots)
    if scene.uneven == 2.0:
        steps = np.repeat(rng.choice([1.0, 3.0, 10.0], n // 10 + 1), 10)[:n]
    steps[: scene.handover[0]] *= scene.handover[1]
    time = sensor.first + sensor.scan * np.cumsum(steps)
    if scene.uneven != 2.0:
        time = time + sensor.scan * scene.uneven * rng.uniform(-1, 1, n)
    for _ in range(scene.pauses):
        time[int(rng.integers(min(10, n - 1), n)) :] += sensor.scan * rng.uniform(3, 6)
    return time


def itinerary(rng, scene: Scene, span: float) -> list[Leg]:
    """Return the legs of one object: straight, then a manoeuvre, in turn."""
    kind, at, legs = scene.kind, 0.0, []
    scan, speed = scene.sensors[0].scan, between(rng, kind.speed)
    legs.append(Leg(0.0, 0.0, 0.0, speed))
    if "rests" in scene.troubles and rng.random() < 0.5:
        speed, legs[0] = 0.0, Leg(0.0, 0.0, 0.0, 0.0)
    calm = rng.random() < 0.2  # nothing ever happens
    while at < span + 60 * scan:
        at += max(between(rng, kind.leg), LEAST_LEG * scan)
        legs.append(Leg(at, 0.0, 0.0, speed))
        if calm and speed > 0.0:
            continue
        a = between(rng, kind.acceleration)
        dice = rng.random()
        if speed == 0.0 or dice < 0.3:
            target = between(rng, kind.speed)
            if speed > 0.0 and "rests" in scene.troubles and rng.random() < 0.7:
                target = 0.0
            at += abs(target - speed) / a
            legs.append(Leg(at, a * np.sign(target - speed), 0.0, target))
            speed = target
        else:
            angle = rng.uniform(0.35, np.pi) * (rng.integers(2, 8) if kind.circles and dice < 0.7 else 1)
            at += angle * speed / a
            legs.append(Leg(at, 0.0, a * rng.choice([-1.0, 1.0]), speed))
    return legs


def walk(rng, scene: Scene, legs: list[Leg], asked: np.ndarray) -> Path:
    """Go along the legs, and return where the object is at the times asked for."""
    kind, scan = scene.kind, scene.sensors[0].scan
    first = float(asked.min())
    edges = first + np.array([leg.end for leg in legs])
    fine = np.arange(first - scan, float(asked.max()) + scan, scan / STEPS)
    t = np.unique(np.concatenate([fine, asked, edges[(edges > fine[0]) & (edges < fine[-1])]]))
    which = np.minimum(np.searchsorted(edges, 0.5 * (t[:-1] + t[1:])), len(legs) - 1)
    along, across, goal = (np.array([getattr(leg, f) for leg in legs])[which] for f in ("along", "across", "target"))
    d, speed = np.diff(t), np.empty(len(t))
    speed[0] = legs[0].target
    for k in range(len(d)):  # a leg may end between two steps: it stops at its speed
        speed[k + 1] = goal[k] if along[k] == 0.0 else approach(speed[k], along[k] * d[k], goal[k])
    mean = 0.5 * (speed[1:] + speed[:-1])
    w = WOBBLE * kind.acceleration[0] * np.sqrt(np.minimum(scan, kind.leg[0]))
    drift = np.cumsum(w * np.sqrt(d) * rng.standard_normal(len(d)) / np.maximum(mean, kind.speed[0]))
    rate = np.where(mean > 0.0, across / np.maximum(mean, 1e-9), 0.0)
    turned = np.concatenate([[0.0], np.cumsum(rate * d)])
    heading = rng.uniform(0, 2 * np.pi) + turned + np.concatenate([[0.0], drift])
    middle = 0.5 * (heading[1:] + heading[:-1])
    chord = np.sinc(0.5 * rate * d / np.pi)  # a circle's
    step = (mean * d * chord)[:, None] * np.stack([np.sin(middle), np.cos(middle)], axis=1)
    position = np.concatenate([np.zeros((1, 2)), np.cumsum(step, axis=0)])
    position += place(rng, scene, float(asked.max()) - first)
    velocity = speed[:, None] * np.stack([np.sin(heading), np.cos(heading)], axis=1)
    where, how = (np.stack([np.interp(asked, t, c) for c in table.T], axis=1) for table in (position, velocity))
    spans = np.array([(a.end, b.end) for a, b in pairwise(legs) if b.along or b.across]).reshape(-1, 2) + first
    spans = spans[spans[:, 0] < float(asked.max()) - 2 * scan]
    sizes = [away(t, position, velocity, a, b) for a, b in spans]
    return Path(where, how, spans, np.array(sizes))


def approach(speed: float, step: float, goal: float) -> float:
    """Return a speed after a step that ends at the goal."""
    return min(speed + step, goal) if step > 0 else max(speed + step, goal)


def away(t, position, velocity, begin: float, end: float) -> float:
    """Return how far a manoeuvre leads away from going on straight, until it ends."""
    a, b = np.searchsorted(t, (begin, end))
    b = min(b, len(t) - 1)
    return float(np.hypot(*(position[b] - position[a] - (t[b] - t[a]) * velocity[a])))


def place(rng, scene: Scene, span: float) -> np.ndarray:
    """Return where an object begins: alone anywhere, in company within reach of each other."""
    if scene.objects == 1:
        return rng.uniform(-1e4, 1e4, 2)
    side = 0.5 * scene.kind.speed[1] * min(span, 60 * scene.sensors[0].scan) + 100 * scene.sensors[0].deviation
    return rng.uniform(-side, side, 2)


def seen(rng, scene: Scene, sensor: Sensor, k: int, time, path: Path, now: slice, then: slice, stated: bool):
    """Return the columns of one sensor's plots of one object."""
    n = len(time)
    sd = np.full(n, sensor.deviation)
    if sensor.name == "A":
        sd[: scene.precise[0]] *= scene.precise[1]
    noise = rng.standard_t(3, (n, 2)) / np.sqrt(3) if scene.heavy else rng.standard_normal((n, 2))
    error = sd[:, None] * noise
    wild = (rng.random(n) < scene.wild) & (np.arange(n) > 2)
    if scene.early:
        early = np.random.default_rng([*scene.seed, 3, k])
        wild[early.choice(min(EARLY, n), scene.early, replace=False)] = True
    way = rng.uniform(0, 2 * np.pi, n)
    direction = np.stack([np.sin(way), np.cos(way)], axis=1)
    speed = np.hypot(*path.velocity[then].T)
    if scene.along and (speed > 0).any():
        ahead = path.velocity[then] / np.maximum(speed, 1e-9)[:, None] * rng.choice([-1.0, 1.0], n)[:, None]
        direction = np.where(speed[:, None] > 0, ahead, direction)
    size = sensor.deviation * np.exp(rng.uniform(*np.log(WILDEST), n))
    error += np.where(wild, size, 0.0)[:, None] * direction
    position = path.position[then] + sensor.offset + error
    if scene.behind or scene.late:
        own, slows = np.random.default_rng([*scene.seed, 4, k]), np.diff(speed, prepend=speed[0]) < 0.0
        old = WAYS[scene.late](own, time, slows) if scene.late else sensor.scan * ages(own, n, scene.behind)
        position -= old[:, None] * path.velocity[then]
        wild |= old * speed > WILDEST[0] * sensor.deviation
    if scene.lattice:
        position = scene.lattice * np.round(position / scene.lattice)
    if scene.resampled:
        position = ruled(np.random.default_rng([*scene.seed, 2, k]), time, position, scene.resampled)
    keep = rng.random(n) >= scene.missing
    keep[:3] = True
    variance = np.full(n, scene.stated * sensor.deviation**2)
    if stated:  # of each coordinate; an offset and a way are as likely East as North
        variance = sd**2 + np.where(wild, size**2, 0.0) / 2 + scene.lattice**2 / 12 + np.hypot(*sensor.offset) ** 2 / 2
    columns = (
        time, position, path.position[now], path.velocity[now], wild,
        np.full(n, k), np.full(n, int(sensor.name == "B")), variance,
    )  # fmt: skip
    return tuple(c[keep] for c in columns)


def ages(rng, n: int, share: float) -> np.ndarray:
    """Return how old positions are, in scans: now and then one stays behind, and catches up plot by plot."""
    old = np.zeros(n)
    for begin in 3 + np.flatnonzero(rng.random(n - 3) < share):
        falling = rng.uniform(*STAYED) * np.linspace(1, 0, int(rng.integers(*CAUGHT_UP)), endpoint=False)
        old[begin : begin + len(falling)] = falling[: n - begin]
    return old


def ruled(rng, time, position, share: float) -> np.ndarray:
    """Return positions of which a share was seen, and a pause not; all others are on straight lines of degrees."""
    known, begin = rng.random(len(time)) < share, int(rng.integers(len(time)))
    known[begin : begin + int(rng.integers(BRIDGED))] = False
    known[[0, -1]] = True
    latitude, longitude = (np.interp(time, time[known], one[known]) for one in geographic(position, PLACE).T)
    return east_north(latitude, longitude, PLACE)
