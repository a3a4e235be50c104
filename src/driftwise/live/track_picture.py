"""What a map shows of a running tracker: the last of each track and its trail, bounded, and the same as JSON."""

from __future__ import annotations

import math
from heapq import nlargest
from typing import Any, NamedTuple

import numpy as np

from driftwise.estimators.track.bank import sample_at
from driftwise.estimators.track.motion import moving, unpacked
from driftwise.tracking.live import PLOT, TENTATIVE

from .web.encode import dumps

MOST = 300  # tracks, those seen last
POINTS = 40  # of a trail
TRAIL = 600.0  # s that a trail goes back
PLACE = [PLOT + sample_at(2).state + k for k in (0, 3)]  # columns of East and North
RADIUS95 = math.sqrt(-2.0 * math.log(0.05))  # deviations of a 95 % ellipse in two dimensions
LONGEST = 40  # characters of a name
SLOW, SHORT, LONG = 15.0, 60.0, 360.0  # m/s: who is slower has a course line of six minutes, others of one


class Picture(NamedTuple):
    """A tracker at one moment; nothing of it changes later, so that another thread may read it."""

    time: float  # s, of the newest plot, or of the clock
    plots: int
    total: int  # live tracks, shown or not
    ahead: float  # s that a course line goes
    who: list[tuple[int, str, str]]  # number, name and status of each track
    rows: np.ndarray  # (N, ..), the last of each: time, then the columns of its trace
    trails: list[np.ndarray]  # (M, 2) m, East and North, oldest first


def picture(tracker) -> Picture:
    """Return what is to be seen of the confirmed tracks that live, at most ``MOST`` and ``POINTS`` of a trail.

    Plots that are held back (``delay``), and those without a key that wait for others of their instant, are not in it.
    """
    live = [track for track in tracker.targets.live.values() if track.status != TENTATIVE and track.count]
    shown = nlargest(MOST, live, key=lambda track: track.rows[-1, 0])
    who = [(track.id, (track.name or track.key or f"#{track.id}")[:LONGEST], track.status) for track in shown]
    rows = np.array([[track.rows[-1, 0], *track.rows[-1, PLOT:]] for track in shown])
    ahead = LONG if tracker.estimator.speed < SLOW else SHORT
    trails = [_trail(track.rows) for track in shown]
    return Picture(tracker.inbox.newest, tracker.inbox.arrivals, len(live), ahead, who, rows, trails)


def _trail(rows: np.ndarray) -> np.ndarray:
    """Return where a track was, evenly thinned; the newest place is always there."""
    rows = rows[np.searchsorted(rows[:, 0], rows[-1, 0] - TRAIL) :]
    step = math.ceil(len(rows) / POINTS)
    return rows[(len(rows) - 1) % step :: step, PLACE]  # a copy: the columns are picked


def encoded(seen: Picture) -> bytes:
    """Return a picture as JSON in which null is unknown: m, m/s, degrees clockwise from North, standard deviations."""
    tracks: list[dict[str, Any]] = []
    if len(seen.rows):
        x, V = unpacked(seen.rows[:, 1:], 2)
        speed, speed_sd, course, course_sd = moving(x, V)
        told = {
            "time": seen.rows[:, 0],
            "position": x[:, ::3],
            "velocity": x[:, 1::3],
            "speed": speed,
            "speed_sd": speed_sd,
            "course": np.degrees(course) % 360.0,
            "course_sd": np.degrees(course_sd),
            "ellipse": _ellipses(V[:, ::3, ::3]),
        }
        columns = [_known(column) for column in told.values()]
        places, ends = (
            _known(np.round(np.concatenate(seen.trails), 1)),
            np.cumsum([len(trail) for trail in seen.trails]),
        )
        tracks = [
            {"id": id, "name": name, "status": status, **dict(zip(told, row)), "trail": places[end - len(trail) : end]}
            for (id, name, status), trail, end, *row in zip(seen.who, seen.trails, ends, *columns)
        ]
    head = {"time": _known(np.array(seen.time)), "plots": seen.plots, "total": seen.total, "ahead": seen.ahead}
    return dumps(head | {"tracks": tracks})


def _ellipses(C: np.ndarray) -> np.ndarray:
    """Return the semi-axes (m, the longer first) of 95 % ellipses and where the longer points, degrees: (N, 3)."""
    good = np.isfinite(C).all(axis=(1, 2))
    found = np.full((len(C), 3), np.nan)
    values, vectors = np.linalg.eigh(C[good])
    found[good, :2] = RADIUS95 * np.sqrt(np.maximum(values[:, ::-1], 0.0))
    found[good, 2] = np.degrees(np.arctan2(vectors[:, 0, 1], vectors[:, 1, 1])) % 180.0
    return found


def _known(values: np.ndarray) -> Any:
    """Return numbers as lists, None where they are not finite."""
    found = values.astype(object)
    found[~np.isfinite(values)] = None
    return found.tolist()
