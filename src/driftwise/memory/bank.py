"""Several speeds of drift at once: a bank of filters with forgetting weights, or interacting ones with a jump mode."""

from typing import Any, NamedTuple

import numpy as np

from ..detect.watch import SINCE, STATISTIC, WHICH
from ..engine.dispatch import Vector, kernel, rare
from ..engine.status import AT_REST, CAPPED
from ..engine.ud import predicted_variance, project
from .adapt import (
    adapt,
    begin,
    count,
    found_jump,
    mixture,
    nothing,
    on_alarm,
    outlier_probability,
    time_update,
    trust,
    unmoved,
)
from .mixing import drift_apart, interact, merge
from .modes import FREEDOM, WEIGHT, count_of, mode, normalise, open_bank, own_sigma2, size_of, unfold, update
from .unknown import RESTS, excite, lean, open_ground, pace

LEVELS = (0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
JUMP, AGAIN = 1.0, 0.1  # NVR of the jump mode, and how likely one jump follows another
FREEDOM_NOW, SIGMA2_NOW, TOLD, WAITS, OWN_HEAD = range(5)  # WAITS: P of the modes is in ``dense``, to be mixed


class MultipleModel(NamedTuple):
    """Drift of unknown speed: one filter for each NVR of ``levels``, weighted by how well each predicts.

    Weights fade (``forgetting``, to its power at every sample), so that the bank follows a plant whose drift changes
    speed. Each filter learns its own sigma^2 where that is unknown. Simpler than `AutoMemory`, not cheaper: no speeds
    are learnt, no outliers and no jumps told. All parameters drift at one speed in units of y: bad at speeds that
    differ much.
    Source: Abid and Kamoun (2008), section 5 ("multiple model"); Magill (1965).
    """

    levels: tuple[float, ...] = LEVELS
    forgetting: float = 0.99
    phi: Any = 1.0


class IMM(NamedTuple):
    """A bank whose filters exchange what they know, with a mode for jumps: IMM.

    From sample to sample a filter stays at its speed with probability ``stay``; ``jumps`` is the probability of a jump
    of about the size that one unit of noise hides (0: no such mode). A jump is told (``JUMP``) when its mode is
    likelier than all others. Source: Blom and Bar-Shalom (1988). Bad at: constant parameters, which the jump mode makes
    restless, and outliers, which look like jumps (use `AutoMemory`).
    """

    levels: tuple[float, ...] = LEVELS
    stay: float = 0.995
    jumps: float = 0.0005
    phi: Any = 1.0


class Fading(NamedTuple):
    """What the kernel sees of a `MultipleModel`; each learnt sigma^2 begins at ``freedom`` and ``chi2``."""

    R: float
    phi: Vector
    cap: Vector
    floor: float
    moving: float
    learns: float
    freedom: float
    chi2: float
    told: float
    forgetting: float
    levels: Vector


class Mixing(NamedTuple):
    """What the kernel sees of `IMM`: A is the (M, M) matrix of the transitions."""

    R: float
    phi: Vector
    cap: Vector
    floor: float
    moving: float
    learns: float
    freedom: float
    chi2: float
    told: float
    jumps: float
    levels: Vector
    A: Vector


class Cells(NamedTuple):
    """Views of what a bank keeps beyond the ground of all policies; q, dense, old, P and logs are scratch.

    ``dense`` has room for the P of every mode and of the mixture, packed.
    """

    head: np.ndarray
    bank: np.ndarray
    q: np.ndarray
    dense: np.ndarray
    old: np.ndarray
    P: np.ndarray
    logs: np.ndarray


def own_cells(N: int, M: int) -> int:
    """Return how many numbers a bank of M modes keeps."""
    return OWN_HEAD + 2 * M * size_of(N) + M * N + (M + 2) * N * (N + 1) // 2 + 2 * M + 4


@kernel
def open_cells(own, N, M):
    """Return the views."""
    size, half = M * size_of(N), N * (N + 1) // 2
    a = OWN_HEAD + size
    b = a + M * N
    c = b + (M + 1) * half
    d = c + size
    e = d + half
    return Cells(own[:OWN_HEAD], own[OWN_HEAD:a], own[a:b], own[b:c], own[c:d], own[d:e], own[e : e + 2 * M + 4])


@kernel
def cells_of_modes(memory, ground):
    """Return the views of a bank of as many modes as there are levels."""
    return open_cells(ground.own, memory.cap.size, memory.levels.size)


@kernel
def adapt_in_bank(memory, memory_state, e, R, theta, U, D, scratch, is_apart):
    """Every mode learns; theta and P become those of the mixture. Modes that do not stay apart wait to be mixed."""
    ground = open_ground(memory_state, D.size)
    own, T = cells_of_modes(memory, ground), predicted_variance(scratch.f, D, R)
    rests = excite(memory, ground, scratch.psi)
    lean(ground, R, T)
    own.head[WAITS] = 0.0 if is_apart else 1.0
    update(memory, own.bank, own.dense, e, R, theta, scratch, own.logs, False, rests, is_apart)
    if is_apart:
        unfold(own.bank, own.dense, D.size)
    own.head[FREEDOM_NOW], own.head[SIGMA2_NOW] = merge(memory, own, theta, U, D)
    return T


@rare
def merge_again(memory, own, theta, U, D):
    """Let theta and P be those of the mixture, after each mode moved alone."""
    unfold(own.bank, own.dense, D.size)
    merge(memory, own, theta, U, D)


@adapt.on(Mixing)
def adapt_mixing(memory, memory_state, e, R, s2, theta, U, D, scratch):
    return adapt_in_bank(memory, memory_state, e, R, theta, U, D, scratch, False)


@adapt.on(Fading)
def adapt_fading(memory, memory_state, e, R, s2, theta, U, D, scratch):
    """Then the weights fade; P stays what it is, relative to the sigma^2 that is theirs."""
    T = adapt_in_bank(memory, memory_state, e, R, theta, U, D, scratch, True)
    own = cells_of_modes(memory, open_ground(memory_state, D.size))
    total, before = 0.0, own.head[SIGMA2_NOW]
    for m in range(memory.levels.size):
        own.logs[m] = mode(own.bank, m, D.size).own[WEIGHT] ** memory.forgetting
        total += own.logs[m]
    normalise(own.bank, own.logs, total, D.size)
    own.head[FREEDOM_NOW] = own.head[SIGMA2_NOW] = 0.0
    for m in range(memory.levels.size):
        one = mode(own.bank, m, D.size).own
        own.head[FREEDOM_NOW] += one[WEIGHT] * one[FREEDOM]
        own.head[SIGMA2_NOW] += one[WEIGHT] * own_sigma2(memory, one)
    for i in range(D.size):
        D[i] *= before / own.head[SIGMA2_NOW]
    return T


@begin.on(Fading, Mixing)
def begin_fading(memory, memory_state, theta, U, D):
    own = cells_of_modes(memory, open_ground(memory_state, D.size))
    open_bank(memory, own.bank, theta, U, D)


@kernel
def count_mixture(memory, ground, head, count, chi2, gain):
    """Freedom and sigma^2 are those of the mixture."""
    if memory.learns == 0.0:
        return count + 1.0, chi2 + gain, pace(ground)
    return head[FREEDOM_NOW], head[SIGMA2_NOW] * max(head[FREEDOM_NOW], 1.0), pace(ground)


@count.on(Fading, Mixing)
def count_fading(memory, memory_state, count, chi2, weight, gain):
    ground = open_ground(memory_state, memory.cap.size)
    return count_mixture(memory, ground, ground.own, count, chi2, gain)


found_jump.on(Fading)(nothing)
on_alarm.on(Fading, Mixing)(unmoved)
outlier_probability.on(Fading, Mixing)(trust)


@kernel
def speeds(memory, ground, own):
    """Fill q (N of each mode) with the variances each gains, and the ground's with what they are on average."""
    N, M, s2 = memory.cap.size, memory.levels.size, 0.0
    for i in range(N):
        ground.q[i] = 0.0
    for m in range(M):
        one = mode(own.bank, m, N).own
        share = one[WEIGHT] * own_sigma2(memory, one)
        s2 += share
        for i in range(N):
            own.q[m * N + i] = memory.levels[m] * ground.unit[i]
            ground.q[i] += share * own.q[m * N + i]
    for i in range(N):
        ground.q[i] /= s2


@kernel
def met(ground, is_capped, surprise):
    """Return the status bits of a sample."""
    status = CAPPED if is_capped else 0
    return status | AT_REST if surprise >= 0.0 and ground.head[RESTS] > 0.0 else status


@time_update.on(Fading)
def time_update_fading(memory, memory_state, weight, surprise, share, s2, theta, U, D, scratch):
    ground = open_ground(memory_state, D.size)
    own = cells_of_modes(memory, ground)
    speeds(memory, ground, own)
    is_capped = drift_apart(memory, own.bank, own.q, scratch.b)
    merge_again(memory, own, theta, U, D)
    return 1.0, met(ground, is_capped, surprise)


@time_update.on(Mixing)
def time_update_mixing(memory, memory_state, weight, surprise, share, s2, theta, U, D, scratch):
    ground = open_ground(memory_state, D.size)
    own = cells_of_modes(memory, ground)
    speeds(memory, ground, own)
    if own.head[WAITS] > 0.0:
        is_capped = interact(memory, own, own.bank, own.q, D.size)
    else:
        is_capped = drift_apart(memory, own.bank, own.q, scratch.b)
    own.head[WAITS] = 0.0
    merge_again(memory, own, theta, U, D)
    return 1.0, met(ground, is_capped, surprise)


@found_jump.on(Mixing)
def found_jump_mixing(memory, memory_state, detector_state):
    """Tell a jump when the jump mode is likelier than all others, once until it is not."""
    own = cells_of_modes(memory, open_ground(memory_state, memory.cap.size))
    last = mode(own.bank, memory.levels.size - 1, memory.cap.size)
    if memory.jumps == 0.0:
        return 0.0
    w = last.own[WEIGHT]
    detector_state[STATISTIC], was_told = 2.0 * w, own.head[TOLD] > 0.0
    own.head[TOLD] = 1.0 if w > 0.5 else 0.0
    if was_told or w <= 0.5:
        return 0.0
    detector_state[SINCE], detector_state[WHICH] = 1.0, -1.0
    return 1.0


@kernel
def mixture_of_modes(memory, bank, R, s2, theta, scratch, out):
    """Write weight, mean less the mixture's, and squared scale of each mode's prediction."""
    N = theta.size
    for m in range(count_of(bank, N)):
        one, offset = mode(bank, m, N), 0.0
        for i in range(N):
            offset += scratch.psi[i] * (one.theta[i] - theta[i])
        project(one.U, scratch.psi, scratch.b)
        out[3 * m], out[3 * m + 1] = one.own[WEIGHT], offset
        out[3 * m + 2] = own_sigma2(memory, one.own) * predicted_variance(scratch.b, one.D, R)


@mixture.on(Fading, Mixing)
def mixture_fading(memory, memory_state, R, s2, theta, scratch, out):
    own = cells_of_modes(memory, open_ground(memory_state, theta.size))
    mixture_of_modes(memory, own.bank, R, s2, theta, scratch, out)
