"""`driftwise live`: samples a second to what is on disk, memory and start; the process of it is in `live_service`."""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import driftwise as dw
from driftwise.live.config import parse
from driftwise.live.core import Core
from driftwise.live.decode import chunks
from driftwise.live.sources.base import Parcel
from driftwise.live.store.sqlite import SqliteStore
from driftwise.live.view import gathered
from driftwise.live.web.samples import samples_of

from . import live_service
from .live_messages import TOPICS, messages
from .memory import resident
from .verdicts import Verdict, at_least, at_most

SOURCE = "bench/live.py"
NOW = 2e9


def verdicts(big: bool = False) -> Iterator[Verdict]:
    """Yield rates of the core, memory, start, and what passes through mosquitto where there is one."""
    with tempfile.TemporaryDirectory() as folder:
        yield from _core(Path(folder), 10_000_000 if big else 1_000_000)
    with tempfile.TemporaryDirectory() as folder:
        yield _start(Path(folder))
    yield from live_service.verdicts()


def estimator(config=None) -> dw.AR:
    """Return what every series gets."""
    return dw.AR(2, offset=True, memory=dw.AutoMemory())


def core_in(folder: Path) -> Core:
    """Return a core with its store in a folder."""
    config = parse(f'[model]\nmodel = "ar:2"\n[store]\npath = "{folder}"\n')
    return Core(config, SqliteStore(folder), estimator)


def _core(folder: Path, total: int) -> Iterator[Verdict]:
    """Yield rates of one core without a network, and memory over all of it."""
    core, at = core_in(folder), 0
    for size, handful, least in ((50, 40, 20_000.0), (1, 100, 2_000.0)):
        count = max(total // 4 // size // (10 if size == 1 else 1), 4 * TOPICS)
        cost = _fed(core, messages(count, size, at), handful)
        at += count // TOPICS * size + size
        what = f"live: messages of {size} samples through decoding, estimating, committing"
        yield at_least(what, count * size / cost, least, "samples/s of CPU time", SOURCE)
    body = b"".join(
        b'{"key": "h%d", "time": %d, "value": %.3f}\n' % (i % 50, 1e9 + i // 50, i % 7) for i in range(50_000)
    )
    begun = time.process_time()
    core.take([Parcel(gathered(samples_of(body, "json")[0]))], NOW)
    core.commit()
    yield at_least("live: a body of 50 000 lines by HTTP", 50_000 / (time.process_time() - begun), 50_000.0,
                   "samples/s of CPU time", SOURCE)  # fmt: skip
    after, size = [], 50
    for _ in range(4):
        _fed(core, messages(total // 4 // size, size, at), 40)
        at += total // 4 // size // TOPICS * size + size
        part = core.history.part()
        if part is not None:
            core.history.write(part, core.keys(part.numbers))
            core.store.forget(part.last)
            core.history.written(part)
        after.append(resident())
    yield at_most("live: memory, after all samples over after half of them", after[3] / after[1], 1.05, "x", SOURCE,
                  f"{after[3] / 1e6:.0f} MB, history in Parquet")  # fmt: skip
    core.store.close()


def _fed(core: Core, found: list[tuple[str, bytes]], handful: int) -> float:
    """Feed messages, so many between two commits; return CPU seconds."""
    begun = time.process_time()
    for i in range(0, len(found), handful):
        core.take([Parcel(chunks(payload, key)) for key, payload in found[i : i + handful]], NOW)
        core.commit()
    return time.process_time() - begun


def _start(folder: Path) -> Verdict:
    """Return how long a core of 10 000 stored series takes to begin."""
    core = core_in(folder)
    rng = np.random.default_rng(2)
    for t in range(0, 40, 10):
        times = [1e9 + t + j for j in range(10)]
        core.take([Parcel(chunks(json.dumps({"time": times, "value": rng.standard_normal(10).tolist()}), f"s{i}"))
                   for i in range(10_000)], NOW)  # fmt: skip
    core.commit()
    core.store.close()
    begun = time.perf_counter()
    core_in(folder).store.close()
    return at_most("live: start with 10 000 stored series", time.perf_counter() - begun, 3.0, "s", SOURCE)
