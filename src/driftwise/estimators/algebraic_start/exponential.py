"""The matrix exponential of many steps at once; for a single small one, too, without a library that starts threads."""

from __future__ import annotations

import numpy as np

TERMS = 15  # of Taylor's series, for a norm of at most one half: 2^-16/16! is beyond the last digit


def exponentials(F, steps) -> np.ndarray:
    """Return exp(F h) of all steps h at once: Taylor's series of a fraction of each, squared back."""
    X = F * steps[:, None, None]
    size = float(abs(X).sum(axis=-1).max())
    halvings = max(int(np.ceil(np.log2(size))) + 1, 0) if size > 0 else 0
    X = X / 2.0**halvings
    E = one = np.eye(len(F))
    for k in range(TERMS, 0, -1):
        E = one + X @ E / k
    for _ in range(halvings):
        E = E @ E
    return E
