"""How the theorem is computed, and what grows: products held between samples, unstable plants, downdating."""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

import driftwise as dw
from driftwise.estimators.algebraic_observer.filter import kernel, observer_form
from driftwise.estimators.algebraic_observer.theorem import Theorem
from driftwise.estimators.window_observer.gains import Design

from ..verdict import Section, Table, Verdict, numbers, short
from .comparison import near
from .listed import THIS
from .motor import RATE, SIGMA, Records, constant, cosine, modes, records
from .watchers import STEP, forced, silent, theorem, window

MOTOR = Theorem([0, 2, 10, 1], [2], 0, [50])
HOLDS = ("Euler", "ZOH", "FOH")
LISTED = {  # error of y, y', y'' at 0.15 s and at 1 s
    "Euler": ("5e-3 0.36 65", "3e-4 0.026 0.16"),
    "ZOH": ("2.5e-2 1.8 1.3e2", "6e-3 0.033 0.066"),
    "FOH": ("2.9e-5 1.0e-2 1.4", "6e-6 6e-5 2e-4"),
}
AT = (150, 1000)  # samples


def section(seeds: int) -> Section:
    """Discretisation and growth, without noise; no seeds are needed."""
    r = records(seeds=range(1))
    truth = np.column_stack([r.x[:, :2], r.x[:, 2] / 5])
    found = {name: np.abs(naive(r, name) - truth[list(AT)]) for name in HOLDS}
    trace = theorem().scan(r.x[:, 0], r.u)
    found["y a straight line, powers of t exact (this package)"] = np.abs(
        np.column_stack([trace.of(n)[0] for n in ("angle_e", "dangle", "d2angle")])[list(AT)] - truth[list(AT)]
    )
    found["least squares on the samples"] = np.abs(_least(r) - truth[list(AT)])
    rows = [[name, *("; ".join(map(short, each)) for each in one)] for name, one in found.items()]
    return Section(
        "Discretisation and growth",
        [
            "The theorem holds in continuous time. Who holds (-t)^k y and (-t)^k u between samples, as one writes it "
            "down first, is wrong without any noise; x3 is five times y''. Least squares on samples has no such error.",
        ],
        [Table("Error of y; y'; y'' without noise at 1 kHz", ["method", "t = 0.15 s", "t = 1 s"], rows)],
        verdicts=[_naive(found), _states(r, trace), _unstable(), _anchored(r), _downdating()],
    )


def naive(r: Records, hold: str) -> np.ndarray:
    """Return y, y', y'' (2, 3) at ``AT`` by the theorem's filter with the products (-t)^(N-j) y, (-t)^(N-j) u held."""
    N, T, h = MOTOR.N, MOTOR, 1 / RATE
    A, By, Bu = observer_form(T)
    powers = np.stack([(-r.t) ** (N - j) for j in range(N + 1)], axis=1)
    v = (powers * r.x[:, :1]) @ By + (powers * r.u[:, None]) @ Bu
    if hold == "Euler":
        Phi, now, then = np.eye(N) + A * h, np.eye(N) * h, np.zeros((N, N))
    else:
        E = expm(
            np.kron(np.eye(3, k=1), np.eye(N) * [h]) + np.kron(np.diag([1, 0, 0]), A * h)
        )  # [A h, h, 0; 0, 0, h; 0]
        Phi, whole, slope = E[:N, :N], E[:N, N : 2 * N], E[:N, 2 * N :] / h
        now, then = (whole, 0 * whole) if hold == "ZOH" else (whole - slope, slope)
    xi, kept = np.zeros(N), []
    for k in range(max(AT)):
        xi = Phi @ xi + now @ v[k] + then @ v[k + 1]
        if k + 1 in AT:
            t, z = r.t[k + 1], list[float]()
            for mu in range(3):
                alpha = sum(float(c) * t**p * z[i] for i in range(mu) for p, c in T.alpha(mu, i).items())
                z.append((np.linalg.matrix_power(A, mu)[0] @ xi - alpha) / (-t) ** N)
            kept.append(z)
    return np.array(kept)


def _least(r: Records) -> np.ndarray:
    est = dw.WindowObserver(silent(), 0.15, disturbances=(constant(), cosine()), **STEP)
    pushed = forced(len(r.t))
    x = est.scan((r.x - pushed)[: max(AT) + 1, 0]).x[list(AT)] + pushed[list(AT)]
    return x / [1, 1, 5]


def _naive(found):
    fits = [fit for name in HOLDS for k in (0, 1) for fit in near(found[name][k], np.zeros(3), LISTED[name][k])]
    x3 = {name: 5 * found[name][0, 2] for name in HOLDS}
    return Verdict(
        "the theorem with t^k y held between samples: x3 at 0.15 s, no noise",
        f"wrong by {x3['FOH']:.0f} A (FOH), {x3['ZOH']:.0f} A (ZOH), {x3['Euler']:.0f} A (Euler); "
        f"{sum(fits)} of {len(fits)} errors as listed",
        f"7 A, 650 A, 320 A; {len(fits)} of {len(fits)}",
        all(fits),
        THIS,
    )


def _states(r, trace):
    part = slice(50, 2001)
    error = np.abs(trace.x[part] - r.x[part]).max(axis=0)
    third = np.abs(trace.of("d3angle")[0][part] - r.y3[part]).max()
    return Verdict(
        "the theorem as this package computes it, without noise, from 0.05 to 2 s",
        f"largest error {short(error[0])} rad, {short(error[1])} rad/s, {short(error[2])} A; y''' {short(third)}",
        "at most 1e-6, 1e-6, 5e-5 A, 1e-3",
        bool(np.all(error <= [1e-6, 1e-6, 5e-5]) and third <= 1e-3),
        THIS,
    )


def _unstable():
    """y'' = 9 y + q for 5 s: what noise of 1 at 1 kHz becomes."""
    plant, q, T = dw.Plant([[0, 1], [9, 0]]), dw.models.Polynomial([0, 1], np.inf), 5.0
    std = dw.WindowObserver(plant, T + 1 / RATE, disturbances=q, noise_std=1.0, dt=1 / RATE).design.std[:2]
    node, weight = np.polynomial.legendre.leggauss(60)
    kernels = [kernel(Theorem([-9, 0, 1], degree=0), T, T / 2 * (1 + node), order) for order in (0, 1)]
    hard = [np.sqrt(T / 2 * weight @ k**2 / RATE) for k in kernels]  # sum k^2 h^2, h = 1/RATE
    try:
        dw.AlgebraicObserver(plant, into=[0, 1], dt=1 / RATE, noise_std=1.0)
        refused = "not refused"
    except dw.InputError as error:
        refused = "refused" if "Re(lambda) > 0" in str(error) else str(error)
    return Verdict(
        "a plant that grows like exp(3 t): deviations after 5 s, in units of a sample's",
        f"least squares {numbers(std, 4)}; the theorem {hard[0]:.1f}, {hard[1]:.1f}, and this package: {refused}",
        "0.0791, 0.2522 (to a unit of the last digit); 79.5, 333.7 (± 1 %); refused",
        bool(
            all(near(std, np.zeros(2), "0.0791 0.2522"))
            and np.all(np.abs(np.array(hard) / [79.5, 333.7] - 1) < 0.01)
            and refused == "refused"
        ),
        THIS,
    )


def _anchored(r):
    """The window of 8 s: the unknown at its start, where this package has it, and at its end."""
    L, pushed, system = 8000, forced(len(r.t)), modes(6)
    est = dw.WindowObserver(silent(), 8.0, disturbances=(constant(), cosine()), **STEP)
    free = (r.x - pushed)[: L + 1, 0]
    x = est.gains @ free[1:]
    error = np.abs(x[:3] + pushed[L] - r.x[L]).max()
    back = np.linalg.inv(system.discretise(1 / RATE)[0])
    rows = np.empty((L, system.m))
    rows[-1] = system.H[0]
    for k in range(L - 2, -1, -1):
        rows[k] = rows[k + 1] @ back
    end = np.linalg.solve(rows.T @ rows, rows.T @ free[1:])
    wrong = np.abs(end[:3] + pushed[L] - r.x[L]).max()
    conditions = [Design(system, 1 / RATE, 1000 * T, [SIGMA]).condition for T in (1, 2, 4, 8)]
    return Verdict(
        "a window of 8 s of a plant with a fast pole, without noise",
        f"largest error {short(error)} (condition {', '.join(f'{c:.0f}' for c in conditions)} at 1, 2, 4, 8 s); with "
        f"the unknown at the window's end, as normal equations: {short(wrong)}",
        "at most 1e-9; above 1e-3",
        bool(error <= 1e-9 and not wrong <= 1e-3),
        THIS,
    )


def _downdating():
    """Ten thousand samples of a sliding window: as gains, and by adding the newest and taking off the oldest."""
    r = records(seeds=range(1))
    system, L = modes(4), 500
    est = window(0.5, constant())
    t = np.arange(10_000) / RATE
    Phi = system.discretise(1 / RATE, "foh")[0]
    z = np.empty((len(t), 4))
    z[0] = [1, 0, 3, 1]
    for k in range(len(t) - 1):
        z[k + 1] = Phi @ z[k]
    sliding = est.scan(z[:, 0], 0 * r.u[: len(t)], keep="means")
    error = np.abs(sliding.x - z[:, :3])[L - 1 :].max()
    back = np.linalg.inv(Phi)
    oldest = system.H[0] @ np.linalg.matrix_power(back, L)  # the row that leaves, seen from the window's end
    information, vector, worst = np.zeros((4, 4)), np.zeros(4), 0.0
    for k in range(len(t)):
        information, vector = back.T @ information @ back, back.T @ vector
        information += np.outer(system.H[0], system.H[0])
        vector += system.H[0] * z[k, 0]
        if k >= L:
            information -= np.outer(oldest, oldest)
            vector -= oldest * z[k - L, 0]
        if k >= L and k % 250 == 0:
            worst = max(worst, float(np.abs(np.linalg.lstsq(information, vector, rcond=None)[0][:3] - z[k, :3]).max()))
    return Verdict(
        "10 000 samples of a window of 0.5 s, without noise",
        f"largest error {short(error)}; by adding the newest sample and taking off the oldest: {short(worst)}",
        "at most 1e-9; above 1 (it diverges with any stable pole)",
        bool(error <= 1e-9 and not worst <= 1),
        THIS,
    )
