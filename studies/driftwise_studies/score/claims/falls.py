"""Monthly counts that fall once or twice beside inputs that grow and walk: how often that is told, beside who knows.

Run: python -m driftwise_studies.score.claims.falls [--records 40] [--seed 1]

The logarithm of a count of some 200 to 5000 a month, 120 to 300 months, is a season of three harmonics, noise of the
first order of .03 to .09, and what two inputs do: what is driven, which grows by up to two thirds and has the season,
and a price, which walks by steps with the tails of Student's t of 3 and may leap once, both by an elasticity. "Once":
at some month the count falls by 10 to 30 % at once. "Twice": by another such share in the other half. "None": not.
"Who knows" is told the season, the inputs and the class of the noise (least squares of the logarithm, with and without
a step at each month; beside the first, the second), and tells what is above 1000:1, Schwarz's half logarithm for the
size and one for the date paid: as the program tells a level.

"""

from __future__ import annotations

import math

import numpy as np
from scipy.signal import lfilter

from driftwise.analysis.segmentation import LEVEL, hindsight

from .command import show
from .seasonal_steps import NEAR, YEAR

ONCE, TWICE, NONE = KINDS = "once", "twice", "none"
EDGE = 12  # months at either end without a fall
SURE = math.log(1000.0)
COLOURS = np.linspace(0.0, 0.95, 20)  # of the noise, that who knows its class tries


def counts(seed: int, number: int, kind: str) -> tuple[np.ndarray, np.ndarray, tuple[int, ...]]:
    """Return y (T,), u (T, 2), and the months of the falls."""
    rng = np.random.default_rng([seed, number, 35])
    T = int(rng.integers(120, 301))
    t, half = np.arange(T), T // 2
    dates = [int(rng.integers(EDGE, half - EDGE)), int(rng.integers(half + EDGE, T - EDGE))]
    sizes = np.log(1 - rng.uniform(0.1, 0.3, 2))
    if kind == ONCE:
        keep = int(rng.integers(2))
        dates, sizes = dates[keep : keep + 1], sizes[keep : keep + 1]
    elif kind == NONE:
        dates, sizes = [], sizes[:0]
    driven = rng.uniform(0, 0.5) * t / T + rng.uniform(0.05, 0.2) * np.sin(2 * np.pi * t / YEAR + rng.uniform(0, 6))
    driven += 0.03 * rng.standard_normal(T)
    price = np.cumsum(rng.uniform(0.005, 0.02) * rng.standard_t(3, T))
    price += rng.uniform(0.1, 0.4) * (t >= rng.integers(T)) * (rng.uniform() < 0.5)
    season = sum(
        rng.uniform(0.02, 0.12) * np.cos(2 * np.pi * k * t / YEAR + rng.uniform(0, 2 * np.pi)) for k in (1, 2, 3)
    )
    phi = rng.uniform(0, 0.6)
    noise = lfilter([np.sqrt(1 - phi**2)], [1, -phi], rng.standard_normal(T + 100))[100:]
    log = rng.uniform(math.log(200), math.log(5000)) + season + rng.uniform(-0.3, 0.6) * driven
    log += -rng.uniform(0, 0.5) * price + sum(size * (t >= at) for at, size in zip(dates, sizes))
    y = np.round(np.exp(log + rng.uniform(0.03, 0.09) * noise))
    return y, np.exp(np.column_stack([driven, price])), tuple(dates)


def known(y, u, dates) -> int:
    """Return how many of the falls are told by who knows the season, the inputs and the class of the noise."""
    T, log, found = len(y), np.log(np.maximum(y, 0.5)), list[int]()
    t = np.arange(T)
    turns = [f(2 * np.pi * k * t / YEAR) for k in (1, 2, 3) for f in (np.cos, np.sin)]
    columns = [np.ones(T), t / T, *np.log(u).T, *turns]
    for _ in range(2):
        least = _criterion(log, [*columns, *(t >= at for at in found)])
        gains = {
            at: least - _criterion(log, [*columns, *(t >= other for other in (*found, at))])
            for at in range(6, T - 6)
            if all(abs(at - other) > NEAR for other in found)
        }
        best = max(gains, key=lambda at: gains[at])
        if gains[best] - 1.5 * math.log(T) < SURE:
            break
        found.append(best)
    return sum(any(abs(at - other) <= NEAR for other in found) for at in dates)


def _criterion(y, columns) -> float:
    """Return half the deviance of a regression beside noise of the first order, at the likeliest colour."""
    X = np.column_stack([y, *columns]).astype(float)
    G0, G1, G2 = X[1:].T @ X[1:], X[1:].T @ X[:-1], X[:-1].T @ X[:-1]
    best = math.inf
    for phi in COLOURS:
        G = G0 - phi * (G1 + G1.T) + phi * phi * G2
        left = G[0, 0] - G[0, 1:] @ np.linalg.solve(G[1:, 1:], G[0, 1:])
        best = min(best, 0.5 * len(y) * math.log(left / len(y)))
    return best


def table(seed: int, records: int) -> str:
    """Return falls that are told, and other changes, as a table of Markdown."""
    rows = ["| falls | records | falls | who knows | season | told | other changes |", "| --- " * 7 + "|"]
    for kind in KINDS:
        drawn = [counts(seed, number, kind) for number in range(records)]
        falls, best = sum(len(dates) for _, _, dates in drawn), sum(known(*one) for one in drawn)
        for seasons in ((YEAR,), ()):
            right = others = 0
            for y, u, dates in drawn:
                found = hindsight(y, u, seasons=seasons)
                told = [jump.at for jump in found.jumps() if jump.kind == LEVEL] if found else []
                hits = sum(any(abs(one - at) <= NEAR for one in told) for at in dates)
                right, others = right + hits, others + (len(found.jumps()) if found else 0) - hits
            row = kind, records, falls, best, "known" if seasons else "not known", right, others
            rows.append("| " + " | ".join(map(str, row)) + " |")
    return "\n".join(rows)


if __name__ == "__main__":
    show(table, __doc__, 40)
