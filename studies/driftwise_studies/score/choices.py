"""Which structures and memories compete in a forecast: chosen anew on drawn rigs, in sight of no recording.

Run: python -m driftwise_studies.score.choices [--seed 0] [--records 2]

Each choice of `analysis.candidates` and `analysis.identifier` by which a forecast of `identify` may differ is made
otherwise: half as much of it, twice as much, more, fewer, none. Records are those of `rigs`, some of every kind, none
of them a model's own. The second half is judged, in pairs: how many points of fit the other choice has more, and how
much more log score a sample, each with its standard error. A choice stands where no other is better by more than two of
both errors.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from driftwise.analysis import candidates, identifier
from driftwise.memory.constant import Constant
from driftwise.memory.exponential_forgetting import ExponentialForgetting
from driftwise.memory.restart_on_change import RestartOnChange

from .claims.command import show
from .ours import ours
from .rigs import KINDS, draw

MOST = 20.0  # points that one record counts


def forgetting(*factors: float) -> tuple[Any, ...]:
    """Return memories that compete: none, and such factors."""
    return (Constant(), *(ExponentialForgetting(factor) for factor in factors))


def by(**changed: Any) -> dict[str, Any]:
    """Return names and values."""
    return changed


OTHERWISE = {
    "factors .999": by(FORGETTING=forgetting(0.999)),
    "factors .995": by(FORGETTING=forgetting(0.995)),
    "factors .9995, .9975, .99": by(FORGETTING=forgetting(0.9995, 0.9975, 0.99)),
    "and .95": by(FORGETTING=forgetting(0.999, 0.995, 0.98, 0.95)),
    "one input: up to second order": by(ONE=[one for one in candidates.ONE if max(one[:2]) <= 2]),
    "one input: without delays": by(ONE=[one for one in candidates.ONE if one[2] == 0]),
    "one input: six orders more": by(ONE=[*candidates.ONE, *((n, n, k) for n in (5, 6, 12) for k in (0, 1))]),
    "several inputs: up to second order": by(SEVERAL=[one for one in candidates.SEVERAL if max(one[:2]) <= 2]),
    "several inputs: (4,8,0), (6,6,0) more": by(SEVERAL=[*candidates.SEVERAL, (4, 8, 0), (6, 6, 0)]),
    "several inputs: none long": by(LONG=[]),
    "long where 10 rows an unknown": by(ROWS=10),
    "long where 40": by(ROWS=40),
    "no input: 1, 2, 4": by(NONE=[1, 2, 4]),
    "no input: 12, 20 more": by(NONE=[*candidates.NONE, 12, 20]),
    "colour: order 1": by(COLOURED=[1]),
    "colour: 4 more": by(COLOURED=[*candidates.COLOURED, 4]),
    "found delays: (2,2,0)": by(DELAYED=[(2, 2, 0)]),
    "found delays: (8,8,3) more": by(DELAYED=[*candidates.DELAYED, (8, 8, 3)]),
    "levels that jump: 1 per 500": by(JUMPS=RestartOnChange(candidates.SelfStarting("1 per 500"))),
    "levels that jump: 1 per 5000": by(JUMPS=RestartOnChange(candidates.SelfStarting("1 per 5000"))),
    "four structures go on after 4096": by(NARROW=4096),
    "two go on": by(KEEP=2),
    "eight go on": by(KEEP=8),
    "runs away at 3 times": by(AWAY=3.0),
    "at 30 times": by(AWAY=30.0),
    "units by 100 samples": by(PILOT=100),
    "by 400": by(PILOT=400),
}


@contextmanager
def chosen(changed: dict[str, Any]) -> Iterator[None]:
    """Let choices be others."""
    places = {name: candidates if hasattr(candidates, name) else identifier for name in changed}
    before = {name: getattr(place, name) for name, place in places.items()}
    try:
        for name, value in changed.items():
            setattr(places[name], name, value)
        yield
    finally:
        for name, place in places.items():
            setattr(place, name, before[name])


def judged(y, u) -> tuple[float, float] | None:
    """Return fit and log score of the second half; None where the output does not move."""
    half = slice(len(y) // 2, None)
    size = float(np.nanstd(y[half]))
    if not size > 0.0:
        return None
    said = ours(y, u)
    off = (said.prediction - y)[half]
    return 100 * (1 - float(np.sqrt(np.nanmean(off**2))) / size), float(np.nanmean(said.log_score[half]))


def table(seed: int, records: int) -> str:
    """Return what each other choice gains, as a table of Markdown."""
    warnings.simplefilter("ignore")
    rows = ["| otherwise | moved | points of fit more | log score more |", "| --- | --- | --- | --- |"]
    drawn = [draw(kind, seed, number) for kind in KINDS for number in range(records)]
    now = [judged(y, u) for y, u in drawn]
    for words, changed in OTHERWISE.items():
        with chosen(changed):
            other = [judged(y, u) for y, u in drawn]
        gains = np.array([np.subtract(b, a) for a, b in zip(now, other) if a is not None and b is not None])
        gains = np.clip(gains, -MOST, MOST)
        middle, error = gains.mean(axis=0), gains.std(axis=0) / np.sqrt(len(gains))
        cells = " | ".join(f"{m:+.3f} +- {e:.3f}" for m, e in zip(middle, error))
        rows.append(f"| {words} | {int(np.any(gains != 0, axis=1).sum())} of {len(gains)} | {cells} |")
        print(rows[-1], flush=True)
    return "\n".join(rows)


if __name__ == "__main__":
    show(table, __doc__, 2)
