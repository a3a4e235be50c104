"""What a user says about a bank of speeds, as the kernel wants it: checked, complete, in units."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..engine import validation
from ..engine.errors import InputError
from . import auto, bank, unknown
from .adaptation import Setting, resolve
from .unknown_noise import ground, learns


def modes(setting: Setting, count: int, phi: Any = 1.0) -> dict[str, Any]:
    """Return the numbers every bank of ``count`` modes has: see `memory.modes`."""
    is_learnt = learns(setting)
    freedom, chi2 = (2 * setting.scale.alpha, 2 * setting.scale.beta) if is_learnt else (0.0, 0.0)
    numbers = {k: v for k, v in ground(setting, phi).items() if k != "discount"}
    return numbers | dict(learns=is_learnt, freedom=freedom, chi2=chi2, told=3.0 * count)


def _levels(memory) -> np.ndarray:
    """Return the NVRs of a bank."""
    levels = validation.floats("levels", memory.levels)
    if levels.ndim != 1 or len(levels) < 2 or not np.isfinite(levels).all() or np.any(levels < 0):
        raise InputError(f"levels are two or more noise variance ratios, none negative, got {memory.levels!r}")
    return levels


def _staying(M: int, stay: float) -> np.ndarray:
    """Return the transitions of M modes that stay with this probability, and else go to any other."""
    A = np.full((M, M), (1 - stay) / (M - 1))
    np.fill_diagonal(A, stay)
    return A


@resolve.register
def resolve_multiple_model(memory: bank.MultipleModel, setting):
    levels = _levels(memory)
    if validation.positive("forgetting", memory.forgetting) > 1:
        raise InputError(f"forgetting is a power of the weights, above 0 and at most 1, got {memory.forgetting!r}")
    M = len(levels)
    kernel = bank.Fading(**modes(setting, M, memory.phi), forgetting=memory.forgetting, levels=levels)
    return kernel, unknown.cells_of(setting.N, bank.own_cells(setting.N, M))


@resolve.register
def resolve_imm(memory: bank.IMM, setting):
    levels, jumps, stay = _levels(memory), memory.jumps, memory.stay
    if not 0 < stay < 1 or not 0 <= jumps < stay:
        raise InputError(f"stay and jumps are probabilities, 0 <= jumps < stay < 1, got {stay!r} and {jumps!r}")
    if jumps > 0:
        levels = np.append(levels, bank.JUMP)
    M = len(levels)
    A = _staying(M, stay)
    if jumps > 0:
        A[:-1, :-1] = (1 - stay) / (M - 2)
        np.fill_diagonal(A, stay - jumps)
        A[:-1, -1], A[-1, -1], A[-1, :-1] = jumps, bank.AGAIN, (1 - bank.AGAIN) / (M - 1)
    kernel = bank.Mixing(**modes(setting, M, memory.phi), jumps=jumps, levels=levels, A=A.ravel())
    return kernel, unknown.cells_of(setting.N, bank.own_cells(setting.N, M))


@resolve.register
def resolve_auto_memory(memory: auto.AutoMemory, setting):
    expect = validation.one_of("expect", memory.expect, ("both", "outliers", "jumps"))
    levels = np.array([*auto.LEVELS, np.nan])  # the last one is learnt
    M, stay = len(levels), auto.STAY
    A = _staying(M, stay)
    kernel = auto.Contest(
        **modes(setting, M, memory.phi), outliers=float(expect != "jumps"), trials=float(expect != "outliers"),
        ripe=1.0 if expect == "jumps" else 2.0, start=np.log(1e-2), least=np.log(1e-6), most=np.log(10.0),
        samples=300.0, tau=2.0, prior=4.0, levels=levels, A=A.ravel(),
    )  # fmt: skip
    return kernel, unknown.cells_of(setting.N, auto.auto_cells(setting.N, M))
