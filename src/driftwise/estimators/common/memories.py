"""Which memories the joint filters take: those that change the covariance of the parameters alone."""

from __future__ import annotations

from typing import Any

from ...engine.errors import InputError, refuse_class
from ...memory.constant import Constant
from ...memory.random_walk import RandomWalk
from ...memory.registry import MEMORIES, adapt, count, found_jump, mixture, outlier_probability
from ...memory.restart_on_change import CovarianceInflation, RestartOnChange
from ...memory.settings import Setting, resolve_memory


def fits_joint(memory) -> bool:
    """Say whether a memory is one that joint filters take; a user's own is, if it leaves learning to them."""
    kind = type(memory)
    if isinstance(memory, Constant | RandomWalk | RestartOnChange):
        return True
    is_ours = kind.__module__.startswith("driftwise.")
    learns = any(kind in each.table for each in (adapt, count, found_jump, mixture, outlier_probability))
    return kind in MEMORIES and not is_ours and not learns


def memory_of_joint(memory, setting: Setting) -> Any:
    """Return the kernel's memory of a joint filter."""
    if isinstance(memory, RestartOnChange):
        if not isinstance(memory.response, CovarianceInflation) or memory.response.only_named:
            refuse_class("response", memory.response)
            raise InputError(
                f"response must be CovarianceInflation(step) here, for all parameters at once, got {memory.response!r}"
            )
    if not fits_joint(memory):
        refuse_class("memory", memory)
        raise InputError(f"memory must be Constant(), RandomWalk(q) or RestartOnChange(), got {memory!r}")
    return resolve_memory(memory, setting)
