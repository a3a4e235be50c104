"""What a model average said at every sample of a record."""

from __future__ import annotations

import math

import numpy as np

from ...engine.status import Status
from ...models.markup import columns, markup
from ...results.bands import half_width, normal_score, share_within, sides
from ...results.trace import Trace
from . import step


class AverageTrace(Trace):
    """Columns of one run of a `ModelAverage`, time first.

    ``prediction``, ``innovation``, ``variance`` (of the prediction error) and the density belong to y(t) given the
    samples before it; ``weights`` are those of the prediction. The density is that by likelihood; where the prediction
    is not its centre, because another mean has smaller squared errors, the band about it is wider; ``variance`` is what
    squared errors of the prediction have been beside what members claim and how far they disagree. ``state`` continues
    where the trace ends.

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-0.8], [1.0], samples=400, noise_std=0.1, seed=1)
    >>> trace = dw.ModelAverage([dw.ARX(1, 1), dw.ARX(2, 2)]).scaled_to(y, u).scan(y, u)
    >>> trace.leader, trace.weights.shape
    ('ARX(na=1)', (400, 5))
    """

    def __repr__(self):
        return f"AverageTrace({len(self)} samples, {self.leader} leads)"

    def _repr_html_(self):
        weights = self.weights[-1].tolist() if len(self) else []
        return markup(repr(self)) + columns({"member": self.names, "weight": weights})

    def _times(self, samples: int) -> np.ndarray:
        """Return the instants of samples that came without any: the members count samples, an average does not."""
        return self.dt * np.arange(samples)

    @property
    def log_score(self) -> np.ndarray:
        """Log density that the forecast gave to y(t); NaN where it is missing, (T,)."""
        return self.table[:, step.SCORE]

    @property
    def normal_score(self) -> np.ndarray:
        """Where y(t) lies in its forecast, as a deviate of N(0, 1), whatever the tails; NaN where missing, (T,)."""
        return normal_score(*sides(self.innovation, *self._mixture()))

    @property
    def is_used(self) -> np.ndarray:
        """Whether the sample taught anything, (T,)."""
        return (self.status & int(Status.MISSING_OUTPUT | Status.BAD_VALUE)) == 0

    @property
    def weights(self) -> np.ndarray:
        """Weight of each member and of the naive forecasters in the prediction, (T, M), in the order of ``names``."""
        return self.table[:, self.estimator.columns["weights"]]

    @property
    def names(self) -> list[str]:
        """Names of the columns of ``weights``."""
        return self.estimator.all_names

    @property
    def leader(self) -> str:
        """The member of the largest weight at the end."""
        return self.names[int(np.argmax(self.weights[-1]))]

    def tails(self) -> tuple[np.ndarray, np.ndarray]:
        """Return what the density is made of: weights and standard deviations of normal components, (T, J) each."""
        base, level = self.table[:, [step.BASE]], self.table[:, [step.LEVEL]]
        scales = np.hstack([base * np.array(step.FAST), level * np.array(step.SLOW)])
        least = self.table[:, [step.FLOOR]]
        return self.table[:, self.estimator.columns["shares"]], np.sqrt(np.maximum(scales, least))

    def band(self, level: float = 0.95) -> np.ndarray:
        """Half-width of the prediction interval at each sample: about it lies that share of the density, (T,)."""
        return half_width(level, *self._mixture())

    def _mixture(self, use=slice(None)):
        """Return the density about the prediction as `half_width` takes it, at the samples ``use``."""
        weight, scale = (part[use] for part in self.tails())
        offset = np.broadcast_to(self.table[use, step.OFFSET][:, None], scale.shape)
        return weight, offset, scale, np.full(len(scale), math.inf)

    # --- in numbers ----------------------------------------------------------------------------------------

    def fit(self, first: int = 0) -> float:
        """Return the one-step fit 100 (1 - |e|/|y - mean y|) in per cent, from sample ``first`` on."""
        e, y = self.innovation[first:], self.y[first:]
        e, y = e[np.isfinite(e)], y[np.isfinite(e)]
        return 100 * (1 - math.sqrt((e @ e) / ((y - y.mean()) @ (y - y.mean())))) if np.ptp(y) > 0 else math.nan

    def nis(self, first: int = 0) -> float:
        """Return the mean of e^2/variance from sample ``first`` on: 1 where the variance is right."""
        z2 = self.innovation[first:] ** 2 / self.variance[first:]
        return float(np.nanmean(z2))

    def coverage(self, level: float = 0.95, first: int = 0) -> float:
        """Return the share of outputs within their band (`band`), from sample ``first`` on."""
        used = np.flatnonzero(self.is_used[first:]) + first
        held = share_within(np.abs(self.innovation[used]), *self._mixture(used)) <= level
        return float(held.mean()) if used.size else math.nan

    def _shown(self) -> list[str]:
        return ["prediction", "innovation", "variance", "status", "log_score", "normal_score"]
