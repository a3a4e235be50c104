"""Which jumps can be told: by who knows which parameter jumps, and how far, but neither when nor anything else.

Linear about the truth, all is Gaussian: the record is N(0, V) beside its truth without the jump, V the noise, the walk
and what is believed of parameters and initial state; a jump at some sample adds what it makes of the record. The odds
are those of one jump somewhere in the record, all places alike, against none.
"""

from __future__ import annotations

import numpy as np

from .batch import Batch
from .drawing import Drawn
from .simulation import response, unmoved

ODDS, PLACES, CONSTANTS = 20.0, 24, 2.0  # to tell; moments that are tried; slowest time constants after the jump


def window(drawn: Drawn) -> int:
    """Return how many samples two time constants are, ten at least."""
    return max(int(np.searchsorted(drawn.t, drawn.t[drawn.at] + CONSTANTS * drawn.slow)) - drawn.at, 10)


def is_tellable(drawn: Drawn, y, noise) -> bool:
    """Return whether such a filter puts the jump above 20:1 within two time constants."""
    end = min(drawn.at + window(drawn), len(drawn.t))
    batch = Batch(drawn, np.where(np.arange(len(y))[:, None] < end, y, np.nan))
    z = np.concatenate([np.log(drawn.theta), drawn.x0])
    e, S = batch.simulated(z)
    w = batch.weights(noise)
    e = np.concatenate([a * b for a, b in zip(w, e)])
    S = np.concatenate([a[:, None] * b for a, b in zip(w, S)])
    clean, path = unmoved(drawn)
    clean = clean[:end]
    inner = np.linalg.inv(np.diag(batch.spread**-2.0) + S.T @ S)
    logs = []
    for at in np.unique(np.append(np.linspace(end // PLACES, end - 2, PLACES).astype(int), drawn.at)):
        moved = np.concatenate([np.zeros((at, clean.shape[1])), _after(drawn, path[at], at, end) - clean[at:]])
        moved = np.vstack([moved, np.zeros((len(y) - end, clean.shape[1]))])
        d = np.concatenate([a * b for a, b in zip(w, batch.along([c[t] for c, t in zip(moved.T, batch.there.T)]))])
        whitened = d - S @ (inner @ (S.T @ d))
        logs.append(whitened @ (e - 0.5 * d))
    return bool(np.mean(np.exp(np.minimum(logs, 300.0))) > ODDS)


def _after(drawn: Drawn, x, at: int, end: int):
    """Return the outputs from a sample on if the parameter jumps there, at state x."""
    part = slice(at, end)
    return response(drawn.plant, drawn.after[:, None], x[:, None], drawn.t[part], drawn.u[part], drawn.fast)[0][:, :, 0]
