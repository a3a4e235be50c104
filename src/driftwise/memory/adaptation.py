"""What a user says about the memory of a recursive estimator, as its kernel wants it: checked, complete, in units."""

from __future__ import annotations

from functools import singledispatch
from typing import Any, NamedTuple

import numpy as np

from ..engine import validation
from ..engine.errors import InputError, refuse_class
from ..models.scale import KnownScale
from . import directional, fading, restart, run_lengths, window
from .adapt import adapt
from .drift import CovarianceInflation, RandomWalk, RestartOnChange
from .hold import MEMORIES
from .resolve import jump_size, resolve_walk, resolve_watch

EKF = (
    "an extended Kalman filter with log q appended to its state learns nothing: the innovation's mean does not depend "
    "on q, so the cross-covariance of theta and log q stays exactly 0 (measured: log q moves by 0.0 in 600 samples). "
    "LikelihoodDrift() learns log q from the variance of the innovations instead"
)
LARGEST = 50_000_000  # numbers in a window, 400 MB of them


class Setting(NamedTuple):
    """Where a memory works: squared units and prior variances of theta, its prior (mean, U, D), the scale.

    ``R`` is the variance of the noise, relative to sigma^2 where that is learnt; the first ``moving`` regressors are
    data, not a constant.
    """

    units: np.ndarray
    cap: np.ndarray
    prior: tuple[np.ndarray, np.ndarray, np.ndarray]
    scale: Any
    R: float
    moving: int

    @property
    def N(self) -> int:
        """Number of parameters."""
        return len(self.units)

    @property
    def settle(self) -> float:
        """How many samples it takes until a learnt sigma^2 says what surprises."""
        return 0.0 if isinstance(self.scale, KnownScale) else 2.0 * self.N


def adaptation(memory, setting: Setting) -> tuple[Any, Any, float, int]:
    """Return the memory and the detector of a recursive estimator as the kernel wants them.

    Besides: how many measured samples pass before the detector counts, and how many numbers the memory keeps.
    """
    refuse_class("memory", memory)
    detector, settle = resolve_watch(memory, setting.N, setting.units)
    if isinstance(memory, RestartOnChange):
        return resolve_restart(memory.response, setting), detector, settle, 0
    found, memory_size = resolve(memory, setting)
    if memory_size > LARGEST:
        raise InputError(
            f"{type(memory).__name__} of {setting.N} parameters keeps {memory_size:.2g} numbers, more than "
            f"{LARGEST:.0e}: "
            "take a smaller model, or a memory that keeps few, such as Constant() or ExponentialForgetting(lam)"
        )
    return found, detector, settle, memory_size


def resolve_restart(answer, setting) -> Any:
    """Return the kernel's answer to an alarm."""
    refuse_class("response", answer)
    if isinstance(answer, CovarianceInflation):
        q = jump_size("step", answer.step, setting.N) ** 2 * setting.units
        return restart.Jolt(q, float(validation.yes("only_named", answer.only_named)), setting.cap)
    if isinstance(answer, restart.GainReset):
        return restart.Reset(more_than_one("samples", answer.samples), setting.cap)
    raise InputError(f"response must be CovarianceInflation(step) or GainReset(samples), got {answer!r}")


@singledispatch
def resolve(memory, setting) -> tuple[Any, int]:
    """Return the kernel's memory, and how many numbers it keeps."""
    if type(memory) not in adapt.table:
        raise InputError(
            "memory must be Constant(), GainFloor(N), ExponentialForgetting(lam), VariableForgetting(N), "
            "DirectionalForgetting(lam), RandomWalk(q), Window(T), RestartOnChange(), BayesianChangePoint(jump, "
            "every), "
            "Drift(phi, q) or, where q is not known, AutoMemory(), MultipleModel(), IMM(), LikelihoodDrift(), "
            "FuzzyDrift(), CovarianceMatching(), AuxiliaryFilter(), "
            f"AutocovarianceLS() or VariationalBayes(), got {memory!r}{_meant(memory)}"
        )
    return memory, 0


@resolve.register
def resolve_str(memory: str, setting):
    if memory.lower() in ("ekf", "augmented ekf"):
        raise InputError(EKF)
    raise InputError(
        f"memory is a policy, such as ExponentialForgetting(0.99), not the word {memory!r}: words are for --memory"
    )


@resolve.register
def resolve_random_walk(memory: RandomWalk, setting):
    return resolve_walk(memory, setting.units, setting.cap), 0


@resolve.register
def resolve_gain_floor(memory: fading.GainFloor, setting):
    samples = more_than_one("samples", memory.samples)
    return fading.Fade(1.0, samples, MEMORIES * samples, setting.cap), 1 + setting.N


@resolve.register
def resolve_exponential_forgetting(memory: fading.ExponentialForgetting, setting):
    lam, horizon = _weight(memory.lam)
    return fading.Fade(lam, np.inf, horizon, setting.cap), 1 + setting.N


@resolve.register
def resolve_variable_forgetting(memory: fading.VariableForgetting, setting):
    samples, least = more_than_one("samples", memory.samples), validation.positive("least", memory.least)
    if least > 1:
        raise InputError(f"least is the smallest lambda, above 0 and at most 1, got {memory.least!r}")
    return fading.Alert(samples, least, setting.settle, MEMORIES * samples, setting.cap), 1 + setting.N


@resolve.register
def resolve_directional_forgetting(memory: directional.DirectionalForgetting, setting):
    return directional.Along(*_weight(memory.lam), setting.cap), 1 + setting.N


@resolve.register
def resolve_window(memory: window.Window, setting):
    samples, is_learnt = validation.count("samples", memory.samples, least=1), setting.settle > 0
    freedom, chi2 = (2 * setting.scale.alpha, 2 * setting.scale.beta) if is_learnt else (0.0, 0.0)
    if is_learnt and freedom + samples < 2:
        raise InputError(
            f"a window of {samples} samples cannot learn {setting.N} parameters and the variance of the noise: "
            f"it needs {setting.N + 1} samples, better ten times that. Is the variance known? Then say variance=..."
        )
    memory_size = window.cells_of(samples, setting.N)
    if memory_size > LARGEST:
        raise InputError(
            f"a window of {samples} samples of {setting.N} parameters keeps {memory_size:.2g} numbers, more than "
            f"{LARGEST:.0e}: take a shorter one, or GainFloor(samples), which keeps next to nothing"
        )
    return window.Slide(samples, freedom, chi2, *setting.prior), memory_size


@resolve.register
def resolve_bayesian_change_point(memory: run_lengths.BayesianChangePoint, setting):
    q = jump_size("jump", memory.jump, setting.N) ** 2 * setting.units
    rate = 1 / more_than_one("every", memory.every)
    count = validation.count("hypotheses", memory.hypotheses, least=2)
    settle = 3 * setting.settle  # six times the number of unknowns, as long as detectors wait
    return run_lengths.Mixture(rate, count, settle, q, setting.cap), run_lengths.cells_of(count, setting.N)


def _meant(memory) -> str:
    """Return the likely cause where something else came in place of a memory."""
    if isinstance(memory, int | float) and not isinstance(memory, bool):
        return (
            f". A weight per sample is ExponentialForgetting({memory})"
            if memory <= 1
            else f". Samples are GainFloor({memory})"
        )
    return ""


def more_than_one(name, value) -> float:
    """Return a number of samples that exceeds one."""
    if validation.positive(name, value) <= 1:
        raise InputError(f"{name} must exceed 1 (a gain of 1 erases all that was learnt), got {value!r}")
    return float(value)


def _weight(lam) -> tuple[float, float]:
    """Return a weight per sample, and over how many samples `hold` calls something typical."""
    if validation.positive("lam", lam) > 1:
        raise InputError(f"lam is a weight per sample, above 0 and at most 1, got {lam!r}")
    return float(lam), MEMORIES / (1 - lam) if lam < 1 else np.inf
