"""Plots of driftwise into Stone Soup, and its tracks back."""

from __future__ import annotations

import numpy as np

try:
    from stonesoup.models.measurement.linear import LinearGaussian
    from stonesoup.types.detection import Detection
    from stonesoup.types.update import Update
except ImportError:
    raise ImportError("driftwise.adapters.stonesoup_io needs Stone Soup: pip install driftwise[stonesoup]") from None

from ..tracking.plots import Plots, plots
from ..tracking.tracks import Track, Tracks
from .stonesoup import POSITION, noise_of, position, seconds, timestamp


def detections(plots: Plots):
    """Yield (timestamp, set of detections) of `Plots`, those of one time together: a Stone Soup ``detector``.

    Plots with a covariance bring a linear measurement model; altitude, key, name and sensor are metadata.

    Examples
    --------
    >>> import driftwise as dw
    >>> from driftwise.adapters.stonesoup_io import detections
    >>> from driftwise.tracking.plots import plots
    >>> for time, found in detections(plots([0.0, 0.0, 1.5], [[0, 0], [9, 9], [1, 1]])):
    ...     print(time.time(), len(found))
    00:00:00 2
    00:00:01.500000 1
    """
    starts = np.flatnonzero(np.diff(plots.time, prepend=-np.inf))
    for a, b in zip(starts, [*starts[1:], len(plots)]):
        time, found = timestamp(plots.time[a]), set()
        for k in range(a, b):
            known = {name: getattr(plots, name)[k] for name in ("altitude", "key", "name", "sensor")}
            known = {name: value for name, value in known.items() if value == value}
            R = plots.covariance[k]
            model = LinearGaussian(4, POSITION, R) if np.isfinite(R).all() else None
            z = plots.position[k].reshape(2, 1)
            found.add(Detection(z, timestamp=time, measurement_model=model, metadata=known))
        yield time, found


def tracks_from(tracks, estimator, origin=None) -> Tracks:
    """Return Stone Soup tracks as `Tracks` of driftwise, to be tabled, drawn and written.

    The estimator runs over the plots of each. For tracks of `TrackUpdater` the numbers are those that it had, bit for
    bit; those of any other filter are estimated anew, association as it was.

    Parameters
    ----------
    tracks : iterable of stonesoup Track
        Those worth keeping, such as the confirmed ones.
    estimator : TrackEstimator
    origin : (latitude, longitude), optional
        Degrees, of East = North = 0.
    """
    found = sorted((_plots(track, origin) for track in tracks), key=lambda one: tuple(one.time[:2]))
    return Tracks([_followed(k, one, estimator) for k, one in enumerate(found, start=1)], origin)


def _plots(track, origin) -> Plots:
    """Return the plots that a track was updated with, in order."""
    updates = [state for state in track.states if isinstance(state, Update)]
    taken = [state.hypothesis.measurement for state in updates]
    told = {name: [one.metadata.get(name, "") for one in taken] for name in ("key", "name", "sensor")}
    noise = [getattr(state, "noise", noise_of(one.measurement_model)) for state, one in zip(updates, taken)]
    return plots(
        [seconds(one.timestamp) for one in taken], [position(one) for one in taken],
        covariance=np.array([np.full((2, 2), np.nan) if R is None else R for R in noise]),
        altitude=[one.metadata.get("altitude", np.nan) for one in taken], origin=origin, **told,
    )  # fmt: skip


def _followed(number, one, estimator) -> Track:
    """Return a track whose plots the estimator followed."""
    trace = estimator.scan(one.time, one.position, one.covariance)
    key, name = (next((word for word in getattr(one, of)[::-1] if word), "") for of in ("key", "name"))
    return Track(
        id=number, key=key, name=name, status="confirmed", plots=one, events=(), origin=one.origin, follows=None,
        period=0.0, state=trace.state, estimator=estimator, table=trace.table,
    )  # fmt: skip
