"""Who in a fleet needs a look: who jumped, drifts, differs from the rest, was taught nothing, is not to be believed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..results.sentences import SOMETHING
from .counters import FEW, never_moved
from .fleet_snapshot import Census, census
from .reasons import reason
from .robust import Burst, Rest, bursts, discoveries, rest_of

KINDS = {
    "jumped": SOMETHING,
    "drifts": "parameters drift",
    "differs": "not like the rest",
    "noise": "louder or quieter than the rest",
    "untaught": "not identifiable",
    "bars": "error bars not to be believed",
    "data": "poor data",
}
FALSE = 0.01  # share of false discoveries among those that differ, are louder, or have wrong bars
STILL = 0.2  # probability of standing still below which a series drifts
UNTAUGHT = 0.5  # posterior over prior variance above which a combination counts as unlearnt
NIS, HELD = (0.8, 1.25), (0.92, 0.975)  # no closer than matters in practice
LEAST = 8  # series that make a fleet
MISSING, BAD = 0.2, 0.01  # shares beyond which data are poor; BAD also of late and duplicate rows
SHORT = 4  # measured samples for each unknown
ALARMS = 1e-5  # false jumps of `AutoMemory`, at most, a sample


class Found(NamedTuple):
    """Those of one kind, worst first: their row in the fleet, and how bad it is."""

    rows: np.ndarray
    scores: np.ndarray


@dataclass(frozen=True)
class Outliers:
    """What `outliers` returns.

    Attributes
    ----------
    found : for each of `KINDS`, rows of the fleet and scores, worst first: the number of jumps, the probability of
        drift, deviations from the rest (parameters, noise), posterior over prior variance, NIS or coverage in
        deviations from what it should be, the share of poor rows
    census, rest : the columns that were judged, and what the rest of the fleet is like
    together : jumps of many at one time, the most first
    """

    keys: list
    found: dict[str, Found]
    census: Census
    rest: Rest
    together: list[Burst]
    say: Callable[[str, int], str]

    def words(self, kind: str, row: int) -> str:
        """Return in one sentence why a series is listed."""
        return self.say(kind, row)

    @property
    def rows(self) -> np.ndarray:
        """The rows of all that need a look, in order."""
        return np.unique(np.concatenate([found.rows for found in self.found.values()]).astype(int))

    def table(self, most: int = 20) -> list[tuple[Any, str, float, str]]:
        """Return (key, kind, score, words) of the worst ``most`` of each kind."""
        return [
            (self.keys[row], kind, float(score), self.words(kind, row))
            for kind, (rows, scores) in self.found.items()
            for row, score in zip(rows[:most].tolist(), scores[:most])
        ]


def outliers(fleet, tally, *, inputs=(), when: Callable[[float], str] = "{:.6g}".format) -> Outliers:
    """Return who in a fleet needs a look, from the final states and the counts alone.

    Parameters
    ----------
    fleet : Fleet
    tally : mapping of names to (S,) counts of the series, in the fleet's order: a `Tally`
    inputs : names of the inputs, for the words
    when : how a time is written

    Returns
    -------
    Outliers

    Notes
    -----
    A parameter differs where it lies further from the fleet's median than the spread of the fleet (median absolute
    deviation, its own share taken out) and the series' own deviation explain together. Over all series and parameters
    the share of false discoveries is 1 % (Benjamini and Hochberg 1995); in a fleet of one kind, one in a hundred names
    anybody at all. Offsets are not compared. NIS and coverage are judged at the same rate, and no closer than matters
    (0.8 to 1.25, 92 to 97.5 %).

    Drift is what `AutoMemory` says of the end of the record: standing still is less than 20 % likely; of those that do
    stand still at most 1 in 200 is named. Jumps are counted as they were told, false alarms and all (`AutoMemory`: at
    most 1 in 100 000 samples).

    Bad at: fleets of several kinds side by side (the smaller kind differs), and fewer than 8 series, which nobody can
    differ from; a series that drifted, jumped or differed and is as it should be now.
    """
    columns, N = census(fleet), len(fleet.estimators[0].names)
    rest, moves = rest_of(columns, UNTAUGHT), ~never_moved(tally)
    spoken = {
        "jumped": _ranked(tally["jumps"] > 0, tally["jumps"]),
        "drifts": _ranked((columns.still < STILL) & (tally["measured"] > 0), 1 - columns.still),
        "differs": _differs(rest),
        "noise": _ranked(moves & _unlike(rest.noise_z[:, None]), abs(rest.noise_z)),
        "untaught": _untaught(columns, tally, N, moves),
        "bars": _bars(tally, moves),
        "data": _data(tally, N),
    }
    return Outliers(
        fleet.keys, spoken, columns, rest, bursts(tally), lambda kind, row: reason(
            kind, row, fleet=fleet, tally=tally, census=columns, rest=rest, inputs=inputs, when=when
        )
    )  # fmt: skip


def _ranked(is_one, score) -> Found:
    """Return the chosen, the highest score first."""
    rows = np.flatnonzero(is_one)
    rows = rows[np.argsort(-score[rows], kind="stable")]
    return Found(rows, np.asarray(score[rows], float))


def _unlike(z) -> np.ndarray:
    """Say which series differ in any of their columns (S, N) of standard normal z, NaN where there is none."""
    from scipy.special import ndtr

    if len(z) < LEAST or not z.shape[1]:
        return np.zeros(len(z), bool)
    size = np.max(np.abs(np.nan_to_num(z)), axis=1)
    tried = np.isfinite(z).sum(axis=1)
    return discoveries(np.where(tried > 0, np.minimum(2 * ndtr(-size) * tried, 1.0), np.nan), FALSE)


def _differs(rest: Rest) -> Found:
    score = np.max(np.abs(np.nan_to_num(rest.z)), axis=1, initial=0.0)
    return _ranked(_unlike(rest.z), score)


def _untaught(columns: Census, tally, N: int, moves) -> Found:
    """Return who was taught nothing of some combination, although there were samples enough that moved."""
    is_long = moves & (tally["measured"] >= SHORT * N)
    score = np.where(columns.moves.all(axis=1), np.nan_to_num(columns.untaught), 1.0)
    return _ranked(is_long & (score > UNTAUGHT), score)


def _bars(tally, moves) -> Found:
    """Return whose innovations are not as large as they were said to be."""
    from scipy.special import ndtr

    count = np.maximum(tally["scored"], 1.0)
    nis, held = tally["z2"] / count, tally["inside"] / count
    z = np.column_stack([(nis - 1) / np.sqrt(2 / count), (held - 0.95) / np.sqrt(0.95 * 0.05 / count)])
    matters = np.column_stack([_beyond(nis, NIS), _beyond(held, HELD)]) & (tally["scored"] >= FEW)[:, None]
    size = np.max(np.where(matters, np.abs(z), 0.0), axis=1)
    p = np.where(tally["scored"] >= FEW, np.minimum(4 * ndtr(-size), 1.0), np.nan)
    return _ranked(moves & discoveries(p, FALSE) & (size > 0), size)


def _beyond(value, bounds) -> np.ndarray:
    return (value < bounds[0]) | (value > bounds[1])


def _data(tally, N: int) -> Found:
    """Return whose rows are missing, broken, late, too few, or all the same."""
    rows = np.maximum(tally["samples"] + tally["late"] + tally["duplicate"], 1.0)
    missing, bad = tally["missing"] / rows, tally["bad"] / rows
    disorder = (tally["late"] + tally["duplicate"]) / rows
    is_nothing = (tally["measured"] < SHORT * N) | never_moved(tally)
    is_poor = (missing > MISSING) | (bad > BAD) | (disorder > BAD) | is_nothing
    return _ranked(is_poor, np.where(is_nothing, 1.0, missing + bad + disorder))
