"""What breaks whom: one NaN, and a vague prior, in driftwise and in filterpy fed with the same matrices."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .opponents import FilterPy
from .plant import joint, record
from .verdicts import Verdict, at_most, for_information

SOURCE = "bench/failures.py"


def verdicts(samples: int = 2_000) -> Iterator[Verdict]:
    """Yield how many predictions one NaN costs, and the worst prediction after a prior of 1e16."""
    y, u = record(samples)
    half = samples // 2
    spoiled = y.copy()
    spoiled[half] = np.nan
    name = f"one NaN: predictions lost of the next {samples - half - 1}"
    ours = joint("EquationError", P0=10.0).scan(spoiled, u).prediction
    yield at_most(name, np.count_nonzero(~np.isfinite(ours)), 0, "", SOURCE)
    theirs = _filterpy(10.0, spoiled, u)
    if theirs is not None:
        lost = np.count_nonzero(~np.isfinite(theirs[half + 1 :]))
        yield for_information(f"{name}, filterpy", lost, "samples", SOURCE)

    right = joint("EquationError", P0=1e6).scan(y, u).prediction
    settled = slice(half, None)
    name = "prior 1e16: worst prediction error against prior 1e6"
    ours = joint("EquationError", P0=1e16).scan(y, u).prediction
    yield at_most(name, float(np.abs(ours - right)[settled].max()), 1e-6, "", SOURCE)
    theirs = _filterpy(1e16, y, u)
    if theirs is not None:
        yield for_information(f"{name}, filterpy", float(np.abs(theirs - right)[settled].max()), "", SOURCE)


def _filterpy(P0: float, y, u):
    try:
        with np.errstate(all="ignore"):
            return FilterPy(joint("EquationError", P0=P0), y, u).run()
    except ImportError:
        return None
