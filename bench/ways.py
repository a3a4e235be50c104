"""One recursion, four ways to feed it: a call for each sample, a record, a fleet."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import driftwise as dw

from .clock import alternate
from .fleets import Feed, seconds_of
from .verdicts import Table

COLUMNS = (
    "estimator", "est.update", "raw call", "record, std", "record, innovations",
    "fleet, order of time", "fleet, order of series", "est.update_batch",
)  # fmt: skip
SERIES = 10_000


def estimators() -> dict[str, object]:
    """Return those that the table compares."""
    return {
        "Joint(3)": dw.Joint(3),
        "Joint(3), input, direct": dw.Joint(3, inputs=1, direct=True),
        "ARX(2, 2)": dw.ARX(2, 2),
        "ARX(2, 2), AutoMemory": dw.ARX(2, 2, memory=dw.AutoMemory()),
    }


def verdicts() -> Iterator[Table]:
    """Yield nanoseconds per sample of each estimator, each way."""
    rows = [(name, *_each(est)) for name, est in estimators().items()]
    text = (
        "Nanoseconds of one core per sample. A raw call is the compiled loop without checks (`est.drive`); a fleet of "
        f"{SERIES} series takes a table through `Fleet.advance`, all series at one instant after the other, or one "
        "series after the other; `est.update_batch` takes one sample of each series. Every way gives the same bits."
    )
    yield Table("Nanoseconds per sample", COLUMNS, rows, text)


def _each(est) -> list[float]:
    """Return the nanoseconds of each way."""
    feed = Feed(est, SERIES, 20)
    y, u = np.tile(feed.y[:, 0], 10), np.tile(feed.u[:, 0], 10)
    inputs = u if est.model.inputs else None
    few, pairs = 1000, list(zip(y.tolist(), u.tolist() if est.model.inputs else [None] * len(y)))
    out, scratch, ys, us = np.empty((1, 1, 4)), est.scratch(), y.reshape(-1, 1, 1, 1), u.reshape(-1, 1, 1, 1)
    us = us if est.model.inputs else np.empty((len(y), 1, 1, 0))
    states = [feed.fleet(1).states.copy()]

    def update():
        state = est.start()
        for value, given in pairs[:few]:
            state, _ = est.update(state, value, given)

    def raw():
        rows = est.start(1).view("f8").reshape(1, -1)
        for t in range(few):
            est.drive(rows, ys[t], us[t], out, est.spec, scratch)

    def update_batch():
        for t in range(2):
            states[0], _ = est.update_batch(
                states[0], feed.y[200 + t].repeat(10), feed.u[200 + t].repeat(10) if est.model.inputs else None
            )

    def record(keep):
        return lambda: est.scan(y, inputs, keep=keep)

    seconds = np.median(alternate(update, raw, update_batch, rounds=5), axis=0) / [few, few, 2 * SERIES]
    scans = np.median(alternate(record("std"), record("innovations"), rounds=7), axis=0) / len(y)
    fleets = [np.median(seconds_of(feed.fleet(1), feed.batches(50_000, is_sorted))) for is_sorted in (False, True)]
    return [float(1e9 * s) for s in (seconds[0], seconds[1], *scans, *fleets, seconds[2])]
