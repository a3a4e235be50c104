"""Diagnostics as verdicts: each a number, a threshold and one sentence an engineer can act on."""

from __future__ import annotations

import math

import numpy as np

from ..results.numbers import odds_words
from ..results.sentences import BETWEEN_JUMPS, explained_by_jump, jump_count_words
from ..results.stable import stability
from ..results.verdicts import Diagnosis, Verdict
from .drift_or_jump import constancy, odds
from .forecast_verdicts import LEVEL, of_summary
from .identifiable import ROWS, WEAK, Identifiability, taught
from .information_age import last_news
from .outliers import common_words
from .remedies import memories

UNLEARNED = 0.5  # of the prior variance: beyond it the first guess says more than the data
SURE = 100.0  # odds to one
SLACK = 1.5  # bars of models that are not linear in their parameters are approximate
MOST = 1e6  # odds beyond it are no longer told apart
OLD = 0.1  # of the record
ANY = (-math.inf, math.inf)
LOST, SET_ASIDE, STUCK = 0.1, 0.01, 0.01  # shares of the samples
FEW = 5
WORK = 4e9  # rows times unknowns to the fourth power that the odds may cost: some 15 s


def diagnose(
    trace, summary=None, *, record=None, identifiable: Identifiability | None = None, are_reported: bool = False
) -> Diagnosis:
    """Return the verdicts on a run of an estimator; with several outputs, on their predictions (`trace.diagnose`).

    Parameters
    ----------
    trace : Trace
        Perhaps thinned out; then the next ones are those of the whole run.
    summary : Summary, optional
    record : (y, u), optional
        The samples as they were estimated, or None where they are too many to be held.
    identifiable : Identifiability, optional
    are_reported : bool
        Jumps are reported beside the verdicts, by who watched for them: those of the memory are left out.
    """
    if trace.estimator.outputs is not None:
        return of_outputs(trace.summary().parts)
    s = trace.summary() if summary is None else summary
    y, u = (trace.y, trace.u) if record is None and summary is None else (None, None) if record is None else record
    holds_poles = trace.estimator.holds_poles  # at 1: neither taught nor in doubt
    if identifiable is None and y is not None and s.is_enough and not holds_poles:
        identifiable = taught(trace.estimator, y, u)
    found = of_summary(s)
    found += [excitation(s)]
    found += [] if identifiable is None else [identifiability_verdict(identifiable, s, trace)]
    found += [] if s.is_static or holds_poles else [stability(s, LEVEL)]
    found += [changes(trace, s, y, u, is_white=found[2].is_fine, are_reported=are_reported)]
    if y is not None:
        found += news(trace, y, u)
    return Diagnosis([*found, *shares(s, trace=trace), *saturation(trace.y)])


def of_outputs(parts, names=None, is_white: bool = True) -> Diagnosis:
    """Return the verdicts on the predictions of several outputs, a `Summary` of each."""
    if len(parts) == 1 and names is not None:
        names = [""]
    names = [f"y{i + 1}" for i in range(len(parts))] if names is None else names
    labels = [f" of {name}" if name else "" for name in names]
    return Diagnosis(
        verdict
        for part, label in zip(parts, labels)
        for verdict in (*of_summary(part, label, is_white), *shares(part, label))
    )


def of_observer(trace) -> Diagnosis:
    """Return the verdicts on the predictions of an observer; innovations of a window are not white anyway."""
    return of_outputs(trace.summary().outputs, trace.estimator.model.output_names, is_white=False)


# --- what was taught -----------------------------------------------------------------------------------------


def excitation(s) -> Verdict:
    """Return how much of the prior is left along the least informed direction, and what is known all the same."""
    ratios = [ratio for ratio, _ in s.directions]
    limits = (-math.inf, UNLEARNED)
    if not s.is_enough:
        return Verdict("excitation", math.nan, limits, True, "too few samples to tell what the data taught")
    if not ratios:
        return Verdict("excitation", math.nan, limits, True, "this method keeps no covariance to tell by")
    lost = s.unlearned
    if not lost:
        return Verdict("excitation", ratios[0], limits, True, "the data taught every combination of the parameters")
    many = len(s.estimator.names)
    advice = f"the data taught {many - len(lost)} of {many} combinations of the parameters, not {lost[0][0]}"
    known = steady_words(s)
    more = f": {known}" if known else ""
    advice += f"{more}; {'move the input' if s.estimator.model.inputs else 'record longer'}, or lower the order"
    return Verdict("excitation", ratios[0], limits, False, advice)


def steady_words(s) -> str:
    """Say whether gain and time constant are known to a half, where they are not equally so; else nothing."""
    if s.is_static or not s.is_enough or not s.estimator.model.inputs or not s.poles:
        return ""
    model, (pole, std) = s.model, s.poles[0]
    gain, spread = abs(float(model.dc_gain[0])), float(model.dc_gain_std[0])
    knows_gain, knows_time = spread < 0.5 * gain, std < 0.5 * abs(1 - abs(pole))
    if knows_gain == knows_time:
        return ""
    return (
        "the steady-state gain is known, the time constant is not"
        if knows_gain
        else ("the time constant is known, the steady-state gain is not")
    )


def identifiability_verdict(found: Identifiability, s, trace) -> Verdict:
    """Return how much less the worst combination of parameters shows than each of them alone.

    Regressors that go together are no harm in a regression whose parameters are known all the same.
    """
    limits, weak = (WEAK, math.inf), found.directions[0]
    vague = _vague(weak, trace) if s.is_static else found.names
    if found.worst >= WEAK or not vague:
        advice = "the record tells all combinations of the parameters apart"
        if found.worst < WEAK:
            advice = f"{weak.words} shows little, but every parameter in it is known to a half"
        return Verdict("identifiability", found.worst, limits, True, advice)
    if found.unseen:
        return Verdict("identifiability", found.worst, limits, False, found.words.rstrip("."))
    advice = f"{weak.words} is taught {1 / weak.eigenvalue:.0f} times less than each parameter alone"
    if s.is_static:
        advice += (
            f", and {' and '.join(vague)} not known to a half: let the regressors go different ways, or leave one out"
        )
    else:
        advice += ": lower the order, sample more slowly, or move the input at other frequencies"
    return Verdict("identifiability", found.worst, limits, False, advice)


def _vague(direction, trace) -> list[str]:
    """Return the parameters of a direction whose two bars at the end hold zero."""
    theta, bars = trace.parameters[-1], trace.parameters_std[-1]
    size = np.abs(direction.vector) / np.where(bars > 0, bars, math.inf)
    is_in = size > 0.05 * size.max(initial=0.0)
    return [name for name, one, value, bar in zip(trace.names, is_in, theta, bars) if one and abs(value) < 2 * bar]


# --- what moved ----------------------------------------------------------------------------------------------


def changes(trace, s, y, u, is_white: bool = True, are_reported: bool = False) -> Verdict:
    """Return whether the parameters drift or jump: the odds, or how far the estimates moved; what the memory says."""
    from ..memory.auto import AutoMemory
    from ..memory.constant import Constant

    memory = s.estimator.options.get("memory")
    name, speeds = "drift or jump", s.drift
    if isinstance(memory, Constant):
        is_short = y is not None and len(y) <= ROWS and len(y) * s.estimator.model.N**4 <= WORK
        against = odds(s.estimator, y, u) if is_short else None
        return _constant(trace, name) if against is None else _by_odds(against, name, s.estimator, is_white)
    jumped = jump_count_words(s.jumps, s.last_jump, s.origin, s.unit)
    also = "" if are_reported else f"; {jumped}"
    if isinstance(memory, AutoMemory) and speeds is not None and speeds.weights:
        still = speeds.weights["still"]
        value = min((1 - still) / max(still, 1 / MOST), MOST)
        return Verdict(name, value, ANY, True, f"odds of drift; {speeds.words}{also}; both are followed")
    if speeds is not None:
        return Verdict(name, math.nan, ANY, True, f"the memory follows a drift ({speeds.words}){also}")
    if s.estimator.holds_poles:
        return Verdict(name, math.nan, ANY, True, "its one free pole walks, so that a drift is followed")
    if are_reported and (s.jumps or trace.watches):
        return Verdict(name, math.nan, ANY, True, f"jumps are followed; {BETWEEN_JUMPS}")
    if s.jumps or trace.watches or isinstance(memory, AutoMemory):
        return Verdict(name, float(s.jumps), ANY, True, f"{jumped}; {BETWEEN_JUMPS}")
    advice = f"this memory forgets without asking why: {memories(s.estimator)} tells drift from jumps, with odds"
    return Verdict(name, math.nan, ANY, True, advice)


def _by_odds(found, name, est, is_white) -> Verdict:
    value = math.exp(min(found.most, math.log(MOST)))
    if value <= SURE:
        advice = "the record is as likely with parameters that stay as they are"
        return Verdict(name, value, (0.0, SURE), True, f"odds of a change; {advice}")
    if found.jump >= found.drift:
        than = _than(found.jump - found.drift, "drift")
        return Verdict(name, value, (0.0, SURE), False, f"{explained_by_jump(found.jumped, than)}: try "
                       f"{memories(est, 'memory=RestartOnChange()')}")  # fmt: skip
    than = _than(found.drift - found.jump, "jumps")
    advice = f"the parameters drift, most of all {found.drifted} ({than}): try {memories(est)}"
    more = ", unless it is the colour of the noise that looks like it: see whiteness"
    return Verdict(name, value, (0.0, SURE), False, advice + more * (not is_white))


def _than(lead: float, other: str) -> str:
    """Return by what odds one explanation beat the other."""
    return f"odds {odds_words(math.exp(min(lead, 700.0)))} against {other}"


def _constant(trace, name) -> Verdict:
    """Return how far the estimates have moved, where no odds are to be had."""
    from scipy.special import ndtri

    moved = constancy(trace)
    if moved is None:
        return Verdict(name, math.nan, ANY, True, "too little was kept to tell whether parameters change")
    most = SLACK * float(ndtri(1 - (1 - LEVEL) / (2 * moved.tried)))
    if moved.deviations <= most:
        advice = "deviations by which an estimate moved; the parameters are those of the record's beginning"
        return Verdict(name, moved.deviations, (0.0, most), True, advice)
    advice = (
        f"{moved.name} moved by {moved.deviations:.1f} deviations since sample {moved.sample}: let the parameters walk "
        "or jump (memory=RandomWalk(q) or RestartOnChange()), or the noise has another colour than the model says"
    )
    return Verdict(name, moved.deviations, (0.0, most), False, advice)


def news(trace, y, u) -> list[Verdict]:
    """Return how many samples ago something was last learnt of the parameter that waits longest."""
    found = last_news(trace.estimator, y, u)
    if found is None:
        return []
    limit = max(OLD * len(y), 20.0)
    if found.age <= limit:
        return [Verdict("last news", float(found.age), (0.0, limit), True, "samples; all parameters are up to date")]
    what = "all parameters are" if found.is_all else f"{found.name} is"
    if np.isnan(y[-found.age :]).mean() > 0.5:
        why = "y is missing since"
    else:
        why = "nothing has moved enough since" if found.is_all else "its regressor has hardly moved since"
        why += ", so move the input" if trace.estimator.model.inputs else ""
    advice = f"no informative sample for {found.age} samples: {what} of then; {why}"
    return [Verdict("last news", float(found.age), (0.0, limit), False, advice)]


# --- what was lost -------------------------------------------------------------------------------------------


def shares(s, label: str = "", trace=None) -> list[Verdict]:
    """Return the shares of missing and of rejected samples, where there are any; by a trace where most of many are."""
    found, missing = [], s.missing_outputs  # those that cannot be read are among them
    if missing:
        share = missing / s.samples
        advice = f"{missing} of {s.samples} outputs are missing or unreadable"
        more = "; each gap also hides the samples after it from the regressors: repair the recording"
        found.append(Verdict(f"missing{label}", share, (0.0, LOST), share <= LOST, advice + more * (share > LOST)))
    rejected = s.rejected + s.happened["outliers"][0]
    if rejected:
        share = rejected / s.samples
        advice = f"{rejected} of {s.samples} outputs were taken for outliers"
        if share > SET_ASIDE:
            common = common_words(trace) if trace is not None and len(trace) == s.samples else ""
            advice += (
                f", {common}: there the model is wrong, rather than the sensor"
                if common
                else "; so many are no accident: look at the sensor, widen the gate, or the model is wrong there"
            )
        found.append(Verdict(f"rejected{label}", share, (0.0, SET_ASIDE), share <= SET_ASIDE, advice))
    return found


def saturation(y) -> list[Verdict]:
    """Return the share of outputs at an end of their range, where they pile up there more than just inside it."""
    seen = y[np.isfinite(y)]
    if len(seen) < FEW:
        return []
    values, counts = np.unique(seen, return_counts=True)
    if len(values) < 3:
        return []
    ends = [(int(counts[0]), int(counts[1]), values[0]), (int(counts[-1]), int(counts[-2]), values[-1])]
    piled = [(here, at) for here, inside, at in ends if here >= FEW and here > 2 * inside]
    if not piled:
        return []
    share = sum(here for here, _ in piled) / len(seen)
    where = " and ".join(f"{at:.6g}" for _, at in piled)
    is_fine = share <= STUCK
    advice = f"outputs stay at {where}"
    more = (
        ", the end of their range: where the sensor ends there, mark them as missing (NaN), or gains come out too small"
    )
    return [Verdict("saturation", share, (0.0, STUCK), is_fine, advice + more * (not is_fine))]
