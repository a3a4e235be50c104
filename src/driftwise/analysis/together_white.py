"""Columns in blocks under many noises at once, each white: by themselves, and without what other columns say of them.

What a column says of a change, beside any others, is in products alone: of the columns with one another, and with the
steps that changes are made of. They are worked out once for all columns and all noises (`whitened`); what is seen of
one beside some is then a matter of small matrices. The noises are the last axis: whatever is done is done for all.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .together_noise import noises

FOLLOWS = 30.0  # variance of what a column follows another by, both scaled, in that of the noise
EXACT = 1e-6  # of its squares, that others are never said to know of a column


class White(NamedTuple):
    """Columns under each noise.

    X : (n, p), the columns, scaled
    sizes : (p,), what they were divided by
    gram : (noises, p, p), their products with one another, white
    along : (p, steps, noises), the white shape of each step times each column
    """

    X: np.ndarray
    sizes: np.ndarray
    gram: np.ndarray
    along: np.ndarray


class Seen(NamedTuple):
    """A column under some noises, white, the others taken out: log likelihood but for what is left; squares; steps.

    which : (noises,), the places of these noises
    constant, whole : (noises,)
    along : (steps, noises), the white shape of each step times the column
    others : (q, steps, noises), the same times what each of the others says, of length one
    """

    which: np.ndarray
    constant: np.ndarray
    whole: np.ndarray
    along: np.ndarray
    others: np.ndarray

    def under(self, which) -> Seen:
        """Return the same under some of these noises, (noises,), True or False."""
        return Seen(*(np.compress(which, part, axis=-1) for part in self))


def scaled(X) -> tuple[np.ndarray, np.ndarray]:
    """Return columns (n, p) about their means, of deviation one, and what they were divided by."""
    sizes = np.maximum(X.std(axis=0), 1e-300)
    return (X - X.mean(axis=0)) / sizes, sizes


def whitened(X) -> White:
    """Return columns (n, p) under each noise."""
    X, sizes = scaled(X)
    n, p = X.shape
    grid = noises(n)
    along = X.T.astype(np.float32) @ grid.steps.reshape(n, -1)
    return White(X, sizes, X.T @ (grid.left @ X), along.reshape(p, *grid.steps.shape[1:]))


def shared(X, q: int) -> np.ndarray:
    """Return what columns (n, p) share, the most of it first: q principal components, each of deviation one."""
    U = np.linalg.svd(X, full_matrices=False)[0][:, :q]
    return U * math.sqrt(len(X))


def seen(white: White, j: int, beside: Sequence[int]) -> Seen:
    """Return column j beside others, which it follows by coefficients that nobody knows, or by itself."""
    constant, whole, along, q = noises(len(white.X)).constant, white.gram[:, j, j], white.along[j], len(beside)
    which = np.arange(len(constant))
    if not q:
        return Seen(which, constant, whole, along, white.along[:0])
    root = np.linalg.cholesky(white.gram[:, beside][:, :, beside] + np.eye(q) / FOLLOWS)
    told = np.linalg.solve(root, white.gram[:, beside, j, None])[..., 0]
    along = _solved(root, told, white.along[[*beside, j]])
    constant = constant - np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1) - 0.5 * q * math.log(FOLLOWS)
    return Seen(which, constant, np.maximum(whole - (told**2).sum(axis=1), 0.0) + EXACT * whole, along[q], along[:q])


def _solved(root, told, along) -> np.ndarray:
    """Return root^-1 along, what others say of each step, and behind it what they do not say of the column's.

    root (noises, q, q) is lower triangular, told (noises, q), along (q + 1, steps, noises), the column's the last.
    """
    rows = np.concatenate([root, told[:, None]], axis=1).astype(along.dtype).transpose(1, 2, 0)  # (q + 1, q, noises)
    for i, row in enumerate(rows):
        for by, other in zip(row[:i], along):
            along[i] -= by * other
        if i < len(row):
            along[i] /= row[i]
    return along
