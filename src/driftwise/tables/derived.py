"""Columns that are copies of others, or computed from them: neither the output nor its input."""

from __future__ import annotations

import itertools

import numpy as np

from ..results.numbers import listed

ROWS = 4096  # that are looked at
MOST = 40  # columns beyond which only copies are looked for
SHIFTS = 3  # samples by which a copy may be shifted
EXACT = 1e-6  # share of the variance that rounding may leave
NEEDED = 10.0  # times that a relation is worse without any one of its columns
FEW = 12  # columns up to which four and five of them are looked at together
STILL = 0.5  # share of the rows in which a part may jump
LOUDER = 2.0  # times the variance elsewhere, that what else moves the whole may have where its part jumps
EDGE = 0.1  # how far from 1 the jumps of a whole may be, where its part jumps by 1


def derived(columns: dict[str, np.ndarray], rank: dict[str, float]) -> dict[str, str]:
    """Return why a column is no signal of its own, for those that are not: a copy, scaled, shifted, or a sum.

    Parameters
    ----------
    columns : name -> float array (T,), NaN where missing; none of them constant
    rank : of two that are one another's copy, the one of lower rank is left out; of equal ones the later

    Bad at: ratios, products and logarithms of others.

    Examples
    --------
    >>> a, b = np.random.default_rng(0).normal(size=(2, 50))
    >>> derived({"a": a, "b": b, "c": 2 * a + 1, "d": a + b}, {})
    {'c': "'a' in another unit", 'd': "the sum of 'a' and 'b'"}
    """
    names = sorted(columns, key=lambda name: -rank.get(name, 0.0))  # of equal ones the first stays
    values = {name: np.asarray(columns[name], float)[:ROWS] for name in names}
    found: dict[str, str] = {}
    for j, name in enumerate(names):
        for other in names[:j]:
            if other in found or not (why := _copied(values[name], values[other], other)):
                continue
            if why.endswith("earlier") and rank.get(name, 0.0) == rank.get(other, 0.0):  # what comes first is no copy
                found[other] = _copied(values[other], values[name], name)
                continue
            found[name] = why
            break
    left = [name for name in names if name not in found]
    if 3 <= len(left) <= MOST:
        found |= _sums({name: values[name] for name in left}, rank)
    return found


def is_copy(why: str) -> bool:
    """Whether the reason that `derived` gave is that of an exact copy."""
    return why.startswith("the same as")


def _copied(x, y, other: str) -> str:
    """Return how x is a copy of y, "" if it is none."""
    for shift in sorted(range(-SHIFTS, SHIFTS + 1), key=abs):
        a = x[max(shift, 0) : len(x) + min(shift, 0)]
        b = y[max(-shift, 0) : len(y) + min(-shift, 0)]
        rows = np.isfinite(a) & np.isfinite(b)
        if np.count_nonzero(rows) < 10:
            continue
        a, b = a[rows], b[rows]
        if not np.ptp(a) or not np.ptp(b) or (shift and np.unique(b).size < 5):
            continue
        da, db = a - a.mean(), b - b.mean()
        high, wide = float(np.max(np.abs(da))), float(np.max(np.abs(db)))
        if not (high > 0.0 and wide > 0.0):
            continue
        da, db = da / high, db / wide  # squares of tiny numbers are zero
        slope = float(da @ db) / float(db @ db)
        if float(np.sum((da - slope * db) ** 2)) > EXACT * float(da @ da):
            continue
        if shift:
            return f"{other!r} {abs(shift)} row{'s' * (abs(shift) > 1)} {'later' if shift > 0 else 'earlier'}"
        same = abs(slope * high - wide) < 1e-3 * wide and abs(a.mean() - b.mean()) < 1e-3 * np.ptp(a)
        return f"the same as {other!r}" if same else f"{other!r} in another unit"
    return ""


def _sums(values: dict[str, np.ndarray], rank) -> dict[str, str]:
    """Return the columns that are sums of two to four others, weighted or not."""
    names = list(values)
    rows = np.all([np.isfinite(v) for v in values.values()], axis=0)
    if np.count_nonzero(rows) < 3 * len(names):
        return {}
    A = np.column_stack([v[rows] for v in values.values()])
    A = A - A.mean(axis=0)
    size = np.sqrt(np.mean(A * A, axis=0))
    if not np.all(size > 0):
        return {}
    R = (A / size).T @ (A / size) / len(A)
    if np.linalg.eigvalsh(R)[0] > EXACT:  # nothing is computed from others
        return {}
    found: dict[str, str] = {}
    for count in (3, 4, 5)[: 3 if len(names) <= FEW else 1]:
        for parts in itertools.combinations(range(len(names)), count):
            if any(names[j] in found for j in parts):
                continue
            left, weights = _related(R[np.ix_(parts, parts)])
            if left > EXACT or any(
                np.linalg.eigvalsh(R[np.ix_(rest, rest)])[0] < NEEDED * left
                for rest in itertools.combinations(parts, count - 1)
            ):
                continue
            weights = weights / size[list(parts)]
            taken = _computed(weights, [rank.get(names[j], 0.0) for j in parts])
            shares = np.delete(-weights / weights[taken], taken)
            others = [repr(names[j]) for k, j in enumerate(parts) if k != taken]
            what = "the sum of" if np.all(np.abs(shares - 1.0) < 1e-2) else "computed from"
            found[names[parts[taken]]] = f"{what} {listed(others)}"
    return found


def _related(R) -> tuple[float, np.ndarray]:
    """Return what is left of the linear relation that holds best between columns, and its weights."""
    values, vectors = np.linalg.eigh(R)
    return max(float(values[0]), 1e-15), vectors[:, 0]


def _computed(weights, rank: list[float]) -> int:
    """Return which column of a relation is the computed one: of the lowest rank, or the sum of the others, or last."""
    sums = [bool(np.all(np.delete(-weights / weights[k], k) > 0)) for k in range(len(weights))]
    return min(range(len(weights)), key=lambda k: (rank[k], not sums[k], -k))


def is_part(part, whole) -> bool:
    """Whether one column is contained in another: wherever it jumps, the other jumps by as much, in the same row.

    It stands still in between, and what else moves the other does so no more where it jumps.

    >>> rng = np.random.default_rng(1)
    >>> pulse = np.repeat([0.0, 5.0, 0.0, 5.0, 0.0], 40)
    >>> is_part(pulse, pulse + 0.1 * rng.normal(size=200)), is_part(pulse, 2 * pulse + rng.normal(size=200))
    (True, False)
    """
    steps, follow = np.diff(np.asarray(part, float)[:ROWS]), np.diff(np.asarray(whole, float)[:ROWS])
    rows = np.isfinite(steps) & np.isfinite(follow)
    steps, follow = steps[rows], follow[rows]
    power = float(steps @ steps)
    if np.count_nonzero(steps) < 4 or not power:
        return False
    slope = float(steps @ follow) / power
    left = follow - slope * steps
    error = np.sqrt(float(left @ left) / max(len(left) - 1, 1) / power)
    at = steps != 0
    if np.mean(at) > STILL or not (abs(slope - 1.0) < EDGE and error < EDGE / 2):
        return False
    rest = np.mean(left[~at] ** 2)
    return bool(np.mean(left[at] ** 2) <= LOUDER * rest + EDGE**2 * np.mean(steps[at] ** 2))
