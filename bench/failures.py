"""What breaks whom: one NaN, and a vague prior, in driftwise and in the others fed with the same numbers."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import driftwise as dw

from .opponents import FilterPy
from .peers import P0, PEERS, Q, R
from .plant import joint, record
from .rivals import data
from .verdicts import Table, Verdict, at_most, for_information

SOURCE = "bench/failures.py"


def verdicts(samples: int = 2_000) -> Iterator[Verdict | Table]:
    """Yield how many estimates one NaN costs, and the worst prediction after a prior of 1e16."""
    y, u = record(samples)
    half = samples // 2
    spoiled = y.copy()
    spoiled[half] = np.nan
    ours = joint("EquationError", P0=10.0).scan(spoiled, u).prediction
    name = f"one NaN: predictions lost of the next {samples - half - 1}"
    yield at_most(name, np.count_nonzero(~np.isfinite(ours)), 0, "", SOURCE)
    yield _one_nan(samples)

    right = joint("EquationError", P0=1e6).scan(y, u).prediction
    settled = slice(half, None)
    name = "prior 1e16: worst prediction error against prior 1e6"
    ours = joint("EquationError", P0=1e16).scan(y, u).prediction
    yield at_most(name, float(np.abs(ours - right)[settled].max()), 1e-6, "", SOURCE)
    try:
        theirs = FilterPy(joint("EquationError", P0=1e16), y, u).run()
    except ImportError:
        return
    yield for_information(f"{name}, filterpy", float(np.abs(theirs - right)[settled].max()), "", SOURCE)


def _one_nan(samples: int) -> Table:
    """Return what becomes of the estimates after a NaN in the output, and after one among the regressors."""
    y, h = data(samples)
    half = samples // 2
    no_y, no_h = y.copy(), h.copy()
    no_y[half] = no_h[half, 1] = np.nan
    est = dw.Regression(4, memory=dw.RandomWalk(Q), variance=R, P0=P0)
    everybody = {"driftwise": lambda y, h: est.scan(y, h).parameters, **PEERS}
    rows = [(name, _lost(run, no_y, h, half), _lost(run, y, no_h, half)) for name, run in everybody.items()]
    text = f"Estimates of a drifting regression lost of the {samples - half} from the NaN on. Nobody raises or warns."
    return Table("One NaN", ("who", "a NaN in y", "a NaN among the regressors"), rows, text)


def _lost(run, y, h, half: int) -> int | str:
    try:
        with np.errstate(all="ignore"):
            found = run(y, h)
    except (ImportError, OSError):
        return "not installed"
    except (ValueError, FloatingPointError, np.linalg.LinAlgError) as error:
        return f"{type(error).__name__}: {error}"
    return int(np.count_nonzero(~np.isfinite(found[half:]).all(axis=1)))
