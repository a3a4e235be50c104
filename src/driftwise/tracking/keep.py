"""A tracker on disk: JSON and arrays of numbers in one ``.npz`` file; every bit survives, nothing is pickled."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from ..errors import InputError
from ..estimators.track.estimator import TrackEstimator
from .live import Event, Live, Plot
from .plots import Fault

SCHEMA = 1
TRACK = (
    "id",
    "key",
    "follows",
    "clock",
    "name",
    "code",
    "status",
    "period",
    "count",
    "motion",
    "allowance",
    "place",
    "due",
)
TRACKER = ("counts", "time", "_begun", "_due", "_numbers", "_places", "_past")
INBOX = ("newest", "held", "arrivals", "strange", "dropped")


def save(tracker, path) -> None:
    """Write a tracker to a file."""
    tracks = [*tracker._live.values(), *tracker._ended]
    facts = {
        "schema": SCHEMA,
        "estimator": tracker.estimator.options,
        "rules": tracker.rules._asdict() | {"fastest": tracker.fastest},
        "origin": tracker.origin,
        "faults": [(f.source, f.offset, f.what) for f in tracker.faults],
        "events": tracker.events,
        "pooled": tracker.scans.pooled,
        "inbox": {name: getattr(tracker.inbox, name) for name in INBOX},
        "tracker": {name: getattr(tracker, name) for name in TRACKER},
        "live": len(tracker._live),
        "keys": {key: [t.id for t in alive] for key, alive in tracker._of_key.items()},
        "suspects": tracker._suspects,
        "tracks": [{name: getattr(t, name) for name in TRACK} | {"last": t.last, "events": t.events} for t in tracks],
    }
    arrays = {
        "facts": np.frombuffer(json.dumps(facts).encode(), np.uint8),
        "where": tracker._where,
    }
    if tracks:
        arrays |= {"states": np.stack([t.state for t in tracks]), "rows": np.concatenate([t.rows for t in tracks])}
    with open(path, "wb") as file:
        np.savez(file, **arrays)  # type: ignore[arg-type]


def restore(kind, path):
    """Return the tracker in a file."""
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = dict(file)
        facts = json.loads(arrays["facts"].tobytes())
    except (ValueError, KeyError, OSError) as error:
        raise InputError(f"{path} is no file that Tracker.save wrote ({error})") from None
    if facts["schema"] != SCHEMA:
        raise InputError(f"{path} was written with schema {facts['schema']}, this version reads {SCHEMA}")
    tracker = kind(TrackEstimator(**facts["estimator"]), **facts["rules"])
    tracker.origin = tuple(facts["origin"]) if facts["origin"] else None
    tracker.faults = [Fault(*f) for f in facts["faults"]]
    tracker.events = [Event(*e) for e in facts["events"]]
    tracker.scans.pooled = facts["pooled"]
    for name, value in facts["tracker"].items():
        setattr(tracker, name, value)
    tracker._due = [(due, id) for due, id in tracker._due]
    tracker._past = {key: (follows, clock) for key, (follows, clock) in tracker._past.items()}
    for name, value in facts["inbox"].items():
        setattr(tracker.inbox, name, value)
    tracker.inbox.held = [(time, number, _plot(p)) for time, number, p in tracker.inbox.held]
    tracker.inbox.strange = tracker.inbox.strange and _plot(tracker.inbox.strange)
    tracker._suspects = {key: [_plot(p) for p in some] for key, some in facts["suspects"].items()}
    _tracks(tracker, facts, arrays)
    return tracker


def _tracks(tracker, facts: dict[str, Any], arrays: dict[str, np.ndarray]) -> None:
    """Put the tracks back where they were."""
    first = 0
    for k, kept in enumerate(facts["tracks"]):
        track = Live(kept["id"], kept["key"], arrays["states"][k].copy(), kept["follows"], kept["clock"])
        for name in TRACK:
            setattr(track, name, kept[name])
        track.motion = tuple(kept["motion"])
        track.last, track.events = _plot(kept["last"]), [Event(*e) for e in kept["events"]]
        track.table = arrays["rows"][first : first + track.count].copy()
        first += track.count
        if k < facts["live"]:
            tracker._live[track.id] = track
        else:
            tracker._ended.append(track)
    tracker._where = arrays["where"]
    tracker._who = [None] * len(tracker._where)
    for track in tracker._live.values():
        tracker._who[track.place] = track
    tracker._of_key = {key: [tracker._live[id] for id in ids] for key, ids in facts["keys"].items()}


def _plot(row) -> Plot:
    plot = Plot(*row)
    return plot._replace(covariance=tuple(plot.covariance))
