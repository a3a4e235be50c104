"""Which order do the data speak for? The evidence of each, with parameters, state and scale integrated out."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, cast

import numpy as np

from ..engine import validation
from ..engine.errors import InputError
from ..estimators.common.priors import WIDTH
from ..estimators.joint.estimator import Joint
from ..models.canonical import power_of_two
from ..models.noise import EquationError
from ..models.scale import InverseGamma
from ..results.frames import as_frame
from ..results.summary import Summary

PILOT = 1000  # samples that set the units
VAGUE = 10.0  # prior variance of the unknowns in units of the data
SMALLEST = 1e-24  # noise variance, relative to that of y, where Joint's own round-off begins
CLOSE = 3.0  # odds below which two orders are called equally good


class OrderEvidence:
    """Log evidence, posterior probability and one-step errors of several orders on the same samples.

    Feed it a record piece by piece (`add`); memory does not grow. The first 1000 samples, from the first measured
    output on, are kept until they are complete and set the units: so the pieces do not matter. (Reading a result
    earlier sets them by what there is.)

    Parameters
    ----------
    orders : iterable of int
        Orders to compare, equally probable beforehand.
    inputs : int, optional
        Number of inputs; taken from the first piece if omitted.
    direct : bool
        Whether u(t) acts on y(t) at once.
    noise : a noise of `Joint`, or a function from the order to one
        `NoisePolynomial` and `NoiseCovariance` are as long as the order: give a function.
    P0 : float
        Prior variance of every unknown in units of the data: a's have 1, b's those of y / u, the state those of y. The
        default 10 expects coefficients of a few units: at 1 a fifth order with poles near 1 (coefficients up to 9) is
        overfitted, at 100 second orders that show weakly are missed.
    scale : InverseGamma, optional
        Prior of sigma^2 where the noise variance is to be learnt, the same for every order. By default
        alpha = 1/2, beta = s^2 / 2: the weight of one sample, at the noise level s^2 of the pilot.
    **options
        What else `Joint` takes (memory, dt, floor).

    Raises
    ------
    InputError
        Where an order, a shape or a setting does not fit.

    Notes
    -----
    The sum of log predictive densities is the evidence log p(y | order) exactly where `Joint` is exact. It carries its
    own penalty for unknowns, so no BIC term is added; it depends on the prior: each unknown costs about
    log(P0 x information) / 2, without bound as P0 grows. With one input an order brings three unknowns, and a hundred
    times P0 a thousand times the odds against it: weigh odds below that with care. x(0) belongs to the prior, so every
    order uses every sample.

    Both priors are proper, as they must be: under the reference prior of `Joint` the evidence is known up to a constant
    that depends on the order. `Joint` counts P0 relative to sigma^2 where that is learnt; on a clean record such a
    prior would hold theta near zero and the *smallest* parameters would win, not the fewest. Hence P0 here is absolute,
    divided by the pilot's noise level, which the highest order estimates and which is rounded to a power of four.

    Bad at: `OutputError`, whose posterior is approximate; parameters that jump; colour of the noise, which a
    higher order explains in part; signals that grow for ever (one mode drowns the others); two orders that are both
    wrong.

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=300, noise_std=0.5, seed=1)
    >>> evidence = OrderEvidence(range(1, 4)).add(y[:100], u[:100]).add(y[100:], u[100:])
    >>> evidence.best, evidence.probability.round(3).tolist()
    (2, [0.0, 1.0, 0.0])
    """

    def __init__(
        self,
        orders=range(1, 6),
        inputs: int | None = None,
        direct: bool = False,
        *,
        noise: Any = EquationError(),
        P0: float | None = None,
        scale: InverseGamma | None = None,
        **options,
    ):
        try:
            orders = [validation.count("orders", n, least=1) for n in orders]
        except TypeError:
            raise InputError(f"orders must be a list of orders, got {orders!r}; for one order n give [n]") from None
        if not orders:
            raise InputError("orders is empty: which ones shall be compared?")
        self.orders = sorted(set(orders))
        self.inputs = None if inputs is None else validation.count("inputs", inputs)
        self.direct, self._noise = direct, noise
        self.P0 = VAGUE if P0 is None else validation.positive("P0", P0)
        self.scale = scale
        for name in ("gate", "s0", "y_scale", "u_scale", "form"):
            if options.get(name) is not None:
                why = "it rejects other samples for each order" if name == "gate" else "it is set for each order here"
                raise InputError(f"choose_order takes no {name}: {why}")
        if scale is not None and not (isinstance(scale, InverseGamma) and scale.alpha > 0 and scale.beta > 0):
            raise InputError(f"orders are compared under a proper prior: alpha and beta > 0, got {scale!r}")
        self.options = {k: v for k, v in options.items() if v is not None}
        self.samples = 0
        self._pilot: list[tuple[np.ndarray, np.ndarray]] = []
        self._runs: dict[int, tuple[Joint, Summary]] = {}
        self._states: dict[int, Any] = {}

    # --- feeding -------------------------------------------------------------------------------------------

    def add(self, y, u=None) -> OrderEvidence:
        """Take in the next piece of the record, y (T,) and u (T,) or (T, k); NaN where missing."""
        inputs = self.inputs
        if inputs is None:
            inputs = 0 if u is None else 1 if np.ndim(u) < 2 else np.shape(u)[1]
        y, u = validation.record(y, u, inputs)
        if self.samples == 0:
            self.inputs = inputs
            for n in self.orders:
                self._joint(n, {})  # what does not fit is said now
        self.samples += len(y)
        if self._runs:
            return self._scan(y, u)
        if not self._pilot:  # x(0) is that of the first measured sample
            start = int(np.argmax(np.isfinite(y))) if np.isfinite(y).any() else len(y)
            y, u = y[start:], u[start:]
        if len(y):
            self._pilot.append((y.copy(), u.copy()))
        return self.begin() if sum(len(y) for y, _ in self._pilot) >= PILOT else self

    def begin(self) -> OrderEvidence:
        """Set the units by the first samples, start every order, and take in what has waited; once."""
        if self._runs:
            return self
        inputs = self.inputs or 0
        y, u = (np.concatenate(c) for c in zip(*self._pilot)) if self._pilot else (np.zeros(0), np.zeros((0, inputs)))
        self._pilot = []
        units = dict(y_scale=power_of_two(y[:PILOT]), u_scale=[power_of_two(c) for c in u[:PILOT].T] or 1.0)
        level = self._noise_level(y[:PILOT], u[:PILOT], units)
        settle = 2 * self._joint(self.orders[-1], units).model.N
        for n in self.orders:
            est = self._with_prior(n, units, level)
            self._runs[n] = est, Summary(est, settle=settle)
        return self._scan(y, u)

    def _joint(self, n, units) -> Joint:
        noise = cast(Callable, self._noise)(n) if callable(self._noise) else self._noise
        return Joint(n, self.inputs or 0, self.direct, noise=noise, **units, **self.options)

    def _with_prior(self, n, units, level) -> Joint:
        """Return the estimator of order n under the prior that all orders share."""
        est = self._joint(n, units)
        is_learnt = not est.has_known_scale
        P = np.diag(est.prior_covariance)[est.model.kernel] * (self.P0 / WIDTH / (level if is_learnt else 1.0))
        scale = (self.scale or InverseGamma(0.5, 0.5 * level)) if is_learnt else None
        return Joint(**{**est.options, "P0": P, "scale": scale})

    def _noise_level(self, y, u, units) -> float:
        """Return the noise variance, relative to that of y, that the highest order finds in the pilot.

        Again and again, as the prior is relative to the level: each pass takes off most of what the last one put on.
        """
        level = 1.0
        while level > SMALLEST:
            est = self._with_prior(self.orders[-1], units, level)
            state = est.scan(y, u if est.model.inputs else None, keep="innovations").state
            if est.has_known_scale or state["observed"] < 2 * est.model.N:
                break
            found = 4.0 ** round(math.log(max(est.sigma2(state), SMALLEST), 4))
            if found >= level:
                break
            level = found
        return level

    def _scan(self, y, u) -> OrderEvidence:
        for n, (est, summary) in self._runs.items():
            trace = est.scan(y, u if est.model.inputs else None, state=self._states.get(n), keep="innovations")
            self._states[n] = trace.state
            summary.add(trace)
        return self

    # --- the numbers ---------------------------------------------------------------------------------------

    @property
    def summaries(self) -> dict[int, Summary]:
        """The `Summary` of each order; fit, NIS and whiteness leave out the same first samples for all."""
        return {n: summary for n, (_, summary) in self.begin()._runs.items()}

    @property
    def log_evidence(self) -> np.ndarray:
        """Log p(y | order) of each order."""
        return np.array([s.loglik for s in self.summaries.values()])

    @property
    def probability(self) -> np.ndarray:
        """Posterior probability of each order."""
        weight = np.exp(self.log_evidence - self.log_evidence.max())
        return weight / weight.sum()

    @property
    def fit(self) -> np.ndarray:
        """One-step fit in percent."""
        return np.array([s.fit for s in self.summaries.values()])

    @property
    def rmse(self) -> np.ndarray:
        """Root mean square one-step error."""
        return np.array([s.rmse for s in self.summaries.values()])

    @property
    def nis(self) -> np.ndarray:
        """Mean normalised innovation squared.

        Above 1 on short records, more so at high orders: under a vague but proper prior the first N samples fit for
        nothing and still count. Calibration is judged by a run of `Joint` with its own prior.
        """
        return np.array([s.nis for s in self.summaries.values()])

    @property
    def best(self) -> int:
        """The most probable order, the lowest of equals."""
        return self.orders[int(np.argmax(self.log_evidence))]

    def odds(self, order: int, against: int) -> float:
        """Return how many times more probable one order is than another."""
        if not {order, against} <= set(self.orders):
            raise InputError(f"orders {order} and {against} must be among those compared, {self.orders}")
        one, other = (self.log_evidence[self.orders.index(n)] for n in (order, against))
        return math.exp(min(one - other, 700.0))

    @property
    def notes(self) -> list[str]:
        """What to beware of, in words; empty where the verdict is plain."""
        found, best, summaries = [], self.best, self.summaries
        observed = {s.observed for s in summaries.values()}
        if max(observed) == 0:
            return ["no output was measured: every order is as probable as before"]
        if best == self.orders[-1] and len(self.orders) > 1:
            found.append(f"order {best} is the largest tried: try more")
        if best == self.orders[0] and best > 1:
            found.append(f"order {best} is the smallest tried: try fewer")
        near = [n for n in self.orders if n != best and self.odds(best, n) < CLOSE]
        if near:
            listed = " and ".join(f"{n} (odds {self.odds(best, n):.1f}:1)" for n in near)
            found.append(f"nearly as probable: order {listed}")
        short = [n for n, s in summaries.items() if not s.is_enough]
        if short:
            found.append(f"{max(observed)} measured outputs are fewer than the unknowns of order {short[0]}")
        one, rmse = summaries[best], dict(zip(self.orders, self.rmse))
        better = min(rmse, key=lambda n: rmse[n] if math.isfinite(rmse[n]) else math.inf)
        if rmse[better] < 0.95 * one.rmse:
            found.append(f"order {better} has the smaller one-step error, {rmse[better]:.3g} against {one.rmse:.3g}")
        is_long = one.observed > 30 * one.estimator.model.N
        if is_long and not 0.8 <= one.nis <= 1.25 and not one.nis_interval.is_consistent:
            found.append(
                f"NIS of order {best} is {one.nis:.2f}: the noise is not what the model says, nor are the odds"
            )
        if len(observed) > 1:
            found.append("the orders did not score the same samples: some found y exactly known beforehand")
        return found

    @property
    def words(self) -> str:
        """The verdict in a sentence or two."""
        best = self.best
        others = [n for n in self.orders if n != best]
        text = f"order {best}"
        if others:
            second = max(others, key=lambda n: self.summaries[n].loglik)
            text += f", odds {_ratio(self.odds(best, second))} against order {second}"
        return "; ".join([text, *self.notes])

    def __repr__(self):
        return f"OrderEvidence({self.orders}, inputs={self.inputs}; {self.samples} samples)"

    def as_dict(self) -> dict[str, Any]:
        """Return everything as plain numbers, ready for JSON (what is not finite becomes None)."""
        table = {k: [v if math.isfinite(v) else None for v in c] for k, c in self.columns().items()}
        return {"best": self.best, "words": self.words, "notes": self.notes, **table}

    def columns(self) -> dict[str, list]:
        """Return order, log_evidence, probability, fit, rmse, nis by name."""
        names = ("log_evidence", "probability", "fit", "rmse", "nis")
        return {"order": list(self.orders), **{name: getattr(self, name).tolist() for name in names}}

    def to_frame(self, backend: str = "pandas") -> Any:
        """Return one row per order as a data frame of "pandas", "polars" or "pyarrow" (through narwhals)."""
        return as_frame(self.columns(), backend)


def choose_order(y, u=None, orders=range(1, 6), **options) -> OrderEvidence:
    """Return what the record says about the order of its model.

    Parameters
    ----------
    y : (T,) outputs; NaN where missing
    u : (T,) or (T, k) inputs, optional
    orders : iterable of int
    **options
        What `OrderEvidence` takes: direct, noise, P0, scale, and the options of `Joint`.

    Raises
    ------
    InputError
        Where data or a setting do not fit.

    Notes
    -----
    Subtract offsets first, as for `Joint`. Sources, priors and what it is bad at: `OrderEvidence`.

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=300, noise_std=0.5, seed=1)
    >>> choose_order(y, u).words.split(",")[0]
    'order 2'
    """
    return OrderEvidence(orders, **options).add(y, u).begin()


def _ratio(odds: float) -> str:
    if odds >= 1e6:
        return "beyond a million to one"
    return f"{odds:.0f}:1" if odds >= 10 else f"{odds:.1f}:1"
