"""Section 1: the paper's equations, corrected, in every form; and what each careless version gives."""

from __future__ import annotations

import numpy as np

from ..verdict import Section, Table, Verdict, short
from . import engine

PAPER = "Perriot-Mathonna 1981, section 1, (1)-(5)"
HAMPTON = "Perriot-Mathonna 1981, section 5"
GRADIENT = "this package's derivation, docs/decisions/recursive-prediction-error.md"
FACTORS = "this package's derivation, docs/decisions/ud.md"
PHI = 0.99


def section(seeds: int) -> Section:
    """Check the recursion (1)-(5) against recursions written for one model only."""
    verdicts = [*_regression(), _order(seeds), *_hampton(), _gradient(), _walk(), _plain_gradient()]
    return Section(
        "The equations: one recursion, five forms",
        [
            "Equations (1)-(5) are right as printed, if (5) comes before (4) and (2) takes the theta of the same "
            "sample. With P = g R^-1 every sequence of gains is a sequence of forgetting factors, a re-initialised "
            "gain is one sample with a small factor, and U-D factors carry all of them.",
            "Hampton's adaptive Kalman gain is the same recursion once the output may have a known part C x and "
            "(2) takes the theta of the sample before.",
            "Right as printed are also the equivalence of a limited step with weighted measurements (6)-(9), the "
            "diffusion (14), the energies after a restart; and the paper's warnings: T1 is optimistic for the products "
            "of neighbouring residuals, the decrease is missed, the filter hardly adapts while its gain is too large.",
            "Small slips: (7) shifts an index; (12) holds at the true θ only, elsewhere the fluctuation of R is "
            "missing; the integral in the solution of (14) begins at s0, not at 0; ν means three things.",
        ],
        [_structures()],
        [],
        verdicts,
    )


def _structures():
    rows = [
        ["ARX, recursive least squares", "0", "y enters", "0"],
        ["ARMAX, extended least squares / RML1", "-1 (residual register)", "y and residual registers", "0"],
        ["output error (Landau)", "1 (model output register)", "0", "0"],
        ["Hampton's adaptive gain, state [Φ x, e]", "[Φ; -1]", "[0; 1]", "[1 0]"],
    ]
    return Table("Members of the class: what theta nu, y and x feed", ["method", "G", "K", "C"], rows)


def arx_data(T=200, seed=81):
    """Return y, u (T, 1) of y = .7 y_{n-1} + u_{n-1} + v."""
    rng = np.random.default_rng(seed)
    u, v = rng.standard_normal((2, T, 1))
    y = np.zeros((T, 1))
    for n in range(T):
        y[n] = v[n] + (0.7 * y[n - 1] + u[n - 1] if n else 0.0)
    return y, u


def least_squares(y, u, lam, P):
    """Return theta (T, 2) of textbook recursive least squares for ARX(1, 1) with forgetting factors."""
    theta, found, before = np.zeros(2), [], np.zeros(2)
    for n in range(len(y)):
        L = P @ before / (lam[n] + before @ P @ before)
        theta = theta + L * (y[n, 0] - theta @ before)
        P = (P - np.outer(L, before @ P)) / lam[n]
        found.append(theta)
        before = np.array([y[n, 0], u[n, 0]])
    return np.array(found)


def _regression():
    y, u = arx_data()
    n, structure, zero = np.arange(2, len(y) + 2), engine.registers(na=1, nb=1), np.zeros((1, 2))
    reset = 1.0 / np.concatenate([np.arange(2, 100), 6 + np.arange(len(y) - 98)])
    off, off_factors = 0.0, 0.0
    for gains in (1.0 / n, engine.limited(n, 50), engine.weighted(n, 0.98), reset):
        R = engine.run(structure, y, u, gains, engine.Information(np.eye(2)), zero).theta[:, 0]
        UD = engine.run(structure, y, u, gains, engine.Factored(np.eye(2), 1.0), zero).theta[:, 0]
        textbook = least_squares(y, u, engine.forgetting(gains, 1.0), np.eye(2))
        off, off_factors = max(off, np.abs(R - textbook).max()), max(off_factors, np.abs(R - UD).max())
    return [
        Verdict(
            "ARX: the recursion is recursive least squares; gains 1/n, (6), (8), re-initialised",
            f"theta differs by {short(off)} at most over {len(y)} samples",
            "≤ 1e-12",
            bool(off <= 1e-12),
            PAPER,
        ),
        Verdict(
            "ARX: U-D factors are the R form, re-initialisation included",
            f"theta differs by {short(off_factors)} at most",
            "≤ 1e-12",
            bool(off_factors <= 1e-12),
            FACTORS,
        ),
    ]


def _order(seeds):
    """(4) before (5): three parameters, static regression, noise .1, R_0 = .5 I before the first gain 1/2."""
    theta0, worst = np.array([[1.0, -0.5, 0.25]]), {}
    static = engine.registers(m=3, direct=True)
    for change in (engine.Information, engine.Swapped):
        found = []
        for seed in range(max(60, min(seeds, 100))):
            rng = np.random.default_rng([4, seed])
            u = rng.standard_normal((10, 3))
            y = u @ theta0.T + 0.1 * rng.standard_normal((10, 1))
            run = engine.run(static, y, u, 1 / np.arange(2.0, 12.0), change(0.5 * np.eye(3)), np.zeros((1, 3)))
            found.append(np.abs(run.theta[-1] - theta0).max())
        worst[change] = np.median(found)
    right, wrong = worst.values()
    return Verdict(
        "the order of the equations: (5) must come before (4), which needs the new R",
        f"with the R of the sample before, median worst error after 10 samples {wrong:.2f} instead of {right:.3f}: "
        f"{wrong / right:.0f} times",
        "at least 5 times worse the other way round (1.22 instead of .091: 13 times)",
        bool(wrong > 5 * right),
        PAPER,
    )


def direct_hampton(y, gains, gradient=False, R=1.0):
    """Return the gains K of Hampton's filter (section 5), written for it alone."""
    K, prediction, nu, psi, found = 0.0, 0.0, 0.0, 0.0, []
    for y_n, g in zip(y[:, 0], gains):
        e = y_n - prediction
        f = psi if gradient else PHI * nu
        R += g * (f * f - R)
        K = K + g * f * e / R
        prediction = PHI * (prediction + K * e)
        psi = PHI * (1 - K) * psi + PHI * e
        nu = e
        found.append(K)
    return np.array(found)


def _hampton():
    from .hampton import plant, records

    T = 20_000
    _, y = records(plant([0.3], "Q", T), 1, 5)
    u, gains, zero = np.zeros((T, 1)), 1 / np.arange(2.0, T + 2), np.zeros((1, 1))

    def off(direct, length, **options):
        change = engine.Information(np.eye(1))
        K = engine.run(engine.hampton(PHI), y[:length], u, gains, change, zero, **options).theta[:, 0, 0]
        return np.abs(K - direct[:length]).max()

    plr, rpem = direct_hampton(y, gains), direct_hampton(y, gains, True)
    same, naive = off(plr, T, posterior=False), off(plr, 2000)
    same_gradient = off(rpem, T, posterior=False, gradient=True)
    mixed = off(rpem, 2000, posterior=False, posterior_gradient=True, gradient=True)
    return [
        Verdict(
            "Hampton's filter as a member of the class: 20 000 samples",
            f"K differs by {short(same)} at most",
            "≤ 1e-12",
            bool(same <= 1e-12),
            HAMPTON,
        ),
        Verdict(
            "Hampton's filter takes the theta of the sample before: theta a posteriori in (2) is another filter",
            f"K differs by {naive:.2f}",
            "differs by more than .01 (.18 in another record)",
            bool(naive > 0.01),
            HAMPTON,
        ),
        Verdict(
            "Hampton's filter with the generic gradient is the one written for it: 20 000 samples",
            f"K differs by {short(same_gradient)} at most",
            "≤ 1e-12",
            bool(same_gradient <= 1e-12),
            GRADIENT,
        ),
        Verdict(
            "a gradient with another theta than the state is not the gradient",
            f"K differs by {mixed:.4f}",
            "differs by more than 1e-4 (.005 in another record)",
            bool(mixed > 1e-4),
            GRADIENT,
        ),
    ]


def gradient_case(seed=7, T=30):
    """Return structure, y, u, theta of an ARMAX model with two outputs and two inputs."""
    rng = np.random.default_rng(seed)
    structure = engine.registers(na=1, nb=1, nc=1, p=2, m=2)
    theta = 0.4 * rng.standard_normal((2, 6))
    return structure, rng.standard_normal((T, 2)), rng.standard_normal((T, 2)), theta


def frozen(structure, y, u, theta):
    """Return the run at a theta that never changes: its eps is that of the model, its last Psi the gradient."""
    still = engine.Information(np.eye(theta.size))
    return engine.run(structure, y, u, np.zeros(len(y)), still, theta, gradient=True)


def _differences(structure, y, u, theta, h=1e-5):
    """Return -d eps / d theta of the last sample by central differences, (p, p s)."""
    columns = []
    for i in range(theta.size):
        step = h * np.eye(theta.size)[i].reshape(theta.shape)
        up, down = (frozen(structure, y, u, theta + sign * step).eps[-1] for sign in (1, -1))
        columns.append((down - up) / (2 * h))
    return np.array(columns).T


def _gradient():
    structure, y, u, theta = gradient_case()
    off = np.abs(frozen(structure, y, u, theta).Psi - _differences(structure, y, u, theta)).max()
    return Verdict(
        "gradient Psi against central differences: ARMAX, 2 outputs, 2 inputs",
        f"differs by {short(off)} at most after {len(y)} samples",
        "≤ 1e-8",
        bool(off <= 1e-8),
        GRADIENT,
    )


def _plain_gradient():
    structure, y, u, theta = gradient_case()
    run = frozen(structure, y, u, theta)
    off = np.abs(run.Psi - _differences(structure, y, u, theta)).max()
    nu_only = np.abs(_nu(structure, y, u, theta) - _differences(structure, y, u, theta)).max()
    return Verdict(
        "the regressor nu is not the gradient where the state depends on theta",
        f"nu differs from it by {nu_only:.2f}, Psi by {short(off)}",
        "nu differs by more than .1",
        bool(nu_only > 0.1 > off),
        GRADIENT,
    )


def _nu(structure, y, u, theta):
    """Return I kron nu' of the last sample."""
    x = frozen(structure, y[:-1], u[:-1], theta).x
    return np.kron(np.eye(2), structure.H @ x + structure.T @ u[-1])


def _walk():
    T = 500
    y, u = arx_data(T, 82)
    q, structure = np.array([1e-3, 4e-4]), engine.registers(na=1, nb=1)
    change = engine.Walking(q, np.eye(2), prior=(5.0, 1.0))
    found = engine.run(structure, y, u, np.zeros(T), change, np.zeros((1, 2))).theta[:, 0]
    theta, P, c, before, off = np.zeros(2), np.eye(2), 1.0, np.zeros(2), 0.0
    for n in range(T):
        P = P + np.diag(q)
        L = P @ before / (c + before @ P @ before)
        e = y[n, 0] - theta @ before
        theta, P = theta + L * e, P - np.outer(L, before @ P)
        c += max(1 / 100, 1 / (n + 6)) * (e * e - c)
        before = np.array([y[n, 0], u[n, 0]])
        off = max(off, np.abs(theta - found[n]).max())
    return Verdict(
        "random walk in U-D form against the dense recursion, 500 samples",
        f"theta differs by {short(off)} at most",
        "≤ 1e-12",
        bool(off <= 1e-12),
        FACTORS,
    )
