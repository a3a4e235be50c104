"""The noise has another level: what the bank of an `AutoMemory` becomes, and in which units its speeds stay."""

from ..engine.dispatch import rare
from .auto_constants import STILL_LOUD
from .auto_state import MODES, QUIET, SINCE_NOW, VERDICT
from .less_noise import is_louder, take_over, weigh_as_before
from .moments import forget_moments
from .second_start import AGE
from .suspicion import calm
from .trial import end_trial
from .verdict import A_LEVEL


@rare
def stay_as_fast(head, unit, s2):
    """Let no parameter move faster because the noise is louder: units, relative to sigma^2, are those of before."""
    louder = s2 / head[QUIET]
    if louder < STILL_LOUD:
        head[QUIET] = 0.0
        return
    for i in range(unit.size):
        unit[i] /= louder


@rare
def follow_level(memory, parts, s2):
    """Let the bank be the filter with another level of the noise than ``s2``; louder noise is told."""
    own, head, second = parts.own, parts.head, parts.second
    if is_louder(memory, second, s2):
        head[VERDICT], head[SINCE_NOW] = A_LEVEL, second.head[AGE]
        head[QUIET] = head[QUIET] if head[QUIET] > 0.0 else s2
        weigh_as_before(second, own.bank, parts.drift.unit.size, MODES)
    else:
        head[QUIET] = 0.0
    take_over(second, own.bank, own.dense, parts.learner, own.P)
    end_trial(parts.trial)
    calm(parts.sums)
    forget_moments(parts.moments)
