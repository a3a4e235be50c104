"""Short records whose level or gain steps near an end: how often that is told, and what else is.

Run: python -m driftwise_studies.score.claims.late_steps [--records 24] [--seed 0]

Months, quarters or years, 80 to 300 of them, or 1000 to 3000 samples ("long"): noise of the first order, a season of
two harmonics where there is one, and what two inputs do: one that has the season, too, or is noise, and one that walks.
The level steps by two to eight deviations of the noise's innovations, or the gain of the second input becomes another,
after 60 to 97 % of the record, of every fourth record after 3 to 40 %. The other kinds have no step: the same records,
and such whose level walks, or moves as slow processes do, or has a long memory (`wander`), or whose noise has the tails
of Student's with three degrees of freedom and one to three outliers of one sign in its last sixteen samples. Told is a
step of which a change of its kind is dated within five samples.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from driftwise.analysis.segmentation import GAIN, LEVEL, hindsight

from .answering import coloured
from .command import show
from .wander import long_memory, slow

YEAR, QUARTERS = 12, 4
STEPS = ALONE, SEASON, INPUTS, BOTH, GAINS, LONG = (
    "level alone", "level and season", "level and inputs", "level, season and inputs", "gain", "long, level and inputs",
)  # fmt: skip
STEADY = tuple(f"no step: {one}" for one in (ALONE, SEASON, INPUTS, BOTH, LONG))
WANDERS = WALK, SLOW, MEMORY, TAILS, BEGINS = (
    "level that walks", "slow process", "long memory", "outliers at the end", "begins elsewhere",
)  # fmt: skip
KINDS = (*STEPS, *STEADY, *WANDERS)
NEAR = 5  # samples from the step within which it is told


def late_step(seed: int, number: int, kind: str) -> tuple[np.ndarray, np.ndarray, tuple[int, ...], int]:
    """Return y (T,), u (T, k), the seasons of its clock, and where it steps: T where it does not."""
    base = kind.removeprefix("no step: ")
    rng = np.random.default_rng([seed, number, 37, KINDS.index(kind)])
    is_long, has_season = base == LONG, base in (SEASON, BOTH) or (kind in WANDERS and number % 2 == 0)
    T = int(rng.integers(1000, 3000) if is_long else np.exp(rng.uniform(np.log(80), np.log(300))))
    season = int(rng.choice([YEAR, QUARTERS]))
    at = int(T * (rng.uniform(0.03, 0.4) if number % 4 == 3 else rng.uniform(0.6, 0.97)))
    t, phi = np.arange(T), rng.uniform(0, 0.6)
    y = coloured(rng, T, phi) / np.sqrt(1 - phi**2)
    if has_season:
        for k in (1, 2):
            y += rng.uniform(1, 4) / k * np.cos(2 * np.pi * k * t / season + rng.uniform(0, 2 * np.pi))
    u = np.zeros((T, 0))
    if base in (INPUTS, BOTH, LONG, GAINS):
        first = coloured(rng, T, rng.uniform(0, 0.8)) + (2 * np.sin(2 * np.pi * t / season) if has_season else 0)
        second = np.cumsum(rng.standard_normal(T)) / 8 if number % 2 else coloured(rng, T, rng.uniform(0, 0.9))
        u, pole = np.column_stack([first, second]), rng.uniform(0, 0.7)
        gains = np.tile(rng.uniform(0.5, 2, 2) * rng.choice([-1, 1], 2), (T, 1))
        if base == GAINS:
            gains[at:, 1] *= rng.choice([0.0, 0.4, 2.0, -1.0])
        y += lfilter([1 - pole], [1, -pole], (u * gains).sum(axis=1))
    if kind in STEPS and kind != GAINS:
        y += np.exp(rng.uniform(np.log(2), np.log(8))) * rng.choice([-1, 1]) * (t >= at)
    if kind == WALK:
        y += np.exp(rng.uniform(np.log(0.03), np.log(2))) * np.cumsum(rng.standard_normal(T))
    if kind == TAILS:  # one side, in a few of the last rows
        y += rng.standard_t(3, T)
        last = rng.choice(np.arange(T - 16, T), rng.integers(1, 4), replace=False)
        y[last] += rng.choice([-1, 1]) * rng.uniform(4, 12, len(last))
    if kind == BEGINS:
        y += rng.uniform(3, 20) * rng.choice([-1, 1]) * rng.uniform(0.5, 0.97) ** t
    if kind in (SLOW, MEMORY):
        y += rng.uniform(0.5, 3) * (slow if kind == SLOW else long_memory)(rng, T)
    return y, u, (season,) if has_season else (), at if kind in STEPS else T


def told(seed: int, number: int, kind: str) -> tuple[bool, int, bool]:
    """Return whether the step is told, how many other changes are, and whether the step is in the last eighth."""
    y, u, seasons, at = late_step(seed, number, kind)
    found = hindsight(y, u, seasons=seasons)
    jumps = found.jumps() if found else []
    right = [jump for jump in jumps if jump.kind == (GAIN if kind == GAINS else LEVEL) and abs(jump.at - at) <= NEAR]
    return bool(right), len(jumps) - len(right[:1]), len(y) * 7 / 8 < at < len(y)


def table(seed: int, records: int) -> str:
    """Return steps that are told, and other changes, as a table of Markdown."""
    rows = [
        "| kind | records | steps told | in the last eighth | other changes |",
        "| --- | --- | --- | --- | --- |",
    ]
    for kind in KINDS:
        seen = np.array([told(seed, number, kind) for number in range(records)]).astype(int)
        right, other, late = seen.T
        steps = f"{right.sum()} | {right @ late} of {late.sum()}" if kind in STEPS else " | "
        rows.append(f"| {kind} | {records} | {steps} | {other.sum()} |")
    return "\n".join(rows)


if __name__ == "__main__":
    show(table, __doc__, 24)
