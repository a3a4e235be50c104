"""Draw a plant from a seed: its dynamics, inputs, noise and troubles."""

from __future__ import annotations

from typing import Any

import numpy as np

from .plant import DRAWN, Jump, Plant

LONGEST = 60  # samples of delay
MANY = 4  # troubles at once, at most
LAGGING = (
    8  # of so many files one has a lag that jumps, too, where no gain does, no controller acts and the clock is regular
)
TRIES = 1000  # poles that are drawn in vain until all are drawn anew


def draw(seed: int, number: int) -> Plant:
    """Return plant ``number`` of a seed; every third one has a single trouble or none, the others several.

    Examples
    --------
    >>> from driftwise_studies.score.claims.drawing import draw
    >>> draw(0, 3) == draw(0, 3), sorted(draw(0, 3).troubles)
    (True, ['level jump'])
    """
    rng = np.random.default_rng([seed, number, 22])
    if number % 3 == 0:
        turn = number // 3 % (len(DRAWN) + 1)
        troubles = frozenset(DRAWN[turn - 1 : turn] if turn else ())
    else:
        troubles = frozenset(rng.choice(DRAWN, rng.integers(1, MANY + 1), replace=False).tolist())
    if "irregular" in troubles:
        troubles -= {"sparse", "missing"}
    slow = 4.0 if troubles & {"irregular", "sparse"} else 1.0
    samples = int(np.exp(rng.uniform(np.log(400), np.log(2500))))
    lag = _lag(np.random.default_rng([seed, number, 30]), troubles, samples)
    troubles |= {"lag jump"} if lag else set()
    poles = _poles(rng, int(rng.integers(1, 4)), slow)
    inputs = int(rng.choice([1, 1, 2, 3]))
    many = rng.integers(1, 3, inputs)
    return Plant(
        number, troubles, samples, float(rng.choice([0.1, 0.5, 1.0, 10.0, 60.0, 600.0, 3600.0, 86400.0])), poles,
        tuple(_shares(rng, int(m)) for m in many), _gains(rng, inputs), _delays(rng, inputs, troubles),
        str(rng.choice(["steps", "steps", "coloured", "white"])), float(rng.choice([0.0, 1.0, 20.0, 300.0])),
        float(np.exp(rng.uniform(np.log(1.5), np.log(30)))), _noise(rng, troubles), float(rng.uniform(0.5, 0.95)),
        **_troubled(rng, troubles, samples, inputs, lag),
    )  # fmt: skip


def _lag(rng, troubles, samples: int) -> tuple[Jump, ...]:
    """Return a jump of all time constants, or of the slowest, by 10 % to threefold, of one file in `LAGGING`."""
    if rng.integers(LAGGING) or troubles & {"gain jump", "closed loop", "irregular"}:
        return ()
    size = np.exp(rng.choice([-1, 1]) * np.log(1.1) * (np.log(3) / np.log(1.1)) ** rng.uniform(0, 1))
    return (Jump("lag", int(samples * rng.uniform(0.25, 0.85)), float(size), int(rng.integers(2))),)


def _poles(rng, n: int, slow: float) -> tuple[complex, ...]:
    """Return poles with time constants of 2 to 25 samples, real ones or pairs, apart from each other."""
    found, rejected = list[complex](), 0
    while len(found) < n:
        tau = slow * np.exp(rng.uniform(np.log(2), np.log(25)))
        radius = float(np.exp(-1 / tau))
        if n - len(found) > 1 and rng.random() < 0.4:
            p = radius * np.exp(2j * np.pi / (tau * rng.uniform(1.0, 4.0) + 4 * slow))
            found += [complex(p), complex(p.conjugate())]
        elif all(abs(radius - abs(p)) > 0.03 for p in found):
            found.append(complex(radius))
        elif (rejected := rejected + 1) % TRIES == 0:  # two slow poles may leave no room for a third
            found.clear()
    return tuple(found)


def _shares(rng, many: int) -> tuple[float, ...]:
    first = rng.uniform(0.3, 1.0) if many > 1 else 1.0
    return tuple(float(v) for v in ([first, 1 - first] if many > 1 else [1.0]))


def _gains(rng, inputs: int) -> tuple[float, ...]:
    return tuple(float(v) for v in np.exp(rng.uniform(-1.5, 2.0, inputs)) * rng.choice([1.0, 1.0, -1.0], inputs))


def _delays(rng, inputs: int, troubles) -> tuple[int, ...]:
    """Return delays in samples: 0 to 2, and up to `LONGEST` where that is the trouble."""
    found = rng.integers(0, 3, inputs)
    if "closed loop" in troubles:
        found = np.maximum(found, 1)
    elif "delay" in troubles:
        found[rng.integers(inputs)] = int(np.exp(rng.uniform(np.log(3), np.log(LONGEST + 1))))
    return tuple(int(v) for v in found)


def _noise(rng, troubles) -> str:
    if troubles & {"irregular", "sparse"}:
        return "white"
    return "coloured" if "coloured" in troubles else str(rng.choice(["white", "equation"]))


def _troubled(rng, troubles, samples: int, inputs: int, lag: tuple[Jump, ...]) -> dict[str, Any]:
    """Return the settings of the troubles; each draws its numbers whether it is there or not."""
    at = sorted(int(v) for v in samples * rng.uniform(0.25, 0.85, 3))
    sizes = rng.uniform(0.3, 2.0) * rng.choice([-1.0, 1.0]), float(np.exp(rng.choice([-1, 1]) * rng.uniform(0.25, 1.1)))
    louder = float(np.exp(rng.choice([-1, 1]) * rng.uniform(0.4, 1.4)))
    which = int(rng.integers(inputs))
    jumps = [
        Jump("level", at[0], float(sizes[0])), Jump("gain", at[1], sizes[1], which), Jump("noise", at[2], louder),
    ]  # fmt: skip
    every = {
        "ramp": ("drift", float(rng.uniform(0.5, 2.0) * rng.choice([-1.0, 1.0]))),
        "season": ("season", (float(rng.uniform(0.2, 1.0)), int(rng.integers(20, 300)))),
        "outliers": ("outliers", (float(rng.uniform(0.002, 0.03)), float(rng.uniform(3, 12)))),
        "stuck": ("stuck", (int(samples * rng.uniform(0.3, 0.6)), int(rng.integers(60, 150)))),
        "levels": ("quantised", int(rng.integers(6, 40))),
        "every": ("sparse", int(rng.integers(3, 10))),
        "loop": ("closed loop", float(rng.uniform(0.3, 1.0))),
        "nonlinearity": ("nonlinear", str(rng.choice(["square", "saturation"]))),
        "missing": ("missing", float(rng.uniform(0.02, 0.25))),
    }
    found = {name: value for name, (trouble, value) in every.items() if trouble in troubles}
    return found | {"jumps": tuple(jump for jump in jumps if f"{jump.what} jump" in troubles) + lag}
