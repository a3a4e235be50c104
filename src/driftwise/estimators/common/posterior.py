"""What is known after a sample, with one output: s ~ N(mean, sigma^2 P), sigma^2 known or learnt."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...engine import ud
from ...models import noise as noises
from ...models.convert import Model
from ...models.quantities import Derived, derive
from ...models.scale import KnownScale, sigma2
from ..base import Estimator


class Posterior(Estimator):
    """An estimator of one output whose state holds a mean and the factors U D U' of a covariance."""

    scale: Any
    prior_covariance: np.ndarray

    def degrees_of_freedom(self, is_used, observed) -> np.ndarray:
        """Return those of each prediction, (T,), where so many outputs were used before; infinite: sigma^2 is known."""
        if isinstance(self.scale, KnownScale):
            return np.full(len(is_used), np.inf)
        before = observed + np.cumsum(is_used) - is_used
        return 2 * np.maximum(self.scale.alpha + before / 2, 0.5)

    def model_at(self, theta, P) -> Any:
        """Return the model of a parameter vector and its covariance."""
        return Model(self.model, theta, P, self.dt)

    def model_of(self, state) -> Any:
        """Return the model a state amounts to, with the covariance of its parameters."""
        return self.model_at(*self.parameters_of(state))

    def parameters_of(self, state) -> tuple[np.ndarray, np.ndarray]:
        """Return the parameters, in the order of ``names``, and their covariance."""
        return np.array(state["theta"]), self.unit_of(state) * self._theta_covariance(state)

    def derived(self, state, quantities) -> dict[str, Derived]:
        """Return what follows from the parameters of a state, with bars: as `update` goes on, sample by sample.

        Parameters
        ----------
        state : one state, as `update` or a trace leaves it
        quantities : mapping from a name to a function of the parameters, which come as a dictionary by their ``names``

        Notes
        -----
        By slopes and the joint covariance; by draws where the quantity bends within its interval
        (`models.quantities.derive`). ``trace.derived`` does it for a record.

        Examples
        --------
        >>> import driftwise as dw
        >>> y, u = dw.simulate([-0.8], [1.0], samples=500, noise_std=0.1, seed=1)
        >>> est = dw.ARX(1, 1)
        >>> found = est.derived(est.scan(y, u).state, {"gain": lambda p: p["b1"] / (1 + p["a1"])})["gain"]
        >>> low, high = found.interval
        >>> low < 5.0 < high, high - low < 0.2
        (True, True)
        """
        return derive(self.names, *self.parameters_of(state), quantities)

    def unit_of(self, state) -> Any:
        """Return what the covariance is relative to: sigma^2."""
        return self.sigma2(state)

    def covariance(self, state) -> np.ndarray:
        """Return the covariance of s(t+1 | t) in Salut's order; relative to sigma^2 where that is unknown."""
        return self._covariance(state)[..., self.model.kernel, :][..., self.model.kernel]

    def _covariance(self, state) -> np.ndarray:
        """Return the covariance in the kernel's order, with what an unknown polynomial is yet to get."""
        P = ud.unpack(state["U"], state["D"])
        if self.model.coloured:
            n, first = self.model.n, self.model.n * (self.model.blocks - 1)
            for index in np.ndindex(P.shape[:-2]):
                free = noises.held_back(self.policies[1], float(state["observed"][index]), self.sigma2(state[index]))
                P[index][range(first, first + n), range(first, first + n)] += free
        return P

    def _theta_covariance(self, state) -> np.ndarray:
        """Return the covariance of theta in its own order, relative to sigma^2 where that is unknown."""
        n = self.model.n
        return self._covariance(state)[n:, n:]

    def scale_posterior(self, state) -> tuple[float, float]:
        """Return (alpha, beta) of the inverse-gamma posterior of sigma^2; (inf, inf) where it is known."""
        if isinstance(self.scale, KnownScale):
            return math.inf, math.inf
        return self.scale.alpha + float(state["observed"]) / 2, self.scale.beta + float(state["chi2"]) / 2

    def sigma2(self, state) -> float:
        """Return the estimate of the scale sigma^2 (1 where the noise is known).

        It is relative to the variance that the noise has in the units of y_scale; the noise itself in units of y is
        ``trace.summary().noise_std``.
        """
        return sigma2(self.scale, float(state["observed"]), float(state["chi2"]))

    def loglik(self, state) -> float:
        """Return log p(y_1..y_t), parameters (and scale) integrated out: the evidence, ready to compare.

        Under the reference prior of an unknown scale it is known up to a constant only, which depends on N:
        compare orders with a proper `InverseGamma(alpha, beta)`.
        """
        count, chi2, logdet = (float(state[k]) for k in ("observed", "chi2", "logdet"))
        base = -0.5 * (count * math.log(2 * math.pi) + logdet)
        if isinstance(self.scale, KnownScale):
            return base - 0.5 * chi2
        (alpha, beta), prior = self.scale_posterior(state), self.scale
        if alpha <= 0:
            return math.nan
        constant = math.lgamma(prior.alpha) - prior.alpha * math.log(prior.beta) if prior.alpha > 0 else 0.0
        return base + math.lgamma(alpha) - alpha * math.log(beta) - constant

    def information_ratio(self, state) -> list[tuple[float, np.ndarray]]:
        """Return (ratio, direction) pairs: posterior over prior variance along directions of theta, worst first.

        A ratio near one says that the data have taught nothing about that combination of parameters (above 0.5
        counts as unlearnt; S. Salut's identifiability, live). Directions are unit vectors in prior deviations.
        """
        n = self.model.n
        P = self._theta_covariance(state)
        prior = np.diag(self.prior_covariance)[n:].copy()
        if self.model.coloured and self.policies[1].settle > 0:
            at = n * (self.model.blocks - 2)
            prior[at : at + n] = noises.held_back(self.policies[1], 0.0, self.sigma2(state))
        return directions(P, prior)


def directions(P, prior) -> list[tuple[float, np.ndarray]]:
    """Return (ratio, direction) pairs of a covariance to its prior variances, largest ratio first."""
    root = np.sqrt(prior)
    live = root > 0
    ratio, vectors = np.linalg.eigh((P / np.where(live, root, 1) / np.where(live, root, 1)[:, None])[live][:, live])
    full = np.zeros((len(ratio), len(root)))
    full[:, live] = vectors.T
    return [(max(float(r), 0.0), v) for r, v in zip(ratio[::-1], full[::-1])]
