"""One claim against the truth: true, false, vacuous, or nothing that could be checked.

An interval of 95 % holds the truth where that lies within 1.5 times of it (99.7 %); a number without one, within 20 %.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .dating import dates
from .oracle import Oracle
from .plant import Plant
from .simulation import MEAN_GAP, Record, step
from .tables import NAMELESS, Written

TRUE, FALSE, VACUOUS, UNCHECKED = "true", "false", "vacuous", "unchecked"
STRETCH, NEAR, WIDE = 1.5, 0.2, 2.0
TELLABLE = float(np.log(100.0))  # log odds of the oracle beyond which a change is there for everybody
FOLLOWS = re.compile(r"level|(Seasonal)?ARX?\(")  # the models that are shown with a memory that follows a change
FASTER = re.compile(r"the plant became (faster|slower)")
MONTHS = 0.05  # by which the time between rows may differ from row to row, as that of months
SLACK = 10  # samples by which a change may be dated wrong, beside the time the plant takes to answer


@dataclass(frozen=True)
class Case:
    """A file, what is true of it, and what was answered."""

    plant: Plant
    record: Record
    written: Written
    oracle: Oracle
    answer: dict[str, Any]  # the results of `driftwise run`, as JSON has them

    @property
    def grid(self) -> float:
        """Seconds between the instants of the grid, as the clock of the file has them."""
        return self.written.dt / (MEAN_GAP if self.plant.is_irregular else 1.0)

    @property
    def dt(self) -> float:
        """Steps of the grid between two samples of the answer: whole ones, unless rows come as they like.

        A file by the month is told one sample every 31 d, but its hundredth row is its hundredth month.
        """
        steps = self.answer["dt"] / self.grid
        is_whole = not self.plant.is_irregular and abs(steps / max(round(steps), 1) - 1) < MONTHS
        return float(max(round(steps), 1)) if is_whole else steps

    @property
    def output(self) -> str:
        """The column of the output."""
        return self.written.outputs[0]

    @property
    def y_scale(self) -> float:
        """What one unit of the output is in the file."""
        return abs(self.written.affine[self.output][1])

    def gain_scale(self, i: int) -> float:
        """What one unit of a gain is in the file."""
        return self.written.affine[self.output][1] / self.written.affine[self.written.inputs[i]][1]

    @property
    def tolerance(self) -> float:
        """Steps of the grid by which a change may be dated wrong."""
        plant = self.plant
        return SLACK * max(self.dt, plant.every) + 2 * plant.slowest + max(plant.delays)


def check(case: Case, claim: dict[str, Any]) -> str:
    """Return what a claim is worth."""
    rule = RULES.get(claim["kind"])
    return rule(case, claim) if rule else UNCHECKED


def _said(is_true: bool) -> str:
    return TRUE if is_true else FALSE


def column(case: Case, claim) -> str:
    """Output and inputs as they are; nothing left out that plays a part."""
    value, written = claim["value"], case.written
    if claim["subject"] == "output":
        return _said(value == written.outputs[0])
    if claim["subject"] == "inputs":
        return _said(set(value) == set(written.inputs))
    if claim["subject"] == "left out":
        return _said(not {written.outputs[0], *written.inputs} & set(value))
    return UNCHECKED


def clock(case: Case, claim) -> str:
    """The clock, and the time between its rows; on an irregular one a step between the shortest and the longest."""
    written, record = case.written, case.record
    is_index = bool(written.clocks) and NAMELESS.fullmatch(written.clocks[0]) and not case.plant.is_irregular
    if not claim["subject"] and is_index and written.dt == 1.0:  # 0, 1, 2, .. under no name count rows
        return _said(claim["value"] == 1.0)
    if bool(claim["subject"]) != bool(written.clocks):
        return FALSE
    if claim["subject"] and not set(claim["subject"].split(" and ")) & set(written.clocks):
        return FALSE
    if case.plant.is_irregular:
        gaps = np.diff(record.rows) * case.grid
        return _said(bool(gaps.min() * 0.99 <= claim["value"] <= gaps.max()))
    steps = claim["value"] / case.grid
    return _said(abs(steps - round(steps)) < 0.05 and round(steps) in (1, case.plant.every))


def table(case: Case, claim) -> str:
    """What a note says of the sensor, against what the sensor did."""
    plant, text, value = case.plant, claim["text"], claim["value"]
    is_output = claim["subject"] == case.output
    if "stuck" in text:
        return _said(bool(plant.stuck[1]) and is_output)
    if "in steps of" in text and is_output and plant.levels:
        return _said(abs(value / (step(plant, case.record.unit) * case.y_scale) - 1) < 0.01)
    if "is missing" in text and is_output:
        truth = np.mean(~np.isfinite(case.record.y[case.record.rows]))
        return _said(abs(value - truth) < 0.05 + 0.2 * truth)
    if "not believed" in text:
        return _said(_doubts(case, claim["subject"], text))
    return UNCHECKED


def _doubts(case: Case, name: str, text: str) -> bool:
    """Whether values are doubted for what is true of them: a code that stands for lost cells, or drawn outliers."""
    written, is_code = case.written, "for a missing value" in text
    if is_code and not (f"({written.code} for a missing value" in text and written.lost.get(name, 0)):
        return False
    is_far = "drop-outs" in text or "far outside" in text
    return not is_far or (bool(case.plant.outliers[0]) and name == case.output)


def plant(case: Case, claim) -> str:
    """The order, where one is said. That nothing was found is no statement about the plant."""
    return UNCHECKED if claim["value"] is None else _said(claim["value"] == len(case.plant.poles))


def gain(case: Case, claim) -> str:
    """The gain at the end; where a nonlinearity bends it, said to bend or with an interval that holds the bend."""
    if claim["value"] is None:
        return UNCHECKED
    if claim["subject"] not in case.written.inputs:
        return FALSE
    i = case.written.inputs.index(claim["subject"])
    oracle = case.oracle
    low, high = _stretched(claim)
    scale = case.gain_scale(i)
    truth, (least, most) = scale * oracle.gains[i], sorted(scale * end for end in oracle.spreads[i])
    if not low <= truth <= high:
        return FALSE
    has_bend = max(abs(least), abs(most)) > 1.5 * min(abs(least), abs(most))
    if has_bend and not (low <= least and most <= high) and not _warns(case, "nonlinear"):
        return FALSE
    return _width(claim, abs(scale) * oracle.gain_bars[i])


def time_constant(case: Case, claim) -> str:
    """When the answer to a step is 63 % done, half a sample more or less; without an input, a mode that there is."""
    factor, written = case.grid, case.written
    low, high = _stretched(claim)
    slack = 0.5 * case.answer["dt"]
    if claim["subject"] in written.inputs:
        truth, bar = case.oracle.times[written.inputs.index(claim["subject"])]
        return _width(claim, bar * factor) if low - slack <= truth * factor <= high + slack else FALSE
    if not any(low - slack <= tau * factor <= high + slack for tau in case.plant.time_constants):
        return FALSE
    return _width(claim, case.oracle.slowest[1] * factor)


def pole(case: Case, claim) -> str:
    """The period of an oscillation that the plant has; any other pole it has not."""
    if claim["value"] is None:
        return FALSE
    value = claim["value"] / case.grid
    return _said(any(abs(value / period - 1) < NEAR for period in case.plant.periods))


def delay(case: Case, claim) -> str:
    """The samples until the first answer, one more or less."""
    if claim["subject"] not in case.written.inputs:
        return FALSE
    truth = case.plant.delays[case.written.inputs.index(claim["subject"])] / case.dt
    return _said(abs(claim["value"] - truth) <= 1 + 1 / case.dt)


def change(case: Case, claim) -> str:
    """A change that happened then, of that kind; none where none is there that is said to be visible."""
    subject, value = claim["subject"], claim["value"]
    tellable = tellable_jumps(case)
    if subject == "others":
        return UNCHECKED
    if value is None:
        return UNCHECKED
    if isinstance(value, dict):
        return _said(not any(_is_larger(case, k, value) for k in tellable))
    return _said(any(is_told(case, k, claim) for k in range(len(case.plant.jumps))))


def tellable_jumps(case: Case) -> list[int]:
    """Return the jumps that the oracle puts above 100:1."""
    return [k for k, odds in enumerate(case.oracle.log_odds) if odds > TELLABLE]


def is_attainable(case: Case, k: int) -> bool:
    """Whether a jump is above 100:1 for who is not told when it was, nor what jumped, and could be dated by the output.

    There are as many dates as tolerances in the record, and levels, noise and the gain of each input; a gain has to
    be told from a level. A jump in a stretch in which the sensor was stuck is dated by nobody to more than that.
    """
    plant, jump = case.plant, case.plant.jumps[k]
    dates = max(plant.samples / (2 * case.tolerance), 1.0)
    first, length = plant.stuck
    is_unseen = first <= jump.at <= first + length and length > 2 * case.tolerance
    odds = min(case.oracle.log_odds[k] - np.log(dates * (2 + len(plant.gains))), case.oracle.named_odds[k])
    return not is_unseen and bool(odds > TELLABLE)


def _is_larger(case: Case, k: int, visible) -> bool:
    """Whether a jump is larger than one that is said to be visible."""
    jump = case.plant.jumps[k]
    if jump.what == "level":
        return abs(jump.size) * case.record.unit * case.y_scale > (visible["level"] or np.inf)
    if jump.what == "noise":
        return max(jump.size, 1 / jump.size) > (visible["noise"] or np.inf)
    if jump.what == "lag":  # of which nothing is said
        return False
    return abs(jump.size - 1) > visible["gain"].get(case.written.inputs[jump.input], np.inf)


def is_told(case: Case, k: int, claim) -> bool:
    """Whether a claim is about a jump: at its time, and of its kind where one is named."""
    if claim["kind"] != "change" or not isinstance(claim["value"], int) or claim["subject"] == "others":
        return False
    jump, subject = case.plant.jumps[k], claim["subject"]
    if not is_near(case, k, claim) and not _is_between(case, k, claim):
        return False
    named = {word for word in ("level", "noise", "gain") if f"the {word} " in subject}
    if FASTER.search(subject):
        named.add("lag")
    if jump.what == "gain" and "gain" in named:
        return f"from {case.written.inputs[jump.input]} " in subject
    if "response changed" in subject:  # a gain, all gains or a lag: true where either is
        return jump.what in ("gain", "lag")
    return not named or jump.what in named


def is_near(case: Case, k: int, claim) -> bool:
    """Whether the date of a claim is within the tolerance of a jump's."""
    return abs(claim["value"] * case.dt - case.plant.jumps[k].at) <= case.tolerance


def _is_between(case: Case, k: int, claim) -> bool:
    """Whether the interval of a date holds the jump, and is at most twice as wide as that of who knows the plant."""
    if claim["interval"] is None or not is_dated(case, k, claim):
        return False
    low, high = claim["interval"]
    first, last = dates(case.plant, case.record, k)
    return bool((high - low) * case.dt <= 2 * (last - first + case.dt))


def is_dated(case: Case, k: int, claim) -> bool:
    """Whether a jump lies in the interval of its date, a sample more or less."""
    low, high = claim["interval"]
    return bool((low - 1) * case.dt <= case.plant.jumps[k].at <= (high + 1) * case.dt)


def forecast(case: Case, claim) -> str:
    """No better than who knows all."""
    if claim["subject"] != "fit" or claim["value"] is None:
        return UNCHECKED
    return _said(claim["value"] <= case.record.clean_fit + 5)


def model_choice(case: Case, claim) -> str:
    """The most likely; or odds that are not far below those of all, or of all that can follow a change."""
    candidates = case.answer["candidates"]
    at = candidates["model"].index(claim["value"])
    if claim["subject"] == "follows":
        able = [odds for name, odds in zip(candidates["model"], candidates["log_odds"]) if FOLLOWS.match(name)]
        return _said(candidates["log_odds"][at] > max(able) - 1)
    if claim["subject"] == "most likely":
        return _said(candidates["log_odds"][at] > -1e-6)
    return _said(candidates["log_odds"][at] > -1)


def note(case: Case, claim) -> str:
    """What can be known of a warning: that it is about a trouble that was drawn."""
    plant, subject = case.plant, claim["subject"]
    if subject == "whiteness":
        fit = case.answer["forecast"]["fit"]
        return _said(fit is None or fit < case.record.clean_fit - 0.5 or plant.noise == "coloured")
    for what, troubles in NOTES.items():
        if what in subject:
            return _said(bool(plant.troubles & troubles))
    return UNCHECKED


NOTES = {
    "nonlinear": {"nonlinear", "stuck", "outliers", "gain jump"},
    "feedback": {"closed loop"},
    "season": {"season"},
    "drift": {"drift", "season", "level jump", "gain jump", "nonlinear", "noise jump"},
    "missing": {"missing", "sparse", "irregular", "outliers", "stuck"},
}


def _stretched(claim) -> tuple[float, float]:
    """Return the interval that should hold the truth; an end without bound is None in JSON."""
    value = claim["value"]
    if claim["interval"] is None:
        half = NEAR * abs(value)
        return value - half, value + half
    low, high = claim["interval"]
    low = -np.inf if low is None else value - STRETCH * (value - low)
    high = np.inf if high is None else value + STRETCH * (high - value)
    return low, high


def _width(claim, bar: float) -> str:
    """Return whether an interval says something: it is no wider than twice the oracle's, or than the number."""
    if claim["interval"] is None:
        return TRUE
    low, high = claim["interval"]
    if low is None or high is None:
        return VACUOUS
    return VACUOUS if high - low > max(WIDE * 2 * bar, 2 * NEAR * abs(claim["value"])) else TRUE


def grows(case: Case, claim) -> str:
    """Judge that the noise grows with the level: of no drawn plant it does."""
    return FALSE


def together(case: Case, claim) -> str:
    """Output and inputs may change together, by a step of an input; of idle columns none does."""
    return _said(set(claim["subject"].split(", ")) <= {*case.written.outputs, *case.written.inputs})


def season(case: Case, claim) -> str:
    """There is one, and as many samples as are said are one or several of it."""
    period = case.plant.season[1]
    turns = [int(s) / period for s in claim["subject"].split(", ")] if period else []
    return _said(any(round(n) >= 1 and abs(n - round(n)) < 0.05 * n for n in turns))


def _warns(case: Case, what: str) -> bool:
    return any(what in claim["subject"] or what in claim["text"] for claim in case.answer["claims"])


RULES: dict[str, Callable[[Case, Any], str]] = {
    "column": column, "clock": clock, "table": table, "plant": plant, "gain": gain, "time constant": time_constant,
    "pole": pole, "delay": delay, "change": change, "forecast": forecast, "model choice": model_choice, "note": note,
    "noise": grows, "season": season, "together": together,
}  # fmt: skip
