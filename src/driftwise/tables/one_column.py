"""What one column of a table says of itself: its values, and whether by them, or by its name, it can take no part."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..engine.holding import held
from .calendar import is_beyond
from .cleaning import Belief
from .column_roles import SCORES, Name
from .stuck_sensor import Segment

DOUBTFUL = 0.5  # share of the rows whose values are not believed, above which a column is no signal
PACED = 0.8  # share of the steps from value to value that are alike where a column is measured every so many rows
LEAST_ROWS, EARLY = 100, 0.1  # rows, and the share of them, after which a column without a value is none
STEPS, LASTS = 2, 6  # of a column that says when something was done, at most; rows that each of its values lasts
MARKS = 20  # values that a mark may have, at most
MEASURED = frozenset(("anomaly", "class", "quality"))  # marks by name that may be quantities: a deviation, seats


@dataclass(frozen=True)
class Column:
    """One column of a table.

    role : "time", "output", "input", or why it is neither: "text", "empty", "constant", "duplicate", "counter",
        "label", "event", "stuck", "doubted", "spare"
    why : the reason, in a few words
    unit : from a row of units or from the name, "" if there is none
    missing : share of the first rows without a value
    resolution : the step in which values are written, 0 where none shows
    belief : range, drop-outs and codes for "missing" (`Belief`), None where the column holds no numbers
    doubted : values of the first rows that are not believed
    helps : share of the error variance of a prediction that a proposed input takes away
    stuck : segments of the first rows in which the sensor is stuck
    ten : power of ten that the numbers are counted in
    """

    name: str
    role: str = "spare"
    why: str = ""
    unit: str = ""
    missing: float = 0.0
    resolution: float = 0.0
    belief: Belief | None = None
    doubted: int = 0
    helps: float = 0.0
    stuck: tuple[Segment, ...] = ()
    ten: int = 0


def measured(name: str, values, unit: str, belief: Belief, doubt) -> Column:
    """Return what the values of one column say of it alone."""
    fine = values[np.isfinite(values) & ~doubt]
    missing = float(np.mean(~np.isfinite(values)))
    column = Column(name, "spare", "", unit, missing, _resolution(fine), belief, int(doubt.sum()))
    if not fine.size:
        return replace(column, role="empty", why="no value")
    if fine.min() == fine.max():
        return replace(column, role="constant", why=f"always {fine[0]:g}")
    last = int(np.flatnonzero(np.isfinite(values))[-1])
    if len(values) >= LEAST_ROWS and last < EARLY * len(values):  # settings, beside the first rows
        return replace(column, role="empty", why=f"no value after row {last + 1}")
    moves = np.flatnonzero(np.diff(fine))
    still = fine.size - 1 - moves[-1]
    if still > 50 and still >= 0.5 * fine.size and moves.size > 0.5 * (fine.size - still):
        return replace(column, role="stuck", why=f"reads {fine[-1]:g} for the last {still} of {fine.size} values")
    return column


def _resolution(values) -> float:
    """Return the step of a column that is written in steps, 0 where none shows."""
    levels = np.unique(values)
    if levels.size < 2 or levels.size > 0.5 * values.size:
        return 0.0
    gaps = np.diff(levels)
    step = float(np.quantile(gaps, 0.05))
    gaps = gaps[gaps > 0.5 * step] / step
    return float(f"{step:.6g}") if np.mean(np.abs(gaps - np.round(gaps)) < 0.15) > 0.9 else 0.0


def _is_paced(values) -> bool:
    """Whether a column has a value every so many rows, as one that is measured less often than the others.

    >>> k = np.arange(70)
    >>> _is_paced(np.where(k % 7, np.nan, 1.0)), _is_paced(np.where(k % 7 * (k % 5), np.nan, 1.0))
    (True, False)
    """
    steps = np.diff(np.flatnonzero(np.isfinite(values)))
    return steps.size > 1 and bool(np.mean(steps == np.median(steps)) > PACED)


def is_event(name: Name, values) -> bool:
    """Whether a column says when something was done: it seldom steps, and its name is of no cause and no effect.

    >>> from driftwise.tables.column_roles import parse
    >>> law = np.repeat([0.0, 1.0], 20)
    >>> is_event(parse("law"), law), is_event(parse("heater"), law), is_event(parse("temperature"), law)
    (True, False, False)
    """
    return name.score == 0.0 and bool(seldom_steps(held(values)))


def seldom_steps(x) -> list[int]:
    """Return the rows at which a column steps, where it seldom does and stays there; none of any other.

    >>> [seldom_steps(np.repeat([0.0, 1.0, 0.0], [20, many, 20])) for many in (20, 1)], seldom_steps(np.arange(9.0))
    ([[20, 40], []], [])
    """
    found = np.flatnonzero(np.diff(x)) + 1
    lasting = np.diff([0, *found, len(x)])
    return found.tolist() if len(found) <= STEPS and lasting.min() >= LASTS else []


def barred_by_itself(name: Name, column: Column, values):
    """Return (role, why) of a column that takes no part by what it is itself, None if it may."""
    if column.role != "spare":
        return column.role, column.why
    kinds = name.kinds
    if column.doubted > DOUBTFUL * len(values) and not _is_paced(values):
        return "doubted", f"{column.doubted} of its first {len(values)} values stand for a missing one"
    fine = values[np.isfinite(values)]
    whole = bool(np.all(fine == np.round(fine)))
    is_measured = bool(MEASURED & set(name.words)) and not whole and len(np.unique(fine)) > MARKS
    if "label" in kinds and "output" not in kinds and not is_measured:
        return "label", "a mark that somebody set, by its name"
    if kinds & {"time", "calendar"} and not kinds & SCORES.keys() and not is_beyond(name.base, fine):
        return "counter", "a part of the calendar, by its name"
    steps = np.diff(fine)
    if whole and steps.size and np.all((steps == 0) | (steps == 1)) and not kinds & SCORES.keys() - {"source"}:
        if steps.sum() >= 2:
            return "counter", "counts upwards"
    is_index = "rownames" in name.words and len(np.unique(fine)) == len(fine)  # of a table that was sorted since
    is_index |= name.base == "column1" and bool(np.all(steps > 0))  # of one of which some rows were taken
    if whole and (is_index or ("counter" in kinds and np.mean(steps >= 0) > 0.95)):
        return "counter", "counts, by its name" if "counter" in kinds else "counts upwards"
    if "logger" in kinds and name.score > -2:
        return "logger", "of the logger itself, by its name"
    return None
