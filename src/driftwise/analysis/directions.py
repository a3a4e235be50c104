"""Which column is the effect: fits in both directions, where names leave it open."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ..results.numbers import listed
from ..tables.autoread import recognised
from ..tables.cleaning import judged
from ..tables.recognise import Reading, Table
from ..tables.table import OpenTable

ROWS = 8192  # that are looked at
LAGS = 6  # past readings of each column
STRIDES = (1, 6)  # readings: what acts slowly shows better over several
MOST = 8  # columns that are tried against one another
SURE = 20.0  # odds from which the evidence decides
CLEAR = 4.0  # times that one column is explained better than any other, where each explains the other
RIDGE = 1e-9


class Explained(NamedTuple):
    """How far the past of the others explains a column beyond its own past.

    nats : gain of the log likelihood, less half the logarithm of the samples for each coefficient (Schwarz 1978)
    share : of the variance that its own past leaves
    """

    nats: float
    share: float


def explained(columns: dict[str, Any]) -> dict[str, Explained]:
    """Return how far each column (T,) is explained by the past of the others (Granger 1969); NaN where missing.

    Bad at: causes that were not recorded, feedback, effects within the same row of causes without a memory.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> u = rng.normal(size=500)
    >>> y = np.convolve(u, [0, 1.0, 0.5])[:500] + 0.1 * rng.normal(size=500)
    >>> found = explained({"u": u, "y": y})
    >>> found["y"].nats > 100, found["u"].nats < 0
    (True, True)
    """
    values = {name: np.asarray(column, float)[:ROWS] for name, column in columns.items()}
    return {name: max((_explained(values, name, s) for s in STRIDES), key=lambda e: e.nats) for name in values}


def _explained(values: dict[str, np.ndarray], name: str, stride: int) -> Explained:
    """Return how far one column is explained; readings are means over ``stride`` rows."""
    means = {n: _means(v, stride) for n, v in values.items()}
    y = means[name]
    past = {n: np.column_stack([v[LAGS - k : len(v) - k] for k in range(1, LAGS + 1)]) for n, v in means.items()}
    y, own = y[LAGS:], past.pop(name)
    if not past:
        return Explained(-math.inf, 0.0)
    others = np.column_stack(list(past.values()))
    rows = np.isfinite(y) & np.isfinite(own).all(axis=1) & np.isfinite(others).all(axis=1)
    n = int(np.count_nonzero(rows))
    if n < 4 * (1 + LAGS * len(values)):
        return Explained(-math.inf, 0.0)
    one = np.ones((n, 1))
    before = _left(y[rows], np.hstack((one, own[rows])))
    after = _left(y[rows], np.hstack((one, own[rows], others[rows])))
    if not 0.0 < after <= before:
        return Explained(-math.inf, 0.0)
    return Explained(0.5 * n * math.log(before / after) - 0.5 * others.shape[1] * math.log(n), 1.0 - after / before)


def _means(values, stride: int):
    if stride == 1:
        return values
    return values[: len(values) // stride * stride].reshape(-1, stride).mean(axis=1)


def _left(y, A) -> float:
    """Return the sum of squares that a least-squares fit leaves."""
    scale = np.sqrt(np.mean(A * A, axis=0)) + 1e-300
    A = A / scale
    R = A.T @ A
    theta = np.linalg.solve(R + RIDGE * len(A) * np.eye(len(R)), A.T @ y)
    return float(np.sum((y - A @ theta) ** 2))


def settled(table: OpenTable, output=None, inputs=None, time=None, dt=None) -> Table:
    """Return what an open table holds, as `tables.autoread.recognised` does, direction included.

    Where names leave open which column is the output, the past decides: an effect is explained by its causes, causes
    are not by their effect. Where that is even, too, ``alternatives`` lists the readings, the likelier first, which the
    returned table takes.
    """
    found = recognised(table, output, inputs, time, dt)
    if output is not None or not found.rivals:
        return found
    signals = [column.name for column in found.columns if column.role in ("output", "input", "spare")]
    rivals = list(found.rivals)[:MOST]
    names = [*rivals, *(name for name in signals if name not in rivals)][:MOST]
    heads = {name: np.asarray(table.head[name], float) for name in names}
    clean = {name: np.where(doubt, np.nan, heads[name]) for name, (_, doubt) in judged(heads).items()}
    by = explained(clean)
    order = sorted(rivals, key=lambda name: -by[name].nats)
    shares = _shares([by[name] for name in order])
    tables = [_reading(table, found, name, inputs, time, dt, by) for name in order[:2]]
    if shares[0] >= SURE / (1.0 + SURE):
        return tables[0]
    readings = tuple(
        Reading(one.output, one.inputs, one[one.output].why, share) for one, share in zip(tables, shares)
    )
    return replace(tables[0], alternatives=readings)


def _shares(by: list[Explained]) -> list[float]:
    """Return how likely each of several columns is the effect, the best explained first."""
    best = by[0].nats
    if best <= 0.0:
        return [1.0 / len(by)] * len(by)
    weights = []
    for one in by:
        gap = math.log(max(by[0].share, 1e-12) / max(one.share, 1e-12)) / math.log(CLEAR) * math.log(SURE)
        weights.append(math.exp(-min(best - max(one.nats, 0.0), max(gap, 0.0))))
    return [weight / sum(weights) for weight in weights]


def _reading(table: OpenTable, found: Table, name: str, inputs, time, dt, by: dict[str, Explained]) -> Table:
    """Return the table read with one column as its output, and why."""
    one = found if name == found.output else recognised(table, name, inputs, time, dt)
    others = [other for other in found.rivals if other != name][:2]
    back = " and ".join(f"{100 * max(by[other].share, 0.0):.2g} %" for other in others)
    why = (
        f"the past of the others takes {100 * max(by[name].share, 0.0):.2g} % off the error of predicting it, and "
        f"{back} off that of {listed([repr(other) for other in others])}"
    )
    return _because(one, name, why, found.given)


def _because(table: Table, name: str, why: str, given) -> Table:
    from ..tables.recognise import worded

    columns = tuple(replace(column, why=why) if column.name == name else column for column in table.columns)
    return worded(replace(table, columns=columns, given=given))
