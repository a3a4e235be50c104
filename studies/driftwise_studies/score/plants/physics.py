"""Plants by hand, in NumPy: derivatives and outputs, and between which levels their inputs are drawn.

Each is written again, in TOML, in the package's library of plants; nothing here reads that. Parameters come by name,
as numbers or as arrays whose last axis is over parameter vectors, complex ones for derivatives by a complex step.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

GRAVITY, AIR, WATER = 9.81, 1.2, 4186.0
BODY = 300.0  # kg
TINY = 1e-30  # a complex step


class Plant(NamedTuple):
    """A plant: what it is called, what it does, and what may drive it."""

    starts: dict[str, float]  # of its parameters, where a prior has its middle
    states: tuple[tuple[float, float], ...]  # start and deviation of each
    slopes: Callable  # (x, u, p) -> dx/dt, a list
    outputs: Callable  # (x, u, p) -> y, a list
    levels: Callable  # (rng, p) -> (low, high) of each input
    is_linear: bool = True
    walk: float = 0.0  # deviation that the last state gains in a root of a second; it is added to the output


def wander(x):
    """Return |x| that has a derivative by a complex step."""
    return np.where(np.real(x) < 0, -x, x)


def even(*sizes):
    """Return levels around zero."""
    return [(-s, s) for s in sizes]


def between(rng, low, high):
    """Return a number whose logarithm is uniform."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def flows(rng, p):
    """Return levels of two streams that heat is exchanged between, and of their temperatures."""
    middles = [p["UA"] / WATER * between(rng, 0.5, 2.0) for _ in range(2)]
    return [*((0.5 * m, 1.5 * m) for m in middles), (60.0, 90.0), (10.0, 25.0)]


def suspension_push(x, p):
    """Return the force of spring and damper."""
    return p["ks"] * (x[0] - x[2]) + p["cs"] * (x[1] - x[3])


def vehicle_slope(x, u, p):
    """Return the acceleration."""
    air = AIR / 2 * p["drag"] * x[0] * wander(x[0]) / p["mass"]
    return [u[0] / p["mass"] - air - GRAVITY * (p["rolling"] * np.cos(u[1]) + np.sin(u[1]))]


def two_capacities(x, u, p):
    """Return the slopes of the temperatures of air and envelope."""
    inner = (x[1] - x[0]) / p["Ri"]
    return [(inner + u[1]) / p["Ci"], ((u[0] - x[1]) / p["Re"] - inner) / p["Ce"]]


def exchanged(x, u, p):
    """Return the slopes of the temperatures of two sides."""
    over = p["UA"] * (x[0] - x[1])
    return [(WATER * u[0] * (u[2] - x[0]) - over) / p["Ch"], (WATER * u[1] * (u[3] - x[1]) + over) / p["Cc"]]


PLANTS = {
    "battery": Plant(
        {"R0": 0.01, "R1": 0.01, "C1": 2000.0},
        ((0.0, 0.01), (3.7, 1.0)),
        lambda x, u, p: [(u[0] - x[0] / p["R1"]) / p["C1"], 0.0 * x[1]],
        lambda x, u, p: [x[1] + p["R0"] * u[0] + x[0]],
        lambda rng, p: even(between(rng, 1.0, 20.0)),
        walk=1e-5,
    ),
    "dc_motor": Plant(
        {"R": 1.0, "L": 0.002, "k": 0.05, "J": 1e-4, "b": 2e-4},
        ((0.0, 0.5), (0.0, 5.0)),
        lambda x, u, p: [
            (u[0] - p["R"] * x[0] - p["k"] * x[1]) / p["L"],
            (p["k"] * x[0] - p["b"] * x[1]) / p["J"],
        ],
        lambda x, u, p: [x[0], x[1]],
        lambda rng, p: even(between(rng, 6.0, 24.0)),
    ),
    "room": Plant(
        {"Ri": 0.001, "Re": 0.005, "Ci": 4e6, "Ce": 2e7},
        ((20.0, 2.0), (15.0, 5.0)),
        two_capacities,
        lambda x, u, p: [x[0]],
        lambda rng, p: [(-5.0, 10.0), (0.0, between(rng, 10.0, 40.0) / (p["Ri"] + p["Re"]))],
    ),
    "exchanger": Plant(
        {"UA": 2000.0, "Ch": 40000.0, "Cc": 40000.0},
        ((50.0, 10.0), (30.0, 10.0)),
        exchanged,
        lambda x, u, p: [x[0], x[1]],
        flows,
    ),
    "tank": Plant(
        {"A": 0.1, "a": 5e-4},
        ((0.5, 0.1),),
        lambda x, u, p: [
            (u[0] - p["a"] * np.sqrt(2 * GRAVITY * np.where(np.real(x[0]) > 0, x[0], 0.0))) / p["A"]
        ],
        lambda x, u, p: [x[0]],
        lambda rng, p: [tuple(p["a"] * np.sqrt(2 * GRAVITY * level) for level in (0.1, between(rng, 0.5, 2.0)))],
        is_linear=False,
    ),
    "vehicle": Plant(
        {"mass": 1500.0, "drag": 0.6, "rolling": 0.01},
        ((15.0, 2.0),),
        vehicle_slope,
        lambda x, u, p: [x[0]],
        lambda rng, p: [(8.0, between(rng, 20.0, 40.0)), *even(between(rng, 0.01, 0.06))],  # speed wanted, grade
        is_linear=False,
    ),
    "suspension": Plant(
        {"mu": 40.0, "ks": 20000.0, "cs": 1500.0, "kt": 180000.0},
        ((0.0, 0.005), (0.0, 0.05), (0.0, 0.005), (0.0, 0.05)),
        lambda x, u, p: [
            x[1], -suspension_push(x, p) / BODY, x[3],
            (suspension_push(x, p) - p["kt"] * (x[2] - u[0])) / p["mu"],
        ],
        lambda x, u, p: [x[0] - x[2], -suspension_push(x, p) / BODY],
        lambda rng, p: even(between(rng, 0.01, 0.05)),
    ),
    "mass_spring_damper": Plant(
        {"m": 1.0, "d": 2.0, "k": 100.0},
        ((0.0, 0.01), (0.0, 0.1)),
        lambda x, u, p: [x[1], (u[0] - p["d"] * x[1] - p["k"] * x[0]) / p["m"]],
        lambda x, u, p: [x[0]],
        lambda rng, p: even(p["k"] * between(rng, 0.02, 0.2)),
    ),
    "pendulum": Plant(
        {"J": 0.1, "weight": 2.0, "b": 0.05},
        ((0.0, 0.1), (0.0, 0.3)),
        lambda x, u, p: [x[1], (u[0] - p["b"] * x[1] - p["weight"] * np.sin(x[0])) / p["J"]],
        lambda x, u, p: [x[0]],
        lambda rng, p: even(p["weight"] * between(rng, 0.1, 0.5)),
        is_linear=False,
    ),
    "first_order_delay": Plant(
        {"gain": 1.0, "tau": 10.0, "delay": 4.0},
        ((0.0, 0.1), (0.0, 0.1), (0.0, 1.0)),
        lambda x, u, p: [
            x[1] / p["delay"], (12 * (u[0] - x[0]) - 6 * x[1]) / p["delay"],
            (p["gain"] * (u[0] - x[1]) - x[2]) / p["tau"],
        ],
        lambda x, u, p: [x[2]],
        lambda rng, p: even(between(rng, 0.3, 3.0)),
    ),
}  # fmt: skip


def named(plant: Plant, theta):
    """Return parameters by name."""
    return dict(zip(plant.starts, theta, strict=True))


def clocks(plant: Plant, theta, x, u) -> tuple[float, float]:
    """Return the fastest and the slowest time constant in s at a state: of the eigenvalues of the slopes."""
    n, p = len(x), named(plant, theta)
    J = np.array([np.imag(plant.slopes(x + 1j * TINY * np.eye(n)[j], u, p)) / TINY for j in range(n)]).T
    sizes = np.abs(np.linalg.eigvals(J))
    sizes = sizes[sizes > 1e-9 * sizes.max()]
    return float(1 / sizes.max()), float(1 / sizes.min())
