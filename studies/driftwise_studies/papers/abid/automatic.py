"""What the default memory promises on the ranked systems: error, bars, jumps."""

from __future__ import annotations

import numpy as np

from driftwise import Status

from ..verdict import Scaled, Section, Table, Verdict
from . import ranking
from .entrants import AUTO, KNOWN, LEARNT, TOLD
from .example import OURS
from .systems import RANKED

BOUNDS = {"a": 1.08, "b": 1.25, "c": 1.20, "d": 1.05, "e": 1.20, "f10": 1.20, "f01": 1.20, "g": 1.18}
INSIDE = {
    "b": (0.88, 1),
    "c": (0.93, 0.97),
    "d": (0.95, 1),
    "e": (0.95, 1),
    "f10": (0.92, 1),
    "f01": (0.92, 1),
    "g": (0.91, 1),
}
NIS = (0.95, 1.10)
MEAN, WORST = 1.10, 1.20
SOON = 20


def section(seeds: int) -> Section:
    """The lines of `AutoMemory`, judged."""
    scaled = Scaled(seeds, 200)
    nothing, told = (ranking.line(seeds, AUTO, how) for how in (LEARNT, TOLD))
    jumps = {
        how: detection(ranking.line(seeds, AUTO, how).outcome["d"].status, (200, 400)) for how in (LEARNT, TOLD, KNOWN)
    }
    calm = {how: detection(ranking.line(seeds, AUTO, how).outcome["e"].status, ()) for how in (LEARNT, TOLD, KNOWN)}
    rows = [
        [
            ranking.WORDS[how],
            f"{jumps[how][0]:.3f}",
            f"{jumps[how][1]:.1f}",
            f"{jumps[how][2]:.3f}",
            f"{calm[how][2]:.3f}",
        ]
        for how in jumps
    ]
    return Section(
        "AutoMemory, the default",
        [
            "Nothing is told: neither Q nor σ², nor where to begin. Bounds hold for 200 records; with fewer they are "
            "as much wider as the standard error.",
            f"Where its bars are not right: on a they hold {nothing.outcome['a'].inside:.2f} (Q and σ² cannot be told "
            f"apart there), on constant parameters {nothing.outcome['e'].inside:.2f}, too wide because drift is never "
            f"ruled out; and right after a jump it is surprised (NIS {nothing.outcome['d'].nis:.1f} on d).",
        ],
        [
            Table(
                "Jumps told by AutoMemory (d: two jumps a record; e: none)",
                ["σ²", "seen within 20", "mean delay", "false, a record of d", "false, a record of e"],
                rows,
            )
        ],
        verdicts=[
            *_errors(nothing, told, scaled),
            *_bars(nothing, scaled),
            _jumps(jumps[LEARNT], calm[LEARNT], scaled),
            _variance(told, scaled),
        ],
    )


def detection(status, jumps) -> tuple[float, float, float]:
    """Return the share of the jumps told within 20 samples, the mean delay, and the false ones a record."""
    told = (status & int(Status.JUMP)) != 0
    seen, delays, false = [], [], told.copy()
    for jump in jumps:
        near = told[:, jump : jump + SOON]
        seen.append(near.any(axis=1))
        delays.append(near.argmax(axis=1)[seen[-1]])
        false[:, jump : jump + SOON] = False
    share = float(np.mean(seen)) if jumps else 0.0
    delay = float(np.concatenate(delays).mean()) if jumps and np.any(seen) else float("nan")
    return share, delay, float(false.sum(axis=1).mean())


def slack(scaled: Scaled, deviation: float) -> float:
    """Return what a bound for 200 records is widened by where there are fewer."""
    return float(scaled.wide(deviation)) - deviation


def _errors(nothing, told, scaled):
    more = slack(scaled, 0.04)
    cases = [(name, nothing.ratio[name], "") for name in RANKED if not name.startswith("f")]
    cases += [
        (name, told.ratio[name], f", told σ² ten times too {size}")
        for name, size in (("f10", "large"), ("f01", "small"))
    ]
    for name, ratio, words in cases:
        yield Verdict(
            f"AutoMemory, error on {name} over the reference{words}",
            f"{ratio:.3f}",
            f"at most {BOUNDS[name] + more:.2f}",
            ratio <= BOUNDS[name] + more,
            OURS,
        )
    yield Verdict(
        "AutoMemory, geometric mean and worst over all eight, nothing told",
        f"{nothing.mean:.3f}, {nothing.worst:.2f}",
        f"at most {MEAN + more / 2:.2f}, {WORST + more:.2f}",
        nothing.mean <= MEAN + more / 2 and nothing.worst <= WORST + more,
        OURS,
    )


def _bars(nothing, scaled):
    more = slack(scaled, 0.01)
    for name, (low, high) in INSIDE.items():
        one = nothing.outcome[name]
        holds = low - more <= one.inside <= high + more
        if name != "d":
            holds = holds and NIS[0] - 2 * more <= one.nis <= NIS[1] + 2 * more
        span = f"{low - more:.2f} to {high + more:.2f}" if high < 1 else f"at least {low - more:.2f}"
        yield Verdict(
            f"AutoMemory, 95 % bars and NIS on {name}",
            f"bars hold {one.inside:.3f}, NIS {one.nis:.2f}",
            span + ("" if name == "d" else f"; NIS {NIS[0] - 2 * more:.2f} to {NIS[1] + 2 * more:.2f}"),
            bool(holds),
            OURS,
        )


def _jumps(d, e, scaled):
    more = slack(scaled, 0.02)
    return Verdict(
        "AutoMemory, jumps: told soon, and not told where there are none",
        f"{100 * d[0]:.1f} % of those of d within 20 samples (mean delay {d[1]:.1f}), {d[2]:.3f} false a record; e: "
        f"{e[2]:.3f} a record",
        f"at least {92 - 100 * more:.0f} %, at most {0.05 + more:.2f}; at most {0.02 + more:.2f}",
        bool(d[0] >= 0.92 - more and d[2] <= 0.05 + more and e[2] <= 0.02 + more),
        OURS,
    )


def _variance(told, scaled):
    medians = [float(np.median(told.outcome[name].sigma2)) for name in ("f10", "f01")]
    near = 0.002 + 0.02 * slack(scaled, 0.03)
    return Verdict(
        "AutoMemory learns σ² that was told ten times wrong",
        f"median at the last sample: f10 {medians[0]:.4f}, f01 {medians[1]:.4f}",
        f".02 ± {near:.4f}",
        all(abs(median - 0.02) <= near for median in medians),
        OURS,
    )
