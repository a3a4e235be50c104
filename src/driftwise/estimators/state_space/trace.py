"""The trace of a filter with the user's matrices."""

from __future__ import annotations

import numpy as np

from ...results.observer_trace import ObserverTrace
from ...results.trace import Trace


class StateTrace(ObserverTrace):
    """Columns of one run, time first: predictions given the samples before, states given those up to t."""

    is_used = Trace.is_used

    @property
    def nis(self) -> np.ndarray:
        """Squared innovations of all outputs that were taken in, e' S^-1 e: as many as these on average, (T,)."""
        return self.table[:, self.estimator.columns["nis"].start]

    @property
    def log_density(self) -> np.ndarray:
        """Log density of what was taken in, given the samples before; its sum is the evidence, (T,)."""
        return self.table[:, self.estimator.columns["density"].start]

    def columns(self) -> dict[str, np.ndarray]:
        """Return the columns by name, under the system's own names."""
        more = {"nis": np.ascontiguousarray(self.nis), "log_density": np.ascontiguousarray(self.log_density)}
        return {**super().columns(), **more}
