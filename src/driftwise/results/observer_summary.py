"""What a run of an observer amounts to: the last estimates, since when they are ready, and how well outputs fit."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..models.markup import markup
from .numbers import finite
from .summary import Summary
from .whiteness import Nis


class ObserverSummary:
    """Numbers of a run of an observer; add one trace after the other, memory does not grow.

    ``outputs`` holds a `Summary` of the one-step predictions of each output. Those of a finite window are slightly
    correlated even where the plant is right, so no verdict on whiteness is given for one.
    """

    too_small = "the plant, the disturbances or noise_std are not what was stated"
    too_large = "noise_std or a walk was stated too large"

    def __init__(self, estimator):
        self.estimator = estimator
        form = estimator.model
        self.outputs = [Summary(estimator, 0) for _ in range(form.outputs)]
        self.names = form.state_names + form.names
        self.state = estimator.start()
        self.samples = self.unready = self.jumps = 0
        self.first_ready = self.last_jump = math.nan  # seconds
        self.last, self.last_std = np.full((2, len(self.names)), np.nan)
        self._begin = math.nan

    def add(self, trace: Any) -> ObserverSummary:
        """Take in one more stretch of the run."""
        if not len(trace):
            return self
        self.state = trace.state
        if not self.samples:
            self._begin = float(trace.time[0])
        for part, one in zip(self.outputs, trace.outputs):
            part.add(one)
        ready = trace.ready
        if ready.any():
            if math.isnan(self.first_ready):
                self.first_ready = float(trace.time[np.argmax(ready)])
            if trace.keep == "std":
                at = np.flatnonzero(ready)[-1]
                self.last, self.last_std = trace.estimates[at].copy(), trace.std[at].copy()
        self.samples += len(trace)
        self.unready += int(np.count_nonzero(~ready))
        found = trace.jumps()
        if found:
            self.jumps, self.last_jump = self.jumps + len(found), found[-1].time
        return self

    @property
    def estimates(self) -> list[tuple[str, float, float]]:
        """(name, value, standard deviation) of each state, disturbance and derived output, the last that was ready."""
        return [(name, float(v), float(s)) for name, v, s in zip(self.names, self.last, self.last_std)]

    @property
    def ready(self) -> float:
        """Share of the samples with an estimate."""
        return 1 - self.unready / self.samples if self.samples else math.nan

    @property
    def loglik(self) -> float:
        """Log likelihood of the outputs from the first that was predicted; NaN for the theorem, which has none."""
        return self.estimator.loglik(self.state)

    @property
    def settling(self) -> float:
        """Seconds from the first sample to the first estimate."""
        return self.first_ready - self._begin

    @property
    def nis(self) -> list[Nis]:
        """Mean normalised innovation squared of each output, and the interval that should hold it."""
        return [part.nis_interval for part in self.outputs]

    def __str__(self):
        return self.words

    def __repr__(self):
        return f"ObserverSummary({self.samples} samples of {self.estimator!r})"

    def _repr_html_(self):
        return markup(self.words)

    @property
    def words(self) -> str:
        """The run in a few plain sentences."""
        if not self.samples:
            return "0 samples."
        if math.isnan(self.first_ready):
            return (
                f"No estimate was ready in {self.samples} samples: fewer than there are unknowns, or deviations above "
                "the tolerance."
            )
        said = [f"The first estimate was ready after {self.settling:.3g} s."]
        if self.ready < 0.99:
            said.append(f"In {100 * (1 - self.ready):.0f} % of the samples there was none.")
        for name, nis in zip(self.estimator.model.output_names, self.nis):
            if not nis.samples:
                continue
            size = math.sqrt(nis.value)
            if not size:
                said.append(
                    f"{name} is predicted without any error: is the sensor stuck, or the record no measurement?"
                )
            elif nis.is_consistent or abs(size - 1) < 0.05:
                said.append(f"{name} is predicted as well as the plant and the noise say (NIS {nis.value:.2f}).")
            else:
                more, why = ("larger", self.too_small) if size > 1 else ("smaller", self.too_large)
                said.append(
                    f"{name}: prediction errors are {max(size, 1 / size):.2g} times {more} than stated (NIS "
                    f"{nis.value:.2g}): {why}, and so are the error bars."
                )
        missing = self.outputs[0].missing_inputs
        if missing:
            said.append(f"In {missing} samples an input was missing and held; the error bars do not know of it.")
        if self.jumps:
            said.append(f"The plant changed or a fault began: {self.jumps} alarms, the last at {self.last_jump:g} s.")
        return " ".join(said)

    def as_dict(self) -> dict[str, Any]:
        """Return everything as plain numbers, ready for JSON (NaN becomes None)."""
        names = self.estimator.model.output_names
        return finite({
            "samples": self.samples, "ready": self.ready, "first_ready": self.first_ready, "settling": self.settling,
            "missing_inputs": self.outputs[0].missing_inputs, "jumps": self.jumps, "last_jump": self.last_jump,
            "loglik": self.loglik,
            "outputs": [
                {
                    "name": name, "observed": s.observed, "missing": s.missing_outputs, "rmse": s.rmse, "fit": s.fit,
                    "nis": s.nis, "nis_interval": [s.nis_interval.low, s.nis_interval.high], "coverage": s.coverage,
                }
                for name, s in zip(names, self.outputs)
            ],
            "estimates": [{"name": n, "value": v, "std": s} for n, v, s in self.estimates],
            "words": self.words,
        })  # fmt: skip
