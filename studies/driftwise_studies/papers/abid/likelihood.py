"""Section 4: the likelihood with its log-determinant, its gradient, and what the paper's experiment can tell at all."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..verdict import Scaled, Section, Table, Verdict, numbers, short
from . import claims
from .example import OURS, PAPER
from .plain import times
from .systems import System, system

SKIP = 8  # samples while P is still that of the prior: twice as many as parameters
POWERS = np.arange(-5, 3)
WINDOWS = (4, 5, 9, 10, 20, 40)


class Likelihood(NamedTuple):
    """For each record: (14) as printed, with log S, its gradient and Fisher's information in log q_i and log R."""

    printed: np.ndarray  # (S,)
    F: np.ndarray  # (S,)
    gradient: np.ndarray  # (S, n + 1)
    information: np.ndarray  # (S, n + 1, n + 1)


def likelihood(s: System, q, sigma2, P0=1000.0) -> Likelihood:
    """Run the filter with the derivatives of theta and P by each log-parameter beside it."""
    records, T, n = s.psi.shape
    theta, P = np.zeros((records, n)), np.tile(P0 * np.eye(n), (records, 1, 1))
    dtheta, dP = np.zeros((records, n + 1, n)), np.zeros((records, n + 1, n, n))
    printed, F = np.zeros(records), np.zeros(records)
    gradient, information = np.zeros((records, n + 1)), np.zeros((records, n + 1, n + 1))
    outer, noise = s.phi[:, None] * s.phi, np.append(np.zeros(n), sigma2)
    added = np.zeros((n + 1, n, n))
    added[range(n), range(n), range(n)] = q
    for k in range(T):
        psi = s.psi[:, k]
        b, v = times(P, psi), times(dP, psi[:, None])
        S = (psi * b).sum(axis=1) + sigma2
        e = s.y[:, k] - (psi * theta).sum(axis=1)
        K = b / S[:, None]
        dS, de = (v * psi[:, None]).sum(axis=2) + noise, -(dtheta * psi[:, None]).sum(axis=2)
        if k >= SKIP:
            a, c = dS / S[:, None], de / np.sqrt(S)[:, None]
            printed -= 0.5 * e**2 / S
            F -= 0.5 * (np.log(2 * np.pi * S) + e**2 / S)
            gradient -= 0.5 * a * (1 - e**2 / S)[:, None] + c * (e / np.sqrt(S))[:, None]
            information += 0.5 * a[:, :, None] * a[:, None] + c[:, :, None] * c[:, None]
        w, k1 = v[..., :, None] * K[:, None, None, :], K[:, None, :]
        dtheta = s.phi * (dtheta + (v - k1 * dS[..., None]) * (e / S)[:, None, None] + k1 * de[..., None])
        dP = dP - w - np.swapaxes(w, 2, 3) + dS[..., None, None] * (K[:, :, None] * K[:, None, :])[:, None]
        dP = outer * dP + added
        theta = s.phi * (theta + K * e[:, None])
        P = outer * (P - K[:, :, None] * b[:, None, :]) + np.diag(q)
    return Likelihood(printed, F, gradient, information)


def section(seeds: int) -> Section:
    """Profiles, the gradient, Cramer and Rao's bound, regressors of (13), excitation."""
    scaled = Scaled(seeds, 400)
    s, first = system("a", seeds), system("a", scaled.records(100, 20))
    profile = [likelihood(first, np.full(4, 10.0**j), s.sigma2) for j in POWERS]
    printed, F = (np.array([getattr(one, name) for one in profile]) for name in ("printed", "F"))
    truth = likelihood(s, s.q[0], s.sigma2)
    bound, known = bounds(truth.information)
    windows = {m: excitation(s.psi, m) for m in WINDOWS}
    rows = [["as printed, (14)", *(f"{v:.1f}" for v in printed.mean(axis=1))]]
    rows += [["with the log-determinant", *(f"{v:.1f}" for v in F.mean(axis=1))]]
    return Section(
        "Likelihood, and what the example can tell",
        [
            "(14) lacks log S, so that a larger Q always fits better. The paper's example cannot judge a method that "
            "finds Q in any case: its input has one amplitude, so u² is the same at every sample and cannot tell q3, "
            "q4 and σ² apart; and parameters of Φ = .5, .3 and .09 forget themselves within a sample or two.",
            "A bench that can tell is driftwise reproduce policies.",
        ],
        [
            Table(
                f"Log-likelihood of q1 = .. = q4 = 10^j, mean of {len(first.y)} records", ["j", *map(str, POWERS)], rows
            ),
            Table(
                "Cramér and Rao: least standard deviation of the logarithm of each variance, median record of 600 "
                "samples",
                ["", "q1", "q2", "q3", "q4", "σ²"],
                [
                    ["all five unknown", *numbers(bound, 2).split(", ")],
                    ["σ² known", *numbers(known, 2).split(", "), "–"],
                ],
            ),
            Table(
                "Least eigenvalue of the mean of ψψ' over a window, median",
                ["samples", *map(str, WINDOWS)],
                [["", *(short(round(float(np.median(w)), 12)) for w in windows.values())]],
            ),
        ],
        verdicts=[
            _profile(printed, F),
            _gradient(),
            _information(truth, scaled),
            _regressors(s, bound, known, scaled),
            _excites(windows),
        ],
    )


def _profile(printed, F):
    rises, best = np.all(np.diff(printed, axis=0) > 0, axis=0), F.argmax(axis=0)
    inside = (best > 0) & (best < len(POWERS) - 1)
    return Verdict(
        "the likelihood without log S has no maximum; with it, one near the truth",
        f"as printed it rises with Q in {100 * rises.mean():.0f} % of the records; with log S the largest is inside in "
        f"{100 * inside.mean():.0f} %, at q = 10^{np.median(POWERS[best]):.0f}",
        "all, all; at the true q = 10^-3",
        bool(rises.all() and inside.all() and np.median(POWERS[best]) == -3),
        f"{PAPER} 4",
        claims.LIKELIHOOD,
    )


def _gradient():
    """The recursion of the derivatives beside differences of four points."""
    few, h = system("a", 5), 2e-3
    at = np.log(np.append(few.q[0] * [3.0, 0.3, 2.0, 0.5], 1.5 * few.sigma2))

    def F(x):
        return likelihood(few, np.exp(x[:4]), np.exp(x[4])).F

    exact = likelihood(few, np.exp(at[:4]), np.exp(at[4])).gradient
    steps = h * np.eye(5)
    near = np.array([(8 * (F(at + d) - F(at - d)) - F(at + 2 * d) + F(at - 2 * d)) / (12 * h) for d in steps]).T
    off = float(np.abs(exact - near).max() / np.abs(exact).max())
    return Verdict(
        "gradient of the likelihood, by recursion, is that of differences",
        f"largest difference {off:.1e} of the largest entry",
        "below 1e-9",
        off < 1e-9,
        OURS,
    )


def bounds(information) -> tuple[np.ndarray, np.ndarray]:
    """Return the least deviations of log q_1 .. log q_n, log R, and of the first n where R is known: median record."""
    deviations = [np.sqrt(np.einsum("sii->si", np.linalg.inv(J))) for J in (information, information[:, :-1, :-1])]
    return np.median(deviations[0], axis=0), np.median(deviations[1], axis=0)


def _information(truth, scaled):
    """Fisher's information beside the covariance of the gradient at the truth, as it must be."""
    J, found = truth.information.mean(axis=0), np.cov(truth.gradient.T)
    ratio, near = np.diag(found) / np.diag(J), float(scaled.wide(0.3))
    return Verdict(
        "Fisher's information is the covariance of the gradient at the truth",
        f"variances over information {numbers(ratio, 2)} (log q1 .. q4, σ²), {len(truth.F)} records",
        f"1 ± {near:.2f}",
        bool(np.all(np.abs(ratio - 1) <= near)),
        OURS,
    )


def _regressors(s, bound, known, scaled):
    """Regressors of the variance equation (13), each of length 1: what they span."""
    x = np.concatenate([s.psi[:, 50:] ** 2, np.ones((*s.y[:, 50:].shape, 1))], axis=2)
    x = x / np.sqrt((x**2).sum(axis=1, keepdims=True))
    spans = np.linalg.eigvalsh(np.einsum("sti,stj->sij", x, x)).mean(axis=0)[::-1]
    near = float(scaled.wide(0.1))
    off = max(np.abs(bound[:3] / [1.03, 1.10, 0.22] - 1).max(), abs(known[2] / 0.22 - 1))
    return Verdict(
        "the example cannot separate Q from σ²",
        f"eigenvalues of the five regressors {numbers(np.abs(spans), 3)}; deviations of the logarithms "
        f"of q1 .. q4, σ² at least {numbers(bound, 2)} (q4 {known[3]:.2f} with σ² known)",
        f"two of five 0 (< 1e-12); 1.03, 1.10, .22 within {100 * near:.0f} %, q4 more than 2, σ² more than .5: only q3 "
        "is estimable",
        bool(np.all(np.abs(spans[3:]) < 1e-12) and spans[2] > 1e-4 and off <= near and bound[3] > 2 and bound[4] > 0.5),
        f"{PAPER} 6",
        claims.SEPARATES,
    )


def excitation(psi, m):
    """Return the least eigenvalue of the mean of psi psi' over each window of m samples from sample 50 on."""
    x = psi[:, 50:]
    total = np.cumsum(x[..., :, None] * x[..., None, :], axis=1)
    total = np.concatenate([np.zeros_like(total[:, :1]), total], axis=1)
    if m <= 5:  # differences of sums would round where the least eigenvalue is next to nothing
        parts = np.lib.stride_tricks.sliding_window_view(x, m, axis=1)
        return np.linalg.svd(parts, compute_uv=False)[..., 3] ** 2 / m
    return np.linalg.eigvalsh((total[:, m:] - total[:, :-m]) / m)[..., 0]


def _excites(windows):
    u = np.where(np.arange(20) < 10, 2.0, -2.0)
    R = np.array([np.mean(u * np.roll(u, lag)) for lag in range(20)])
    least = [np.linalg.eigvalsh(R[np.abs(np.subtract.outer(range(m), range(m)))])[0] for m in (4, 10, 11)]
    four, five, forty = (float(np.median(windows[m])) for m in (4, 5, 40))
    return Verdict(
        "the square wave excites order 10 over a period, and next to nothing over a tracker's memory",
        f"least eigenvalue of orders 4, 10, 11: {numbers(least, 3)}; of windows of 4, 5, 40 samples "
        f"{short(round(four, 12))}, {short(round(five, 12))}, {short(forty)}",
        ".469, .41, 0; below 1e-12, below 1e-3, .02 to .03",
        bool(
            abs(least[0] - 0.469) < 1e-3 and abs(least[1] - 0.41) < 0.01 and abs(least[2]) < 1e-12
            and four < 1e-12 and five < 1e-3 and 0.02 < forty < 0.03
        ),
        f"{PAPER} 6",
        claims.EXCITES,
    )  # fmt: skip
