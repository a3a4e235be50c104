"""Section 2.2: the error under a constant step is tau K, F K + K F' + G G' = 0; theory beside simulation."""

from __future__ import annotations

import numpy as np

from ..verdict import Scaled, Section, Table, Verdict, numbers
from . import engine
from .hampton import PHI, Averaging, follow, mean_of_Z, plant, records

PAPER = "Perriot-Mathonna 1981, section 2.2, (14)"
SIGNAL = "Perriot-Mathonna 1981, sections 4.3 and 5"
GRADIENT = "this package's derivation, docs/decisions/recursive-prediction-error.md"
A, C = 0.8, 0.5  # y = A y_{n-1} + e_n + C e_{n-1}


def section(seeds: int) -> Section:
    """Compare variances under a constant step with those of the linear diffusion (14)."""
    scaled = Scaled(seeds, 500)
    means, zeroth = _signal(seeds, scaled)
    scalar, first = _autoregression(seeds, scaled)
    table, second = _moving_average(seeds, scaled)
    gains, third = _hampton(seeds, scaled)
    return Section(
        "The error under a constant step",
        [
            "With a step τ that does not fall, the error of the estimate tends to τ K, and F K + K F' + G G' = 0 in "
            "the scale of the samples. F = −I for a gradient and for autoregressions; for a pseudo-linear "
            "regression F = −R^-1 E[φ ψ'], and its K is another one.",
            "The test signal Z of Hampton's filter has mean 0 and, at the optimum, F = −1 and G = 1/Φ. Its mean "
            "after a jump of the optimal gain by .2 is not .2, and not the same up and down: half of it is the "
            "paper's Δμ.",
        ],
        [Table("Mean square error of the estimate", ["", "theory", "simulation"], [*scalar, *table, *gains]), means],
        [],
        [*zeroth, *first, *second, *third],
    )


def _autoregression(seeds, scaled):
    rows, verdicts = [], []
    for a, tau, expected in ((0.5, 0.01, 1.0), (0.9, 0.002, 1.0), (0.9, 0.01, 1.07), (0.9, 0.1, 1.77)):
        theory, found = tau * (1 - a * a) / 2, autoregression(a, tau, 4 * seeds)
        rows.append([f"AR(1), a = {a}, τ = {tau}", f"{theory:.5f}", f"{found:.5f}"])
        wide = scaled.wide(0.12 if tau == 0.1 else 0.06)
        words = "; tau is too large for the theory" if tau == 0.1 else ""
        verdicts.append(
            Verdict(
                f"AR(1), a = {a}, step {tau}: mean square error over theory",
                f"{found / theory:.3f}",
                f"{expected} ± {wide:.2f}{words}",
                bool(abs(found / theory - expected) <= wide),
                PAPER,
            )
        )
    return rows, verdicts


def _signal(seeds, scaled):
    found = [(K, K_opt, mean_of_Z(K, K_opt), *signal(K, K_opt, seeds)) for K, K_opt in ((0.1, 0.3), (0.3, 0.1))]
    _, spread = signal(0.2, 0.2, seeds)
    rows = [
        [f"{K} → {K_opt}", f"{theory:.4f}", f"{mean:.4f}", f"{mean / 2:.3f}"] for K, K_opt, theory, mean, _ in found
    ]
    wide, far = scaled.wide(0.003), scaled.wide(0.05)
    table = Table("Mean of Z right after a jump of the optimal gain", ["jump", "theory", "simulation", "half"], rows)
    return table, [
        Verdict(
            "mean of Z after a jump up and down: the paper's Δμ is half of it",
            ", ".join(row[2] for row in rows),
            f"{', '.join(row[1] for row in rows)} ± {wide:.3f}; the paper has Δμ = .15 and .07",
            bool(max(abs(mean - theory) for _, _, theory, mean, _ in found) <= wide),
            SIGNAL,
        ),
        Verdict(
            "long-run variance of Z at the optimum",
            f"{spread:.3f}",
            f"G² = 1/Φ² = {1 / PHI**2:.3f} within {100 * far:.0f} %",
            bool(abs(spread * PHI**2 - 1) <= far),
            SIGNAL,
        ),
    ]


def signal(K, K_opt, count, T=4000, block=100):
    """Return mean and long-run variance of Z of a filter that keeps its gain K where K_opt would be optimal."""
    _, y = records(plant([K_opt], "Q", T), count, [44, int(10 * K)])
    xp, nu = np.zeros(count), np.empty_like(y)
    for n in range(T):
        nu[n] = y[n] - xp
        xp = PHI * (xp + K * nu[n])
    nu = nu[200:]
    products = nu[1:] * nu[:-1] / (PHI * np.mean(nu**2))
    blocks = products[: len(products) // block * block].reshape(-1, block, count).sum(axis=1)
    return float(products.mean()), float(blocks.var() / block)


def autoregression(a, tau, count):
    """Return E (theta - a)^2 of (4)-(5) with g = tau for y = a y_{n-1} + e, after six time constants."""
    rng, settle = np.random.default_rng(41), int(6 / tau)
    y = rng.standard_normal(count) / np.sqrt(1 - a * a)
    theta, R, total, length = np.full(count, a), np.full(count, 1 / (1 - a * a)), 0.0, int(max(2000, 4 / tau))
    for n in range(settle + length):
        before, y = y, a * y + rng.standard_normal(count)
        R += tau * (before * before - R)
        theta += tau * before * (y - theta * before) / R
        if n >= settle:
            total += np.mean((theta - a) ** 2) / length
    return total


def moments():
    """Return E phi phi', E phi psi', E psi psi' of the ARMA(1, 1) model: phi = (y_{n-1}, e_{n-1}), psi = phi/C(q)."""
    from scipy.linalg import solve_discrete_lyapunov

    F = np.zeros((4, 4))  # of (phi_{n+1}, psi_n): psi_n = phi_n - C psi_{n-1}
    F[0, :2] = A, C
    F[2:, :2], F[2:, 2:] = np.eye(2), -C * np.eye(2)
    b = np.array([1.0, 1.0, 0.0, 0.0])
    S = solve_discrete_lyapunov(F, np.outer(b, b))  # of phi_{n+1} beside psi_n
    later = F @ S  # phi_{n+2}, psi_{n+1} beside phi_{n+1}, psi_n
    return S[:2, :2], later[2:, :2].T, S[2:, 2:]


def moving_average(tau, count, gradient):
    """Return E (theta - theta_0)(theta - theta_0)' after three time constants of ARMA(1, 1) with g = tau."""
    rng, settle, length = np.random.default_rng(42), int(4 / tau), int(4 / tau)
    phi_phi, _, psi_psi = moments()
    (R11, R12), (_, R22) = psi_psi if gradient else phi_phi
    y, e, residual = np.zeros(count), np.zeros(count), np.zeros(count)
    a, c, f1, f2 = np.full(count, A), np.full(count, C), np.zeros(count), np.zeros(count)
    total = np.zeros(3)
    for n in range(settle + length):
        before, noise = y, rng.standard_normal(count)
        y, e = A * y + noise + C * e, noise
        error = y - a * before - c * residual
        f1, f2 = (before - c * f1, residual - c * f2) if gradient else (before, residual)
        R11, R12, R22 = R11 + tau * (f1 * f1 - R11), R12 + tau * (f1 * f2 - R12), R22 + tau * (f2 * f2 - R22)
        scale = tau * error / (R11 * R22 - R12 * R12)
        a, c = a + scale * (R22 * f1 - R12 * f2), c + scale * (R11 * f2 - R12 * f1)
        residual = y - a * before - c * residual
        if n >= settle:
            x, z = a - A, c - C
            total += np.array([np.mean(x * x), np.mean(x * z), np.mean(z * z)]) / length
    return np.array([[total[0], total[1]], [total[1], total[2]]])


def _moving_average(seeds, scaled):
    from scipy.linalg import solve_continuous_lyapunov

    tau, (phi_phi, phi_psi, psi_psi) = 0.001, moments()
    F = -np.linalg.solve(phi_phi, phi_psi)
    plr = np.diag(solve_continuous_lyapunov(F, -np.linalg.inv(phi_phi)))
    rpem = np.diag(np.linalg.inv(psi_psi)) / 2
    minus_one = np.diag(np.linalg.inv(phi_phi)) / 2
    found = {way: np.diag(moving_average(tau, 4 * seeds, way)) / tau for way in (False, True)}
    wide = scaled.wide(0.06)
    rows = [
        ["ARMA(1, 1), pseudo-linear, τ = .001: K", numbers(plr), numbers(found[False])],
        ["ARMA(1, 1), gradient: K", numbers(rpem), numbers(found[True])],
    ]
    return rows, [
        Verdict(
            "ARMA(1, 1), pseudo-linear: covariance under τ = .001",
            numbers(found[False]),
            f"{numbers(plr)} within {100 * wide:.0f} %; F = −I would give {numbers(minus_one)}",
            bool(np.all(np.abs(found[False] / plr - 1) <= wide)),
            PAPER,
        ),
        Verdict(
            "ARMA(1, 1), gradient: covariance under τ = .001",
            numbers(found[True]),
            f"{numbers(rpem)} within {100 * wide:.0f} %",
            bool(np.all(np.abs(found[True] / rpem - 1) <= wide)),
            GRADIENT,
        ),
    ]


def _hampton(seeds, scaled):
    tau = 1 - 0.996
    theory = tau / (2 * PHI**2)
    rows, worst, free = [], 0.0, (-5.0, 5.0)
    for K in (0.1, 0.3):
        found = _stationary(K, Averaging(lambda t: engine.weighted(t, 0.996)), seeds, free)
        rows.append([f"Hampton, p = .996, K_opt = {K}", f"{theory:.5f}", f"{found:.5f}"])
        worst = max(worst, abs(found / theory - 1))
    gradient_theory = tau * (1 - PHI**2 * 0.7**2) / (2 * PHI**2)
    gradient = _stationary(0.3, Averaging(lambda t: engine.weighted(t, 0.996), score=True), seeds, (0.0, 1.0))
    rows.append(["Hampton, gradient, K_opt = 0.3", f"{gradient_theory:.5f}", f"{gradient:.5f}"])
    with np.errstate(all="ignore"):
        loose = _stationary(0.1, Averaging(lambda t: engine.weighted(t, 0.996), score=True), seeds, free)
    small = tau * (1 - PHI**2 * 0.9**2) / (2 * PHI**2)
    rows.append(["Hampton, gradient, K_opt = 0.1, K free in [−5, 5]", f"{small:.5f}", f"{loose:.5f}"])
    wide = scaled.wide(0.05)
    return rows, [
        Verdict(
            "Hampton, p = .996: variance of the gain",
            ", ".join(row[2] for row in rows[:2]),
            f"{theory:.5f} within {100 * wide:.0f} %",
            bool(worst <= wide),
            PAPER,
        ),
        Verdict(
            "Hampton, gradient, p = .996, K_opt = .3",
            f"{gradient:.5f}",
            f"{gradient_theory:.5f} within {100 * wide:.0f} %",
            bool(abs(gradient / gradient_theory - 1) <= wide),
            GRADIENT,
        ),
        Verdict(
            "a gradient without its stability limits, K_opt = .1",
            f"{loose:.5f}",
            f"far from the theory's {small:.5f} (.00795): the projection is not optional",
            not loose < 3 * small,
            GRADIENT,
        ),
    ]


def _stationary(K, way, seeds, limits):
    """Return E (K_n - K)^2 of samples 1500 to 4000, started at the truth."""
    levels = plant([K], "Q", 4000)
    _, y = records(levels, seeds, [43, int(10 * K)])
    return float(np.mean((follow(y, way, K0=K, limits=limits).K[1500:] - K) ** 2))
