"""What each part of `ModelAverage` is worth on recordings: the numbers of docs/decisions/model-average.md.

    DRIFTWISE_DATA=.. python scripts/model_average.py [record ..]

One step ahead, nothing tuned, second half scored, as in docs/score.md. Members are the linear candidates of `identify`,
each with all memories; the forecast is by regrets, its variance what its errors were beside the four
that compete. "normal": the density N(m, s), and that variance, instead. "no floor": the same record with a millionth of
its deviation of noise added, so that its smallest step says nothing any more. `AutoMemory` is slow with
many parameters: records up to 2500 samples only.
"""

import sys
from time import perf_counter

import numpy as np
from driftwise_studies.score.protocol import Score, judge
from driftwise_studies.score.records import ROWS, folder
from driftwise_studies.score.second import read

import driftwise as dw
from driftwise.analysis.candidates import candidates
from driftwise.analysis.identifier import PILOT
from driftwise.estimators.model_average.step import BASE

LONGEST = 2500  # samples of a record on which AutoMemory is tried
EDGE = 1.959963984540054


def members(inputs, auto=False, fading=True):
    """Return the linear candidates, each with the memories asked for."""
    linear = [c for c in candidates(inputs) if c.is_linear]
    others = [dw.AutoMemory()] if auto else []
    return [c.estimator(memory) for c in linear for memory in (*(c.memories if fading else ()), *others)]


def averaged(y, u, own, **options):
    """Return the trace of the average of members over a record."""
    u = u if u.shape[1] else None
    pilot = slice(min(PILOT, len(y) // 2))
    average = dw.ModelAverage(own, **options).scaled_to(y[pilot], None if u is None else u[pilot])
    return average.scan(y, u)


def score(trace) -> Score:
    """Return the score of the learnt density."""
    inside = np.where(np.isfinite(trace.normal_score), abs(trace.normal_score) <= EDGE, np.nan)
    return judge(trace.y, trace.prediction, trace.variance, inside, trace.log_score)


def price(y, u, auto) -> float:
    """Return microseconds a sample of the average over a record; compiled before."""
    own = members(u.shape[1], auto=auto)
    averaged(y[:50], u[:50], own)
    begin = perf_counter()
    averaged(y, u, own)
    return 1e6 * (perf_counter() - begin) / len(y)


def variants(y, u) -> dict[str, Score]:
    """Return the score of each variant."""
    own = members(u.shape[1])
    trace = averaged(y, u, own)
    base = trace.table[:, BASE]
    found = {"all": score(trace), "normal": judge(y, trace.prediction, base)}
    found["window 1e-9"] = score(averaged(y, u, own, window=1e-9))
    found["phi 1"] = score(averaged(y, u, own, forgetting=1.0))
    tiny = 1e-6 * np.nanstd(y) * np.random.default_rng(0).standard_normal(len(y))
    found["no floor"] = score(averaged(y + tiny, u, own))
    if len(y) <= LONGEST:
        found["with AutoMemory"] = score(averaged(y, u, members(u.shape[1], auto=True)))
        found["AutoMemory only"] = score(averaged(y, u, members(u.shape[1], auto=True, fading=False)))
    return found


NAMES = ("all", "normal", "window 1e-9", "phi 1", "no floor", "with AutoMemory", "AutoMemory only")


def main(*wanted: str) -> None:
    where, gathered = folder(), {}
    print("fit % / NIS / % in the 95 % band / log score")
    print(f"| record | {' | '.join(NAMES)} |\n|{'---|' * (len(NAMES) + 1)}")
    for name in wanted or ROWS:
        record = read(name, where)
        gathered[name] = variants(record.y, record.u)
        cells = [
            f"{s.fit:.1f} / {s.nis:.2f} / {s.share:.0f} / {s.log_score:.2f}" if s else ""
            for s in (gathered[name].get(n) for n in NAMES)
        ]
        print(f"| {name} | {' | '.join(cells)} |", flush=True)
    for n in NAMES:
        some = [(f[n], f["all"]) for f in gathered.values() if n in f]
        nis = sum(0.8 <= s.nis <= 1.25 for s, _ in some)
        held = sum(91.5 <= s.share < 97.5 for s, _ in some)
        worse = np.mean([s.fit - a.fit for s, a in some]), np.mean([s.log_score - a.log_score for s, a in some])
        print(f"{n}: of {len(some)} NIS in .8-1.25 {nis}, bands hold 92-97 % {held};", end=" ")
        print(f"against all: fit {worse[0]:+.2f} points, log score {worse[1]:+.3f}")
    y, u, _ = read("hair_dryer", where)
    print(f"hair_dryer: {price(y, u, False):.0f} us a sample, with AutoMemory {price(y, u, True):.0f}")


if __name__ == "__main__":
    main(*sys.argv[1:])
