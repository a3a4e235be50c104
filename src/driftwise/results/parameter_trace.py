"""The trace of an estimator of parameters: with them, their deviations, and what happened to them."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from ..engine.errors import InputError
from ..engine.validation import count
from ..models.quantities import derive, derived_columns
from . import verbs
from .bands import unpack
from .events import Event, Events, events_of, jumps_of
from .output import outputs_of
from .trace import KEEP, Trace


class ParameterTrace(Trace):
    """Columns of one run, time first; what each one means stands in ``docs/conventions.md``.

    ``prediction``, ``innovation`` and ``variance`` belong to y(t) given the samples before it; ``x`` and
    ``parameters`` to x(t) and theta given the samples up to t. ``state`` continues where the trace ends.

    With several outputs (`JointMIMO`, `ARXMIMO`) those of y_i(t) are given the samples before t *and* y_1(t) ..
    y_{i-1}(t) where these tell about it (an output acting at once, or correlated noise), so innovations of different
    outputs are independent where the noise is as stated.

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-0.8], [1.0], samples=400, noise_std=0.1, seed=1)
    >>> trace = dw.ARX(1, 1).scan(y, u)
    >>> trace.names, trace.parameters.shape, trace.parameters_std[-1].round(3).tolist()
    (['a1', 'b1'], (400, 2), [0.002, 0.006])
    """

    @property
    def weight(self) -> np.ndarray:
        """Effective number of samples behind the estimate, 1/gain, (T,) or (T, p)."""
        return self._column("weight")

    @property
    def statistic(self) -> np.ndarray:
        """The detector's statistic relative to its threshold: 1 and more is an alarm, (T,) or (T, p)."""
        return self._column("statistic")

    def _kept(self, first, size, least):
        """Return columns after those of the outputs."""
        if KEEP.index(self.keep) < KEEP.index(least):
            raise InputError(f"this trace kept {self.keep!r} only; run scan(..., keep={least!r})")
        first += self.estimator.n_columns
        return self.table[:, first : first + size]

    @property
    def x(self) -> np.ndarray:
        """State x(t) given the samples up to t, measured state first, (T, n)."""
        return self._kept(0, self.estimator.model.n, "means")

    @property
    def parameters(self) -> np.ndarray:
        """Parameters in the order of ``names``, (T, m)."""
        model = self.estimator.model
        return self._kept(model.n, model.N - model.n, "means")

    @cached_property
    def names(self) -> list[str]:
        """Names of the parameter columns."""
        return self.estimator.names

    @property
    def state_names(self) -> list[str]:
        """Names of the columns of ``x``."""
        return self.estimator.state_names

    @property
    def _std(self):
        N = self.estimator.model.N
        if self.keep == "covariance":
            return np.sqrt(np.einsum("tii->ti", self.covariance).clip(0))
        return self._kept(N, N, "std")

    @property
    def x_std(self) -> np.ndarray:
        """Standard deviations of ``x``, (T, n)."""
        return self._std[:, : self.estimator.model.n]

    @property
    def parameters_std(self) -> np.ndarray:
        """Standard deviations of ``parameters``, (T, m)."""
        return self._std[:, self.estimator.model.n :]

    @property
    def covariance(self) -> np.ndarray:
        """Covariance of [x ; parameters], (T, N, N); needs keep="covariance"."""
        N = self.estimator.model.N
        return unpack(self._kept(N, N * (N + 1) // 2, "covariance"), N)

    @property
    def has_bars(self) -> bool:
        """Whether the trace kept parameters with their deviations."""
        return self.keep in ("std", "covariance")

    def columns(self) -> dict[str, np.ndarray]:
        """Return the columns by name, as `to_frame` and the command line write them.

        With several outputs those of each end in its number (prediction.2), and states are x{k}.{output}.
        """
        table, names = super().columns(), self.state_names + self.names
        if self.keep != "innovations":
            table |= dict(zip(names, np.hstack([self.x, self.parameters]).T))
        if self.has_bars:
            table |= dict(zip([f"{name}_std" for name in names], np.hstack([self.x_std, self.parameters_std]).T))
        return {name: np.ascontiguousarray(c) for name, c in table.items()}

    # --- what happened -------------------------------------------------------------------------------------

    @property
    def outputs(self) -> list[Any]:
        """The columns of each output, (T,) each, under the names that the trace of one output has."""
        return [self] if self.estimator.outputs is None else outputs_of(self)

    @property
    def odds(self) -> float | None:
        """The odds at which a memory that weighs explanations tells a jump (statistic 1); None where none does."""
        return self.estimator.odds

    @property
    def watches(self) -> str:
        """What tells the jumps: the "width" or the "level" of the innovations, or "", the memory itself."""
        return self.estimator.watches

    def events(self, limit: int = 10_000) -> list[Event]:
        """Return what happened besides ordinary samples, in order, at most ``limit`` entries.

        A run of the same thing is one event; with several outputs the text names the one.
        """
        return self._of_each(events_of, limit)

    def jumps(self, limit: int = 10_000) -> list[Event]:
        """Return an event for each alarm: when, about what, since when, on what evidence."""
        return self._of_each(jumps_of, limit)

    def alarm(self, k):
        """Return statistic, since and which of the detector, None where the estimator does not write them."""
        at = self.estimator.columns
        return self.table[k, at["statistic"].start : at["which"].stop] if "which" in at else None

    def _of_each(self, listed, limit) -> list[Event]:
        if self.estimator.outputs is None:
            return listed(self, limit)
        found = [_of_output(event, i) for i, one in enumerate(self.outputs) for event in listed(one, limit)]
        return Events(sorted(found, key=lambda event: event.sample)[:limit])

    # --- results -------------------------------------------------------------------------------------------

    def model(self, at: int = -1) -> Any:
        """Return the model at a sample (the last by default), with the covariance of its parameters.

        Sample -1 uses the final state; any other needs keep="covariance", or "std" for a diagonal one.
        """
        est, n = self.estimator, self.estimator.model.n
        if at in (-1, len(self) - 1):
            return est.model_of(self.state)
        is_full = self.keep == "covariance"
        P = self.covariance[at, n:, n:] if is_full else np.diag(self.parameters_std[at] ** 2)
        return est.model_at(self.parameters[at].copy(), P)

    def derived(self, quantities, every: int = 1) -> dict[str, np.ndarray]:
        """Return what follows from the parameters along a record, with bars; needs keep="covariance".

        Columns ``name``, ``name_std``, ``name_low`` and ``name_high``, (T,) each, of every ``every``-th sample from the
        first on; ``est.derived`` is the same of one state.

        Examples
        --------
        >>> import driftwise as dw
        >>> y, u = dw.simulate([-0.8], [1.0], samples=500, noise_std=0.1, seed=1)
        >>> trace = dw.ARX(1, 1).scan(y, u, keep="covariance")
        >>> list(trace.derived({"gain": lambda p: p["b1"] / (1 + p["a1"])}, every=100))
        ['gain', 'gain_std', 'gain_low', 'gain_high']
        """
        n, every = self.estimator.model.n, count("every", every)
        P = self.covariance[::every, n:, n:]
        rows = zip(self.parameters[::every], P)
        return derived_columns([derive(self.names, theta, one, quantities) for theta, one in rows])

    def predict(self, u=None, horizon: int | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Return mean (h,) and standard deviation (h,) of the outputs that follow, given the inputs to come."""
        return self.estimator.predict(self.state, u, horizon)

    def summary(self) -> Any:
        """Return the constant-memory `Summary` of this trace; `SummaryMIMO` where it has several outputs."""
        from .output_summary import SummaryMIMO
        from .summary import Summary

        return (Summary if self.estimator.outputs is None else SummaryMIMO)(self.estimator).add(self)

    def diagnose(self):
        """Return verdicts on this run, each a number, a threshold and what to do: a `Diagnosis`, to be printed.

        NIS, coverage and whiteness of the predictions (thresholds: 99 %, and no closer than matters in practice),
        excitation, identifiability, stability (99 %), drift against jump (odds of 100:1), the age of the last news
        about a parameter, and missing, rejected and saturated samples where there are any. With several outputs, and of
        an observer, those on the predictions of each.

        Notes
        -----
        Where nothing is wrong a verdict of chance fails in at most one run of a hundred. Drift and jumps are weighed
        where the memory is ``Constant``; other memories say themselves what they found. Bad at: several faults at once,
        each of which may look like the others, and records of fewer samples than twenty times the unknowns.

        Examples
        --------
        >>> import numpy as np, driftwise as dw
        >>> b = np.where(np.arange(600)[:, None] < 400, [1.0, 0.5], [2.0, 0.5])
        >>> y, u = dw.simulate([-1.5, 0.7], b, samples=600, noise_std=0.1, seed=1)
        >>> trace = dw.ARX(2, 2).scaled_to(y, u).scan(y, u)
        >>> found = trace.diagnose()
        >>> [verdict.name for verdict in found.not_fine]
        ['NIS', 'coverage', 'whiteness', 'drift or jump']
        >>> print(found.find("drift or jump").advice)
        the parameters jumped, b1 by +1 at sample 401 (odds beyond a million to one against drift): try
        memory=RestartOnChange() or AutoMemory()
        """
        return verbs.call("diagnose", self)

    def validate(self, inputs=None):
        """Hold the model against what an engineer asks of it before it is used: a `Validation`, to be printed.

        Innovations: their autocorrelation; of each input a delay that explains the record better, what they owe to it
        (a missing lag), whether it follows the output (feedback); squares that explain them (a plant that is not
        linear). Each is named with its remedy, at a level of 1 %. Then the model of the first two thirds, held, 1, 5
        and 25 samples ahead and from the inputs alone, on these and on the last third; step and frequency response
        with bands; poles with time constant, damping and Hz.

        Parameters
        ----------
        inputs : sequence of str, optional
            What to call the inputs.

        Notes
        -----
        Recursive innovations of the right model are white and owe nothing to past inputs, so no degree of freedom is
        taken off (Ljung 1999, ch. 16 is about residuals of a fit). A correlation below 0.05 is no matter, however long
        the record. ``docs/validation.md`` has what is told falsely and what is seen, on drawn plants.

        Bad at: inputs that move a few times only (nothing is told by them), odd nonlinearities such as a saturation
        either side, several faults at once, and coloured noise under an ARX, which may look like each of them.

        Examples
        --------
        >>> import numpy as np, driftwise as dw
        >>> u = np.random.default_rng(1).standard_normal(800)
        >>> y, u = dw.simulate([-0.8], [1.0], u=u, samples=800, noise_std=0.5, seed=2)
        >>> y = np.concatenate([np.zeros(4), y[:-4]])  # the sensor is late
        >>> found = dw.ARX(1, 1, 1).scaled_to(y, u).scan(y, u).validate()
        >>> print(found.verdicts.find("delay").advice)
        wrong delay: u acts after 5 samples, and the model says 1 (odds beyond a million to one): take nk = 5
        """
        return verbs.call("validate", self, inputs)

    def what_changed(self, event, samples: int = 100):
        """Return which parameter no longer fits after a jump: a `ScoreTest` of the samples since it began.

        Parameters
        ----------
        event : one of ``jumps()``, or a sample: the first one after the change
        samples : how many samples to judge by

        Notes
        -----
        The parameters from before are held, and each one's score is taken raw (`score_test`): more than nine in ten
        runs of ARX(2, 2) name the right one, which the detector, in a hurry, cannot. Bad at: fewer samples than
        parameters, and several that changed at once. For least squares, prediction error, pseudolinear regression.

        Examples
        --------
        >>> import numpy as np, driftwise as dw
        >>> a = np.where(np.arange(2000)[:, None] < 1500, [-1.5, 0.7], [-1.45, 0.7])
        >>> y, u = dw.simulate(a, [1.0, 0.5], samples=2000, noise_std=0.1, seed=1)
        >>> trace = dw.ARX(2, 2, memory=dw.RestartOnChange()).scaled_to(y, u).scan(y, u)
        >>> trace.jumps()[0].text
        'jump: the innovations widened, it began about 2 samples ago (statistic 1.06 times its threshold)'
        >>> trace.what_changed(trace.jumps()[0])
        chi2 = 1080.0 on 4 degrees of freedom (p = 1.6e-232); most of all a1 up (+32.7 sd)
        """
        if isinstance(event, Event):
            event = event.sample if event.since is None else event.since
        return verbs.call("what_changed", self, event, samples)

    def state_before(self, sample: int):
        """Return the state just before a sample, bit for bit as it was: replay an event from there."""
        if not count("sample", sample) < len(self):
            raise InputError(f"sample must lie between 0 and {len(self) - 1}, got {sample!r}")
        if self.begun is None:
            raise InputError("a trace that was read back does not know the state it began with: run it again")
        u = self.u[:sample] if self.u.shape[1] else None
        time = self.time[:sample] if self.is_stamped else None
        return self.estimator.scan(self.y[:sample], u, time=time, state=self.begun, keep="innovations").state


def _of_output(event, i):
    return replace(event, text=f"output {i + 1}: {event.text}")
