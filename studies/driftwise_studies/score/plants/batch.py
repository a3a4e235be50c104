"""The batch fit of a plant's parameters, SciPy's least squares on all samples at once, and what no fit can beat.

Unknown are the logarithms of the parameters, whose prior is within `FACTOR`; the initial state; and the deviation of
each output's noise, of which nothing is believed. A walk of the last state adds walk^2 min(t, t') to the covariance of
the output. Derivatives are exact (complex steps). Nothing here is the package's.
"""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares, minimize_scalar

from .drawing import FACTOR, Drawn
from .physics import TINY
from .simulation import response

LOG_STD = np.log(FACTOR) / 1.96
ROUNDS, SETTLED = 12, 1e-3  # of least squares with a noise from the last; change of its logarithm that ends them


class Fit(NamedTuple):
    """Where a batch fit ended."""

    eta: np.ndarray  # (m,) logarithms
    x0: np.ndarray
    noise: np.ndarray  # (p,)
    value: float  # log posterior of eta
    covariance: np.ndarray  # of eta and x0


class Batch:
    """A record, y (T, p) with NaN where missing, and all that can be known of it at once."""

    def __init__(self, drawn: Drawn, y):
        self.drawn, self.plant, self.m = drawn, drawn.plant, len(drawn.theta)
        self.there = np.isfinite(y)
        self.y = [column[there] for column, there in zip(y.T, self.there.T)]
        start, std = np.array(self.plant.states).T
        self.mean = np.concatenate([np.log(list(self.plant.starts.values())), start])
        self.spread = np.concatenate([np.full(self.m, LOG_STD), std])
        self._seen: tuple = (None, None)

    @cached_property
    def axes(self):
        """The variances that a walk adds to each output, and along which axes (orthogonal)."""
        if not self.plant.walk:
            return [(np.zeros(len(y)), None) for y in self.y]
        made = []
        for there in self.there.T:
            t = self.drawn.t[there]
            variances, basis = np.linalg.eigh(self.plant.walk**2 * np.minimum.outer(t, t))
            made.append((np.maximum(variances, 0.0), basis.T))
        return made

    def along(self, parts):
        """Return vectors or matrices of each output along its axes."""
        return [part if basis is None else basis @ part for part, (_, basis) in zip(parts, self.axes)]

    def simulated(self, z):
        """Return innovations of each output along its axes, and the slopes of the outputs by z = (eta, x0)."""
        if self._seen[0] is None or not np.array_equal(z, self._seen[0]):
            width = len(z)
            columns = np.repeat(z[:, None], width, 1) + 1j * TINY * np.eye(width)
            theta, x0 = np.exp(columns[: self.m]), columns[self.m :]
            with np.errstate(all="ignore"):
                y, _ = response(self.plant, theta, x0, self.drawn.t, self.drawn.u, self.drawn.fast)
            y = np.nan_to_num(y, nan=1e9, posinf=1e9, neginf=-1e9)
            own = [y[there, i] for i, there in enumerate(self.there.T)]
            e = self.along([data - one[:, 0].real for data, one in zip(self.y, own)])
            self._seen = z.copy(), (e, self.along([one.imag / TINY for one in own]))
        return self._seen[1]

    def weights(self, noise):
        """Return one over the deviation of each innovation."""
        return [1 / np.sqrt(s**2 + variances) for s, (variances, _) in zip(noise, self.axes)]

    def noise_of(self, e):
        """Return the likeliest deviation of the noise of each output."""
        found = []
        for own, (variances, _) in zip(e, self.axes):
            rough = 0.5 * np.log(np.mean(own**2) + 1e-300)
            if variances.any():

                def cost(log, own=own, variances=variances):
                    V = np.exp(2 * log) + variances
                    return np.sum(np.log(V) + own**2 / V)

                rough = minimize_scalar(cost, (rough - 6, rough + 0.1), bounds=(rough - 6, rough + 0.1)).x
            found.append(np.exp(rough))
        return np.array(found)

    def solve(self, z, free=slice(None)):
        """Return z and noise where the posterior is largest, seen from z; only ``free`` parts of z move."""
        z, before = z.copy(), np.full(len(self.y), 1e300)

        def placed(part):
            whole = z.copy()
            whole[free] = part
            return whole

        for _ in range(ROUNDS):
            noise = self.noise_of(self.simulated(z)[0])
            if np.max(np.abs(np.log(noise / before))) < SETTLED:
                break
            before, w = noise, self.weights(noise)

            def cost(part, w=w):
                whole = placed(part)
                e = np.concatenate([a * b for a, b in zip(w, self.simulated(whole)[0])])
                return np.append(e, (whole - self.mean)[free] / self.spread[free])

            def slopes(part, w=w):
                S = np.concatenate([-a[:, None] * b for a, b in zip(w, self.simulated(placed(part))[1])])
                return np.vstack([S[:, free], np.diag(1 / self.spread[free])])

            z = placed(least_squares(cost, z[free], slopes, x_scale=self.spread[free], ftol=1e-9, max_nfev=60).x)
        return z, noise

    def posterior(self, eta, z=None) -> Fit:
        """Return the log posterior at eta, over the initial state by Laplace (exact where it acts linearly)."""
        z = np.concatenate([eta, self.mean[self.m :]]) if z is None else z
        z, noise = self.solve(z, slice(self.m, None))
        e, S = self.simulated(z)
        w = self.weights(noise)
        information = self.information(S, w)
        own = information[self.m :, self.m :]
        value = sum(np.sum(np.log(a)) - 0.5 * np.sum((a * b) ** 2) for a, b in zip(w, e))
        value -= 0.5 * np.sum(((z - self.mean) / self.spread) ** 2) + 0.5 * np.linalg.slogdet(own)[1]
        return Fit(z[: self.m], z[self.m :], noise, float(value), np.linalg.inv(information))

    def information(self, S, w):
        """Return Fisher's information of eta and x0, with the prior's."""
        return sum((b * a[:, None] ** 2).T @ b for a, b in zip(w, S)) + np.diag(self.spread**-2.0)

    def fit(self, starts) -> Fit:
        """Return the best of the fits from each of these log parameters (m,)."""
        found = []
        for eta in starts:
            z, _ = self.solve(np.concatenate([eta, self.mean[self.m :]]))
            found.append(self.posterior(z[: self.m], z))
        return max(found, key=lambda fit: fit.value)

    def bound(self, noise) -> np.ndarray:
        """Return the least deviations of eta that are possible: Cramer and Rao's, with the prior (Van Trees)."""
        _, S = self.simulated(np.concatenate([np.log(self.drawn.theta), self.drawn.x0]))
        return np.sqrt(np.diag(np.linalg.inv(self.information(S, self.weights(noise)))))[: self.m]
