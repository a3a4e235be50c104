"""Draw a record of a plant from a seed: true parameters, clock, inputs, noise, gaps, and a jump that it may have."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .physics import AIR, GRAVITY, PLANTS, Plant, between, clocks, named

FACTOR = 5.0  # the prior of a parameter: within this factor of its start, with 95 %
SAMPLES = 600
NOISE = 0.003, 0.05  # of the deviation of an output
SPAN = 15.0, 40.0  # slowest time constants in a record
FAST = 0.03, 2.0  # fastest time constants in a sample, at least and most
JUMP = 1.3  # factor, up or down
WAYS = "steps", "binary", "sines", "cycle"


class Drawn(NamedTuple):
    """A record before it is simulated."""

    name: str
    key: tuple[int, ...]
    plant: Plant
    theta: np.ndarray  # (m,)
    x0: np.ndarray  # (n,)
    t: np.ndarray  # (T,) s
    u: np.ndarray  # (T, k), held from sample to sample
    slow: float  # slowest time constant, s
    fast: float
    noise: float  # of the deviation of each output
    missing: float
    which: int  # parameter that jumps, if one does
    after: np.ndarray  # (m,) parameters from then on
    at: int  # the first sample of them

    @property
    def names(self) -> list[str]:
        """The parameters."""
        return list(self.plant.starts)


def draw(seed: int, name: str, number: int) -> Drawn:
    """Return record ``number`` of a plant; whatever else is drawn, it is the same.

    Examples
    --------
    >>> from driftwise_studies.score.plants import draw, simulate
    >>> record = draw(0, "battery", 7)
    >>> y, noise = simulate(record)
    >>> y.shape, record.u.shape, record.names
    ((600, 1), (600, 1), ['R0', 'R1', 'C1'])
    """
    plant, key = PLANTS[name], (seed, list(PLANTS).index(name), number, 25)
    rng = np.random.default_rng(key)
    starts = np.array(list(plant.starts.values()))
    theta = starts * np.exp(rng.standard_normal(len(starts)) * np.log(FACTOR) / 1.96)
    x0 = np.array([start + std * rng.standard_normal() for start, std in plant.states])
    p = named(plant, theta)
    levels = plant.levels(rng, p)
    middle = np.array([0.5 * (low + high) for low, high in levels])
    if name == "vehicle":
        middle[0] = hold(p, middle[0])
    fast, slow = clocks(plant, theta, np.array([start for start, _ in plant.states]), middle)
    dt = float(np.clip(slow * between(rng, *SPAN) / SAMPLES, FAST[0] * fast, FAST[1] * fast))
    steps = dt * (rng.uniform(0.3, 1.7, SAMPLES) if rng.random() < 0.3 else np.ones(SAMPLES))
    t = np.cumsum(steps) - steps[0]
    u = np.column_stack([signal(rng, str(rng.choice(WAYS)), t, fast, slow, *span) for span in levels])
    if name == "vehicle":
        u[:, 0] = driven(p, t, u)
    which, way = int(rng.integers(len(theta))), 1 if rng.random() < 0.5 else -1
    after = theta.copy()
    after[which] *= JUMP**way
    missing = float(rng.uniform(0.02, 0.2)) if rng.random() < 0.3 else 0.0
    at = int(rng.integers(SAMPLES * 2 // 3, SAMPLES * 5 // 6))
    return Drawn(
        name, key, plant, theta, x0, t, u, slow, fast, between(rng, *NOISE), missing, which, after, at
    )  # fmt: skip


def signal(rng, way: str, t, fast: float, slow: float, low: float, high: float) -> np.ndarray:
    """Return an input (T,) of some way between two levels.

    ``steps``: levels held for a while; ``binary``: one of both; ``sines``: three; ``cycle``: ramps, holds and rests.
    """
    if way == "sines":
        periods = [between(rng, 4 * fast, 12 * slow) for _ in range(3)]
        share = rng.dirichlet(np.ones(3))
        wave = sum(a * np.sin(2 * np.pi * (t / T + rng.random())) for a, T in zip(share, periods))
        return low + (high - low) * (0.5 + 0.5 * wave)
    ends, level = [0.0], [rng.uniform(low, high)]
    while ends[-1] < t[-1]:
        ends.append(ends[-1] + between(rng, fast, 3 * slow))
        level.append(rng.uniform(low, high))
    if way == "binary":
        level = [low if v < 0.5 * (low + high) else high for v in level]
    if way == "cycle":
        return np.interp(t, ends, level)
    return np.array(level)[np.searchsorted(ends, t, side="right") - 1]


def hold(p, v):
    """Return the force that holds a vehicle's speed on a level road."""
    return AIR / 2 * p["drag"] * v**2 + p["mass"] * GRAVITY * p["rolling"]


def driven(p, t, u):
    """Return the force of a driver who wants the speeds u[:, 0] on the grades u[:, 1], within .3 of gravity."""
    change = np.append(np.diff(u[:, 0]) / np.diff(t), 0.0)
    change = np.clip(change, -0.3 * GRAVITY, 0.2 * GRAVITY)
    return hold(p, u[:, 0]) + p["mass"] * (change + GRAVITY * np.sin(u[:, 1]))
