"""Regression with drifting coefficients for scikit-learn: fit, partial_fit, predict with error bars."""

from __future__ import annotations

from typing import Any

import numpy as np

try:
    from sklearn.base import BaseEstimator, RegressorMixin
    from sklearn.utils.validation import check_consistent_length, check_is_fitted, column_or_1d, validate_data
except ImportError:
    raise ImportError("driftwise.adapters.sklearn needs scikit-learn: pip install driftwise[sklearn]") from None

from ..engine.errors import InputError
from ..engine.validation import numbers
from ..estimators.arx.regression import Regression
from ..memory.auto import AutoMemory

CHUNK = 1024  # rows with gaps predicted at once


class DriftRegressor(RegressorMixin, BaseEstimator):
    """Coefficients of y = X theta + offset that drift and jump, sample after sample; `predict` is for the next one.

    Rows are in the order of time. `Regression` does the work: `partial_fit` gives the same numbers bit for bit as its
    ``scan`` over the same rows, NaN is a missing value in X and in y.

    Parameters
    ----------
    memory : policy, optional
        How the past is forgotten: `AutoMemory` if omitted, or any memory of `Regression`.
    offset : bool
        Estimate a constant besides.
    gate : InnovationGate, optional
        Treat outliers as missing (`AutoMemory` has its own way).
    missing : "predict", "hold" or "skip"
        What stands for a missing number of X: see `ARX`.

    Attributes
    ----------
    coef_, coef_std_ : (n_features,)
        Coefficients after the last row, and their standard deviations.
    intercept_ : float
    estimator_, state_
        The `Regression` and where it stands: ``estimator_.scan(y, X, state=state_)`` goes on with a trace.

    Notes
    -----
    The typical sizes of X and y are those of the first batch; ``partial_fit`` in pieces and ``fit`` at once differ by
    that alone, not at all where the first batch has sizes like the rest (they are rounded to powers of two).

    Bad at: rows in random order (nothing drifts then: ``memory=dw.Constant()``, or scikit-learn's own),
    cross-validation that shuffles (use TimeSeriesSplit), and hundreds of features: P is a matrix, and `AutoMemory`
    keeps nine of them.

    Examples
    --------
    >>> import numpy as np
    >>> from driftwise.adapters.sklearn import DriftRegressor
    >>> rng = np.random.default_rng(1)
    >>> X = rng.standard_normal((600, 2))
    >>> slope = np.where(np.arange(600) < 400, 1.0, 3.0)  # jumps
    >>> y = slope * X[:, 0] - X[:, 1] + 5 + 0.1 * rng.standard_normal(600)
    >>> model = DriftRegressor().fit(X, y)
    >>> print(model.coef_.round(1), round(model.intercept_, 1))
    [ 3. -1.]  5.0
    """

    def __init__(self, memory: Any = None, *, offset: bool = True, gate: Any = None, missing: str = "predict"):
        self.memory = memory
        self.offset = offset
        self.gate = gate
        self.missing = missing

    def fit(self, X, y):
        """Start anew and learn the rows of X (T, n) and y (T,) in their order."""
        return self._learn(X, y, is_first=True)

    def partial_fit(self, X, y):
        """Go on with the rows that came after those learnt so far."""
        return self._learn(X, y, is_first=not hasattr(self, "state_"))

    def predict(self, X, return_std: bool = False):
        """Return what y would be at the next sample, were its regressors a row of X; rows do not follow each other.

        Parameters
        ----------
        X : (T, n)
            NaN where missing.
        return_std : bool
            Return the standard deviations (T,) besides: those of y, noise and coefficients together.
        """
        check_is_fitted(self, "state_")
        X = validate_data(self, X, reset=False, dtype=float, ensure_all_finite="allow-nan")
        s2, theta = self.estimator_.sigma2(self.state_), self.state_["theta"]
        psi = np.hstack([X, np.ones((len(X), theta.size - X.shape[1]))])
        mean = psi @ theta
        P = self.estimator_.covariance(self.state_)
        variance = s2 * (np.sum(psi @ P * psi, axis=1) + self.estimator_.policies[1].R)
        gaps = np.flatnonzero(np.isnan(mean))
        for at in np.split(gaps, range(CHUNK, len(gaps), CHUNK)):
            mean[at], variance[at] = self._with_gaps(X[at])
        return (mean, np.sqrt(variance)) if return_std else mean

    def _with_gaps(self, X):
        """Return mean and variance of the next sample, missing regressors predicted as in learning."""
        _, step = self.estimator_.update_batch(np.repeat(self.state_, len(X)), np.full(len(X), np.nan), X)
        return step.prediction, step.variance

    @property
    def coef_(self) -> np.ndarray:
        """Coefficients after the last row (n_features,)."""
        return self.state_["theta"][: self.n_features_in_].copy()

    @property
    def coef_std_(self) -> np.ndarray:
        """Their standard deviations (n_features,)."""
        _, P = self.estimator_.parameters_of(self.state_)
        return np.sqrt(np.diag(P))[: self.n_features_in_]

    @property
    def intercept_(self) -> float:
        """The constant after the last row."""
        return float(self.state_["theta"][-1]) if self.estimator_.model.has_offset else 0.0

    def _learn(self, X, y, is_first):
        if y is None:
            raise InputError("this estimator requires y to be passed, but the target y is None")
        X = validate_data(self, X, reset=is_first, dtype=float, ensure_all_finite="allow-nan")
        y = numbers("y", column_or_1d(y, warn=True, dtype=float))
        check_consistent_length(X, y)
        if is_first:
            if np.isnan(y).all():
                raise InputError("y has no measured value, only NaN; is it the right column?")
            names = getattr(self, "feature_names_in_", self.n_features_in_)
            memory = AutoMemory() if self.memory is None else self.memory
            est = Regression(names, memory=memory, offset=self.offset, gate=self.gate, missing=self.missing)
            self.estimator_ = est.scaled_to(y, X)
            self.state_ = self.estimator_.start()
        (self.state_,), _ = self.estimator_.update_batch(self.state_.reshape(1), y[None], X[None])
        return self

    def __sklearn_tags__(self):
        tags = super().__sklearn_tags__()
        tags.input_tags.allow_nan = True
        return tags
