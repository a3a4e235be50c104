"""Smoothing: every sample in the light of those that came after it."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..kernel import compose
from .joint_smooth import note_size

BLOCK = 4096  # states held at a time; the others are recomputed from one in so many, bit for bit


def smooth(est, y, u, start, lag, outs) -> np.ndarray:
    """Fill ``outs`` with s(t) given all samples, or those up to t + lag; return the filter's last state."""
    T, blocks = len(y), range(0, len(y), BLOCK)
    kinds: tuple[Any, ...] = tuple(map(type, est.policies))
    form, scratch = est.policies[0], est.scratch()
    rows, checkpoints = est._rows(start), []
    for first in blocks:
        checkpoints.append(rows[0].copy())
        part = slice(first, first + BLOCK)
        est.drive(rows, y[None, part, None], u[None, part], np.empty((1, len(y[part]), 4)), est.spec, scratch)
    final = rows.view(est.dtype).reshape(())

    record, back = compose.recorder(*kinds), compose.smoother(kinds[0])
    ahead, size, N = lag or 0, rows.shape[1], est.model.N
    history = np.empty((min(BLOCK + ahead, T), size + note_size(form)))
    seen, space = np.empty((len(history), 4)), np.zeros((3 * N + 1, N))
    for first in reversed(blocks):
        count, part = min(BLOCK, T - first), slice(first, min(first + BLOCK + ahead, T))
        kept = history[: len(y[part])]
        record(checkpoints.pop(), kept, y[part, None], u[part], seen[: len(kept)], est.spec, scratch)
        back_to = outs[first : first + count]
        back(kept, size, count, -1 if lag is None else lag, est.sigma2(final), back_to, est.spec, scratch, space)
    return final
