"""Section 3: the gain as printed lacks Phi; what that does to the filter that knows Q."""

from __future__ import annotations

import numpy as np

import driftwise as dw

from ..verdict import Scaled, Section, Table, Verdict, numbers
from . import claims, plain
from .example import GAINS, KNOWN, OURS, PAPER, SIZES, scores
from .systems import system


def section(seeds: int) -> Section:
    """Known Q, the gain printed and correct, on the same records."""
    found, scaled = scores(seeds), Scaled(seeds, 400)
    rows = []
    for size in SIZES:
        for printed, word in GAINS.items():
            one = found[size, printed, KNOWN]
            rows.append(
                [f"{size:g}", word, f"{one.rmse:.4f} ± {one.deviation:.4f}", f"{one.nis:.3f}", f"{one.lag1:+.3f}"]
                + [f"{one.inside:.3f}", numbers(one.claimed, 2)]
            )
    head = ["q", "gain", "prediction RMSE", "NIS (1)", "lag 1 (0)", "in 95 % bands", "actual / claimed variance"]
    return Section(
        "The gain",
        [
            "θ(k+1) = Φ θ(k) + L ε(k) needs L = Φ P ψ/S; (11) prints L = P ψ/S, while the covariance (12) is that of "
            "the correct filter. With the true Q and σ² given, the printed filter is not the best one any more and "
            "does not know it. This package has the correct gain; the printed one lives only in this reproduction.",
        ],
        [Table(f"Known Q, {seeds} records; variances of a1, a2, b1, b2", head, rows)],
        verdicts=[_correct(found, scaled), _printed(found, scaled), *_paired(found, scaled), _engine()],
    )


def _correct(found, scaled):
    one, lag, near = found[1e-3, False, KNOWN], float(scaled.wide(0.02)), float(scaled.wide(0.01))
    holds = 1.005 - scaled.wide(0.025) <= one.nis <= 1.005 + scaled.wide(0.025)
    return Verdict(
        "known Q, correct gain, q = 1e-3: calibrated",
        f"NIS {one.nis:.3f}, lag-1 correlation {one.lag1:+.3f}, 95 % bands hold {one.inside:.3f}",
        f"NIS 1.005 ± {scaled.wide(0.025):.3f}, lag 1 within ± {lag:.3f}, .95 ± {near:.3f}",
        bool(holds and abs(one.lag1) <= lag and abs(one.inside - 0.95) <= near),
        OURS,
    )


def _printed(found, scaled):
    lag = {size: found[size, True, KNOWN].lag1 for size in SIZES}
    ratio = found[1e-2, True, KNOWN].claimed
    near = float(scaled.wide(0.03))
    return Verdict(
        "known Q, printed gain: innovations are correlated and P is too small",
        f"lag-1 correlation {lag[1e-3]:+.2f} at q = 1e-3, {lag[1e-2]:+.2f} at 1e-2; actual over claimed variance "
        f"{numbers(ratio, 2)} at 1e-2",
        f"−.15 and −.31 ± {near:.3f} (correct: 0); 1.07, 1.11, 1.08, 1.12 ± {near:.3f} (correct: 1)",
        bool(
            abs(lag[1e-3] + 0.15) <= near
            and abs(lag[1e-2] + 0.31) <= near
            and np.all(np.abs(ratio - [1.07, 1.11, 1.08, 1.12]) <= near)
        ),
        f"{PAPER} 3",
        claims.GAIN,
    )


def _paired(found, scaled):
    listed = {1e-3: (0.036, 0.98, 0.01), 1e-2: (0.179, 1.0, 0.03)}
    for size, (more, share, near) in listed.items():
        right, wrong = found[size, False, KNOWN].prediction, found[size, True, KNOWN].prediction
        better, cost = float((right < wrong).mean()), float(np.median(wrong / right) - 1)
        near = float(scaled.wide(near))
        yield Verdict(
            f"the correct gain predicts better, record by record, q = {size:g}",
            f"in {100 * better:.0f} % of the records; the printed one's mean square is {100 * cost:.1f} % larger "
            "(median)",
            f"at least 90 % ({100 * share:.0f} %); {100 * more:.1f} ± {100 * near:.1f} % larger",
            bool(better >= 0.9 and abs(cost - more) <= near),
            OURS,
        )


def _engine():
    """The compiled memory beside the plain recursion, and beside the printed one: a control that must differ."""
    s = system("a", 4)
    est = dw.Regression(4, memory=dw.memory.Drift(s.phi, s.q[0]), variance=s.told, P0=1000.0)
    mine = np.array([est.scan(y, psi).innovation for y, psi in zip(s.y, s.psi)])
    right, wrong = (np.abs(mine - plain.follow(s, plain.Known(s.q), printed).e).max() for printed in GAINS)
    return Verdict(
        "this package's Drift(phi, q) is the correct recursion",
        f"largest difference of an innovation {right:.1e}; from the printed recursion {wrong:.2f}",
        "below 1e-9, and above 1e-2 from the printed one",
        bool(right < 1e-9 and wrong > 1e-2),
        OURS,
    )
