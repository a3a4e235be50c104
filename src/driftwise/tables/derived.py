"""Columns that are copies of others, or computed from them: neither the output nor its input."""

from __future__ import annotations

import itertools

import numpy as np

ROWS = 4096  # that are looked at
MOST = 40  # columns beyond which only copies are looked for
SHIFTS = 3  # samples by which a copy may be shifted
EXACT = 1e-6  # share of the variance that rounding may leave
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
            if other not in found and (why := _copied(values[name], values[other], other)):
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
        slope = float(da @ db) / float(db @ db)
        if float(np.sum((da - slope * db) ** 2)) > EXACT * float(da @ da):
            continue
        if shift:
            return f"{other!r} {abs(shift)} row{'s' * (abs(shift) > 1)} {'later' if shift > 0 else 'earlier'}"
        same = abs(slope - 1.0) < 1e-3 and abs(a.mean() - b.mean()) < 1e-3 * np.ptp(a)
        return f"the same as {other!r}" if same else f"{other!r} in another unit"
    return ""


def _sums(values: dict[str, np.ndarray], rank) -> dict[str, str]:
    """Return the columns that are sums or differences of two or three others, or of all that make one up."""
    names = list(values)
    rows = np.all([np.isfinite(v) for v in values.values()], axis=0)
    if np.count_nonzero(rows) < 3 * len(names):
        return {}
    A = np.column_stack([v[rows] for v in values.values()])
    A = A - A.mean(axis=0)
    size = A.std(axis=0)
    if not np.all(size > 0):
        return {}
    found: dict[str, str] = {}
    whole = np.linalg.svd(A / size, compute_uv=False)
    if whole[-1] > np.sqrt(EXACT) * whole[0]:  # nothing is computed from others
        return {}
    for count in (2, 3, 4):
        for parts in itertools.combinations(range(len(names)), count + 1):
            if any(names[j] in found for j in parts):
                continue
            _, s, V = np.linalg.svd(A[:, parts] / size[list(parts)], full_matrices=False)
            weights = V[-1] / size[list(parts)]
            if s[-1] > np.sqrt(EXACT) * s[0] or np.min(np.abs(V[-1])) < 1e-2:
                continue
            sums = [k for k in range(count + 1) if all(-weights[j] / weights[k] > 0 for j in range(count + 1) if j != k)]
            by_rank = sorted(range(count + 1), key=lambda k: (rank.get(names[parts[k]], 0.0), k not in sums, -parts[k]))
            taken = by_rank[0]
            others = [names[parts[j]] for j in range(count + 1) if j != taken]
            shares = [-weights[j] / weights[taken] for j in range(count + 1) if j != taken]
            what = "the sum of" if all(abs(share - 1.0) < 1e-3 for share in shares) else "computed from"
            listed = ", ".join(map(repr, others[:-1])) + f" and {others[-1]!r}"
            found[names[parts[taken]]] = f"{what} {listed}"
        if len(names) > 12:
            break
    return found


def is_part(part, whole) -> bool:
    """Whether one column is contained in another: wherever it jumps, the other jumps by as much, in the same row.

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
    return bool(abs(slope - 1.0) < EDGE and error < EDGE / 2)
