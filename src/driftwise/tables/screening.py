"""Which columns help to predict another: a cheap look at the first rows."""

from __future__ import annotations

import numpy as np

ROWS = 16_384
LAGS = 4
STRIDES = (1, 8)  # readings: what acts slowly shows better a few readings ahead
MANY = 20  # columns beyond which only the best by themselves are tried together
RIDGE = 1e-8
CHANCE = 15.0  # chi-square of four regressors that mean nothing, exceeded in 0.5 % of cases


def screen(y, u, most: int) -> list[tuple[int, float]]:
    """Return up to `most` columns of u (T, m) that help to predict y (T,) one or eight readings ahead, best first.

    Least squares of y on its two readings before and on the means of the inputs since then, strictly in the past,
    column after column; each comes with the share of the residual variance that it takes
    away beyond chance. Bad at: effects that
    come later than thirty readings, and products of inputs.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> u = rng.normal(size=(500, 3))
    >>> y = np.convolve(u[:, 1], [0, 1.0, 0.5])[:500] + 0.1 * rng.normal(size=500)
    >>> screen(y, u, 1)[0][0]
    1
    """
    y, u = np.asarray(y, float), np.asarray(u, float)
    read = np.flatnonzero(np.isfinite(y))[:ROWS]
    if read.size < 4 * (LAGS + 3) or not u.shape[1]:
        return []
    y, u = y[: read[-1] + 1], u[: read[-1] + 1]
    views = [_regressors(y, u, read[::stride]) for stride in STRIDES if read.size >= 20 * (LAGS + 3) * stride]
    views = views or [_regressors(y, u, read)]
    chosen: list[tuple[int, float]] = []
    left = list(range(u.shape[1]))
    if len(left) > MANY:
        alone = {j: max(_gain(view, [], j) for view in views) for j in left}
        left = sorted(sorted(left, key=lambda j: -alone[j])[:MANY])
    while left and len(chosen) < most:
        gains = {j: max(_gain(view, [k for k, _ in chosen], j) for view in views) for j in left}
        best = max(gains, key=lambda j: gains[j])
        if not gains[best] > 0.0:
            break
        chosen.append((best, gains[best]))
        left.remove(best)
    return chosen


def _gain(view, chosen: list[int], j: int) -> float:
    """Return the share of the residual variance that input j takes away beside those already chosen, less CHANCE."""
    y, own, past = view
    kept = np.hstack((own, *(past[:, k] for k in chosen)))
    rows = np.isfinite(y) & np.isfinite(kept).all(axis=1) & np.isfinite(past[:, j]).all(axis=1)
    if np.count_nonzero(rows) < 4 * (kept.shape[1] + LAGS):
        return 0.0
    before = _residual(y[rows], kept[rows])
    after = _residual(y[rows], np.hstack((kept[rows], past[rows, j])))
    return 1 - after / before - CHANCE / np.count_nonzero(rows) if before > 0 else 0.0


def _regressors(y, u, read):
    """Return y at its readings, [1, two readings before], and the last means of each input (readings, m, LAGS)."""
    z = (y[read] - y[read].mean()) / (y[read].std() or 1.0)
    u = u[: read[-1]]
    total, seen = (np.vstack((np.zeros(u.shape[1]), np.cumsum(x, axis=0))) for x in (np.nan_to_num(u), np.isfinite(u)))
    count = seen[read[1:]] - seen[read[:-1]]
    means = np.where(
        count > 0, (total[read[1:]] - total[read[:-1]]) / np.maximum(count, 1), np.nan
    )  # (readings - 1, m)
    spread = np.nanstd(means, axis=0)
    means = (means - np.nanmean(means, axis=0)) / np.where(spread > 0, spread, 1.0)
    at = np.arange(LAGS, read.size)
    own = np.column_stack((np.ones(at.size), z[at - 1], z[at - 2]))
    past = np.stack([means[at - 1 - lag] for lag in range(LAGS)], axis=2)
    return z[at], own, past


def _residual(y, rows) -> float:
    """Return the residual sum of squares."""
    A = rows.T @ rows
    theta = np.linalg.solve(A + RIDGE * np.trace(A) / len(A) * np.eye(len(A)), rows.T @ y)
    return float(np.sum((y - rows @ theta) ** 2))
