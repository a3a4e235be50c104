"""Position plots of one object, at whatever times they come: where it is, how it moves, and how sure that is."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...engine import compile, validation
from ...engine.dispatch import flatten
from ...engine.errors import InputError
from ...engine.portable import Portable
from ...results.snapshot import register
from . import bank, former, smoothed, step
from .motion import unpacked
from .step import Tracking
from .trace import TrackTrace

FARTHEST = 1e30  # m: beyond it lies no target, and squares of squares are no numbers any more
CLASSES = {"aircraft": 250.0, "helicopter": 60.0, "glider": 40.0, "uav": 20.0, "boat": 8.0}  # m/s


class TrackStep(NamedTuple):
    """What one plot showed; arrays have one entry per coordinate."""

    prediction: np.ndarray  # of the plot, from those before it
    innovation: np.ndarray
    covariance: np.ndarray  # (C, C) of the innovation
    nis: float  # mean over coordinates of e^2/variance
    log_density: float  # that the forecast gave to the plot
    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    spread: np.ndarray  # (3C, 3C) covariance of [E, vE, aE, N, vN, aN]
    turn_rate: float  # rad/s, positive to the right
    turn_rate_sd: float
    manoeuvre: float  # probability
    status: int


@register
class TrackEstimator(Portable):
    """Position, velocity, acceleration and turn rate of one object from its plots, with error bars: nothing to tune.

    A bank of models of motion: constant velocity with six shares of noise, velocities that are forgotten, constant
    acceleration, Singer's, a coordinated turn, legs straight or on circles that end at any time, and the joint filter
    with two poles at 1 and a manoeuvre pole that is learnt. All predict the next plot; their mixture, weighted by
    likelihood that fades, is the forecast. What a plot's noise is, and the tails of the forecast, are learnt on the
    way. Times may be irregular, plots may be missing.

    Parameters
    ----------
    speed : float or str
        What is fast for the class, m/s: 250 "aircraft", 60 "helicopter", 40 "glider", 20 "uav", 8 "boat". It matters in
        the first plots only, and is the unit of everything else.
    coordinates : int
        2: East and North. 1: a single coordinate, such as altitude. Two share the evidence and the manoeuvre pole.
    forgetting : float
        Evidence of k plots ago counts forgetting^k.
    learning_rate : float
        What the evidence of one plot counts. All models are wrong in the same way: half.
    doubt : float
        By what log weight all that curve begin behind constant velocity: they are slow to learn.
    noise, tails : float
        Plots by which each model's noise, and the shape of the forecast, are known.

    Notes
    -----
    Source: Salut, Aguilar, Favier and Alengrin (1979) for the joint filter; Singer (1970); Blom and Bar-Shalom (1988)
    for legs; Raftery, Karny and Ettler (2010) for the average; the two poles held at 1 and the velocity increments that
    make it fit for irregular times are this package's.

    Each coordinate is filtered with its own variance: of a stated covariance the diagonal counts. Position, velocity
    and acceleration are those of the members that have them, all but those with a learnt pole.

    Bad at: tracks of a few plots, where it has the speed of the class and little else; precise sensors of manoeuvring
    targets, where a tuned interacting model is some ten per cent better; clutter (see `Tracker`, and the adapter
    for Stone Soup); errors that stay for many plots, such as the extent of a ship: no filter tells them from motion.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> t = np.arange(60) * 4.0
    >>> turn = np.clip(t - 120, 0, 60) * np.radians(3)  # straight, half a circle at 3 degrees a second, straight
    >>> path = np.cumsum(200 * 4.0 * np.stack([np.sin(turn), np.cos(turn)], axis=1), axis=0)
    >>> plots = path + 50 * np.random.default_rng(1).standard_normal(path.shape)
    >>> trace = dw.TrackEstimator("aircraft").scan(t, plots)
    >>> at = 40
    >>> print(f"{np.degrees(trace.turn_rate[at]):.1f} +- {np.degrees(trace.turn_rate_sd[at]):.1f} degrees a second")
    2.5 +- 1.8 degrees a second
    """

    trace_kind = TrackTrace
    unknown_parts = ("plots",)  # of a state, where NaN says that something is not known
    policies = members = ()  # no memory that it is told, and no estimators: its models of motion are its own

    def __init__(
        self,
        speed: float | str = "aircraft",
        *,
        coordinates: int = 2,
        forgetting: float = 0.9,
        learning_rate: float = 0.5,
        doubt: float = 1.5,
        noise: float = 20.0,
        tails: float = 100.0,
    ):
        if isinstance(speed, str):
            if speed not in CLASSES:
                raise InputError(f"speed must be metres a second, or one of {', '.join(CLASSES)}, got {speed!r}")
            self.speed = CLASSES[speed]
        else:
            self.speed = validation.size("speed", speed)
        if coordinates not in (1, 2):
            raise InputError(
                f"coordinates must be 1 or 2 (East, North), got {coordinates!r}; altitude comes from another sensor: "
                "give it an estimator of its own"
            )
        validation.share("forgetting", forgetting), validation.share("learning_rate", learning_rate)
        self.coordinates = C = int(coordinates)
        self.task = Tracking(
            C, self.speed, forgetting, learning_rate, -abs(float(doubt)), validation.positive("noise", noise),
            validation.positive("tails", tails), step.STARTS, step.ENDS, step.CLAIM,
        )  # fmt: skip
        self.options = dict(
            speed=self.speed, coordinates=C, forgetting=forgetting, learning_rate=learning_rate, doubt=doubt,
            noise=noise, tails=tails,
        )  # fmt: skip
        self.dtype = bank.TRACK.dtype(C)
        self.columns, self.n_columns = bank.TRACK_SAMPLE.slices(C), bank.TRACK_SAMPLE.size(C)
        self.names, self.outputs = bank.names(C), C

    @classmethod
    def of(cls, given) -> TrackEstimator:
        """Return the estimator of a plane that was given, or the one of a speed or class."""
        found = cls(speed=given) if isinstance(given, str | float | int) else given
        if not isinstance(found, TrackEstimator) or found.coordinates != 2:
            raise InputError(f"estimator must be a TrackEstimator of two coordinates or a speed, got {found!r}")
        return found

    def __repr__(self):
        return f"TrackEstimator(speed={self.speed:g}, coordinates={self.coordinates})"

    def start(self, series: int | None = None) -> np.ndarray:
        """Return a fresh state, or ``series`` of them: a record of plain numbers."""
        return np.zeros(() if series is None else validation.count("series", series), self.dtype)

    def carried_over(self, rows) -> np.ndarray:
        """Return rows of states of a former layout as they are laid out now."""
        return former.rows(self.coordinates, rows)

    def carried_table(self, table) -> np.ndarray:
        """Return the table of a trace that was written with such states."""
        return former.table(self.coordinates, table)

    # --- running -------------------------------------------------------------------------------------------

    def scan(self, time, position, covariance=None, *, state=None):
        """Run over a record of plots and return its `TrackTrace`; ``trace.state`` continues where it ended.

        Parameters
        ----------
        time : (T,)
            s, increasing; or dates.
        position : (T, C)
            m; a row with NaN is a scan without a plot.
        covariance : (C, C) or (T, C, C), optional
            What the sensor says of its errors, m^2: how they change from plot to plot is believed, their size is a
            start. NaN is unknown.
        state : optional
            To go on from.
        """
        time, position, R = self._door(time, position, covariance)
        row = self._row(self.start() if state is None else state)
        self._later(time, row)
        outs = self.run(row, time, position, R)
        return self.trace_of(time, position, outs, row.view(self.dtype).reshape(()))

    def smooth(self, time, position, covariance=None, *, lag: int | None = None) -> TrackTrace:
        """Return the `TrackTrace` of a record in which each plot's motion is told given all plots, before and after.

        The filter goes over the record both ways; each member's state after the plots so far meets each one's that
        comes from the end, and pairs are weighed by how well they agree (two-filter smoothing of jumping models:
        Helmick, Blair and Hoffman 1995). A plot more than five deviations off what either side expects is set aside:
        ``status`` has ``OUTLIER`` there. Forecast, NIS, manoeuvre and onset stay those of `scan`.

        Parameters
        ----------
        time, position, covariance
            As in `scan`.
        lag : int, optional
            Plots that are waited for (fixed lag): the motion at a plot is told given the next ``lag`` and those before
            it. All are when omitted (fixed interval).

        Notes
        -----
        Bad at: errors that stay for several plots (the bias between two sensors, multipath), which it takes for
        motion; the bands of its position are narrower than the filter's, and break sooner there.

        Examples
        --------
        >>> import numpy as np, driftwise as dw
        >>> t = np.arange(100) * 4.0
        >>> path = np.stack([200 * t, 50 * t], axis=1)
        >>> plots = path + 50 * np.random.default_rng(1).standard_normal(path.shape)
        >>> est = dw.TrackEstimator("aircraft")
        >>> for trace in (est.scan(t, plots), est.smooth(t, plots, lag=5), est.smooth(t, plots)):
        ...     print(np.sqrt(np.mean((trace.position - path)[10:] ** 2)).round(), "m")
        15.0 m
        10.0 m
        7.0 m
        """
        time, position, R = self._door(time, position, covariance)
        row = self._row(self.start())
        self._later(time, row)
        if lag is None:
            table = smoothed.smooth(self, time, position, R)
        else:
            table = smoothed.smooth_behind(self, time, position, R, validation.count("lag", lag))
        self.run(row, time, position, R)
        return self.trace_of(time, position, table, row.view(self.dtype).reshape(()))

    def table_width(self, keep) -> int:
        """Return the number of columns of a trace; a track's are always all."""
        return self.n_columns

    def trace_of(self, time, position, table, state) -> TrackTrace:
        """Return the trace of plots that were followed, (T,) and (T, C), with the state after the last."""
        time, position = np.array(time, float), np.array(position, float)
        return TrackTrace(self, position, np.zeros((len(time), 0)), table, "std", state, time=time)

    def update(self, state, time, position, covariance=None) -> tuple[np.ndarray, TrackStep]:
        """Return the next state and what this plot showed; NaN is a scan without one."""
        state, out = self.advance(state, time, position, covariance)
        return state, self.shown(out)

    def advance(self, state, time, position, covariance=None) -> tuple[np.ndarray, np.ndarray]:
        """Return the next state and a row of the trace's columns, as `update` does, without words."""
        time, position, R = self._door([time], [position], None if covariance is None else [covariance])
        row = self._row(state)
        self._later(time, row)
        out = self.run(row, time, position, R)[0]
        return row.view(self.dtype)[0], out

    def predict(self, state, time) -> tuple[np.ndarray, np.ndarray]:
        """Return mean (C,) and covariance (C, C) of a plot at ``time``; infinite before the first plot."""
        out = self._ahead(state, time)
        return out[: self.coordinates].copy(), self._covariance(out)

    def density(self, state, time, position) -> float:
        """Return the log density that the forecast gives to a plot there; 0 before the first plot: nothing known."""
        position = validation.vector("position", position, self.coordinates)
        out, C = self._ahead(state, time), self.coordinates
        base = out[2 * C : 3 * C]
        if not np.isfinite(base).all():
            return 0.0
        rare, total = out[self.columns["unforeseen"]], 0.0
        shares = np.append((1 - rare) * out[self.columns["shares"]], rare)
        for e, s, wider in zip(position - out[:C], base, out[self.columns["wider"]]):
            v = np.append(np.array(bank.SCALES) * s, s + wider)
            total += float(np.logaddexp.reduce(np.log(shares) - 0.5 * np.log(2 * np.pi * v) - 0.5 * e * e / v))
        return total

    def update_batch(self, states, time, position, covariance=None) -> tuple[np.ndarray, list[TrackStep]]:
        """Advance many tracks, one plot each: states (S,), time (S,), position (S, C)."""
        rows = np.ascontiguousarray(states).reshape(-1).view(float).reshape(np.size(states), -1).copy()
        times, positions = validation.seconds("time", time).reshape(-1), validation.floats("position", position)
        steps = []
        for s, row in enumerate(rows):
            stated = None if covariance is None else np.asarray(covariance)[s]
            t, p, R = self._door(times[s : s + 1], positions[s : s + 1], None if stated is None else stated[None])
            self._later(t, row)
            steps.append(self.shown(self.run(row, t, p, R)[0]))
        return rows.reshape(-1).view(self.dtype).reshape(np.shape(states)), steps

    # --- inside --------------------------------------------------------------------------------------------

    @cached_property
    def _drive(self):
        kept = np.empty(step.room(self.coordinates))
        return compile.passage(Tracking), kept, flatten([self.task])

    def run(self, row, time, position, R) -> np.ndarray:
        """Advance a state's numbers in place, unchecked; return the columns of the trace (T, columns)."""
        rows = np.empty((len(time), 1 + self.coordinates))
        rows[:, 0], rows[:, 1:] = time, position
        return self.run_rows(row, rows, R)

    def run_rows(self, row, rows, R) -> np.ndarray:
        """Do the same for plots in rows (T, 1 + C): time and position."""
        go, kept, spec = self._drive
        outs = np.empty((len(rows), self.n_columns))
        go(rows, R, kept, outs, row, spec)
        return outs

    def _ahead(self, state, time) -> np.ndarray:
        C, row = self.coordinates, self._row(state)
        time = validation.seconds("time", time).reshape(-1)
        if len(time) != 1 or not np.isfinite(time[0]):
            raise InputError(f"time must be one finite number, got {time.tolist()}")
        self._later(time, row)
        return self.run(row, time, np.full((1, C), np.nan), np.full((1, C), np.nan))[0]

    def _covariance(self, out) -> np.ndarray:
        C, reported = self.coordinates, bank.sample_at(self.coordinates).reported
        S = np.diag(out[2 * C : 3 * C])
        if C == 2:
            S[0, 1] = S[1, 0] = out[reported + bank.CROSS]
        rare = out[self.columns["unforeseen"]]
        return S * ((1 - rare) * out[reported + bank.SPREADING] + rare) + np.diag(rare * out[self.columns["wider"]])

    def shown(self, out) -> TrackStep:
        """Return a row of the trace's columns as a `TrackStep`."""
        C, reported = self.coordinates, out[bank.sample_at(self.coordinates).reported :].tolist()
        state, spread = unpacked(out, C)
        e, S = out[C : 2 * C], self._covariance(out)
        nis = sum(e[c] * e[c] / S[c, c] for c in range(C)) / C
        density = float(out[3 * C : 4 * C].sum())
        turn, turn_sd = reported[bank.TURN : bank.TURN_SD + 1]
        return TrackStep(
            out[:C], e, S, float(nis), density, state[0::3], state[1::3], state[2::3], spread, turn, turn_sd,
            reported[bank.MANOEUVRING], int(reported[bank.STATUS]),
        )  # fmt: skip

    def _row(self, state) -> np.ndarray:
        state = np.asarray(state)
        if state.dtype != self.dtype or state.size != 1:
            raise InputError("the state belongs to another estimator: start one with estimator.start()")
        return np.ascontiguousarray(state).reshape(-1).view(float).copy()

    def _door(self, time, position, covariance):
        C, time = self.coordinates, validation.seconds("time", time).reshape(-1)
        position = validation.floats("position", position)
        T = len(time)
        if position.shape != (T, C) and not (C == 1 and position.shape == (T,)):
            raise InputError(f"position must have shape {(T, C)}, a row for each time, got {position.shape}")
        position = position.reshape(T, C)
        if not np.isfinite(time).all():
            raise InputError(f"time must be finite, got {time[~np.isfinite(time)][0]} at plot {_first(time)}")
        if np.isinf(position).any() or np.nanmax(np.abs(position), initial=0.0) > FARTHEST:
            raise InputError(
                f"position must be finite and within {FARTHEST:g} m, or NaN where there is no plot; was a sentinel "
                "left in the data?"
            )
        if covariance is None:
            return time, position, np.full((T, C), np.nan)
        covariance = validation.floats("covariance", covariance)
        if C == 1 and covariance.shape == (T,):
            covariance = covariance.reshape(T, 1, 1)
        try:
            R = np.broadcast_to(covariance, (T, C, C))
        except ValueError:
            raise InputError(f"covariance must have shape {(C, C)} or {(T, C, C)}, got {covariance.shape}") from None
        R = np.ascontiguousarray(R[:, range(C), range(C)])
        if (R <= 0).any() or np.isinf(R).any():
            raise InputError("covariance must have positive variances, or NaN where it is unknown")
        return time, position, R

    def _later(self, time, row):
        wrong = np.flatnonzero(np.diff(time) <= 0) + 1
        if row[bank.SEEN] > 0 and len(time) and time[0] <= row[bank.TIME] + row[bank.SUSPECTED]:
            wrong = np.array([0])
        if len(wrong):
            k = int(wrong[0])
            before = time[k - 1] if k else row[bank.TIME]
            raise InputError(
                f"time must increase: {time[k]:.6g} s after {before:.6g} s at plot {k}. Are the plots in order, and of "
                "one object? Sort them, or give them to a Tracker"
            )


def _first(time) -> int:
    return int(np.flatnonzero(~np.isfinite(time))[0])
