"""Drift of unknown speed: what every policy that learns it has in common.

A policy is a few numbers and one small function, `revise`, which sees one sample and sets q, the variances that the
parameters gain until the next one. Everything else happens here, for every policy, a user's own included: units,
the guard against learning from a plant at rest, q >= 0, the time update within the prior's variances, sigma^2.

Units: R/ms_i, ms_i the running mean square of regressor i, is the variance of parameter i that moves y as much as the
noise does. q_i = NVR_i R/ms_i, like P, is relative to sigma^2 where that is learnt, so that an NVR is a number without
units, and 1/sqrt(NVR) a memory in samples.
"""

from typing import Any, NamedTuple

import numpy as np

from ..engine import validation
from ..engine.dispatch import choice, kernel
from ..engine.errors import InputError
from ..engine.layout import REST, Field, Layout, each, numbers
from ..engine.status import AT_REST, CAPPED
from .gauss_markov import relax, widen_within
from .questions import adapt, count, least_squares, time_update

ROOM = 2.0  # times its prior, the widest variance: a prior of known width is no limit before data come
FADING = 0.995  # per sample, of what sigma^2 rests on: the noise may change, 200 samples of it count
SEEN, UNEXCITED, LEVER = range(3)  # of the head
SLOWEST = 0.005  # gain of the running mean squares
LEAST = 0.01  # of its largest mean square: a regressor's floor; of all mean squares: a plant at rest
RECENT = 0.05  # gain of the mean leverage
FIRST, START = 10, 1e-3  # policies that need a settled filter begin after so many samples, with this NVR until then
WILD = 9.0  # times its mean square: more of a regressor that may be a prediction is not believed
INVISIBLE = 1e-250  # a mean square that says nothing: its inverse would overflow in products
WAKING = 0.01  # at rest the mean squares move so much slower: a level that stays low is taken for normal in the end


DRIFT_STATE = Layout(
    *numbers(
        "head",
        seen="samples that counted",
        unexcited="whether the plant is at rest",
        lever="mean of 1 - R/T",
    ),
    *each(
        "N",
        ms="running mean squares of the regressors",
        top="the largest so far",
        unit="R/ms",
        q="variances that the parameters gain until the next sample",
    ),
    Field("own", (REST,), "what the policy keeps"),
    given=("N",),
)
open_drift_state = kernel(DRIFT_STATE.open)


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


def drift_state_size(N: int, own: int = 0) -> int:
    """Return how many numbers a policy keeps, ``own`` of them its own."""
    return DRIFT_STATE.size(N) + own


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
def excite(memory, drift, row, are_known):
    """Take the row into the mean squares, update the units, and say whether the plant is at rest.

    ``are_known``: no regressor is a prediction. A wild one says nothing of their size.
    """
    return excite_by_noise(memory, drift, row, are_known, 1.0)


@kernel
def excite_by_noise(memory, drift, row, are_known, left):
    """Do so where noise alone moves the regressors, of whose variance so much is left (``left``)."""
    head, ms, top, unit, N = drift.head, drift.ms, drift.top, drift.unit, row.size
    size, moving = 0.0, int(memory.moving)
    for i in range(moving):
        if ms[i] > 0.0:
            size += row[i] * row[i] / ms[i]
    is_unexcited = head[SEEN] > 4.0 * N and size < LEAST * left * moving
    gain = SLOWEST * WAKING if is_unexcited else max(1.0 / (head[SEEN] + 1.0), SLOWEST)
    for i in range(N):
        square = row[i] * row[i]
        if not are_known and ms[i] > 0.0:
            square = min(square, WILD * ms[i])
        ms[i] += gain * (square - ms[i])
        top[i] = max(top[i], ms[i])
        floored = max(ms[i], LEAST * top[i], memory.floor)
        unit[i] = memory.R / floored if floored > INVISIBLE else 0.0
    head[UNEXCITED] = 1.0 if is_unexcited else 0.0
    if not is_unexcited:
        head[SEEN] += 1.0
    return is_unexcited


@kernel
def rest(drift):
    """Let a sample that seemed to excite the plant be one of a plant at rest; say so."""
    drift.head[UNEXCITED] = 1.0
    drift.head[SEEN] -= 1.0
    return True


@kernel
def adapt_and_revise(memory, state, e, R, view):
    """Least squares, then the policy."""
    drift = open_drift_state(state, view.D.size)
    is_unexcited = excite(memory, drift, view.row, True)
    T = least_squares(e, R, view)
    lean(drift, R, T)
    if T > 0.0 and not is_unexcited:
        sample = Sample(view.psi, view.b, e, T, R, view.s2, drift.head[SEEN], drift.unit, memory.phi)
        revise(memory, drift.own, sample, view.theta, view.U, view.D, drift.q)
        for i in range(view.D.size):
            if not drift.q[i] >= 0.0:
                drift.q[i] = 0.0
    return T


@kernel
def lean(drift, R, T):
    """Take the leverage psi' P psi/R, P after the sample, into its mean: N/n where n samples count alike."""
    if T > 0.0:
        gain = max(1.0 / max(drift.head[SEEN], 1.0), RECENT)
        drift.head[LEVER] += gain * ((T - R) / T - drift.head[LEVER])


@kernel
def pace(drift):
    """Return how many samples are behind the estimate: as many as would leave the mean leverage."""
    return drift.q.size / max(drift.head[LEVER], 1e-300)


@kernel
def count_unless_at_rest(memory, state, count, chi2, weight, gain):
    """Count one sample more for sigma^2, unless the plant is at rest: its noise may rest as well."""
    drift = open_drift_state(state, memory.cap.size)
    if drift.head[UNEXCITED] > 0.0:
        return count, chi2, pace(drift)
    return count + 1.0, chi2 + gain, pace(drift)


@kernel
def wander(memory, state, elapsed, view):
    """P <- Phi P Phi' + diag(q), no variance beyond its prior; what sigma^2 rests on fades."""
    U, D, drift, status = view.U, view.D, open_drift_state(state, memory.cap.size), 0
    relax(view.theta, U, D, memory.phi, view.b)
    for i in range(D.size - view.first):
        if not widen_within(U, D, view.first + i, drift.q[i], memory.cap[i], view.b):
            status = CAPPED
    is_unexcited = drift.head[UNEXCITED] > 0.0
    if view.surprise >= 0.0 and is_unexcited:
        status |= AT_REST
    return memory.discount if view.surprise >= 0.0 and not is_unexcited else 1.0, status


def learns_drift(*kinds: type):
    """Give policies all they have in common; each of them then only has its `revise`."""
    adapt.on(*kinds)(adapt_and_revise)
    count.on(*kinds)(count_unless_at_rest)
    time_update.on(*kinds)(wander)


# --- settings ------------------------------------------------------------------------------------------------------


def common(setting, phi: Any = 1.0) -> dict[str, Any]:
    """Return the numbers every policy has: R, phi, cap, floor, moving and discount."""
    return dict(
        R=setting.R, phi=diagonal(phi, setting.N), cap=ROOM * setting.cap, floor=0.0, moving=setting.moving,
        discount=FADING if setting.is_learnt else 1.0,
    )  # fmt: skip


def diagonal(phi, N: int) -> np.ndarray:
    """Return a diagonal Phi as a vector; raise InputError where a parameter would grow by itself."""
    numbers = validation.each("phi", phi, N)
    if np.any(np.abs(numbers) > 1):
        raise InputError(f"phi is a share that remains, at most 1 in size (the parameters would run away), got {phi!r}")
    return np.where(np.abs(numbers) < 1e-100, 0.0, numbers)
