"""What a forecast amounts to, accumulated in constant memory."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..models.quantities import NORMAL_95
from ..results.bands import normal_score, sides
from ..results.parameter_trace import ParameterTrace
from ..results.verdicts import Diagnosis
from ..results.whiteness import Correlations, score, verdict
from .forecast_verdicts import LEVEL, coverage_verdict, nis_verdict, unsaid, whiteness_verdict


class Own:
    """The forecast that one estimator makes, in the numbers that a model average has: deviates of its density."""

    def __init__(self, trace: ParameterTrace):
        self.y, self.innovation, self.variance = trace.y, trace.innovation, trace.variance
        self.is_used = np.isfinite(trace.innovation)
        self.normal_score = np.full(len(trace), math.nan)
        self.normal_score[self.is_used] = normal_score(*_sides(trace, self.is_used))
        self.log_score = np.full(len(trace), math.nan)

    def __len__(self):
        return len(self.y)


def _sides(trace: ParameterTrace, use) -> list[np.ndarray]:
    """Return the probability below and above the outputs ``use``, (2, T)."""
    scale = np.sqrt(trace.variance)[:, None]
    parts = trace.mixture() if trace.is_mixture else (np.ones_like(scale), np.zeros_like(scale), scale, trace.dof)
    return sides(trace.innovation[use], *(part[use] for part in parts))


class ForecastSummary:
    """Numbers of a forecast; add one piece after the other. The first ``settle`` samples do not count."""

    def __init__(self, settle: int = 0):
        self.settle, self.samples, self.count = settle, 0, 0
        self._mean = self._m2 = self._squares = self._log = 0.0
        self._nis, self._spread, self._held = 0.0, 0.0, 0
        self._lags = Correlations()

    def __repr__(self):
        return f"{type(self).__name__}({self.samples} samples)"

    def add(self, trace: Any) -> ForecastSummary:
        """Take in one more piece, an `AverageTrace` or an `Own`."""
        late = self.samples + np.arange(len(trace)) >= self.settle
        self.samples += len(trace)
        used = trace.is_used & late
        y, e, z = trace.y[used], trace.innovation[used], trace.normal_score[used]
        if not len(y):
            return self
        delta, total = float(y.mean()) - self._mean, self.count + len(y)
        self._m2 += float(((y - y.mean()) ** 2).sum()) + delta * delta * self.count * len(y) / total
        self._mean += delta * len(y) / total
        self.count = total
        self._squares += float(e @ e)
        self._log += float(trace.log_score[used].sum())
        more, spread, _ = score(z, np.ones(len(z)), np.full(len(z), math.inf))
        self._nis, self._spread = self._nis + more, self._spread + spread
        self._held += int(np.count_nonzero(abs(z) <= NORMAL_95))
        self._lags.add(np.where(used, trace.normal_score, np.nan).clip(-4, 4))
        return self

    @property
    def rmse(self) -> float:
        """Root mean square error one step ahead."""
        return math.sqrt(self._squares / self.count) if self.count else math.nan

    @property
    def spread(self) -> float:
        """Standard deviation of the outputs: root mean square distance from their mean."""
        return math.sqrt(self._m2 / self.count) if self.count else math.nan

    @property
    def fit(self) -> float:
        """100 (1 - |e|/|y - mean y|), per cent."""
        return 100 * (1 - math.sqrt(self._squares / self._m2)) if self._m2 > 0 else math.nan

    @property
    def nis(self) -> float:
        """Mean square of the normal scores, 1 where the bars are right: that which the verdict is on."""
        return self._nis / self.count if self.count else math.nan

    @property
    def coverage(self) -> float:
        """Share of outputs within their 95 % band."""
        return self._held / self.count if self.count else math.nan

    @property
    def log_score(self) -> float:
        """Mean log density given to the outputs."""
        return self._log / self.count if self.count else math.nan

    @property
    def verdicts(self) -> Diagnosis:
        """NIS, coverage and whiteness as verdicts."""
        found = verdict(self._nis, self._spread, self.count, LEVEL)
        return Diagnosis(
            [
                nis_verdict(found, is_tunable=False),
                coverage_verdict(self.coverage, self.count),
                whiteness_verdict(self._lags.whiteness, self.count, least=unsaid(self.fit)),
            ]
        )
