"""What a run of an observer amounts to: when it was ready, how well it predicted, where it ended."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..kernel.status import Status


class ObserverSummary:
    """Numbers of a run; add one trace after the other, memory does not grow."""

    def __init__(self, estimator):
        self.estimator, self.state = estimator, estimator.start()
        self.samples = self.observed = self.missing_outputs = self.missing_inputs = self.bad_values = self.jumps = 0
        self.first_ready = math.nan  # its time
        self._ready, self._covered, self._nis = 0, 0, 0.0
        p = estimator.model.outputs
        self._squares, self._counts = np.zeros(p), np.zeros(p)

    def add(self, trace) -> ObserverSummary:
        """Take in one more stretch of the run."""
        status, T = trace.status.reshape(len(trace), -1), len(trace)
        self.samples, self.state = self.samples + T, trace.state
        self.missing_outputs += int(np.count_nonzero(status & int(Status.MISSING_OUTPUT)))
        self.bad_values += int(np.count_nonzero(status & int(Status.BAD_VALUE)))
        self.missing_inputs += int(np.count_nonzero(status[:, 0] & int(Status.MISSING_INPUT)))
        self.jumps += int(np.count_nonzero(status[:, 0] & int(Status.JUMP)))
        ready = np.flatnonzero(trace.ready)
        if len(ready) and math.isnan(self.first_ready):
            self.first_ready = float(trace.time[ready[0]])
        self._ready += len(ready)
        e = trace.innovation.reshape(T, -1)
        self._squares += np.nansum(e * e, axis=0)
        self._counts += np.count_nonzero(~np.isnan(e), axis=0)
        scored = ~np.isnan(e) & np.isfinite(trace.variance.reshape(T, -1))
        self.observed += int(np.count_nonzero(scored))
        self._nis += float(np.sum(e[scored] ** 2 / trace.variance.reshape(T, -1)[scored]))
        self._covered += int(np.count_nonzero(abs(e[scored]) <= trace.band().reshape(T, -1)[scored]))
        return self

    @property
    def ready(self) -> float:
        """Share of the samples with an estimate."""
        return self._ready / self.samples if self.samples else math.nan

    @property
    def rmse(self) -> np.ndarray:
        """Root mean square one-step prediction error of each output, (p,)."""
        return np.sqrt(
            np.divide(self._squares, self._counts, out=np.full(len(self._counts), np.nan), where=self._counts > 0)
        )

    @property
    def nis(self) -> float:
        """Mean normalised innovation squared; 1 where plant and noise are as stated."""
        return self._nis / self.observed if self.observed else math.nan

    @property
    def coverage(self) -> float:
        """Share of outputs inside their 95 % prediction band."""
        return self._covered / self.observed if self.observed else math.nan

    @property
    def loglik(self) -> float:
        """Log likelihood of the outputs from the first that was predicted."""
        return self.estimator.loglik(self.state)

    @property
    def estimates(self) -> list[tuple[str, float, float]]:
        """(name, value, standard deviation) of states, disturbances and derived outputs at the end."""
        form = self.estimator.model
        values, std = self.estimator.estimate(self.state)
        return [(n, float(v), float(s)) for n, v, s in zip(form.state_names + form.names, values, std)]

    @property
    def words(self) -> str:
        """The run in a few plain sentences."""
        told = [f"{self.samples} samples."]
        if self.missing_outputs or self.missing_inputs:
            told.append(f"{self.missing_outputs} outputs and {self.missing_inputs} inputs missing.")
        if math.isnan(self.first_ready):
            told.append("Never ready: too few samples, or the tolerance was not met.")
        else:
            told.append(f"Ready at {self.first_ready:g} s, for {100 * self.ready:.3g} % of the samples.")
        if self.observed:
            names = self.estimator.model.output_names
            errors = ", ".join(f"{name} {error:.3g}" for name, error in zip(names, self.rmse))
            told.append(
                f"One-step error {errors}; NIS {self.nis:.2f}; 95 % bands hold {100 * self.coverage:.1f} % of the outputs."
            )
        if self.jumps:
            told.append(f"{self.jumps} alarms.")
        ended = [f"{name} {value:.4g} (std {std:.2g})" for name, value, std in self.estimates if math.isfinite(std)]
        if ended:
            told.append(f"At the end: {', '.join(ended)}.")
        return " ".join(told)

    def as_dict(self) -> dict[str, Any]:
        """Return everything as plain numbers, ready for JSON (NaN becomes None)."""

        def finite(value):
            return value if math.isfinite(value) else None

        return {
            "samples": self.samples, "observed": self.observed, "missing_outputs": self.missing_outputs,
            "missing_inputs": self.missing_inputs, "bad_values": self.bad_values, "jumps": self.jumps,
            "ready": finite(self.ready), "first_ready": finite(self.first_ready),
            "rmse": [finite(float(v)) for v in self.rmse], "nis": finite(self.nis), "coverage": finite(self.coverage),
            "loglik": finite(self.loglik),
            "estimates": [{"name": n, "value": finite(v), "std": finite(s)} for n, v, s in self.estimates],
            "words": self.words,
        }  # fmt: skip
