"""What a tracker that runs for months lets go: ended tracks, old rows, old events, words that nobody uses any more."""

from __future__ import annotations

import numpy as np

from .live import PLOT
from .targets import Targets

LEAST = 64  # rows that a live track keeps, however old


def forget(targets: Targets, before: float) -> None:
    """Forget what lies before a time, s; estimates go on as they would have.

    What is told of a live track is then of its plots since; a key that was not heard of since begins anew.
    """
    targets.ended = [track for track in targets.ended if track.last.time >= before]
    targets.events = [event for event in targets.events if event.time >= before]
    targets.past = {
        key: (follows, clock)
        for key, (follows, clock) in targets.past.items()
        if any(seen[0] >= before for seen in clock.values())
    }
    kept = [*targets.live.values(), *targets.ended]
    for track in targets.live.values():
        first = min(int(np.searchsorted(track.rows[:, 0], before)), max(track.count - LEAST, 0))
        if first:
            track.table = track.rows[first:].copy()
            track.count -= first
            track.events = [event for event in track.events if event.time >= before]
    heard = {sensor for track in kept for sensor in track.clock}
    targets.scans.pooled = {sensor: pool for sensor, pool in targets.scans.pooled.items() if sensor in heard}
    _renumber(targets, kept)


def _renumber(targets: Targets, kept: list) -> None:
    """Drop the words that no row uses."""
    words, columns = list(targets.numbers), slice(PLOT - 3, PLOT)
    used = np.unique(np.concatenate([[0.0], *(np.unique(track.rows[:, columns]) for track in kept)])).astype(int)
    if len(used) == len(words):
        return
    new = np.zeros(len(words))
    new[used] = np.arange(len(used))
    for track in kept:
        table = track.rows.copy()  # a view of the old rows may have been handed out
        table[:, columns] = new[table[:, columns].astype(int)]
        track.table = table
    targets.numbers = {words[old]: k for k, old in enumerate(used)}
