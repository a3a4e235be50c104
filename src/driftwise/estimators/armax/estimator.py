"""ARMA, ARMAX, output error and Box-Jenkins: recursive prediction error, or pseudolinear regression."""

from __future__ import annotations

import inspect
import math

import numpy as np

from ...engine import validation
from ...engine.errors import InputError
from ...memory.questions import finds_speed
from ...models.family import Family
from ...models.polynomial import PolynomialModel
from ...models.stability import is_inside
from ..arx.estimator import ARX
from ..arx.methods import LeastSquares
from ..arx.row import PREDICT, lags
from ..base import Estimator
from .regressors import RADIUS, Polynomials, sizes

METHODS = ("rpem", "plr")
AFTER, BEFORE = RESIDUALS = ("a posteriori", "a priori")
OWN = ("method", "instruments", "step")  # options of ARX that mean something else here, or nothing
COMMON = {
    k: p.default for k, p in inspect.signature(ARX).parameters.items() if p.kind is p.KEYWORD_ONLY and k not in OWN
}


class _Member(ARX):
    """What the members of the family share; the orders make the difference."""

    model: Family
    smooth, tune = Estimator.smooth, Estimator.tune  # its regressors are no data: noise is estimated
    _is_regression = False

    def _set(self, orders, method, options, residual=AFTER):
        unknown = [name for name in options if name not in COMMON]
        if unknown:
            raise TypeError(f"{type(self).__name__} has no option {unknown[0]!r}; it has {', '.join(COMMON)}")
        validation.one_of("method", method, METHODS)
        if validation.one_of("residual", residual, RESIDUALS) == BEFORE and method != "plr":
            raise InputError(
                f'residual={BEFORE!r} goes with method="plr": the gradient of "rpem" is that of the residual by the '
                "corrected parameters"
            )
        own = {"method": method} | ({"residual": residual} if residual != AFTER else {})
        self.options = {**orders, **own, **COMMON, **options}
        na, nc, nd = (validation.count(name, orders.get(name, 0)) for name in ("na", "nc", "nd"))
        nb, nk, nf = (validation.counts(name, orders.get(name, ())) for name in ("nb", "nk", "nf"))
        nk, nf = _each("nk", nk, nb), _each("nf", nf, nb)
        self.model = form = Family(na, nb, nk, validation.yes("offset", self.options["offset"]), nc=nc, nd=nd, nf=nf)
        if not form.N:
            raise InputError("the model has no parameter: its orders are all zero")
        is_exact = method == "rpem"
        registers, scratch = sizes(form.N, form.kept, is_exact, False)
        start = 2.0 * form.N if self.options["P0"] is None else math.inf
        given = dict(
            exact=float(is_exact),
            kept=form.kept,
            nc=nc,
            nd=nd,
            follows=0.0,
            a_priori=float(residual == BEFORE),
            nf=np.array(nf, float),
            start=start,
        )
        self._prepare(lags(form, Polynomials, registers=registers, R=0.0, cap=(), **given), scratch)

    def _kernel_form(self, form, R, memory) -> Polynomials:
        is_apart = (
            form.nd == 0.0
        )  # else the errors of v and w are each other's opposite, and no sample tells them apart
        is_ready = form.exact > 0.0 and form.missing == PREDICT
        follows = is_ready and is_apart and finds_speed(self.options["memory"], memory)
        registers, _ = sizes(int(form.N), int(form.kept), form.exact > 0.0, follows)
        cap = np.diag(self.prior_covariance)
        return form._replace(R=R, cap=cap, follows=float(follows), registers=registers)

    def _method(self, R) -> LeastSquares:
        return LeastSquares(R)

    def _set_prior(self, theta0, P0):
        super()._set_prior(theta0, P0)
        form = self.model
        if P0 is None:  # c, d and f wait for the scale: `polynomials.begin` frees them
            self._D0[form.plain : form.plain + form.kept] = 1.0
        _, _, C, _, F = form.split(self._s0)
        for name, p in [("C", C), *((f"F{l + 1}" if form.inputs > 1 else "F", f) for l, f in enumerate(F))]:
            if not is_inside(p[1:], RADIUS, np.empty(len(p)), np.empty(len(p))):
                raise InputError(
                    f"theta0 has a zero of {name} outside the circle of radius {RADIUS}: its predictor is unstable. "
                    f"The order of theta0 is {', '.join(form.names)}; was a sign changed (y = -a y.., w = -f w..)?"
                )

    def model_of(self, state) -> PolynomialModel:
        """Return the model a state amounts to, with the covariance of its parameters."""
        s2 = self.sigma2(state)
        noise_std = math.sqrt(s2 * self.policies[0].R)
        return PolynomialModel(
            self.model, np.array(state["theta"]), s2 * self._theta_covariance(state), self.dt, noise_std
        )

    def model_at(self, theta, P) -> PolynomialModel:  # type: ignore[override]  # with the polynomials of noise
        """Return the model of a parameter vector and its covariance."""
        return PolynomialModel(self.model, theta, P, self.dt)


def _each(name, values, nb):
    """Return one order for each input."""
    values = values * len(nb) if len(values) == 1 else values
    if values and len(values) != len(nb):
        raise InputError(f"{name} must be one number, or one for each of the {len(nb)} inputs, got {values!r}")
    return values or (0,) * len(nb)


class ARMAX(_Member):
    """Parameters of A(q) y = B(q) u + C(q) e: an equation whose noise is coloured.

    Parameters
    ----------
    na : int
        Number of past outputs.
    nb, nk : int, or one for each input
        Number of coefficients, and delay, of each input.
    nc : int
        Number of coefficients of C.
    method : "rpem" or "plr"
        The exact gradient (recursive prediction error, RML2), or the regressors themselves (pseudolinear regression,
        extended least squares, RML1), which costs less.
    residual : "a posteriori" or "a priori"
        Whether the past e among the regressors of "plr" are y less what the parameters after each correction make of
        it, or those before it, which are the innovations: Perriot-Mathonna (1981) has the former in his (2), the latter
        in Hampton's filter.
    memory, gate, offset, ... : as for `ARX`

    Notes
    -----
    "rpem" reaches the Cramer-Rao bound (Ljung and Soderstrom 1983, chapter 4). "plr" does not, and converges for sure
    only where 1/C - 1/2 is positive real. Its bars assume the exact gradient all the same and are too narrow: in 200
    runs of an ARMAX(2, 2, 2) b2 spread 1.4 and c2 1.5 times as far as they say.

    After each step C is kept inside the circle by halving the step (Perriot-Mathonna 1981; status ``PROJECTED``).
    With the default prior the first few hundred samples count less, for their e is not yet what it will be, and c
    starts with a standard deviation of one; give ``P0`` and nothing of the kind happens.

    Bad at: zeros of C near the circle and poles near one (thousands of samples to converge); white noise on the
    measurement alone (C = A is then to be learnt: `OE` is leaner); a start from nothing under many gaps.

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-0.8], [1.0], samples=4000, noise_std=0.5, d=[0.6], seed=1)
    >>> trace = dw.ARMAX(1, 1, 1).scan(y, u)
    >>> print(trace.model())
    A(q) y(t) = B(q) u(t) + C(q) e(t)
    A(q) = 1 - 0.8062 (± 0.0041) q^-1
    B(q) = 0.984 (± 0.01) q^-1
    C(q) = 1 + 0.6003 (± 0.014) q^-1
    standard deviation of e: 0.4969
    """

    for_colour = "BJ, or a higher order"

    def __init__(self, na: int = 2, nb=1, nc: int = 1, nk=1, *, method: str = "rpem", residual: str = AFTER, **options):
        self._set(dict(na=na, nb=nb, nc=nc, nk=nk), method, options, residual)


class ARMA(_Member):
    """Parameters of A(q) y = C(q) e: `ARMAX` without an input, with its ``method`` and ``residual``.

    Bad at: nearly common roots of A and C, which no data tell apart.

    Parameters
    ----------
    na, nc : int
        Number of past outputs, and of past e.
    **options
        As for `ARMAX`.

    Examples
    --------
    >>> import driftwise as dw
    >>> y, _ = dw.simulate([-0.8], [0.0], samples=4000, noise_std=1.0, d=[0.5], seed=2)
    >>> print(dw.ARMA(1, 1).scan(y).parameters[-1].round(1))
    [-0.8  0.5]
    """

    for_colour = "a higher order"

    def __init__(self, na: int = 2, nc: int = 1, *, method: str = "rpem", residual: str = AFTER, **options):
        self._set(dict(na=na, nc=nc), method, options, residual)


class OE(_Member):
    """Parameters of y = B(q)/F(q) u + e: white noise on the measurement, none in the plant.

    Parameters
    ----------
    nb, nf, nk : int, or one for each input
        Number of coefficients of B and of F, and delay, of each input.
    method : "rpem" or "plr"
        The exact gradient, or the regressors themselves (Landau's output error method; 1/F - 1/2 positive real; its
        bars are too narrow, see `ARMAX`).
    memory, gate, offset, ... : as for `ARX`

    Notes
    -----
    Unbiased whatever the colour of e, where least squares (`ARX`) is not; efficient where e is white. A missing output
    costs nothing but its own news: the predictor never uses y. The rest as for `ARMAX`.

    Bad at: poles near one (thousands of samples from a start at nothing; give ``theta0``), disturbances that the plant
    itself filters (`ARMAX`, `BJ` or `Joint` predict better), unstable plants (F is kept inside the circle).

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-0.8], [1.0], samples=4000, noise_std=1.0, noise="output", seed=1)
    >>> model = dw.OE(1, 1).scan(y, u).model()
    >>> model.poles.real.round(2).tolist(), dw.ARX(1, 1).scan(y, u).model().poles.real.round(2).tolist()
    ([0.8], [0.7])
    """

    for_colour = "BJ, or a higher order"

    def __init__(self, nb=1, nf=2, nk=1, *, method: str = "rpem", **options):
        self._set(dict(nb=nb, nf=nf, nk=nk), method, options)


class BJ(_Member):
    """Parameters of y = B(q)/F(q) u + C(q)/D(q) e: plant and noise with a model of their own (Box and Jenkins).

    Parameters
    ----------
    nb, nf, nk : int, or one for each input
        Number of coefficients of B and of F, and delay, of each input.
    nc, nd : int
        Number of coefficients of C and of D.
    method : "rpem" or "plr"
        The exact gradient, or the regressors themselves (bars too narrow, see `ARMAX`).
    memory, gate, offset, ... : as for `ARX`

    Notes
    -----
    The plant is found even where the noise model is wrong; C and F are kept inside the circle, D is not.

    Bad at: short records (it has the most parameters of the family), common roots of C and D; the rest as for `OE`.

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-0.8], [1.0], samples=4000, noise_std=0.5, noise="output", seed=1)
    >>> print(dw.BJ(1, 1, 1, 1).scan(y, u).model().dc_gain.round(1))
    [5.]
    """

    for_colour = "a higher order"

    def __init__(self, nb=1, nc: int = 1, nd: int = 1, nf=2, nk=1, *, method: str = "rpem", **options):
        self._set(dict(nb=nb, nc=nc, nd=nd, nf=nf, nk=nk), method, options)
