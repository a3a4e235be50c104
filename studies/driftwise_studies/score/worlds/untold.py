"""Why are jumps not told that the oracle tells? The best that a trial of `AutoMemory` comes to, by what is short.

Run: python -m driftwise_studies.score.worlds.untold [--systems 300] [--records 2]     (the choosing systems)
"""

from __future__ import annotations

import argparse
from collections import Counter

import numpy as np

import driftwise as dw
from driftwise.memory.auto import AutoMemoryKernel
from driftwise.memory.auto_constants import JUMP_ODDS, RATE
from driftwise.memory.auto_state import open_parts
from driftwise.memory.trial_state import AGE, ALONE, BESIDE, FREED, GAP, LEVEL, SAME, is_told

from .drawing import draw
from .field import table
from .judged import CHOOSING
from .measured import HEARD
from .simulation import Records, records
from .system import System
from .told import estimator, oracle, walk, without_outliers

CAUSES = (
    "no trial", "below even odds against none", "even to 20:1", "20:1 to 100:1", "told as louder noise",
    "another level of the noise is as likely", "fast drift is likelier",
)  # fmt: skip
NO_TRIAL, BELOW, EVEN, NEARLY, LOUDER, NOISE, DRIFT = CAUSES


def causes(system: System, r: Records, s: int) -> tuple[int, list[tuple[str, float]]]:
    """Return how many jumps of record s the oracle tells; of each that is not told the cause, and its deviations."""
    y, u, q = r.y[s], r.u[s] if r.u.shape[2] else None, walk(system, r.y.shape[1])
    known, sigma = without_outliers(system, r)
    _, can = oracle(system, known[s], r.u[s], sigma[s], r.jumps[s], r.moved[s], q)
    est = estimator(system, dw.AutoMemory())
    status, found = est.scan(y, u).status, []
    ends = [*r.jumps[s][1:].tolist(), len(y)]
    for j in np.flatnonzero(can):
        k = int(r.jumps[s][j])
        if (status[k : k + HEARD] & int(dw.Status.JUMP)).any():
            continue
        why = LOUDER if (status[k : k + HEARD] & int(dw.Status.NOISE)).any() else cause(est, y, u, k, ends[j])
        found.append((why, float(np.abs(r.moved[s, j] / np.array(system.deviations)).max())))
    return sum(can), found


def cause(est, y, u, k: int, end: int) -> str:
    """Return what a jump at sample k lacks, by the trials until ``end``, or as long as it could be told."""
    memory = next(policy for policy in est.policies if isinstance(policy, AutoMemoryKernel))
    state, best = est.scan(y[:k], None if u is None else u[:k]).state, []
    for t in range(k, min(k + HEARD, end)):
        state, _ = est.update(state, y[t], None if u is None else u[t])
        trial = open_parts(memory, state["memory_state"].ravel(), len(memory.cap)).trial
        head, logs = trial.head, trial.found
        if head[AGE] > 0 and not is_told(trial):
            prior = np.log(RATE * head[GAP])
            jump = max(logs[SAME] + head[ALONE], logs[FREED]) + prior
            best.append((jump - logs[SAME], jump - logs[LEVEL] - prior, jump - head[BESIDE]))
    if not best:
        return NO_TRIAL
    over_none = max(odds for odds, *_ in best)
    if over_none < JUMP_ODDS:
        return BELOW if over_none < 0 else EVEN if over_none < np.log(20.0) else NEARLY
    over_level = max(level for odds, level, _ in best if odds >= JUMP_ODDS)
    return NOISE if over_level < JUMP_ODDS else DRIFT


def main(arguments=None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--systems", type=int, default=300)
    parser.add_argument("--records", type=int, default=2)
    asked = parser.parse_args(arguments)
    tellable, found = 0, list[tuple[str, float]]()
    for number in range(asked.systems):
        system = draw(CHOOSING, number)
        if not system.jumps:
            continue
        r = records(system, range(asked.records))
        for s in range(asked.records):
            could, untold = causes(system, r, s)
            tellable, found = tellable + could, found + untold
    print(f"{tellable} jumps that the oracle tells, {len(found)} of them not told\n")
    counted = Counter(why for why, _ in found)
    rows = [
        [why, f"{n}", f"{n / len(found):.2f}", f"{np.median([size for w, size in found if w == why]):.1f}"]
        for why, n in counted.most_common()
    ]
    print(table(("what is short", "jumps", "share", "median size, deviations"), rows))


if __name__ == "__main__":
    main()
