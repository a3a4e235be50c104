"""What a joint filter tells of sigma^2 and the evidence, where its memory says how many samples count."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...models.scale import KnownScale
from .given_state import COUNT, SCORE
from .posterior import Posterior


class FadingPosterior(Posterior):
    """A posterior whose samples may fade: then its row has ``counts``, and 2 alpha and 2 beta fade with them."""

    policies: Any

    @property
    def _fades(self) -> bool:
        """Whether the memory says how many samples count."""
        return self.policies[0].fades > 0

    def start(self, series: int | None = None) -> np.ndarray:
        """Return a fresh state, or ``series`` of them."""
        state = super().start(series)
        if self._fades and not isinstance(self.scale, KnownScale):
            state["counts"][..., COUNT], state["chi2"] = 2 * self.scale.alpha, 2 * self.scale.beta
        return state

    def degrees_of_freedom(self, is_used, observed) -> np.ndarray:
        """Return those of each prediction, (T,), where so many outputs were used before; infinite: sigma^2 is known.

        Where samples fade they are at most the memory's own, where that is the same at all times.
        """
        found = super().degrees_of_freedom(is_used, observed)
        most = getattr(self.policies[2], "discount", getattr(self.policies[2], "lam", 1.0)) if self._fades else 1.0
        return np.minimum(found, 1 / (1 - most)) if most < 1 else found

    def scale_posterior(self, state) -> tuple[float, float]:
        """Return (alpha, beta) of the inverse-gamma posterior of sigma^2; (inf, inf) where it is known."""
        if not self._fades or isinstance(self.scale, KnownScale):
            return super().scale_posterior(state)
        return float(state["counts"][COUNT]) / 2, float(state["chi2"]) / 2

    def sigma2(self, state) -> float:
        """Return the estimate of the scale sigma^2 (1 where the noise is known).

        It is relative to the variance that the noise has in the units of y_scale; the noise itself in units of y is
        ``trace.summary().noise_std``.
        """
        if not self._fades or isinstance(self.scale, KnownScale):
            return super().sigma2(state)
        alpha, beta = self.scale_posterior(state)
        return beta / alpha if alpha >= 0.5 else max(2 * beta, 1.0)

    def loglik(self, state) -> float:
        """Return log p(y_1..y_t), parameters (and scale) integrated out: the evidence, ready to compare.

        Where samples fade there is no such thing, and it is the sum of the log densities of the one-step predictions.
        Under the reference prior of an unknown scale it is known up to a constant only, which depends on N:
        compare orders with a proper `InverseGamma(alpha, beta)`.
        """
        return float(state["counts"][SCORE]) if self._fades else super().loglik(state)
