"""Smoothing: every sample in the light of those that came after it."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...engine import compile
from .row import OBSERVED
from .smooth import note_size, space

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

    record, back = compile.recorder(*kinds), compile.smoother(kinds[0])
    ahead, size, N = lag or 0, rows.shape[1], est.model.N
    history = np.empty((min(BLOCK + ahead, T) + 1, size + note_size(form)))
    seen, unknown, known = np.empty((len(history), 4)), space(N), space(N)
    for first in reversed(blocks):
        count, part = min(BLOCK, T - first), slice(first, min(first + BLOCK + ahead, T))
        kept = history[: len(y[part]) + 1]
        record(checkpoints.pop(), kept, y[part, None], u[part], seen[: len(kept) - 1], est.spec, scratch)
        back_to = outs[first : first + count]
        back(
            kept, size, count, -1 if lag is None else lag, est.sigma2(final), back_to, est.spec, scratch, unknown, known
        )
        if form.coloured:
            _fill(outs, first, kept[:count, OBSERVED] < est.policies[1].settle, form)
    return final


def _fill(outs, first, is_held, form):
    """While c was held the filter took it for known: it is what it was from then on (the held samples come first)."""
    n, held = int(form.n), first + int(np.count_nonzero(is_held))
    if not is_held.any() or held >= len(outs):
        return
    c = np.arange(int(form.n * (form.inputs + 2)), int(form.n * (form.inputs + 3)))
    N = n * int(form.inputs + 3) + int(form.direct) + int(form.offset)
    columns = [c]
    if outs.shape[1] == 2 * N:
        columns.append(N + c)
    elif outs.shape[1] > N:
        j, i = np.tril_indices(N)
        columns.append(N + np.flatnonzero(np.isin(i, c) | np.isin(j, c)))
    at = np.concatenate(columns)
    outs[first:held, at] = outs[held, at]
