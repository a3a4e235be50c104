"""Drift of unknown speed: what every policy that learns it has in common.

A policy is a few numbers and one small function, `revise`, which sees one sample and sets q, the variances that the
parameters gain until the next one. Everything else happens here, for every policy, a user's own included: units,
the guard against learning from a plant at rest, q >= 0, the time update within the prior's variances, sigma^2.

Units: R/ms_i, ms_i the running mean square of regressor i, is the variance of parameter i that moves y as much as the
noise does. q_i = NVR_i R/ms_i, like P, is relative to sigma^2 where that is learnt, so that an NVR is a number without
units, and 1/sqrt(NVR) a memory in samples.
"""

from typing import NamedTuple

import numpy as np

from ..engine.dispatch import Vector, choice, kernel
from ..engine.status import AT_REST, CAPPED
from .adapt import adapt, by_least_squares, count, plain, time_update
from .drift import widen_within
from .transition import relax

SEEN, RESTS, LEVER, HEAD = range(4)  # cells: samples that counted, is it at rest, mean leverage; then ms, top, unit, q
SLOWEST = 0.005  # gain of the running mean squares
LEAST = 0.01  # of its largest mean square: a regressor's floor; of all mean squares: a plant at rest
RECENT = 0.05  # gain of the mean leverage
FIRST, START = 10, 1e-3  # policies that need a settled filter begin after so many samples, with this NVR until then
INVISIBLE = 1e-250  # a mean square that says nothing: its inverse would overflow in products
WAKING = 0.01  # at rest the mean squares move so much slower: a level that stays low is taken for normal in the end


class Ground(NamedTuple):
    """Views of what all policies keep: mean squares of the regressors, the largest so far, units and q."""

    head: np.ndarray
    ms: np.ndarray
    top: np.ndarray
    unit: np.ndarray
    q: np.ndarray
    own: np.ndarray


class Sample(NamedTuple):
    """What a policy sees of a sample: row, innovation and its variance T = psi' P psi + R, b = P psi, sigma^2.

    T, R and P are relative to sigma^2 where that is learnt: the innovation's variance is s2 T, the gain is b/T.
    """

    psi: np.ndarray
    b: np.ndarray
    e: float
    T: float
    R: float
    s2: float
    seen: float
    unit: np.ndarray
    phi: np.ndarray


def cells_of(N: int, own: int = 0) -> int:
    """Return how many numbers a policy keeps, ``own`` of them its own."""
    return HEAD + 4 * N + own


@kernel
def open_ground(memory_state, N):
    """Return the views."""
    a = HEAD + N
    b = a + N
    c = b + N
    return Ground(
        memory_state[:HEAD],
        memory_state[HEAD:a],
        memory_state[a:b],
        memory_state[b:c],
        memory_state[c : c + N],
        memory_state[c + N :],
    )


@choice
def revise(policy, own, sample, theta, U, D, q):
    """Set q (N,), the variances that the parameters gain until the next sample, from what this one showed.

    ``own`` are the numbers the policy keeps (zero at the start), theta and P = U D U' are those after the correction.
    """


@kernel
def starts(sample, q):
    """Let q be that of NVR 1e-3 for the first 10 samples, at least 2 N; say whether this is one of them."""
    if sample.seen > max(FIRST, 2 * q.size):
        return False
    for i in range(q.size):
        q[i] = START * sample.unit[i]
    return True


@kernel
def excite(memory, ground, psi):
    """Take the row into the mean squares, update the units, and say whether the plant is at rest."""
    head, ms, top, unit, N = ground.head, ground.ms, ground.top, ground.unit, psi.size
    size, moving = 0.0, int(memory.moving)
    for i in range(moving):
        if ms[i] > 0.0:
            size += psi[i] * psi[i] / ms[i]
    rests = head[SEEN] > 4.0 * N and size < LEAST * moving
    gain = SLOWEST * WAKING if rests else max(1.0 / (head[SEEN] + 1.0), SLOWEST)
    for i in range(N):
        ms[i] += gain * (psi[i] * psi[i] - ms[i])
        top[i] = max(top[i], ms[i])
        floored = max(ms[i], LEAST * top[i], memory.floor)
        unit[i] = memory.R / floored if floored > INVISIBLE else 0.0
    head[RESTS] = 1.0 if rests else 0.0
    if not rests:
        head[SEEN] += 1.0
    return rests


@kernel
def adapt_and_revise(memory, memory_state, e, R, s2, theta, U, D, scratch):
    """Least squares, then the policy."""
    ground = open_ground(memory_state, D.size)
    rests = excite(memory, ground, scratch.psi)
    T = by_least_squares(memory, memory_state, e, R, s2, theta, U, D, scratch)
    lean(ground, R, T)
    if T > 0.0 and not rests:
        sample = Sample(scratch.psi, scratch.b, e, T, R, s2, ground.head[SEEN], ground.unit, memory.phi)
        revise(memory, ground.own, sample, theta, U, D, ground.q)
        for i in range(D.size):
            if not ground.q[i] >= 0.0:
                ground.q[i] = 0.0
    return T


@kernel
def lean(ground, R, T):
    """Take the leverage psi' P psi/R, P after the sample, into its mean: N/n where n samples count alike."""
    if T > 0.0:
        gain = max(1.0 / max(ground.head[SEEN], 1.0), RECENT)
        ground.head[LEVER] += gain * ((T - R) / T - ground.head[LEVER])


@kernel
def pace(ground):
    """Return how many samples are behind the estimate: as many as would leave the mean leverage."""
    return ground.q.size / max(ground.head[LEVER], 1e-300)


@kernel
def count_unless_at_rest(memory, memory_state, count, chi2, weight, gain):
    """Count one sample more for sigma^2, unless the plant is at rest: its noise may rest as well."""
    ground = open_ground(memory_state, memory.cap.size)
    if ground.head[RESTS] > 0.0:
        return count, chi2, pace(ground)
    return count + 1.0, chi2 + gain, pace(ground)


@kernel
def wander(memory, memory_state, weight, surprise, share, s2, theta, U, D, scratch):
    """P <- Phi P Phi' + diag(q), no variance beyond its prior; what sigma^2 rests on fades."""
    ground, status = open_ground(memory_state, D.size), 0
    relax(theta, U, D, memory.phi, scratch.b)
    for i in range(D.size):
        if not widen_within(U, D, i, ground.q[i], memory.cap[i], scratch.b):
            status = CAPPED
    rests = ground.head[RESTS] > 0.0
    if surprise >= 0.0 and rests:
        status |= AT_REST
    return memory.discount if surprise >= 0.0 and not rests else 1.0, status


def adaptive(*kinds: type):
    """Give policies all they have in common; each of them then only has its `revise`."""
    plain(*kinds)
    adapt.on(*kinds)(adapt_and_revise)
    count.on(*kinds)(count_unless_at_rest)
    time_update.on(*kinds)(wander)


class Paced(NamedTuple):
    """What the kernel sees of a `Drift` of given NVR."""

    R: float
    phi: Vector
    cap: Vector
    floor: float
    moving: float
    discount: float
    nvr: Vector


adaptive(Paced)


@revise.on(Paced)
def revise_paced(policy, own, sample, theta, U, D, q):
    for i in range(q.size):
        q[i] = policy.nvr[i] * sample.unit[i]
