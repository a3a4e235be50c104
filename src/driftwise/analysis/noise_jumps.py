"""Where the noise of a response jumps: binary segmentation of what is left of it."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from .response import Response
from .response_record import HUBER, local_size, long_run

LEAST, EDGE = 30, 8  # samples of a piece, and at the ends of a record, at least; of a short one this part of it
SURE = math.log(100.0)  # log odds from which a jump is told
PIECES = 20  # jumps that are told at most
CUT = 3.0  # deviations of its surroundings beyond which a sample counts no more: a short louder stretch is beyond HUBER


class NoiseJump(NamedTuple):
    """The first sample after it, where that lies in 95 of 100 cases, log odds, deviations before and after."""

    at: int
    interval: tuple[int, int]
    log_odds: float
    before: float
    after: float


def noises(now: Response, left: np.ndarray | None = None) -> list[NoiseJump]:
    """Return the jumps of the noise that is left, or of ``left`` at the rows in another unit, NaN where it is none."""
    r = now.unscaled if left is None else left
    r, rows = r[np.isfinite(r)], now.rows[np.isfinite(r)]
    least = min(LEAST, len(r) // EDGE)
    found: list[NoiseJump] = []
    pieces = [(0, len(r))] if len(r) > 2 * LEAST else []
    while pieces and len(found) < PIECES:
        a, b = pieces.pop()
        if b - a <= 2 * least:
            continue
        odds, at, (low, high) = _noise(r[a:b], least, now.record.floor)
        odds -= math.log(2 + len(now.b))
        if odds > SURE:
            ends = int(rows[a + low]), int(rows[a + high])
            found.append(NoiseJump(int(rows[a + at]), ends, odds, math.nan, math.nan))
            pieces += [(a, a + at), (a + at, b)]
    found.sort()
    edges = [0, *np.searchsorted(rows, [jump.at for jump in found]), len(r)]
    sizes = [float(np.std(r[a:b])) for a, b in pairwise(edges)]  # from one jump to the next
    return [jump._replace(before=a, after=b) for jump, (a, b) in zip(found, pairwise(sizes))]


def noisy(now: Response) -> Response:
    """Return a response whose noise has the size of its surroundings between jumps of it."""
    T = len(now.used)
    shape = np.ones(T)
    jumps = noises(now)
    if not jumps and np.ptp(now.sigma) < 1e-12:
        return now
    ends = [0, *(jump.at for jump in jumps), T]
    r = now.unscaled
    for a, b in pairwise(ends):
        inside = abs(r[(now.rows >= a) & (now.rows < b)])
        most = HUBER * 1.4826 * float(np.median(inside))
        shape[a:b] = max(float(np.sqrt(np.mean(np.minimum(inside, most) ** 2))), 1e-300)
    return replace(now, sigma=np.maximum(shape, now.record.floor), cache=now.of_mean()).settled(1)


def cut(r: np.ndarray, floor: float) -> np.ndarray:
    """Return what is left with what stands out of its surroundings cut off."""
    limit = CUT * local_size(r, floor)
    return np.clip(r, -limit, limit)


def _noise(r, margin: int, floor: float) -> tuple[float, int, tuple[int, int]]:
    """Return log odds, place and interval of another variance; what stands out of its surroundings is cut off."""
    r = cut(r, floor)
    n, k = len(r), np.arange(1, len(r))
    total = np.cumsum(r**2)
    first, second = total[:-1] / k, (total[-1] - total[:-1]) / (n - k)
    low = floor**2 + 1e-300
    gain = 0.5 * (n * math.log(total[-1] / n + low) - k * np.log(first + low) - (n - k) * np.log(second + low))
    gain = np.concatenate([[0.0], gain])
    place = margin + int(np.argmax(gain[margin : n - margin]))
    z = np.concatenate([part**2 / (np.mean(part**2) + low) for part in (r[:place], r[place:])]) - 1
    return _odds(gain / max(long_run(z) / 2, 1.0), margin)


def _odds(gain, margin: int) -> tuple[float, int, tuple[int, int]]:
    """Return log odds of a jump somewhere, the likeliest place, and 95 % of the places.

    The size of a jump is told by the samples before and after: it costs what as many samples as their harmonic mean
    say of it.
    """
    n = len(gain)
    k = np.arange(margin, n - margin)
    inside = gain[margin : n - margin] - 0.5 * np.log(k * (n - k) / n)
    best = float(inside.max())
    weight = np.exp(inside - best)
    share = np.cumsum(weight) / weight.sum()
    low, high = (margin + int(np.searchsorted(share, q)) for q in (0.025, 0.975))
    odds = best + math.log(weight.sum() / len(inside))
    return odds, margin + int(np.argmax(inside)), (low, min(high, n - margin - 1))
