"""What every recursive estimator of one output has: a prior, a memory, a gate, and how its state is read."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...detect.gate import InnovationGate, resolve_gate
from ...engine import validation
from ...engine.layout import layout_of
from ...memory.constant import Constant
from ...memory.settings import Setting, resolve_memory, resolve_watch, state_size
from ...models.convert import Model
from ...models.scale import InverseGamma, KnownScale, resolve_scale
from ..common.columns import RECURSIVE_SAMPLE
from ..common.posterior import Posterior
from ..common.priors import covariance_of, factors_of, mean_of
from ..common.settings import arguments
from . import step as _step  # noqa: F401  (registers the step)
from .methods import LeastSquares
from .row import HOLD, PREDICT, SKIP
from .speeds import read as read_speeds

MISSING = {"predict": PREDICT, "hold": HOLD, "skip": SKIP}


class Recursive(Posterior):
    """What every recursive estimator has: a prior, a memory, a gate, and rows that the compiled step advances."""

    sample_layout = RECURSIVE_SAMPLE
    _shows_mixture = True  # a trace has columns for what a mixture is made of
    _is_regression = True  # its regressors are data

    def __init__(
        self,
        *,
        memory: Any = Constant(),
        gate: InnovationGate | None = None,
        offset: bool = False,
        variance: float | None = None,
        scale: InverseGamma | None = None,
        missing: str = "predict",
        at_rest: bool = False,
        theta0=None,
        P0=None,
        y_scale: float = 1.0,
        u_scale=1.0,
        dt: float = 1.0,
    ):
        self.options = arguments(locals())

    def _prepare(self, form, own: int = 0):
        """Set everything that does not depend on the class: ``form`` waits for N, cells, marks and settle."""
        options, N = self.options, self.model.N
        self._set_units(options["dt"], options["y_scale"], options["u_scale"])
        missing = MISSING[validation.one_of("missing", options["missing"], MISSING)]
        variance, scale = options["variance"], options["scale"]
        R = self.y_scale**2 if variance is None else validation.positive("variance", variance)
        is_relative = scale is not None or variance is None
        self.scale = resolve_scale(scale, is_relative, N)
        self._set_prior(options["theta0"], options["P0"])
        prior, cap = (self._s0, self._U0, self._D0), np.diag(self.prior_covariance).copy()
        setting = Setting(
            self._theta_units(),
            cap,
            self.scale,
            R,
            N - self.model.constants,
            prior,
            is_regression=self._is_regression,
            past=self._past(),
        )
        given = self._memory(R)
        detector, settle = resolve_watch(given, N, setting.units)
        memory = resolve_memory(given, setting)
        fill = 0.0 if options["at_rest"] else form.fill
        columns = float(getattr(memory, "mixture_columns", 0)) if self._shows_mixture else 0.0
        form = form._replace(
            N=float(N),
            memory_size=state_size(memory, N),
            detector_size=detector.state_size(N),
            settle=settle,
            fill=fill,
            missing=missing,
            mixture_columns=columns,
        )
        # The kernel keeps 2 alpha and 2 beta in the row, where they fade with the memory.
        scale = InverseGamma(0.0, 0.0) if is_relative else KnownScale()
        form = self._kernel_form(form, R, memory)
        self.policies = (
            form,
            self._method(R),
            memory,
            resolve_gate(options["gate"], N),
            scale,
            detector,
        )
        self.dtype = layout_of(form).dtype(form)
        self.scratch_size = 5 * N + own

    def _sample_sizes(self) -> tuple[int, ...]:
        return 1, int(self.policies[0].mixture_columns)

    def _past(self) -> int:
        """Return how many regressors, the first ones, are past outputs as data, of which outliers are replaced."""
        return 0

    def _kernel_form(self, form, R, memory) -> Any:
        """Return the kernel's form, with what it needs to know of noise, prior and memory."""
        return form

    def _memory(self, R) -> Any:
        """Return the memory of all parameters."""
        return self.options["memory"]

    @property
    def tells_what_changed(self) -> bool:  # type: ignore[override]  # one that is worked out
        """Whether the slopes of its innovations can be had by its parameters: least squares and its kin."""
        return isinstance(self.policies[1], LeastSquares)

    def _method(self, R) -> Any:
        """Return the kernel's method."""
        return LeastSquares(R)

    def _set_prior(self, theta0, P0):
        order, names = np.arange(self.model.N), self.model.names
        self._s0, P = mean_of("theta0", theta0, order, names), covariance_of(P0, order, self._theta_units(), names)
        (self._U0, self._D0), self.prior_covariance = factors_of(P), P

    def _theta_units(self) -> np.ndarray:
        """Return the squared units of theta: none for a, those of y over u for b, those of y for an offset."""
        form, gain = self.model, (self.y_scale / self.u_scale) ** 2
        b = [value for value, nb in zip(np.ravel(gain), form.nb) for _ in range(nb)] if form.inputs else []
        return np.array([1.0] * form.na + b + [1.0] * form.kept + [self.y_scale**2] * form.constants)

    def start(self, series: int | None = None) -> np.ndarray:
        """Return a fresh state, or ``series`` of them."""
        state = super().start(series)
        if not isinstance(self.scale, KnownScale):
            state["count"], state["chi2"] = 2 * self.scale.alpha, 2 * self.scale.beta
        return state

    # --- reading a state -----------------------------------------------------------------------------------

    def mean(self, state) -> np.ndarray:
        """Return the parameters, in the order of ``names``."""
        return np.array(state["theta"])

    def scale_posterior(self, state) -> tuple[float, float]:
        """Return (alpha, beta) of the inverse-gamma posterior of sigma^2; (inf, inf) where it is known."""
        if isinstance(self.scale, KnownScale):
            return math.inf, math.inf
        return float(state["count"]) / 2, float(state["chi2"]) / 2

    def sigma2(self, state) -> float:
        """Return the estimate of the scale sigma^2 (1 where the noise is known).

        It is relative to y_scale^2: the variance of the noise is y_scale^2 sigma^2, or the ``variance`` that was given.
        Its root is ``trace.summary().noise_std``.
        """
        alpha, beta = self.scale_posterior(state)
        if math.isinf(alpha):
            return 1.0
        return beta / max(alpha, 0.5) if alpha >= 0.5 else max(beta / 0.5, 1.0)  # too few samples: up to the data's own

    def drift_of(self, state):
        """Return how fast each parameter drifts, as the memory has it; None where it knows of no drift.

        That is what was learnt (`AutoMemory`, `LikelihoodDrift` and their kin), the mean of the speeds that compete
        (`MultipleModel`, `IMM`), or what was said (`Drift`, `RandomWalk`). Where it was said in the units of theta, an
        NVR is read off the variance that such a drift leaves, which takes a few memories to settle.

        Returns
        -------
        Speeds
            ``nvr`` and ``memory`` (samples, 1/sqrt(NVR)) of each parameter, ``weights`` of explanations, ``words``.

        Examples
        --------
        >>> import numpy as np, driftwise as dw
        >>> rng = np.random.default_rng(1)
        >>> phi, slope = rng.standard_normal((800, 2)), np.cumsum(0.05 * rng.standard_normal(800))
        >>> est = dw.Regression(["slope", "other"], memory=dw.AutoMemory())
        >>> est.drift_of(est.scan(phi[:, 0] * slope + 2 * phi[:, 1] + 0.5 * rng.standard_normal(800), phi).state)
        slope forgets in about 10, other in about 44 samples (99 % likely)
        """
        self._rows(state)  # one state, and of this estimator
        return read_speeds(self, state, self.names)

    def variance_inflation(self, state) -> np.ndarray:
        """Return how many times larger the variance of each parameter is than if all others were known, (N,).

        1 where its regressor goes its own way; above 10 it cannot be told from what others do (Marquardt 1970), such as
        friction from an offset while a motor turns one way.

        Examples
        --------
        >>> import numpy as np, driftwise as dw
        >>> rng = np.random.default_rng(0)
        >>> one = rng.standard_normal(200)
        >>> phi = np.column_stack([one, one + 0.1 * rng.standard_normal(200), rng.standard_normal(200)])
        >>> est = dw.Regression(["twin", "other twin", "alone"])
        >>> est.variance_inflation(est.scan(phi.sum(axis=1), phi).state).round().tolist()
        [88.0, 88.0, 1.0]
        """
        P = self._theta_covariance(state)
        size = np.sqrt(np.diag(P))
        size = np.where(size > 0, size, 1.0)
        return np.diag(np.linalg.pinv(P / np.outer(size, size), hermitian=True)).copy()

    def loglik(self, state) -> float:
        """Return log p(y_1..y_t), parameters (and scale) integrated out: the evidence, ready to compare.

        Where samples have faded there is no such thing, and it is the sum of the log densities of the one-step
        predictions (Gaussian, with the variance learnt so far). Under the reference prior of an unknown scale both are
        known up to a constant only, which depends on N.
        """
        begun = 0.0 if isinstance(self.scale, KnownScale) else 2 * self.scale.alpha
        faded = begun + float(state["observed"]) - float(state["count"])
        return super().loglik(state) if faded <= 1e-9 * float(state["observed"]) else float(state["score"])

    def predict(self, state, u=None, horizon: int | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Return mean (h,) and standard deviation (h,) of the next h outputs, given the inputs to come.

        The deviation holds the noise still to come, the parameters' uncertainty (first order) and what is unknown of
        past outputs and inputs. Parameters stay as they are: a memory that lets them walk or jump widens it no further.

        Parameters
        ----------
        state : one state, as `update` or a trace leaves it
        u : (h,) or (h, k) inputs to come; omitted where the model has none
        horizon : int, optional
            h; the length of ``u`` if omitted.

        Notes
        -----
        Bad at: far horizons of a model near the edge of stability, where the first order is too narrow.

        Examples
        --------
        >>> import driftwise as dw
        >>> y, u = dw.simulate([-0.8], [1.0], samples=500, noise_std=0.1, seed=1)
        >>> est = dw.ARX(1, 1)
        >>> mean, std = est.predict(est.scan(y, u).state, [1.0, 1.0, 1.0])
        >>> std.round(2).tolist()
        [0.11, 0.14, 0.15]
        """
        from .forecast import forecast

        return forecast(self, state, u, horizon)

    def model_at(self, theta, P) -> Model:
        """Return the model of a parameter vector and its covariance."""
        form, at = self.model.canonical()
        size, real = form.N - form.n, len(at)
        values, covariance = np.zeros(size), np.zeros((size, size))
        values[at], covariance[np.ix_(at, at)] = theta[:real], P[:real, :real]
        return Model(form, values, covariance, self.dt)
