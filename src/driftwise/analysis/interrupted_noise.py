"""Noise of an autoregression where samples are missing: what the past leaves open of the next one that is there.

z = F v is white. What was missing says nothing: of the last z, only combinations count in which no missing v has a
part. The one that is new with a sample is its innovation: the last z as seen from there, beside all that a missing v
does. A past of some samples is looked at, no further; a sample of which that says nothing counts as a first one.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

BACK = 8  # samples that are looked back for those before which are missing
LOST, LEAST = 1e-9, 0.03  # the weight of what is missing; of a sample in its innovation, from which it counts


class Gaps(NamedTuple):
    """Innovations after gaps: of samples ``at`` (K,), as weights (K, W) of z there and before, the latest first."""

    at: np.ndarray
    weights: np.ndarray

    @property
    def size(self) -> np.ndarray:
        """The deviation of the next sample, given those before it, in deviations of z, (K,)."""
        return 1 / self.weights[:, 0]

    def filled(self, rows, samples: int) -> np.ndarray:
        """Return the weights of all rows, (samples, W): one of those without a gap before, none of no row."""
        found = np.zeros((samples, self.weights.shape[1]))
        found[rows, 0] = 1.0
        found[self.at] = np.where(found[self.at, :1] > 0, self.weights, 0.0)
        return found

    def mixing(self, kept, samples: int, sigma) -> Any:
        """Return a sparse matrix (m, samples) that makes innovations ``kept`` (m,) of these of signals through F."""
        from scipy.sparse import csr_matrix

        many = self.weights.shape[1]
        before = np.maximum(self.at[kept, None] - np.arange(many), 0)  # what is before the record has no weight
        weights = np.where(self.at[kept, None] >= np.arange(many), self.weights[kept], 0.0) / sigma[before]
        ends = np.arange(0, weights.size + 1, many)
        return csr_matrix((weights.ravel(), before.ravel(), ends), shape=(len(weights), samples))


def gaps(f, used) -> Gaps | None:
    """Return the innovations of v(t) = -f1 v(t-1) .. + z where a sample before is missing; None where none is.

    Examples
    --------
    >>> used = np.array([True, True, True, False, True, True])
    >>> found = gaps(np.array([-0.5]), used)
    >>> found.at, found.size.round(3), bool(np.isclose(found.size[0] ** 2, 1 + 0.5**2))
    (array([4]), array([1.118]), True)
    """
    if used.all():
        return None
    p, T = len(f), len(used)
    W = p + BACK
    many = W - 1 + p  # samples that have a part in the last W of z
    lost = sliding_window_view(np.concatenate([np.ones(many, bool), ~used]), many)[:T, ::-1]  # of each, the last first
    at = np.flatnonzero(used & lost[:, :p].any(axis=1))
    at = at[at >= p]
    if not len(at):
        return None
    kinds, which = np.unique(lost[at] @ (1 << np.arange(many)), return_inverse=True)
    kinds = kinds[:, None] >> np.arange(many) & 1
    spikes = np.zeros((many, W))  # what each sample before does to z
    for m in range(1, many + 1):
        for lag in range(max(m - p, 0), min(m, W - 1) + 1):
            spikes[m - 1, lag] = f[m - lag - 1] if m > lag else 1.0
    outer = (spikes[:, :, None] * spikes[:, None, :]).reshape(many, -1)
    doubt = np.eye(W) + (kinds.astype(float) @ outer).reshape(-1, W, W) / LOST
    weights = np.linalg.solve(doubt, np.eye(W, 1))[:, :, 0][which]
    keeps = weights[:, 0] > LEAST**2
    return Gaps(at[keeps], weights[keeps] / np.sqrt(weights[keeps, :1])) if keeps.any() else None
