"""What every estimator's state can be asked: rows, covariance, scale, evidence, what has been learnt."""

from __future__ import annotations

import inspect
import math
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ..engine import compile, ud, validation
from ..engine.errors import InputError
from ..models import noise as noises
from ..models.scale import KnownScale, sigma2
from ..results.snapshot import register
from ..results.trace import Trace, width


class Step(NamedTuple):
    """What one sample showed: its prediction, the error, its variance, what happened (arrays for a fleet)."""

    prediction: Any
    innovation: Any
    variance: Any
    status: Any


class Rows:
    """States as rows of numbers, and the compiled loop that runs over them."""

    model: Any
    policies: Any
    dtype: np.dtype
    spec: np.ndarray
    scratch_size: int
    options: dict[str, Any]
    starting: Any = None  # what makes its start from its first samples, if anything
    _s0: np.ndarray
    _D0: np.ndarray
    _U0: np.ndarray
    columns = 4  # prediction, innovation, variance, status: what the trace holds before means and spreads
    trace_kind: type[Trace] = Trace  # what a run over a record returns
    _x = "x"  # the state's field in a row

    def __init_subclass__(cls, **options):
        super().__init_subclass__(**options)
        register(cls)

    def __repr__(self):
        first = next(iter(self.options))
        defaults: dict[str, Any] = {}
        for kind in reversed(type(self).__mro__):
            defaults |= inspect.signature(kind).parameters if kind is not object else {}
        changed = {k: v for k, v in self.options.items() if k == first or repr(v) != repr(defaults[k].default)}
        return f"{type(self).__name__}({', '.join(f'{k}={v!r}' for k, v in changed.items())})"

    def start(self, series: int | None = None) -> np.ndarray:
        """Return a fresh state, or ``series`` of them."""
        state = np.zeros(() if series is None else validation.count("series", series), self.dtype)
        n = self.model.n
        state[self._x], state["theta"] = self._s0[:n], self._s0[n:]
        state["D"], state["U"] = self._D0, self._U0
        return state

    @property
    def names(self) -> list[str]:
        """Names of the parameters, in the order of ``state["theta"]`` and of a trace's columns."""
        return self.model.names

    def smooth(self, *args, **options):
        """Refuse (InputError): smoothing needs regressors that are data, or a joint posterior with the state."""
        raise InputError(
            f"{type(self).__name__} has no smoother: use ARX, AR or Regression, or Joint(order, inputs).smooth(y, u)"
        )

    def tune(self, *args, **options):
        """Refuse (InputError): the regressors of this model are not data."""
        raise InputError(
            f"{type(self).__name__} has no tune: drift is learnt from a record by ARX, AR and Regression, "
            "whose regressors are data"
        )

    def predict(self, *args, **options):
        """Refuse (InputError): missing samples at the end of a record are the prediction here."""
        raise InputError(
            f"{type(self).__name__} has no predict: scan the inputs to come with y missing, "
            "ahead = est.scan(np.full(h, np.nan), u, state=state), and read ahead.prediction and ahead.variance "
            "(several outputs: np.full((h, p), np.nan))"
        )

    @cached_property
    def drive(self):
        """The compiled loop, ``drive(rows, ys, us, outs, est.spec, est.scratch())``: the fastest way in, no checks."""
        return self._started(compile.driver(*map(type, self.policies)))

    def _started(self, drive):
        """Return a loop with the estimator's start in it, if it has one."""
        return drive if self.starting is None else self.starting.wrap(drive)

    def scratch(self) -> np.ndarray:
        """Return memory for one run of `drive`; its contents do not matter, but no two threads may share it."""
        return np.empty(self.scratch_size)

    def _rows(self, state, is_one=True):
        """Return a copy of the states as rows of numbers."""
        state = np.asarray(state)
        if state.dtype != self.dtype:
            raise InputError("the state belongs to another estimator: start one with est.start()")
        if is_one and state.shape != ():
            raise InputError(f"one state is expected, got {state.shape}: advance a fleet with update_batch")
        if not state.flags.c_contiguous:
            state = np.ascontiguousarray(state)
        return np.ndarray(
            (state.size, self.dtype.itemsize // 8), np.float64, state
        ).copy()  # faster than field by field


class Reading(Rows):
    """The same with one output: s ~ N(mean, sigma^2 P), sigma^2 known or learnt."""

    scale: Any
    prior_covariance: np.ndarray

    # --- running -------------------------------------------------------------------------------------------

    def update(self, state, y, u=None) -> tuple[np.ndarray, Step]:
        """Return the next state and what this sample showed; NaN means missing.

        Parameters
        ----------
        state : from `start`, `update`, or a trace
        y : the output
        u : the input, or a sequence of k inputs
        """
        rows = self._rows(state)
        ys, us = validation.sample(y, u, self.model.inputs)
        outs = np.empty((1, 1, 4))
        self.drive(rows, ys, us, outs, self.spec, self.scratch())
        prediction, innovation, variance, status = outs[0, 0].tolist()
        return np.ndarray((), self.dtype, rows), Step(prediction, innovation, variance, int(status))

    def scan(self, y, u=None, *, state=None, keep: str = "std", time=None):
        """Run over a record and return its trace; ``trace.state`` continues where it ended.

        Parameters
        ----------
        y : (T,) outputs; NaN where missing
        u : (T,) or (T, k) inputs; NaN where missing
        state : state to start from; a fresh one if omitted
        keep : "innovations", "means", "std" or "covariance": how much of each sample the trace holds
        time : (T,) instants in seconds; multiples of dt if omitted
        """
        y, u = validation.record(y, u, self.model.inputs)
        start = self.start() if state is None else state
        rows = self._rows(start)
        outs = np.empty((1, len(y), width(keep, self.model.N, self.columns)))
        self.drive(rows, y.reshape(1, -1, 1), u[None], outs, self.spec, self.scratch())
        final, observed = rows.view(self.dtype).reshape(()), float(np.asarray(start)["observed"])
        trace = Trace(self, y, u, outs[0], keep, final, observed, time)
        trace.begun = np.array(start)
        return trace

    def update_batch(self, states, y, u=None):
        """Advance a fleet: one state, and one sample or a stretch of samples, per series.

        Parameters
        ----------
        states : (S,) states
        y : (S,) or (S, T) outputs
        u : (S,), (S, k) or (S, T, k) inputs

        Returns
        -------
        states : (S,) new states
        steps : Step of arrays shaped like y
        """
        rows = self._rows(states, is_one=False)
        ys, us, shape = validation.fleet(y, u, len(rows), self.model.inputs)
        outs = np.empty((*ys.shape[:2], 4))
        self.drive(rows, ys, us, outs, self.spec, self.scratch())
        prediction, innovation, variance, status = (outs[..., i].reshape(shape) for i in range(4))
        return rows.view(self.dtype).reshape(np.shape(states)), Step(
            prediction, innovation, variance, status.astype(int)
        )

    # --- reading a state -----------------------------------------------------------------------------------

    def covariance(self, state) -> np.ndarray:
        """Return the covariance of s(t+1 | t) in Salut's order; relative to sigma^2 where that is unknown."""
        return self._covariance(state)[..., self.model.kernel, :][..., self.model.kernel]

    def _covariance(self, state) -> np.ndarray:
        """Return the covariance in the kernel's order, with what an unknown polynomial is yet to get."""
        P = ud.unpack(state["U"], state["D"])
        if self.model.coloured:
            n, first = self.model.n, self.model.n * (self.model.blocks - 1)
            for index in np.ndindex(P.shape[:-2]):
                free = noises.held_back(self.policies[1], float(state["observed"][index]), self.sigma2(state[index]))
                P[index][range(first, first + n), range(first, first + n)] += free
        return P

    def _theta_covariance(self, state) -> np.ndarray:
        """Return the covariance of theta in its own order, relative to sigma^2 where that is unknown."""
        n = self.model.n
        return self._covariance(state)[n:, n:]

    def scale_posterior(self, state) -> tuple[float, float]:
        """Return (alpha, beta) of the inverse-gamma posterior of sigma^2; (inf, inf) where it is known."""
        if isinstance(self.scale, KnownScale):
            return math.inf, math.inf
        return self.scale.alpha + float(state["observed"]) / 2, self.scale.beta + float(state["chi2"]) / 2

    def sigma2(self, state) -> float:
        """Return the estimate of the scale sigma^2 (1 where the noise is known).

        It is relative to the variance that the noise has in the units of y_scale; the noise itself in units of y is
        ``trace.summary().noise_std``.
        """
        return sigma2(self.scale, float(state["observed"]), float(state["chi2"]))

    def loglik(self, state) -> float:
        """Return log p(y_1..y_t), parameters (and scale) integrated out: the evidence, ready to compare.

        Under the reference prior of an unknown scale it is known up to a constant only, which depends on N:
        compare orders with a proper `InverseGamma(alpha, beta)`.
        """
        count, chi2, logdet = (float(state[k]) for k in ("observed", "chi2", "logdet"))
        base = -0.5 * (count * math.log(2 * math.pi) + logdet)
        if isinstance(self.scale, KnownScale):
            return base - 0.5 * chi2
        (alpha, beta), prior = self.scale_posterior(state), self.scale
        if alpha <= 0:
            return math.nan
        constant = math.lgamma(prior.alpha) - prior.alpha * math.log(prior.beta) if prior.alpha > 0 else 0.0
        return base + math.lgamma(alpha) - alpha * math.log(beta) - constant

    def information_ratio(self, state) -> list[tuple[float, np.ndarray]]:
        """Return (ratio, direction) pairs: posterior over prior variance along directions of theta, worst first.

        A ratio near one says that the data have taught nothing about that combination of parameters (above 0.5
        counts as unlearnt; S. Salut's identifiability, live). Directions are unit vectors in prior deviations.
        """
        n = self.model.n
        P = self._theta_covariance(state)
        prior = np.diag(self.prior_covariance)[n:].copy()
        if self.model.coloured and self.policies[1].settle > 0:
            at = n * (self.model.blocks - 2)
            prior[at : at + n] = noises.held_back(self.policies[1], 0.0, self.sigma2(state))
        return directions(P, prior)


def directions(P, prior) -> list[tuple[float, np.ndarray]]:
    """Return (ratio, direction) pairs of a covariance to its prior variances, largest ratio first."""
    root = np.sqrt(prior)
    live = root > 0
    ratio, vectors = np.linalg.eigh((P / np.where(live, root, 1) / np.where(live, root, 1)[:, None])[live][:, live])
    full = np.zeros((len(ratio), len(root)))
    full[:, live] = vectors.T
    return [(max(float(r), 0.0), v) for r, v in zip(ratio[::-1], full[::-1])]
