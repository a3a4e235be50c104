"""One plot: every member predicts it, the mixture of all is the forecast, and the plot says who was right.

    prediction   m = sum w_i mu_i                                  per coordinate, one weight for all coordinates
    base         s = sum w_i (S_i + (mu_i - m)^2)
    density      y ~ sum q_j N(m, kappa_j s): the tails are learnt
    evidence     log w_i <- phi log w_i + eta sum_c log t(y_c; mu_ic, S_ic)     Student-t: a wild plot is no verdict
    noise        of each member and coordinate: c <- c + g (min(e^2/S, 9) - 1) c, above what no plot is
    manoeuvre    P(manoeuvre) of a two-state Markov chain: members that see one against those that see none; no
                 less than the lead in weight of those sure of one (2 standard deviations)

A missing plot changes nothing but the columns: they tell where the target is by then.
"""

import math
from typing import NamedTuple

from ...engine.dispatch import kernel, pass_over
from ...engine.elementary import exp, log, log1p, square
from ...engine.status import MISSING_OUTPUT, NOT_READY, OUTLIER, PROJECTED
from . import bank, circle, linear, output, pole

FREEDOM = 6.0  # of the Student-t by which bank.members are judged
WILD = 9.0  # most that one e^2/S counts for the noise
LEAST_COUNT = 1e-3  # of the tails, of what they start with
YOUNG = 20.0  # plots, memory of the tails at first
LOG_MEAN = 1.27  # -E log z^2, z normal
LEARNT_BY = 12  # plots: the variance of a plot is then left to the noise of each member
PERIODS = 50.0  # plots by which the typical time between plots is known
STARTS, ENDS = 0.02, 0.1  # of a manoeuvre, per plot
GENTLE = 250.0  # s, from rest to the speed of the class: an acceleration that is no manoeuvre
CLAIM = 10.0  # plots that a stated variance is worth
MADDEST = 1e3  # speed, of what is fast for the class, at which nothing is known of a turn
FINEST, COARSEST = 1e-6, 1e6  # a plot's standard deviation, of what is fast for the class between two plots
TOLD_ABOVE, OVER_BELOW = 0.9, 0.5  # of the probability of a manoeuvre: an onset, and when another may come
PRIOR = (0.1, 0.4, 2.0, 0.25, 0.06, 0.02, 0.01, 0.005)  # plots that each scale of the tails is worth beforehand


class Tracking(NamedTuple):
    """The numbers of a tracker of one object."""

    coordinates: float
    fastest: float  # m/s, what is fast for the class
    forgetting: float  # phi
    rate: float  # eta, what the evidence of a plot counts
    doubt: float  # log weight of all but constant velocity at first
    noise: float  # plots by which the noise of a member is known
    tails: float  # plots by which the shape of the density is known
    starts: float  # probability of a manoeuvre to start, per plot
    ends: float
    claim: float  # plots that a measurement's stated variance is worth


@kernel
def enter(task, row, t, y, R, C):
    """Take the first plot; R (C,) its stated variance, NaN is unknown."""
    row[bank.SEEN], row[bank.TIME], row[bank.MANOEUVRE], row[bank.ALERT], row[bank.TRUST] = (
        1.0,
        t,
        task.starts,
        0.0,
        1.0,
    )
    for c in range(C):
        row[bank.of_coordinate(C, bank.FIRST, c)], row[bank.of_coordinate(C, bank.LAST, c)] = y[c], 0.0
        row[bank.of_coordinate(C, bank.SPEED, c)] = 0.0
        row[bank.of_coordinate(C, bank.STATED, c)] = R[c]
        if R[c] > 0.0:
            row[bank.TRUST] = task.claim
    for j in range(bank.TAILS):
        row[bank.row_at(C).tails + j] = PRIOR[j]
    for i in range(bank.members(C)):
        row[bank.row_at(C).weights + i] = 0.0 if i < bank.LINES else task.doubt


@kernel
def least_variance(task, T):
    """Return the variance below which no plot's is taken: exact and repeated plots would let it vanish."""
    return square(FINEST * task.fastest * T)


@kernel
def sane(task, T, R):
    """Return a stated variance, within what plots of the class can have; NaN stays."""
    return min(max(R, least_variance(task, T)), square(COARSEST * task.fastest * T)) if R > 0.0 else R


@kernel
def start_members(task, row, d, C, unit):
    """Start the bank.members on the first plot, now that the time to the second is known."""
    row[bank.PERIOD] = row[bank.GAP] = log(d)
    T = bank.period(row)
    for c in range(C):
        stated = sane(task, T, row[bank.of_coordinate(C, bank.STATED, c)])
        unit[c] = stated if stated > 0.0 else square(0.1 * task.fastest * d)
        row[bank.of_coordinate(C, bank.LOG, c)] = log(unit[c])
    linear.begin(row, C, T, task.fastest, unit)
    for i in range(bank.circles(C)):
        circle.begin(row, C, i, T, task.fastest, unit)


@kernel
def measure_units(task, row, C, T, R, unit, g):
    """Fill the variance of a plot by what is known of it, and g: how much of that this plot has."""
    for c in range(C):
        unit[c] = max(exp(row[bank.of_coordinate(C, bank.LOG, c)]), least_variance(task, T))
        stated = sane(task, T, row[bank.of_coordinate(C, bank.STATED, c)])
        g[c] = sane(task, T, R[c]) / stated if stated > 0.0 and R[c] > 0.0 else 1.0


@kernel
def predict_all(row, C, T, d, unit, F, A, B):
    """Take all that have a state d seconds on."""
    linear.predict_all(row, C, T, d)
    for i in range(bank.circles(C)):
        circle.predict(row, C, i, T, d, unit, F, A, B)


@kernel
def foresee(row, C, T, d, unit, g, mean, S):
    """Fill mean and S (M, C): what each expects of the next plot, relative to the first; NaN is no opinion."""
    k = bank.KALMAN
    for i in range(bank.KALMAN):
        for c in range(C):
            at = bank.at_linear(C, i) + bank.LINEAR * c
            mean[i, c] = row[at]
            S[i, c] = (row[at + linear.P] + g[c]) * unit[c] * row[at + linear.SCALE]
    for i in range(bank.circles(C)):
        for c in range(C):
            at = bank.at_circle(C, i)
            mean[k, c] = row[at + 2 * c]
            S[k, c] = row[at + circle.P + (0 if c == 0 else 9)] + g[c] * unit[c] * row[at + bank.CIRCULAR + c]
        k += 1
    for i in range(bank.POLES):
        n = pole.size(C)
        for c in range(C):
            at, ahead = bank.at_pole(C, i), d / T
            if row[bank.SEEN] < 2.0:
                mean[k, c] = S[k, c] = math.nan
                continue
            nu = g[c] * unit[c] * row[at + n + bank.triangle(n) + c]
            mean[k, c] = (
                row[bank.of_coordinate(C, bank.LAST, c)]
                + d * row[bank.of_coordinate(C, bank.SPEED, c)]
                + ahead * row[at + 2 * c + 1]
            )
            S[k, c] = ahead * ahead * pole.variance(row, C, i, c) + nu
        k += 1


@kernel
def weigh(row, C, mean, w):
    """Fill w: the weight of each member that has an opinion."""
    M, best, total = bank.members(C), -math.inf, 0.0
    for i in range(M):
        if math.isfinite(mean[i, 0]):
            best = max(best, row[bank.row_at(C).weights + i])
    for i in range(M):
        w[i] = exp(row[bank.row_at(C).weights + i] - best) if math.isfinite(mean[i, 0]) else 0.0
        total += w[i]
    for i in range(M):
        w[i] /= total


@kernel
def moves(task, row, C, i, T, unit):
    """Say how a member sees the target: 1 in a manoeuvre, 0 without, -1 if it does not say.

    A manoeuvre is an acceleration beyond what takes a target of the class from rest to its speed in ``GENTLE`` seconds:
    of the state, or, where velocity is under white noise, of what that noise does between two plots.
    """
    least, size2 = task.fastest / GENTLE, 0.0
    if i < bank.LINES:
        for c in range(C):
            r = unit[c] * row[bank.at_linear(C, i) + bank.LINEAR * c + linear.SCALE]
            size2 = max(size2, bank.STRAIGHT[i][1] * r / (T * T * T * T))
        return 1 if i > 0 and size2 > least * least else 0
    if i < bank.KALMAN:
        for c in range(C):
            size2 += square(row[bank.at_linear(C, i) + bank.LINEAR * c + 2])
        return 1 if size2 > least * least else 0
    if i < bank.KALMAN + bank.circles(C):
        at = bank.at_circle(C, i - bank.KALMAN)
        size2 = square(row[at + 4]) * (square(row[at + 1]) + square(row[at + 3]))
        return 1 if size2 > least * least else 0
    return -1


@kernel
def bends(row, C, i, unit):
    """Whether a member's acceleration is beyond twice its standard deviation."""
    if i < bank.LINES:
        return False
    if i < bank.KALMAN:
        size2, variance = 0.0, 0.0
        for c in range(C):
            at = bank.at_linear(C, i) + bank.LINEAR * c
            size2 += square(row[at + 2])
            variance += row[at + linear.P + 5] * unit[c] * row[at + linear.SCALE]
        return size2 > 4.0 * variance
    at = bank.at_circle(C, i - bank.KALMAN)
    return square(row[at + 4]) > 4.0 * row[at + circle.P + circle.index(4, 4)]


@kernel
def judge(task, row, C, T, y, unit, w, mean, S, scores):
    """Give each member the density it had for the plot, and move the probability of a manoeuvre."""
    M, best, top = bank.members(C), -math.inf, -math.inf
    for i in range(M):
        scores[i] = 0.0
        for c in range(C):
            if math.isfinite(mean[i, c]):
                z2 = square(y[c] - mean[i, c]) / S[i, c]
                scores[i] += -0.5 * log(S[i, c]) - 0.5 * (FREEDOM + 1.0) * log1p(z2 / FREEDOM)
        if math.isfinite(mean[i, 0]):
            top = max(top, scores[i])
    tiny = 1e-12
    quiet, still, moving, alive, bent = tiny, tiny, tiny, tiny, tiny
    for i in range(M):
        how = moves(task, row, C, i, T, unit)
        if how == 0:
            quiet += w[i] * exp(scores[i] - top)
            still += w[i]
        elif how == 1:
            moving += w[i] * exp(scores[i] - top)
            alive += w[i]
            bent += w[i] if bends(row, C, i, unit) else 0.0
    so_far = max(row[bank.MANOEUVRE], (2.0 * bent - alive - still) / (alive + still))
    before = so_far * (1.0 - task.ends) + (1.0 - so_far) * task.starts
    moving += tiny * (quiet / still - 1.0)  # where none sees a manoeuvre the plot is no evidence of one
    quiet, moving = (1.0 - before) * quiet / still, before * moving / alive
    row[bank.MANOEUVRE] = moving / (moving + quiet)
    at = bank.row_at(C).weights
    for i in range(M):
        if math.isfinite(mean[i, 0]):
            row[at + i] = task.forgetting * row[at + i] + task.rate * (scores[i] - top)
        else:
            row[at + i] *= task.forgetting
        best = max(best, row[at + i])
    for i in range(M):
        row[at + i] -= best


@kernel
def learn_tails(task, row, C, parts):
    """Share the plot out among the scales that may have made it; say how likely it is wild."""
    fade, wild, first = 1.0 - 1.0 / min(task.tails, YOUNG + row[bank.SEEN]), 0.0, bank.row_at(C).tails
    for j in range(bank.TAILS):
        for _ in range(C):  # the coordinates' order does not matter
            row[first + j] *= fade
    for c in range(C):
        p, far = 0.0, 0.0
        for j in range(bank.TAILS):
            p += parts[c * bank.TAILS + j]
        for j in range(bank.TAILS):
            if p > 0.0:
                part = parts[c * bank.TAILS + j] / p
            else:  # no scale makes it: the widest does
                part = 1.0 if j == bank.TAILS - 1 else 0.0
            far += part if bank.SCALES[j] > 10.0 else 0.0
            row[first + j] += part
        wild = max(wild, far)
    for j in range(bank.TAILS):
        row[first + j] = max(row[first + j], LEAST_COUNT * PRIOR[j])
    return wild


@kernel
def follow(task, row, i, T, mean, S, y, unit, scale, c):
    """Return what the noise scale of member i, coordinate c, becomes."""
    if row[bank.SEEN] < 2.0 or not math.isfinite(mean[i, c]):
        return scale
    z2 = square(y[c] - mean[i, c]) / S[i, c]
    scale *= 1.0 + (min(z2, WILD) - 1.0) * max(1.0 / task.noise, 1.0 / (row[bank.SEEN] + 3.0))
    return max(scale, least_variance(task, T) / unit[c])


@kernel
def learn_noise(row, C, d, y, g, unit):
    """Let the second differences of the first plots say what the variance of a plot is."""
    if row[bank.SEEN] < 2.0 or row[bank.SEEN] > LEARNT_BY:
        return
    for c in range(C):
        v, last = row[bank.of_coordinate(C, bank.SPEED, c)], row[bank.of_coordinate(C, bank.LAST, c)]
        ahead = d / exp(row[bank.GAP])
        e = y[c] - last - d * v
        z = e * e / (1.0 + square(1.0 + ahead) + ahead * ahead) / g[c]
        level, at = log(max(z, 1e-8 * unit[c])) + LOG_MEAN, bank.of_coordinate(C, bank.LOG, c)
        row[at] += (level - row[at]) / (row[bank.SEEN] - 1.0 + row[bank.TRUST])


@kernel
def correct_all(task, row, C, T, d, y, g, unit, mean, S, F, A, B, w):
    """Take the plot into every member; return 1 where a pole was held."""
    for i in range(bank.KALMAN):
        for c in range(C):
            at = bank.at_linear(C, i) + bank.LINEAR * c
            linear.correct(row, at, y[c] - row[at], g[c])
            row[at + linear.SCALE] = follow(task, row, i, T, mean, S, y, unit, row[at + linear.SCALE], c)
    k, held = bank.KALMAN, 0.0
    for i in range(bank.circles(C)):
        for c in range(C):
            scale = bank.at_circle(C, i) + bank.CIRCULAR + c
            circle.correct(row, C, i, c, T, y[c], g[c] * unit[c] * row[scale], A)
            row[scale] = follow(task, row, k, T, mean, S, y, unit, row[scale], c)
        if not circle.speed(row, C, i) < MADDEST * task.fastest:
            circle.start_over(row, C, i, T, unit)  # far beyond where its slopes hold
        k += 1
    for i in range(bank.POLES):
        if row[bank.SEEN] < 2.0:
            pole.begin(row, C, i, unit)
            continue
        n = pole.size(C)
        for c in range(C):
            scale = bank.at_pole(C, i) + n + bank.triangle(n) + c
            ahead = d / T
            w[c] = (
                (y[c] - row[bank.of_coordinate(C, bank.LAST, c)]) / d - row[bank.of_coordinate(C, bank.SPEED, c)]
            ) * T
            pole.measure(row, C, i, c, w[c], g[c] * unit[c] * row[scale] / (ahead * ahead), A)
            row[scale] = follow(task, row, k, T, mean, S, y, unit, row[scale], c)
        held = max(held, pole.step(row, C, i, w, F, A, B))
        k += 1
    return held


@kernel
def note(row, C, t, d, y):
    """Keep what the next step needs of the plot."""
    row[bank.TIME], row[bank.GAP] = t, log(d)
    for c in range(C):
        row[bank.of_coordinate(C, bank.SPEED, c)] = (y[c] - row[bank.of_coordinate(C, bank.LAST, c)]) / d
        row[bank.of_coordinate(C, bank.LAST, c)] = y[c]
    row[bank.SEEN] += 1.0


@kernel
def follow_period(row, C, d):
    """Let the typical time between plots follow; states that are measured in it are rescaled."""
    before = row[bank.PERIOD]
    row[bank.PERIOD] += (log(d) - before) / min(row[bank.SEEN], PERIODS)
    if row[bank.SEEN] >= 2.0:
        factor = exp(row[bank.PERIOD] - before)
        for i in range(bank.POLES):
            pole.rescale(row, C, i, factor)


@kernel
def advance(task, row, t, y, R, out, kept):
    """Take one plot into ``row`` and write what it showed; NaN is no plot. ``kept`` is room."""
    C = int(task.coordinates)
    M, n = bank.members(C), max(3 * C, 5)
    ahead, room = kept[0], kept[1]
    unit, g, z, x = room[:C], room[C : 2 * C], room[2 * C : 3 * C], room[3 * C : 3 * C + n]
    w, scores = kept[2], kept[3, :M]
    parts = kept[3, M : M + C * bank.TAILS]
    mean, S = kept[4 : 4 + M], kept[4 + M : 4 + 2 * M]
    F, A, B = kept[4 + 2 * M :], kept[4 + 2 * M + n :], kept[4 + 2 * M + 2 * n :]
    is_seen = True
    for c in range(C):
        is_seen = is_seen and math.isfinite(y[c])
    if row[bank.SEEN] == 0.0:
        output.blank(task, row, C, t, y, out)
        if is_seen:
            enter(task, row, t, y, R, C)
        else:
            out[bank.sample_at(C).reported + bank.STATUS] = NOT_READY + MISSING_OUTPUT
        return
    d = t - row[bank.TIME]
    for k in range(row.size):
        ahead[k] = row[k]
    if row[bank.SEEN] == 1.0:
        start_members(task, ahead, d, C, unit)
    else:
        follow_period(ahead, C, d)
    T = bank.period(ahead)
    measure_units(task, ahead, C, T, R, unit, g)
    predict_all(ahead, C, T, d, unit, F, A, B)
    foresee(ahead, C, T, d, unit, g, mean, S)
    weigh(ahead, C, mean, w)
    for c in range(C):
        z[c] = y[c] - row[bank.of_coordinate(C, bank.FIRST, c)]
    output.tell(ahead, C, z, w, mean, S, parts, out)
    status, onset = 0.0 if row[bank.SEEN] > 1.0 else float(NOT_READY), 0.0
    if is_seen:
        judge(task, ahead, C, T, z, unit, w, mean, S, scores)
        if row[bank.SEEN] >= 2.0 and learn_tails(task, ahead, C, parts) > 0.5:
            status += OUTLIER
        learn_noise(ahead, C, d, z, g, unit)
        if correct_all(task, ahead, C, T, d, z, g, unit, mean, S, F, A, B, x) > 0.0:
            status += PROJECTED
        if ahead[bank.ALERT] == 0.0 and ahead[bank.MANOEUVRE] > TOLD_ABOVE:
            ahead[bank.ALERT] = onset = 1.0
        elif ahead[bank.MANOEUVRE] < OVER_BELOW:
            ahead[bank.ALERT] = 0.0
        note(ahead, C, t, d, z)
        for k in range(row.size):
            row[k] = ahead[k]
        weigh(ahead, C, mean, w)
    else:
        status += MISSING_OUTPUT
        for c in range(C):
            out[bank.column(C, 1, c)] = out[bank.column(C, 3, c)] = out[bank.column(C, 4, c)] = out[
                bank.column(C, 5, c)
            ] = math.nan
    output.tell_state(ahead, C, T, w, unit, x, A, F, out)
    output.tell_turn(C, out)
    output.tell_pole(ahead, C, w, out)
    out[bank.sample_at(C).reported + bank.MANOEUVRING], out[bank.sample_at(C).reported + bank.ONSET] = (
        ahead[bank.MANOEUVRE],
        onset,
    )
    out[bank.sample_at(C).reported + bank.STATUS] = status


def room(C) -> tuple[int, int]:
    """Return the shape of the room that a step needs."""
    return 4 + 2 * bank.members(C) + 3 * max(3 * C, 5), bank.row_size(C)


@pass_over.on(Tracking)
def pass_over_tracking(task, rows, q, kept, out, numbers):
    """Track over a record: time and position in ``rows``, stated variances in ``q``."""
    for k in range(rows.shape[0]):
        advance(task, numbers, rows[k, 0], rows[k, 1:], q[k], out[k], kept)
