"""Drifting parameters in hindsight: what they were at every sample, how fast they drift, when they jumped."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ...engine.errors import InputError
from ...models.markup import markup
from ...results import verbs
from ...results.bands import unpack
from ...results.frames import as_frame
from ...results.numbers import MOST_ODDS
from ...results.sentences import hindsight_jump_words
from .jumps import Step
from .separable import Separability, separability
from .smoothed_wording import paragraph
from .smoother import Hindsight, diagonal

SURE = 3.0  # deviations: a step this large is named


@dataclass(frozen=True)
class Jump:
    """The parameters were new at ``sample``; ``parameter`` is the one whose step stands out most.

    ``size`` and ``std`` are its step and how uncertain that is, ``steps`` and ``steps_std`` those of all parameters;
    ``odds`` that they jumped just there, to the best drift without that jump, if one jump was likely in the record.
    """

    sample: int
    time: float
    parameter: str
    size: float
    std: float
    odds: float
    steps: dict[str, float]
    steps_std: dict[str, float]

    @property
    def text(self) -> str:
        """The jump in words."""
        steps = self.steps.items()
        others = [(n, s) for n, s in steps if n != self.parameter and abs(s) > SURE * self.steps_std[n]]
        odds = "beyond a million to one" if self.odds > MOST_ODDS else f"{self.odds:.3g} to one"
        return hindsight_jump_words(self.parameter, self.size, self.std, self.sample, others, odds)


class SmoothedParameters:
    """What `ARX.smooth` returns: parameters at every sample given the whole record, or ``lag`` samples more.

    Attributes
    ----------
    parameters, parameters_std : (T, n), given later samples too
    filtered, filtered_std : (T, n), given the samples up to each one only, under the same drift
    names : names of the columns
    drift : "walk" or "integrated"
    nvr : (n,), variance of a parameter's step (of its slope's, if integrated) per sample, in units of
        sigma^2 / mean(psi_i^2): dimensionless; 0 where no drift was found
    q : (n,), the same in the units of the parameters
    sigma2, noise_std : variance and deviation of e
    loglik : log p(y) of all rows but the first 2n, jumps and drift at their best
    logliks : the same for each drift tried, before jumps were looked for
    jumps : list of `Jump`
    is_used : (T,), which samples taught something
    separability : what the record can tell of the drifts

    Notes
    -----
    Bad at: bars of ``hyper="ml"`` take the drift for known, so that those of parameters whose drift the record cannot
    tell are too short; ``hyper="average"`` is for them (docs/smoothing.md).

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-0.8], [1.0], samples=400, noise_std=0.1, seed=1)
    >>> smoothed = dw.ARX(1, 1).smooth(y, u)
    >>> smoothed.parameters.shape, smoothed.parameters[200].round(1).tolist(), smoothed.jumps
    ((400, 2), [-0.8, 1.0], [])
    """

    def __init__(self, estimator, y, u, hindsight: Hindsight, lag, time=None):
        self.estimator, self.y, self.u, self.lag = estimator, y.copy(), u.copy(), lag
        self.hindsight, fit = hindsight, hindsight.fit
        self.time = np.asarray(estimator.dt * np.arange(len(y)) if time is None else time, float)
        if self.time.shape != self.y.shape:
            raise InputError(f"time must be ({len(y)},) like y, got shape {self.time.shape}")
        self.parameters, self.is_used = hindsight.parameters, hindsight.is_used
        self.filtered, self.filtered_std = hindsight.filtered, hindsight.filtered_std
        self.parameters_std = np.sqrt(hindsight.packed[:, diagonal(self.parameters.shape[1])])
        self.drift, self.nvr, self.sigma2, self.loglik = fit.likelihood.drift, fit.nvr, fit.s2, fit.loglik
        self.q = self.nvr * self.sigma2 * fit.likelihood.unit
        self.noise_std = math.sqrt(self.sigma2)
        self.logliks = hindsight.logliks
        self.jumps = [self._jump(step) for step in hindsight.steps]

    def _jump(self, step: Step) -> Jump:
        which = int(np.argmax(np.abs(step.size) / np.maximum(step.std, 1e-300)))
        sizes, stds = (dict(zip(self.names, numbers.tolist())) for numbers in (step.size, step.std))
        name, odds = self.names[which], math.exp(min(step.log_odds, 700.0))
        return Jump(step.sample, float(self.time[step.sample]), name, sizes[name], stds[name], odds, sizes, stds)

    def __len__(self):
        return len(self.y)

    def _repr_html_(self):
        last = zip(self.names, self.parameters[-1], self.parameters_std[-1])
        return markup(self.words, parameters=list(last))

    def __repr__(self):
        return self.words

    @property
    def names(self) -> list[str]:
        """Names of the parameter columns."""
        return self.estimator.names

    @property
    def memory(self) -> np.ndarray:
        """How many samples teach about each parameter, (n,): 1/sqrt(NVR), of an integrated walk NVR^(-1/4)."""
        with np.errstate(divide="ignore"):
            return self.nvr ** (-0.5 if self.drift == "walk" else -0.25)

    @property
    def covariance(self) -> np.ndarray:
        """Covariance of the parameters at each sample, (T, n, n)."""
        return unpack(self.hindsight.packed, self.parameters.shape[1])

    @cached_property
    def separability(self) -> Separability:
        """Whether the record can tell the drifts from none, from the noise and from each other."""
        return separability(self.hindsight, self.names)

    @property
    def words(self) -> str:
        """The record in hindsight, one plain paragraph."""
        return paragraph(self)

    def columns(self) -> dict[str, np.ndarray]:
        """Return the columns by name: time, y, u, parameters, their deviations, and the filtered ones."""
        u = {f"u{i + 1}" if self.u.shape[1] > 1 else "u": c for i, c in enumerate(self.u.T)}
        table = {"time": self.time, "y": self.y, **u}
        for suffix, values in (
            ("", self.parameters), ("_std", self.parameters_std),
            ("_filtered", self.filtered), ("_filtered_std", self.filtered_std),
        ):  # fmt: skip
            table |= {f"{name}{suffix}": c for name, c in zip(self.names, values.T)}
        return {name: np.ascontiguousarray(c) for name, c in table.items()}

    def to_frame(self, backend: str = "pandas") -> Any:
        """Return the columns as a data frame of "pandas", "polars" or "pyarrow" (through narwhals)."""
        return as_frame(self.columns(), backend)

    def plot(self, **options) -> Any:
        """Draw each parameter with its 2-sigma band, the filtered one thin, the jumps; return the Axes."""
        return verbs.call("plot", self, **options)
