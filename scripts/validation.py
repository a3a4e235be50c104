"""What does `validate` tell falsely, and what does it see? Drawn plants, by seed: the tables of docs/validation.md.

    python scripts/validation.py [draws [first seed [kinds..]]]

A draw is a plant of order 1 to 3 with its noise (ARX, ARMAX or OE), an input (coloured, binary, held, or steps), a
signal-to-noise ratio of 1 to 100, and 500 to 5000 samples. It is validated under its true orders. "sound": as it is.
"delay d": under nk = 1 while the input acts after d samples. "loop": the input is a proportional or integrating
controller's, with a set point that stands, steps or moves. "square": the input, or the output, passes a square law. The
oracle of the latter knows the law: log odds above 100:1, both fitted by least squares.
"""

from __future__ import annotations

import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from typing import Any, NamedTuple

import numpy as np
from identify_families import polynomial
from scipy.signal import lfilter

import driftwise as dw
from driftwise.analysis.delays import lagged
from driftwise.memory import AutoMemory, Constant, ExponentialForgetting

FAMILIES = ("ARX", "ARMAX", "OE")
KINDS = ("sound", "sound, auto", "sound, 0.98", "delay 5", "delay 12", "loop", "square")
TESTS = ("autocorrelation", "delay", "missing lag", "feedback", "nonlinearity")
SURE = np.log(100.0)


class Outcome(NamedTuple):
    """Which tests asked for something, and whether the oracle saw what there was to see."""

    kind: str
    detail: str
    told: tuple[str, ...]
    is_seen: bool = True
    advice: tuple[str, ...] = ()


def an_input(rng, size: int) -> tuple[str, np.ndarray]:
    """Return a drawn input and what it is called."""
    which = ("coloured", "binary", "held", "steps")[int(rng.integers(4))]
    if which == "coloured":
        return which, lfilter([1], [1, -rng.uniform(0, 0.95)], rng.standard_normal(size))
    if which == "binary":
        return which, rng.choice([-1.0, 1.0], size)
    if which == "held":
        return which, np.repeat(rng.choice([-1.0, 1.0], size), 5)[:size]
    lengths = rng.integers(5, 40, size)
    return which, np.repeat(rng.standard_normal(size), lengths)[:size]


class Plant(NamedTuple):
    """A(q) y = B(q) u + noise."""

    family: str
    n: int
    A: np.ndarray
    B: np.ndarray
    C: np.ndarray

    @classmethod
    def drawn(cls, rng) -> Plant:
        n = int(rng.integers(1, 4))
        A, C = polynomial(rng, n, 0.95), polynomial(rng, n, 0.9)
        return cls(FAMILIES[int(rng.integers(3))], n, A, np.concatenate([[0.0], rng.standard_normal(n)]), C)

    def noise(self, rng, size: int) -> np.ndarray:
        e = rng.standard_normal(size)
        return {"ARX": lambda: lfilter([1], self.A, e), "ARMAX": lambda: lfilter(self.C, self.A, e), "OE": lambda: e}[
            self.family
        ]()

    def model(self, memory=Constant(), nk: int = 1) -> Any:
        n = self.n
        if self.family == "ARX":
            return dw.ARX(n, n, nk, offset=True, memory=memory)
        if self.family == "ARMAX":
            return dw.ARMAX(n, n, n, nk, offset=True, memory=memory)
        return dw.OE(n, n, nk, offset=True, memory=memory)


def validated(plant: Plant, y, u, memory=Constant(), nk: int = 1):
    """Return what `validate` says of a record under the plant's own orders."""
    return plant.model(memory, nk).scaled_to(y, u).scan(y, u).validate()


def outcome(task: tuple[str, int]) -> Outcome:
    """Return what came of the draw of a seed."""
    kind, seed = task
    rng = np.random.default_rng(seed)
    plant, size = Plant.drawn(rng), int(np.exp(rng.uniform(np.log(500), np.log(5000))))
    name, u = an_input(rng, size)
    ratio = 10 ** rng.uniform(0, 1)  # of standard deviations
    memory: Any = Constant()
    is_seen, detail = True, f"{plant.family}, {name}"
    if kind == "loop":
        y, u, detail = loop(rng, plant, size)
    else:
        x = lfilter(plant.B, plant.A, u)
        if kind == "square":
            law = ("input", "output")[int(rng.integers(2))]
            bend = rng.uniform(0.2, 1.0)
            seen = (u if law == "input" else x) / (u if law == "input" else x).std()
            x = (
                lfilter(plant.B, plant.A, u + bend * seen**2 * u.std())
                if law == "input"
                else x + bend * x.std() * seen**2
            )
            detail = f"{law}, {name}"
        if kind.startswith("delay"):
            d = int(kind.split()[1]) - 1
            x = np.concatenate([np.zeros(d), x[:-d]])
        noise = plant.noise(rng, size)
        y = x + noise * x.std() / noise.std() / ratio
        if kind == "square":
            is_seen = seen_by_oracle(plant, y, u, law)
        if kind.startswith("sound, "):
            plant = plant._replace(family="ARX")
            noise = plant.noise(rng, size)
            y = x + noise * x.std() / noise.std() / ratio
            memory = AutoMemory() if kind.endswith("auto") else ExponentialForgetting(0.98)
    found = validated(plant, y, u, memory)
    return Outcome(kind, detail, tuple(v.name for v in found.verdicts.not_fine), is_seen)


def loop(rng, plant: Plant, size: int):
    """Return output and input of a plant under control, and what kind of control it is."""
    which, moved = ("P", "PI")[int(rng.integers(2))], ("stands", "steps", "moves")[int(rng.integers(3))]
    gain = plant.B.sum() / plant.A.sum()
    sign = np.sign(gain) if gain else 1.0
    n, w = plant.n, plant.noise(rng, size)
    v = lfilter(plant.A, [1.0], w)  # the disturbance in the equation: A y = B u + v
    level = v.std()
    r = {
        "stands": lambda: np.zeros(size),
        "steps": lambda: 5 * level * np.repeat(rng.standard_normal(size), 100)[:size],
        "moves": lambda: 5 * level * lfilter([0.1], [1, -0.9], rng.standard_normal(size)),
    }[moved]()
    dither = level * rng.uniform(0, 0.3) * rng.standard_normal(size) if rng.random() < 0.5 else np.zeros(size)
    K = rng.uniform(0.2, 0.6) * margin(plant, sign) * sign
    Ki = K * rng.uniform(0.02, 0.1) if which == "PI" else 0.0
    for _ in range(40):
        if is_stable(plant, K, Ki):
            break
        K, Ki = 0.8 * K, 0.8 * Ki
    y, u, total = np.zeros(size), np.zeros(size), 0.0
    for t in range(size):
        y[t] = v[t] - sum(plant.A[i] * y[t - i] for i in range(1, min(n, t) + 1))
        y[t] += sum(plant.B[i] * u[t - i] for i in range(1, min(n, t) + 1))
        total += r[t] - y[t]
        u[t] = K * (r[t] - y[t]) + Ki * total + dither[t]
    return y, u, f"{which}, {moved}{', dither' if dither.any() else ''}"


def is_stable(plant: Plant, K: float, Ki: float) -> bool:
    """Say whether (1 - q^-1) A + B (K (1 - q^-1) + Ki) has all roots well inside."""
    one = np.array([1.0, -1.0])
    p = np.convolve(one, plant.A)
    extra = np.convolve(plant.B, K * one + [Ki, 0.0])
    size = max(len(p), len(extra))
    p = np.pad(p, (0, size - len(p))) + np.pad(extra, (0, size - len(extra)))
    if not Ki:
        p = plant.A + K * plant.B
    return bool(np.all(abs(np.roots(p)) < 0.998))


def margin(plant: Plant, sign: float) -> float:
    """Return the largest proportional gain of that sign that is stable, of those tried."""
    tried = np.geomspace(0.01, 100, 200)
    stable = [K for K in tried if np.all(abs(np.roots(plant.A + sign * K * plant.B)) < 1)]
    return max(stable, default=0.01)


def seen_by_oracle(plant: Plant, y, u, law: str) -> bool:
    """Say whether who knows the law, and the noise, finds it in the record."""
    n = plant.n
    f = {"ARX": np.ones(1), "ARMAX": plant.C, "OE": plant.A}[plant.family]
    x = lfilter(plant.B, plant.A, u)
    s = u**2 if law == "input" else x**2
    fy, fu, fs = (lfilter([1.0], f, v - v.mean()) for v in (y, u, s))
    linear = np.hstack([lagged(fy, range(1, n + 1)), lagged(fu, range(n + 2))])
    more = lagged(fs, range(1, n + 1) if law == "input" else range(n + 1))
    use = slice(2 * n + 50, None)

    def left(X):
        X = np.column_stack([np.ones(len(X)), X])[use]
        target = fy[use]
        return float(np.sum((target - X @ np.linalg.lstsq(X, target, rcond=None)[0]) ** 2))

    rows = len(y) - 2 * n - 50
    odds = 0.5 * rows * np.log(left(linear) / left(np.hstack([linear, more]))) - 0.5 * more.shape[1] * np.log(rows)
    return bool(odds > SURE)


def main(draws: int = 200, first: int = 0, *kinds: str) -> None:
    tasks = [(kind, first + k) for kind in (kinds or KINDS) for k in range(draws)]
    with ProcessPoolExecutor(2) as pool:
        found = list(pool.map(outcome, tasks, chunksize=5))
    print(f"| drawn plants | draws | {' | '.join(TESTS)} | any |")
    print("|---" * (len(TESTS) + 3) + "|")
    for kind in kinds or KINDS:
        some = [o for o in found if o.kind == kind and o.is_seen]
        cells = [f"{np.mean([test in o.told for o in some]):.3f}" for test in TESTS]
        print(f"| {kind} | {len(some)} | {' | '.join(cells)} | {np.mean([bool(o.told) for o in some]):.3f} |")
    aim = {"loop": "feedback", "square": "nonlinearity", "delay 5": "delay", "delay 12": "delay"}
    for kind, test in aim.items():
        missed = Counter(o.detail for o in found if o.kind == kind and o.is_seen and test not in o.told)
        if missed:
            print(f"{kind}, not named: " + "; ".join(f"{what} {count}" for what, count in missed.most_common(8)))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]), *sys.argv[3:])
