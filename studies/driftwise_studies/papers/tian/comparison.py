"""Everybody on the same records: errors of the states, when the current settles, and what model errors do.

A row is a name and a function of y (S, T) and u (T,) that returns [x1, x2, x3] (S, T, 3); more rows are handed over as
a dictionary, or for model errors as a function of what estimators are `Told`. Where the name is in ``LISTED`` or
``LISTED_ERRORS``, the row is judged against the numbers there: 200 records, other code.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from decimal import Decimal

import numpy as np
from scipy.stats import norm, t

from ..verdict import Section, Table, Verdict
from .listed import LISTED, LISTED_ERRORS, THIS
from .motor import NOMINAL, SCENARIOS, SECONDS, Records, Scenario, Told, records
from .opponents import Run, filters, opponents

LIMITS = (0.015, 0.25, 1.2)  # a state has settled when its error stays below: rad, rad/s, A
EARLY = 0.15  # the paper's epsilon, s
SURE = 4.0  # standard errors


@dataclass(frozen=True)
class Score:
    """What one row is worth; the last axis is [x1, x2, x3]."""

    early: np.ndarray  # RMSE from 0.15 s on
    late: np.ndarray  # RMSE from 2 s on, or from after the jump
    early_error: np.ndarray  # standard errors of these, over the seeds
    late_error: np.ndarray
    settles: np.ndarray  # (S, 3), after this time (s) the error stays below its limit; infinite: not at the end either

    @property
    def settling(self) -> np.ndarray:
        """Median settling times (3,), s."""
        return np.median(self.settles, axis=0)

    @property
    def settling_error(self) -> np.ndarray:
        """Standard errors of these, from the quartiles of the seeds."""
        at_most = np.minimum(self.settles, SECONDS)
        low, high = np.quantile(at_most, (0.25, 0.75), axis=0)
        return 1.25 * (high - low) / 1.35 / np.sqrt(len(self.settles))


def score(estimates: np.ndarray, r: Records) -> Score:
    """Return the score of estimates (S, T, 3); NaN counts nowhere, but nothing settles before the first estimate."""
    error = estimates - r.x
    early, late = (_rmse(error[:, r.t >= since - 1e-9]) for since in (EARLY, r.scenario.since))
    known = np.isfinite(error).any(axis=(0, 2))
    begin, end = np.argmax(known), len(known) - np.argmax(known[::-1])
    outside = np.abs(error[:, :end]) >= LIMITS
    outside[:, :begin] = True
    after = end - np.argmax(outside[:, ::-1], axis=1)  # the first sample after the last one outside
    settles = np.where(outside.any(axis=1), r.t[np.minimum(after, end - 1)], 0.0)
    settles[~(np.abs(error[:, end - 1]) < LIMITS)] = np.inf
    return Score(early[0], late[0], early[1], late[1], settles)


def _rmse(error):
    """Return root mean squares (3,) over seeds and time, and their standard errors over the seeds (by Student)."""
    count = np.isfinite(error).sum(axis=1)
    each = np.where(count > 0, np.nansum(error**2, axis=1) / np.maximum(count, 1), np.nan)
    rmse = np.sqrt(each.mean(axis=0))
    wide = t.isf(norm.sf(SURE), len(each) - 1) / SURE if len(each) > 1 else 1.0  # few seeds know their spread badly
    return rmse, wide * each.std(axis=0) / np.sqrt(len(each)) / (2 * np.maximum(rmse, 1e-300))


def scores(rows: Mapping[str, Run], scenario: Scenario = NOMINAL, seeds=200, kind: str = "uniform") -> dict[str, Score]:
    """Return the score of each row, all on the same records."""
    r = records(scenario, seeds, kind)
    return {name: score(run(r.y, r.u), r) for name, run in rows.items()}


def section(seeds: int, more: Mapping[str, Run] | None = None, judge=lambda found: []) -> Section:
    """Compare everybody on the paper's experiment; ``more`` rows come first, ``judge`` adds verdicts on the scores."""
    found = scores({**(more or {}), **opponents()}, seeds=seeds)
    rows = [[name, _words(one.early), _words(one.late), _time(one.settling[2])] for name, one in found.items()]
    head = ["estimator", "RMSE from 0.15 s: rad, rad/s, A", "RMSE from 2 s", "x3 settles"]
    return Section(
        "Everybody on the paper's experiment",
        [
            "Settling: the median time after which the error of x3 stays below 1.2 A. Windows count from when they are "
            "full. The cosine moves the angle by 8e-6 rad, a thousandth of the noise: whoever estimates it without a "
            "prior pays for it in x3, and nobody more than an observer of which the poles are asked to be fast.",
        ],
        [Table(f"Errors of the states, {seeds} records of 10 s", head, rows, is_result=True)],
        verdicts=[_verdict(name, one) for name, one in found.items() if name in LISTED] + judge(found),
    )


def _verdict(name, one):
    early, late, settles = LISTED[name]
    settled = one.settling[2:] if settles == "never" else np.minimum(one.settling[2:], SECONDS)
    fits = [
        *near(one.early, one.early_error, early),
        *near(one.late, one.late_error, late),
        *near(settled, one.settling_error[2:] + 0.01 / SURE, settles),  # 10 ms of the grid
    ]
    return Verdict(
        f"errors of the states: {name}",
        f"{_words(one.early)} from 0.15 s; {_words(one.late)} from 2 s; x3 settles: {_time(one.settling[2])}",
        f"{early}; {late}; {settles} (± a unit of the last digit and {SURE:g} standard errors)",
        all(fits),
        THIS,
    )


def near(values, errors, listed: str) -> list[bool]:
    """Return whether each value is what is listed, to a unit of its last digit and the errors; - is not listed."""
    fits = []
    for value, error, word in zip(values, errors, listed.split(), strict=True):
        if word == "never":
            fits.append(bool(np.isinf(value)))
        elif word != "-":
            digit = 10.0 ** int(Decimal(word).as_tuple().exponent)
            fits.append(bool(abs(value - float(word)) <= digit + SURE * error))
    return fits


def model_errors(seeds: int, more: Callable[[Told], Mapping[str, Run]] = lambda told: {}) -> Section:
    """Compare under wrong models and other noise; ``more`` makes further columns for what estimators are told."""
    cases = [(name, scenario, "uniform") for name, scenario in SCENARIOS.items()]
    cases += [("noise AR(1), pole 0.99", NOMINAL, "ar1"), ("50 Hz interference, no noise", NOMINAL, "hum")]
    rows, verdicts, names = [], [], []
    for case, scenario, kind in cases:
        found = scores({**more(scenario.told), **filters(scenario.told)}, scenario, seeds, kind)
        names = list(found)
        rows.append([case, *(_words(one.late[1:]) for one in found.values())])
        listed = {name: LISTED_ERRORS[case][name] for name in found if name in LISTED_ERRORS[case]}
        fits = [all(near(found[name].late[1:], found[name].late_error[1:], words)) for name, words in listed.items()]
        verdicts.append(
            Verdict(
                f"model errors: {case}",
                "; ".join(f"{name}: {_words(found[name].late[1:])}" for name in listed),
                "; ".join(listed.values()) + f" (± a unit of the last digit and {SURE:g} standard errors)",
                all(fits),
                THIS,
            )
        )
    return Section(
        "Wrong models and other noise",
        [
            "RMSE of x2 (rad/s) and x3 (A) from 2 s on, after the jump from 6 s on. Estimators are told R = 1 and "
            "w = 50 unless the row says otherwise; the truth is the paper's motor unless it says otherwise."
        ],
        [Table(f"Errors under wrong models, {seeds} records", ["case", *names], rows, is_result=True)],
        verdicts=verdicts,
    )


def _words(values) -> str:
    return ", ".join(f"{value:.3g}" for value in values)


def _time(seconds) -> str:
    return "never" if np.isinf(seconds) else f"{seconds:.2f} s"
