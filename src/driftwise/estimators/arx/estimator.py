"""Recursive identification of a difference equation, the memory chosen by a word."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...detect.gate import InnovationGate
from ...engine import validation
from ...engine.errors import InputError
from ...engine.layout import layout_of
from ...memory.constant import Constant
from ...models.equation import Equation
from ...models.noise import White
from ...models.scale import InverseGamma
from ..algebraic_start.start import AlgebraicStart, prepare_equation
from ..common.settings import arguments
from ..smoothing.estimator import InHindsight
from .forms import METHODS
from .gradient import LagsAlone, gradient
from .instruments import REGISTERS, Instruments, instruments
from .recursive import Recursive
from .row import lags


class ARX(InHindsight, Recursive):
    """Parameters of A(q) y = B(q) u + e by recursive least squares, with the memory you choose.

    Parameters
    ----------
    na : int
        Number of past outputs.
    nb : int, or one for each input
        Number of coefficients of each input; ``()`` for no input.
    nk : int, or one for each input
        Delay of each input in samples; 0 acts at once.
    memory : policy
        How the past is forgotten.
    gate : InnovationGate, optional
        Treat outliers as missing.
    offset : bool
        Estimate a constant besides.
    variance : float, optional
        Variance of e; learnt if omitted (Student-t bands).
    scale : InverseGamma, optional
        Prior of that variance.
    missing : "predict", "hold" or "skip"
        What stands for a missing number among the regressors: its prediction (whose variance counts), the last value
        (taken for true), or nothing: such samples teach nothing.
    at_rest : bool
        Whether outputs and inputs were zero before the record. Otherwise nothing is known of that time, and the first
        max(na, nk + nb - 1) samples only fill the lags (status ``SKIPPED``).
    method : "ls", "iv", "nlms" or "lms"
        Least squares; instrumental variables, consistent whatever colours e; or a stochastic gradient, of cost O(N).
    instruments : "model" or "delayed"
        With "iv", what stands for past outputs: those of an auxiliary model, simulated with the estimate, or values of
        the first input further back. Least squares runs for the first 2 N measured samples.
    step : float
        With "nlms" and "lms", the gain: stable for 0 < step < 2, slower and less restless the smaller it is.
    theta0, P0 : (N,), and scalar, (N,) or (N, N), optional
        Prior mean and covariance, the latter relative to the variance where that is learnt.
    y_scale, u_scale : float, (k,)
        Typical size of the data, for the default prior; `scaled_to` sets them.
    dt : float
        Seconds between samples.
    start : "algebraic" or AlgebraicStart, optional
        Identify the first samples at once and go on from there.

    Notes
    -----
    Bad at: noise on the measurement itself, and coloured e: least squares is biased there (`OE`, `ARMAX`, or "iv").

    Instrumental variables need an input that excites all of the model and no feedback; bars are those of white e,
    sigma^2 P (sum zeta zeta') P', exact only there. A sample whose instruments do not fit its regressors is skipped
    (``SKIPPED``). Soderstrom and Stoica (1983); Young (1984).

    A gradient has no covariance: its deviations are infinite, in the trace and in the model; bands of the prediction
    are those of the past errors, which fade with the memory. Normalised ("nlms", Nagumo and Noda 1967), the gain is
    step M phi/(1e-3 y_scale^2 + phi' M phi), M the squared units of theta; plain ("lms", Widrow and Hoff 1960),
    step M phi/y_scale^2, but never beyond M phi/(phi' M phi), so that it cannot run away. Slow where regressors are
    alike.

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=400, noise_std=0.1, seed=1)
    >>> trace = dw.ARX(2, 2, memory=dw.ExponentialForgetting(0.99)).scan(y, u)
    >>> [f"{name} {value:.2f}" for name, value in zip(trace.names, trace.parameters[-1])]
    ['a1 -1.51', 'a2 0.71', 'b1 1.00', 'b2 0.47']
    """

    is_arx = True
    for_colour = "ARMAX, or a higher order"

    def __init__(
        self,
        na: int = 2,
        nb=1,
        nk=1,
        *,
        memory: Any = Constant(),
        gate: InnovationGate | None = None,
        offset: bool = False,
        variance: float | None = None,
        scale: InverseGamma | None = None,
        missing: str = "predict",
        at_rest: bool = False,
        method: str = "ls",
        instruments: str = "model",
        step: float = 0.5,
        theta0=None,
        P0=None,
        y_scale: float = 1.0,
        u_scale=1.0,
        dt: float = 1.0,
        start: str | AlgebraicStart | None = None,
    ):
        self.options = arguments(locals())
        self._build(na, nb, nk, offset)

    def _build(self, na, nb, nk, offset, labels=(), has_disturbance=False):
        nb, nk = validation.counts("nb", nb), validation.counts("nk", nk)
        if len(nk) == 1:
            nk = nk * len(nb)
        if len(nk) != len(nb):
            raise InputError(f"nk must be one delay, or one for each of the {len(nb)} inputs, got {nk!r}")
        has_offset = validation.yes("offset", offset)
        kind = validation.one_of("method", self.options["method"], METHODS)
        self.model = form = Equation(validation.count("na", na), nb, nk, has_offset, tuple(labels), has_disturbance)
        if not form.N:
            raise InputError("the model has no parameter: give na, nb or an offset")
        N, deep = form.N, form.deep
        registers = own = 0
        if kind == "iv":
            registers, own = REGISTERS.size(N, form.na), 3 * N
            first = instruments(self.options["instruments"], form, self.options["memory"])
            deep = max(deep, first + form.na)
        self._prepare(lags(form, METHODS[kind], deep=deep, registers=registers), own)
        if self._is_bare:
            if self.options["P0"] is not None:
                raise InputError(f"method={kind!r} has no covariance, so P0 says nothing: give theta0, or step")
            self._D0, self._U0, self.prior_covariance = np.zeros(0), np.zeros(0), self._unknown()
        if self.options["start"] is not None:
            self.starting = prepare_equation(self, White(self.policies[1].R))
            form = self.policies[0]
            self.dtype = layout_of(form).dtype(form, more=self.starting.fields)

    def _method(self, R) -> Any:
        kind, memory, form = self.options["method"], self.options["memory"], self.model
        if kind == "iv":
            first, prior = instruments(self.options["instruments"], form, memory), np.diag(self.prior_covariance).copy()
            return Instruments(R, first, self.y_scale / self.u_scale[0], 2 * form.N, prior)
        if kind != "ls":
            return gradient(kind, self.options["step"], memory, self._theta_units(), self.y_scale, R)
        return super()._method(R)

    def _past(self) -> int:
        return self.model.na if self._is_regression and self.options["missing"] == "predict" else 0

    def as_regression(self) -> Any:
        """Return the estimator itself where it is least squares, else None."""
        return self if self.options["method"] == "ls" else None

    @property
    def _is_bare(self) -> bool:
        """Whether there is no covariance."""
        return isinstance(self.policies[0], LagsAlone)

    def _unknown(self) -> np.ndarray:
        return np.diag(np.full(self.model.N, np.inf))

    def start(self, series: int | None = None) -> np.ndarray:
        """Return a fresh state, or ``series`` of them."""
        state = super().start(series)
        if self.options["method"] == "iv":
            at = REGISTERS.slices(self.model.N, self.model.na)["P"]
            state["registers"][..., at] = self.prior_covariance.ravel()
        return state

    def _covariance(self, state) -> np.ndarray:
        return self._unknown() if self._is_bare else super()._covariance(state)

    def information_ratio(self, state) -> list[tuple[float, np.ndarray]]:
        """Return (ratio, direction) pairs as every estimator does; none for a gradient, which cannot tell."""
        return [] if self._is_bare else super().information_ratio(state)


class AR(ARX):
    """Parameters of A(q) y = e by recursive least squares: `ARX` without an input.

    Parameters
    ----------
    na : int
        Number of past outputs.
    **options
        As for `ARX`.

    Examples
    --------
    >>> import driftwise as dw
    >>> y, _ = dw.simulate([-0.8], [0.0], samples=500, noise_std=1.0, seed=1)
    >>> trace = dw.AR(1).scan(y)
    >>> print(trace.parameters[-1].round(1))
    [-0.8]
    """

    for_colour = "ARMA, or a higher order"

    def __init__(self, na: int = 2, **options):
        plain = ARX(na, (), (), **options)
        self.__dict__.update(plain.__dict__)
        self.options = {k: v for k, v in plain.options.items() if k not in ("nb", "nk")}
