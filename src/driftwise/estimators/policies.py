"""What a user says about memory and gate, as the kernel wants it: checked, complete, in units of the data."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..detect.cusum import CUSUM
from ..detect.gate import Always, Gate, admit
from ..errors import InputError
from ..memory.drift import Inflate, Matched, Restart, UntilJump, Walk, drift
from . import door


def resolve_memory(memory, units, cap, unknowns: int) -> Any:
    """Return the kernel's memory; ``units`` and ``cap`` are the squared units and prior variances of theta."""
    if isinstance(memory, Walk):
        return resolve_walk(memory, units, np.array(cap))
    if isinstance(memory, UntilJump):
        detector, restart = memory.detector, memory.restart
        if not isinstance(restart, Inflate) or restart.only_named:
            raise InputError(f"restart must be Inflate(step) here, for all parameters at once, got {restart!r}")
        step = jump_size("step", restart.step, len(units))
        if not isinstance(detector, CUSUM) or not (detector.ratio > 1 and detector.threshold > 0):
            raise InputError(f"detector must be CUSUM(ratio > 1, threshold > 0), got {detector!r}")
        settle = float(6 * unknowns if memory.settle is None else door.count("settle", memory.settle))
        return Restart(float(detector.ratio), float(detector.threshold), settle, step**2 * units, np.array(cap))
    if type(memory) not in drift.table:
        raise InputError(f"memory must be Never(), Walk(q) or UntilJump(), got {memory!r}")
    return memory


def resolve_walk(memory, units, cap) -> Any:
    """Return the kernel's random walk."""
    if isinstance(memory.matched, tuple | list) and not memory.matched:
        q = door.each("q", memory.q, len(units))
        if np.any(q < 0):
            raise InputError(f"q must not be negative (it is a variance), got {memory.q!r}")
        return Walk(q * units, cap)
    if np.any(memory.q) or not isinstance(memory.matched, tuple | list) or len(memory.matched) != 2:
        raise InputError(f"a walk has either q or matched=(jump, every), got {memory!r}")
    jump, every = memory.matched
    return Matched(jump_size("jump", jump, len(units)) ** 2 * units / door.positive("every", every), cap)


def jump_size(name, value, size) -> np.ndarray:
    """Return the size of jump to expect of each parameter."""
    step = door.each(name, value, size)
    if np.any(step < 0) or not np.any(step > 0):
        raise InputError(f"{name} is the size of jump to expect: positive, or zero for some; got {value!r}")
    return step


def resolve_gate(gate, unknowns: int) -> Any:
    """Return the kernel's gate."""
    if gate is None:
        return Always()
    if isinstance(gate, Gate):
        settle = 6 * unknowns if gate.settle is None else gate.settle
        return Gate(door.positive("sigmas", gate.sigmas), door.positive("patience", gate.patience), float(settle))
    if type(gate) not in admit.table:
        raise InputError(f"gate must be None or Gate(sigmas), got {gate!r}")
    return gate
