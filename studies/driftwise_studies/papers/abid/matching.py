"""Section 4: covariance matching, its guards, and the noise variance that the paper takes as known."""

from __future__ import annotations

import numpy as np

import driftwise as dw

from ..verdict import Scaled, Section, Verdict
from . import plain
from .automatic import slack
from .entrants import SKIP, TOLD, Entrant, reference, run
from .example import OURS
from .rule import compiled
from .systems import system

RULES = {"scalar": 1.34, "gain": 1.18, "myers-tapley": 1.29}


def section(seeds: int) -> Section:
    """Three rules on system c, the unguarded one beside them, and sigma^2 told wrong."""
    scaled = Scaled(seeds, 400)
    s = system("c", scaled.records(200, 10))
    return Section(
        "Covariance matching, and σ²",
        [
            "All rules of the paper's section 4 are driven by ε² − S, one number a sample. In steady state the mean of "
            "K S K' is Q, so every Q is a fixed point of its own shape and Q = 0 stays 0: a floor is needed, and a "
            "clamp, for the sums go negative. Measured on system c of driftwise reproduce policies.",
            "The paper takes σ² as known. Told ten times wrong it costs the filter with the true Q as much as most "
            "guesses of Q cost; learning it costs next to nothing.",
        ],
        verdicts=[*_guarded(s, scaled), _naive(s), *_told(scaled)],
    )


def _guarded(s, scaled):
    best, count = reference(s), min(20, len(s.y))
    for name in RULES:
        memory = dw.memory.CovarianceMatching(name, phi=s.phi)
        est, square, least, lowest = compiled(s, memory), [], np.inf, np.inf
        for i, (y, psi) in enumerate(zip(s.y, s.psi)):
            trace = est.scan(y, psi, keep="covariance" if i < count else "std")
            square.append(np.mean((trace.parameters - s.theta[i])[SKIP:] ** 2))
            lowest = min(lowest, float(trace.variance.min()))
            if i < count:
                least = min(least, float(np.linalg.eigvalsh(trace.covariance).min()))
        ratio = float(np.sqrt(np.mean(square))) / best
        most = 1.45 + slack(scaled, 0.05)
        yield Verdict(
            f"covariance matching, rule {name!r}, on system c",
            f"error {ratio:.2f} of the reference's; least S {lowest:.4f}, least eigenvalue of P {least:.1e}",
            f"at most {most:.2f} ({RULES[name]}); S above 0, eigenvalues not below −1e-12",
            bool(ratio <= most and lowest > 0 and least >= -1e-12),
            OURS,
        )


def _naive(s):
    """The auxiliary filter with negative q let through: S falls below 0."""
    path = plain.follow(s, plain.Auxiliary(least=-np.inf, most=np.inf))
    below = float((path.S <= 0).any(axis=1).mean())
    return Verdict(
        "an auxiliary filter that is not clamped breaks down on system c",
        f"S ≤ 0 at some sample in {100 * below:.0f} % of the records",
        "in most (92 %)",
        below > 0.5,
        OURS,
    )


def _told(scaled):
    count = scaled.records(200, 10)
    for name, size, cost, inside in (("f10", "large", 1.27, 1.0), ("f01", "small", 1.30, 0.60)):
        s = system(name, count)
        path = plain.follow(s, plain.Known(s.q))
        error = (path.filtered - s.theta)[:, SKIP:]
        held = float((np.abs(error) < 1.96 * np.sqrt(path.filtered_variance[:, SKIP:])).mean())
        ratio = float(np.sqrt(np.mean(error**2))) / reference(s)
        mine = run(s, Entrant("AutoMemory", lambda phi: dw.AutoMemory(phi=phi), TOLD))
        median, near = float(np.median(mine.sigma2)), float(scaled.wide(0.05))
        yield Verdict(
            f"σ² told ten times too {size}: the filter with the true Q, and AutoMemory, which learns σ²",
            f"known Q: error {ratio:.2f}, 95 % bars hold {held:.2f}; AutoMemory: {mine.rmse / reference(s):.2f}, "
            f"{mine.inside:.2f}, median σ² at the end {median:.4f}",
            f"{cost} and {inside} ± {near:.2f}; AutoMemory at most {1.2 + slack(scaled, 0.05):.2f}, "
            f".02 ± {0.002 + 0.02 * slack(scaled, 0.03):.4f}",
            bool(
                abs(ratio - cost) <= near and abs(held - inside) <= near
                and mine.rmse / reference(s) <= 1.2 + slack(scaled, 0.05)
                and abs(median - 0.02) <= 0.002 + 0.02 * slack(scaled, 0.03)
            ),
            OURS,
        )  # fmt: skip
