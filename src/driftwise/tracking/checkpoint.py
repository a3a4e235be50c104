"""A tracker on disk: JSON and arrays of numbers in one ``.npz`` file; every bit survives, nothing is pickled."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from ..engine.atomic import replaced
from ..engine.errors import InputError
from ..engine.saved import reading
from ..estimators.track.estimator import TrackEstimator
from .existence import SURE, Existence
from .live import PLOT, TENTATIVE, Event, Live, Plot
from .places import FREE
from .plots import Fault

# 4: what is learnt of plots without keys; 5: how much sensors err by objects that move; 6: tables as wide as then;
# 7: the plot that was called wild; 8: what a target may do
SCHEMA = 8
AS_TODAY = 8  # from this schema on: what is narrower was damaged, and is no table of an earlier version
PLAIN = "id key follows clock name code status period count allowance place due odds quiet".split()  # of a track
LEARNT = "box hits chances begun born quiet sees_at_once".split()  # of plots without keys
COUNTED = "counts time before begun numbers".split()  # of the targets


def save(tracker, path) -> None:
    """Write a tracker to a file."""
    targets, inbox = tracker.targets, tracker.inbox
    tracks = [*targets.live.values(), *targets.ended]
    facts = {
        "schema": SCHEMA,
        "estimator": tracker.estimator.options,
        "rules": tracker.rules._asdict(),
        "origin": tracker.origin,
        "faults": [(f.source, f.offset, f.what) for f in tracker.faults],
        "newest": inbox.newest,
        "held": inbox.held,
        "arrivals": inbox.arrivals,
        "strange": inbox.strange,
        "dropped": inbox.dropped,
        "steps": inbox.steps,
        "pooled": targets.scans.pooled,
        "free": targets.places.free,
        "events": targets.events,
        "at_once": targets.at_once,
        "existence": {name: getattr(targets.existence, name) for name in LEARNT},
        "nobody": targets.existence.clutter.table.tolist(),
        "errors": targets.existence.errors.seen,
        "suspects": targets.suspects,
        "past": targets.past,
        "due": targets.due,
        "live": len(targets.live),
        "keys": {key: [t.id for t in alive] for key, alive in targets.of_key.items()},
        "tracks": [_facts(track) for track in tracks],
        **{name: getattr(targets, name) for name in COUNTED},
    }
    arrays = {"facts": np.frombuffer(json.dumps(facts).encode(), np.uint8), "places": targets.places.table}
    if tracks:
        arrays |= {"states": np.stack([t.state for t in tracks]), "rows": np.concatenate([t.rows for t in tracks])}
    with replaced(path) as beside, open(beside, "wb") as file:
        np.savez(file, **arrays)


def restore(kind, path):
    """Return the tracker in a file."""
    with reading(path, "Tracker.save"):
        with np.load(path, allow_pickle=False) as file:
            arrays = dict(file)
        facts = json.loads(arrays["facts"].tobytes())
        written, facts = facts["schema"], _upgraded(facts)
        if facts["schema"] != SCHEMA:
            raise InputError(f"it was written with schema {facts['schema']}, this version reads {SCHEMA}")
        tracker = kind(TrackEstimator(**facts["estimator"]), **facts["rules"])
        tracker.origin = tuple(facts["origin"]) if facts["origin"] else None
        tracker.faults = [Fault(*f) for f in facts["faults"]]
        inbox = tracker.inbox
        inbox.newest, inbox.arrivals, inbox.dropped = facts["newest"], facts["arrivals"], facts["dropped"]
        inbox.remember(facts["steps"])
        inbox.held = [(time, number, _plot(p)) for time, number, p in facts["held"]]
        inbox.strange = _plot(facts["strange"]) if facts["strange"] else None
        if written < AS_TODAY:
            _carry_over(tracker.estimator, arrays)
        _check_widths(tracker.estimator, arrays)
        _put_back(tracker.targets, facts, arrays)
        return tracker


def _carry_over(estimator: TrackEstimator, arrays: dict[str, np.ndarray]) -> None:
    """Lay out states, and what was told of each plot, as this version does."""
    if "states" in arrays:
        arrays["states"] = estimator.carried_over(arrays["states"])
        plots, told = np.split(arrays["rows"], [PLOT], axis=-1)
        arrays["rows"] = np.concatenate([plots, estimator.carried_table(told)], axis=-1)


def _check_widths(estimator: TrackEstimator, arrays: dict[str, np.ndarray]) -> None:
    """Refuse tables that a compiled loop would read beyond their ends."""
    widths = {"states": estimator.start().nbytes // 8, "rows": PLOT + estimator.n_columns, "places": len(FREE)}
    for name, width in widths.items():
        table = arrays.get(name, np.empty((0, width)))
        if table.dtype != np.float64 or table.shape[1:] != (width,):
            raise InputError(
                f"its {name} are {table.dtype} of shape {table.shape}, this version keeps {width} numbers each"
            )


def _upgraded(facts: dict[str, Any]) -> dict[str, Any]:
    """Return what earlier schemas wrote as this one has it: nothing is learnt yet of what they did not know."""
    if facts["schema"] == 3:
        for track in facts["tracks"]:
            track |= {"odds": 0.0 if track["status"] == TENTATIVE else SURE, "quiet": 0.0}
        nothing = Existence()
        learnt = {name: getattr(nothing, name) for name in LEARNT}
        facts |= {"schema": 4, "at_once": [], "existence": learnt, "nobody": []}
    if facts["schema"] == 4:
        nobody = [[*row, 1.0] for row in facts["nobody"]]
        facts |= {"schema": 5, "errors": {}, "nobody": nobody}
    if facts["schema"] in (5, 6, 7):
        facts |= {"schema": SCHEMA}
    return facts


def _put_back(targets, facts: dict[str, Any], arrays: dict[str, np.ndarray]) -> None:
    """Put the tracks where they were."""
    for name in COUNTED:
        setattr(targets, name, facts[name])
    targets.scans.pooled = facts["pooled"]
    targets.at_once = [_plot(p) for p in facts["at_once"]]
    for name in LEARNT:
        setattr(targets.existence, name, facts["existence"][name])
    targets.existence.clutter.table = np.array(facts["nobody"]).reshape(-1, 5)
    targets.existence.errors.seen = facts["errors"]
    targets.events = [Event(*e) for e in facts["events"]]
    targets.suspects = {key: [_plot(p) for p in some] for key, some in facts["suspects"].items()}
    targets.past = {key: (follows, clock) for key, (follows, clock) in facts["past"].items()}
    targets.due = [(due, id) for due, id in facts["due"]]
    places = targets.places
    places.table, places.free, places.who = arrays["places"], facts["free"], [None] * len(arrays["places"])
    tables = np.split(arrays["rows"], np.cumsum([t["count"] for t in facts["tracks"]])[:-1]) if facts["tracks"] else []
    for k, (kept, table) in enumerate(zip(facts["tracks"], tables)):
        track = _track(kept, arrays["states"][k].copy(), table.copy())
        if k < facts["live"]:
            targets.live[track.id] = places.who[track.place] = track
        else:
            targets.ended.append(track)
    targets.of_key = {key: [targets.live[id] for id in ids] for key, ids in facts["keys"].items()}


def _facts(track: Live) -> dict[str, Any]:
    more = {"last": track.last, "sure": track.sure, "motion": track.motion, "events": track.events}
    return {name: getattr(track, name) for name in PLAIN} | more


def _track(kept: dict[str, Any], state: np.ndarray, table: np.ndarray) -> Live:
    track = Live(kept["id"], kept["key"], state, kept["follows"], kept["clock"])
    for name in PLAIN:
        setattr(track, name, kept[name])
    track.table, track.motion = table, tuple(kept["motion"])
    track.last, track.sure = _plot(kept["last"]), _plot(kept["sure"])
    track.events = [Event(*e) for e in kept["events"]]
    return track


def _plot(row) -> Plot:
    plot = Plot(*row)
    return plot._replace(covariance=tuple(plot.covariance))
