"""A model held as it is: its forecasts k samples ahead on a record, without learning a thing from it."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ..engine.errors import InputError
from ..engine.validation import deviation, root_mean_square
from ..models.filtering import linear_filter
from ..models.noise import NoisePolynomial, OutputError, UnknownPolynomial

HUGE = 1e100  # deviations of y, beyond which an error is that of a model that ran away
SIMULATION = math.inf  # steps ahead: from the inputs alone


class HeldModel(NamedTuple):
    """A(q) y = sum B_l/F_l u_l + offset + C/D e, each polynomial in powers of q^-1."""

    A: np.ndarray
    B: list[np.ndarray]
    C: np.ndarray
    D: np.ndarray
    F: list[np.ndarray]
    offset: float = 0.0

    @classmethod
    def of(cls, estimator, state) -> HeldModel:
        """Return what a state of an estimator of one output says, with its noise model."""
        names, one = estimator.names, np.ones(1)
        values = estimator.mean(state)[-len(names) :] if names else np.zeros(0)
        offset = float(values[names.index("offset")]) if "offset" in names else 0.0
        model = estimator.model_of(state)
        if hasattr(model, "family"):
            A, B, C, D, F = model.family.split(model.values)
            return cls(A, B, C, D, F, offset)
        A, B = model.form.polynomials(model.values)
        noise = estimator.options.get("noise")
        C = one
        if isinstance(noise, OutputError):
            C = A
        elif isinstance(noise, NoisePolynomial):
            C = np.append(1.0, np.asarray(noise.d, float)[::-1])
        elif isinstance(noise, UnknownPolynomial):
            C = np.asarray(model.noise_polynomial)
        return cls(A, list(B), C, one, [one] * len(B), offset)

    @property
    def noise_filter(self) -> np.ndarray:
        """What both y and u are divided by so that the equation A F y = B u has white errors, D aside."""
        return np.asarray(np.polynomial.polynomial.polymul(self.C, _product(self.F)))

    @property
    def is_decaying(self) -> bool:
        """Whether what it divides by dies out: C and every F."""
        return all(np.all(np.abs(np.roots(p)) < 1) for p in (self.C, *self.F))

    def equation_error(self, y, u) -> np.ndarray:
        """Return w = A y - sum B/F u - offset, (T,); y and u (T, k) without gaps."""
        w = linear_filter(self.A, [1.0], y) - self.offset
        for b, f, x in zip(self.B, self.F, u.T):
            w = w - linear_filter(b, f, x)
        return w

    def errors(self, y, u, steps: tuple[float, ...]) -> dict[float, np.ndarray]:
        """Return the errors of forecasts so many steps ahead, inputs known, (T,) each: sum h_i e(t - i), i < k.

        h is the impulse response of C/(A D), e the error one step ahead (Box and Jenkins 1970, sec. 5.1); from the
        inputs alone it is all of them: 1/A times the error of the equation.
        """
        w = self.equation_error(y, u)
        e = linear_filter(self.D, self.C, w)
        most = int(max((k for k in steps if math.isfinite(k)), default=1))
        h = linear_filter(self.C, np.convolve(self.A, self.D), np.eye(1, most)[0])
        found = {}
        for k in steps:
            with np.errstate(over="ignore", invalid="ignore"):
                found[k] = linear_filter([1.0], self.A, w) if math.isinf(k) else linear_filter(h[: int(k)], [1.0], e)
        return found


def _product(polynomials) -> np.ndarray:
    found = np.ones(1)
    for p in polynomials:
        found = np.convolve(found, p)
    return found


class Fit(NamedTuple):
    """How well a held model forecast ``steps`` ahead on one part: 100 (1 - |e|/|y - mean y|), root mean square error.

    ``last`` is the error of who expects the value of ``steps`` samples before; NaN of a simulation.
    """

    steps: float
    fit: float
    rmse: float
    last: float

    @property
    def name(self) -> str:
        """How far ahead, in words."""
        return "simulation" if math.isinf(self.steps) else f"{self.steps:.0f} step{'s' * (self.steps > 1)}"


def fits(errors: dict[float, np.ndarray], y, use) -> list[Fit]:
    """Return how large errors are where ``use`` says so."""
    found, most = [], HUGE * (deviation(y) or 1.0)
    for steps, e in errors.items():
        at = use & (np.abs(e) < most)
        size, rmse = deviation(y[at]), root_mean_square(e[at])
        fit = 100 * (1 - rmse / size) if size > 0 else math.nan
        last = math.nan
        if math.isfinite(steps):
            k = int(steps)
            step = np.full(len(y), np.nan)
            step[k:] = y[k:] - y[: max(len(y) - k, 0)]
            both = at & np.isfinite(step)
            last = root_mean_square(step[both])
        found.append(Fit(steps, fit, rmse, last))
    return found


def filled(x) -> np.ndarray:
    """Return a series whose gaps are bridged by straight lines; zero where nothing was measured."""
    known = np.isfinite(x)
    if known.all():
        return np.asarray(x, float)
    at = np.arange(len(x))
    return np.interp(at, at[known], x[known]) if known.any() else np.zeros(len(x))


def check_kind(estimator: Any) -> None:
    """Refuse what is none."""
    if estimator.is_equation:
        return
    if "season" in estimator.options:
        raise InputError(
            "validate() holds an equation, and a season is learnt from the output as it comes: validate the best model "
            "without one (identify(.., season=()), ARX), and diagnose() this one"
        )
    raise InputError(
        "validate() is of difference equations of one output (ARX, ARMAX, OE, BJ, Joint and their kin), not of "
        f"{type(estimator).__name__}: diagnose() looks at its predictions"
    )
