"""How likely a record is under a drift, and what it says of the drift: score and information.

    log L = -1/2 sum [log(2 pi sigma^2 S) + e^2/(sigma^2 S)],     sigma^2 = mean(e^2/S) where it is not known

over all rows that teach something but the first 2n (``skip``), which only settle the prior. The gradient is exact: the
score of all rows less that of the first, for a conditional likelihood is a difference of two (`passes.Disturbances`).
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...engine import compile
from ...engine.dispatch import flatten
from . import moments, passes
from .record import Record, factors

SLOPE = 5.0  # prior variance of a slope, in units of (what moves y by one noise deviation)^2
FREED = 100.0  # variance a parameter gains at a jump, in the same units


class Point(NamedTuple):
    """The likelihood at one drift: log L, its gradient in log NVR, sigma^2."""

    loglik: float
    gradient: np.ndarray
    s2: float


class Likelihood:
    """Log-likelihood of a record under one kind of drift, with ``jumps``: samples at which all parameters are new."""

    def __init__(self, record: Record, drift: str, jumps=()):
        self.record, self.drift, self.jumps = record, drift, tuple(jumps)
        self.n = n = record.n
        self.m = m = n * (1 + (drift == "integrated"))
        self.unit, self.least = 1 / record.power, record.least_variance
        self.rows = np.zeros((len(record.y), 1 + m))
        self.rows[:, 0], self.rows[:, 1 : n + 1] = record.y, record.psi
        known = np.flatnonzero(record.known)
        skip = 2 * n if record.skip is None else record.skip
        self.head, self.counted = int(known[skip - 1]) + 1 if skip else 0, known[skip:]
        mean, P = record.prior
        full = np.diag(np.concatenate([np.zeros(n), SLOPE * self.unit])[:m])
        full[:n, :n] = P
        self.start = passes.forward_numbers(np.concatenate([mean, np.zeros(m - n)]), *factors(full))
        self.kept = np.empty((len(self.rows), passes.note_size(m, False)))
        self.room = np.empty((len(self.rows), 2 * m))
        self.scratch = np.empty(passes.back_size(m))
        self.size = passes.information_size(n, m)
        self.extra = np.zeros((len(self.rows), m))
        for k in self.jumps:
            self.extra[k - 1, :n] = FREED * self.unit

    @cached_property
    def motion(self) -> tuple[float, np.ndarray]:
        """How many parameters there are, and the diagonal of the transition."""
        return float(self.n), np.concatenate([self.record.phi, np.ones(self.m - self.n)])

    @cached_property
    def spec(self) -> np.ndarray:
        """The transition, as the compiled passes read it."""
        return flatten((passes.Forward(*self.motion),))

    def variances(self, nvr) -> np.ndarray:
        """Return Q (T, m) over sigma^2: row k acts between samples k and k + 1."""
        q = self.extra.copy()
        q[:, self.m - self.n :] += nvr * self.unit
        return q

    def filter(self, q, kept) -> np.ndarray:
        """Fill ``kept``; return the numbers after the last sample."""
        numbers = self.start.copy()
        compile.passage(passes.Forward)(self.rows, q, kept, passes.NONE, numbers, self.spec)
        return numbers

    def score(self, q, rows: int, s2) -> np.ndarray:
        """Return the derivatives of log L of the first so many rows by each quiet variance, after a `filter`."""
        r, N = self._disturbances(q, rows)
        return 0.5 * (np.einsum("ti,ti->i", r, r) / s2 - N.sum(axis=0))[self.m - self.n :]

    def _disturbances(self, q, rows: int) -> tuple[np.ndarray, np.ndarray]:
        out = self.room[:rows]
        back = compile.passage(passes.Disturbances)
        back(self.rows[:rows], q[:rows], self.kept[:rows], out, self.scratch, self.spec)
        return out[:, : self.m], out[:, self.m :]

    def at(self, nvr, with_gradient=True) -> Point:
        """Return log L at one drift (n NVRs), and its gradient by their logarithms."""
        q = self.variances(nvr)
        self.filter(q, self.kept)
        e, S = self.kept[self.counted, passes.EPS], self.kept[self.counted, passes.VARIANCE]
        chi2, known = float(np.sum(e * e / S)), self.record.variance
        s2 = known or max(chi2 / len(S), self.least)
        loglik = -0.5 * (len(S) * math.log(2 * math.pi * s2) + float(np.sum(np.log(S))) + chi2 / s2)
        if not with_gradient:
            return Point(loglik, np.full(self.n, np.nan), s2)
        slope = self.score(q, len(self.rows), s2) - self.score(q, self.head, s2)
        return Point(loglik, slope * nvr * self.unit, s2)

    def information(self, nvr, s2) -> np.ndarray:
        """Return Fisher's information about (log NVR of each parameter, log sigma^2), (n + 1, n + 1)."""
        n, q = self.n, self.variances(nvr)
        self.filter(q, self.kept)
        out, numbers = np.zeros((n + 1, n + 1)), np.zeros(self.size)
        task = passes.Information(*self.motion, nvr * self.unit, s2, float(self.head))
        compile.passage(passes.Information)(self.rows, q, self.kept, out, numbers, flatten((task,)))
        return out

    def moments(self, nvr, lag=None) -> tuple[np.ndarray, np.ndarray]:
        """Return the notes and states of the filter, and the rows of `moments.Backward`."""
        T, n, m, q = len(self.rows), self.n, self.m, self.variances(nvr)
        kept, out = np.empty((T, passes.note_size(m, True))), np.empty((T, n + n * (n + 1) // 2))
        self.filter(q, kept)
        task = moments.Backward(*self.motion, -1.0 if lag is None else float(lag))
        scratch = np.empty(moments.moments_size(m))
        compile.passage(moments.Backward)(self.rows, q, kept, out, scratch, flatten((task,)))
        return kept, out

    def disturbances(self, nvr) -> tuple[np.ndarray, np.ndarray]:
        """Return r (T, n) and the diagonal of N (T, n): what the record says of the step after each sample."""
        q = self.variances(nvr)
        self.filter(q, self.kept)
        r, N = self._disturbances(q, len(self.rows))
        return r[:, : self.n].copy(), N[:, : self.n].copy()


class Unknowns:
    """The logarithms of the NVRs that are looked for: one for each parameter, or one for all."""

    def __init__(self, likelihood: Likelihood, shared=False, constant=()):
        n = likelihood.n
        self.likelihood, self.live = likelihood, likelihood.record.is_live
        self.live[list(constant)] = False
        self.groups = np.ones((n, 1)) if shared else np.eye(n)  # which unknown each parameter has
        self.size = self.groups.shape[1]

    def nvr(self, z) -> np.ndarray:
        """Return the NVR of each parameter."""
        return np.where(self.live, np.exp(self.groups @ z), 0.0)

    def at(self, z) -> Point:
        """Return the likelihood, its gradient by the unknowns, sigma^2."""
        point = self.likelihood.at(self.nvr(z))
        return point._replace(gradient=self.groups.T @ point.gradient)

    def curvature(self, z, s2) -> np.ndarray:
        """Return Fisher's information about the unknowns; sigma^2 follows where it is not known."""
        n, full = self.likelihood.n, self.likelihood.information(self.nvr(z), s2)
        about = full[:n, :n]
        if self.likelihood.record.variance is None:
            about = about - np.outer(full[:n, n], full[:n, n]) / full[n, n]
        return self.groups.T @ about @ self.groups
