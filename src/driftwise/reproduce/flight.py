"""One recorded flight, and every filter run over it: the whole record, records of 50, a sweep of noise polynomials."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from . import radar_data
from . import radar_filters as filters
from .records import ljung_box

SKIP, LENGTH = 12, 50  # plots before scoring; the paper's record
RHOS = (0.0, 0.2, 0.35, 0.5, 0.65, 0.75, 0.85)
WALK = 1e-3
AXES = ("East", "North")
PAPERS = "the paper's form: three free coefficients"
HELD = "two poles held at 1, one constant"
WALKING = "two poles held at 1, one walking"
SINGERS = "the paper's form started from Singer"
CV, SINGER = "constant velocity", "Singer"


def rmse(error, part=slice(SKIP, None)):
    """Return the root mean square of the finite errors from the 12th plot on."""
    return float(np.sqrt(np.nanmean(error[part] ** 2)))


class Flight:
    """The track and everything that was run over it."""

    def __init__(self, track: radar_data.Track):
        self.track, self.y, self.period = track, track.y, track.period
        self.fixed = {kind: filters.tuned(kind, self.y, self.period) for kind in (CV, SINGER)}

    def free(self, y, rho=0.35, m=3):
        """The paper's form over one coordinate: its trace and `Outcome`."""
        return filters.follow(filters.joint(y, self.period, rho, m, poles_held=False), y)

    def held(self, y, rho=0.5, m=2):
        """Two poles at 1 by a prior of rank one, the third constant."""
        return filters.follow(filters.joint(y, self.period, rho, m, poles_held=True), y)

    def walking(self, y, rho=0.5, m=2):
        """Two poles at 1 by differences, the third a random walk: (phi, `Outcome`)."""
        return filters.follow_differences(filters.joint_of_differences(y, self.period, rho, m, WALK), y)

    def outcomes(self, y):
        """Return name -> `Outcome` per coordinate of a (T, 2) record, every filter started afresh."""
        found = {kind: flt(y) for kind, flt in self.fixed.items()}
        columns = [y[:, i] for i in range(2)]
        found[PAPERS] = [self.free(c)[1] for c in columns]
        found[SINGERS] = [
            filters.follow(filters.joint_of_singer(self.fixed[SINGER], self.period), c)[1] for c in columns
        ]
        found[HELD] = [self.held(c)[1] for c in columns]
        found[WALKING] = [self.walking(c)[1] for c in columns]
        return found

    @cached_property
    def whole(self):
        """Outcomes over the whole record."""
        return self.outcomes(self.y)

    @cached_property
    def ratios(self):
        """RMSE over that of the tuned constant-velocity filter, name -> (East, North)."""
        found = {name: self.errors(name) for name in self.whole}
        return {name: value / found[CV] for name, value in found.items()}

    def errors(self, name):
        """Return the RMSE of a filter over the whole record, East and North."""
        return np.array([rmse(self.y[:, i] - self.whole[name][i].prediction) for i in range(2)])

    def calibration(self, name):
        """Return NIS, share inside the 95 % bands, and Ljung-Box(5) p, each East and North."""
        found = []
        for i in range(2):
            outcome, e = self.whole[name][i], (self.y[:, i] - self.whole[name][i].prediction)[SKIP:]
            ok = np.isfinite(e)
            z = e[ok] / np.sqrt(outcome.variance[SKIP:][ok])
            found.append((np.mean(z * z), np.mean(np.abs(e[ok]) <= outcome.band[SKIP:][ok]), ljung_box(z, 5)[0]))
        return np.array(found).T

    def noise(self, start, stop):
        """Return the standard deviation of the constant-velocity innovations between two minutes, both coordinates."""
        part = (self.track.time >= 60 * start) & (self.track.time < 60 * stop)
        return float(np.nanstd([self.y[part, i] - self.whole[CV][i].prediction[part] for i in range(2)]))

    @cached_property
    def sweep(self):
        """RMSE over rho: (form, m) -> (2, len(RHOS))."""
        ways = {
            ("paper's form", 3): self.free,
            ("paper's form", 2): self.free,
            ("two poles held, walking", 3): self.walking,
            ("two poles held, walking", 2): self.walking,
        }
        return {
            (name, m): np.array([[rmse(c - way(c, rho, m)[1].prediction) for rho in RHOS] for c in self.y.T])
            for (name, m), way in ways.items()
        }

    @property
    def starts(self):
        """Where the records of 50 begin (on a plot that was seen)."""
        return [s for s in range(0, len(self.y) - LENGTH + 1, LENGTH) if np.isfinite(self.y[s, 0])]

    @cached_property
    def pieces(self):
        """Records of 50 plots from scratch: name -> RMSE over that of CV, (pieces, 2 coordinates, 2 windows)."""
        found: dict[str, list] = {}
        for start in self.starts:
            y = self.y[start : start + LENGTH]
            each = {
                name: np.array(
                    [[rmse(y[:, i] - o[i].prediction, w) for w in (slice(6, 15), slice(15, LENGTH))] for i in range(2)]
                )
                for name, o in self.outcomes(y).items()
            }
            for name, value in each.items():
                found.setdefault(name, []).append(value / each[CV])
        return {name: np.array(values) for name, values in found.items()}

    @cached_property
    def settling(self):
        """Per coordinate: a over time (T, 3), its std, and the last relative step above 2 % among the first 50."""
        found = []
        for c in self.y.T:
            trace, _ = self.free(c)
            a, std = trace.parameters[:, ::-1], trace.parameters_std[:, ::-1]
            step = np.linalg.norm(np.diff(a[:LENGTH], axis=0), axis=1) / np.linalg.norm(a[1:LENGTH], axis=1)
            found.append((a, std, int(np.flatnonzero(step > 0.02).max()) + 1))
        return found
