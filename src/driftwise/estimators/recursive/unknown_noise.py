"""What a user says about drift, as the kernel wants it: checked, complete, in units. One function per policy."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...errors import InputError
from ...kernel import ud
from ...memory import auto, bank, transition, unknown
from ...models.scale import KnownScale
from .. import door
from .adaptation import Setting, resolve

ROOM = 2.0  # times its prior, the widest variance: a prior of known width is no limit before data come
FADING = 0.995  # per sample, of what sigma^2 rests on: the noise may change, 200 samples of it count


def ground(setting: Setting, phi: Any = 1.0) -> dict[str, Any]:
    """Return the numbers every policy has: see `memory.unknown`."""
    return dict(
        R=setting.R, phi=diagonal(phi, setting.N), cap=ROOM * setting.cap, floor=0.0, moving=setting.moving,
        discount=1.0 if isinstance(setting.scale, KnownScale) else FADING,
    )  # fmt: skip


def diagonal(phi, N: int) -> np.ndarray:
    """Return a diagonal Phi as a vector; raise InputError where a parameter would grow by itself."""
    numbers = door.each("phi", phi, N)
    if np.any(np.abs(numbers) > 1):
        raise InputError(f"phi is a share that remains, at most 1 in size (the parameters would run away), got {phi!r}")
    return np.where(np.abs(numbers) < 1e-100, 0.0, numbers)


@resolve.register
def _(memory: transition.Drift, setting):
    has_q, has_nvr = np.size(memory.q) > 0, np.size(memory.nvr) > 0
    if has_q == has_nvr:
        raise InputError(
            "Drift(phi, q) or Drift(phi, nvr=..) needs its speed, in one of the two: q, variances per sample, or nvr, "
            f"q ms/sigma^2; got q = {memory.q!r} and nvr = {memory.nvr!r}. Is it not known? Some policies learn it"
        )
    N = setting.N
    if np.ndim(memory.phi) == 2 or np.ndim(memory.q) == 2:
        if has_nvr:
            raise InputError("nvr goes with a diagonal phi: say q where phi is a matrix")
        return _coupled(memory, setting)
    if has_nvr:
        nvr = _not_negative("nvr", memory.nvr, N)
        return unknown.Paced(**ground(setting, memory.phi), nvr=nvr), unknown.cells_of(N)
    q = _not_negative("q", memory.q, N) * setting.units
    return transition.Drifting(diagonal(memory.phi, N), q, ROOM * setting.cap), 0


def modes(setting: Setting, count: int, phi: Any = 1.0) -> dict[str, Any]:
    """Return the numbers every bank of ``count`` modes has: see `memory.modes`."""
    learns = not isinstance(setting.scale, KnownScale)
    freedom, chi2 = (2 * setting.scale.alpha, 2 * setting.scale.beta) if learns else (0.0, 0.0)
    numbers = {k: v for k, v in ground(setting, phi).items() if k != "discount"}
    return numbers | dict(learns=float(learns), freedom=freedom, chi2=chi2, told=3.0 * count)


def _levels(memory) -> np.ndarray:
    """Return the NVRs of a bank."""
    levels = door.floats("levels", memory.levels)
    if levels.ndim != 1 or len(levels) < 2 or not np.isfinite(levels).all() or np.any(levels < 0):
        raise InputError(f"levels are two or more noise variance ratios, none negative, got {memory.levels!r}")
    return levels


@resolve.register
def _(memory: bank.Bank, setting):
    levels = _levels(memory)
    if door.positive("forgetting", memory.forgetting) > 1:
        raise InputError(f"forgetting is a power of the weights, above 0 and at most 1, got {memory.forgetting!r}")
    M = len(levels)
    kernel = bank.Fading(**modes(setting, M, memory.phi), forgetting=memory.forgetting, levels=levels)
    return kernel, unknown.cells_of(setting.N, bank.own_cells(setting.N, M))


@resolve.register
def _(memory: bank.Interacting, setting):
    levels, jumps, stay = _levels(memory), memory.jumps, memory.stay
    if not 0 < stay < 1 or not 0 <= jumps < stay:
        raise InputError(f"stay and jumps are probabilities, 0 <= jumps < stay < 1, got {stay!r} and {jumps!r}")
    if jumps > 0:
        levels = np.append(levels, bank.JUMP)
    M = len(levels)
    A = np.full((M, M), (1 - stay) / (M - 1))
    np.fill_diagonal(A, stay)
    if jumps > 0:
        A[:-1, :-1] = (1 - stay) / (M - 2)
        np.fill_diagonal(A, stay - jumps)
        A[:-1, -1], A[-1, -1], A[-1, :-1] = jumps, bank.AGAIN, (1 - bank.AGAIN) / (M - 1)
    kernel = bank.Mixing(**modes(setting, M, memory.phi), jumps=jumps, levels=levels, A=A.ravel())
    return kernel, unknown.cells_of(setting.N, bank.own_cells(setting.N, M))


@resolve.register
def _(memory: auto.Auto, setting):
    expect = door.one_of("expect", memory.expect, ("both", "outliers", "jumps"))
    levels = np.array([*auto.LEVELS, np.nan])  # the last one is learnt
    M, stay = len(levels), auto.STAY
    A = np.full((M, M), (1 - stay) / (M - 1))
    np.fill_diagonal(A, stay)
    kernel = auto.Contest(
        **modes(setting, M, memory.phi), outliers=float(expect != "jumps"), trials=float(expect != "outliers"),
        ripe=1.0 if expect == "jumps" else 2.0, levels=levels, A=A.ravel(),
    )  # fmt: skip
    return kernel, unknown.cells_of(setting.N, auto.auto_cells(setting.N, M))


def _coupled(memory, setting):
    """Return the kernel's drift of full matrices."""
    N, root = setting.N, np.sqrt(setting.units)
    phi = np.asarray(memory.phi, float)
    phi = phi if phi.ndim == 2 else np.diag(diagonal(memory.phi, N))
    if phi.shape != (N, N) or not np.isfinite(phi).all():
        raise InputError(f"phi must be a number, {N} numbers or a {N} x {N} matrix, got shape {phi.shape}")
    if max(abs(np.linalg.eigvals(phi))) > 1 + 1e-9:
        raise InputError(f"phi has an eigenvalue outside the unit circle: the parameters would run away; got {phi!r}")
    q = np.asarray(memory.q, float)
    q = q if q.ndim == 2 else np.diag(_not_negative("q", memory.q, N))
    try:
        G, d = ud.factor(door.covariance("q", q, N))
    except ValueError:
        raise InputError("q must be a covariance: it has a negative eigenvalue") from None
    # in units of the prior: theta = root * theta'
    kernel = transition.Coupled((phi * root[:, None] / root).ravel(), (G * root[:, None]).ravel(), d)
    return kernel, 2 * N * N + 4 * N


def _not_negative(name, value, N) -> np.ndarray:
    numbers = door.each(name, value, N)
    if np.any(numbers < 0):
        raise InputError(f"{name} must not be negative (it is a variance), got {value!r}")
    return numbers
