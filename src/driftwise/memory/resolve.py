"""What a user says about memory, detector and gate, as the kernel wants it: checked, complete, in units of the data."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..detect.gain import GainProbes, PullTest
from ..detect.gate import Always, InnovationGate, admit
from ..detect.probes import ProbeBank
from ..detect.score import ScoreSums
from ..detect.watch import Silent, watch
from ..engine import validation
from ..engine.errors import InputError, refuse_class
from ..models.scale import InverseGamma, KnownScale
from .drift import CovarianceInflation, Matched, RandomWalk, Restart, RestartOnChange, drift


def resolve_memory(memory, units, cap) -> Any:
    """Return the kernel's memory; ``units`` and ``cap`` are the squared units and prior variances of theta."""
    refuse_class("memory", memory)
    if isinstance(memory, RandomWalk):
        return resolve_walk(memory, units, np.array(cap))
    if isinstance(memory, RestartOnChange):
        refuse_class("response", memory.response)
        if not isinstance(memory.response, CovarianceInflation) or memory.response.only_named:
            raise InputError(
                f"response must be CovarianceInflation(step) here, for all parameters at once, got {memory.response!r}"
            )
        return Restart(jump_size("step", memory.response.step, len(units)) ** 2 * units, np.array(cap))
    if type(memory) not in drift.table:
        raise InputError(f"memory must be Constant(), RandomWalk(q) or RestartOnChange(), got {memory!r}")
    return memory


def resolve_walk(memory, units, cap) -> Any:
    """Return the kernel's random walk."""
    if isinstance(memory.matched, tuple | list) and not memory.matched:
        if not np.size(memory.q):
            raise InputError(
                "a walk needs its speed: RandomWalk(q), the variance of a step per sample, or "
                "RandomWalk(matched=(jump, every)); "
                "for constant parameters use Constant()"
            )
        q = validation.each("q", memory.q, len(units))
        if np.any(q < 0):
            raise InputError(f"q must not be negative (it is a variance), got {memory.q!r}")
        return RandomWalk(q * units, cap)
    if np.any(memory.q) or not isinstance(memory.matched, tuple | list) or len(memory.matched) != 2:
        raise InputError(
            f"a walk has either q or matched=(jump, every), got q = {memory.q!r} and matched = {memory.matched!r}"
        )
    jump, every = memory.matched
    return Matched(jump_size("jump", jump, len(units)) ** 2 * units / validation.positive("every", every), cap)


def jump_size(name, value, size) -> np.ndarray:
    """Return the size of jump to expect of each parameter."""
    step = validation.each(name, value, size)
    if np.any(step < 0) or not np.any(step > 0):
        raise InputError(f"{name} is the size of jump to expect: positive, or zero for some; got {value!r}")
    return step


def resolve_watch(memory, unknowns: int, units=()) -> tuple[Any, float]:
    """Return the kernel's detector, and how many samples it waits for: for ever, where the memory has no use for it."""
    if not isinstance(memory, RestartOnChange):
        return Silent(), np.inf
    settle = 6 * unknowns if memory.settle is None else validation.count("settle", memory.settle)
    return resolve_detector(memory.detector, units), float(settle)


def resolve_detector(detector, units=()) -> Any:
    """Return the kernel's detector; ``units`` are the squared units of the parameters whose slopes it is told."""
    parameters = len(units)
    told = (
        "VarianceCUSUM(), PageHinkley(), GLR() or ScoreCUSUM()"
        if parameters
        else "VarianceCUSUM(), PageHinkley() or GLR()"
    )
    if isinstance(detector, ProbeBank | GainProbes | PullTest):
        raise InputError(
            f"detector must be {told}, got {detector!r}: it compares probes of a gain, which only AdaptiveGain runs"
        )
    refuse_class("detector", detector)
    resolve = getattr(detector, "resolve", None)
    found = resolve(parameters) if resolve else detector
    if type(found) not in watch.table:
        raise InputError(f"detector must be {told}, got {detector!r}")
    return found._replace(d=found.d * np.sqrt(units)) if isinstance(found, ScoreSums) else found


def check_scale(scale, proper: bool = False) -> None:
    """Raise InputError unless ``scale`` is None or a prior; a proper one has a positive alpha."""
    if scale is None:
        return
    numbers = tuple(scale) if isinstance(scale, InverseGamma) else ()
    if not numbers or not all(isinstance(n, int | float | np.number) and math.isfinite(n) for n in numbers):
        raise InputError(f"scale must be InverseGamma(alpha, beta) of finite numbers or None, got {scale!r}")
    if scale.beta <= 0 or (proper and scale.alpha <= 0):
        which = "a positive alpha and a positive beta" if proper else "a finite alpha and a positive beta"
        raise InputError(f"InverseGamma needs {which}, got {scale!r}. It is the prior of a variance, beta/alpha")


def resolve_scale(scale, is_relative: bool, unknowns: int) -> Any:
    """Return the prior of sigma^2: the one given, or the reference prior that spends one half on each unknown."""
    check_scale(scale)
    return (scale or InverseGamma(0.5 - unknowns / 2, 1e-20)) if is_relative else KnownScale()


def resolve_gate(gate, unknowns: int) -> Any:
    """Return the kernel's gate."""
    refuse_class("gate", gate)
    if gate is None:
        return Always()
    if isinstance(gate, InnovationGate):
        settle = 6 * unknowns if gate.settle is None else validation.count("settle", gate.settle)
        return InnovationGate(
            validation.positive("sigmas", gate.sigmas), validation.positive("patience", gate.patience), float(settle)
        )
    if type(gate) not in admit.table:
        raise InputError(f"gate must be None or InnovationGate(sigmas), got {gate!r}")
    return gate
