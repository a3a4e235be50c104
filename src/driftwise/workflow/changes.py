"""What changed in a plant, and when: jumps of a trace in the terms of an engineer, gain and level."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from .clock_words import instant
from .events import Event, odds_words

LATER = 6  # samples for each parameter after a change, at least, until its size is told
CLEAR = 2.0  # standard deviations by which a gain or a level has moved
MOST = 20  # changes of one trace that are looked into
MISFIT = "the forecast no longer fits"  # a change of which is not known what moved
NEAR = 10  # samples between an alarm and a jump that are one


@dataclass(frozen=True)
class Change:
    """A change of the plant: the first sample of it, when it was noticed, and what moved."""

    since: int
    time: float  # of that sample
    told: int
    odds: float | None  # where the memory weighed a jump at about that time against other explanations
    moved: tuple[str, ...]

    @property
    def delay(self) -> int:
        """Samples until it was told."""
        return self.told - self.since

    def words(self, origin: str | None = None) -> str:
        """Return it as a phrase; with the time stamp of second 0 it has a date."""
        return f"at {instant(self.time, origin)} {self.what}"

    @property
    def what(self) -> str:
        """What moved, how late it was noticed, and the odds, without the time."""
        known = [f"noticed {self.delay} samples later"] if self.delay > 1 else []
        known += [f"odds {odds_words(self.odds)}"] if self.odds is not None else []
        what = " and ".join(self.moved) or MISFIT
        return what + (f" ({', '.join(known)})" if known else "")


def changes_of(trace, inputs=(), events=None) -> list[Change]:
    """Return the jumps of a trace as changes of gain and level.

    Parameters
    ----------
    trace : Trace
        As `scan` returned it: the record is run over again for what was known before and after each change.
    inputs : names of the inputs
    events : list of Event, optional
        What to take for changes; the jumps of the trace if omitted.
    """
    jumps = trace.jumps()
    events = (jumps if events is None else events)[:MOST]
    starts = [_since(event) for event in events]
    ends = [*starts[1:], len(trace)]
    least = LATER * len(trace.names)
    before = [max(start, 0) for start in starts]  # states before that sample
    after = [min(max(e.sample + least, (e.sample + end) // 2), end - 1) + 1 for e, end in zip(events, ends)]
    states = _states(trace, {*before, *after})
    middle = np.nan_to_num(np.nanmedian(trace.u, axis=0)) if trace.u.shape[1] else np.zeros(0)
    found = []
    for event, start, a, b in zip(events, starts, before, after):
        moved = _moved(trace.estimator, states[a], states[b], inputs, middle) if a < b else ()
        odds = max((j.odds for j in jumps if j.odds and abs(j.sample - event.sample) <= NEAR), default=None)
        found.append(Change(start, float(trace.time[start]), event.sample, odds, moved))
    return found


def _since(event: Event) -> int:
    return event.sample if event.since is None else event.since


def _states(trace, samples) -> dict[int, Any]:
    """Return the state before each of some samples."""
    est, state, at, found = trace.estimator, trace.begun, 0, {}
    for k in sorted(samples):
        if k > at:
            u = trace.u[at:k] if trace.u.shape[1] else None
            state = est.scan(trace.y[at:k], u, state=state, keep="innovations").state
        found[k], at = state, k
    return found


def _moved(est, before, after, inputs, middle) -> tuple[str, ...]:
    """Say which gains are others, else whether the level is, else which parameter moved most."""
    old, new = est.model_of(before), est.model_of(after)
    found = []
    for i, name in enumerate(inputs):
        a, b = float(old.dc_gain[i]), float(new.dc_gain[i])
        if _is_clear(b - a, old.dc_gain_std[i], new.dc_gain_std[i]):
            found.append(f"the gain from {name} {way(a, b)} from {a:.3g} to {b:.3g}")
    if not found:
        (a, s), (b, t) = (level(est, state, middle) for state in (before, after))
        if _is_clear(b - a, s, t):
            found.append(f"the level {'rose' if b > a else 'fell'} by {abs(b - a):.3g}")
    if not found:
        (a, P), (b, Q) = _parameters(est, before), _parameters(est, after)
        z = (b - a) / np.maximum(np.sqrt(np.diag(P) + np.diag(Q)), 1e-300)
        k = int(np.argmax(abs(z)))
        if abs(z[k]) > CLEAR:
            found.append(f"{_with_input(est.names[k], inputs)} {way(a[k], b[k])} from {a[k]:.3g} to {b[k]:.3g}")
    return tuple(found)


def _with_input(name: str, inputs) -> str:
    """Return the name of a parameter, with that of the input it belongs to where there are several: b1.2 (valve)."""
    _, _, number = name.partition(".")
    return f"{name} ({inputs[int(number) - 1]})" if number.isdigit() and int(number) <= len(inputs) else name


def _is_clear(difference, std, other) -> bool:
    return bool(np.isfinite(std) and np.isfinite(other) and abs(difference) > CLEAR * math.hypot(std, other))


def _parameters(est, state):
    """Return the parameters of an estimator, and their covariance."""
    if hasattr(est, "parameters_of"):
        return est.parameters_of(state)
    model = est.model_of(state)
    return model.values, model.covariance


def level(est, state, u) -> tuple[float, float]:
    """Return where y settles with the inputs held at ``u`` (k,), and its deviation; infinite where it does not."""
    form = est.model
    if not getattr(form, "has_offset", False) or not hasattr(form, "na"):
        return math.nan, math.inf
    theta, P = est.parameters_of(state)
    na, size = form.na, 1.0 + theta[: form.na].sum()
    weights = np.concatenate([np.zeros(na), np.repeat(u, form.nb) if form.inputs else np.zeros(0)])
    weights = np.append(weights, np.zeros(len(theta) - len(weights) - 1))
    weights = np.append(weights, 1.0)
    value = float(weights @ theta) / size
    slope = weights / size
    slope[:na] -= value / size
    is_settling = np.all(np.abs(np.roots(np.append(1.0, theta[:na]))) < 1)
    return value, math.sqrt(max(float(slope @ P @ slope), 0.0)) if is_settling else math.inf


def way(a: float, b: float) -> str:
    """Say how a number went from a to b."""
    if a * b < 0:
        return "changed its sign,"
    ratio = abs(b / a) if a else math.inf
    if 0.4 < ratio < 0.6:
        return "halved,"
    if 1.8 < ratio < 2.2:
        return "doubled,"
    return "rose" if b > a else "fell"
