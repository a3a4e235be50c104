"""Estimators that compete: one forecast from all of them, weighted by how well they have predicted lately."""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ...engine import compile, validation
from ...engine.dispatch import flatten
from ...engine.errors import InputError
from ...models.canonical import power_of_two
from ..base import Estimator
from ..common.posterior import Posterior
from . import step as _step
from .step import AVERAGE, AVERAGE_SAMPLE, NAIVE, PREDICTION, VARIANCE, Averaging
from .trace import AverageTrace

STRETCH = 1024  # samples that members run through before the average does: what they say of a record needs no room


class Members(NamedTuple):
    """What an average of models is as a model: unknowns of all members, and inputs of those that have any."""

    N: int
    inputs: int


class ModelAverage(Estimator):
    """The forecast of several estimators on the same samples: one density from all, honest about its tails.

    Each member predicts; the forecast is their mean, weighted by how much smaller squared errors each would have made
    (regrets), with their mean by likelihood that fades (dynamic model averaging) as one of them. The noise variance of
    each follows its recent errors, and the shape of the density is learnt: mostly normal, heavy tails where the record
    has them. Last value, straight line and mean are always members, so that the forecast is not much worse than any of
    these.

    Parameters
    ----------
    members : list of estimators
        Of one output (`ARX`, `Joint`, `ARMAX`, ..), with the same inputs or with none.
    names : list of str, optional
        What to call them.
    forgetting : float
        phi: evidence of k samples ago counts phi^k. 0.99 is a memory of a hundred samples.
    learning_rate : float
        eta: what the evidence and the error of one sample count, 1 if members are models to be believed. Where all of
        them are wrong in the same way, errors come in rows, and a row of ten says no more than one sample would: 0.1
        then.
    memory : float
        Samples by which the noise variance of each member is known.
    tails : float
        Samples by which the shape of the density is known.
    share : float
        Of the weights, given to all alike at every sample.
    window : float
        Members whose weight is less than this times the best are not heard.
    settle : int, optional
        Measured samples before evidence counts; 30, or twice the most parameters of a member, if omitted.
    y_scale : float
        Typical size of y; `scaled_to` sets it, for all members.
    center : float
        Of y and each input, (1 + k,): members see the distance from there. `scaled_to` takes the means.

    Notes
    -----
    Source: Raftery, Karny and Ettler (2010); Occam's window: Madigan and Raftery (1994);
    learning rate: Grunwald (2012); regrets: Wintenberger (2017). Cost is that of the members
    and some 50 ns for each.

    Bad at: long rests in a record of rare, violent excitation: evidence fades meanwhile, and the first sample after
    them is forecast by all alike. Members that are all wrong in the same way.

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=500, noise_std=0.3, seed=1)
    >>> average = dw.ModelAverage([dw.ARX(1, 1), dw.ARX(2, 2), dw.ARX(2, 2, memory=dw.ExponentialForgetting(0.98))])
    >>> trace = average.scaled_to(y, u).scan(y, u)
    >>> trace.leader, round(float(trace.nis(100)), 1)
    ('ARX(na=2, nb=2)', 1.0)
    """

    names: Any = ()

    sample_layout = AVERAGE_SAMPLE

    fits_fleet = False
    trace_kind = AverageTrace
    unknown_parts = ("own",)

    def __init__(
        self,
        members,
        *,
        names=None,
        forgetting: float = 0.99,
        learning_rate: float = 1.0,
        memory: float = 50.0,
        tails: float = 500.0,
        share: float = 1e-5,
        window: float = 0.01,
        settle: int | None = None,
        y_scale: float = 1.0,
        center=0.0,
    ):
        self.members = list(members)
        wrong = [m for m in self.members if not isinstance(m, Posterior)]
        if not self.members or wrong:
            came = f"got {wrong[0]!r}" if wrong else "got none"
            raise InputError(f"members must be estimators of one output, such as ARX(2, 2), {came}")
        counts = {m.model.inputs for m in self.members} - {0}
        if len(counts) > 1:
            raise InputError(f"members must have the same inputs, or none, got {sorted(counts)} of them")
        self.inputs = max(counts, default=0)
        self.model = Members(sum(m.model.N for m in self.members), self.inputs)
        self.names = [*map(repr, self.members)] if names is None else [*map(str, names)]
        if len(self.names) != len(self.members):
            raise InputError(f"names must be one for each of {len(self.members)} members, got {len(self.names)}")
        self.dt = self.members[0].dt
        self.y_scale = validation.size("y_scale", y_scale)
        self.center = validation.each("center", center, 1 + self.inputs)
        self.options: dict[str, Any] = dict(
            members=self.members, names=self.names, forgetting=forgetting, learning_rate=learning_rate,
            memory=memory, tails=tails, share=share, window=window, settle=settle, y_scale=self.y_scale, center=center,
        )  # fmt: skip
        for name, value in (
            ("forgetting", forgetting), ("learning_rate", learning_rate), ("share", share), ("window", window)
        ):  # fmt: skip
            validation.share(name, value)
        M = len(self.members)
        if settle is None:
            settle = max(30, 2 * max(m.model.N for m in self.members))
        self.task = Averaging(
            M, forgetting, learning_rate, validation.positive("memory", memory), validation.positive("tails", tails),
            share, window,
            validation.count("settle", settle), self.y_scale**2,
        )  # fmt: skip
        fields = [(f"member{i}", m.dtype) for i, m in enumerate(self.members)]
        self.dtype = np.dtype([*fields, ("own", AVERAGE.dtype(M))])
        self.scratch_size = 0

    def __repr__(self):
        return f"ModelAverage({len(self.members)} members, {self.inputs} inputs)"

    def scaled_to(self, y, u=None) -> ModelAverage:
        """Return the same average with the default priors of its members in units of the data (powers of two)."""
        y, u = validation.record(y, u, self.inputs)
        center = levels(y, u)
        y, u = y - center[0], u - center[1:]
        members = [m.scaled_to(y, u if m.model.inputs else None) for m in self.members]
        return ModelAverage(**{**self.options, "members": members, "y_scale": power_of_two(y), "center": center})

    def start(self, series: int | None = None) -> np.ndarray:
        """Return a fresh state, or ``series`` of them."""
        state = np.zeros(() if series is None else validation.count("series", series), self.dtype)
        for i, member in enumerate(self.members):
            state[f"member{i}"] = member.start()
        state["own"] = _step.fresh(self.task)
        return state

    # --- running -------------------------------------------------------------------------------------------

    @property
    def step_columns(self) -> int:
        """A sample on its own is shown all of them."""
        return self.n_columns

    @cached_property
    def spec(self) -> np.ndarray:
        """The numbers of what makes one forecast; each member is given its own."""
        return flatten([self.task])

    def _sample_sizes(self) -> tuple[int, ...]:
        return (len(self.members),)

    def table_width(self, keep) -> int:
        validation.one_of("keep", keep, ("std",))  # weights and densities are always there
        return self.n_columns

    def _trace(self, y, u, outs, keep, start, end, time):
        return self.trace_kind(self, y, u, outs, keep, end, time=time)

    def drive(self, rows, ys, us, outs, spec, scratch):
        """Advance states of S series by T samples in place."""
        for first in range(0, ys.shape[1], STRETCH):
            part = slice(first, first + STRETCH)
            self._drive(rows, ys[:, part], us[:, part], outs[:, part], spec)

    def _drive(self, rows, ys, us, outs, spec):
        """Advance them by a stretch of samples: members first, then what makes one forecast of theirs."""
        (S, T), M = ys.shape[:2], len(self.members) + len(NAIVE)
        ys, us = ys - self.center[0], us - self.center[1:]
        means, variances = np.empty((S, T, M)), np.empty((S, T, M))
        at = 0
        for i, member in enumerate(self.members):
            width = member.dtype.itemsize // 8
            own, said = rows[:, at : at + width].copy(), np.empty((S, T, member.n_columns))
            member.drive(
                own, ys, us if member.model.inputs else us[..., :0].copy(), said, member.spec, member.scratch()
            )
            rows[:, at : at + width] = own
            means[..., i], variances[..., i] = said[..., PREDICTION], said[..., VARIANCE]
            at += width
        for s in range(S):
            numbers = np.concatenate([rows[s, at:], np.empty(_step.scratch_size(M))])
            self._go(ys[s], means[s], variances[s], outs[s], numbers, spec)
            rows[s, at:] = numbers[: rows.shape[1] - at]
        outs[..., PREDICTION] += self.center[0]

    @cached_property
    def _go(self):
        return compile.passage(Averaging)

    # --- reading a state -----------------------------------------------------------------------------------

    def weights(self, state) -> np.ndarray:
        """Return the weight of each member and of the naive forecasters, in the order of ``all_names``."""
        return state["own"]["likely"].copy()

    def evidence(self, state) -> np.ndarray:
        """Return the log density, in units of y_scale, each member gave to all outputs from the ``settle``-th on."""
        return state["own"]["evidence"].copy()

    def squares(self, state) -> np.ndarray:
        """Return the sum of squared errors of each member, from the ``settle``-th measured sample on."""
        return state["own"]["squares"].copy()

    @property
    def all_names(self) -> list[str]:
        """Names of the members, and of the naive forecasters behind them."""
        return [*self.names, *NAIVE]

    def narrowed(self, state, keep) -> tuple[ModelAverage, np.ndarray]:
        """Return an average of fewer members, and the state that continues this one's.

        Parameters
        ----------
        keep : indices of members
        """
        keep = sorted(set(keep))
        fewer = ModelAverage(**{**self.options, "members": [self.members[i] for i in keep],
                                "names": [self.names[i] for i in keep]})  # fmt: skip
        after, M = fewer.start(), len(self.members)
        for new, old in enumerate(keep):
            after[f"member{new}"] = state[f"member{old}"]
        own, chosen = state["own"], [*keep, *range(M, M + len(NAIVE))]
        places = {"all": chosen, "heard": [*chosen, M + len(NAIVE)]}
        for name, shape in ((field.name, field.shape) for field in AVERAGE.fields):
            after["own"][name] = own[name][..., places[shape[-1]]] if shape and shape[-1] in places else own[name]
        after["own"]["likely"] /= after["own"]["likely"].sum()
        return fewer, after


def levels(y, u) -> list[float]:
    """Return the point from which members see y (T,) and each input (T, k): `level` of each."""
    return [level(c) for c in (y, *u.T)]


def level(column) -> float:
    """Return the mean of what is known of a column, its last hundredths taken in; 0 where nothing is known.

    Not the median: members without an offset need the point about which the inputs balance. Of a switch, which has two
    levels, the median is one of them.
    """
    known = column[np.isfinite(column)]
    if not known.size:
        return 0.0
    known = known.clip(*np.quantile(known, (0.01, 0.99)))
    return float(known[0] if np.ptp(known) == 0 else np.mean(known))  # of what is constant the mean is rounded
