"""Drift of unknown speed: one filter for each speed, weighted by how well it predicts."""

from typing import Any, NamedTuple

from ..engine import validation
from ..engine.dispatch import PerParameter, Vector
from ..engine.elementary import pow
from .bank import (
    FREEDOM_NOW,
    LEVELS,
    SIGMA2_NOW,
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
    take_bank_along,
)
from .mixing import drift_apart
from .modes import FREEDOM, WEIGHT, mode, normalise, own_sigma2
from .questions import adapt, begin, count, mixture, resolve, take_along, time_update
from .registry import register
from .unknown_drift import drift_state_size, open_drift_state


@register("multiple-model", about="several speeds at once, weighted by how well each predicts")
class MultipleModel(NamedTuple):
    """Drift of unknown speed: one filter for each NVR of ``levels``, weighted by how well each predicts.

    Weights fade (``forgetting``, to its power at every sample), so that the bank follows a plant whose drift changes
    speed. Each filter learns its own sigma^2 where that is unknown. Simpler than `AutoMemory`, not cheaper: no speeds
    are learnt, no outliers and no jumps told. All parameters drift at one speed in units of y: bad at speeds that
    differ much.
    Source: Abid and Kamoun (2008), section 5 ("multiple model"); Magill (1965).

    ``phi`` is that of `Drift`.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> rng = np.random.default_rng(1)
    >>> slope = np.cumsum(0.05 * rng.standard_normal(500))  # it walks
    >>> phi = rng.standard_normal((500, 1))
    >>> y = phi[:, 0] * slope + 0.1 * rng.standard_normal(500)
    >>> trace = dw.Regression(1, memory=dw.memory.MultipleModel()).scan(y, phi)
    >>> f"{trace.parameters[-1, 0]:.2f} ± {trace.parameters_std[-1, 0]:.2f}, the truth is {slope[-1]:.2f}"
    '-0.78 ± 0.07, the truth is -0.89'
    """

    levels: tuple[float, ...] = LEVELS
    forgetting: float = 0.99
    phi: Any = 1.0


class MultipleModelKernel(NamedTuple):
    """What the kernel sees of a `MultipleModel`; each learnt sigma^2 begins at ``freedom`` and ``chi2``."""

    R: float
    phi: PerParameter
    cap: PerParameter
    floor: float
    moving: float
    learns: float
    freedom: float
    chi2: float
    has_state: float
    forgetting: float
    levels: Vector

    def state_size(self, parameters: int) -> int:
        """Return how many numbers it keeps."""
        return drift_state_size(parameters, bank_size(parameters, len(self.levels)))

    @property
    def mixture_columns(self) -> int:
        """How many numbers tell what a prediction is mixed of: three of each mode."""
        return 3 * len(self.levels)


@resolve.on(MultipleModel)
def resolve_multiple_model(memory, setting):
    levels = levels_of(memory)
    validation.share("forgetting", memory.forgetting, "a power of the weights")
    return MultipleModelKernel(**common_of_banks(setting, memory.phi), forgetting=memory.forgetting, levels=levels)


begin.on(MultipleModelKernel)(begin_bank)
count.on(MultipleModelKernel)(count_in_bank)
mixture.on(MultipleModelKernel)(mixture_in_bank)
take_along.on(MultipleModelKernel)(take_bank_along)


@adapt.on(MultipleModelKernel)
def adapt_multiple_model(memory, state, e, R, view):
    """Then the weights fade; P stays what it is, relative to the sigma^2 that is theirs."""
    T, D = adapt_in_bank(memory, state, e, R, view, True), view.D
    own = bank_of(memory, open_drift_state(state, D.size))
    total, before = 0.0, own.head[SIGMA2_NOW]
    for m in range(memory.levels.size):
        own.logs[m] = pow(mode(own.bank, m, D.size).own[WEIGHT], memory.forgetting)
        total += own.logs[m]
    normalise(own.bank, own.logs, total, D.size)
    own.head[FREEDOM_NOW] = own.head[SIGMA2_NOW] = 0.0
    for m in range(memory.levels.size):
        one = mode(own.bank, m, D.size).own
        own.head[FREEDOM_NOW] += one[WEIGHT] * one[FREEDOM]
        own.head[SIGMA2_NOW] += one[WEIGHT] * own_sigma2(memory, one)
    for i in range(D.size):
        D[i] *= before / own.head[SIGMA2_NOW]
    return T


@time_update.on(MultipleModelKernel)
def time_update_multiple_model(memory, state, elapsed, view):
    drift = open_drift_state(state, memory.cap.size)
    own = bank_of(memory, drift)
    speeds(memory, drift, own)
    is_capped = drift_apart(memory, own.bank, own.q, view.b)
    merge_again(memory, own, view)
    return 1.0, met(drift, is_capped, view.surprise)
