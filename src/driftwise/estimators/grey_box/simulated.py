"""What a plant in formulas does with given parameters, beside the filter that learns them: `simulate`."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from ...engine import validation
from ...engine.errors import InputError
from .transform import to_units, transformed


class Simulated:
    """`simulate`, and parameters by name, for a filter of a plant in formulas."""

    formulas: Any
    model: Any
    options: dict[str, Any]
    dt: float
    outputs: int | None
    prior_covariance: np.ndarray
    _s0: np.ndarray

    @cached_property
    def names(self) -> list[str]:
        """Names of the parameters, in the order of ``state["theta"]``."""
        return self.formulas.names

    @cached_property
    def bare(self) -> Any:
        """The same filter of one thing that is known: no start, memory, gate or scale, noise as a state says."""
        outputs = tuple(replace(one, noise=one.noise or 1.0) for one in self.formulas.outputs_)
        kind: Any = type(self)
        return kind(replace(self.formulas, outputs_=outputs), method=self.options["method"], start=None, dt=self.dt)

    def simulate(self, u=None, parameters=None, *, samples: int | None = None, x0=None, time=None, noise=None, seed=0):
        """Return outputs (T,) or (T, p) of the plant with given parameters and inputs that are held, and noise.

        Parameters
        ----------
        u : (T,) or (T, k) inputs; omitted where there are none
        parameters : numbers by name, in their units; others are at their start
        samples : T, where there are no inputs
        x0 : (n,) state at first; the start's if omitted
        time : (T,) instants in seconds; steps of dt if omitted
        noise : deviation of each output's noise; what the formulas say, or none, if omitted
        seed : of the noise
        """
        n, p = self.model.n, self.model.outputs
        u = validation.inputs_to_come(u, samples, self.model.inputs)
        state = self.bare.start()
        state["theta"], state["D"] = self.transformed(parameters), 0.0
        state["x"] = self._s0[:n] if x0 is None else validation.vector("x0", np.atleast_1d(x0), n)
        nothing = np.full((len(u), p) if self.outputs else len(u), np.nan)
        given = u if self.model.inputs else None
        y = self.bare.scan(nothing, given, state=state, time=time, keep="innovations").prediction
        stated = [one.noise or 0.0 for one in self.formulas.outputs_] if noise is None else noise
        std = validation.each("noise", stated, p)
        v = std * np.random.default_rng(seed).standard_normal((len(u), p))
        return y + (v if self.outputs else v[:, 0])

    def likely(self, rng) -> dict[str, float]:
        """Return parameters in their units by name, drawn from what is believed beforehand, half as wide."""
        n = self.model.n
        theta = self._s0[n:] + 0.5 * np.sqrt(np.diag(self.prior_covariance))[n:] * rng.standard_normal(len(self.names))
        return dict(zip(self.names, to_units(self.formulas.free, theta)[0].tolist()))

    def transformed(self, parameters=None) -> np.ndarray:
        """Return numbers by name, in their units, as they are estimated; others are at their start."""
        found, known = self._s0[self.model.n :].copy(), parameters or {}
        for name, value in known.items():
            if name not in self.names:
                raise InputError(f"{name!r} is none of the parameters: they are {', '.join(self.names)}")
            found[self.names.index(name)] = transformed(self.formulas.free[self.names.index(name)], value)
        if not np.isfinite(found).all():
            bad = self.names[int(np.argmin(np.isfinite(found)))]
            raise InputError(f"{bad} = {known[bad]!r} is not within its bounds")
        return found
