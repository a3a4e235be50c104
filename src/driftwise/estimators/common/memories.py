"""Which memories the joint filters take, and what they keep for them."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...detect.score import ScoreCUSUM
from ...engine import ud, validation
from ...engine.errors import InputError
from ...memory.constant import Constant
from ...memory.directional_forgetting import DirectionalForgettingKernel
from ...memory.drift import DriftKernel, DriftMatrixKernel
from ...memory.exponential_forgetting import ExponentialForgettingKernel
from ...memory.questions import adapt, count, found_jump, mixture, outlier_probability
from ...memory.random_walk import RandomWalk
from ...memory.restart_on_change import CovarianceInflationKernel
from ...memory.settings import Setting, answers, resolve_memory, resolve_watch
from ...memory.variable_forgetting import VariableForgettingKernel

COUNT_ALL = (Constant, RandomWalk, CovarianceInflationKernel, DriftKernel, DriftMatrixKernel)
EACH = ("q", "phi", "nvr", "jump", "matched", "step", "response")  # settings of memories that may differ by parameter
FORGET = (ExponentialForgettingKernel, VariableForgettingKernel, DirectionalForgettingKernel)


def memory_of_joint(memory, setting: Setting) -> tuple[Any, float, float]:
    """Return the kernel's memory, whether samples fade in it, and whether it learns by a rule of its own."""
    found = resolve_memory(memory, setting)
    learns = answers(type(found), adapt, count, found_jump, mixture, outlier_probability)
    return found, float(not isinstance(found, COUNT_ALL)), float(learns)


def watch_of_joint(memory, unknowns: int, units) -> tuple[Any, float, float]:
    """Return the kernel's detector, how many samples it waits, and whether it is told the slopes of the parameters."""
    slopes = isinstance(getattr(memory, "detector", None), ScoreCUSUM)
    detector, settle = resolve_watch(memory, unknowns, units if slopes else ())
    return detector, settle, float(slopes)


def prior_of_parameters(mean, U, D, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return mean, factor and D of the parameters behind n unknowns: p(theta) is the trailing block."""
    rows, columns = ud.packed_indices(len(D))
    return mean[n:], U[(rows >= n) & (columns >= n)], D[n:]


def of_some(memory, which, parameters: int) -> Any:
    """Return a user's memory for some of the parameters: of settings that differ by parameter, what is theirs.

    ``which`` are their indices. Where the memory has a response, its settings are among these.
    """
    changed = {}
    for name in set(EACH) & set(getattr(memory, "_fields", ())):
        value = getattr(memory, name)
        if name == "response" and isinstance(value, tuple):
            changed[name] = of_some(value, which, parameters)
        elif name == "matched" and len(value) == 2:
            changed[name] = (_some(value[0], which, parameters), value[1])
        elif name != "response":
            changed[name] = _some(value, which, parameters)
    return memory._replace(**changed) if changed else memory


def _some(value, which, parameters):
    if np.ndim(value) == 0 or np.shape(value)[0] != parameters:
        return value
    return np.asarray(value)[np.ix_(*[which] * np.ndim(value))]


def forgets_state(wanted, memory) -> float:
    """Return 1 where the state given the parameters is to be forgotten as they are, if the memory forgets at all."""
    if validation.yes("forget_state", wanted) and not isinstance(memory, FORGET):
        raise InputError(
            "forget_state=True is for memories that forget: ExponentialForgetting, GainFloor, VariableForgetting and "
            "DirectionalForgetting; what drifts or jumps are the parameters, and the state only follows"
        )
    return float(wanted)
