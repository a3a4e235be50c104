"""A record afterwards: what smoothing gains, which drift is likelier, jumps dated; and history turned into numbers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

import driftwise as dw

from ..verdict import Scaled, Section, Table, Verdict
from .automatic import slack
from .entrants import SKIP
from .example import OURS
from .surprises import local_level
from .systems import system

CASES = ("b", "c", "d", "e", "g")


class Smoothed(NamedTuple):
    """One system: errors filtered and smoothed under the drift learnt, shares, jumps found a record, their samples."""

    filtered: float
    smoothed: float
    inside: float
    integrated: float
    jumps: float
    dated: float  # share of the true jumps found within 3 samples

    @property
    def gain(self) -> float:
        """Share of the filtered error that smoothing takes away."""
        return 1 - self.smoothed / self.filtered


def smooth(name: str, count: int, **options) -> Smoothed:
    """Smooth ``count`` records of a system, nothing told."""
    s, est = system(name, count), dw.Regression(4)
    kept: list[tuple] = []
    dated: list[bool] = []
    for y, psi, theta in zip(s.y, s.psi, s.theta):
        found = est.smooth(y, psi, **options)
        before, after = (found.filtered - theta)[SKIP:], (found.parameters - theta)[SKIP:]
        held = np.abs(after) < 1.96 * found.parameters_std[SKIP:]
        samples = np.array([jump.sample for jump in found.jumps])
        dated += [bool(np.any(np.abs(samples - jump) <= 3)) for jump in s.jumps]
        kept.append(((before**2).mean(), (after**2).mean(), held.mean(), found.drift == "integrated", len(samples)))
    filtered, smoothed, inside, integrated, jumps = (float(value) for value in np.mean(kept, axis=0))
    return Smoothed(filtered**0.5, smoothed**0.5, inside, integrated, jumps, float(np.mean(dated or [False])))


def section(seeds: int) -> Section:
    """Smooth every system as a user would, and b and c as random walks; tune on half of the local level."""
    scaled = Scaled(seeds, 200)
    count = scaled.records(100, 10)
    found = {name: smooth(name, count) for name in CASES}
    walks = {name: smooth(name, count, drift="walk", jumps=None) for name in "bc"}
    rows = [
        [name, f"{one.filtered:.4f}", f"{one.smoothed:.4f}", f"{100 * one.gain:.0f} %", f"{one.inside:.2f}"]
        + [f"{100 * one.integrated:.0f} %", f"{one.jumps:.2f}"]
        for name, one in found.items()
    ]
    head = ["system", "filtered", "smoothed", "gain", "in 95 % bars", "integrated walk", "jumps a record"]
    return Section(
        "Afterwards",
        [
            "smooth() looks at a whole record: drift by maximum likelihood, random or integrated walk as the "
            "likelihood has it, jumps found and left free. Filtered: the error under the same drift without the "
            "samples to come. tune() turns a record into the numbers of a Kalman filter."
        ],
        [Table(f"Smoothing, nothing told, {count} records", head, rows)],
        verdicts=[
            _gains(walks, scaled),
            _choice(found, scaled),
            _jumps(found, scaled),
            _tuned(),
        ],
    )


def _gains(walks, scaled):
    more, b, c = slack(scaled, 0.03), walks["b"], walks["c"]
    return Verdict(
        "smoothing takes away part of the error (random walks)",
        f"b {100 * b.gain:.0f} %, c {100 * c.gain:.0f} %",
        f"at least {35 - 100 * more:.0f} % and {22 - 100 * more:.0f} % (40, 27)",
        b.gain >= 0.35 - more and c.gain >= 0.22 - more,
        OURS,
    )


def _choice(found, scaled):
    more = slack(scaled, 0.03)
    return Verdict(
        "the likelihood tells a smooth drift from a random walk",
        f"integrated walk in {100 * found['b'].integrated:.0f} % of b, in {100 * found['c'].integrated:.0f} % of c",
        f"at least {95 - 100 * more:.0f} %, at most {5 + 100 * more:.0f} %",
        found["b"].integrated >= 0.95 - more and found["c"].integrated <= 0.05 + more,
        OURS,
    )


def _jumps(found, scaled):
    d, e, more = found["d"], found["e"], slack(scaled, 0.03)
    return Verdict(
        "jumps are found and dated afterwards, and not where there are none",
        f"{100 * d.dated:.0f} % of those of d within 3 samples, {d.jumps:.2f} a record; e: {e.jumps:.2f} a record",
        f"at least {90 - 100 * more:.0f} %, 2 ± {0.2 + more:.2f}; at most {0.06 + more:.2f}",
        d.dated >= 0.9 - more and abs(d.jumps - 2) <= 0.2 + more and e.jumps <= 0.06 + more,
        OURS,
    )


def _tuned():
    level = local_level()
    half, one = len(level.y) // 2, np.ones((len(level.y), 1))
    est = dw.Regression(1).tune(level.y[:half], one[:half])
    ratio = level.rmse(est.scan(level.y, one).parameters[:, 0]) / level.best
    return Verdict(
        "the peers' test, tuned on its first half",
        f"error on the second half {ratio:.4f} of the optimal filter's",
        "at most 1.005",
        ratio <= 1.005,
        OURS,
    )
