"""The default where nothing is known of drift, noise, outliers and jumps: every explanation competes.

A small interacting bank with one learnt speed explains slow change. Beside it a trial goes on: have the parameters, or
one of them, just jumped, or has the noise another level? What is shown is the mixture of all that is probable; the
explanation that wins takes over, and the event is told.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from ..detect.watch import SINCE, STATISTIC, WHICH
from ..engine import validation
from ..engine.dense import at
from ..engine.dispatch import PerParameter, Vector, kernel, rare
from ..engine.elementary import log
from ..engine.layout import Field, Layout, numbers
from ..engine.status import AT_REST, CAPPED, NOISE, OUTLIER
from ..engine.ud import factor_within, predicted_variance, project, widen
from .auto_constants import (
    CHANCES,
    ISOLATED,
    JUMP_ODDS,
    LEAST,
    LEVELS,
    MOST,
    PRIOR,
    SAMPLES,
    START,
    STAY,
    STRUCK,
    STRUCK_FADES,
    SUSPECT,
    TAU,
)
from .bank import (
    FREEDOM_NOW,
    SIGMA2_NOW,
    WAITS,
    bank_size,
    common_of_banks,
    count_mixture,
    merge_again,
    mixture_of_modes,
    open_bank,
    staying,
)
from .gauss_markov import relax
from .likelihood_drift import begin_again, carry, climb, derivatives, follow, learner_size, open_learner, ratio
from .mixing import (
    add_spread,
    drift_apart,
    drift_beside_state,
    interact,
    merge,
    shrink,
    take_dense_along,
    take_modes_along,
)
from .modes import FREEDOM, WEIGHT, begin_modes, fold, mode, own_sigma2, unfold
from .modes import update as update_bank
from .registry import (
    adapt,
    begin,
    count,
    found_jump,
    mixture,
    outlier_probability,
    register,
    resolve,
    take_along,
    time_update,
)
from .sensitivity import pass_time
from .trial import (
    A_JUMP,
    A_LEVEL,
    AGE,
    ALONE,
    BEFORE,
    COPIES,
    FREED,
    LEVEL,
    NOTHING,
    ODDS,
    SAME,
    alone,
    argue,
    begin_trial,
    hand_over,
    is_over,
    judge,
    move_alone,
    open_trial,
    time_update_copies,
    trial_size,
)
from .unknown_drift import SEEN, UNEXCITED, drift_state_size, excite, lean, open_drift_state

RHO, CLEAN, VERDICT, STRUCK_SO_FAR, COUNTED, SINCE_NOW, IS_ISOLATED, HEAD = range(8)  # its own numbers, and how many
MODES = len(LEVELS) + 1


@register(
    "auto",
    "auto:outliers",
    "auto:jumps",
    about="how fast each parameter drifts, the noise, outliers and jumps are found out; or only these surprise",
    read=lambda words: AutoMemory(words.rest),
)
class AutoMemory(NamedTuple):
    """Nothing to tune: how fast each parameter drifts, sigma^2, outliers, jumps and louder noise are found out.

    Three Kalman filters interact: one that never forgets, one that does so fast (NVR .1), and one whose speeds are
    learnt for each parameter (recursive maximum likelihood); each has its own sigma^2. ``expect`` says what surprises
    may be: "outliers" (then nothing jumps), "jumps" (then every sample counts) or "both". An outlier is discounted by
    the odds that it is one (status ``OUTLIER``); a jump is told (``JUMP``) at odds of 100:1 against none, and against
    another level of the noise, which is told as such if it is louder (``NOISE``). A plant at rest (``AT_REST``) teaches
    nothing about speeds and noise. ``phi`` as in `Drift`.

    Bad at: very smooth motion, and speeds that differ a thousandfold, where the right Q is 10 % better; for a few
    samples after a jump its bars are too narrow; outliers of y that stay among the regressors of an `ARX` are doubted
    there, but frequent ones still look like jumps now and then. The learnt speeds take a few hundred samples.
    Source: Abid and Kamoun (2008) pose the problem; Blom and Bar-Shalom (1988), Willsky and Jones (1976) the parts.
    """

    expect: str = "both"
    phi: Any = 1.0

    @property
    def odds(self) -> float:
        """The odds at which a jump is told: a statistic of 1."""
        return math.exp(JUMP_ODDS)


class AutoMemoryKernel(NamedTuple):
    """What the kernel sees of `AutoMemory`."""

    R: float
    phi: PerParameter
    cap: PerParameter
    floor: float
    moving: float
    learns: float
    freedom: float
    chi2: float
    outliers: float  # 1: some samples are
    jumps: float  # 1: jumps are looked for
    start: float  # of the learnt speeds, see `LikelihoodDrift`
    least: float
    most: float
    samples: float
    tau: float
    prior: float
    levels: Vector
    A: Vector

    def state_size(self, parameters: int) -> int:
        """Return how many numbers it keeps."""
        return drift_state_size(parameters, auto_size(parameters, len(self.levels)))

    @property
    def mixture_columns(self) -> int:
        """How many numbers tell what a prediction is mixed of: three of each mode."""
        return 3 * (len(self.levels) + COPIES)


AUTO = Layout(
    *numbers(
        "head",
        rho="probability that the sample just taken in was an outlier",
        clean="samples since the last one",
        verdict="what the trial decided",
        struck="outliers so far",
        counted="of so many samples",
        since="how long ago began what was decided; -1: the noise is quieter",
        isolated="whether the samples before the last were no outliers",
    ),
    Field("bank", ("bank_size(N, M)",), "the filters that interact"),
    Field("trial", ("trial_size(N, M)",), "what may have happened a moment ago"),
    Field("learner", ("learner_size(N, N)",), "what learns the ratio of the last mode"),
    given=("N", "M"),
    bank_size=bank_size,
    trial_size=trial_size,
    learner_size=learner_size,
)
open_auto, auto_size = kernel(AUTO.open), kernel(AUTO.size)


class Parts(NamedTuple):
    """Views of everything `AutoMemory` keeps: those of `DRIFT_STATE`, `AUTO`, `BANK`, `TRIAL` and `LEARNER`."""

    drift: tuple
    own: tuple
    head: np.ndarray
    trial: tuple
    learner: tuple


@kernel
def open_parts(memory, state, N):
    """Return the views."""
    drift = open_drift_state(state, N)
    parts = open_auto(drift.own, N, MODES)
    bank, trial = open_bank(parts.bank, N, MODES), open_trial(parts.trial, N, MODES)
    return Parts(drift, bank, parts.head, trial, open_learner(parts.learner, N, N))


@resolve.on(AutoMemory)
def resolve_auto_memory(memory, setting):
    expect = validation.one_of("expect", memory.expect, ("both", "outliers", "jumps"))
    levels = np.array([*LEVELS, np.nan])  # the last one is learnt
    return AutoMemoryKernel(
        **common_of_banks(setting, memory.phi), outliers=float(expect != "jumps"), jumps=float(expect != "outliers"),
        start=np.log(START), least=np.log(LEAST), most=np.log(MOST), samples=SAMPLES, tau=TAU, prior=PRIOR,
        levels=levels, A=staying(MODES, STAY).ravel(),
    )  # fmt: skip


@begin.on(AutoMemoryKernel)
def begin_auto_memory(memory, state, view):
    parts = open_parts(memory, state, view.D.size)
    begin_modes(memory, parts.own.bank, view.theta, view.U, view.D)


@kernel
def share_of_outliers(memory, head):
    """Return how many samples in one are outliers, as far as that is known."""
    return memory.outliers * (head[STRUCK_SO_FAR] + STRUCK) / (head[COUNTED] + CHANCES)


@rare
def follow_verdict(memory, parts, what):
    """Let the bank be what has won a trial."""
    trial, learner, N, k = parts.trial, parts.learner, parts.drift.unit.size, LEVEL
    level = own_sigma2(memory, mode(trial.copies, LEVEL, N).own)
    parts.head[SINCE_NOW] = -1.0 if what == A_LEVEL and level < trial.head[BEFORE] else trial.head[AGE]
    if what == A_JUMP:
        k = FREED
        if trial.found[SAME] + trial.head[ALONE] > trial.found[FREED]:
            k = SAME
            move_alone(trial, parts.drift.unit, 1.0)
        for j in range(N):
            begin_again(learner, j)
    else:  # P and Q stay what they are; relative to sigma^2 they change
        change = trial.head[BEFORE] / level
        for j in range(N):
            _, dP = derivatives(learner, j)
            for i in range(dP.size):
                dP[i] *= change
            eta = memory.start + learner.eta[j] + log(change)
            learner.eta[j] = min(max(eta, memory.least), memory.most) - memory.start
    hand_over(trial, parts.own.bank, parts.own.dense, k, MODES)


@rare
def blend(memory, parts, view):
    """Let theta and P be those of the mixture of bank and copies, about a mean that is slower to believe in jumps."""
    own, trial, theta, N = parts.own, parts.trial, view.theta, view.theta.size
    half, P, mean, shown, moved = N * (N + 1) // 2, own.P, view.c, trial.shown, trial.moved
    bank = own.dense[MODES * half : (MODES + 1) * half]
    if shown[SAME] > 0.0:
        move_alone(trial, parts.drift.unit, 1.0)
    rest, stays = 1.0 - shown[0] - shown[1] - shown[2], 1.0 - moved[0] - moved[1] - moved[2]
    s2 = own_s2 = rest * own.head[SIGMA2_NOW]
    freedom = rest * own.head[FREEDOM_NOW]
    for i in range(N):
        mean[i] = stays * theta[i]
    for k in range(COPIES):
        one = mode(trial.copies, k, N)
        s2 += shown[k] * own_sigma2(memory, one.own)
        freedom += shown[k] * one.own[FREEDOM]
        for i in range(N):
            mean[i] += moved[k] * one.theta[i]
    for i in range(half):
        P[i] = 0.0
    add_spread(P, own_s2 / s2, bank, rest / s2, theta, mean)
    for k in range(COPIES):
        one, w = mode(trial.copies, k, N), shown[k] / s2
        if w > 0.0:
            add_spread(P, w * own_sigma2(memory, one.own), trial.dense[k * half : (k + 1) * half], w, one.theta, mean)
    if shown[SAME] > 0.0:
        move_alone(trial, parts.drift.unit, -1.0)
    shrink(P, memory.cap)
    for i in range(N):
        theta[i] = mean[i]
    for i in range(half):
        bank[i] = P[i]
    factor_within(P, view.U, view.D)
    own.head[SIGMA2_NOW], own.head[FREEDOM_NOW] = s2, freedom


@kernel
def try_out(memory, parts, e, R, evidence, rho, outliers, view):
    """Let the trial see the sample, and follow what it decides; return the probability of an outlier to all."""
    trial, head = parts.trial, parts.head
    same, freed, level = argue(memory, trial, e, R, head[CLEAN], view.theta, evidence, outliers, view, parts.drift.unit)
    head[VERDICT] = judge(memory, trial, outliers, parts.drift.head[SEEN])
    shown = trial.shown
    rest = 1.0 - shown[0] - shown[1] - shown[2]
    if head[VERDICT] != NOTHING:
        follow_verdict(memory, parts, head[VERDICT])
    return rest * rho + shown[0] * same + shown[1] * freed + shown[2] * level


@adapt.on(AutoMemoryKernel)
def adapt_auto_memory(memory, state, e, R, view):
    theta, U, D, s2, parts = view.theta, view.U, view.D, view.s2, open_parts(memory, state, view.D.size)
    own, trial, drift, learner, head = parts.own, parts.trial, parts.drift, parts.learner, parts.head
    N, M, T = D.size, MODES, predicted_variance(view.f, D, R)
    is_unexcited = excite(memory, drift, view.row)
    lean(drift, R, T)
    if own.head[WAITS] > 0.0:  # one more output of the same sample
        fold(own.bank, own.dense, N)
        if trial.head[AGE] > 0.0:
            fold(trial.copies, trial.dense, N)
    outliers, is_trying = share_of_outliers(memory, head), not is_unexcited and drift.head[SEEN] > 4.0 * N
    if is_trying and is_over(trial, e * e / (s2 * T)):
        begin_trial(memory, trial, own.bank, drift.unit, M, e * e / (s2 * T), view.b)
    evidence, rho = update_bank(
        memory, own.bank, own.dense, e, R, theta, view, own.logs, outliers, is_unexcited, is_unexcited
    )
    own.head[WAITS] = 0.0 if is_unexcited else 1.0
    if is_unexcited:
        unfold(own.bank, own.dense, N)
    error, spread, own_s2, part = own.logs[M], own.logs[M + 1], own.logs[M + 2], own.logs[M + 3]
    follow(learner, view.psi, view.b, error, spread, own_s2, part, view.c)
    if drift.head[SEEN] > 2.0 * N and not is_unexcited:
        climb(memory, learner, error / math.sqrt(own_s2 * spread), part)
    head[VERDICT] = NOTHING
    if is_trying:
        rho = try_out(memory, parts, e, R, evidence, rho, outliers, view)
    else:
        trial.head[ODDS] = 0.0
        for k in range(COPIES):
            trial.shown[k] = trial.moved[k] = 0.0
    head[RHO], head[IS_ISOLATED] = rho, 1.0 if head[CLEAN] >= ISOLATED else 0.0
    head[CLEAN] = 0.0 if rho > 0.5 else head[CLEAN] + 1.0
    if not is_unexcited and head[VERDICT] == NOTHING:
        head[STRUCK_SO_FAR] = STRUCK_FADES * head[STRUCK_SO_FAR] + rho
        head[COUNTED] = STRUCK_FADES * head[COUNTED] + 1.0
    own.head[FREEDOM_NOW], own.head[SIGMA2_NOW] = merge(memory, own, theta, U, D)
    if head[VERDICT] == NOTHING and trial.shown[0] + trial.shown[1] + trial.shown[2] > 0.0:
        blend(memory, parts, view)
    return T


@count.on(AutoMemoryKernel)
def count_auto_memory(memory, state, count, chi2, weight, gain):
    drift = open_drift_state(state, memory.cap.size)
    return count_mixture(memory, drift, drift.own[HEAD:], count, chi2, gain)


@outlier_probability.on(AutoMemoryKernel)
def outlier_probability_auto_memory(memory, state):
    head = open_drift_state(state, memory.cap.size).own
    if head[VERDICT] != NOTHING:
        return 0.0
    return head[RHO] if head[IS_ISOLATED] > 0.0 else min(head[RHO], SUSPECT)


@found_jump.on(AutoMemoryKernel)
def found_jump_auto_memory(memory, state, detector_state):
    parts = open_parts(memory, state, memory.cap.size)
    is_told = parts.head[VERDICT] == A_JUMP
    detector_state[STATISTIC] = parts.trial.head[ODDS]
    if is_told:
        detector_state[SINCE], detector_state[WHICH] = parts.head[SINCE_NOW], -1.0
    return 1.0 if is_told else 0.0


@time_update.on(AutoMemoryKernel)
def time_update_auto_memory(memory, state, elapsed, view):
    parts = open_parts(memory, state, memory.cap.size)
    own, trial, drift, learner, head = parts.own, parts.trial, parts.drift, parts.learner, parts.head
    N, M, q, status = memory.cap.size, MODES, own.q, 0
    is_unexcited, waits = drift.head[UNEXCITED] > 0.0, own.head[WAITS] > 0.0
    for i in range(N):
        for m in range(M - 1):
            q[m * N + i] = memory.levels[m] * drift.unit[i]
        q[(M - 1) * N + i] = drift.q[i] = ratio(memory, learner, i) * drift.unit[i]
    if not waits:
        unfold(own.bank, own.dense, N)
    for i in range(N):
        view.c[i] = own.dense[(M - 1) * own.P.size + at(i, i)]
    carry(learner, memory.phi, drift.q, view.c, memory.cap)
    if waits:
        is_capped = interact(memory, own, own.bank, q, N)
    else:
        is_capped = drift_apart(memory, own.bank, q, view.b)
    if trial.head[AGE] > 0.0:
        time_update_copies(memory, trial, q, waits, view.b)
    own.head[WAITS] = 0.0
    if view.surprise >= 0.0:
        status |= AT_REST if is_unexcited else 0
        status |= NOISE if head[VERDICT] == A_LEVEL and head[SINCE_NOW] > 0.0 else 0
        status |= OUTLIER if head[RHO] > 0.5 and head[VERDICT] == NOTHING else 0
    if is_capped:
        merge_again(memory, own, view)
        return 1.0, status | CAPPED
    if view.first > 0:
        drift_beside_state(memory, own.bank, q, view)
    else:
        drift_together(memory, own, waits, view.theta, view.U, view.D, view)
    return 1.0, status


@kernel
def drift_together(memory, own, waits, theta, U, D, view):
    """Take the mixture on: what its modes are now, told without mixing them again."""
    N, M, total = D.size, MODES, 0.0
    for m in range(M):
        one = mode(own.bank, m, N).own
        own.logs[m] = one[WEIGHT] * own_sigma2(memory, one)
        total += own.logs[m]
    inverse = 1.0 / total
    for i in range(N):
        view.c[i] = 0.0
        for m in range(M):
            view.c[i] += own.logs[m] * own.q[m * N + i]
        view.c[i] *= inverse
    if waits:
        P = own.dense[M * own.P.size :]
        pass_time(theta, P, memory.phi)
        for i in range(N):
            P[at(i, i)] += view.c[i]
        factor_within(P, U, D)
    else:
        relax(theta, U, D, memory.phi, view.b)
        for i in range(N):
            widen(U, D, i, view.c[i], view.b)


@mixture.on(AutoMemoryKernel)
def mixture_auto_memory(memory, state, R, view, out):
    N, parts = view.theta.size, open_parts(memory, state, view.theta.size)
    trial, rest = parts.trial, 1.0
    mixture_of_modes(memory, parts.own.bank, R, view, out)
    for k in range(COPIES):
        place, one, w = 3 * (MODES + k), mode(trial.copies, k, N), trial.shown[k] if trial.head[AGE] > 0.0 else 0.0
        offset, variance = 0.0, R
        if w > 0.0:
            for i in range(N):
                offset += view.psi[i] * (one.theta[i] - view.theta[i])
            project(one.U, view.psi, view.b)
            variance = predicted_variance(view.b, one.D, R)
            if k == SAME:
                more, spread = alone(trial, view.psi, parts.drift.unit)
                offset += more
                variance += spread
        out[place], out[place + 1], out[place + 2] = w, offset, own_sigma2(memory, one.own) * variance
        rest -= w
    for m in range(MODES):
        out[3 * m] *= rest


@take_along.on(AutoMemoryKernel)
def take_along_auto_memory(memory, state, change, view):
    N, parts = memory.cap.size, open_parts(memory, state, memory.cap.size)
    own, trial, waits = parts.own, parts.trial, parts.own.head[WAITS] > 0.0
    take_modes_along(memory, own.bank, change, view)
    if waits:
        take_dense_along(memory, own.bank, own.dense, change, view)
    if trial.head[AGE] > 0.0:
        if waits:
            fold(trial.copies, trial.dense, N)
        take_modes_along(memory, trial.copies, change, view)
        if waits:
            unfold(trial.copies, trial.dense, N)
