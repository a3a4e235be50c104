"""Draw a scene from a seed: a class, its sensors, its troubles."""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

from .scene import ALONE, KINDS, Scene, Sensor

SHARES = (
    ("rests", 0.5),
    ("lattice", 0.3),
    ("wild", 0.4),
    ("gaps", 0.4),
    ("precise start", 0.15),
    ("uneven", 0.3),
    ("heavy", 0.2),
    ("second sensor", 0.2),
    ("stated", 0.3),
    ("company", 0.15),
)


def draw(seed: int, number: int) -> Scene:
    """Return scene ``number`` of ``seed``; whatever else is drawn, it is the same.

    Examples
    --------
    >>> from driftwise_studies.score.motions import draw, simulate
    >>> print(draw(0, 7))
    7: glider, 108 plots, 11.6 s, 5.3 m; precise start
    >>> simulate(draw(0, 7)).plots.position.shape
    (108, 2)
    """
    rng = np.random.default_rng([seed, number, 26])
    if number % 3 == 0:
        chosen = {ALONE[number // 3 % len(ALONE)]} - {"nothing"}
    else:
        chosen = {name for name, share in SHARES if rng.random() < share}
    name = str(rng.choice(list(KINDS)))
    kind = KINDS[name]
    if not kind.can_rest:
        chosen -= {"rests"}
    scan, deviation = between(rng, kind.scan), between(rng, kind.deviation)
    what: dict = {}
    if "lattice" in chosen:
        what["lattice"] = deviation * between(rng, (0.5, 20.0))
    if "wild" in chosen:
        what |= {"wild": float(rng.uniform(0.01, 0.08)), "along": bool(rng.random() < 0.5)}
    if "gaps" in chosen:
        what |= {"missing": float(rng.uniform(0.05, 0.4)), "pauses": int(rng.integers(1, 4))}
    if "precise start" in chosen:
        what["precise"] = int(rng.integers(5, 31)), between(rng, (1e-4, 1e-2))
    if "uneven" in chosen:
        what["uneven"] = 2.0 if rng.random() < 0.4 else float(rng.uniform(0.05, 0.4))
    if "stated" in chosen:
        what["stated"] = between(rng, (0.25, 4.0))
    sensors = [Sensor("A", scan, deviation)]
    if "second sensor" in chosen:
        size = 3 * deviation * between(rng, (0.1, 1.0))
        way, clock = rng.uniform(0, 2 * np.pi), float(rng.uniform(-0.3, 0.3)) * scan
        offset = float(size * np.cos(way)), float(size * np.sin(way))
        other = scan * between(rng, (0.5, 3.0)), deviation * between(rng, (0.3, 3.0))
        sensors.append(Sensor("B", *other, float(rng.uniform(0, scan)), offset, clock))
    hidden = rng.random() < 0.4 and what.get("uneven") != 2.0  # it says not who it is
    keyed, single = not ("company" in chosen or hidden), bool(hidden and rng.random() < 0.5)
    return Scene(
        number, (seed, number), name, kind, tuple(t for t in ALONE if t in chosen),
        int(between(rng, (30.0, 500.0))), tuple(sensors), 3 if "company" in chosen else 1,
        keyed, single and "company" not in chosen, heavy="heavy" in chosen, **what,
    )  # fmt: skip


def between(rng, span: tuple[float, float]) -> float:
    """Return a number whose logarithm is uniform."""
    return float(np.exp(rng.uniform(*np.log(span))))


def asked(about: str, arguments=None, seed: int = 0, scenes: int = 150, **switches: str) -> tuple[Any, ...]:
    """Return the seed and the number of scenes that a command line asks for, and whether it names each switch.

    Parameters
    ----------
    about : the module's docstring
    arguments : of the command line; those of the process if omitted
    seed, scenes : what is drawn unless it says otherwise
    switches : the help of each by its name
    """
    parser = argparse.ArgumentParser(description=about.splitlines()[0])
    parser.add_argument("--seed", type=int, default=seed)
    parser.add_argument("--scenes", type=int, default=scenes)
    for name, text in switches.items():
        parser.add_argument(f"--{name}", action="store_true", help=text)
    return tuple(vars(parser.parse_args(arguments)).values())
