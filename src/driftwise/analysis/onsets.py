"""Where a level steps within a sample, told by the first samples of the step alone."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from .change_effects import share
from .noise_jumps import LEAST, SURE
from .response import Response

REACH, ONSETS = 5, 3  # samples by which a level before and after is compared; steps that are tried by these


def abrupt(now: Response) -> list[tuple[int, float]]:
    """Return where the level steps within a sample, and by how much, by the onset alone; the surest first.

    A noise with a slow colour takes a level for its own, but not the first samples of a step, which it whitens to a
    pattern of its own. A lone sample that is far off has another: where that explains more, nothing steps.
    """
    T, reach = len(now.used), REACH + len(now.f)
    if now.record.is_scattered or T < 2 * (LEAST + reach):
        return []  # no onset is seen
    whole = replace(now, used=np.isfinite(now.record.y), cache=now.of_mean())
    z, weights = np.zeros(T), np.zeros((T, 1))
    z[whole.rows] = whole.left
    weights[whole.rows] = 1.0
    if whole.gaps is not None:
        weights = whole.gaps.filled(whole.rows, T)
    about = np.arange(LEAST, T - LEAST)
    windows, by = (sliding_window_view(x, 2 * reach, axis=0)[about - reach] for x in (z, weights))
    f = np.append(1.0, now.f)
    spikes = [np.pad(f, (reach + k, reach - k - len(f))) for k in (-1, 0, 1)]
    calm = seen_at(by, np.full(2 * reach, f.sum()), f.sum())  # a level that was there before
    calm /= np.maximum(np.linalg.norm(calm, axis=1, keepdims=True), 1e-3)
    taken, sizes = [], []
    for pattern in (np.cumsum(spikes[1]), *spikes):
        d = seen_at(by, pattern)
        d -= np.einsum("tw,tw->t", d, calm)[:, None] * calm
        product = np.einsum("tw,tw->t", windows, d)
        sizes.append(share(product, np.einsum("tw,tw->t", d, d), 1))
        taken.append(0.5 * sizes[-1] * product)
    more, found = taken[0] - np.max(taken[1:], axis=0), list[tuple[int, float]]()
    while len(found) < ONSETS and len(more) and (k := int(np.argmax(more))) >= 0 and more[k] > SURE:
        found.append((int(about[k]), float(sizes[0][k] * now.sigma[about[k]])))
        more = np.where(abs(about - about[k]) < reach, -math.inf, more)
    return found


def seen_at(weights, pattern, before: float = 0.0) -> np.ndarray:
    """Return what a pattern (w,) of z does to innovations with weights (T, lags, w) of z; it was ``before``."""
    lags = weights.shape[1]
    padded = np.append(np.full(lags - 1, before), pattern)
    return np.einsum("tlw,lw->tw", weights, np.array([padded[lags - 1 - j :][: len(pattern)] for j in range(lags)]))
