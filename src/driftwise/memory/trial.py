"""What may have happened a moment ago: nothing, a jump of all parameters or of one, another level of the noise.

A trial runs all the time. Copies of the likeliest filter of a bank go on from the sample it began with: one as it is,
one whose parameters were set free, one whose sigma^2 is unknown again. Each collects the evidence of its predictions.
A jump of one parameter needs no filter: that the parameters are wrong by d e_i shows in the innovations of the first
as psi' F_i d, F_i its sensitivity to its own start, so that its evidence is a quotient (Willsky and Jones 1976).
"""

import math

from ..engine.dense import add_square, at
from ..engine.dispatch import kernel, rare
from ..engine.elementary import exp, log
from ..engine.layout import Field, Layout, each, numbers
from ..engine.ud import factor_within
from .auto_constants import (
    BY_DRIFT,
    BY_DRIFT_YOUNG,
    FAINT,
    FREED_FREEDOM,
    FRESH,
    HOPELESS,
    JUMP_AGE,
    JUMP_ODDS,
    LEVEL_AGE,
    LEVEL_ODDS,
    LOUD,
    LOUD_FREEDOM,
    OLD,
    OLDEST,
    PLAIN_FREEDOM,
    RATE,
    SHY,
    SHY_OF_OUTLIERS,
    SURPRISE,
    WIDE,
    WIDEST,
    YOUNG,
)
from .gauss_markov import relax, widen_within
from .mixing import shrink
from .modes import CHI2, FREEDOM, WEIGHT, mode, own_sigma2, size_of, take
from .sensitivity import pass_time

SAME, FREED, LEVEL = range(3)  # the copies
COPIES = 3
NOTHING, A_JUMP, A_LEVEL = range(3)
AGE, GAP, LEADER, BEFORE, ALONE, WHICH, BESIDE, ODDS = range(8)  # of the head
IMPOSSIBLE = -1e300
UNSEEN = -4.0  # log odds of which `FAINT` is out of reach
SLIGHT = 2.0  # log evidence that no jump of one parameter is shown for

TRIAL = Layout(
    *numbers(
        "head",
        age="samples since it began; 0: none runs",
        gap="samples between its beginning and that of the one before; 1 if it began at a surprise",
        leader="which filter of the bank the copies are of",
        before="sigma^2 of it then",
        alone="log evidence of a jump of one parameter, over that of none",
        which="the likeliest one",
        beside="log evidence of the bank itself",
        odds="log odds of a jump, over those at which it is told",
    ),
    *each(
        "3",
        found="log evidence of each copy; the first is none, or one parameter that jumped",
        shown="its probability",
        moved="its share in the mean that is shown",
    ),
    Field("weights", ("M",), "of the filters of the bank when it began"),
    Field("copies", ("3 * size_of(N)",), "as it was, parameters set free, sigma^2 unknown"),
    Field("dense", ("3 * half",), "their P, packed, between a sample and the time update"),
    Field("F", ("N * N",), "what the first has wrong now by what it had wrong when it began, column by column"),
    *each("N", score="F' psi e/T, summed", known="(F' psi)^2/T, summed"),
    given=("N", "M"),
    size_of=size_of,
    half="N * (N + 1) // 2",
)
open_trial, trial_size = kernel(TRIAL.open), kernel(TRIAL.size)


@kernel
def best_of(trial):
    """Return the log evidence of the best explanation other than none, over that of none."""
    found = trial.found
    return max(max(found[FREED], found[SAME] + trial.head[ALONE]), found[LEVEL]) - found[SAME]


@kernel
def is_over(trial, surprise):
    """Say whether a trial is to begin anew: at a surprise, or after a while, if this one has nothing to tell."""
    head = trial.head
    if head[AGE] == 0.0 or head[AGE] >= OLDEST:
        return True
    if surprise >= SURPRISE:
        is_ripe = head[GAP] > 1.0 or head[AGE] >= trial.score.size + FRESH
    else:
        is_ripe = head[AGE] >= OLD
    return is_ripe and best_of(trial) + log(RATE * head[GAP]) < HOPELESS


@rare
def begin_trial(memory, trial, bank, unit, M, surprise, b):
    """Copy the likeliest filter of the bank, set the parameters of one copy free and sigma^2 of another."""
    N, head, size = unit.size, trial.head, size_of(unit.size)
    leader, most, is_surprise = 0, 0.0, surprise >= SURPRISE
    for m in range(M):
        trial.weights[m] = mode(bank, m, N).own[WEIGHT]
        if trial.weights[m] > most:
            leader, most = m, trial.weights[m]
    for k in range(COPIES):
        for i in range(size):
            trial.copies[k * size + i] = bank[leader * size + i]
        mode(trial.copies, k, N).own[WEIGHT] = 1.0
        trial.found[k] = trial.shown[k] = trial.moved[k] = 0.0
    freed, level = mode(trial.copies, FREED, N), mode(trial.copies, LEVEL, N).own
    head[BEFORE] = own_sigma2(memory, level)
    level[FREEDOM] = LOUD_FREEDOM if is_surprise else PLAIN_FREEDOM
    level[CHI2] = level[FREEDOM] * head[BEFORE] * (LOUD if is_surprise else 1.0)
    if freed.own[FREEDOM] > FREED_FREEDOM:
        freed.own[FREEDOM], freed.own[CHI2] = FREED_FREEDOM, FREED_FREEDOM * head[BEFORE]
    for i in range(N):
        widen_within(freed.U, freed.D, i, min(max(WIDE, surprise), WIDEST) * unit[i], memory.cap[i], b)
        trial.score[i] = trial.known[i] = 0.0
    for i in range(N * N):
        trial.F[i] = 1.0 if i % (N + 1) == 0 else 0.0
    head[GAP] = 1.0 if is_surprise else max(head[AGE], 1.0)
    head[AGE], head[LEADER], head[BESIDE], head[ALONE] = 0.0, leader, 0.0, 0.0


@kernel
def copy_sees(memory, trial, k, e, R, theta, outliers, view):
    """Let a copy see the sample; return its error, the probability that it is an outlier, and T."""
    N = theta.size
    half = N * (N + 1) // 2
    one, error = mode(trial.copies, k, N), e
    for i in range(N):
        error += view.psi[i] * (theta[i] - one.theta[i])
    P = trial.dense[k * half : (k + 1) * half]
    log_p, rho, T, _ = take(memory, one, P, error, R, view, outliers, False, False)
    trial.found[k] += log_p
    return error, rho, T


@kernel
def weigh(trial, error, rho, T, view, unit, s2):
    """Take a sample of the first copy into the evidence for a jump of one parameter; view.b is its P psi."""
    N, head, gain, best, total = unit.size, trial.head, (1.0 - rho) / T, 0.0, 0.0
    for i in range(N):
        column, c = trial.F[i * N : (i + 1) * N], 0.0
        for j in range(N):
            c += view.psi[j] * column[j]
        trial.known[i] += gain * c * c
        trial.score[i] += gain * c * error
        for j in range(N):
            column[j] -= view.b[j] * gain * c
        view.c[i] = 0.5 * trial.score[i] * trial.score[i] * spread_alone(trial, unit, i) / s2
        if view.c[i] > best:
            best, head[WHICH] = view.c[i], i
    head[ALONE] = 0.0
    if best > SLIGHT:
        for i in range(N):
            total += exp(view.c[i] - best) / math.sqrt(1.0 + WIDE * unit[i] * trial.known[i])
        head[ALONE] = best + log(total / N)


@kernel
def spread_alone(trial, unit, i):
    """Return the variance of the jump of parameter i, if it jumped: as known as its information allows."""
    wide = WIDE * unit[i]
    return wide / (1.0 + wide * trial.known[i])


@kernel
def argue(memory, trial, e, R, clean, theta, evidence, outliers, view, unit):
    """Let the trial see the sample; return the probability that it is an outlier, to each copy.

    ``clean`` are the samples since the last outlier, ``evidence`` is that of the bank.
    """
    N, head = theta.size, trial.head
    half = N * (N + 1) // 2
    error, rho, T = copy_sees(memory, trial, SAME, e, R, theta, outliers, view)
    weigh(trial, error, rho, T, view, unit, own_sigma2(memory, mode(trial.copies, SAME, N).own))
    noise = memory.R if clean <= N else R  # if they jumped, what looked like an outlier was right
    _, freed_rho, _ = copy_sees(memory, trial, FREED, e, noise, theta, outliers, view)
    level_rho, level = 0.0, mode(trial.copies, LEVEL, N).own
    if memory.learns > 0.0:
        before = own_sigma2(memory, level)
        _, level_rho, _ = copy_sees(memory, trial, LEVEL, e, R, theta, outliers, view)
        change = before / own_sigma2(memory, level)
        for i in range(half):  # what it knows of the parameters stays what it was, whatever the noise is
            trial.dense[LEVEL * half + i] *= change
    else:
        trial.found[LEVEL] = IMPOSSIBLE
    head[AGE] += 1.0
    head[BESIDE] += evidence
    return rho, freed_rho, level_rho


@kernel
def judge(memory, trial, outliers, seen):
    """Set the probabilities of the copies, faint ones to zero; return what is decided, NOTHING while it goes on."""
    head, found, shown, moved = trial.head, trial.found, trial.shown, trial.moved
    prior = log(RATE * head[GAP])
    jump = prior if memory.jumps > 0.0 else IMPOSSIBLE
    shown[SAME] = found[SAME] + head[ALONE] + jump - head[BESIDE]
    shown[FREED] = found[FREED] + jump - head[BESIDE]
    shown[LEVEL] = found[LEVEL] + prior - head[BESIDE]
    best, level = max(shown[SAME], shown[FREED]), shown[LEVEL]
    none = max(found[SAME] - head[BESIDE], level)
    head[ODDS] = max((best - none) / JUMP_ODDS, 0.0) if memory.jumps > 0.0 else 0.0
    weigh_up(shown, moved, min(SHY, SHY_OF_OUTLIERS / max(outliers, SHY_OF_OUTLIERS)))
    by_drift = BY_DRIFT if seen > YOUNG else BY_DRIFT_YOUNG
    if head[ODDS] > 1.0 and head[AGE] >= JUMP_AGE and best > by_drift:
        return A_JUMP
    if level > max(found[SAME] - head[BESIDE], best) + LEVEL_ODDS and head[AGE] >= LEVEL_AGE and level > by_drift:
        return A_LEVEL
    return NOTHING


@kernel
def weigh_up(shown, moved, shy):
    """Turn log odds of the copies against the bank into probabilities, and into shares in the mean that is shown."""
    top = max(max(shown[SAME], shown[FREED]), shown[LEVEL])
    if top < UNSEEN:
        for k in range(COPIES):
            shown[k] = moved[k] = 0.0
        return
    top = max(top, 0.0)
    total = exp(-top)
    all_moved = total
    for k in range(COPIES):
        shown[k] = exp(shown[k] - top)
        moved[k] = shown[k] if k == LEVEL else shy * shown[k]
        total += shown[k]
        all_moved += moved[k]
    for k in range(COPIES):
        is_faint = shown[k] <= FAINT * total
        shown[k], moved[k] = (0.0, 0.0) if is_faint else (shown[k] / total, moved[k] / all_moved)


@kernel
def move_alone(trial, unit, sign):
    """Let the first copy be what it is if its likeliest parameter jumped (sign 1), or undo that (-1)."""
    N = unit.size
    i, half = int(trial.head[WHICH]), N * (N + 1) // 2
    column, one, v = trial.F[i * N : (i + 1) * N], mode(trial.copies, SAME, N), spread_alone(trial, unit, i)
    for j in range(N):
        one.theta[j] += sign * v * trial.score[i] * column[j]
    add_square(trial.dense[SAME * half : (SAME + 1) * half], sign * v, column)


@kernel
def alone(trial, psi, unit):
    """Return by how much a jump of the likeliest parameter moves a prediction, and what it adds to its variance."""
    N = unit.size
    i, c = int(trial.head[WHICH]), 0.0
    for j in range(N):
        c += psi[j] * trial.F[i * N + j]
    v = spread_alone(trial, unit, i)
    return c * v * trial.score[i], c * c * v


@rare
def hand_over(trial, bank, dense, k, M):
    """Let every filter of the bank be copy k, with the weights from before the trial, which ends."""
    N = trial.score.size
    half, one = N * (N + 1) // 2, mode(trial.copies, k, N)
    for m in range(M):
        to = mode(bank, m, N)
        to.own[WEIGHT], to.own[FREEDOM], to.own[CHI2] = trial.weights[m], one.own[FREEDOM], one.own[CHI2]
        for i in range(N):
            to.theta[i] = one.theta[i]
        for i in range(half):
            dense[m * half + i] = trial.dense[k * half + i]
    trial.head[AGE] = 0.0


@kernel
def time_update_copies(memory, trial, q, waits, b):
    """Take the copies one sample on; ``q`` are the variances that every filter of the bank gains, N of each."""
    N = memory.cap.size
    half, first = N * (N + 1) // 2, int(trial.head[LEADER]) * N
    for k in range(COPIES):
        one, P = mode(trial.copies, k, N), trial.dense[k * half : (k + 1) * half]
        share = trial.head[BEFORE] / own_sigma2(memory, one.own) if k == LEVEL else 1.0
        if waits:
            pass_time(one.theta, P, memory.phi)
            for i in range(N):
                P[at(i, i)] += share * q[first + i]
            shrink(P, memory.cap)
            factor_within(P, one.U, one.D)
        else:
            relax(one.theta, one.U, one.D, memory.phi, b)
            for i in range(N):
                widen_within(one.U, one.D, i, share * q[first + i], memory.cap[i], b)
    for i in range(N):
        for j in range(N):
            trial.F[i * N + j] *= memory.phi[j]
