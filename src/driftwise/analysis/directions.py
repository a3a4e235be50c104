"""Which column is the effect: fits in both directions, where names leave it open."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ..engine.holding import held
from ..results.numbers import listed, percent
from ..tables.autoread import Segments, asked, recognised
from ..tables.chunks import CHUNK_ROWS
from ..tables.cleaning import judged
from ..tables.column_candidates import MOST_INPUTS
from ..tables.recognise import Reading, Table, worded
from ..tables.table import HEAD_ROWS, OpenTable, open_table
from .response import Response
from .response_orders import begin
from .response_record import recorded

ROWS, FITTED = 8192, 2048  # that are looked at, and that a response is fitted to
LAGS = 6  # single rows of the past of each column
SPANS = (7, 12), (13, 24), (25, 48)  # rows back over which means are taken: what acts slowly shows there
MOST, FEW = 8, 3  # columns that are tried against one another; and by a response, which takes a second each
SURE = 20.0  # odds from which the evidence decides
CLEAR = 4.0  # times that one column is explained better than any other, where each explains the other
RIDGE = 1e-9


class Explained(NamedTuple):
    """How far the past of the others explains a column beyond its own past.

    nats : gain of the log likelihood, less half the logarithm of the samples for each coefficient (Schwarz 1978)
    share : of the variance that its own past leaves, chance taken off; 0 where ``nats`` is not positive
    """

    nats: float
    share: float


NOTHING = Explained(-math.inf, 0.0)


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
    past = {name: _past(np.asarray(column, float)[:ROWS]) for name, column in columns.items()}
    return {name: _explained(np.asarray(columns[name], float)[:ROWS], name, past) for name in columns}


def _past(values) -> np.ndarray:
    """Return the past of each row, (T, LAGS + number of SPANS): single rows, then means of rows further back."""
    padded = np.concatenate((np.full(SPANS[-1][1], np.nan), values))
    back = [padded[SPANS[-1][1] - k :][: len(values)] for k in range(SPANS[-1][1] + 1)]
    return np.column_stack([*back[1 : LAGS + 1], *(np.mean(back[first : last + 1], axis=0) for first, last in SPANS)])


def _explained(y, name: str, past: dict[str, np.ndarray]) -> Explained:
    own, others = past[name], [rows for other, rows in past.items() if other != name]
    if not others:
        return NOTHING
    rest = np.hstack(others)
    rows = np.isfinite(y) & np.isfinite(own).all(axis=1) & np.isfinite(rest).all(axis=1)
    n, fewer, more = int(np.count_nonzero(rows)), 1 + own.shape[1], rest.shape[1]
    if n < 2 * (fewer + more):
        return NOTHING
    one = np.ones((n, 1))
    before = _left(y[rows], np.hstack((one, own[rows])))
    after = _left(y[rows], np.hstack((one, own[rows], rest[rows])))
    if not 0.0 < after <= before:
        return NOTHING
    nats = 0.5 * n * math.log(before / after) - 0.5 * more * math.log(n)
    share = 1.0 - after / (n - fewer - more) / (before / (n - fewer))
    return Explained(nats, max(share, 0.0) if nats > 0.0 else 0.0)


def _left(y, A) -> float:
    """Return the sum of squares that a least-squares fit leaves."""
    scale = np.sqrt(np.mean(A * A, axis=0)) + 1e-300
    A = A / scale
    R = A.T @ A
    theta = np.linalg.solve(R + RIDGE * len(A) * np.eye(len(R)), A.T @ y)
    return float(np.sum((y - A @ theta) ** 2))


def answering(columns: dict[str, Any], name: str) -> Explained:
    """Return how far a column answers to the past of the others: a response to them beside coloured noise, or none.

    It has few numbers and needs no output that follows another, where `explained` has many and needs whole rows.
    """
    y = np.asarray(columns[name], float)[:FITTED]
    others = [held(np.asarray(column, float)[:FITTED]) for other, column in columns.items() if other != name]
    u = np.column_stack([np.concatenate([column[:1], column[:-1]]) for column in others])
    if not np.isfinite(u).any(axis=0).all() or not np.isfinite(y).any():
        return NOTHING
    with_them, alone = (begin(recorded(y, some)[0]) for some in (u, u[:, :0]))
    if with_them is None or alone is None:
        return NOTHING
    more, n = len(with_them.theta) + len(with_them.f) - len(alone.theta) - len(alone.f), len(with_them.rows)
    share = 1.0 - _missed(with_them) / _missed(alone)
    if not n or share >= 1.0:
        return NOTHING
    by_squares = -0.5 * n * math.log(1.0 - share) - 0.5 * more * math.log(n)
    nats = min(by_squares, 0.5 * (alone.criterion - with_them.criterion))  # neither steps that rest nor outliers do it
    return Explained(nats, share) if min(nats, share) > 0.0 else Explained(min(nats, 0.0), 0.0)


def _missed(response: Response) -> float:
    """Return the mean square of a response's errors one step ahead, of all that was measured."""
    whole = replace(response, used=np.isfinite(response.record.y), sigma=np.ones(len(response.sigma)), cache={})
    return float(np.mean((whole.left * whole.spread) ** 2)) if len(whole.rows) else math.inf


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
    order = sorted(rivals, key=lambda name: -max(by[name].nats, 0.0))
    shares = _shares([by[name] for name in order])
    is_open = shares[0] < SURE / (1.0 + SURE)
    if is_open and len(rivals) <= FEW:  # few rows in a row, or an answer that is slow: a response asks for less
        by |= {name: answering(clean, name) for name in order}
        order = sorted(rivals, key=lambda name: -max(by[name].nats, 0.0))  # nothing explained: as they stand
        shares = _shares([by[name] for name in order])
    tables = [_reading(table, found, name, inputs, time, dt, by, clean) for name in order[:2]]
    if shares[0] >= SURE / (1.0 + SURE):
        return tables[0]
    readings = tuple(Reading(one.output, one.inputs, one[one.output].why, share) for one, share in zip(tables, shares))
    return replace(tables[0], alternatives=readings, rivals=found.rivals)


def later_causes(table: Table, clean: dict[str, Any]) -> dict[str, float]:
    """Return columns that explain the output beside its inputs, and the share of each: what acts late, or on few rows.

    The first look at a table goes some rows back (`tables.screening`); here the past is that of `explained`, and where
    that has no rows, and no input was found, a response. One after the other, the likeliest first, at odds of `SURE`.
    """
    name, inputs = table.output, [one for one in table.inputs if one in clean]
    spare = [one for one in clean if table[one].role == "spare"]
    known = {one: np.asarray(clean[one], float)[:ROWS] for one in (name, *inputs, *spare)}
    past, found = {one: _past(values) for one, values in known.items()}, dict[str, float]()
    looks = [lambda names: _explained(known[name], name, {one: past[one] for one in names})]
    if not inputs and len(spare) < FEW:
        looks.append(lambda names: answering({one: clean[one] for one in names}, name))
    for look in looks:
        now = look([name, *inputs]) if inputs else Explained(0.0, 0.0)
        while spare and math.isfinite(now.nats) and len(inputs) < MOST_INPUTS:
            by = {one: look([name, *inputs, one]) for one in spare}
            best = max(spare, key=lambda one: by[one].nats)
            if not by[best].nats - max(now.nats, 0.0) > math.log(SURE):
                break
            found[best] = 1.0 - (1.0 - by[best].share) / (1.0 - now.share)  # beside the others
            now, inputs = by[best], [*inputs, best]
            spare.remove(best)
        if inputs:
            break
    return found


def driven(table: Table, more: dict[str, float]) -> Table:
    """Return a table with more inputs, each with the share that its past helps by."""
    if not more:
        return table
    columns = tuple(
        replace(one, role="input", why=f"its past helps, {percent(more[one.name])}", helps=more[one.name])
        if one.name in more else one
        for one in table.columns
    )  # fmt: skip
    return replace(table, columns=columns, inputs=tuple(one.name for one in columns if one.role == "input"))


def read_settled(data, output=None, inputs=None, time=None, chunk_rows=CHUNK_ROWS, head_rows=HEAD_ROWS, dt=None):
    """Return (`Table`, `Segments`) as `tables.autoread.read` does, direction included."""
    table = open_table(data, chunk_rows, head_rows, asked(output, inputs, time))
    found = settled(table, output, inputs, time, dt)
    return found, Segments(table, found)


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


def _reading(table: OpenTable, found: Table, name: str, inputs, time, dt, by, clean) -> Table:
    """Return the table read with one column as its output, and why."""
    one = found if name == found.output else recognised(table, name, inputs, time, dt)
    if inputs is None:
        one = driven(one, later_causes(one, clean))
    others = [other for other in found.rivals if other != name][:2]
    back = " and ".join(percent(by[other].share) for other in others)
    rest = listed([repr(other) for other in others])
    why = f"the past of the others takes {percent(by[name].share)} off the error of predicting it, and "
    why += f"{back} off that of {rest}"
    if not any(by[one].share > 0 for one in (name, *others)):
        why = f"nothing in its past, or in that of the others, tells it from {rest}"
    return _because(one, name, why, found.given)


def _because(table: Table, name: str, why: str, given) -> Table:
    columns = tuple(replace(column, why=why) if column.name == name else column for column in table.columns)
    return worded(replace(table, columns=columns, given=given))
