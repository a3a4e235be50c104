"""What a run of several outputs amounts to: each output's fit and calibration, the model, links between the noises."""

from __future__ import annotations

import math
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from .numbers import finite
from .summary import ModelSummary, Summary
from .whiteness import LEAST, Nis, Whiteness

LINKED = 0.2  # correlation of two noises from which error bars across outputs suffer
SURE = 4.0  # ... if it lies so many of its standard deviations from zero


class OutputSummary(NamedTuple):
    """Numbers of one output; each is what `Summary` means by it."""

    fit: float
    rmse: float
    noise_std: float
    nis: float
    nis_interval: Nis
    coverage: float
    whiteness: Whiteness
    observed: int
    missing: int
    rejected: int
    bad_values: int
    jumps: int
    happened: dict[str, tuple[int, float]]
    drift: Any  # `Speeds`, or None


class SummaryMIMO(ModelSummary):
    """Numbers of a run of `JointMIMO` or `ARXMIMO`; add one trace after the other, memory does not grow.

    What `Summary` says of one output, ``outputs`` says of each; the first ``settle`` samples of an output (by default
    two for each unknown of its equation) are left out there.

    Examples
    --------
    >>> import driftwise as dw
    >>> truth = [-1.2, 0.5, -0.1, 1.0, 0.5, 0.2, -0.8, 0.3, 0.4]
    >>> y, u = dw.models.simulate_mimo((2, 1), truth, samples=1500, inputs=1, noise_std=(0.1, 0.3), seed=1)
    >>> summary = dw.JointMIMO((2, 1), inputs=1).scaled_to(y, u).scan(y, u).summary()
    >>> [round(one.noise_std, 2) for one in summary.outputs], summary.linked
    ([0.1, 0.3], [])
    """

    def __init__(self, estimator, settle: int | None = None):
        super().__init__(estimator)
        p, own = estimator.model.outputs, estimator.unknowns
        self._parts = [Summary(estimator, 2 * own[i] if settle is None else settle) for i in range(p)]
        self._products, self._squares, self._pairs = np.zeros((3, p, p))

    def add(self, trace: Any) -> SummaryMIMO:
        """Take in one more stretch of the run."""
        self.state = trace.state
        self._forget()
        self.samples += len(trace)
        z = np.full(trace.y.shape, np.nan)
        for i, (part, one) in enumerate(zip(self._parts, trace.outputs)):
            late = part.observed + np.cumsum(one.is_used) > part.settle
            scored = one.is_used & late & (one.variance > 0) & (one.dof >= LEAST)
            z[scored, i] = (one.innovation[scored] / np.sqrt(one.variance[scored])).clip(-4, 4)
            part.add(one)
        known = np.isfinite(z).astype(float)
        z = np.where(known > 0, z, 0.0)
        self._products += z.T @ z
        self._squares += (z * z).T @ known
        self._pairs += known.T @ known
        return self

    # --- each output ---------------------------------------------------------------------------------------

    @property
    def parts(self) -> list[Summary]:
        """What `Summary` says of the predictions of each output; parameters are those of all."""
        return list(self._parts)

    @property
    def outputs(self) -> list[OutputSummary]:
        """The numbers of each output."""
        return [
            OutputSummary(
                s.fit, s.rmse, float(noise), s.nis, s.nis_interval, s.coverage, s.whiteness, s.observed,
                s.missing_outputs, s.rejected, s.bad_values, s.jumps, s.happened, drift,
            )
            for s, noise, drift in zip(self._parts, self.noise_std, self._drifts)
        ]  # fmt: skip

    @property
    def _drifts(self):
        est = self.estimator
        return est.drift_of(self.state) or [None] * est.outputs

    @property
    def noise_std(self) -> np.ndarray:
        """Standard deviation of the noise w_n of each output, given or learnt, (p,)."""
        return np.sqrt(np.diag(self.estimator.noise_covariance(self.state)))

    # --- between outputs -----------------------------------------------------------------------------------

    @property
    def correlation(self) -> np.ndarray:
        """Correlation of the innovations of different outputs at the same sample, (p, p); NaN without pairs."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return self._products / np.sqrt(self._squares * self._squares.T)

    @property
    def linked(self) -> list[tuple[int, int, float]]:
        """(i, j, r) of the outputs, counted from 1, whose innovations are correlated: beyond 0.2, and four std."""
        r, n = self.correlation, self._pairs
        return [
            (i + 1, j + 1, float(r[i, j]))
            for i, j in combinations(range(len(r)), 2)
            if n[i, j] >= LEAST and abs(r[i, j]) > max(LINKED, SURE / math.sqrt(n[i, j]))
        ]

    @property
    def noise_covariance(self) -> np.ndarray:
        """Covariance of w_n (p, p): the R for a coupled run, once a split one has found noises linked.

        Learnt standard deviations and ``correlation``; of a coupled run that of its own noise.
        """
        if not self.estimator.is_split:
            return self.estimator.noise_covariance(self.state)
        r = np.nan_to_num(self.correlation)
        np.fill_diagonal(r, 1.0)
        return r * self.noise_std * self.noise_std[:, None]

    # --- the model -----------------------------------------------------------------------------------------

    @property
    def is_enough(self) -> bool:
        """Whether each output was measured more often than its equation has unknowns."""
        return all(s.observed > N for s, N in zip(self._parts, self.estimator.unknowns))

    @property
    def missing_inputs(self) -> int:
        """Samples at which an input was missing."""
        return self._parts[0].missing_inputs

    @property
    def parameters(self) -> list[tuple[str, float, float]]:
        """(name, value, standard deviation) of each parameter."""
        model = self.model
        std = self._bars(np.sqrt(np.diag(model.covariance)))
        return [(n, float(v), float(s)) for n, v, s in zip(model.names, model.values, std)]

    @property
    def gains(self) -> list[tuple[int, int, float, float]]:
        """(output, input, steady-state gain, standard deviation) of each pair, counted from 1."""
        gain, std = self.model.dc_gain, self._bars(self.model.dc_gain_std)
        return [(i + 1, l + 1, float(g), float(std[i, l])) for (i, l), g in np.ndenumerate(gain)]

    @property
    def notes(self) -> list[str]:
        """What to beware of between the outputs and in the poles, in words; empty where there is nothing."""
        if not self.is_enough:
            return []
        if self.estimator.is_split:
            found = [
                f"the noises of y{i} and y{j} are linked (r = {r:.2f}): {self.estimator.link_words}"
                for i, j, r in self.linked
            ]
        else:
            found = [
                f"the innovations of y{i} and y{j} are linked (r = {r:.2f}): the noise is not what was stated"
                for i, j, r in self.linked
            ]
        return found + [
            f"poles {i + 1} and {j + 1} are closer together than their error bars, which fail there"
            for i, j in self.model.close_poles
            if abs(self.model.poles[i] - self.model.poles[j].conj()) > 1e-9 or self.model.poles[i].imag == 0
        ]

    @property
    def words(self) -> str:
        """The run in a few plain sentences."""
        from .paragraphs import of_outputs

        return of_outputs(self)

    def as_dict(self) -> dict[str, Any]:
        """Return everything as plain numbers, ready for JSON (NaN becomes None)."""

        def plain(one: OutputSummary):
            interval = [one.nis_interval.low, one.nis_interval.high]
            happened = {name: {"samples": count, "last": when} for name, (count, when) in one.happened.items()}
            drift = None if one.drift is None else one.drift.as_dict()
            own = {name: value for name, value in one._asdict().items() if name != "happened"}
            return {**own, "nis_interval": interval, "whiteness": one.whiteness._asdict(), "drift": drift, **happened}

        model = self.model
        data = {
            "structure": list(model.form.nu), "is_split": self.estimator.is_split, "samples": self.samples,
            "missing_inputs": self.missing_inputs, "outputs": [plain(one) for one in self.outputs],
            "correlation": self.correlation.tolist(), "noise_covariance": self.noise_covariance.tolist(),
            "loglik": self.loglik,
            "parameters": [{"name": n, "value": v, "std": s} for n, v, s in self.parameters],
            "poles": [{"real": p.real, "imag": p.imag, "modulus": abs(p), "std": s} for p, s in self.poles],
            "dc_gain": [{"output": i, "input": l, "value": g, "std": s} for i, l, g, s in self.gains],
            "unlearned": [{"direction": d, "ratio": r} for d, r in self.unlearned],
            "notes": self.notes, "words": self.words,
        }  # fmt: skip
        return finite(data)
