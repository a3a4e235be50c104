"""The cases of a day, one after the other."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from .cases import drawn, try_case
from .troubles import drawn as happens


def load() -> None:
    """Import what commands import when they run, so that a forked process need not."""

    import driftwise.analysis.study
    import driftwise.cli.main
    import driftwise.fleet.fleet_run
    import driftwise.report.run_page
    import driftwise.report.terminal
    import driftwise.report.tracks_page
    import driftwise.tables.autoread
    import driftwise.tracking.read
    import driftwise.tracking.tracker  # noqa: F401


def files(seed: int, numbers: Iterable[int]) -> Iterator:
    """Yield (kind, number, case, what is wrong, outcome) of drawn cases; a number draws the same one always."""
    load()
    for number in numbers:
        case = drawn(np.random.default_rng([seed, number]))
        yield "file", number, case, *try_case(case)


def troubles(seed: int, numbers: Iterable[int]) -> Iterator:
    """Yield the same of commands that work, and something happens to them."""
    load()
    for number in numbers:
        case = happens(np.random.default_rng([seed, 1 << 20, number]))
        yield "trouble", number, case, *try_case(case)
