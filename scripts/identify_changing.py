"""Is the model that `identify` names of a plant that changes the one to go on with? The table of docs/identify.md.

    python scripts/identify_changing.py [draws [first seed]]

A draw is a plant of `identify_families.py`, of 120 to 4000 samples and as many to come, in both of which it changes:
one to three jumps of the gain (by .3 to .7, or .75 to .93, of it or of its inverse), of all parameters, or of the level
(up to six deviations of the noise); or a gain whose logarithm walks. "error": mean square of what is to come, over that
of the candidate that turns out to be best, geometric mean; "of the likeliest": the same if the likeliest were named.
"""

from __future__ import annotations

import sys
from concurrent.futures import ProcessPoolExecutor
from typing import NamedTuple

import numpy as np
from identify_families import FAMILIES, polynomial
from scipy.signal import lfilter

from driftwise.analysis.identifier import Identifier

CHANGES = "gain", "gain, small", "gain walks", "all parameters", "level"
WORST = np.e**3  # an error larger than this many times the best counts as that
AMONG = 9  # likeliest candidates among which the best is looked for


class Changing(NamedTuple):
    """A record of T samples and T to come."""

    change: str
    samples: int
    y: np.ndarray
    u: np.ndarray | None


def draw(seed: int) -> Changing:
    """Return a plant that changes."""
    rng = np.random.default_rng([seed, 77])
    family, change = FAMILIES[seed % len(FAMILIES)], CHANGES[int(rng.integers(len(CHANGES)))]
    T, n = int(np.exp(rng.uniform(np.log(120), np.log(4000)))), int(rng.integers(1, 4))
    size, nk = 2 * T, int(rng.integers(1, 3)) if family == "ARX" else 1
    A, C = polynomial(rng, n, 0.95), polynomial(rng, n, 0.9)
    a, b, level = np.tile(A[1:], (size, 1)), np.tile(rng.standard_normal(n), (size, 1)), np.zeros(size)
    if change == "gain walks":
        b *= np.exp(np.cumsum(rng.standard_normal(size)) * rng.uniform(0.3, 1.5) / np.sqrt(T))[:, None]
    else:
        many = rng.integers(1, 4)
        for t in np.sort(np.concatenate([rng.integers(T // 10, T, many), T + rng.integers(1, T, many)])):
            if change == "all parameters":
                a[t:], b[t:] = polynomial(rng, n, 0.95)[1:], rng.standard_normal(n)
            elif change == "level":
                level[t:] = rng.uniform(-6, 6)
            else:
                b[t:] *= rng.uniform(*((0.3, 0.7) if change == "gain" else (0.75, 0.93))) ** rng.choice([-1, 1])
    coloured = lfilter([1], [1, -rng.uniform(0, 0.9)], rng.standard_normal(size))
    u = rng.choice([-1.0, 1.0], size) if rng.random() < 0.5 else coloured
    e = rng.standard_normal(size)
    x = response(a, b, nk, u)
    v = e if family == "OE" else response(a, np.ones((size, 1)), 0, lfilter(C, 1, e) if family == "ARMAX" else e)
    if family == "AR":
        return Changing(change, T, v + level * v.std(), None)
    std = x[:T].std() / v[:T].std() / np.sqrt(10 ** rng.uniform(0, 2))
    return Changing(change, T, x + std * (v + level * v.std()), u)


def response(a, b, nk: int, u) -> np.ndarray:
    """Return y_t = - a_t [y_{t-1}, ..] + b_t [u_{t-nk}, ..]."""
    n, m, y = a.shape[1], b.shape[1], np.zeros(len(u) + a.shape[1])
    past = np.concatenate([np.zeros(nk + m), u])
    for t in range(len(u)):
        y[n + t] = -a[t] @ y[t : n + t][::-1] + b[t] @ past[t + 1 : t + m + 1][::-1]
    return y[n:]


def outcome(seed: int) -> tuple[str, float, float]:
    """Return the change, and how far what is named, and the likeliest, are behind the best in what is to come."""
    d = draw(seed)
    T, level = d.samples, d.y[: d.samples].mean()
    y, u = d.y - level, (lambda a, b: None) if d.u is None else (lambda a, b: d.u[a:b])
    found = Identifier(0 if d.u is None else 1)
    found.add(d.y[:T], u(0, T))

    def error(rival) -> float:
        est = rival.candidate.best.scaled_to(y[:T], u(0, T))
        state = est.scan(y[:T], u(0, T), keep="innovations").state
        e = est.scan(y[T:], u(T, 2 * T), state=state, keep="innovations").innovation
        return float(np.mean(e**2))

    named, likeliest = error(found.chosen), error(found.rivals[0])
    best = min(named, *map(error, found.rivals[:AMONG]))
    return d.change, min(named / best, WORST), min(likeliest / best, WORST)


def main(draws: int = 400, first: int = 0) -> None:
    with ProcessPoolExecutor(2) as pool:
        outcomes = list(pool.map(outcome, range(first, first + draws), chunksize=5))
    print("| what changes | draws | error | of the likeliest |\n|---|---|---|---|")
    for change in (*CHANGES, "all"):
        some = np.log([o[1:] for o in outcomes if change in (o[0], "all")])
        print(f"| {change} | {len(some)} | {' | '.join(f'{x:.3f}' for x in np.exp(some.mean(0)))} |")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
