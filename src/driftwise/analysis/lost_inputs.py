"""Cells of inputs that are missing, as the output tells them: what a line between neighbours is wrong by, shows in y.

A cell is a pulse of unknown size; what pulses do is known by the response. Their sizes are those that are likeliest
beside white noise, with the spread that lines between neighbours have where cells are known (ridge; Hoerl and Kennard,
1970). Left as they are, such errors look like outliers of the noise, and no sample that is taken out mends them.
Bad at: long gaps, in which the sizes of neighbours are told as one.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..models.filtering import linear_filter
from .change_effects import later
from .held_model import filled
from .response import Response
from .response_orders import begin
from .response_record import recorded

MOST = 400  # cells, beyond which lines between neighbours have to do


def completed(y, u) -> np.ndarray:
    """Return inputs (T, k) whose missing cells are as the output y (T,) says; as they were where that is not known.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> u = rng.standard_normal((400, 1))
    >>> y = np.convolve(u[:, 0], 0.8 ** np.arange(30))[:400] + 0.05 * rng.standard_normal(400)
    >>> given = u.copy()
    >>> given[100:400:50] = np.nan
    >>> bool(np.abs(completed(y, given) - u).max() < 0.3)
    True
    """
    cells = ~np.isfinite(u)
    if not 0 < np.count_nonzero(cells) <= MOST or cells.all(axis=0).any():
        return u
    record, _, _, scales, _ = recorded(y, u)
    now = begin(record)
    if now is None or not len(now.b):
        return u
    found = np.column_stack([filled(x) for x in u.T])
    return found + scales * missed(now, cells)


def missed(now: Response, cells) -> np.ndarray:
    """Return by how much inputs (T, k) are wrong at some of their cells, in units of the response; zero elsewhere."""
    T, found = len(now.used), np.zeros(cells.shape)
    now = replace(now, used=np.isfinite(now.record.y), cache={})
    ways, sizes = [], []
    for i, (x, lost) in enumerate(zip(now.record.u.T, cells.T)):
        answer = linear_filter([1.0], now.denominator, now.driven(i, np.eye(1, T)[0]))
        ways.append(later(now, answer[:, None], np.flatnonzero(lost)[:, None]))
        sizes.append(np.full(np.count_nonzero(lost), between(np.where(lost, np.nan, x))))
    D, prior = np.vstack(ways), np.concatenate(sizes)
    D = D * prior[:, None]
    value = prior * np.linalg.solve(D @ D.T + np.eye(len(D)), D @ now.left)
    found.T[cells.T] = value
    return found


def between(x) -> float:
    """Return the deviation of a series (T,) from the middle of its neighbours, where these are known."""
    error = x[1:-1] - 0.5 * (x[2:] + x[:-2])
    error = error[np.isfinite(error)]
    return float(np.sqrt(np.mean(error**2))) if len(error) else 1.0
