"""What may be asked of every estimator, answered plainly; a kind that knows better says so."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import numpy as np

from ..detect.variance import VarianceCUSUM
from ..memory.auto import AutoMemory
from ..memory.constant import Constant
from ..models.canonical import Canonical
from ..models.equation import Equation
from ..models.scale import KnownScale


class Answers:
    """Facts about an estimator that results, analyses and reports go by: they ask no one for its class."""

    model: Any
    options: dict[str, Any]
    outputs: int | None = None  # p of an estimator of several outputs
    y_scale: Any = None  # typical size of an output; several have one each
    scale: Any = None  # how sigma^2 is known, if there is one

    is_observer = False  # whether the plant is known, so that there are no parameters
    is_arx = False  # whether it is A(q) y = B(q) u + e, all regressors data
    holds_poles = False  # whether poles are held where they are: neither taught nor in doubt
    simulates = False  # whether it has formulas of a plant, in physical units, and can simulate it
    pauses = False  # whether its loop pauses between samples, for fits in Python
    fits_fleet = True  # whether a state may be a row of a fleet
    tells_what_changed = False  # whether the slopes of its innovations can be had by its parameters
    window = math.inf  # seconds looked back at, if no more
    parity: Any = None  # the detector that compares two windows, if there is one
    members: list = []  # noqa: RUF012  (the estimators that it is the average of)
    remedy = ""  # what to try where the model does not fit, if that is always the same
    for_colour = "a higher order, or another noise model"  # what to try where the noise is not white

    # --- what it is ----------------------------------------------------------------------------------------

    @cached_property
    def parts(self) -> list[Any]:
        """The estimators whose rows lie side by side in its own: itself, or one for each of several equations."""
        return [self]

    @property
    def is_equation(self) -> bool:
        """Whether its model is a difference equation of one output, with parameters to learn."""
        return self.outputs is None and isinstance(self.model, Equation | Canonical) and bool(self.names)

    @cached_property
    def order(self) -> int:
        """How many poles the model has; 0 of a regression without memory."""
        return getattr(self.model, "order", self.model.n)

    @cached_property
    def names(self) -> list[str]:
        """Names of the parameters, in the order of ``state["theta"]`` and of a trace's columns."""
        return self.model.names

    @property
    def state_names(self) -> list[str]:
        """Names of the states, in the order of ``state["x"]`` and of a trace's columns: the measured one last."""
        n = self.model.n
        return [f"x{n - i}" for i in range(n)]

    @property
    def has_known_scale(self) -> bool:
        """Whether sigma^2 is known, so that nothing of it is learnt."""
        return isinstance(self.scale, KnownScale)

    def as_regression(self) -> Any:
        """Return the estimator as a regression on data: itself, or an ARX of the same lags; None where it is none."""
        return None

    # --- how it forgets ------------------------------------------------------------------------------------

    @cached_property
    def memory(self) -> Any:
        """The memory that was asked for; None of an estimator that has none of its own."""
        return self.options.get("memory")

    @cached_property
    def is_constant(self) -> bool:
        """Whether the parameters are taken for constants."""
        return isinstance(self.memory, Constant)

    @cached_property
    def is_automatic(self) -> bool:
        """Whether the memory finds out by itself how to forget."""
        return isinstance(self.memory, AutoMemory)

    @property
    def automatic(self) -> str:
        """What to write for a memory that finds out by itself."""
        return "memory=AutoMemory()"

    @property
    def relaxation(self) -> Any:
        """What remains of each parameter from one sample to the next, as the memory says; None where it cannot say."""
        return getattr(self.memory, "phi", None)

    @cached_property
    def odds(self) -> float | None:
        """The odds at which the memory tells a jump from all else; None of one that weighs no explanations."""
        return getattr(self.memory, "odds", None)

    @cached_property
    def detector(self) -> Any:
        """What watches its innovations, for its memory or by itself; None where nothing does."""
        return getattr(self.memory, "detector", None) or self.options.get("detector")

    @cached_property
    def watches(self) -> str:
        """What tells the jumps: the "width" or the "level" of the innovations, or "", the memory itself."""
        return "" if self.detector is None else "width" if isinstance(self.detector, VarianceCUSUM) else "level"

    # --- what a state says ---------------------------------------------------------------------------------

    def model_of(self, state) -> Any:
        """Return the model a state amounts to, with the covariance of its parameters."""
        raise NotImplementedError

    def parameters_of(self, state) -> tuple[np.ndarray, np.ndarray]:
        """Return the parameters, in the order of ``names``, and their covariance."""
        model = self.model_of(state)
        return model.values, model.covariance

    def drift_of(self, state) -> Any:
        """Return how fast each parameter drifts; None where the memory knows of no drift (a list with outputs)."""
        return None
