"""Plots to tracks: by address where there is one, by likelihood ratios where there is none."""

from __future__ import annotations

import copy
import math

import numpy as np

from ..engine import validation
from ..engine.errors import InputError
from ..estimators.track.estimator import TrackEstimator
from .checkpoint import restore, save
from .frames import east_north, geographic
from .inbox import LEAP, Inbox
from .live import TENTATIVE, Event, Live, Plot
from .plots import Fault, Plots
from .read import read_plots
from .targets import Rules, Targets
from .tracks import Tracks, track_of

FASTEST = {250.0: 400.0, 60.0: 150.0, 40.0: 150.0, 20.0: 60.0, 8.0: 40.0}  # m/s: typical speed of a class to its limit
FARTHEST = 1e9  # m
STATED = 1e-12, 1e10  # m^2: a variance beyond is no statement


class Tracker:
    """Tracks from plots, one estimator for each object; the rules stand in ``docs/tracker.md``.

    Plots without a key that have the same time are shared out among the tracks at once, weighed against plots of
    nobody; those of the last instant wait for the others of it, and `tracks` counts them in. Bad at: plots of two
    objects that merge into one, crossings without a key, clutter that stays where it is.

    Parameters
    ----------
    estimator : TrackEstimator, float or str
        The estimator of each track, or the class of its speed: "aircraft", "boat", .., or a typical speed in m/s.
    confirm : (N, M)
        A track is confirmed by N plots within M scan periods.
    coast : float
        Scan periods without a plot after which a confirmed track is coasting.
    gap : float
        Scan periods without a plot after which it has ended, four times as many where plots name it, or where
        nobody else was seen either; what comes later is a new track that follows it.
    gate : float
        Standard deviations within which a Mode A code belongs to an addressed track.
    single : bool
        All plots without a key belong to one object.
    delay : float
        s. Plots are held back so long and put in order of time; what comes later still is counted and skipped.
    fastest : float, optional
        m/s; a plot that implies more is not of its track. From the class when omitted.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> from driftwise.tracking.plots import plots
    >>> time = 4.0 * np.arange(20)
    >>> tracker = dw.tracking.Tracker()
    >>> events = tracker.feed(plots(time, np.stack([200 * time, 50 * time], axis=1), key="4BAA5F"))
    >>> [(e.time, e.kind) for e in events]
    [(0.0, 'initiated'), (8.0, 'confirmed')]
    >>> tracker.tracks
    Tracks(1 track, 20 plots)
    """

    def __init__(
        self,
        estimator: TrackEstimator | float | str = "aircraft",
        *,
        confirm=(3, 5),
        coast: float = 3.0,
        gap: float = 8.0,
        gate: float = 4.0,
        single: bool = False,
        delay: float = 0.0,
        fastest: float | None = None,
    ):
        estimator = TrackEstimator.of(estimator)
        try:
            N, M = (validation.count("confirm", n) for n in confirm)
        except (TypeError, ValueError):
            N = M = 0
        if not 1 <= N <= M:
            raise InputError(f"confirm must be (N, M), N plots within M scans with 1 <= N <= M, got {confirm!r}")
        for name, value in dict(coast=coast, gap=gap, gate=gate, fastest=1.0 if fastest is None else fastest).items():
            validation.positive(name, value)
        if not coast < gap:
            raise InputError(f"coast must be below gap, in scan periods; got coast={coast}, gap={gap}")
        if not 0 <= float(validation.floats("delay", delay)) < LEAP:
            raise InputError(f"delay must be within 0 and {LEAP:.0f} s, got {delay!r}")
        self.estimator = estimator
        limit = fastest or FASTEST.get(estimator.speed, 3 * estimator.speed)
        is_single = validation.yes("single", single)
        options = (N, M), float(coast), float(gap), float(gate), is_single, float(delay), float(limit)
        self.rules = Rules(*options)
        self.origin: tuple[float, float] | None = None
        self.faults: list = []
        self.inbox = Inbox(self.rules.delay)
        self.targets = Targets(estimator, self.rules, self.inbox)

    def __repr__(self):
        return f"Tracker({len(self.targets.live)} live, {len(self.targets.ended)} ended, {self.counts['plots']} plots)"

    # --- what comes in -------------------------------------------------------------------------------------

    def feed(self, plots: Plots) -> list[Event]:
        """Take plots in order of time, any number at once, and return what happened."""
        if not isinstance(plots, Plots):
            raise InputError(f"feed takes Plots, got {type(plots).__name__}; driftwise.track reads files")
        before = len(self.events)
        self.faults += plots.faults
        position = self._here(plots)
        if len(far := np.flatnonzero(~(np.abs(position) < FARTHEST).all(axis=1))):
            self.faults += [Fault("plots", int(k), f"position {position[k]} m is nowhere near") for k in far]
            plots, position = plots[np.delete(np.arange(len(plots)), far)], np.delete(position, far, axis=0)
        for plot in zip(
            plots.time.tolist(),
            *position.T.tolist(),
            map(tuple, _stated(plots.covariance).tolist()),
            plots.altitude.tolist(),
            plots.key,
            plots.name,
            plots.sensor,
        ):
            for ready in self.inbox.put(Plot(*plot)):
                self.targets.use(ready)
        return self.events[before:]

    def advance(self, time: float) -> list[Event]:
        """Say what time it is (s) where no plots come, so that tracks coast and end."""
        before = len(self.events)
        for ready in self.inbox.advance(float(time)):
            self.targets.use(ready)
        self.targets.share_out()
        self.targets.look(self.inbox.newest - self.inbox.delay)
        return self.events[before:]

    def finish(self) -> list[Event]:
        """Use the plots that are held back, and return what happened; more may be fed later."""
        before = len(self.events)
        for ready in self.inbox.finish():
            self.targets.use(ready)
        self.targets.share_out()
        return self.events[before:]

    def _here(self, plots: Plots) -> np.ndarray:
        """Return positions relative to the origin of the first plots."""
        if not self.inbox.arrivals:
            self.origin = plots.origin
        if plots.origin == self.origin or not len(plots):
            return plots.position
        if plots.origin is None or self.origin is None:
            raise InputError("plots with a place on earth and plots without one cannot be mixed: give both an origin")
        latitude, longitude = geographic(plots.position, plots.origin).T
        return east_north(latitude, longitude, self.origin)

    # --- what comes out ------------------------------------------------------------------------------------

    @property
    def events(self) -> list[Event]:
        """What happened so far."""
        return self.targets.events

    @property
    def counts(self) -> dict[str, int]:
        """How many plots came, were late, repeated others, were set aside, discarded, had a wild clock."""
        return self._counts(self.targets)

    def _counts(self, targets: Targets) -> dict[str, int]:
        return targets.counts | {"clock": self.inbox.dropped}

    @property
    def tracks(self) -> Tracks:
        """The tracks that are or were confirmed."""
        targets = self._settled()
        return self._tracks(targets.ended + [t for t in targets.live.values() if t.status != TENTATIVE], targets)

    @property
    def tentative(self) -> Tracks:
        """The tracks that wait to be confirmed."""
        targets = self._settled()
        return self._tracks([t for t in targets.live.values() if t.status == TENTATIVE], targets)

    def _settled(self) -> Targets:
        """Return the targets as they are if no other plot comes at the time of the last."""
        if not self.targets.at_once:
            return self.targets
        targets = self.targets.copy()
        targets.share_out()
        return targets

    def now(self) -> Tracks:
        """Return `tracks` as they will be when the plots that are held back have been used and nothing comes between.

        They are bit for bit those of all plots so far in order of time, so that plots that come late (``delay``) cost
        no time: what is held back counts at once, and once more, for good, when its turn has come.
        """
        if not self.inbox.held:
            return self.tracks
        ahead = copy.copy(self)
        ahead.targets, ahead.inbox = self.targets.copy(), copy.deepcopy(self.inbox)
        for ready in ahead.inbox.take(math.inf):
            ahead.targets.use(ready)
        return ahead.tracks

    def release(self) -> Tracks:
        """Return the tracks that have ended and forget them, and the events and faults so far."""
        ended = self._tracks(self.targets.ended, self.targets)
        self.targets.ended, self.targets.events, self.faults = [], [], []
        return ended

    def _tracks(self, tracks: list[Live], targets: Targets) -> Tracks:
        words = list(targets.numbers)
        made = tuple(track_of(t, self.estimator, words, self.origin) for t in sorted(tracks, key=lambda t: t.id))
        return Tracks(made, self.origin, tuple(self.faults), self._counts(targets), tuple(targets.events))

    def save(self, path) -> None:
        """Write the tracker, all its tracks included, to a file that `load` reads; every bit survives."""
        save(self, path)

    @classmethod
    def load(cls, path) -> Tracker:
        """Return a tracker as saved; it goes on as if it had never stopped."""
        return restore(cls, path)


def _stated(covariance: np.ndarray) -> np.ndarray:
    """Return covariances as rows of four numbers, NaN where they cannot be what they say."""
    variances = covariance[:, [0, 1], [0, 1]]
    with np.errstate(invalid="ignore"):
        good = ((variances > STATED[0]) & (variances < STATED[1])).all(axis=1) & np.isfinite(covariance).all(
            axis=(1, 2)
        )
    return np.where(good[:, None], covariance.reshape(-1, 4), np.nan)


def track(
    plots, estimator="aircraft", *, site=None, sites=None, origin=None, columns=None, progress=None, **options
) -> Tracks:
    """Return the tracks in plots, or in files of plots; `Tracker` says how and what the options are.

    Parameters
    ----------
    plots : Plots, or what ``read_plots`` reads: a path, several, a data frame or columns
    estimator : TrackEstimator, float or str
        Or the class of objects: "aircraft", "helicopter", "glider", "uav", "boat", or a typical speed in m/s.
    site, sites, origin, columns, progress : optional
        Of ``read_plots``.
    **options
        Of `Tracker`.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> from driftwise.tracking.plots import plots
    >>> time = 12.0 * np.arange(40)
    >>> dw.track(plots(time, np.stack([120 * time, 90 * time], axis=1)), single=True)
    Tracks(1 track, 40 plots)
    """
    if "speed" in options:
        raise InputError(f"the class of objects is the second argument: dw.track(plots, {options['speed']!r})")
    tracker = Tracker(estimator, **options)
    if not isinstance(plots, Plots):
        plots = read_plots(plots, site=site, sites=sites, origin=origin, columns=columns, progress=progress)
    tracker.feed(plots)
    tracker.finish()
    return tracker.tracks
