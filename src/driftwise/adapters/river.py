"""Regression with drifting coefficients for river: learn_one, predict_one, features that come and go."""

from __future__ import annotations

import copy
import math
from typing import Any

import numpy as np

try:
    from river import base, proba
except ImportError:
    raise ImportError("driftwise.adapters.river needs river: pip install driftwise[river]") from None

from ..engine import ud
from ..engine.errors import InputError
from ..estimators.arx.estimator import AR
from ..estimators.arx.regression import Regression
from ..estimators.common.inputs import each_input
from ..memory.auto import AutoMemory
from ..models.canonical import power_of_two
from ..models.scale import InverseGamma

CARRIED = 10.0  # samples at most that sigma^2 counts for when a feature joins


class DriftRegressor(base.Regressor):
    """Coefficients that drift and jump, one sample at a time: `Regression` behind river's face.

    A feature joins at its first value other than zero, and its coefficient before that is zero. One that is absent
    from ``x``, or NaN, is missing: it is predicted from its past values, and the doubt about it counts. A NaN for ``y``
    is a missing output.

    Parameters
    ----------
    memory : policy, optional
        How the past is forgotten: `AutoMemory` if omitted, or any memory of `Regression`.
    offset : bool
        Estimate a constant besides.
    gate : InnovationGate, optional
        Treat outliers as missing (`AutoMemory` has its own way).
    missing : "predict", "hold" or "skip"
        What stands for a missing feature: see `ARX`.

    Notes
    -----
    The prior's units are the sizes of the first values (rounded to powers of two); where the first value of a feature
    is thousands of times its usual size its coefficient is held back.

    Bad at: thousands of features (P is a matrix, and `AutoMemory` keeps nine of them), words (encode them). When a
    feature joins, coefficients and their covariance carry over, but what the memory has learnt, such as speeds of
    drift, starts anew.

    Examples
    --------
    >>> import random
    >>> from driftwise.adapters.river import DriftRegressor
    >>> rng, model = random.Random(1), DriftRegressor()
    >>> for t in range(600):
    ...     x = {"load": rng.gauss(0, 1), "wind": rng.gauss(0, 1)}
    ...     y = (1 if t < 400 else 3) * x["load"] - x["wind"] + 5 + 0.1 * rng.gauss(0, 1)
    ...     model.learn_one(x, y)
    >>> print({name: round(value, 1) for name, value in model.weights.items()}, round(model.intercept, 1))
    {'load': 3.0, 'wind': -1.0} 5.0
    >>> round(model.predict_one({"load": 2.0, "wind": 0.0}, with_dist=True).sigma, 1)
    0.1
    """

    def __init__(self, memory: Any = None, offset: bool = True, gate: Any = None, missing: str = "predict"):
        self.memory = memory
        self.offset = offset
        self.gate = gate
        self.missing = missing
        self._scales: dict[Any, float] = {}  # of the features, in the order in which they joined
        self._y_scale = 1.0
        self._estimator: Any = None
        self._state: Any = None

    @property
    def _raw_memory_usage(self) -> int:
        """Return the bytes of what was learnt: the compiled loop belongs to all models alike, the compiler to none."""
        alone = copy.copy(self)
        alone._estimator = None
        return super(DriftRegressor, alone)._raw_memory_usage

    def learn_one(self, x, y):
        """Take one sample in: features ``x`` by name, and the output ``y``."""
        if self._estimator is None:
            self._y_scale = power_of_two([_number("y", y)])
        new = [name for name in x if name not in self._scales and abs(_number(name, x[name])) > 0]
        if new or self._estimator is None:
            self._join(sorted(new, key=str), x)
        if self._estimator is not None:
            self._state, _ = self._estimator.update(self._state, _number("y", y), self._row(x))

    def predict_one(self, x, with_dist: bool = False):
        """Return what y would be for the features ``x`` now; with ``with_dist`` as a normal distribution."""
        if self._estimator is None:
            mean, variance = 0.0, math.inf
        else:
            _, step = self._estimator.update(self._state, math.nan, self._row(x))
            mean, variance = step.prediction, step.variance
        return proba.Gaussian._from_state(1, mean, variance, 0) if with_dist else mean

    def clone(self, new_params=None, include_attributes: bool = False):
        """Return a fresh regressor with the same parameters; with ``include_attributes`` with what it has learnt."""
        params = copy.deepcopy(self._get_params() | (new_params or {}))  # river's own stumbles over a policy ()
        fresh = type(self)(**params)
        if include_attributes:
            fresh.__dict__ |= copy.deepcopy({k: v for k, v in self.__dict__.items() if k not in params})
        return fresh

    @property
    def _is_stochastic(self) -> bool:
        return False

    @property
    def weights(self) -> dict:
        """Coefficients by name."""
        return {} if self._state is None else dict(zip(self._scales, self._state["theta"].tolist()))

    @property
    def intercept(self) -> float:
        """The constant."""
        return float(self._state["theta"][-1]) if self.offset and self._state is not None else 0.0

    def _row(self, x):
        """Return the features as inputs in the order in which they joined, NaN where absent."""
        return [_number(name, x.get(name, math.nan)) for name in self._scales] or None

    def _join(self, new, x):
        """Let features join: a larger estimator, which goes on with the coefficients that there are."""
        self._scales |= {name: power_of_two([_number(name, x[name])]) for name in new}
        if not self._scales and not self.offset:
            return  # nothing to learn yet
        old, state = self._estimator, self._state
        self._estimator = est = self._build(None if old is None else carried(old, state))
        self._state = est.start()
        if old is None:
            return
        before, N = old.model.inputs, est.model.N
        kept = [*range(before), N - 1][: old.model.N]
        self._state["theta"][kept] = state["theta"]
        root = np.diag(np.sqrt(np.diag(est.prior_covariance)))
        root[np.ix_(kept, kept)] = ud.unpack_root(state["U"], state["D"])
        self._state["D"], self._state["U"] = ud.factor_root(root)
        for name in (field.name for field in each_input()):
            self._state[name][:before] = state[name]

    def _build(self, scale):
        """Return the estimator for the features so far."""
        options = dict(
            memory=AutoMemory() if self.memory is None else self.memory, offset=self.offset, gate=self.gate,
            scale=scale,
            missing=self.missing, y_scale=self._y_scale,
        )  # fmt: skip
        scales = list(self._scales.values())
        return Regression(len(scales), **options, u_scale=scales) if scales else AR(0, **options)


def carried(est, state) -> InverseGamma | None:
    """Return what is known of sigma^2 as a prior that new samples soon outweigh; None where too little is."""
    alpha, beta = est.scale_posterior(state)
    share = min(1.0, CARRIED / (2 * alpha)) if alpha > 1 else 0.0
    return InverseGamma(share * alpha, share * beta) if share > 0 and beta > 0 else None


def _number(name, value) -> float:
    """Return a value as a number, NaN where it is None."""
    if isinstance(value, float) and math.isfinite(value):
        return value
    try:
        number = math.nan if value is None else float(value)
    except (TypeError, ValueError):
        raise InputError(f"{name} must be a number, got {value!r}. Is it a word? Encode it (OneHotEncoder)") from None
    if math.isinf(number):
        raise InputError(f"{name} must be finite, or NaN where missing, got {value!r}. Was something divided by zero?")
    return number
