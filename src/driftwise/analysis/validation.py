"""`validate`: a model held against what an engineer asks of it before it is used."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..models.curves import Curve, Frequencies, Mode, frequency_response, modes, step_response
from ..models.filtering import linear_filter
from ..models.markup import as_typed
from ..results import verbs
from ..results.numbers import SECONDS, complex_number, fixed, number, plus_minus
from ..results.verdicts import Diagnosis
from .delays import lagged
from .held_model import SIMULATION, Fit, HeldModel, check_kind, filled, fits
from .residual_tests import CLIP, Correlated
from .validation_verdicts import Residuals, judge_residuals

STEPS = (1, 5, 25, SIMULATION)  # samples ahead
SEEN = 2 / 3  # of the record: what the held model is estimated from, the rest is fresh
ENOUGH = 20  # samples for each unknown, below which a page has no section of it
SETTLE = 5  # samples for each unknown that a filter takes to settle, of a record that has four times as many


@dataclass(frozen=True)
class Validation:
    """The answer of ``trace.validate()``; print it for its tables.

    Attributes
    ----------
    verdicts : Diagnosis
        Autocorrelation, and of each input delay, missing lag, feedback; nonlinearity. A number, its limit at a level of
        1 %, and the remedy.
    correlated : dict of name to Correlated
        The correlations of the innovations with each input, and of each input with what was new in y before.
    correlations : (21,)
        Autocorrelation of the innovations at lags 0 to 20.
    seen, fresh : list of Fit
        Of the model as it was after two thirds of the record, on these and on the last third.
    model : the model at the end, with the covariance of its parameters
    estimator, inputs : what was validated, and the names of its inputs
    samples, unit : how many there were, and what time is counted in
    """

    verdicts: Diagnosis
    correlated: dict[str, Correlated]
    correlations: np.ndarray
    seen: list[Fit]
    fresh: list[Fit]
    model: Any
    estimator: Any
    inputs: tuple[str, ...]
    samples: int
    unit: str = SECONDS

    @property
    def is_fine(self) -> bool:
        """Whether every test passed."""
        return self.verdicts.is_fine

    @property
    def dt(self) -> float:
        """What lies between samples, in its `unit`."""
        return self.estimator.dt if self.unit == SECONDS else 1.0

    @cached_property
    def modes(self) -> list[Mode]:
        """Poles with time constant, damping and frequency in Hz, each with its standard error."""
        return [] if not len(self.model.poles) else modes(self.model, self.dt)

    @cached_property
    def steps(self) -> list[Curve]:
        """The step response from each input, with its 95 % band."""
        return [step_response(self.model, i, self.dt) for i in range(len(self.inputs))]

    @cached_property
    def frequencies(self) -> list[Frequencies]:
        """The frequency response from each input, with its 95 % band."""
        return [frequency_response(self.model, i, self.dt) for i in range(len(self.inputs))]

    @property
    def words(self) -> str:
        """What is wrong with the model, and the remedy, in sentences."""
        return self.verdicts.words

    def as_dict(self) -> dict[str, Any]:
        """Return everything as plain values."""

        def plain(fit: Fit):
            return {"ahead": fit.name, "fit": fit.fit, "rmse": fit.rmse, "last_value_rmse": fit.last}

        return {
            "is_fine": self.is_fine,
            "words": self.words,
            "verdicts": self.verdicts.as_dict(),
            "seen": [plain(fit) for fit in self.seen],
            "fresh": [plain(fit) for fit in self.fresh],
            "unit": self.unit,
            "poles": [{**mode._asdict(), "pole": [mode.pole.real, mode.pole.imag]} for mode in self.modes],
        }

    def report(self, path, title: str | None = None) -> Any:
        """Write one self-contained HTML page: verdicts, correlations, fits, step response, Bode, Nyquist, poles."""
        return verbs.call("report", self, path, title)

    def __str__(self):
        return "\n\n".join(part for part in (str(self.verdicts), fit_table(self), mode_table(self)) if part)

    __repr__ = __str__

    def _repr_html_(self):
        return as_typed(str(self))


def validate(trace, inputs=None, unit: str = SECONDS) -> Validation:
    """Return what `ParameterTrace.validate` says; ``inputs`` are names, ``unit`` is what time is counted in."""
    est, y, u = trace.estimator, trace.y, trace.u
    check_kind(est)
    names = named(est, inputs)
    late = settled(est, len(y))
    z = np.where(np.isfinite(trace.innovation), trace.innovation, np.nan) / np.sqrt(trace.variance)
    z = z.clip(-CLIP, CLIP)
    z[~(np.arange(len(z)) >= late)] = np.nan
    held = HeldModel.of(est, trace.state)
    ys, us = filled(y), np.column_stack([filled(x) for x in u.T]) if u.shape[1] else u
    tested = judge_residuals(
        Residuals(
            z, y, u, trace.prediction, equation_orders(est), filtered_by(held, ys, us, y, u), names,
            est.remedy or est.for_colour,
        )
    )  # fmt: skip
    from ..results.whiteness import Correlations

    seen, fresh = split_fits(trace, ys, us, late)
    white = Correlations().add(z).correlations
    model = est.model_of(trace.state)
    return Validation(
        Diagnosis(tested.verdicts), tested.correlated, white, seen, fresh, model, est, names, len(y), unit
    )  # fmt: skip


def can_be_validated(trace) -> bool:
    """Say whether a trace is a whole one, not thinned out, of a difference equation, and long enough to judge by."""
    rows, est = getattr(trace, "rows", None), trace.estimator
    is_whole = len(trace) > 0 and (rows is None or int(rows[-1]) == len(trace) - 1) and trace.has_bars
    return is_whole and est.is_equation and np.count_nonzero(np.isfinite(trace.y)) >= ENOUGH * est.model.N


def settled(est, samples: int) -> int:
    """Return the sample from which a filter is past its beginning; one that linearises takes a quarter of all."""
    return samples // 4 if est.as_regression() is None else min(SETTLE * est.model.N, samples // 4)


def named(est, inputs) -> tuple[str, ...]:
    """Return the names of the inputs: those given, those of a regression, u or u1.."""
    k = est.model.inputs
    if inputs is not None:
        return tuple(map(str, inputs))
    labels = est.model.labels
    return labels if len(labels) == k and k else ("u",) * k if k == 1 else tuple(f"u{i + 1}" for i in range(k))


def equation_orders(est) -> tuple[int, tuple[int, ...], tuple[int, ...]]:
    """Return na, nb, nk of the equation that is left once the noise is filtered out: A F y = B u + e."""
    form = est.model
    if hasattr(form, "nb"):
        return form.na + sum(getattr(form, "nf", ())), tuple(form.nb), tuple(form.nk)
    first = 0 if form.direct else 1
    return form.n, (form.n + form.direct,) * form.inputs, (first,) * form.inputs


def filtered_by(held: HeldModel, ys, us, y, u):
    """Return y and u divided by the noise model, NaN where they are missing; as they are where it does not die out."""
    if not held.is_decaying or not u.shape[1]:
        return y, u
    by = held.noise_filter
    fy, fu = linear_filter(held.D, by, ys), linear_filter(held.D, by, us)
    return np.where(np.isfinite(y), fy, np.nan), np.where(np.isfinite(u), fu, np.nan)


def split_fits(trace, ys, us, late: int) -> tuple[list[Fit], list[Fit]]:
    """Return the fits of the model of the first two thirds there, and on the last third; none of a short record."""
    est, y = trace.estimator, trace.y
    T, at = len(y), int(SEEN * len(y))
    if at - late < 4 * est.model.N:
        return [], []
    state = trace.state_before(at)
    held = HeldModel.of(est, state)
    if not held.is_decaying:
        return [], []
    errors = held.errors(ys, us, STEPS)
    reach = max(max(len(p) for p in (held.A, held.C, *held.B, *held.F)), 1)
    known = np.isfinite(y) & np.isfinite(trace.u).all(axis=1)
    clear = np.nan_to_num(lagged(known.astype(float), range(reach)), nan=0.0).all(axis=1)
    index = np.arange(T)
    return fits(errors, y, clear & (index >= late) & (index < at)), fits(errors, y, clear & (index >= at))


# --- as text -------------------------------------------------------------------------------------------------


FIT_HEAD = ("ahead", "fit %, seen", "fit %, fresh", "error, fresh", "last value")


def mode_head(found: Validation) -> tuple[str, ...]:
    """Return the names of the columns of the table of poles."""
    return "pole", "modulus", "time constant", "damping", frequency_unit(found)


def frequency_unit(found: Validation) -> str:
    """Return what frequencies are counted in."""
    return "Hz" if found.unit == SECONDS else "cycles a sample"


def fit_rows(found: Validation) -> list[tuple[str, ...]]:
    """Return the cells of the table of fits."""
    return [
        (b.name, fixed(a.fit, 1), fixed(b.fit, 1), number(b.rmse, 3), number(b.last, 3) if b.last == b.last else "")
        for a, b in zip(found.seen, found.fresh)
    ]


def mode_rows(found: Validation) -> list[tuple[str, ...]]:
    """Return the cells of the table of poles."""

    def bar(value, std):
        if not math.isfinite(value):
            return "" if value != value else "\u221e"
        return plus_minus(value, std) if math.isfinite(std) else f"{number(value, 3)}, no bound"

    return [
        (
            complex_number(m.pole),
            bar(m.modulus, m.modulus_std),
            bar(m.time_constant, m.time_constant_std) + f" {found.unit}" * math.isfinite(m.time_constant),
            bar(m.damping, m.damping_std),
            bar(m.hertz, m.hertz_std),
        )
        for m in found.modes
    ]


def fit_table(found: Validation) -> str:
    """Return the fits as text."""
    rows = fit_rows(found)
    head = "The model of the first two thirds, held: on these (seen), and on the last third (fresh)."
    return f"{head}\n{text_table(FIT_HEAD, rows)}" if rows else ""


def mode_table(found: Validation) -> str:
    """Return the poles as text."""
    rows = mode_rows(found)
    return text_table(mode_head(found), rows) if rows else ""


def text_table(head, rows) -> str:
    """Return columns that line up."""
    wide = [max(len(row[j]) for row in [head, *rows]) for j in range(len(head))]
    return "\n".join(
        "  ".join(cell.ljust(w) if j == 0 else cell.rjust(w) for j, (cell, w) in enumerate(zip(row, wide))).rstrip()
        for row in [head, *rows]
    )
