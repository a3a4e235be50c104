"""Several estimators side by side: the same samples, one step ahead, none of them having seen what it predicts."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from time import perf_counter
from typing import Any

import numpy as np

from ..engine import validation
from ..engine.errors import InputError
from ..engine.status import Status
from ..estimators.base import is_estimator
from ..models.markup import as_typed
from ..results.summary import pool
from ..results.whiteness import score
from .forecast import forecast

TIED = 2.0  # deviations of the mean difference
LEAST = 10  # measured samples left out at the beginning, at least
POINTS = 2000  # of the path that is drawn, at most


@dataclass(frozen=True)
class Row:
    """How one estimator did; numbers are over the samples that were scored, the same for all.

    ``nlpd`` is the mean negative log predictive density (lower is better), ``difference`` what it lacks to the best
    one and ``difference_std`` how well that is known; ``alarms`` counts jumps reported; ``us_per_sample`` is wall time;
    ``unknowns`` are the parameters, and states, that are estimated.
    """

    name: str
    fit: float
    rmse: float
    nlpd: float
    nis: float
    coverage: float
    alarms: int
    us_per_sample: float
    unknowns: int
    difference: float
    difference_std: float

    @property
    def is_tied(self) -> bool:
        """Whether the best one is not clearly better."""
        return self.difference <= TIED * self.difference_std


class Comparison:
    """Estimators compared on a record that comes in pieces; memory does not grow. Print it for the table.

    Parameters
    ----------
    estimators : dict of name to estimator
        Of one output, with the same inputs or none, scaled to the data.
    settle : int, optional
        Measured samples at the beginning that are scored for none of them: twice the unknowns of the largest model,
        at least ten, if omitted.

    Notes
    -----
    A sample is scored where y is measured and every estimator had a forecast, outliers included: nobody chooses his
    own samples. The interval of a difference takes the samples' differences for independent.

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-0.8], [1.0], samples=400, noise_std=0.1, seed=1)
    >>> comparison = dw.analysis.Comparison({"first": dw.ARX(1, 1), "mean": dw.AR(0, offset=True)})
    >>> for part in (slice(0, 200), slice(200, 400)):
    ...     _ = comparison.add(y[part], u[part])
    >>> comparison.best
    'first'
    """

    def __init__(self, estimators: dict[str, Any], settle: int | None = None):
        self.estimators = dict(estimators)
        if not self.estimators:
            raise InputError(
                "estimators must be a dict with at least one estimator, such as {'arx': ARX(2, 2)}; got none"
            )
        inputs = {inputs_of(name, est) for name, est in self.estimators.items()} - {0}
        if len(inputs) > 1:
            raise InputError(f"estimators must have the same inputs, or none, got {sorted(inputs)} of them")
        self.inputs = max(inputs, default=0)
        self.unknowns = [unknowns_of(est) for est in self.estimators.values()]
        largest = max(one.model.N for est in self.estimators.values() for one in est.members or [est])
        self.settle = max(2 * largest, LEAST) if settle is None else validation.count("settle", settle)
        M = len(self.estimators)
        self.samples = self.measured = self.scored = 0
        self._states: list[Any] = [None] * M
        self._pool = (0, 0.0, 0.0)
        self._squares, self._nis, self._nis_count, self._inside = np.zeros((4, M))
        self._alarms, self._seconds = np.zeros(M, int), np.zeros(M)
        self._log, self._differences, self._products = np.zeros(M), np.zeros(M), np.zeros((M, M))
        self._path: list[tuple[float, np.ndarray]] = []  # time, log densities so far
        self._stride, self._passed = 1, 0

    @property
    def names(self) -> list[str]:
        """Names of the estimators, as they were given."""
        return list(self.estimators)

    def add(self, y, u=None, time=None) -> Comparison:
        """Take in the next stretch of the record: y (T,), u (T, k), and the instants (T,) if they are to be kept."""
        y, u = validation.record(y, u if self.inputs else None, self.inputs)
        if not len(y):
            return self
        time = np.arange(self.samples, self.samples + len(y)) if time is None else validation.floats("time", time)
        found = [self._scan(i, y, u) for i in range(len(self.unknowns))]
        is_measured = np.isfinite(y)
        late = self.measured + np.cumsum(is_measured) > self.settle
        use = is_measured & late & np.all([np.isfinite(one.log_density) for one in found], axis=0)
        self.samples, self.measured = self.samples + len(y), self.measured + int(is_measured.sum())
        self.scored += int(use.sum())
        self._pool = pool(*self._pool, y[use])
        for i, one in enumerate(found):
            e = one.innovation[use]
            self._squares[i] += float(np.einsum("t,t->", e, e))
            total, _, count = score(e, one.variance[use], one.dof[use])
            self._nis[i] += total
            self._nis_count[i] += count
            self._inside[i] += int(np.count_nonzero(one.is_inside[use]))
        log = np.array([one.log_density[use] for one in found])
        self._log += log.sum(axis=1)
        apart = log - log[0]
        self._differences += apart.sum(axis=1)
        self._products += apart @ apart.T
        self._keep(time[use], np.cumsum(log, axis=1) + (self._log - log.sum(axis=1))[:, None])
        return self

    def _scan(self, i: int, y, u):
        """Run one estimator on and return its forecasts."""
        est = list(self.estimators.values())[i]
        u = u if inputs_of("", est) else None
        if self._states[i] is None:
            est.scan(y[:1], None if u is None else u[:1])  # compiled now, not on the clock
        state, start = self._states[i], perf_counter()
        trace = est.scan(y, u, state=state)
        self._seconds[i] += perf_counter() - start
        self._states[i] = trace.state
        self._alarms[i] += int(np.count_nonzero(trace.status & int(Status.JUMP)))
        return forecast(trace)

    def _keep(self, time, log) -> None:
        """Keep every so many of the log densities, for the figure."""
        for k in range(-self._passed % self._stride, len(time), self._stride):
            self._path.append((float(time[k]), log[:, k].copy()))
        self._passed += len(time)
        while len(self._path) > POINTS:
            self._path = self._path[::2]
            self._stride *= 2

    # --- the numbers ---------------------------------------------------------------------------------------

    @property
    def rows(self) -> list[Row]:
        """The estimators, best first: by the log density they gave to what came."""
        n = self.scored
        if not n:
            raise InputError(
                f"no sample could be scored: {self.measured} outputs were measured, and the first {self.settle} settle "
                "the priors. Give a longer record, smaller models, or a smaller settle"
            )
        std = math.sqrt(self._pool[2] / n)
        nlpd = -self._log / n
        order = np.argsort(nlpd, kind="stable")
        found = []
        for i in order.tolist():
            rmse, difference, spread = math.sqrt(self._squares[i] / n), *self._difference(i, int(order[0]))
            found.append(
                Row(
                    self.names[i], 100 * (1 - rmse / std) if std > 0 else math.nan, rmse, float(nlpd[i]),
                    float(self._nis[i] / self._nis_count[i]) if self._nis_count[i] else math.nan,
                    float(self._inside[i]) / n, int(self._alarms[i]), 1e6 * float(self._seconds[i]) / self.samples,
                    self.unknowns[i], difference, spread,
                )
            )  # fmt: skip
        return found

    def _difference(self, i: int, best: int) -> tuple[float, float]:
        """Return by how much the mean log density of ``best`` is higher, and the deviation of that mean."""
        n = self.scored
        mean = (self._differences[best] - self._differences[i]) / n
        square = (self._products[best, best] - 2 * self._products[best, i] + self._products[i, i]) / n
        return float(mean), math.sqrt(max(square - mean * mean, 0.0) / n)

    @property
    def best(self) -> str:
        """Name of the best estimator."""
        return self.rows[0].name

    @property
    def tied(self) -> list[str]:
        """Names of the estimators that are not clearly worse than the best one."""
        return [row.name for row in self.rows[1:] if row.is_tied]

    @property
    def path(self) -> tuple[np.ndarray, np.ndarray]:
        """Time (P,), and the log density that each estimator gave to the samples so far (P, M), thinned out."""
        time, log = zip(*self._path) if self._path else ((), np.zeros((0, len(self.names))))
        return np.array(time, float), np.array(log)

    @property
    def words(self) -> str:
        """The outcome in plain words."""
        rows, lost = self.rows, self.samples - self.scored
        said = [f"{rows[0].name} predicts best"]
        if self.tied:
            said = [f"{', '.join([rows[0].name, *self.tied])} predict equally well"]
            least = min((row for row in rows if row.is_tied), key=lambda row: row.unknowns)
            said.append(f"{least.name} does so with the fewest unknowns ({least.unknowns})")
        elif len(rows) > 1:
            lead = f"{rows[1].difference:.2g} \u00b1 {rows[1].difference_std:.1g} nats per sample"
            said[0] += f", {lead} ahead of {rows[1].name}"
        said.append(f"{self.scored} of {self.samples} samples were scored, the same for all")
        missing = self.samples - self.measured
        if lost:
            said[-1] += f" ({self.settle} settle the priors" + (f", {missing} of y missing)" if missing else ")")
        return ". ".join(said) + "."

    def columns(self) -> dict[str, list]:
        """Return the table by name of its columns, best first."""
        rows = [asdict(row) | {"is_tied": row.is_tied} for row in self.rows]
        return {name: [row[name] for row in rows] for name in rows[0]}

    def as_dict(self) -> dict[str, Any]:
        """Return everything as plain values."""
        return {
            "samples": self.samples, "measured": self.measured, "scored": self.scored, "settle": self.settle,
            "rows": [asdict(row) | {"is_tied": row.is_tied} for row in self.rows], "words": self.words,
        }  # fmt: skip

    def __str__(self):
        cells = [HEAD, *(shown(row) for row in self.rows)]
        wide = [max(len(line[j]) for line in cells) for j in range(len(HEAD))]
        lines = ["  ".join([line[0].ljust(wide[0]), *map(str.rjust, line[1:], wide[1:])]) for line in cells]
        return "\n".join([*lines, self.words])

    __repr__ = __str__

    def _repr_html_(self):
        return as_typed(str(self))


HEAD = ["", "fit %", "rmse", "nlpd", "NIS", "in 95 %", "alarms", "us", "unknowns"]


def shown(row: Row) -> list[str]:
    """Return a row as one prints it; ``=`` marks one that is not clearly worse than the best."""
    tie = " =" if row.is_tied and row.difference > 0 else ""
    return [
        row.name + tie, f"{row.fit:.1f}", f"{row.rmse:.4g}", f"{row.nlpd:.3f}", f"{row.nis:.2f}",
        f"{100 * row.coverage:.1f}", str(row.alarms), f"{row.us_per_sample:.2g}", str(row.unknowns),
    ]  # fmt: skip


def inputs_of(name: str, est) -> int:
    """Return how many inputs an estimator of one output has."""
    if not is_estimator(est) or est.y_scale is None or np.ndim(est.y_scale):
        raise InputError(f"estimators[{name!r}] must be an estimator of one output, such as ARX(2, 2), got {est!r}")
    return est.model.inputs


def unknowns_of(est) -> int:
    """Return how many numbers an estimator estimates; of an average, all its members'."""
    return sum(map(unknowns_of, est.members)) if est.members else int(est.model.N)


def compare(y, u=None, estimators=None, *, settle: int | None = None) -> Comparison:
    """Return how well several estimators predict the next sample of the same record: a table, best first.

    Parameters
    ----------
    y : (T,)
        Outputs; NaN where missing.
    u : (T,) or (T, k), optional
        Inputs, for those estimators that have any.
    estimators : dict of name to estimator
        Of one output, scaled to the data (`scaled_to`).
    settle : int, optional
        Measured samples at the beginning that are left out for all: twice the unknowns of the largest model, at
        least 10, if omitted.

    Returns
    -------
    Comparison

    Notes
    -----
    Every number is prequential: one pass, one step ahead, nothing tuned on what is predicted. The order is that of the
    log predictive density (Dawid 1984), which asks for right error bars too; a fit does not. An estimator is tied with
    the best where the mean difference is below two of its deviations.

    Bad at: what happens several steps ahead, and differences of records whose samples hang together (the deviation
    takes them for independent).

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=600, noise_std=0.3, seed=1)
    >>> found = dw.compare(y, u, {"first": dw.ARX(1, 1), "second": dw.ARX(2, 2), "none": dw.AR(2)})
    >>> [(row.name, round(row.fit)) for row in found.rows]
    [('second', 96), ('none', 84), ('first', 72)]
    >>> print(found.words)
    second predicts best, 1.3 ± 0.04 nats per sample ahead of none. 590 of 600 samples were scored, the same for all
    (10 settle the priors).
    """
    if not isinstance(estimators, dict):
        raise InputError(f"estimators must be a dict of name to estimator, got {type(estimators).__name__}")
    return Comparison(estimators, settle).add(y, u)
