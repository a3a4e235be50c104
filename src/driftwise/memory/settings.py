"""What a user says of a memory, as kernels want it: checked, complete, in the units of the data."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..detect.resolve import resolve_detector
from ..detect.watch import Silent
from ..engine import validation
from ..engine.errors import InputError, refuse_class
from ..models.scale import KnownScale
from .questions import MEMORIES, resolve
from .registry import public

EKF = (
    "an extended Kalman filter with log q appended to its state learns nothing: the innovation's mean does not depend "
    "on q, so the cross-covariance of theta and log q stays exactly 0 (measured: log q moves by 0.0 in 600 samples). "
    "LikelihoodDrift() learns log q from the variance of the innovations instead"
)
LARGEST = 50_000_000  # numbers in a state, 400 MB of them


class Setting(NamedTuple):
    """Where a memory works: squared units and prior variances of the parameters, the scale, the noise, the prior.

    ``R`` is the variance of the noise, relative to sigma^2 where that is learnt; the first ``moving`` regressors are
    data, not a constant; ``prior`` is mean, U and D; ``first`` unknowns, a state, stand before the parameters. Through
    it each parameter acts so many samples later than the first (``lags``; empty: all act at once). In a regression
    (``is_regression``) they act through data, not through what was estimated before; the first ``past`` regressors are
    past outputs, newest first, of which the estimator replaces outliers. Beside a state the first ``poles`` parameters
    say how the output itself goes on: a stable plant leaves them little room to jump. There ``rows_stay`` says that
    what a row tells of the parameters has nothing of what had been estimated before, as in a regression.

    ``cap`` are the prior variances, in the same units.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> setting = dw.memory.Setting(units=np.array([1.0, 4.0]), cap=np.array([1e4, 4e4]))
    >>> setting.N, setting.R
    (2, 1.0)
    """

    units: np.ndarray
    cap: np.ndarray
    scale: Any = KnownScale()
    R: float = 1.0
    moving: int = 0
    prior: tuple[np.ndarray, np.ndarray, np.ndarray] = (np.zeros(0),) * 3
    first: int = 0
    lags: np.ndarray = np.zeros(0)
    is_regression: bool = False
    past: int = 0
    poles: int = 0
    rows_stay: bool = False

    @property
    def N(self) -> int:
        """Number of parameters."""
        return len(self.units)

    @property
    def is_learnt(self) -> bool:
        """Whether sigma^2 is learnt."""
        return not isinstance(self.scale, KnownScale)

    @property
    def prior_counts(self) -> tuple[float, float]:
        """Degrees of freedom and chi2 that sigma^2 begins with."""
        return (2 * self.scale.alpha, 2 * self.scale.beta) if self.is_learnt else (0.0, 0.0)

    @property
    def settle(self) -> float:
        """How many samples it takes until a learnt sigma^2 says what surprises."""
        return 2.0 * self.N if self.is_learnt else 0.0


def resolve_memory(memory, setting: Setting) -> Any:
    """Return the kernel's memory; raise InputError where something else came, or it keeps too much."""
    if isinstance(memory, str):
        if memory.lower() in ("ekf", "augmented ekf"):
            raise InputError(EKF)
        raise InputError(
            f"memory is a policy, such as ExponentialForgetting(0.99), not the word {memory!r}: words are for --memory"
        )
    if type(memory) not in MEMORIES:
        refuse_class("memory", memory)
        raise InputError(f"memory must be {_calls()}, got {memory!r}{_meant(memory)}")
    found = resolve(memory, setting)
    if state_size(found, setting.N) > LARGEST:
        raise InputError(
            f"{type(memory).__name__} of {setting.N} parameters keeps {state_size(found, setting.N):.2g} numbers, more "
            f"than {LARGEST:.0e}: "
            "take a smaller model, or a memory that keeps few, such as Constant() or ExponentialForgetting(lam)"
        )
    return found


def state_size(memory, parameters: int) -> int:
    """Return how many numbers the kernel's memory keeps."""
    return memory.state_size(parameters) if hasattr(memory, "state_size") else 0


def resolve_watch(memory, unknowns: int, units=()) -> tuple[Any, float]:
    """Return the kernel's detector, and how many samples it waits: for ever, where the memory has no use for one."""
    if not hasattr(memory, "detector") or isinstance(memory, type):
        return Silent(), np.inf
    settle = 6 * unknowns if memory.settle is None else validation.count("settle", memory.settle)
    return resolve_detector(memory.detector, units), float(settle)


def answers(kind: type, *questions) -> bool:
    """Say whether memories of this type answer one of these questions themselves."""
    return any(kind in question.table for question in questions)


def more_than_one(name, value) -> float:
    """Return a number of samples that exceeds one."""
    if validation.positive(name, value) <= 1:
        raise InputError(f"{name} must exceed 1 (a gain of 1 erases all that was learnt), got {value!r}")
    return float(value)


def jump_size(name, value, size) -> np.ndarray:
    """Return the size of jump to expect of each parameter."""
    step = validation.each(name, value, size)
    if np.any(step < 0) or not np.any(step > 0):
        raise InputError(f"{name} is the size of jump to expect: positive, or zero for some; got {value!r}")
    return validation.within(name, step, value)


def variances(name, value, size) -> np.ndarray:
    """Return a variance of each parameter, none negative."""
    numbers = validation.each(name, value, size)
    if np.any(numbers < 0):
        raise InputError(f"{name} must not be negative (it is a variance), got {value!r}")
    return numbers


def _calls() -> str:
    """Return all memories as they are written: Constant(), GainFloor(samples), .."""
    written = []
    for name, (kind, *_) in public().items():
        if kind in MEMORIES:
            needed = [field for field in kind._fields if field not in kind._field_defaults]
            written.append(f"{name}({', '.join(needed)})")
    return f"{', '.join(written[:-1])} or {written[-1]}"


def _meant(memory) -> str:
    """Return the likely cause where something else came in place of a memory."""
    if isinstance(memory, int | float) and not isinstance(memory, bool):
        return (
            f". A weight per sample is ExponentialForgetting({memory})"
            if memory <= 1
            else f". Samples are GainFloor({memory})"
        )
    return ""
