"""The cases of a day, one after the other."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable, Iterator
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from . import service, tables, troubles
from .cases import Case, drawn, try_case


def load() -> None:
    """Import what commands import when they run, so that a forked process need not."""

    import driftwise.analysis.study
    import driftwise.cli.entry
    import driftwise.cli.main
    import driftwise.fleet.fleet_run
    import driftwise.report.run_page
    import driftwise.report.terminal
    import driftwise.report.tracks_page
    import driftwise.tables.autoread
    import driftwise.tracking.read
    import driftwise.tracking.tracker  # noqa: F401


def files(seed: int, numbers: Iterable[int]) -> Iterator:
    """Yield (number, case, what is wrong, outcome) of drawn files; a number draws the same one always."""
    for number in numbers:
        case = drawn(np.random.default_rng([seed, number]))
        yield number, case, *try_case(case)


def happenings(seed: int, numbers: Iterable[int]) -> Iterator:
    """Yield the same of commands that work, and something happens to them."""
    for number in numbers:
        case = troubles.drawn(np.random.default_rng([seed, 1, number]))
        yield number, case, *try_case(case)


def disks(seed: int, numbers: Iterable[int]) -> Iterator:
    """Yield the same of commands that write to a disk that is small; of none where this user may not make one."""
    for number in numbers:
        rng = np.random.default_rng([seed, 2, number])
        case, size = troubles.a_command(rng, 100), int(rng.choice([30_000, 100_000, 300_000]))
        with troubles.small_disk(size) as disk:
            case.folder, case.told = disk, f"{case.told}: a disk of {size} bytes"
            if disk is not None:
                yield number, case, *try_case(case)


def caches(seed: int, numbers: Iterable[int]) -> Iterator:
    """Yield the same of commands whose compiled loops are damaged: they say what they said before."""
    rng, said = np.random.default_rng([seed, 3]), ""
    data = tables.plain(rng, 40).to_bytes()
    with tempfile.TemporaryDirectory() as cache:
        for number in numbers:
            case = Case({"t.csv": data}, ["run", "t.csv", "-o", "y", "-i", "u", "--json", "-"])
            case.told = f"cache: {troubles.spoil(Path(cache), rng)}"
            case.codes, case.seconds = {0}, 120.0  # compiled again
            case.options = {"prepare": lambda: os.environ.update(DRIFTWISE_CACHE=cache)}
            wrong, outcome = try_case(case)
            said = said or outcome.out
            yield number, case, wrong + ["another answer"] * (outcome.out != said), outcome


def requests(seed: int, numbers: range) -> Iterator:
    """Yield the same of requests to one live service, and in the end of the service as a whole."""
    if not numbers or find_spec("starlette") is None:
        return
    with tempfile.TemporaryDirectory() as folder, service.served(Path(folder)) as served:
        for number in numbers:
            request = service.drawn(np.random.default_rng([seed, 4, number]))
            yield number, Case({}, [request.told], "a request"), *served.tried(request)
        yield numbers[-1], Case({}, ["live"], "the service after all of them"), *served.end()
