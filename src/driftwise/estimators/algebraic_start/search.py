"""From a record to a fit in units of its own: closed form first, then the search, and what the samples tell of it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...engine.errors import InputError
from ...models.canonical import power_of_two
from .integrals import closed_form
from .refine import Fit, at, lengths, refine
from .responses import Plan, plan


@dataclass(frozen=True)
class Found:
    """A fit, with time in units of the record's length and y, u in powers of two of their sizes."""

    plan: Plan
    fit: Fit
    closed: tuple[np.ndarray, np.ndarray]
    closed_condition: float
    y: np.ndarray
    is_measured: np.ndarray
    span: float
    y_unit: float
    u_unit: np.ndarray

    @cached_property
    def _svd(self):
        J = self.fit.slopes[self.is_measured]
        size = lengths(J)
        return size, np.linalg.svd(J / size, full_matrices=False)

    @property
    def singular(self) -> np.ndarray:
        """Singular values of the slopes, columns of length one."""
        return self._svd[1][1]

    @property
    def directions(self) -> np.ndarray:
        """Directions of the unknowns that belong to them, one a row."""
        return self._svd[1][2]

    @property
    def root(self) -> np.ndarray:
        """A root of (J'J)^-1: the covariance of a, b, x(0), q for noise of variance one."""
        size, (_, s, V) = self._svd
        return (V.T / np.maximum(s, np.finfo(float).tiny)) / size[:, None]

    @property
    def inverse(self) -> np.ndarray:
        """J^+ (c, T): what the noise of each sample does to the unknowns; nothing where y is missing."""
        W = np.zeros((len(self.root), len(self.y)))
        W[:, self.is_measured] = self.root @ self._svd[1][0].T
        return W

    @property
    def state_units(self) -> np.ndarray:
        """What turns a state into the user's units."""
        return self.y_unit * self.span ** -np.arange(float(self.plan.n))

    @property
    def parameter_units(self) -> np.ndarray:
        """The same for a1..an and b1..bn of each input."""
        a = self.span ** -np.arange(1.0, self.plan.n + 1)
        return np.concatenate([a, *(a * self.y_unit / unit for unit in self.u_unit)])

    @property
    def units(self) -> np.ndarray:
        """The same for all unknowns: a, b, x(0), q."""
        n, m = self.plan.n, self.plan.m
        b = self.parameter_units[n:].reshape(-1, n)[:, n - m - 1 :]
        power = np.zeros(len(self.plan.S))
        power[: self.plan.drifts] = np.arange(self.plan.drifts)
        q = self.y_unit * self.span ** -(n + power)
        return np.concatenate([self.parameter_units[:n], b.ravel(), self.state_units, q])

    def final(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the state at the last sample (n,) and its slopes in the unknowns (n, c)."""
        n, Z = self.plan.n, self.fit.Z
        return Z[:n] @ self.fit.linear, np.concatenate([-_numerators(self.fit.a) @ Z[-n:] @ self.fit.linear, Z[:n]], 1)


def _numerators(a) -> np.ndarray:
    """Return N (n, n, n): (p - E + a e')^-1 e_i = N[:, i] [1, p, .., p^(n-1)]' / A(p), x as the filters have it.

    x_1 = p^(n-i)/A and x_(j+1) = p x_j + a_j x_1, less 1 where e_i enters.
    """
    n = len(a)
    A, N = np.append(1.0, a)[::-1], np.zeros((n, n, n))
    for i in range(n):
        first = np.eye(n + 1)[n - 1 - i]
        row = first
        for j in range(n):
            N[j, i] = row[:n]
            row = np.append(0.0, row[:n]) + a[j] * first - (A if i == j else 0.0)
    return N


def find(t, y, u, n, m, hold, degree, frequencies, is_refined: bool = True, last: int | None = None) -> Found:
    """Return the fit of a record whose first y is measured; ``last``: how many until the last one that is (all)."""
    span = t[-1] - t[0]
    t, w = (t - t[0]) / span, tuple(f * span for f in frequencies)
    y_unit, u_unit = power_of_two(y[np.isfinite(y)]), np.array([power_of_two(c) for c in u.T])
    y, u, is_measured = y / y_unit, u / u_unit, np.isfinite(y)
    bridged, reach = np.interp(t, t[is_measured], y[is_measured])[:last], t[:last][-1]
    a, b, condition = closed_form(t[:last] / reach, bridged, u[:last], n, m, hold, degree, [f * reach for f in w])
    a, b = (part * reach ** -np.arange(1.0, n + 1) for part in (a, b))
    task = plan(t, u, n, m, hold, degree, w)
    with np.errstate(all="ignore"):
        fit = refine(task, a, y, is_measured) if is_refined else at(task, a, y, is_measured, b[:, n - m - 1 :])
    if fit is None:
        raise InputError(
            "the closed form found a plant that grows beyond all bounds over this record: let refine=True look for a "
            "better one, or take a lower order"
        )
    return Found(task, fit, (a, b), condition, y, is_measured, span, y_unit, u_unit)
