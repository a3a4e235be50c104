"""A bank of filters for as many speeds of drift: what `MultipleModel`, `IMM` and `AutoMemory` have in common."""

from typing import Any

import numpy as np

from ..engine import validation
from ..engine.dispatch import kernel, rare
from ..engine.errors import InputError
from ..engine.layout import Field, Layout, numbers
from ..engine.status import AT_REST, CAPPED
from ..engine.ud import predicted_variance, project
from .mixing import drift_beside_state, merge, take_dense_along, take_modes_along
from .modes import WEIGHT, begin_modes, count_of, fold, mode, own_sigma2, size_of, unfold, update
from .unknown_drift import UNEXCITED, common, excite, lean, open_drift_state, pace

LEVELS = (0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
FREEDOM_NOW, SIGMA2_NOW, TOLD, WAITS = range(4)  # of the head


BANK = Layout(
    *numbers(
        "head",
        freedom_now="samples behind sigma^2 of the mixture",
        sigma2_now="sigma^2 of the mixture",
        told="whether a jump has been told",
        waits="whether P of the modes is in dense, to be mixed",
    ),
    Field("bank", ("M * size_of(N)",), "weight, sigma^2, theta and P of every mode"),
    Field("q", ("M * N",), "scratch: variances that each gains"),
    Field("dense", ("(M + 1) * half",), "scratch: P of every mode and of the mixture, packed"),
    Field("old", ("M * size_of(N)",), "scratch: the modes before they are mixed"),
    Field("P", ("half",), "scratch"),
    Field("logs", ("2 * M + 4",), "scratch"),
    given=("N", "M"),
    size_of=size_of,
    half="N * (N + 1) // 2",
)
open_bank, bank_size = kernel(BANK.open), kernel(BANK.size)


@kernel
def bank_of(memory, drift):
    """Return the views of a bank of as many modes as there are levels."""
    return open_bank(drift.own, memory.cap.size, memory.levels.size)


@kernel
def begin_bank(memory, state, view):
    """Let every mode begin as the estimator does."""
    bank = bank_of(memory, open_drift_state(state, view.D.size))
    begin_modes(memory, bank.bank, view.theta, view.U, view.D)


@kernel
def adapt_in_bank(memory, state, e, R, view, is_apart):
    """Every mode learns; theta and P become those of the mixture. Modes that do not stay apart wait to be mixed."""
    D, drift = view.D, open_drift_state(state, view.D.size)
    own, T = bank_of(memory, drift), predicted_variance(view.f, D, R)
    is_unexcited = excite(memory, drift, view.row, True)
    lean(drift, R, T)
    if own.head[WAITS] > 0.0:  # one more output of the same sample
        fold(own.bank, own.dense, D.size)
    own.head[WAITS] = 0.0 if is_apart else 1.0
    update(memory, own, e, R, view.theta, view, 0.0, is_unexcited, is_apart, 0.0)
    if is_apart:
        unfold(own.bank, own.dense, D.size)
    own.head[FREEDOM_NOW], own.head[SIGMA2_NOW] = merge(memory, own, view.theta, view.U, D)
    return T


@kernel
def merge_again(memory, own, view):
    """Let theta and P be those of the mixture, after each mode moved alone."""
    if view.first > 0:
        drift_beside_state(memory, own.bank, own.q, view)
    else:
        unfold_and_merge(memory, own, view.theta, view.U, view.D)


@rare
def unfold_and_merge(memory, own, theta, U, D):
    """Let theta and P be those of the mixture of modes whose P stands in U and D."""
    unfold(own.bank, own.dense, D.size)
    merge(memory, own, theta, U, D)


@kernel
def count_mixture(memory, drift, head, count, chi2, gain):
    """Freedom and sigma^2 are those of the mixture."""
    if memory.learns == 0.0:
        return count + 1.0, chi2 + gain, pace(drift)
    return head[FREEDOM_NOW], head[SIGMA2_NOW] * max(head[FREEDOM_NOW], 1.0), pace(drift)


@kernel
def count_in_bank(memory, state, count, chi2, weight, gain):
    """Freedom and sigma^2 are those of the mixture."""
    drift = open_drift_state(state, memory.cap.size)
    return count_mixture(memory, drift, drift.own, count, chi2, gain)


@kernel
def take_bank_along(memory, state, change, view):
    """Every mode goes along."""
    own = bank_of(memory, open_drift_state(state, memory.cap.size))
    take_modes_along(memory, own.bank, change, view)
    if own.head[WAITS] > 0.0:
        take_dense_along(memory, own.bank, own.dense, change, view)


@kernel
def speeds(memory, drift, own):
    """Fill q (N of each mode) with the variances each gains, and the drift's with what they are on average."""
    N, M, s2 = memory.cap.size, memory.levels.size, 0.0
    for i in range(N):
        drift.q[i] = 0.0
    for m in range(M):
        one = mode(own.bank, m, N).own
        share = one[WEIGHT] * own_sigma2(memory, one)
        s2 += share
        for i in range(N):
            own.q[m * N + i] = memory.levels[m] * drift.unit[i]
            drift.q[i] += share * own.q[m * N + i]
    for i in range(N):
        drift.q[i] /= s2


@kernel
def met(drift, is_capped, surprise):
    """Return the status bits of a sample."""
    status = CAPPED if is_capped else 0
    return status | AT_REST if surprise >= 0.0 and drift.head[UNEXCITED] > 0.0 else status


@kernel
def mixture_of_modes(memory, bank, R, view, out):
    """Write weight, mean less the mixture's, and squared scale of each mode's prediction."""
    N = view.theta.size
    for m in range(count_of(bank, N)):
        one, offset = mode(bank, m, N), 0.0
        for i in range(N):
            offset += view.psi[i] * (one.theta[i] - view.theta[i])
        project(one.U, view.psi, view.b)
        out[3 * m], out[3 * m + 1] = one.own[WEIGHT], offset
        out[3 * m + 2] = own_sigma2(memory, one.own) * predicted_variance(view.b, one.D, R)


@kernel
def mixture_in_bank(memory, state, R, view, out):
    """Write what the modes predict."""
    mixture_of_modes(memory, bank_of(memory, open_drift_state(state, view.theta.size)).bank, R, view, out)


# --- settings ------------------------------------------------------------------------------------------------------


def common_of_banks(setting, phi: Any = 1.0) -> dict[str, Any]:
    """Return the numbers every bank has: those of `common`, and how each mode's sigma^2 begins."""
    freedom, chi2 = setting.prior_counts
    numbers = common(setting, phi) | dict(
        learns=float(setting.is_learnt), freedom=freedom, chi2=chi2, has_state=float(setting.lags.size > 0)
    )  # fmt: skip
    del numbers["discount"]
    return numbers


def levels_of(memory) -> np.ndarray:
    """Return the noise variance ratios of a bank."""
    levels = validation.floats("levels", memory.levels)
    if levels.ndim != 1 or len(levels) < 2 or not np.isfinite(levels).all() or np.any(levels < 0):
        raise InputError(f"levels are two or more noise variance ratios, none negative, got {memory.levels!r}")
    return levels


def staying(M: int, stay: float) -> np.ndarray:
    """Return the transitions of M modes that stay with this probability, and else go to any other."""
    A = np.full((M, M), (1 - stay) / (M - 1))
    np.fill_diagonal(A, stay)
    return A
