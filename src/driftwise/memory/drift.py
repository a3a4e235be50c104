"""How the parameters may move between samples: not at all, as a random walk, or by jumps."""

from typing import Any, NamedTuple

from ..detect.variance import VarianceCUSUM
from ..engine.dispatch import Vector, choice, kernel
from ..engine.status import CAPPED, JUMP
from ..engine.ud import variance, widen


class Constant(NamedTuple):
    """Nothing is forgotten: constant parameters, gain 1/n. Bad at plants that change."""


class RandomWalk(NamedTuple):
    """Each parameter takes a random step of variance ``q`` per sample, never wider than its prior.

    ``q`` is one number or one per parameter (order of ``state["theta"]``), in the units of `y_scale` and `u_scale`,
    and relative to sigma^2 where the scale is unknown. ``cap`` is filled in from the prior: without excitation the
    covariance stays bounded. Or say ``matched=(jump, every)``: jumps of that size (one number or one per parameter)
    every so many samples; the walk then has their variance per sample, q = jump^2/every, whatever sigma^2 is.
    One of the two is required. Bad at rare jumps: a q that follows them quickly is noisy in between, and takes noise
    for steps, so that sigma is learnt too small (docs/memory.md: .7 of the truth and less; after a true walk it is
    right).
    """

    q: Vector = ()
    cap: Vector = ()
    matched: Vector = ()


class Matched(NamedTuple):
    """What the kernel sees of a `RandomWalk` that is matched to jumps: q is absolute."""

    q: Vector
    cap: Vector


class CovarianceInflation(NamedTuple):
    """After an alarm each parameter gains variance ``step`` squared, at most up to its prior.

    ``step`` is the size of jump to expect, one number or one per parameter, in the units of `y_scale` and `u_scale`.
    ``only_named``: where the detector names the parameter that jumped, only that one is freed.
    Bad at: jumps much larger than the step.
    """

    step: Any = 1.0
    only_named: bool = False


class RestartOnChange(NamedTuple):
    """Nothing is forgotten until the parameters jump; then they are freed as ``response`` says.

    ``response`` is `CovarianceInflation` (the default: each parameter gains variance 1 in the units of `y_scale` and
    `u_scale`) or, for recursive estimators, `GainReset`. The detector (`VarianceCUSUM`, `PageHinkley`, `GLR`; for
    recursive estimators also `ScoreCUSUM`) watches the whitened innovations after ``settle`` measured samples (None:
    six times the number of unknowns); with several outputs, each has one of its own. No parameter becomes wider than
    its prior. Bad at slow drift, which never alarms (use `RandomWalk`), at noise whose variance grows (it looks like a
    jump), and at dating a jump: the samples between jump and alarm are taken for the old parameters, so bars are too
    short there, smoothed ones (`Joint.smooth`) also before.
    """

    detector: Any = VarianceCUSUM()
    response: Any = CovarianceInflation()
    settle: float | None = None


class Restart(NamedTuple):
    """What the kernel sees of `RestartOnChange`."""

    q: Vector
    cap: Vector


@kernel
def widen_within(U, D, i, q, cap, scratch):
    """Add variance q to element i, at most up to cap; say whether all of it found room."""
    if q <= 0.0:
        return True
    room = cap - variance(U, D, i)
    widen(U, D, i, min(q, max(room, 0.0)), scratch)
    return room >= q


@choice
def drift(memory, alarm, surprise, observed, s2, U, D, n, scratch):
    """Widen U D U' by one sample's drift and return status bits.

    ``alarm`` is what the detector said (0, or +1 or -1: the direction), ``surprise`` is e^2/T of the sample (NaN where
    it taught nothing), ``observed`` how many samples have, and P is relative to ``s2``.
    """


@drift.on(Constant)
def drift_constant(memory, alarm, surprise, observed, s2, U, D, n, scratch):
    return 0


@drift.on(RandomWalk)
def drift_random_walk(memory, alarm, surprise, observed, s2, U, D, n, scratch):
    status = 0
    for i in range(memory.q.size):
        if not widen_within(U, D, n + i, memory.q[i], memory.cap[i], scratch):
            status = CAPPED
    return status


@drift.on(Matched)
def drift_matched(memory, alarm, surprise, observed, s2, U, D, n, scratch):
    status = 0
    for i in range(memory.q.size):
        if not widen_within(U, D, n + i, memory.q[i] / s2, memory.cap[i], scratch):
            status = CAPPED
    return status


@drift.on(Restart)
def drift_restart(memory, alarm, surprise, observed, s2, U, D, n, scratch):
    if alarm == 0.0:
        return 0
    for i in range(memory.q.size):
        widen_within(U, D, n + i, memory.q[i] / s2, memory.cap[i], scratch)
    return JUMP
