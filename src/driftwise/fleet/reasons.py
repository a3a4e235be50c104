"""Why a series of a fleet is listed, in one sentence."""

from __future__ import annotations

import numpy as np

from ..results.numbers import count_of, percent
from ..results.sentences import series_jump_words
from ..results.summary import combination
from .counters import never_moved


def reason(kind: str, row: int, *, fleet, tally, census, rest, inputs, when) -> str:
    """Return why a series is listed under a kind of `outliers.KINDS`."""
    if kind == "jumped":
        return series_jump_words(float(tally["jumps"][row]), when(float(tally["last_jump"][row])))
    if kind == "drifts":
        memory = census.memory[row]
        fastest = int(np.nanargmin(memory)) if np.isfinite(memory).any() else None
        speed = "" if fastest is None else f": {census.names[fastest]} forgets {_forgetting(memory[fastest])}"
        return f"drifts, {100 * (1 - census.still[row]):.3g} % likely{speed}"
    if kind == "differs":
        z = np.nan_to_num(rest.z[row])
        most = int(np.argmax(np.abs(z)))
        value, usual, spread = census.theta[row, most], rest.median[most], rest.spread[most]
        about = f" \u00b1 {spread:.2g}" if spread > 0 else ""
        return (
            f"{census.names[most]} is {value:.3g}, that of the rest {usual:.3g}{about} ({abs(z[most]):.1f} deviations)"
        )
    if kind == "noise":
        ratio = census.noise[row] / rest.noise
        return f"noise of {census.noise[row]:.3g}, {ratio:.2g} times that of the rest"
    if kind == "untaught":
        return _untaught(row, fleet, census, inputs)
    if kind == "bars":
        count = max(float(tally["scored"][row]), 1.0)
        nis, held = tally["z2"][row] / count, tally["inside"][row] / count
        return f"NIS {nis:.3g} (1 is right), 95 % bands hold {100 * held:.1f} %"
    return _data(row, tally)


def _forgetting(samples: float) -> str:
    """Return a memory in words."""
    return f"in about {samples:.0f} samples" if samples >= 1.5 else "from one sample to the next"


def _untaught(row: int, fleet, census, inputs) -> str:
    idle = np.flatnonzero(~census.moves[row])
    if len(idle):
        names = [inputs[j] if j < len(inputs) else f"input {j + 1}" for j in idle]
        return f"{' and '.join(names)} never moved: what {'they do' if len(idle) > 1 else 'it does'} cannot be learnt"
    est = fleet.estimators[fleet._group[row]]
    ratio, direction = est.information_ratio(fleet.states[row])[0]
    return f"nothing was learnt of {combination(direction, est.names)} (variance {ratio:.2g} of the prior's)"


def _data(row: int, tally) -> str:
    rows = max(sum(float(tally[name][row]) for name in ("samples", "late", "duplicate")), 1.0)
    shares = {
        "missing": tally["missing"][row], "bad cells": tally["bad"][row],
        "late or twice": tally["late"][row] + tally["duplicate"][row],
    }  # fmt: skip
    parts = [f"{percent(count / rows)} {what}" for what, count in shares.items() if count]
    stuck = "the output never moved: is its sensor stuck? " if never_moved(tally, row) else ""
    measured = int(tally["measured"][row])
    return stuck + ", ".join([*parts, count_of(measured, "measured sample")])
