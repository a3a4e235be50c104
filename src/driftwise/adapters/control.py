"""Estimators and self-tuning controllers as discrete-time I/O systems of python-control."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

try:
    import control
except ImportError:
    raise ImportError("driftwise.adapters.control needs python-control: pip install driftwise[control]") from None

from ..engine import validation
from ..engine.errors import InputError
from ..estimators.arx.row import HUGE
from ..estimators.base import is_estimator
from .regulator import Lagged, cautious_gain

MISSING = 1e99  # a signal that says "missing": python-control interpolates and compares signals, which NaN breaks


class Rows:
    """States of an estimator among the numbers of a system's state; zeros stand for a fresh one."""

    def __init__(self, estimator):
        if not is_estimator(estimator) or estimator.outputs is not None or not estimator.fits_fleet:
            raise InputError(
                f"estimator must be one of driftwise with one output, such as ARX(2, 2), got {estimator!r}"
            )
        self.estimator, self.size = estimator, estimator.dtype.itemsize // 8
        self.fresh = estimator.start()
        self._said = lru_cache(maxsize=1)(self._say)  # python-control asks several times for every sample

    def read(self, x):
        """Return the state in the first numbers of x."""
        x = np.ascontiguousarray(x[: self.size], float)
        return x.view(self.estimator.dtype).reshape(()) if x.any() else self.fresh

    def after(self, x, y, u) -> np.ndarray:
        """Return the numbers of the state after a sample."""
        state, _ = self.estimator.update(self.read(x), known(y), [known(v) for v in u] or None)
        return np.frombuffer(state.tobytes())

    def said(self, x, u=()) -> np.ndarray:
        """Return what is said before the next output is seen: its prediction and deviation, parameters and theirs."""
        return self._said(np.ascontiguousarray(x[: self.size], float).tobytes(), tuple(map(known, u)))

    def _say(self, row, u):
        state = self.read(np.frombuffer(row))
        trace = self.estimator.scan([math.nan], np.array([u]) if u else None, state=state)
        spread = math.sqrt(trace.variance[0])
        return np.concatenate([[trace.prediction[0], spread], trace.parameters[0], trace.parameters_std[0]])


def known(value) -> float:
    """Return a signal's value, NaN where it is missing or beyond use."""
    return float(value) if abs(value) < HUGE else math.nan


def create_adaptive_iosystem(estimator, *, name: str | None = None, inputs=None, outputs=None):
    """Return an estimator as a python-control system: y and u in, prediction and parameters with deviations out.

    Parameters
    ----------
    estimator : any estimator of one output
        `ARX`, `Joint`, `ARMAX`, ..
    name : str, optional
    inputs, outputs : list of str, optional
        Labels other than y, u (u[0], u[1] of several); and yhat, yhat_std, the parameters' names, and those with _std.

    Returns
    -------
    control.NonlinearIOSystem
        Discrete, of the estimator's dt. Its state is the estimator's row; zeros are a fresh one. Outputs at t rest on
        the samples before t, so that there is no loop through the estimator.

    Notes
    -----
    python-control cannot carry NaN from sample to sample: a missing value is `MISSING`, or anything beyond 1e60.

    Examples
    --------
    >>> import control, driftwise as dw, numpy as np
    >>> from driftwise.adapters.control import create_adaptive_iosystem
    >>> y, u = dw.simulate([-0.8], [1.0], samples=300, noise_std=0.1, seed=1)
    >>> system = create_adaptive_iosystem(dw.ARX(1, 1), name="estimator")
    >>> system.output_labels
    ['yhat', 'yhat_std', 'a1', 'b1', 'a1_std', 'b1_std']
    >>> response = control.input_output_response(system, np.arange(300), [y, u])
    >>> print(response.outputs[2:4, -1].round(2))
    [-0.8   1.01]
    """
    rows = Rows(estimator)
    k, names = estimator.model.inputs, estimator.names
    return control.nlsys(
        lambda t, x, u, params: rows.after(x, u[0], u[1:]),
        lambda t, x, u, params: rows.said(x, u[1:]),
        inputs=inputs or ["y", *(["u"] if k == 1 else [f"u[{i}]" for i in range(k)])],
        outputs=outputs or ["yhat", "yhat_std", *names, *(f"{n}_std" for n in names)],
        states=rows.size, dt=estimator.dt, name=name,
    )  # fmt: skip


def create_adaptive_controller(
    estimator,
    *,
    tracking: float = 1.0,
    integral: float = 0.1,
    effort: float = 0.1,
    caution: float = 0.1,
    every: int = 5,
    limits: tuple[float, float] = (-math.inf, math.inf),
    gain=None,
    design: Callable[..., Any] | None = None,
    name: str | None = None,
):
    """Return a self-tuning controller as a python-control system: r, y and a dither v in, u and parameters out.

    An `ARX` is estimated in the loop, and every few samples the gain is designed anew from what is known of it:
    proportional-integral-plus control, u(t) = u(t-1) - K (z(t) - z(t-1)) - k_I (r - y), of past outputs and inputs. In
    this form a new gain makes no bump, and at its limits u does not wind up.

    Parameters
    ----------
    estimator : ARX
        With one input and nk >= 1; ``memory=AutoMemory()`` for plants that drift and jump.
    tracking, integral, effort : float
        Prices of y^2, of the squared sum of errors, and of u^2.
    caution : float
        What the parameters' covariance is multiplied by: 0 takes the estimate for the truth; 1 takes the bands as they
        are, as if nothing more would ever be learnt, which is too shy.
    every : int
        Samples from one design to the next; 0: the gain stays as it is.
    limits : (low, high)
        Of u. The estimator sees u as it was after the limits.
    gain : (size,), optional
        The first gain, until there is a design; zero if omitted.
    design : function of F and G, optional
        Returns K in place of `cautious_gain`, such as ``lambda F, G: control.place(F, G, poles)``. Where it fails
        (LinAlgError, ValueError, not finite) the gain stays as it was.
    name : str, optional

    Returns
    -------
    control.NonlinearIOSystem
        Outputs u, the parameters, and their deviations (with _std). Its state begins with the estimator's row; zeros
        are a fresh start.

    Notes
    -----
    Bad at: learning without excitation. A loop that is quiet and well regulated does not show a and b apart; caution
    then turns the controller off rather than trying. Add a dither v (its amplitude is the price of staying alert), or
    let r move. Until the estimate stands u is the dither alone. No proof of stability comes with it.

    Examples
    --------
    >>> import control, driftwise as dw, numpy as np
    >>> from driftwise.adapters.control import create_adaptive_controller
    >>> plant = control.nlsys(lambda t, x, u, p: 0.9 * x + (0.2 if t < 300 else 1.0) * u[0] + u[1],
    ...     lambda t, x, u, p: x, inputs=["u", "e"], outputs=["y"], states=1, dt=1, name="plant")
    >>> tuner = create_adaptive_controller(dw.ARX(1, 1, memory=dw.AutoMemory()), limits=(-5, 5), name="tuner")
    >>> loop = control.interconnect([plant, tuner], inputs=["r", "v", "e"], outputs=["y", "u", "b1"],
    ...     check_unused=False)
    >>> t, rng = np.arange(600), np.random.default_rng(0)
    >>> r, v = np.where(t // 50 % 2, 1.0, -1.0), rng.choice([-0.02, 0.02], 600)
    >>> y, u, b1 = control.input_output_response(loop, t, [r, v, 0.003 * rng.standard_normal(600)]).outputs
    >>> print(b1[[290, 590]].round(2), np.abs((r - y)[[290, 590]]).max() < 0.2)
    [0.2 1. ] True
    """
    tuner = Tuner(estimator, limits, gain, every)
    caution, prices = not_negative("caution", caution), dict(tracking=tracking, integral=integral, effort=effort)
    prices = {key: validation.positive(key, value) for key, value in prices.items()}

    def find(theta, P):
        if design is None:
            return cautious_gain(tuner.form, theta, caution * P, **prices)
        F, G = tuner.form.matrices(theta)
        return np.reshape(design(F, G[:, None]), tuner.form.size)

    tuner.design = find
    names = estimator.names
    return control.nlsys(
        tuner.update, tuner.output, inputs=["r", "y", "v"], outputs=["u", *names, *(f"{n}_std" for n in names)],
        states=tuner.ends[-1] + 1, dt=estimator.dt, name=name,
    )  # fmt: skip


def not_negative(name, value) -> float:
    """Return a finite number of at least 0."""
    return 0.0 if isinstance(value, int | float) and value == 0 else validation.positive(name, value)


def between(limits) -> tuple[float, float]:
    """Return the lowest and the highest u."""
    try:
        low, high = map(float, limits)
    except (TypeError, ValueError):
        low = high = math.nan
    if not low < high:
        raise InputError(f"limits must be (low, high), the lowest and the highest u, got {limits!r}")
    return low, high


class Tuner:
    """The functions of a self-tuning controller; its state is [row, gain K, past outputs, past inputs, u without v]."""

    design: Callable[..., Any]

    def __init__(self, estimator, limits, gain, every):
        self.estimator, self.form, self.rows = estimator, Lagged.of(estimator), Rows(estimator)
        form, self.every = self.form, validation.count("every", every)
        self.low, self.high = between(limits)
        self.first = np.zeros(form.size) if gain is None else validation.vector("gain", gain, form.size)
        self.ends = np.cumsum([self.rows.size, form.size, form.outputs, form.inputs + 1]).tolist()

    def parts(self, x):
        """Return row, gain, past outputs and inputs (newest first), and the last u without its dither."""
        a, b, c, d = self.ends
        row = x[:a]
        return row, x[a:b] if row.any() else self.first, x[b:c], x[c:d], float(x[d])

    def act(self, r, y, v, K, ys, us, own) -> tuple[float, float]:
        """Return u without and with the dither: u(t) = u(t-1) - K (z(t) - z(t-1)), within the limits."""
        dz = np.concatenate([np.append(y, ys[:-1]) - ys, us[:-1] - us[1:], [r - y]])
        base = min(max(own - float(K @ dz), self.low), self.high)
        return base, min(max(base + v, self.low), self.high)

    def redesign(self, row, K):
        """Return the gain for what is known now; the one there was where that has none."""
        state, m = self.rows.read(row), self.form.na + self.form.nb
        theta, P = self.estimator.parameters_of(state)
        alpha, _ = self.estimator.scale_posterior(state)
        if alpha <= 1:
            return K  # too few samples: the parameters' law, Student's with 2 alpha degrees, has no variance yet
        heavy = 1.0 if math.isinf(alpha) else alpha / (alpha - 1)
        try:
            new = self.design(theta[:m], heavy * P[:m, :m])
        except (np.linalg.LinAlgError, ValueError):
            return K
        return new if new is not None and np.isfinite(new).all() else K

    def update(self, t, x, inputs, params):
        """Return the state after a sample."""
        (r, y, v), (row, K, ys, us, own) = inputs, self.parts(x)
        last = held(y, ys)
        base, u = self.act(r, last, v, K, ys, us, own)
        row = self.rows.after(row, y, [u])
        if self.every and self.rows.read(row)["samples"] % self.every == 0:
            K = self.redesign(row, K)
        return np.concatenate([row, K, [last], ys[:-1], [u], us[:-1], [base]])

    def output(self, t, x, inputs, params):
        """Return u, the parameters and their deviations."""
        (r, y, v), (row, K, ys, us, own) = inputs, self.parts(x)
        _, u = self.act(r, held(y, ys), v, K, ys, us, own)
        return np.concatenate([[u], self.rows.said(row, [0.0])[2:]])


def held(y, ys) -> float:
    """Return y, or the last one where it is missing."""
    return float(ys[0] if math.isnan(known(y)) else y)
