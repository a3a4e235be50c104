"""What changed in a plant, and when: jumps of a trace in the terms of an engineer, gain and level."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..results.events import Event
from ..results.numbers import instant, odds_words

LATER = 6  # samples for each parameter after a change, at least, until its size is reported
CLEAR = 2.0  # standard deviations by which a gain or a level has moved
MOST, LOOKED = 20, 200  # changes that are kept, the surest; of one trace, those that are looked into
SURE = 20.0, 5.0  # odds, or deviations by which something moved: beyond either it is no matter of chance
UNKNOWN = 0.5  # of the prior variance of a combination: where more is left, it was not known
MISFIT = "the forecast no longer fits"  # a change of which is not known what moved
NEAR = 10  # samples between an alarm and a jump that are one


@dataclass(frozen=True)
class Change:
    """A change of the plant: the first sample of it, when it was noticed, and what moved."""

    since: int
    time: float  # of that sample
    noticed: int
    odds: float | None  # where the memory weighed a jump at about that time against other explanations
    moved: tuple[str, ...]
    deviations: float = 0.0  # by which gain, level or a parameter moved, the one that did most

    @property
    def sureness(self) -> tuple[float, float]:
        """What surer changes have more of: odds that count, then deviations."""
        return (self.odds or 0.0) * self._has_odds, self.deviations

    @property
    def is_sure(self) -> bool:
        """Whether more speaks for it than an alarm, which may be a false one."""
        return self._has_odds or self.deviations > SURE[1]

    @property
    def _has_odds(self) -> bool:
        return self.odds is not None and self.odds >= SURE[0]

    @property
    def delay(self) -> int:
        """Samples until it was noticed."""
        return self.noticed - self.since

    def words(self, origin: str | None = None) -> str:
        """Return it as a phrase; with the time stamp of second 0 it has a date."""
        return f"at {instant(self.time, origin)} {self.what}"

    @property
    def subject(self) -> str:
        """What moved."""
        return " and ".join(self.moved) or MISFIT

    @property
    def what(self) -> str:
        """What moved, how late it was noticed, and the odds, without the time."""
        known = [f"noticed {self.delay} samples later"] if self.delay > 1 else []
        known += [f"odds {odds_words(self.odds)}"] if self.odds is not None else []
        return self.subject + (f" ({', '.join(known)})" if known else "")


def changes_of(trace, inputs=(), events=None) -> list[Change]:
    """Return the jumps of a trace as changes of gain and level, in order; the likeliest `LOOKED` where they are more.

    Before the plant has moved nothing is known of it: what an alarm there says is no change, and is left out.

    Parameters
    ----------
    trace : Trace
        As `scan` returned it: the record is run over again for what was known before and after each change.
    inputs : names of the inputs
    events : list of Event, optional
        What to take for changes; the jumps of the trace if omitted.
    """
    jumps = trace.jumps()
    events = jumps if events is None else events
    odds = [max((j.odds for j in jumps if j.odds and abs(j.sample - e.sample) <= NEAR), default=None) for e in events]
    starts = [max(_since(event), 0) for event in events]
    ends = [*starts[1:], len(trace)]
    least = LATER * len(trace.names)
    after = [min(max(e.sample + least, (e.sample + end) // 2), end - 1) + 1 for e, end in zip(events, ends)]
    order = sorted(range(len(events)), key=lambda k: (k + 1 < len(events), -(odds[k] or 0.0)))  # the last one always
    looked = sorted(order[:LOOKED])
    states = _states(trace, {at for k in looked for at in (starts[k], after[k])})
    middle = np.nan_to_num(np.nanmedian(trace.u, axis=0)) if trace.u.shape[1] else np.zeros(0)
    found = []
    for k in looked:
        a, b = states[starts[k]], states[after[k]]
        moved = _moved(trace.estimator, a, b, inputs, middle) if starts[k] < after[k] else ((), 0.0)
        if moved is not None:
            found.append(Change(starts[k], float(trace.time[starts[k]]), events[k].sample, odds[k], *moved))
    return found


def surest(changes, most: int = MOST) -> list[Change]:
    """Return the surest of some changes, in order of time."""
    best = sorted(changes, key=lambda change: change.sureness, reverse=True)[:most]
    return sorted(best, key=lambda change: change.since)


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


def _moved(est, before, after, inputs, middle) -> tuple[tuple[str, ...], float] | None:
    """Say which gains are others, else whether the level is, else which parameter moved most; by how many deviations.

    None where it is what was not known before that moved: the plant is only being met.
    """
    (p, P), (q, Q) = (_parameters(est, state) for state in (before, after))
    is_known = _known(est, before)
    old, new = est.model_of(before), est.model_of(after)
    found, most = [], 0.0
    for i, name in enumerate(inputs):
        a, b = float(old.dc_gain[i]), float(new.dc_gain[i])
        z = _deviations(b - a, old.dc_gain_std[i], new.dc_gain_std[i])
        if z > CLEAR and is_known[_of_input(est.names, i, len(inputs))].any():
            found.append(f"the gain from {name} {way(a, b)} from {a:.3g} to {b:.3g}")
            most = max(most, z)
    is_met = np.any(~is_known & _known(est, after) & (abs(q - p) > CLEAR * np.sqrt(np.diag(Q))))
    if not found and is_met:
        return None
    if not found and is_known.all():
        (a, s), (b, t) = (level(est, state, middle) for state in (before, after))
        most = _deviations(b - a, s, t)
        if most > CLEAR:
            found.append(f"the level {'rose' if b > a else 'fell'} by {abs(b - a):.3g}")
    if not found:
        z = abs(q - p) / np.maximum(np.sqrt(np.diag(P) + np.diag(Q)), 1e-300)
        k = int(np.argmax(np.where(is_known, z, 0.0)))
        if z[k] > CLEAR:
            found.append(f"{_with_input(est.names[k], inputs)} {way(p[k], q[k])} from {p[k]:.3g} to {q[k]:.3g}")
            most = float(z[k])
    return tuple(found), most


def _known(est, state) -> np.ndarray:
    """Say which parameters the data had taught something of: most of them lies in directions that they did, (N,)."""
    open_ = [np.square(direction) for ratio, direction in est.information_ratio(state) if ratio > UNKNOWN]
    return np.sum(open_, axis=0) < 0.5 if open_ else np.ones(len(est.names), bool)


def _of_input(names, i: int, inputs: int) -> list[int]:
    """Return the parameters of an input: b0, b1 of the only one, b0.2, b1.2 of the second."""
    end = f".{i + 1}" if inputs > 1 else ""
    return [k for k, name in enumerate(names) if name.startswith("b") and name.endswith(end)]


def _with_input(name: str, inputs) -> str:
    """Return the name of a parameter, with that of the input it belongs to where there are several: b1.2 (valve)."""
    _, _, number = name.partition(".")
    return f"{name} ({inputs[int(number) - 1]})" if number.isdigit() and int(number) <= len(inputs) else name


def _deviations(difference, std, other) -> float:
    """Return how many deviations two numbers are apart; 0 where one has no bound."""
    spread = math.hypot(std, other)
    return abs(float(difference)) / max(spread, 1e-300) if math.isfinite(spread) else 0.0


def _parameters(est, state):
    """Return the parameters of an estimator, and their covariance."""
    return est.parameters_of(state)


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
