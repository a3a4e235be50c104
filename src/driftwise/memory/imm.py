"""Drift of unknown speed, and jumps: filters that exchange what they know (IMM)."""

from typing import Any, NamedTuple

import numpy as np

from ..detect.watch import SINCE, STATISTIC, WHICH
from ..engine.dispatch import PerParameter, Vector
from ..engine.errors import InputError
from .bank import (
    LEVELS,
    TOLD,
    WAITS,
    adapt_in_bank,
    bank_of,
    bank_size,
    begin_bank,
    common_of_banks,
    count_in_bank,
    levels_of,
    merge_again,
    met,
    mixture_in_bank,
    speeds,
    staying,
    take_bank_along,
)
from .mixing import drift_apart, interact
from .modes import WEIGHT, mode
from .questions import adapt, begin, count, found_jump, mixture, resolve, take_along, time_update
from .registry import register
from .unknown_drift import drift_state_size, open_drift_state

JUMP, AGAIN = 1.0, 0.1  # NVR of the jump mode, and how likely one jump follows another


@register("imm", about="several speeds at once that exchange what they know, and jumps")
class IMM(NamedTuple):
    """A bank whose filters exchange what they know, with a mode for jumps: IMM.

    From sample to sample a filter stays at its speed with probability ``stay``; ``jumps`` is the probability of a jump
    of about the size that one unit of noise hides (0: no such mode). A jump is told (``JUMP``) when its mode is
    likelier than all others. Source: Blom and Bar-Shalom (1988). Bad at: constant parameters, which the jump mode makes
    restless, and outliers, which look like jumps (use `AutoMemory`).

    ``levels`` are the noise variance ratios, ``phi`` is that of `Drift`.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> rng = np.random.default_rng(1)
    >>> slope = np.cumsum(0.05 * rng.standard_normal(500))  # it walks
    >>> phi = rng.standard_normal((500, 1))
    >>> y = phi[:, 0] * slope + 0.1 * rng.standard_normal(500)
    >>> trace = dw.Regression(1, memory=dw.memory.IMM()).scan(y, phi)
    >>> f"{trace.parameters[-1, 0]:.2f} ± {trace.parameters_std[-1, 0]:.2f}, the truth is {slope[-1]:.2f}"
    '-0.78 ± 0.07, the truth is -0.89'
    """

    levels: tuple[float, ...] = LEVELS
    stay: float = 0.995
    jumps: float = 0.0005
    phi: Any = 1.0


class IMMKernel(NamedTuple):
    """What the kernel sees of `IMM`: A is the (M, M) matrix of the transitions."""

    R: float
    phi: PerParameter
    cap: PerParameter
    floor: float
    moving: float
    learns: float
    freedom: float
    chi2: float
    has_state: float
    jumps: float
    levels: Vector
    A: Vector

    def state_size(self, parameters: int) -> int:
        """Return how many numbers it keeps."""
        return drift_state_size(parameters, bank_size(parameters, len(self.levels)))

    @property
    def mixture_columns(self) -> int:
        """How many numbers tell what a prediction is mixed of: three of each mode."""
        return 3 * len(self.levels)


@resolve.on(IMM)
def resolve_imm(memory, setting):
    levels, jumps, stay = levels_of(memory), memory.jumps, memory.stay
    if not 0 < stay < 1 or not 0 <= jumps < stay:
        raise InputError(f"stay and jumps are probabilities, 0 <= jumps < stay < 1, got {stay!r} and {jumps!r}")
    if jumps > 0:
        levels = np.append(levels, JUMP)
    M = len(levels)
    A = staying(M, stay)
    if jumps > 0:
        A[:-1, :-1] = (1 - stay) / (M - 2)
        np.fill_diagonal(A, stay - jumps)
        A[:-1, -1], A[-1, -1], A[-1, :-1] = jumps, AGAIN, (1 - AGAIN) / (M - 1)
    return IMMKernel(**common_of_banks(setting, memory.phi), jumps=jumps, levels=levels, A=A.ravel())


begin.on(IMMKernel)(begin_bank)
count.on(IMMKernel)(count_in_bank)
mixture.on(IMMKernel)(mixture_in_bank)
take_along.on(IMMKernel)(take_bank_along)


@adapt.on(IMMKernel)
def adapt_imm(memory, state, e, R, view):
    return adapt_in_bank(memory, state, e, R, view, False)


@found_jump.on(IMMKernel)
def found_jump_imm(memory, state, detector_state):
    """Tell a jump when the jump mode is likelier than all others, once until it is not."""
    own = bank_of(memory, open_drift_state(state, memory.cap.size))
    last = mode(own.bank, memory.levels.size - 1, memory.cap.size)
    if memory.jumps == 0.0:
        return 0.0
    w = last.own[WEIGHT]
    detector_state[STATISTIC], was_told = 2.0 * w, own.head[TOLD] > 0.0
    own.head[TOLD] = 1.0 if w > 0.5 else 0.0
    if was_told or w <= 0.5:
        return 0.0
    detector_state[SINCE], detector_state[WHICH] = 1.0, -1.0
    return 1.0


@time_update.on(IMMKernel)
def time_update_imm(memory, state, elapsed, view):
    drift = open_drift_state(state, memory.cap.size)
    own = bank_of(memory, drift)
    speeds(memory, drift, own)
    if own.head[WAITS] > 0.0:
        is_capped = interact(memory, own, own.bank, own.q, memory.cap.size)
    else:
        is_capped = drift_apart(memory, own.bank, own.q, view.b)
    own.head[WAITS] = 0.0
    merge_again(memory, own, view)
    return 1.0, met(drift, is_capped, view.surprise)
