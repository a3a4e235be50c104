"""The estimate at a window's end as fixed gains on its samples: z(end) = sum_i K_i y_i + V_i u_i, and its covariance.

With w the unknown that a window starts with, y_i = H Phi^i w + (what u adds) + noise. Written so, a mode that dies out
or stays is well determined however long the window; one that grows is so only by its value at the END. The plant is
therefore brought to a block diagonal, z = T [a; b], a at the start, b (growing) at the end, and nothing ever grows:

    y_i = H (Ta exp(Aa i dt) a + Tb exp(-Ab (L-1-i) dt) b) + ..

A prior deviation of the disturbances, at the window's start, adds a row for each. Columns are scaled to unit length
before the QR decomposition (Golub and Van Loan 2013, 5.3); normal equations are never formed.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy.linalg import expm, matrix_balance, null_space, qr, schur, solve_sylvester, solve_triangular

from ...engine.errors import InputError

WORST = 1e12  # condition of the scaled window matrix beyond which its digits are gone
LONGEST = 200_000  # samples that a window holds at most, and how far a usable one is searched for


class Coordinates:
    """z = T [a; b]: a stays bounded forwards in time, b backwards; what grows less than e-fold in ``seconds`` is in a.

    Attributes
    ----------
    Ta (m, s), Tb (m, m - s) : z = Ta a + Tb b
    to_a, to_b : a = to_a z, b = to_b z
    Aa, Ab : their own dynamics, 1/s
    Z (s, .) : what of a is free at the start, where a disturbance has a prior deviation of zero
    prior (., .) : rows that know the free part of a at the start, each to a deviation of one
    """

    def __init__(self, system, seconds: float):
        A, m = system.A, system.m
        self.Ta, self.Tb = np.eye(m), np.zeros((m, 0))
        if np.any(system.modes.real * seconds > 1):
            balanced, (scale, _) = matrix_balance(A, permute=False, separate=True)
            S, Q, s = schur(balanced, sort=lambda re, im: re * seconds <= 1)
            X = solve_sylvester(S[:s, :s], -S[s:, s:], -S[:s, s:])
            T = scale[:, None] * (Q @ np.block([[np.eye(s), X], [np.zeros((m - s, s)), np.eye(m - s)]]))
            self.Ta, self.Tb = T[:, :s], T[:, s:]
        s = self.Ta.shape[1]
        back = np.linalg.inv(np.hstack([self.Ta, self.Tb]))
        self.to_a, self.to_b = back[:s], back[s:]
        self.Aa, self.Ab = self.to_a @ A @ self.Ta, self.to_b @ A @ self.Tb
        std, n = system.prior_std, system.n
        left_out, declared = std == 0, np.isfinite(std) & (std > 0)
        self.Z = null_space(self.Ta[left_out]) if left_out.any() else np.eye(s)
        self.prior = self.Ta[declared] @ self.Z / std[declared][:, None]
        self.free = n + int(np.isinf(std[n:]).sum())  # unknowns that only measurements tell

    def ends(self, dt: float, samples: int) -> np.ndarray:
        """Return Ta exp(Aa i dt) Z for i = 0 .. samples-1: what the free part of a makes of z, i steps on."""
        return self.Ta @ powers(expm(self.Aa * dt), samples) @ self.Z

    def starts(self, dt: float, samples: int) -> np.ndarray:
        """Return Tb exp(-Ab j dt) for j = samples-1 .. 0: what b makes of z, j steps before."""
        return self.Tb @ powers(expm(-self.Ab * dt), samples)[::-1]


def powers(P, count: int) -> np.ndarray:
    """Return P^0 .. P^(count-1), by doubling: round-off grows with the logarithm of the power."""
    found, square = np.eye(len(P))[None], P
    while len(found) < count:
        found, square = np.concatenate([found, found @ square]), square @ square
    return found[:count]


class Design:
    """Least squares on ``samples`` samples, dt apart: gains, covariance, condition.

    Parameters
    ----------
    system : Augmented
    dt : seconds between samples
    samples : number of them
    noise_std (p,) : deviation of the noise on each output
    hold : what u does between samples

    Attributes
    ----------
    condition : of the window matrix, its columns scaled; infinite with fewer outputs than unknowns
    """

    def __init__(self, system, dt: float, samples: int, noise_std, hold: str = "zoh"):
        self.system, self.dt, self.samples, self.hold = system, dt, samples, hold
        self.noise_std = np.asarray(noise_std, float)
        self.frame = frame = Coordinates(system, samples * dt)
        self.ends = frame.ends(dt, samples)
        H = system.H / self.noise_std[:, None]
        self.rows = H @ np.concatenate([self.ends, frame.starts(dt, samples)], axis=2)  # (L, p, unknowns)
        unknowns = self.rows.shape[2]
        self.prior = np.zeros((len(frame.prior), unknowns))
        self.prior[:, : frame.prior.shape[1]] = frame.prior
        matrix = np.vstack([self.rows.reshape(-1, unknowns), self.prior])
        self.scale = np.linalg.norm(matrix, axis=0)
        self.condition = np.inf
        if samples * system.outputs >= frame.free and np.all(self.scale > 0):
            self.Q, self.R = qr(matrix / self.scale, mode="economic")
            low, high = np.linalg.svd(self.R, compute_uv=False)[[-1, 0]] if unknowns else (1.0, 1.0)
            self.condition = high / low if low > 0 else np.inf

    @property
    def is_usable(self) -> bool:
        """Whether double precision can tell the unknowns apart."""
        return self.condition <= WORST

    @cached_property
    def factor(self) -> np.ndarray:
        """C (m, unknowns) with the covariance C C' of z at the end."""
        end = np.hstack([self.ends[-1], self.frame.Tb]) / self.scale
        return solve_triangular(self.R, end.T, trans="T").T

    @property
    def std(self) -> np.ndarray:
        """Deviations of z at the end, (m,)."""
        return np.linalg.norm(self.factor, axis=1)

    @cached_property
    def gains(self) -> np.ndarray:
        """K (m, L, p), the oldest sample first."""
        L, p = self.samples, self.system.outputs
        return (self.factor @ self.Q[: L * p].T).reshape(-1, L, p) / self.noise_std

    @cached_property
    def input_gains(self) -> np.ndarray:
        """V (m, L, k), the oldest sample first.

        W_i says what a known change of z at sample i does to the estimate. From the end, W_i = W_{i+1} Phi - K_i H, for
        what is bounded forwards; from the start, where an unbiased estimate has W_0 = 0, for what is so backwards.
        """
        system, frame, L, K = self.system, self.frame, self.samples, self.gains
        _, G0, G1 = system.discretise(self.dt, self.hold)
        Pa, Pb = expm(frame.Aa * self.dt), expm(-frame.Ab * self.dt)
        V, H = np.empty((system.m, L, system.inputs)), system.H
        Wa, Wb = np.empty((L, *frame.Ta.shape)), np.empty((L, *frame.Tb.shape))
        Wa[-1], Wb[0] = frame.Ta - K[:, -1] @ (H @ frame.Ta), 0.0
        for i in range(L - 2, -1, -1):
            Wa[i] = Wa[i + 1] @ Pa - K[:, i] @ (H @ frame.Ta)
        for i in range(L - 1 if frame.Tb.size else 0):
            Wb[i + 1] = (Wb[i] + K[:, i] @ (H @ frame.Tb)) @ Pb
        W = Wa @ frame.to_a + (Wb @ frame.to_b if frame.Tb.size else 0.0)
        V = -K.transpose(1, 0, 2) @ system.D
        V[:-1] += W[1:] @ G0
        V[1:] += W[1:] @ G1
        return V.transpose(1, 0, 2)


def require_usable(design: Design, tolerance=None) -> None:
    """Raise `InputError` with the smallest usable window where this one is too short."""
    system, dt, samples = design.system, design.dt, design.samples

    def meets(found):
        return found.is_usable and (tolerance is None or bool(np.all(found.std <= tolerance)))

    if meets(design):
        return
    least = smallest(lambda L: meets(Design(system, dt, L, design.noise_std, design.hold)), max(samples, 1))
    advice = f"the smallest usable one is {least * dt:g} s ({least} samples)" if least else "no longer one would do"
    names = ", ".join(system.names)
    aliased = [abs(mode.imag) for mode in system.modes if abs(mode.imag) * dt > np.pi * (1 - 1e-9)]
    if not design.is_usable and aliased:
        raise InputError(
            f"with samples {dt:g} s apart a mode at {aliased[0]:g} rad/s looks like a slower one, and cannot be told "
            f"apart from the others ({names}): sample faster (pi/dt = {np.pi / dt:g} is the limit), or leave it out"
        )
    if not design.is_usable:
        raise InputError(
            f"a window of {samples} samples cannot tell {design.frame.free} unknowns apart ({names}; condition "
            f"{design.condition:.1e}): {advice}. Is window or dt in the wrong unit, or has a disturbance no prior?"
        )
    listed = ", ".join(f"{name} {std:.3g}" for name, std in zip(system.names, design.std))
    raise InputError(f"a window of {samples} samples never meets the tolerance (deviations: {listed}): {advice}")


def smallest(meets, start: int = 1) -> int | None:
    """Return the smallest number of samples above ``start`` that meets what longer windows meet, or None."""
    high = start
    while not meets(high):
        if high >= LONGEST:
            return None
        start, high = high, min(2 * high, LONGEST)
    while high - start > 1:
        middle = (start + high) // 2
        start, high = (start, middle) if meets(middle) else (middle, high)
    return high
