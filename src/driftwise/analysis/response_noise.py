"""A response as a regression with white noise: what it leaves of the samples that count, and its slopes there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..models.filtering import filter_rows, linear_filter
from ..models.regression import NOTHING, filtered_rows, fitted
from .copies import Copies
from .interrupted_noise import Gaps, gaps
from .response_mean import Mean
from .response_record import HUBER, huber
from .scattered_noise import Bridge, bridge

FEW = 6  # samples, of which no variance is asked


@dataclass(frozen=True, kw_only=True)
class Whitened(Mean):
    """A mean beside coloured noise e/F.

    Attributes
    ----------
    f : (p,) of the noise; sigma : (T,) its deviation
    used : (T,) samples that are measured and no outliers
    """

    f: np.ndarray
    sigma: np.ndarray
    used: np.ndarray

    @property
    def rows(self) -> np.ndarray:
        """The samples that count: used, and not the first ones, by which the noise is whitened."""
        if "rows" not in self.cache:
            self.cache["rows"] = self.seen[np.searchsorted(self.seen, self.waits) :]
        return self.cache["rows"]

    @property
    def waits(self) -> int:
        """How many of the first samples are driven by inputs before the record."""
        return max(max(self.nk, default=0) + self.b.shape[1] - 1, 0)

    @property
    def seen(self) -> np.ndarray:
        """The samples that count wherever the inputs before are known."""
        if "seen" not in self.cache:
            seen = self.used.copy()
            for j in range(1, len(self.f) + 1 if not self.record.is_scattered else 1):
                seen[j:] &= self.used[:-j]
                seen[:j] = False
            if self.gaps is not None:
                seen[self.gaps.at] = True
            self.cache["seen"] = np.flatnonzero(seen)
        return self.cache["seen"]

    @property
    def loudness_before(self) -> tuple[int, float]:
        """How many samples wait for inputs before the record, and their variance about a level of their own.

        The variance is in that of the white noise, and no less.
        """
        if self.waits < FEW or self.record.is_scattered:
            return 0, 1.0
        rows = self.seen[: np.searchsorted(self.seen, self.waits)]
        if self.gaps is not None:
            rows = np.setdiff1d(rows, self.gaps.at)
        if len(rows) < FEW:
            return 0, 1.0
        left = np.where(self.used, self.record.y - self.mean, 0.0)[: self.waits]
        left = (linear_filter(self.white, [1.0], left) / self.sigma[: self.waits])[rows]
        return len(rows), max(2 * huber(left - np.median(left)) / len(rows), 1.0)

    @property
    def bridge(self) -> Bridge | None:
        """How noise is whitened by the sample before, however long ago that was; None where most follow another."""
        if not (self.record.is_scattered and len(self.f)):
            return None
        if "bridge" not in self.cache:
            self.cache["bridge"] = bridge(-float(self.f[0]), float(self.f[1:].sum()), self.rows)
        return self.cache["bridge"]

    @property
    def deviations(self) -> np.ndarray:
        """The deviation of the white noise at the rows that count."""
        if "deviations" not in self.cache:
            self.cache["deviations"] = self.sigma[self.rows]
        return self.cache["deviations"]

    @property
    def gaps(self) -> Gaps | None:
        """How noise is whitened after samples that are missing among others; None where none is."""
        if "gaps" not in self.cache:
            is_whole = self.record.is_scattered or not len(self.f)
            self.cache["gaps"] = None if is_whole else gaps(self.f, self.used)
        return self.cache["gaps"]

    @property
    def mixing(self) -> tuple[np.ndarray, Any] | None:
        """Which rows come after gaps, and what makes innovations there of signals that went through `white`."""
        if self.gaps is None:
            return None
        if "mixing" not in self.cache:
            _, after, kept = np.intersect1d(self.rows, self.gaps.at, assume_unique=True, return_indices=True)
            self.cache["mixing"] = after, self.gaps.mixing(kept, len(self.used), self.sigma)
        return self.cache["mixing"]

    @property
    def spread(self) -> np.ndarray:
        """The deviation of what the past leaves open of y, at the rows that count."""
        if self.gaps is None:
            return self.deviations * (1.0 if self.bridge is None else self.bridge.size)
        size = np.ones(len(self.used))
        size[self.gaps.at] = self.gaps.size
        return self.deviations * size[self.rows]

    @property
    def white(self) -> np.ndarray:
        """The polynomial that whitens samples which follow each other, 1, f1, ..; 1 beside a `bridge`."""
        return np.append(1.0, [] if self.record.is_scattered else self.f)

    @property
    def needed(self) -> np.ndarray:
        """The samples at which signals through `white` are asked for: where gaps are, those before rows as well."""
        return self.rows if self.mixing is None else np.arange(len(self.used))

    def scaled(self, x) -> np.ndarray:
        """Return what went through `white`, at the samples needed, as rows that count in deviations of white noise."""
        if self.mixing is not None:
            after, mixing = self.mixing
            found = x[..., self.rows] / self.deviations
            found[..., after] = (mixing @ x.T).T
            return found
        found = x / self.deviations
        return found if self.bridge is None else self.bridge.whitened(found)

    def whitened(self, x) -> np.ndarray:
        """Return signals (.., T) at the rows that count, in deviations of white noise."""
        return self.scaled(linear_filter(self.white, [1.0], x.T).T[..., self.needed])

    @property
    def left(self) -> np.ndarray:
        """What the mean leaves of y there."""
        if "left" not in self.cache:
            self.cache["left"] = self.whitened(np.where(self.used, self.record.y - self.mean, 0.0))
        return self.cache["left"]

    @property
    def unscaled(self) -> np.ndarray:
        """The same, white, in the units of the record."""
        return self.left * self.sigma[self.rows]

    @property
    def expected(self) -> np.ndarray:
        """What was expected of y there, given the past."""
        return self.record.y[self.rows] - self.unscaled

    @property
    def weight(self) -> np.ndarray:
        """Huber's, as roots."""
        if "weight" not in self.cache:
            self.cache["weight"] = np.sqrt(np.minimum(1.0, HUBER / np.maximum(abs(self.left), 1e-300)))
        return self.cache["weight"]

    def regressors(self, through: Copies, beside, more: int = 0) -> np.ndarray:
        """Return signals that went through `white`, through 1/A as well, and others beside, as `scaled` has rows.

        They are (rows, P + m), and ``more`` columns to be filled; overwritten by the next such call.
        """
        mixing, gaps = self.mixing, NOTHING
        if mixing is not None and len(mixing[0]):
            gaps = mixing[0], mixing[1].data.reshape(len(mixing[0]), -1)
        X = filtered_rows(
            self.denominator, through.signals, through.table, beside, self.rows, self.deviations, gaps, more
        )  # fmt: skip
        if self.bridge is not None:
            X = np.ascontiguousarray(self.bridge.whitened(X.T).T)
        return X

    @property
    def through(self) -> Copies:
        """What is `before` 1/A, through `white`."""
        if "through" not in self.cache:
            self.cache["through"] = self.before.filtered(self.white, np.ones(1))
        return self.cache["through"]

    @property
    def aside(self) -> np.ndarray:
        """What moves the level by itself, (m, T), through `white`."""
        if "aside" not in self.cache:
            self.cache["aside"] = filter_rows(self.white, np.ones(1), self.beside)
        return self.cache["aside"]

    def steep(self, more: int = 0) -> np.ndarray:
        """Return the slopes at the rows that count, (rows, P), and ``more`` columns; overwritten by the next call."""
        if self.speeds:
            X = np.concatenate([self.whitened(self.slopes()), self.scaled(self.aside[..., self.needed])])
            return np.ascontiguousarray(np.concatenate([X, np.zeros((more, X.shape[1]))]).T)
        inner = filter_rows(self.white, np.ones(1), -self.inner[None])
        own = Copies(np.concatenate([inner, self.through.signals]), self.slope_places)
        return self.regressors(own, self.aside, more)

    def jacobian(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the slopes there, (rows, P), weighted, in units of their own sizes, and these."""
        J = self.steep() * self.weight[:, None]
        size = np.sqrt(np.einsum("ij,ij->j", J, J))
        size = np.where(size > 0, size, 1.0)
        J /= size
        return J, size

    def way(self) -> np.ndarray:
        """Return the step of Gauss and Newton, (P,): to the parameters that leave least, were slopes the same there."""
        X = self.steep(1)
        X[:, -1] = self.left
        return fitted(X, self.weight)[0]

    @property
    def basis(self) -> np.ndarray:
        """An orthonormal basis of what the parameters can do there, (rows, P)."""
        if "basis" not in self.cache:
            Q, R = np.linalg.qr(self.jacobian()[0])
            self.cache["basis"] = Q[:, abs(np.diag(R)) > 1e-7]
        return self.cache["basis"]

    def loss(self) -> float:
        """Return Huber's loss of what is left."""
        if "loss" not in self.cache:
            self.cache["loss"] = huber(self.left)
        return self.cache["loss"]
