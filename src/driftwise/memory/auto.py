"""The default where nothing is known of drift, noise, outliers and jumps: every explanation competes.

A small interacting bank with one learnt speed explains slow change. A surprise starts a trial: a challenger, whose
parameters have just jumped, against a rival, whose noise has become louder, and both against the bank as it was. Each
collects the evidence of its predictions; the one that wins takes over, and the event is told.
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
from ..engine.ud import factor_within, predicted_variance, widen
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
from .likelihood_drift import begin_again, carry, climb, follow, learner_size, open_learner, ratio
from .mixing import drift_apart, drift_beside_state, interact, merge, take_dense_along, take_modes_along
from .modes import CHI2, FREEDOM, WEIGHT, begin_modes, fold, mode, own_sigma2, size_of, unfold
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
from .unknown_drift import SEEN, UNEXCITED, drift_state_size, excite, lean, open_drift_state

ON, AGE, JUMPED, LOUDER, VERDICT, RHO, CLEAN, TRIAL = range(8)  # of a trial: runs it, how long, log odds, what it found
NOTHING, A_JUMP, A_LEVEL = range(3)
LEVELS, STAY = (0.0, 0.1), 0.999  # NVRs besides the learnt one; probability that the speed stays
MODES = len(LEVELS) + 1
SURPRISE = 9.0  # times the variance of the prediction: a trial starts
PRIOR = log(1 / 200)  # log odds of both explanations then
WIDE, LOUD = 100.0, 3.0  # what a jump adds to P, in units; by what the noise variance grows
JUMP_ODDS, LEVEL_ODDS, AHEAD = log(5.0), log(20.0), log(3.0)
LEVEL_AGE, OLDEST, HOPELESS, IMPOSSIBLE = 8.0, 16.0, -6.0, -1e300


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
    the odds that it is one (status ``OUTLIER``); a jump is told (``JUMP``) when the odds are 5:1 and three times those
    of louder noise, which is told as such (``NOISE``). A plant at rest (``AT_REST``) teaches nothing about speeds and
    noise. ``phi`` as in `Drift`.

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
    trials: float  # 1: jumps and louder noise are looked for
    ripe: float  # samples a challenger runs at least
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
        return 3 * len(self.levels)


AUTO = Layout(
    *numbers(
        "trial",
        on="whether a trial runs",
        age="for how long",
        jumped="log odds of a jump",
        louder="and of louder noise",
        verdict="what it found",
        rho="surprise of the sample just taken in",
        clean="probability that it was no outlier",
    ),
    Field("bank", ("bank_size(N, M)",), "the incumbent's modes"),
    Field("challenger", ("M * size_of(N)",), "modes whose parameters were set free"),
    Field("rival", ("M * size_of(N)",), "modes whose noise is louder"),
    Field("learner", ("learner_size(N, N)",), "what learns the ratio of the last mode"),
    given=("N", "M"),
    bank_size=bank_size,
    size_of=size_of,
    learner_size=learner_size,
)
open_auto, auto_size = kernel(AUTO.open), kernel(AUTO.size)


class Parts(NamedTuple):
    """Views of everything `AutoMemory` keeps: those of `DRIFT_STATE`, `AUTO`, `BANK` and `LEARNER`."""

    drift: tuple
    own: tuple
    trial: np.ndarray
    challenger: np.ndarray
    rival: np.ndarray
    learner: tuple


@kernel
def open_parts(memory, state, N):
    """Return the views."""
    drift = open_drift_state(state, N)
    parts = open_auto(drift.own, N, MODES)
    bank, learner = open_bank(parts.bank, N, MODES), open_learner(parts.learner, N, N)
    return Parts(drift, bank, parts.trial, parts.challenger, parts.rival, learner)


@resolve.on(AutoMemory)
def resolve_auto_memory(memory, setting):
    expect = validation.one_of("expect", memory.expect, ("both", "outliers", "jumps"))
    levels = np.array([*LEVELS, np.nan])  # the last one is learnt
    return AutoMemoryKernel(
        **common_of_banks(setting, memory.phi), outliers=float(expect != "jumps"), trials=float(expect != "outliers"),
        ripe=1.0 if expect == "jumps" else 2.0, start=np.log(1e-2), least=np.log(1e-6), most=np.log(10.0),
        samples=300.0, tau=2.0, prior=4.0, levels=levels, A=staying(MODES, STAY).ravel(),
    )  # fmt: skip


@begin.on(AutoMemoryKernel)
def begin_auto_memory(memory, state, view):
    parts = open_parts(memory, state, view.D.size)
    begin_modes(memory, parts.own.bank, view.theta, view.U, view.D)


@rare
def challenge(memory, parts, b):
    """Start a trial: both banks are the incumbent's; one with parameters set free, one with louder noise."""
    bank, trial, N = parts.own.bank, parts.trial, memory.cap.size
    for i in range(bank.size):
        parts.challenger[i] = parts.rival[i] = bank[i]
    for m in range(MODES):
        one, rival = mode(parts.challenger, m, N), mode(parts.rival, m, N).own
        for i in range(N):
            widen(one.U, one.D, i, WIDE * parts.drift.unit[i], b)
        rival[CHI2] = 2.0 * LOUD * own_sigma2(memory, rival)
        rival[FREEDOM] = 2.0
    trial[ON], trial[AGE], trial[JUMPED], trial[LOUDER] = 1.0, 0.0, PRIOR, PRIOR


@rare
def argue(memory, parts, e, R, theta, evidence, view, is_unexcited):
    """Let challenger and rival see the sample; return what is decided, NOTHING while the trial goes on."""
    trial, own, is_robust = parts.trial, parts.own, memory.outliers > 0.0
    noise = memory.R if trial[CLEAN] <= theta.size else R  # to both, what looked like an outlier is as it should be
    for which in (JUMPED, LOUDER):
        bank = parts.challenger if which == JUMPED else parts.rival
        found, _ = update_bank(memory, bank, own.dense, e, noise, theta, view, own.logs, is_robust, is_unexcited, True)
        trial[which] += found - evidence
    if memory.learns == 0.0:
        trial[LOUDER] = IMPOSSIBLE
    trial[AGE] += 1.0
    jumped, louder, samples = trial[JUMPED], trial[LOUDER], trial[AGE]
    if jumped > JUMP_ODDS and samples >= memory.ripe and jumped > louder + AHEAD:
        return A_JUMP
    if louder > LEVEL_ODDS and samples >= LEVEL_AGE and louder > jumped:
        return A_LEVEL
    if (jumped < HOPELESS and louder < HOPELESS) or samples >= OLDEST:
        trial[ON] = 0.0
    return NOTHING


@rare
def take_over(own, bank, trial):
    """Let the winner be the incumbent."""
    for i in range(bank.size):
        own.bank[i] = bank[i]
    unfold(own.bank, own.dense, own.q.size // MODES)
    trial[ON] = 0.0


@adapt.on(AutoMemoryKernel)
def adapt_auto_memory(memory, state, e, R, view):
    theta, U, D, s2, parts = view.theta, view.U, view.D, view.s2, open_parts(memory, state, view.D.size)
    own, trial, drift, learner = parts.own, parts.trial, parts.drift, parts.learner
    N, M, T = D.size, MODES, predicted_variance(view.f, D, R)
    is_unexcited = excite(memory, drift, view.row)
    lean(drift, R, T)
    if own.head[WAITS] > 0.0:  # one more output of the same sample
        fold(own.bank, own.dense, N)
    if memory.trials > 0.0 and trial[ON] == 0.0 and drift.head[SEEN] > 4.0 * N:
        freedom = own.head[FREEDOM_NOW] if memory.learns > 0.0 else math.inf
        heavy = 1.0 if freedom == math.inf else freedom / (freedom - 2.0) if freedom > 4.0 else 2.0
        if e * e > SURPRISE * heavy * s2 * T:
            challenge(memory, parts, view.b)
    evidence, trial[RHO] = update_bank(
        memory, own.bank, own.dense, e, R, theta, view, own.logs, memory.outliers > 0.0, is_unexcited, is_unexcited
    )
    own.head[WAITS] = 0.0 if is_unexcited else 1.0
    if is_unexcited:
        unfold(own.bank, own.dense, N)
    error, spread, own_s2, part = own.logs[M], own.logs[M + 1], own.logs[M + 2], own.logs[M + 3]
    follow(learner, view.psi, view.b, error, spread, own_s2, part, view.c)
    if drift.head[SEEN] > 2.0 * N and not is_unexcited:
        climb(memory, learner, error / math.sqrt(own_s2 * spread), part)
    trial[VERDICT] = NOTHING
    trial[CLEAN] = 0.0 if trial[RHO] > 0.5 else trial[CLEAN] + 1.0
    if trial[ON] > 0.0:
        trial[VERDICT] = argue(memory, parts, e, R, theta, evidence, view, is_unexcited)
        if trial[VERDICT] == A_JUMP:
            take_over(own, parts.challenger, trial)
            for j in range(N):
                begin_again(learner, j)
        elif trial[VERDICT] == A_LEVEL:
            take_over(own, parts.rival, trial)
    own.head[FREEDOM_NOW], own.head[SIGMA2_NOW] = merge(memory, own, theta, U, D)
    return T


@count.on(AutoMemoryKernel)
def count_auto_memory(memory, state, count, chi2, weight, gain):
    drift = open_drift_state(state, memory.cap.size)
    return count_mixture(memory, drift, drift.own[TRIAL:], count, chi2, gain)


@outlier_probability.on(AutoMemoryKernel)
def outlier_probability_auto_memory(memory, state):
    trial = open_drift_state(state, memory.cap.size).own
    return trial[RHO] if trial[VERDICT] == NOTHING else 0.0


@found_jump.on(AutoMemoryKernel)
def found_jump_auto_memory(memory, state, detector_state):
    trial = open_drift_state(state, memory.cap.size).own
    is_told = trial[VERDICT] == A_JUMP
    detector_state[STATISTIC] = max(trial[JUMPED] / JUMP_ODDS, 0.0) if is_told or trial[ON] > 0.0 else 0.0
    if is_told:
        detector_state[SINCE], detector_state[WHICH] = trial[AGE], -1.0
    return 1.0 if is_told else 0.0


@rare
def take_on(memory, parts, waits, b):
    """Take the banks of a trial one sample on."""
    for bank in (parts.challenger, parts.rival):
        if waits:
            unfold(bank, parts.own.dense, memory.cap.size)
            interact(memory, parts.own, bank, parts.own.q, memory.cap.size)
        else:
            drift_apart(memory, bank, parts.own.q, b)


@time_update.on(AutoMemoryKernel)
def time_update_auto_memory(memory, state, elapsed, view):
    parts = open_parts(memory, state, memory.cap.size)
    own, trial, drift, learner = parts.own, parts.trial, parts.drift, parts.learner
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
    if trial[ON] > 0.0:
        take_on(memory, parts, waits, view.b)
    own.head[WAITS] = 0.0
    if view.surprise >= 0.0:
        status |= AT_REST if is_unexcited else 0
        status |= NOISE if trial[VERDICT] == A_LEVEL else 0
        status |= OUTLIER if trial[RHO] > 0.5 and trial[VERDICT] == NOTHING else 0
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
    mixture_of_modes(memory, open_parts(memory, state, view.theta.size).own.bank, R, view, out)


@take_along.on(AutoMemoryKernel)
def take_along_auto_memory(memory, state, change, view):
    parts = open_parts(memory, state, view.D.size)
    for bank in (parts.own.bank, parts.challenger, parts.rival):
        take_modes_along(memory, bank, change, view)
    if parts.own.head[WAITS] > 0.0:
        take_dense_along(memory, parts.own.bank, parts.own.dense, change, view)
