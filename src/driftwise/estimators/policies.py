"""What a user says about memory, detector and gate, as the kernel wants it: checked, complete, in units of the data."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..detect.gate import Always, Gate, admit
from ..detect.watch import Silent, watch
from ..errors import InputError
from ..memory.adapt import Fade, LimitedGain, Weighted, learn
from ..memory.drift import Restart, UntilJump, Walk, drift
from . import door


def resolve_memory(memory, units, cap) -> Any:
    """Return the kernel's memory; ``units`` and ``cap`` are the squared units and prior variances of theta."""
    if isinstance(memory, Walk):
        q = door.each("q", memory.q, len(units))
        if np.any(q < 0):
            raise InputError(f"q must not be negative (it is a variance), got {memory.q!r}")
        return Walk(q * units, np.array(cap))
    if isinstance(memory, UntilJump):
        step = door.each("step", memory.step, len(units))
        if np.any(step < 0) or not np.any(step > 0):
            raise InputError(f"step is the size of jump to expect: positive, or zero for some; got {memory.step!r}")
        return Restart(step**2 * units, np.array(cap))
    if type(memory) not in drift.table:
        raise InputError(f"memory must be Never(), Walk(q) or UntilJump(), got {memory!r}")
    return memory


def resolve_watch(memory, unknowns: int, parameters: int = 0) -> tuple[Any, float]:
    """Return the kernel's detector, and how many samples it waits for: for ever, where the memory has no use for it."""
    if not isinstance(memory, UntilJump):
        return Silent(), np.inf
    settle = 6 * unknowns if memory.settle is None else door.count("settle", memory.settle)
    return resolve_detector(memory.detector, parameters), float(settle)


def resolve_detector(detector, parameters: int = 0) -> Any:
    """Return the kernel's detector; ``parameters`` is how many slopes the estimator can tell it (0: none)."""
    resolve = getattr(detector, "resolve", None)
    found = resolve(parameters) if resolve else detector
    if type(found) not in watch.table:
        raise InputError(f"detector must be VarianceChange(), Hinkley() or GLR(), got {detector!r}")
    return found


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


def adaptation(memory, units, cap, parameters: int) -> tuple[Any, Any, float, int]:
    """Return the memory and the detector of a recursive estimator as the kernel wants them.

    Besides: how many measured samples pass before the detector counts, and how many numbers the memory keeps.
    """
    cap = np.array(cap)
    if isinstance(memory, LimitedGain):
        samples = door.positive("samples", memory.samples)
        if samples <= 1:
            raise InputError(f"samples must exceed 1 (a gain of 1 erases all that was learnt), got {memory.samples!r}")
        return Fade(1.0, samples, cap), Silent(), 0.0, 0
    if isinstance(memory, Weighted):
        if not 0 < door.positive("p", memory.p) <= 1:
            raise InputError(f"p is a weight per sample, above 0 and at most 1, got {memory.p!r}")
        return Fade(float(memory.p), np.inf, cap), Silent(), 0.0, 0
    if isinstance(memory, Walk):
        return resolve_memory(memory, units, cap), Silent(), 0.0, 0
    if type(memory) not in learn.table:
        raise InputError(f"memory must be Never(), LimitedGain(N), Weighted(p) or Walk(q), got {memory!r}")
    return memory, Silent(), 0.0, 0
