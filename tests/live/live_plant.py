"""A plant for the tests of the service: series that are known, as messages and as a `FleetRun` takes them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

import driftwise as dw
from driftwise.fleet.run import FleetRun
from driftwise.live.config import parse
from driftwise.live.core import Core
from driftwise.live.sources.base import Parcel
from driftwise.live.sources.lines import Lines
from driftwise.live.store.sqlite import SqliteStore
from driftwise.tables.dataset import open_dataset

FIRST = 32


def outputs(series: int, samples: int, seed: int = 1) -> np.ndarray:
    """Return outputs (S, T) around levels of their own."""
    rng = np.random.default_rng(seed)
    noise = rng.standard_normal((series, samples))
    y = np.zeros((series, samples))
    for t in range(1, samples):
        y[:, t] = 0.8 * y[:, t - 1] + noise[:, t]
    return y + 20.0 * np.arange(series)[:, None]


def estimator(config=None):
    return dw.AR(2, offset=True, memory=dw.AutoMemory())


class Nowhere:
    """Takes what a run writes."""

    def take(self, found):
        pass

    def happened(self, at, seen):
        pass


def states(y: np.ndarray) -> dict[str, bytes]:
    """Return the states of a fleet that takes the whole of it at once, by key."""
    S, T = y.shape
    table = {"key": np.tile([f"s{i}" for i in range(S)], T), "time": np.repeat(np.arange(T) + 1e9, S), "y": y.T.ravel()}
    run = FleetRun(dw.Fleet(estimator(), threads=1), Nowhere(), every=0, first=FIRST)
    for batch in open_dataset(table, by="key", output="y", time="time").batches(1 << 16):
        run.take(batch)
    return {key: run.fleet.state(key).tobytes() for key in run.fleet.keys}


def found(core: Core) -> dict[str, bytes]:
    """Return the states of a core, by key."""
    return {key: rows.fleet.state(key).tobytes() for rows in core.roster.groups for key in rows.fleet.keys}


def opened(folder, model='model = "ar:2"') -> Core:
    """Return the core of what a service left in a folder."""
    config = parse(f'[model]\n{model}\n[store]\npath = "{folder}"\n')
    return Core(config, SqliteStore(folder), estimator)


def lines(y: np.ndarray, first: int, last: int) -> str:
    """Return samples as JSON lines."""
    rows = ((i, t) for t in range(first, last) for i in range(len(y)))
    return "".join(json.dumps({"key": f"s{i}", "time": 1e9 + t, "value": float(y[i, t])}) + "\n" for i, t in rows)


def parcel(y: np.ndarray, first: int, last: int) -> Parcel:
    """Return samples as a source hands them over, with the place "file"."""
    chunks, refused = Lines("json").read(lines(y, first, last).encode())
    return Parcel(chunks, None, ("file", last), refused)


def configuration(folder: Path, source: str, store: str = "fsync = 0.2") -> Path:
    """Write the configuration of a service, return its path."""
    path = folder / "live.toml"
    path.write_text(
        f'[model]\nmodel = "ar:2"\n[store]\npath = "{folder / "store"}"\n{store}\n[web]\nenabled = false\n{source}'
    )
    return path
