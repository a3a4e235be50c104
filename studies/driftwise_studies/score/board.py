"""What is measured, a job a record: forecasts beside opponents, labelled changes, tracks beside tuned filters."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..papers import fixed_filters as filters
from . import labels, opponents, records, second
from . import tracks as recorded
from .labels import Found
from .ours import between_jumps, ours, tracked
from .protocol import Score, inside_and_density, judge

OURS, FROZEN, KALMAN, FADING = "driftwise", "frozen ARX", "Kalman, tuned", "RLS .995"
COLUMNS = (OURS, FROZEN, "RLS 1/n", FADING, "RLS .98", KALMAN, "last value", "straight line")
CONSTANT = COLUMNS[1:]


class Row(NamedTuple):
    """One record: the ARX structure of its first half, q of the Kalman filter, and a score per column."""

    name: str
    samples: int
    structure: opponents.Structure
    q: float
    scores: dict[str, Score]
    widest: float  # largest standard deviation we claimed in the second half, over the range of y
    seconds: float  # what driftwise took

    @property
    def best(self) -> tuple[str, float]:
        """The opponent with the best fit."""
        return max(((c, self.scores[c].fit) for c in CONSTANT), key=lambda pair: pair[1])

    @property
    def lead(self) -> float:
        """Our fit minus that of the best opponent, points."""
        return self.scores[OURS].fit - self.best[1]

    @property
    def density(self) -> float:
        """The better log score of the two opponents that claim a variance."""
        return max(self.scores[KALMAN].log_score, self.scores[FADING].log_score)


def opponents_of(y, u) -> tuple[opponents.Structure, float, dict[str, Score]]:
    """Return the structure of the first half, q of the Kalman filter, and the score of every opponent."""
    scale = opponents.first_half(y, u)
    Y, U = scale.apply(y, u)
    s = opponents.by_bic(Y, U)
    phi = opponents.regressors(Y, U, s)
    walk, q = opponents.random_walk(phi, Y, s.reach)
    found = {
        FROZEN: opponents.frozen(phi, Y),
        "RLS 1/n": opponents.rls(phi, Y, s.reach),
        FADING: opponents.rls(phi, Y, s.reach, 0.995),
        "RLS .98": opponents.rls(phi, Y, s.reach, 0.98),
        KALMAN: walk,
        "last value": opponents.last_value(Y),
        "straight line": opponents.straight_line(Y),
    }
    return s, q, {name: judge(y, *scale.undo(forecast)) for name, forecast in found.items()}


def row(name: str, where: Path) -> Row:
    """Return the scores of one record."""
    record = second.read(name, where)
    y, u, _ = record
    s, q, scores = opponents_of(y, u)
    began = time.perf_counter()
    mine = ours(*record)
    seconds = time.perf_counter() - began
    scores[OURS] = judge(y, mine.prediction, mine.variance, mine.inside, mine.log_score)
    half = slice(len(y) // 2, None)
    widest = float(np.sqrt(np.max(mine.variance[half])) / np.ptp(y[half]))
    return Row(name, len(y), s, q, scores, widest, seconds)


# --- labelled records --------------------------------------------------------------------------------------

DETECTORS = (OURS, "RLS .995, CUSUM 5", "RLS .995, CUSUM 10")


class Labelled(NamedTuple):
    """What every detector did on a labelled record, our alarms, and what our model said of gain and level."""

    name: str
    found: dict[str, list[Found]]
    alarms: list[int]
    truths: dict[str, np.ndarray]


def detectors(record: records.Record) -> dict[str, Any]:
    """Return the alarms of every detector on a record."""
    y, u, _ = record
    scale = opponents.first_half(y, u)
    Y, U = scale.apply(y, u)
    s = opponents.by_bic(Y, U)
    fading = opponents.rls(opponents.regressors(Y, U, s), Y, s.reach, 0.995)
    z = labels.running_score(Y - fading.prediction)
    return dict(zip(DETECTORS, (ours(*record).alarms, labels.cusum(z, h=5.0), labels.cusum(z, h=10.0))))


def labelled(name: str, where: Path) -> Labelled:
    """Return what the detectors did on one of the records of ``labels.CHANGES``."""
    record = labels.READ[name](where)
    alarms = detectors(record)
    changes = [c for c in labels.CHANGES if c.record == name]
    found = {d: [labels.look(a, c.clean, c.at, c.until) for c in changes] for d, a in alarms.items()}
    truths = {}
    if name in labels.FIRST_ORDER:
        nk, at = labels.FIRST_ORDER[name]
        truths = between_jumps(record.y, record.u, nk, at)._asdict()
    return Labelled(name, found, alarms[OURS].tolist(), truths)


def pump(name: str, where: Path) -> Labelled:
    """Return what the detectors did on the flow of one file of the pump rig."""
    alarms = detectors(records.flow_of(name)(where))
    onset = labels.pump_onset(where, name)
    found = {d: [labels.look(a, 0, onset, onset + labels.PUMP + 1)] for d, a in alarms.items()}
    return Labelled(name, found, alarms[OURS].tolist(), {})


def day(name: str, where: Path) -> Labelled:
    """Return what the detectors did on one day of the air handler, after two clean days to learn on."""
    record = records.air_handler_days(*labels.CLEAN_DAYS, f"2017-{name}")(where)
    midnight = len(record.y) - labels.DAY
    alarms = detectors(record)
    found = {d: [labels.look(a, midnight, midnight)] for d, a in alarms.items()}
    return Labelled(name, found, [int(a) - midnight for a in alarms[OURS] if a >= midnight], {})


# --- tracks ------------------------------------------------------------------------------------------------

SKIP = 12  # plots of a track that are not scored
UNTUNED, LAST = "six CV, untuned", "last value"
TRACKERS = (OURS, *filters.STARTS, UNTUNED, LAST)


class Tracks(NamedTuple):
    """A set of tracks: the fixed filter that is best in hindsight, and every method beside it, series by series."""

    name: str
    plots: int
    reference: str
    rmse: np.ndarray  # (S,) of the reference, m
    ratio: dict[str, np.ndarray]  # (S,) RMSE over that of the reference
    nis: dict[str, np.ndarray]
    share: dict[str, np.ndarray]  # % in 95 % bands
    density: dict[str, np.ndarray]  # mean log density minus that of the reference, higher is better
    seconds: float


def tracks(name: str, where: Path) -> Tracks:
    """Return how every method predicts the next plots of a set; fixed filters are tuned on this very set."""
    kind = recorded.SETS[name]
    series = recorded.series(name, where.parent / "tracking")
    found: dict[str, list] = {LAST: [_scored(s, *filters.last_value(s)) for s in series]}
    found[UNTUNED] = [_scored(s, *filters.bank(s, kind.v0)) for s in series]
    for fixed in filters.STARTS:
        logs = filters.tuned(fixed, series, kind.v0, kind.a0)
        found[fixed] = [_scored(s, *filters.forecast(fixed, logs, s, kind.v0, kind.a0)) for s in series]
    began = time.perf_counter()
    mine = [m for pair in zip(series[::2], series[1::2]) for m in tracked(*pair, kind.v0)]
    seconds = time.perf_counter() - began
    found[OURS] = [_scored(s, m.prediction, m.variance, m.inside, m.log_score) for s, m in zip(series, mine)]
    table = {method: np.array(rows).T for method, rows in found.items()}
    reference = min(filters.STARTS, key=lambda m: np.mean(np.log(table[m][0])))
    rmse, _, _, density = table[reference]
    return Tracks(
        name,
        sum(len(s.y) for s in series) // 2,
        reference,
        rmse,
        {m: t[0] / rmse for m, t in table.items()},
        {m: t[1] for m, t in table.items()},
        {m: t[2] for m, t in table.items()},
        {m: t[3] - density for m, t in table.items()},
        seconds,
    )


def _scored(series, prediction, variance, inside=None, log_score=None) -> tuple[float, float, float, float]:
    """Return RMSE, NIS, share in 95 % bands and log score of a series without its first plots."""
    e = series.y - prediction
    inside, log_score = inside_and_density(e, variance, inside, log_score)
    rmse, nis = np.sqrt(np.mean(e[SKIP:] ** 2)), np.mean(e[SKIP:] ** 2 / variance[SKIP:])
    return float(rmse), float(nis), float(100 * np.mean(inside[SKIP:])), float(np.mean(log_score[SKIP:]))
