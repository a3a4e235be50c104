"""Smoothing with the user's matrices: a record forwards, block by block, and back."""

from __future__ import annotations

import numpy as np

from ...engine import compile
from ...engine.dispatch import flatten
from .row import STATE_SPACE
from .smooth import NOTE, SPACE, LookBack

BLOCK, NUMBERS = 4096, 4_000_000  # states held at a time, and their numbers; others are computed again, bit for bit


def smooth(est, y, u, start, lag, outs) -> np.ndarray:
    """Fill ``outs`` with x(t) given all samples, or those up to t + lag, of ``y`` and ``u`` as the loop takes them.

    Return the filter's last state.
    """
    T, n, p, ahead = len(y), est.model.n, est.model.outputs, lag or 0
    rows, scratch = est._rows(start), est.scratch()
    width, note = rows.shape[1], NOTE.size(n, p)
    block = max(min(BLOCK, NUMBERS // (width + note)), 1)
    blocks, checkpoints = range(0, T, block), []
    for first in blocks:
        checkpoints.append(rows[0].copy())
        part = slice(first, first + block)
        est.drive(rows, y[None, part], u[None, part], np.empty((1, len(y[part]), est.n_columns)), est.spec, scratch)
    final = rows.view(est.dtype).reshape(())

    record, back = compile.recorder(*map(type, est.policies)), compile.passage(LookBack)
    history = np.empty((min(block + ahead, T) + 1, width + note))
    seen, space, at = np.empty((len(history), est.n_columns)), np.zeros(SPACE.size(n, p)), STATE_SPACE.slices
    space[SPACE.places(n, p).C :][: n * n] = np.eye(n).ravel()  # nothing is known beyond the end
    x_at = at(est.policies[0])["x"].start
    for first in reversed(blocks):
        count, part = min(block, T - first), slice(first, min(first + block + ahead, T))
        kept = history[: len(y[part]) + 1]
        record(checkpoints.pop(), kept, y[part], u[part], seen[: len(kept) - 1], est.spec, scratch)
        task = LookBack(n, p, x_at, width, count, -1.0 if lag is None else float(lag), float(est.sigma2(final)))
        none = np.empty((0, 0))
        back(none, none, kept, outs[first : first + count], space, flatten([task]))
    return final
