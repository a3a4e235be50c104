"""Monthly counts with a season and a level that steps beside inputs: how often the step is told, and what else is.

Run: python -m driftwise_studies.score.claims.seasonal_steps [--records 40] [--seed 1]

The logarithm of a count of some 1600 a month, 160 to 300 months, is a season of three harmonics, noise of the first
order of .04 to .08, and what two inputs do: one that grows and has the season, too, and one that walks. "Step": the
count falls by 15 to 25 % at once in the second half, and the second input may move then. "Steady": it does not. All is
told of twice, without what the clock says of a season and with it (`season=12`).
"""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from driftwise.analysis.segmentation import LEVEL, hindsight

from .command import show

YEAR = 12
STEP, STEADY = KINDS = "step", "steady"
NEAR = 3  # months from the step within which a level that is told is that one


def counts(seed: int, number: int, kind: str) -> tuple[np.ndarray, np.ndarray, int]:
    """Return y (T,), u (T, 2), and the month of the step: T where there is none."""
    rng = np.random.default_rng([seed, number, 33])
    T = int(rng.integers(160, 300))
    at = int(rng.integers(T // 2, T - 18)) if kind == STEP else T
    t, size = np.arange(T), np.log(1 - rng.uniform(0.15, 0.25))
    after = t >= at
    grows = 1 + 0.5 * t / T + 0.15 * np.sin(2 * np.pi * t / YEAR + 1) + 0.03 * rng.standard_normal(T)
    walks = 0.003 * np.cumsum(rng.standard_normal(T)) - 0.02 * after * rng.uniform(-1, 1)
    season = sum(
        rng.uniform(0.02, 0.12) * np.cos(2 * np.pi * k * t / YEAR + rng.uniform(0, 2 * np.pi)) for k in (1, 2, 3)
    )
    phi = rng.uniform(0, 0.6)
    noise = lfilter([np.sqrt(1 - phi**2)], [1, -phi], rng.standard_normal(T + 100))[100:]
    log = 7.4 + season + rng.uniform(-0.3, 0.3) * (grows - 1) - rng.uniform(0, 3) * walks + size * after
    y = np.round(np.exp(log + rng.uniform(0.04, 0.08) * noise))
    return y, np.column_stack([grows, walks]), at


def table(seed: int, records: int) -> str:
    """Return steps that are told, and other changes, as a table of Markdown."""
    rows = ["| kind | records | season | steps told | other changes |", "| --- | --- | --- | --- | --- |"]
    for kind in KINDS:
        for seasons in ((), (YEAR,)):
            steps = others = 0
            for number in range(records):
                y, u, at = counts(seed, number, kind)
                found = hindsight(y, u, seasons=seasons)
                told = found.jumps() if found else []
                right = any(jump.kind == LEVEL and abs(jump.at - at) <= NEAR for jump in told)
                steps, others = steps + right, others + len(told) - right
            rows.append(f"| {kind} | {records} | {'known' if seasons else 'not known'} | {steps} | {others} |")
    return "\n".join(rows)


if __name__ == "__main__":
    show(table, __doc__, 40)
