"""Registration: what sensors say wrongly of range, azimuth and time, learnt from the objects that several of them see.

    plot of a - path by b = Ha biases(a) - Hb biases(b) + noise

The path is a cubic through the two plots of b before and the two after. Biases walk; a `StateSpace` follows them.
"""

from __future__ import annotations

import math
from collections import defaultdict, deque
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ..detect.gate import InnovationGate
from ..engine.errors import InputError
from ..estimators.state_space.estimator import StateSpace
from .frames import east_north
from .plots import Plots
from .sites import Site, site_table

RANGE, AZIMUTH, PLACE, CLOCK = 300.0, 1.0, 300.0, 2.0  # what biases may be, one deviation: m, degrees, m, s
WANDER = 3600.0 * 24  # s in which a bias may wander by a tenth of that
AROUND = 4  # plots that a path goes through
LONGEST = 60.0  # s between two plots of a path
BENT = 0.5  # deviations of a plot that a path may lie off its chord
MEMORY, CLIPPED = 200.0, 9.0  # plots by which the noise of a sensor is known; most that one counts
FIRST = 5.0  # plots that what is stated of the noise is worth
OBJECTS = 4000  # that are remembered
TOLD = 2.0  # deviations from which a bias is told


class Bias(NamedTuple):
    """Biases of a sensor with their standard deviations: true = measured - bias.

    With a site range (m) and azimuth (degrees), without one East and North (m); the clock's in s, positive where stamps
    are late.
    """

    kind: str  # "polar" or "plane"
    first: float
    first_sd: float
    second: float
    second_sd: float
    clock: float
    clock_sd: float


class Registration:
    """Biases of sensors from common targets, on-line, with bars.

    Objects are known by their keys. Feed it plots in order of time, before or beside a `Tracker`; `corrected` takes the
    biases off.

    Parameters
    ----------
    sensors : sequence of str
        As plots name them, two or more.
    sites : see `read_sites`, optional
        Where the radars of them stand; one without a site (a satellite receiver) errs in East and North.
    origin : (latitude, longitude), optional
        Of the plots' plane, needed with sites.
    reference : str, optional
        The sensor whose biases are none: a receiver of ADS-B, say. Without one, range and azimuth of all radars are
        told as far as their geometry shows them, and clocks relative to the first sensor.

    Notes
    -----
    Bad at: two sensors without sites and reference, whose sum nobody sees (the bars say so); biases that change within
    minutes; pressure altitudes far from the true ones, which are a range bias near the radar.

    Examples
    --------
    >>> import numpy as np
    >>> from driftwise.tracking.plots import plots
    >>> from driftwise.tracking.registration import Registration
    >>> rng, t = np.random.default_rng(1), np.arange(0.0, 900.0)
    >>> path = 9000 * np.stack([np.sin(t / 60), np.cos(t / 60)], axis=1) + 20 * rng.standard_normal((900, 2))
    >>> a, b = slice(0, None, 4), slice(2, None, 5)
    >>> seen = plots(
    ...     np.concatenate([t[a], t[b] + 0.5]), np.concatenate([path[a], path[b] + [150, 80]]), key="AB12",
    ...     sensor=["A"] * 225 + ["B"] * 180,
    ... )
    >>> found = Registration(["A", "B"], reference="A")
    >>> found.feed(seen)
    >>> for words in found.words():
    ...     print(words)
    B puts objects 151.8 m +- 4.3 m too far east, beside A.
    B puts objects 79.4 m +- 4.3 m too far north, beside A.
    B has a clock 0.502 s +- 0.029 s late, beside A.
    """

    def __init__(self, sensors: Sequence[str], sites=None, *, origin=None, reference: str | None = None):
        self.sensors = list(dict.fromkeys(sensors))
        if len(self.sensors) < 2:
            raise InputError(f"registration needs two sensors or more, got {', '.join(self.sensors) or 'none'}")
        if reference is not None and reference not in self.sensors:
            raise InputError(f"reference must be one of {', '.join(self.sensors)}, got {reference!r}")
        table: Mapping[str, Site | None] = site_table(sites)
        known = {name: site for name, site in table.items() if site is not None and name in self.sensors}
        if known and origin is None:
            raise InputError("origin must be given with sites: it is that of the plots (plots.origin)")
        self.places = {name: east_north([s.latitude], [s.longitude], origin)[0] for name, s in known.items()}
        self.reference = reference
        n = 3 * len(self.sensors)
        sd = np.array([self._priors(name) for name in self.sensors]).ravel()
        free = np.array([name != reference for name in self.sensors]).repeat(3)
        if reference is None:
            free[2] = False  # a clock for all
        variance = np.where(free, sd**2, 0.0)
        self._wander = np.diag(variance * 0.01 / WANDER)  # a second
        self.estimator = StateSpace(
            np.eye(n), H=np.zeros((2, n)), Q=self._wander, R=[1.0, 1.0], P0=variance, gate=InnovationGate()
        )
        self.state = self.estimator.start()
        self._time = -math.inf  # of the last difference
        self._differences: list[tuple] = []  # not learnt from yet
        self.used = 0  # differences that were learnt from
        self._noise = {name: [FIRST, 1.0] for name in self.sensors}  # plots, factor of what is stated
        self._recent: dict[str, dict[str, deque]] = {}  # of each object and sensor the last plots

    def __repr__(self):
        return f"Registration({', '.join(self.sensors)}; {self.used} differences)"

    def _priors(self, name) -> tuple[float, float, float]:
        return (RANGE, math.radians(AZIMUTH), CLOCK) if name in self.places else (PLACE, PLACE, CLOCK)

    # --- what comes in -------------------------------------------------------------------------------------

    def feed(self, plots: Plots) -> None:
        """Learn from plots in order of time; those without a key, or of other sensors, say nothing."""
        known = np.isfinite(plots.covariance).all(axis=(1, 2), keepdims=True)
        stated = np.where(known, plots.covariance, np.eye(2))
        for time, position, R, key, sensor in zip(plots.time.tolist(), plots.position, stated, plots.key, plots.sensor):
            if key and sensor in self._noise:
                self._take(key, sensor, (time, position, R))
        self._learn()

    def _take(self, key: str, sensor: str, plot: tuple) -> None:
        """Keep a plot, and learn from all differences that it completes."""
        of_key = self._recent.pop(key, None) or defaultdict(lambda: deque(maxlen=2 * AROUND))
        self._recent[key] = of_key  # the one heard last stands last
        if len(self._recent) > OBJECTS:
            del self._recent[next(iter(self._recent))]
        mine = of_key[sensor]
        if mine and not plot[0] > mine[-1][0]:
            return
        mine.append(plot)
        self._learn_noise(sensor, mine)
        if len(mine) < AROUND:
            return
        path = list(mine)[-AROUND:]
        begin, end = path[1][0], path[2][0]
        for other in of_key:
            if other != sensor and self._is_slower(other, sensor, of_key):
                for pivot in of_key[other]:
                    if begin < pivot[0] <= end:
                        self._compare(other, pivot, sensor, path, 0.5 * len(of_key))

    def _is_slower(self, other: str, sensor: str, of_key) -> bool:
        """Say whether another sensor sees an object less often: then each of its plots is compared, once."""
        steps = []
        for name in (other, sensor):
            seen = of_key[name]
            steps.append((seen[-1][0] - seen[0][0]) / (len(seen) - 1) if len(seen) > 1 else math.inf)
        a, b = steps
        return bool((a, other) > (b, sensor))

    def _learn_noise(self, sensor: str, mine: deque) -> None:
        if len(mine) < AROUND + 1:
            return
        path = list(mine)[-AROUND - 1 :]
        around, middle = [path[k] for k in (0, 1, 3, 4)], path[2]
        if path[-1][0] - path[0][0] > AROUND * LONGEST:
            return
        mean, weights = _through(around, middle[0])
        share = 1.0 + float(weights @ weights)
        count, factor = self._noise[sensor]
        variances = np.diagonal(middle[2])
        if count == FIRST and (middle[2] == np.eye(2)).all():  # nothing is stated: a first guess
            factor = float(np.mean((middle[1] - mean) ** 2)) / share
        for e, r in zip(middle[1] - mean, variances):
            z2 = min(e * e / (share * r * factor), CLIPPED)
            factor *= 1.0 + (z2 - 1.0) / (count + 1.0)
        self._noise[sensor] = [min(count + 1.0, MEMORY), max(factor, 1e-6)]

    def _compare(self, a: str, pivot: tuple, b: str, path: list[tuple], share: float) -> None:
        """Keep a plot of one sensor beside the path of another; of n sensors n/2 pairs know what one does."""
        if path[-1][0] - path[0][0] > AROUND * LONGEST or min(self._noise[s][0] for s in (a, b)) < FIRST + 3:
            return
        mean, _ = _through(path, pivot[0])
        (t0, y0, _), (t1, y1, R1), (t2, y2, _), (t3, y3, _) = path
        velocity = (y3 - y0) / (t3 - t0)  # of the chord: noise in it would make clocks look better than they are
        bend = mean - y1 - (y2 - y1) * (pivot[0] - t1) / (t2 - t1)
        if bend @ bend > BENT**2 * self._noise[b][1] * np.trace(R1):
            return  # it manoeuvres: nobody knows where it was between two plots
        H = np.zeros((2, 3 * len(self.sensors)))
        i, j = 3 * self.sensors.index(a), 3 * self.sensors.index(b)
        H[:, i : i + 3] = self._slopes(a, pivot[1], velocity)
        H[:, j : j + 3] = -self._slopes(b, mean, velocity)
        # each plot of b stands in several paths; together they know what b's plots know
        R = share * (pivot[2] * self._noise[a][1] + R1 * self._noise[b][1])
        self._differences.append((pivot[0], pivot[1] - mean, H, R))

    def _learn(self) -> None:
        """Let the biases follow the differences of some plots."""
        if not self._differences:
            return
        times, e, H, R = zip(*self._differences)
        self._differences = []
        past = max(max(times) - self._time, 0.0) if self.used else 0.0
        self._time, self.used = max(self._time, max(times)), self.used + len(e)
        shared = self._wander * past / len(e)  # objects take turns: the walk is shared out among all
        trace = self.estimator.scan(np.array(e), H=np.array(H), Q=shared, R=np.array(R), state=self.state)
        self.state = trace.state

    def _slopes(self, name: str, position, velocity) -> np.ndarray:
        """Return what biases of a sensor do to a plot there, (2, 3)."""
        if name not in self.places:
            return np.column_stack([np.eye(2), -velocity])
        east, north = position - self.places[name]
        far = max(math.hypot(east, north), 1.0)
        return np.array([[east / far, north, -velocity[0]], [north / far, -east, -velocity[1]]])

    # --- what comes out ------------------------------------------------------------------------------------

    @property
    def biases(self) -> dict[str, Bias]:
        """The biases of each sensor so far."""
        x, sd = (np.asarray(part, float).reshape(-1, 3) for part in self.estimator.estimate(self.state))
        found = {}
        for name, b, s in zip(self.sensors, x, sd):
            is_polar = name in self.places
            unit = math.degrees(1.0) if is_polar else 1.0
            kind = "polar" if is_polar else "plane"
            found[name] = Bias(kind, *map(float, (b[0], s[0], unit * b[1], unit * s[1], b[2], s[2])))
        return found

    def corrected(self, plots: Plots) -> Plots:
        """Return plots with the biases taken off, those of sensors that are known; clocks first, in order of time."""
        time, position = plots.time.copy(), plots.position.copy()
        for name, bias in self.biases.items():
            at = plots.sensor == name
            time[at] -= bias.clock
            if bias.kind == "plane":
                position[at] -= [bias.first, bias.second]
                continue
            east, north = (position[at] - self.places[name]).T
            far, azimuth = np.hypot(east, north), np.arctan2(east, north) - math.radians(bias.second)
            far = np.maximum(far - bias.first, 0.0)
            position[at] = self.places[name] + far[:, None] * np.column_stack([np.sin(azimuth), np.cos(azimuth)])
        order = np.argsort(time, kind="stable")
        return replace(plots, time=time, position=position)[order]

    def words(self) -> list[str]:
        """Return what is to be said of each sensor: the biases that are told from none, two deviations from it."""
        said, beside = [], f", beside {self.reference}" if self.reference else ""
        for name, b in self.biases.items():
            polar = b.kind == "polar"
            ways: list[tuple[float, float, str, str, str, str]] = [
                (b.first, b.first_sd, "m", "measures ranges" if polar else "puts objects",
                 "too long" if polar else "too far east", "too short" if polar else "too far west"),
                (b.second, b.second_sd, "degrees" if polar else "m", "measures azimuths" if polar else "puts objects",
                 "too far to the right" if polar else "too far north",
                 "too far to the left" if polar else "too far south"),
                (b.clock, b.clock_sd, "s", "has a clock", "late", "early"),
            ]  # fmt: skip
            for value, sd, unit, verb, more, less in ways:
                if sd > 0.0 and abs(value) > TOLD * sd:
                    digits = max(0, 1 - math.floor(math.log10(2 * sd)))
                    size, bar = f"{abs(value):.{digits}f} {unit}", f"{2 * sd:.{digits}f} {unit}"
                    said.append(f"{name} {verb} {size} +- {bar} {more if value > 0 else less}{beside}.")
        return said or ["No bias is told from none."]


def register(plots: Plots, sites=None, *, reference: str | None = None) -> Registration:
    """Return the `Registration` of the sensors of a recording; without sites its first sensor is the reference."""
    sensors = [name for name in dict.fromkeys(plots.sensor) if name]
    if reference is None and not site_table(sites):
        reference = sensors[0] if sensors else None  # somebody has to be right where nobody has a place
    found = Registration(sensors, sites, origin=plots.origin, reference=reference)
    found.feed(plots)
    return found


def _through(path: Sequence[Any], time: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the place at a time of the cubic through four plots (Lagrange), and their weights."""
    t, y, weights = [plot[0] for plot in path], np.array([plot[1] for plot in path]), np.ones(AROUND)
    for i in range(AROUND):
        for j in range(AROUND):
            if j != i:
                weights[i] *= (time - t[j]) / (t[i] - t[j])
    return weights @ y, weights
