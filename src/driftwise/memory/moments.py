"""Has one parameter jumped at some moment of the last thirty-six samples? The sum over all of them says so.

A trial begins when something looks wrong, and knows nothing of what came before: a jump of one deviation has brought
half of its evidence by then, or never looks wrong. Here psi_i e/T and psi_i^2/T of the filter that never forgets are
summed up, and every fourth sample the sums are kept. What they have grown by since is a regression of one unknown: the
jump of parameter i at that moment. The Bayes factors of all moments and parameters are added. That the filter follows
a jump a little is neglected; what the sums are worth where nothing jumps is not touched by it.

A parameter that walks has wandered off as well. Between two moments the sums say v = m d + noise of variance m, d what
the parameter is off by: for one that walks at a given speed a Kalman filter of one number has the evidence of that. The
speed is the one that had been learnt before the oldest moment: what a jump has taught it does not count.

Source: Willsky and Jones (1976), see `lone_jump`, with sums in place of maxima (Shiryaev 1963).
"""

import math

from ..engine.dense import add_square, at
from ..engine.dispatch import kernel, rare
from ..engine.elementary import exp, log, log1p
from ..engine.layout import Field, Layout, each, numbers
from ..engine.ud import predicted_variance, project
from .auto_constants import JUMP_ODDS, LONE, MOMENT_BY_DRIFT, MOMENTS, RATE, STEP, WORTH
from .likelihood_drift import begin_again
from .modes import CHI2, FREEDOM, WEIGHT, error_of, hand_over, mode, own_noise, own_sigma2

COUNTED, ENERGY, AMOUNT, BESIDE, ODDS, OVER_DRIFT, SINCE = range(7)  # of the head
HIGHEST = 300.0  # log evidence, at most: sums of exponentials must not overflow
MOST_EXPLAINED = 0.99  # share of the sum of squares: numbers that are almost without noise say no more

MOMENT = Layout(
    *numbers(
        "head",
        counted="samples since all was forgotten",
        energy="sum of e^2/(s2 T)",
        amount="of so many samples",
        beside="log evidence of the filter, over that of the bank",
        odds="log odds of a jump, over those at which it is told",
        over_drift="log odds of a jump against the bank, or having walked",
        since="samples since the likeliest moment",
    ),
    *each("N", score="sum of psi_i e/T", known="sum of psi_i^2/T"),
    Field("kept", ("K * (3 + M + 3 * N)",), "of each moment: what a row of it has"),
    given=("N", "M", "K"),
)
open_moments, moments_size = kernel(MOMENT.open), kernel(MOMENT.size)

ROW = Layout(
    *numbers("head", energy="sum of e^2/(s2 T)", amount="of so many samples", beside="as above"),
    Field("weights", ("M",), "of the filters of the bank"),
    *each("N", score="sum of psi_i e/T", known="sum of psi_i^2/T", q="the learnt variances of drift"),
    given=("N", "M"),
)
open_row, row_size = kernel(ROW.open), kernel(ROW.size)
ROW_ENERGY, ROW_AMOUNT, ROW_BESIDE = range(3)


@kernel
def moment(moments, r, M):
    """Return what was kept at moment r."""
    N = moments.score.size
    size = row_size(N, M)
    return open_row(moments.kept[r * size : (r + 1) * size], N, M)


@kernel
def count_of_moments(moments):
    """Return how many moments are kept."""
    return min(int(moments.head[COUNTED]) // STEP - 1, MOMENTS)


@kernel
def forget_moments(moments):
    """Begin again: what was summed up is about a filter that is no more."""
    for i in range(BESIDE + 1):
        moments.head[i] = 0.0
    for i in range(moments.score.size):
        moments.score[i] = moments.known[i] = 0.0


@kernel
def kept_at(moments, age, M):
    """Return what was kept ``age`` moments ago, 1 is the last; 0 has room for what is kept now."""
    return moment(moments, (int(moments.head[COUNTED]) // STEP - 1 - age) % MOMENTS, M)


@kernel
def expected(memory, bank, e, R, theta, view):
    """Return the innovation of the filter that never forgets, its T, and sigma^2; e is that of ``theta``."""
    slow = mode(bank, 0, theta.size)
    s2 = own_sigma2(memory, slow.own)
    project(slow.U, view.psi, view.f)
    noise = own_noise(memory, s2, R, view.s2) if memory.learns > 0.0 else R
    return error_of(slow, e, view.psi, theta), predicted_variance(view.f, slow.D, noise), s2


@kernel
def add_up(moments, psi, e, T, s2, share, evidence):
    """Take in an innovation, as far as it is no outlier (``share``), and the log evidence over that of the bank."""
    head, gain = moments.head, share / T
    head[COUNTED] += 1.0
    head[ENERGY] += gain * e * e / s2
    head[AMOUNT] += share
    head[BESIDE] += evidence
    for i in range(psi.size):
        moments.score[i] += gain * psi[i] * e
        moments.known[i] += gain * psi[i] * psi[i]


@kernel
def is_quiet(row):
    """Say whether the filter that never forgets was likelier than the learnt one: else its innovations are no test."""
    return row.weights[0] >= row.weights[row.weights.size - 1]


@kernel
def explained(memory, own, square):
    """Return the log evidence of what lessens the sum of squares behind a filter's sigma^2 by so much.

    Without it sigma^2 is too large, by what it would explain: -freedom/2 log(1 - square/chi2) is what it says then.
    """
    if memory.learns == 0.0 or own[FREEDOM] < 1.0:
        return 0.5 * square
    return -0.5 * own[FREEDOM] * log1p(-min(square / own[CHI2], MOST_EXPLAINED))


@kernel
def narrowed(moments, row, unit, i):
    """Return how many times the variance of a jump of parameter i at a moment has become less since."""
    return 1.0 + LONE * unit[i] * (moments.known[i] - row.known[i])


@kernel
def lessens(moments, row, unit, i):
    """Return by how much a jump of parameter i at a moment lessens the sum of squares since."""
    v = moments.score[i] - row.score[i]
    return v * v * (LONE * unit[i]) / narrowed(moments, row, unit, i)


@kernel
def ratio_of(memory, moments, row, own, unit, i):
    """Return the Bayes factor of a jump of parameter i at a moment against none."""
    wide = narrowed(moments, row, unit, i)
    return exp(min(explained(memory, own, lessens(moments, row, unit, i)), HIGHEST)) / math.sqrt(wide)


@kernel
def ratio_of_walk(memory, moments, own, i):
    """Return the Bayes factor of parameter i having walked since the oldest moment, at the speed learnt before it."""
    so_many, M = count_of_moments(moments), memory.levels.size
    row = kept_at(moments, so_many, M)
    q, v, m = STEP * row.q[i], moments.score[i] - row.score[i], moments.known[i] - row.known[i]
    d = P = square = 0.0
    wide = 1.0
    for k in range(so_many):
        next_v = next_m = 0.0
        if k < so_many - 1:
            row = kept_at(moments, so_many - 1 - k, M)
            next_v, next_m = moments.score[i] - row.score[i], moments.known[i] - row.known[i]
        x, information = v - next_v, m - next_m
        P += q
        more = 1.0 + P * information
        square += (x * x * P + 2.0 * x * d - information * d * d) / more
        d += P * (x - information * d) / more
        P /= more
        wide *= more
        v, m = next_v, next_m
    return exp(min(explained(memory, own, square), HIGHEST)) / math.sqrt(wide)


@kernel
def most_lessened(memory, moments, unit):
    """Return by how much a jump of one parameter at one moment lessens the sum of squares, at most."""
    most = 0.0
    for r in range(count_of_moments(moments)):
        row = moment(moments, r, memory.levels.size)
        for i in range(unit.size):
            most = max(most, lessens(moments, row, unit, i))
    return most


@kernel
def look_back(memory, moments, bank, unit, q, level):
    """Every fourth sample: say whether a jump is to be told; keep the sums, and ``q``, the variances of drift.

    ``level`` are the log odds of another level of the noise against the bank, as a trial has them.
    """
    head, N, M, most = moments.head, unit.size, memory.levels.size, 0.0
    count = int(head[COUNTED])
    if count % STEP != 0:
        return False
    own, so_many = mode(bank, 0, N).own, count_of_moments(moments)
    for r in range(so_many):
        row = moment(moments, r, M)
        if is_quiet(row):
            for i in range(N):
                most = max(most, lessens(moments, row, unit, i))
    if most > WORTH * own_sigma2(memory, own):
        weigh_moments(memory, moments, own, unit)
        if head[ODDS] > 1.0 and head[OVER_DRIFT] > max(level, MOMENT_BY_DRIFT):
            return True
    row = kept_at(moments, 0, M)
    row.head[ROW_ENERGY], row.head[ROW_AMOUNT], row.head[ROW_BESIDE] = head[ENERGY], head[AMOUNT], head[BESIDE]
    for m in range(M):
        row.weights[m] = mode(bank, m, N).own[WEIGHT]
    for i in range(N):
        row.score[i], row.known[i], row.q[i] = moments.score[i], moments.known[i], q[i]
    return False


@rare
def weigh_moments(memory, moments, own, unit):
    """Set the odds of a jump against none and another level of the noise, and against drift."""
    head, N, prior = moments.head, unit.size, RATE * STEP
    none, jump, over_bank, walk = 1.0, 0.0, 0.0, 0.0
    for r in range(count_of_moments(moments)):
        row = moment(moments, r, memory.levels.size)
        if is_quiet(row):
            total = 0.0
            for i in range(N):
                total += ratio_of(memory, moments, row, own, unit, i)
            jump += prior / N * total
            over_bank += prior / N * total * exp(min(head[BESIDE] - row.head[ROW_BESIDE], HIGHEST))
            n, energy = head[AMOUNT] - row.head[ROW_AMOUNT], head[ENERGY] - row.head[ROW_ENERGY]
            if memory.learns > 0.0 and n > 1.0:
                none += prior * level_ratio(n, energy)
    for i in range(N):
        walk += ratio_of_walk(memory, moments, own, i) / N
    head[ODDS], head[OVER_DRIFT] = log(jump / none) / JUMP_ODDS, log(min(over_bank, jump / walk))


@kernel
def level_ratio(n, energy):
    """Return the Bayes factor of another level of the noise: even in its logarithm, up to ten times (Laplace)."""
    louder = 0.5 * (energy - n) - 0.5 * n * log(max(energy / n, 1.0 - MOST_EXPLAINED)) - 1.0
    return exp(min(louder, HIGHEST)) / math.sqrt(n)


@rare
def follow_moment(memory, moments, learner, bank, dense, unit, shift):
    """Let the bank be the filter that never forgets, after the jump.

    Mean and covariance are those of the mixture over moments and parameters. ``shift`` is scratch.
    """
    head, N, M = moments.head, unit.size, memory.levels.size
    one, half, so_many = mode(bank, 0, N), N * (N + 1) // 2, count_of_moments(moments)
    total, best, where, less, s2 = 0.0, 0.0, 0, 0.0, own_sigma2(memory, one.own)
    for r in range(so_many):
        row = moment(moments, r, M)
        if is_quiet(row):
            for i in range(N):
                ratio = ratio_of(memory, moments, row, one.own, unit, i)
                total += ratio
                if ratio > best:
                    best, where = ratio, r
    for i in range(N):
        shift[i] = 0.0
        for r in range(so_many):
            row = moment(moments, r, M)
            if is_quiet(row):
                w = ratio_of(memory, moments, row, one.own, unit, i) / total
                spread = LONE * unit[i] / narrowed(moments, row, unit, i)
                d = spread * (moments.score[i] - row.score[i])
                less += w * lessens(moments, row, unit, i)
                shift[i] += w * d
                dense[at(i, i)] += w * (spread + d * d / s2)
    add_square(dense[:half], -1.0 / s2, shift)
    for i in range(N):
        one.theta[i] += shift[i]
        begin_again(learner, i)
    if memory.learns > 0.0:  # by so much sigma^2 had been too large
        one.own[CHI2] -= min(less, MOST_EXPLAINED * one.own[CHI2])
    hand_over(bank, dense, one, dense[:half])
    row = moment(moments, where, M)
    for m in range(M):
        mode(bank, m, N).own[WEIGHT] = row.weights[m]
    last = int(head[COUNTED]) // STEP - 2
    head[SINCE] = STEP * ((last - where) % MOMENTS + 1.0)
