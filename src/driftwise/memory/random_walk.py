"""Drift of known speed: a random walk, never wider than the prior."""

from typing import NamedTuple

import numpy as np

from ..engine import validation
from ..engine.dispatch import PerParameter, Vector
from ..engine.errors import InputError
from ..engine.status import CAPPED, JUMP
from ..engine.ud import variance
from .gauss_markov import widen_within
from .questions import on_alarm, resolve, time_update
from .registry import register
from .settings import jump_size, variances


def _read(words):
    return RandomWalk(matched=words.jump_every()) if "/" in words.rest else RandomWalk(words.each())


@register(
    "random-walk:Q",
    "random-walk:JUMP/EVERY",
    about="they drift: variance per sample, such as 1e-6, or as jumps of that size every so many samples would have it",
    read=_read,
    q=1e-4,
)
class RandomWalk(NamedTuple):
    """Each parameter takes a random step of variance ``q`` per sample, never wider than its prior.

    ``q`` is one number or one per parameter (order of ``state["theta"]``), in the units of `y_scale` and `u_scale`,
    and relative to sigma^2 where the scale is unknown. ``cap`` is filled in from the prior: without excitation the
    covariance stays bounded. Or say ``matched=(jump, every)``: jumps of that size (one number or one per parameter)
    every so many samples; the walk then has their variance per sample, q = jump^2/every, whatever sigma^2 is.
    One of the two is required. Bad at rare jumps: a q that follows them quickly is noisy in between, and takes noise
    for steps, so that sigma is learnt too small (docs/memory.md: .7 of the truth and less; after a true walk it is
    right).

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> rng = np.random.default_rng(1)
    >>> slope = np.cumsum(0.05 * rng.standard_normal(500))  # it walks
    >>> phi = rng.standard_normal((500, 1))
    >>> y = phi[:, 0] * slope + 0.1 * rng.standard_normal(500)
    >>> trace = dw.Regression(1, memory=dw.RandomWalk(0.05**2 / 0.1**2)).scan(y, phi)
    >>> f"{trace.parameters[-1, 0]:.2f} ± {trace.parameters_std[-1, 0]:.2f}, the truth is {slope[-1]:.2f}"
    '-0.76 ± 0.09, the truth is -0.89'
    """

    q: PerParameter = ()
    cap: PerParameter = ()
    matched: Vector = ()  # in kernels: not empty where q is absolute, not relative to sigma^2

    @property
    def per_second(self) -> bool:
        """In continuous time q is a variance per second; memories that do not say so count samples."""
        return True

    @property
    def is_absolute(self) -> bool:
        """Whether q is a variance whatever sigma^2 is: that of a walk matched to jumps."""
        return np.size(self.matched) > 0


@resolve.on(RandomWalk)
def resolve_random_walk(memory, setting):
    N = setting.N
    if isinstance(memory.matched, tuple | list) and not memory.matched:
        if not np.size(memory.q):
            raise InputError(
                "a walk needs its speed: RandomWalk(q), the variance of a step per sample, or "
                "RandomWalk(matched=(jump, every)); "
                "for constant parameters use Constant()"
            )
        return RandomWalk(variances("q", memory.q, N) * setting.units, setting.cap)
    if np.any(memory.q) or not isinstance(memory.matched, tuple | list) or len(memory.matched) != 2:
        raise InputError(
            f"a walk has either q or matched=(jump, every), got q = {memory.q!r} and matched = {memory.matched!r}"
        )
    jump, every = memory.matched
    q = jump_size("jump", jump, N) ** 2 * setting.units / validation.positive("every", every)
    return RandomWalk(q, setting.cap, np.ones(1))


@time_update.on(RandomWalk)
def time_update_random_walk(memory, state, elapsed, view):
    s2, status = view.s2 if memory.matched.size > 0 else 1.0, 0
    for i in range(memory.q.size):
        q = memory.q[i] / s2 * elapsed
        if not widen_within(view.U, view.D, view.first + i, q, memory.cap[i], view.b):
            status = CAPPED
    return 1.0, status


@on_alarm.on(RandomWalk)
def on_alarm_random_walk(memory, state, alarm, view):
    """Let every deviation be at least a share ``view.reopen`` of the prior's, where the estimator asks for it."""
    for i in range(memory.q.size if view.reopen > 0.0 else 0):
        room = view.reopen * view.reopen * view.cap[i] - variance(view.U, view.D, view.first + i)
        widen_within(view.U, view.D, view.first + i, room, view.cap[i], view.b)
    return view.weight, JUMP
