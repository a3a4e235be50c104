"""This package's observers in the comparison, and what their rows rest on."""

from __future__ import annotations

import numpy as np

from ..verdict import Scaled, Section, Verdict, short
from . import claims, comparison
from .comparison import Score
from .listed import GROWING4, SOFT, THEOREM, THIS, WINDOW4, WINDOW6
from .motor import NOMINAL, modes, records
from .opponents import HONEST, PRIOR, Kalman, Run
from .watchers import KALMAN, Compiled, Sliding, everybody, under_model_errors


def section(seeds: int) -> Section:
    """Everybody on the paper's experiment, this package's observers first."""
    rows = everybody()
    found = comparison.section(seeds, rows, lambda scores: [_soft(scores, seeds), _worth(scores)])
    found.verdicts += [_same_kalman(rows[KALMAN]), _same_windows(rows)]
    return found


def errors(seeds: int) -> Section:
    """Wrong models and other noise, this package's observers first."""
    found = comparison.model_errors(Scaled(seeds, 200).records(100, 20), under_model_errors)
    found.verdicts.append(_robust(found))
    return found


def _soft(scores: dict[str, Score], seeds: int) -> Verdict:
    soft, theorem = scores[SOFT.format(1)].late[2], scores[THEOREM].late[2]
    hard = scores[WINDOW6].late[2]
    return Verdict(
        "x3 from 2 s on: a window of 1 s with a prior of 2 on the disturbances, against the theorem",
        f"RMSE {soft:.4f} A against {theorem:.2f} A (the same window without priors {hard:.2f} A)",
        "below 0.12 A (0.0903 to 0.0909 in batches of 20 records) against 3.2 to 4.5 A",
        bool(soft < 0.12 and 3.2 <= theorem <= 4.5 and 4.3 <= hard <= 5.2),
        THIS,
    )


def _worth(scores: dict[str, Score]) -> Verdict:
    plain, theorem = scores[GROWING4], scores[THEOREM]
    ratio = theorem.late / plain.late
    return Verdict(
        "what the cosine costs who removes it without a prior",
        f"the theorem's errors over those of least squares that leaves it out, from 2 s on: {ratio[0]:.1f}, "
        f"{ratio[1]:.0f}, {ratio[2]:.0f} times",
        "1.6, 29, 57 times (within a fifth)",
        bool(np.all(np.abs(ratio / [1.63, 29.4, 56.5] - 1) <= 0.2)),
        THIS,
    )


def _same_kalman(ours: Run) -> Verdict:
    r = records(NOMINAL, range(2))
    y, u = r.y[:, :3001], r.u[:3001]
    apart = np.abs(ours(y, u) - Kalman(modes(6), PRIOR)(y, u))[:, 20:].max(axis=(0, 1))
    return Verdict(
        f"the growing window with a prior is the Kalman filter ({HONEST})",
        f"largest difference of the states {', '.join(map(short, apart))}",
        "at most 1e-8 (plain NumPy, Joseph form)",
        bool(np.all(apart <= 1e-8)),
        THIS,
    )


def _same_windows(rows) -> Verdict:
    r, worst = records(NOMINAL, range(1)), 0.0
    for name in (WINDOW6, WINDOW4, SOFT.format(0.3)):
        sliding: Sliding = rows[name]
        L = sliding.observer.length
        y, u = r.y[:, : L + 500], r.u[: L + 500]
        apart = np.abs(Compiled(sliding.observer)(y, u) - sliding(y, u))[0, L - 1 :]
        worst = max(worst, float((apart / sliding.observer.design.std[:3]).max()))
    return Verdict(
        "windows: compiled sample by sample, and gains applied to whole records",
        f"largest difference {short(worst)} deviations",
        "at most 1e-8",
        worst <= 1e-8,
        THIS,
    )


def _robust(found: Section) -> Verdict:
    table = found.tables[0]

    def current(case):
        row = next(row for row in table.rows if row[0].startswith(case))
        return [float(row[table.head.index(name)].split(", ")[-1]) for name in (THEOREM, WINDOW4, HONEST)]

    white, coloured = current("nominal"), current("noise AR(1)")
    return Verdict(
        "noise that is not white, same variance (AR(1), pole .99): x3",
        f"theorem {coloured[0]:.1f} A (white noise: {white[0]:.1f}), window of 4 modes {coloured[1]:.2f} "
        f"({white[1]:.2f}), Kalman filter with a prior {coloured[2]:.3f} ({white[2]:.3f})",
        "10.7 (3.8), .58 (.09), .088 (.07) A; the theorem at least doubles, and is 10 times worse than the window",
        bool(coloured[0] >= 2 * white[0] and coloured[0] >= 10 * coloured[1]),
        THIS,
        claims.OTHER_NOISE,
    )
