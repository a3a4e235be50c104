"""One recorded track, and everybody who follows it plot by plot: fixed dynamics, the joint form, the bank."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

import driftwise as dw

from . import fixed_filters, radar_filters
from .radar_data import on_grid
from .recordings import Kind, Series
from .records import ljung_box

SKIP, LENGTH = 12, 50  # plots before scoring; the paper's record
RHOS = (0.0, 0.2, 0.35, 0.5, 0.65, 0.75, 0.85)
AXES = ("East", "North")
PAPERS = "the paper's form: three free coefficients"
SINGERS = "the paper's form started from Singer"
MANOEUVRE = "Manoeuvre: two poles held at 1, one learnt"
SHIPPED = "TrackEstimator: a bank, nothing tuned"
CV, SINGER, IMM = "constant velocity", "Singer", "IMM"


class Outcome(NamedTuple):
    """One-step predictions of one coordinate at its plots, their variances, half-widths of 95 % intervals."""

    prediction: np.ndarray
    variance: np.ndarray
    band: np.ndarray


def rmse(error, part=slice(SKIP, None)):
    """Return the root mean square of the errors from the 12th plot on."""
    return float(np.sqrt(np.mean(error[part] ** 2)))


def tuned(kinds, series: list[Series], kind: Kind) -> dict[str, np.ndarray]:
    """Return the logarithms of the numbers of fixed filters, most likely on these very series."""
    return {name: fixed_filters.tuned(name, series, kind.v0, kind.a0) for name in kinds}


class Flight:
    """A track of T plots, (T, 2), the speed of its class, and the fixed filters that were tuned for it."""

    def __init__(self, time, y, kind: Kind, fixed: dict[str, np.ndarray]):
        self.time, self.y, self.kind, self.fixed = time - time[0], y, kind, fixed
        self.grid, self.period = on_grid(time, y)
        self.seen = np.isfinite(self.grid[:, 0])
        self._followed: dict[str, list[Outcome]] = {}

    def cut(self, length: int = LENGTH) -> list[Flight]:
        """Return the records of so many plots that the track falls into, each a track of its own."""
        parts = (slice(s, s + length) for s in range(0, len(self.y) - length + 1, length))
        return [Flight(self.time[p], self.y[p], self.kind, self.fixed) for p in parts]

    # --- who follows it ------------------------------------------------------------------------------------

    def constant(self, name):
        """Return the `Outcome` of a fixed filter per coordinate, at the times of the plots."""
        found = []
        for y in self.y.T:
            one = Series("", self.time, y)
            mean, S = fixed_filters.forecast(name, self.fixed[name], one, self.kind.v0, self.kind.a0)
            found.append(Outcome(mean, S, 1.96 * np.sqrt(S)))
        return found

    def _scan(self, est, i):
        """Return the trace of one coordinate on the grid, from its first plot as zero, and its `Outcome`."""
        y = self.grid[:, i]
        trace = est.scan(y - y[0])
        return trace, Outcome(
            (trace.prediction + y[0])[self.seen], trace.variance[self.seen], trace.band(0.95)[self.seen]
        )

    def free(self, i, rho=0.35, m=3):
        """Return trace and `Outcome` of the paper's form."""
        return self._scan(radar_filters.joint(self.grid[:, i], self.period, rho, m, self.kind.v0), i)

    def manoeuvre(self, i, rho=0.5, m=2):
        """Return trace and `Outcome` of `Manoeuvre`."""
        return self._scan(dw.tracking.Manoeuvre(rho, m, dt=self.period).scaled_to(self.grid[:, i]), i)

    def from_singer(self, i):
        """Return trace and `Outcome` of the paper's form started from the tuned Singer filter."""
        q, r, alpha = np.exp(self.fixed[SINGER])
        return self._scan(radar_filters.joint_of_singer(alpha, q, r, self.period), i)

    @cached_property
    def shipped(self):
        """What the shipped estimator says of both coordinates."""
        return dw.TrackEstimator(self.kind.v0).scan(self.time, self.y)

    def bank(self):
        """Return the `Outcome` of the shipped estimator per coordinate."""
        trace = self.shipped
        band = trace.band(0.95)
        return [Outcome(trace.prediction[:, i], trace.variance[:, i], band[:, i]) for i in range(2)]

    @cached_property
    def names(self) -> list[str]:
        """Everybody who follows the track."""
        singers = [SINGERS] if SINGER in self.fixed else []
        return [*self.fixed, PAPERS, *singers, MANOEUVRE, SHIPPED]

    def outcome(self, name) -> list[Outcome]:
        """Return the `Outcome` of one of them per coordinate, started afresh, worked out when it is first asked for."""
        if name not in self._followed:
            ways = {PAPERS: self.free, SINGERS: self.from_singer, MANOEUVRE: self.manoeuvre}
            if name in ways:
                self._followed[name] = [ways[name](i)[1] for i in range(2)]
            else:
                self._followed[name] = self.bank() if name == SHIPPED else self.constant(name)
        return self._followed[name]

    # --- how well ------------------------------------------------------------------------------------------

    def error(self, name, i):
        """Return the errors of one coordinate at every plot."""
        return self.y[:, i] - self.outcome(name)[i].prediction

    def errors(self, name, part=slice(SKIP, None)):
        """Return the RMSE, East and North."""
        return np.array([rmse(self.error(name, i), part) for i in range(2)])

    def ratios(self, name, reference=CV, part=slice(SKIP, None)):
        """Return the RMSE over that of a fixed filter, East and North."""
        return self.errors(name, part) / self.errors(reference, part)

    def calibration(self, name):
        """Return NIS, shares inside 95 % bands and within two sigma, Ljung-Box(5); East and North each."""
        from scipy.stats import chi2

        found = []
        for i in range(2):
            outcome, e = self.outcome(name)[i], self.error(name, i)[SKIP:]
            z = e / np.sqrt(outcome.variance[SKIP:])
            inside = np.mean(np.abs(e) <= outcome.band[SKIP:])
            found.append((np.mean(z * z), inside, np.mean(np.abs(z) <= 2), chi2.isf(ljung_box(z, 5)[0], 5)))
        return np.array(found).T

    def noise(self, start, stop):
        """Return the standard deviation of the constant-velocity innovations between two minutes, both coordinates."""
        part = (self.time >= 60 * start) & (self.time < 60 * stop)
        return float(np.std([self.error(CV, i)[part] for i in range(2)]))

    @cached_property
    def sweep(self):
        """RMSE over rho: (form, m) -> (2, len(RHOS))."""
        ways = {"paper's form": self.free, "Manoeuvre": self.manoeuvre}
        return {
            (name, m): np.array([[rmse(self.y[:, i] - way(i, rho, m)[1].prediction) for rho in RHOS] for i in range(2)])
            for name, way in ways.items()
            for m in (3, 2)
        }

    @cached_property
    def settling(self):
        """Per coordinate: a over time (T, 3), its std, and the last relative step above 2 % among the first 50."""
        found = []
        for i in range(2):
            trace, _ = self.free(i)
            a, std = trace.parameters[:, ::-1], trace.parameters_std[:, ::-1]
            step = np.linalg.norm(np.diff(a[:LENGTH], axis=0), axis=1) / np.linalg.norm(a[1:LENGTH], axis=1)
            found.append((a, std, int(np.flatnonzero(step > 0.02).max()) + 1))
        return found
