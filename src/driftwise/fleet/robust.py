"""What most of a fleet is like, and who is not: medians, false discoveries, jumps of many at one time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

NORMAL = 0.674489750196082  # the median of the size of a standard normal number
HALVINGS = 60  # of the interval that the spread lies in
WINDOW, AT_LEAST, CHANCE, MOST = 20, 3, 1e-3, 10  # samples of a burst, jumps in it, its probability, how many are told


class Rest(NamedTuple):
    """The rest of a fleet: median and spread of each parameter and of the noise, and how far each series is off.

    ``z`` (S, N) and ``noise_z`` (S,) are deviations from the median over the root of spread^2 + (its own deviation)^2:
    NaN where nothing was learnt, and for offsets. The noise is compared by its logarithm.
    """

    median: np.ndarray  # (N,)
    spread: np.ndarray  # (N,)
    z: np.ndarray  # (S, N)
    noise: float
    noise_z: np.ndarray  # (S,)


class Burst(NamedTuple):
    """Jumps of many series at one time."""

    start: float
    end: float
    rows: np.ndarray


def rest_of(census, untaught: float) -> Rest:
    """Return what the rest of a fleet is like, and how far each series is from it."""
    theta, std = census.theta, census.std
    known = np.isfinite(std) & (census.untaught <= untaught)[:, None] & np.isfinite(theta)
    compared = [not name.startswith("offset") for name in census.names]
    columns = [
        unlike(np.where(known[:, j] & compared[j], theta[:, j], np.nan), std[:, j]) for j in range(theta.shape[1])
    ]
    with np.errstate(divide="ignore", invalid="ignore"):
        size, own = np.log(census.noise), np.sqrt(0.5 / census.freedom)  # of a logarithm of a root of chi^2
    is_learnt = np.isfinite(own) & np.isfinite(size)  # a known variance is no estimate
    level, _, noise_z = unlike(np.where(is_learnt, size, np.nan), own)
    median, spread = (np.array([column[i] for column in columns]) for i in range(2))
    z = np.column_stack([column[2] for column in columns]) if columns else np.zeros(theta.shape)
    return Rest(median, spread, z, float(np.exp(level)), noise_z)


def unlike(values, std) -> tuple[float, float, np.ndarray]:
    """Return the median of values (S,), the spread of their truths, and z of each.

    The spread is what, added to each value's own variance, makes the median of |z| that of a normal number; a fleet
    whose values differ by no more than their deviations has none. NaN values are left out.
    """
    seen = np.isfinite(values)
    if not seen.any():
        return np.nan, np.nan, np.full(len(values), np.nan)
    middle = float(np.median(values[seen]))
    off, own = np.abs(values[seen] - middle), std[seen] ** 2
    low, high = 0.0, float(np.median(off)) / NORMAL
    if _typical(off, own, low) <= NORMAL:
        high = low
    else:
        for _ in range(HALVINGS):
            half = 0.5 * (low + high)
            low, high = (half, high) if _typical(off, own, half) > NORMAL else (low, half)
    slack = np.median(np.sqrt(own + high * high)) ** 2 * np.pi / 2 / seen.sum()  # the median's own variance
    with np.errstate(divide="ignore", invalid="ignore"):
        z = (values - middle) / np.sqrt(std**2 + high * high + slack)
    return middle, high, np.where(np.isfinite(z), z, np.nan)


def _typical(off, own, spread: float) -> float:
    """Return the median of |z| with that spread."""
    size = np.sqrt(own + spread * spread)
    return float(np.median(np.divide(off, size, out=np.where(off > 0, np.inf, 0.0), where=size > 0)))


def discoveries(p, rate: float) -> np.ndarray:
    """Say which of the hypotheses with these p-values (NaN: none) fall, at that share of false discoveries.

    Benjamini and Hochberg (1995), as ``scipy.stats.false_discovery_control``, which takes half a second to import.
    """
    p = np.asarray(p, float)
    found, order = np.zeros(len(p), bool), np.argsort(p)[: np.isfinite(p).sum()]
    is_below = p[order] * (len(order) / np.arange(1, len(order) + 1)) <= rate
    found[order[: np.max(np.flatnonzero(is_below), initial=-1) + 1]] = True
    return found


def bursts(tally) -> list[Burst]:
    """Return when more series jumped within 20 samples than chance explains, the largest first.

    Each series counts by its last jump. Chance is that of jumps at any time alike, those of the burst left out: less
    than 1 in 1000 over the whole record.
    """
    from scipy.special import pdtrc

    rows = np.flatnonzero(np.isfinite(tally["last_jump"]))
    time = tally["last_jump"][rows]
    order = np.argsort(time, kind="stable")
    rows, time = rows[order], time[order]
    width, span = WINDOW * _step(tally), _span(tally) if len(rows) else 0.0
    found: list[Burst] = []
    while len(time) >= AT_LEAST and len(found) < MOST and span > width > 0:
        inside = np.searchsorted(time, time + width, "right") - np.arange(len(time))
        first = int(np.argmax(inside))
        count = int(inside[first])
        others = max(len(time) - count, 1) * width / span
        if count < AT_LEAST or pdtrc(count - 1, others) * span / width > CHANCE:
            break
        some = slice(first, first + count)
        found.append(Burst(float(time[first]), float(time[first + count - 1]), rows[some]))
        rows, time = np.delete(rows, some), np.delete(time, some)
    return found


def _step(tally) -> float:
    """Return the time between two samples of a usual series."""
    lasting = tally["last_time"] - tally["first_time"]
    seen = np.isfinite(lasting)
    return float(np.median(lasting[seen] / np.maximum(tally["samples"][seen] - 1, 1))) if seen.any() else 0.0


def _span(tally) -> float:
    """Return the time from the first to the last sample of the fleet."""
    return float(np.nanmax(tally["last_time"]) - np.nanmin(tally["first_time"]))
