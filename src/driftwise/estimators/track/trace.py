"""What a `TrackEstimator` said at every plot of one object."""

from __future__ import annotations

import math

import numpy as np

from ...engine.status import Status
from ...models.markup import markup
from ...results.bands import half_width, normal_score
from ...results.trace import Trace
from . import bank
from .motion import moving, unpacked

AXES = {1: ("",), 2: ("_east", "_north")}


class TrackTrace(Trace):
    """Columns of one run of a `TrackEstimator`, time first; per coordinate (T, C), C = 2: East, North.

    ``prediction``, ``innovation``, ``variance`` and the density belong to a plot ``y`` given those before it: NaN, the
    variance infinite, of the first. Position, velocity, acceleration, course and turn rate are those after it; where a
    scan had no plot, what is expected then. ``state`` continues where the trace ends.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> t = 4.0 * np.arange(30)
    >>> trace = dw.TrackEstimator("aircraft").scan(t, np.stack([150 * t, 80 * t], axis=1))
    >>> trace.position.shape, trace.speed[-1].round().item(), trace.course[-1].round().item()
    ((30, 2), 170.0, 62.0)
    """

    def __repr__(self):
        return f"TrackTrace({len(self)} plots, {self.leader} leads)"

    # --- the forecast of a plot ----------------------------------------------------------------------------

    def _repr_html_(self):
        told = {"speed": (self.speed, self.speed_sd), "course": (self.course, self.course_sd)}
        return markup(repr(self), parameters=[(name, at[-1], sd[-1]) for name, (at, sd) in told.items() if len(self)])

    def _single(self, name) -> np.ndarray:
        return self.table[:, self.estimator.columns[name].start]

    @property
    def variance(self) -> np.ndarray:
        """Variance of the prediction error, (T, C); infinite for the first plot."""
        rare = self._single("unforeseen")[:, None]
        spreading = (1 - rare) * self._single("spreading")[:, None] + rare
        return self._column("base") * spreading + rare * self._column("wider")

    @property
    def nis(self) -> np.ndarray:
        """Mean over coordinates of innovation^2/variance: 1 on average where the variance is right, (T,)."""
        return np.mean(self.innovation**2 / self.variance, axis=1)

    @property
    def log_score(self) -> np.ndarray:
        """Log density that the forecast gave to the plot; NaN where there is none, (T, C)."""
        return self._column("log_score")

    @property
    def normal_score(self) -> np.ndarray:
        """Where the plot lies in its forecast, as a deviate of N(0, 1), whatever the tails, (T, C)."""
        return normal_score(self._column("lower"), self._column("upper"))

    def tails(self) -> np.ndarray:
        """Return the shares of the scales of the tails in what is learnt, (T, J); their variances: `bank.SCALES`."""
        return self.table[:, self.estimator.columns["shares"]]

    def band(self, level: float = 0.95) -> np.ndarray:
        """Half-width of the prediction interval of each coordinate, a quantile of the density, (T, C)."""
        base, wider, rare = self._column("base"), self._column("wider"), self._single("unforeseen")[:, None]
        weight = np.hstack([(1 - rare) * self.tails(), rare])
        found = np.full(base.shape, math.inf)
        for c in range(base.shape[1]):
            used = np.isfinite(base[:, c])
            each = base[used, c][:, None] * np.array(bank.SCALES)
            scale = np.sqrt(np.column_stack([each, base[used, c] + wider[used, c]]))
            dof = np.full(int(used.sum()), math.inf)
            found[used, c] = half_width(level, weight[used], np.zeros_like(scale), scale, dof)
        return found

    def coverage(self, level: float = 0.95, first: int = 2) -> float:
        """Return the share of coordinates of plots within their band, from plot ``first`` on."""
        outside = np.minimum(self._column("lower"), self._column("upper"))[first:]
        outside = outside[np.isfinite(outside)]
        return float(1 - np.mean(outside < 0.5 * (1 - level))) if outside.size else math.nan

    # --- motion --------------------------------------------------------------------------------------------

    def _state(self):
        return unpacked(self.table, self.estimator.coordinates)

    def _mean(self, what) -> np.ndarray:
        return self._state()[0][:, what::3]

    def _sd(self, what) -> np.ndarray:
        V = self._state()[1]
        return np.sqrt(np.maximum(np.diagonal(V, axis1=1, axis2=2)[:, what::3], 0.0))

    @property
    def position(self) -> np.ndarray:
        """Where it is, m, (T, C)."""
        return self._mean(0)

    @property
    def position_sd(self) -> np.ndarray:
        """Standard deviation of the position, (T, C)."""
        return self._sd(0)

    @property
    def velocity(self) -> np.ndarray:
        """Velocity, m/s, (T, C)."""
        return self._mean(1)

    @property
    def velocity_sd(self) -> np.ndarray:
        """Standard deviation of the velocity, (T, C)."""
        return self._sd(1)

    @property
    def acceleration(self) -> np.ndarray:
        """Acceleration, m/s^2, (T, C)."""
        return self._mean(2)

    @property
    def acceleration_sd(self) -> np.ndarray:
        """Standard deviation of the acceleration, (T, C)."""
        return self._sd(2)

    @property
    def spread(self) -> np.ndarray:
        """Covariance of [E, vE, aE, N, vN, aN], (T, 3C, 3C)."""
        return self._state()[1]

    @property
    def speed(self) -> np.ndarray:
        """Speed, m/s, (T,)."""
        return moving(*self._state())[0]

    @property
    def speed_sd(self) -> np.ndarray:
        """Standard deviation of the speed, (T,)."""
        return moving(*self._state())[1]

    @property
    def course(self) -> np.ndarray:
        """Course, degrees clockwise from North, 0 to 360, (T,)."""
        return np.degrees(moving(*self._state())[2]) % 360.0

    @property
    def course_sd(self) -> np.ndarray:
        """Standard deviation of the course, degrees; at most that of any course, 104, (T,)."""
        return np.minimum(np.degrees(moving(*self._state())[3]), 360 / math.sqrt(12))

    @property
    def turn_rate(self) -> np.ndarray:
        """Turn rate, rad/s, positive to the right, (T,)."""
        return self._single("turn")

    @property
    def turn_rate_sd(self) -> np.ndarray:
        """Standard deviation of the turn rate, rad/s, (T,)."""
        return self._single("turn_sd")

    @property
    def manoeuvre(self) -> np.ndarray:
        """Probability that the target manoeuvres, (T,)."""
        return self._single("manoeuvring")

    @property
    def onset(self) -> np.ndarray:
        """Whether a manoeuvre was told to have begun, (T,) bool."""
        return self._single("onset") > 0

    @property
    def pole(self) -> np.ndarray:
        """Manoeuvre pole phi, of a step of `period`; NaN before the third plot, (T,)."""
        return self._single("pole")

    @property
    def pole_sd(self) -> np.ndarray:
        """Standard deviation of the manoeuvre pole, (T,)."""
        return self._single("pole_sd")

    # --- the bank ------------------------------------------------------------------------------------------

    @property
    def status(self) -> np.ndarray:
        """Bits of `driftwise.Status`, (T,)."""
        return self._single("status").astype(np.int64)

    @property
    def is_plot(self) -> np.ndarray:
        """Whether the scan had a plot, (T,)."""
        return (self.status & int(Status.MISSING_OUTPUT)) == 0

    @property
    def weights(self) -> np.ndarray:
        """Weight of each member in the prediction, (T, M), in the order of ``names``."""
        return self.table[:, self.estimator.columns["weights"]]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the members."""
        return self.estimator.names

    @property
    def leader(self) -> str:
        """The member of the largest mean weight."""
        return self.names[int(np.argmax(self.weights.mean(axis=0)))] if len(self) else "nobody"

    # --- out -----------------------------------------------------------------------------------------------

    def columns(self) -> dict[str, np.ndarray]:
        """Return the columns by name, those of a coordinate with its axis."""
        C = self.estimator.coordinates
        table = {"time": self.time}
        table |= {"plot" + axis: column for axis, column in zip(AXES[C], self.y.T)}
        pairs = ["prediction", "innovation", "variance", "position", "position_sd", "velocity", "velocity_sd"]
        for name in [*pairs, "acceleration", "acceleration_sd"]:
            table |= {name + axis: column for axis, column in zip(AXES[C], getattr(self, name).T)}
        if C == 2:
            names = ("speed", "speed_sd", "course", "course_sd", "turn_rate", "turn_rate_sd")
            table |= {name: getattr(self, name) for name in names}
        names = ("manoeuvre", "onset", "pole", "pole_sd", "nis", "status")
        table |= {name: getattr(self, name) for name in names}
        return {name: np.ascontiguousarray(c) for name, c in table.items()}
