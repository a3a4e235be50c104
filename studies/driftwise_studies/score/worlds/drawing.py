"""Draw a system from a seed: a plant, its noise and input, its troubles."""

from __future__ import annotations

import numpy as np

from .simulation import records, regressors
from .system import ALONE, System, changed, stays

SHARES = (
    ("walk", 0.45),
    ("jumps", 0.45),
    ("noise", 0.35),
    ("outliers", 0.3),
    ("input", 0.4),
    ("rest", 0.2),
    ("missing", 0.3),
)
OF_PROCESS = 1 / 3  # of the plants with outliers


def draw(seed: int, number: int) -> System:
    """Return system ``number`` of ``seed``; whatever else is drawn, it is the same.

    Examples
    --------
    >>> from driftwise_studies.score.worlds import draw, record
    >>> draw(0, 3).troubles
    ('walk all',)
    >>> record(draw(0, 3), seed=1).y.shape
    (1, 2000)
    """
    rng = np.random.default_rng([seed, number, 21])
    chosen = {ALONE[number // 3 % len(ALONE)]} if number % 3 == 0 else several(rng)
    plain = structure(rng, number, chosen)
    moved = move(rng, trouble(rng, plain, chosen), chosen)
    return changed(moved, of_process=are_of_process(moved, np.random.default_rng([seed, number, 23])))


def are_of_process(system: System, rng) -> bool:
    """Say of a third of the plants with outliers that they feel them; in a regression nothing tells the two apart."""
    return bool(system.outliers[0] and system.na > 0 and rng.random() < OF_PROCESS)


def several(rng) -> set[str]:
    """Return two troubles or more."""
    while True:
        found = {name for name, share in SHARES if rng.random() < share}
        if len(found) > 1:
            break
    for name, kinds in (("walk", ALONE[1:3]), ("noise", ALONE[4:6]), ("input", ALONE[7:10])):
        if name in found:
            found = found - {name} | {str(rng.choice(kinds))}
    return found


def structure(rng, number: int, chosen: set[str]) -> System:
    """Return a plant, its noise and its input."""
    is_arx = rng.random() < 0.7 or "closed loop" in chosen
    kind, value = input_kind(rng, chosen)
    while True:
        na = int(rng.integers(1, 5)) if is_arx else -1
        least = 1 if chosen & {"coloured", "quantised", "closed loop"} else 0
        inputs = int(rng.integers(least, 4)) if is_arx else int(rng.integers(1, 5))
        nb = tuple(int(n) for n in (rng.integers(1, 3, inputs) if is_arx else np.ones(inputs, int)))
        b = rng.uniform(0.3, 1.5, sum(nb)) * rng.choice([-1.0, 1.0], sum(nb))
        theta = np.concatenate([poles(rng, na) if is_arx else [], b])
        sigma = float(10 ** rng.uniform(-1.5, 0))
        if kind == "closed loop":
            value = float(rng.uniform(0.1, 0.8) * np.sign(b[0]))
        found = System(number, na, nb, tuple(theta), sigma, (1.0,) * len(theta), (kind, value))
        if stays(found, theta):
            return with_deviations(found)


def input_kind(rng, chosen) -> tuple[str, float]:
    """Return the kind of input and its number."""
    if "coloured" in chosen:
        return "coloured", float(rng.uniform(0.8, 0.98))
    if "quantised" in chosen:
        return "quantised", float(rng.integers(2, 6))
    return ("closed loop", 0.0) if "closed loop" in chosen else (str(rng.choice(["white", "signs"])), 0.0)


def poles(rng, na: int) -> np.ndarray:
    """Return a1 .. of poles of radius .2 to .9, real or in pairs."""
    roots: list[complex] = []
    while len(roots) < na:
        radius = rng.uniform(0.2, 0.9)
        if na - len(roots) > 1 and rng.random() < 0.7:
            one = radius * np.exp(1j * rng.uniform(0.2, 2.6))
            roots += [one, one.conjugate()]
        else:
            roots.append(radius * rng.choice([1.0, 1.0, -1.0]))
    return np.real(np.poly(roots))[1:]


def with_deviations(system: System) -> System:
    """Return it with the deviations of its parameters, from a record without trouble."""
    found = records(system, range(4), samples=800)
    psi = regressors(system, found.y, found.u)[:, 50:]
    rms = np.sqrt((psi**2).mean(axis=(0, 1)))
    return changed(system, deviations=tuple(float(v) for v in system.sigma / np.maximum(rms, 1e-3 * rms.max())))


def trouble(rng, system: System, chosen: set[str]) -> System:
    """Return it with the troubles of noise, outputs and input."""
    what: dict = {}
    if chosen & {"louder", "quieter"}:
        first = rng.uniform(1.5, 10) if "louder" in chosen else 1 / rng.uniform(1.5, 10)
        what["steps"] = (float(first), float(1 / first))[: 1 + int(rng.random() < 0.5)]
    if "outliers" in chosen:
        what["outliers"] = (float(rng.uniform(0.002, 0.05)), float(rng.uniform(6, 25)))
    if "rest" in chosen:
        what["rest"] = (int(rng.integers(100, 601)), bool(rng.random() < 0.5))
    if "missing" in chosen:
        what["missing"] = (float(rng.uniform(0.02, 0.3)), int(rng.choice([1, 1, 10])))
    return changed(system, **what)


def move(rng, system: System, chosen: set[str]) -> System:
    """Return it with parameters that walk and jump."""
    n = len(system.theta)
    what: dict = {}
    if chosen & {"walk all", "walk some"}:
        nvr = 10 ** (rng.uniform(-6, -2, n) if rng.random() < 0.5 else np.full(n, rng.uniform(-6, -2)))
        if "walk some" in chosen and n > 1:
            still = rng.permutation(n)[: rng.integers(1, n)]
            nvr[still] = 0.0
        what["nvr"] = tuple(float(v) for v in nvr)
    if "jumps" in chosen:
        what["jumps"] = tuple(jump(rng, system) for _ in range(rng.integers(1, 5)))
    return changed(system, **what)


def jump(rng, system: System) -> tuple[float, tuple[int, ...]]:
    """Return a jump that the plant survives in one direction at least."""
    n, theta = len(system.theta), np.array(system.theta)
    size = float(np.exp(rng.uniform(np.log(0.5), np.log(8))))
    while True:
        for _ in range(2 * n):
            who = tuple(range(n)) if rng.random() < 0.3 else (int(rng.integers(n)),)
            step = np.zeros(n)
            step[list(who)] = size * np.array(system.deviations)[list(who)]
            if stays(system, theta + step) or stays(system, theta - step):
                return size, who
        size /= 2
