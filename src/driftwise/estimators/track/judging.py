"""What the members of a track expect of a plot, and which of them the plot says were right.

evidence     log w_i <- phi log w_i + eta sum_c log t(y_c; mu_ic, S_ic)     Student-t: a wild plot is no verdict; where
             no manoeuvre lasts from one plot to the next, who is right stays so, and half as much is forgotten
turning      log w_i + b P(turn)    of the member that goes by legs: as long as it holds a turn it has more weight
manoeuvre    P(manoeuvre) of a two-state Markov chain: members that see one against those that see none; no
             less than the lead in weight of those sure of one (2 standard deviations)
"""

import math

from ...engine.dispatch import kernel
from ...engine.elementary import exp, log, log1p, square
from . import bank, circle, learning, legs, linear, pole

FREEDOM = 6.0  # of the Student-t by which members are judged
LOUDER = -10.0  # log probability that all is as expected but the noise, which is as large as it seems
LOUDEST = 3.0  # log density of a plot by which legs are above the best straight flight, at most
TURNED = 1.75  # log weight that legs have more while they hold a turn
GENTLE = 250.0  # s, from rest to the speed of the class: an acceleration that is no manoeuvre
LASTING = 0.5  # of what a plot makes forget, where plots are farther apart than the gentlest manoeuvre is long
LEAST_REST = 1e-9  # weight of all other members
MADDEST = 3.0  # speed, of what is fast for the class, that no member believes


@kernel
def foresee(row, C, T, d, fastest, unit, g, mean, S):
    """Fill mean and S (M, C): what each expects of the next plot, relative to the first; NaN is no opinion."""
    k = bank.KALMAN
    for i in range(bank.KALMAN):
        for c in range(C):
            at = bank.at_linear(C, i, c)
            mean[i, c] = row[at]
            S[i, c] = (row[at + linear.PP] + g[c]) * unit[c] * row[at + linear.SCALE]
    for i in range(bank.circles(C)):
        for c in range(C):
            at = bank.at_circle(C, i)
            mean[k, c] = row[at + 2 * c]
            S[k, c] = row[at + circle.P + (0 if c == 0 else 9)] + g[c] * unit[c] * row[at + bank.CIRCULAR + c]
        k += 1
    if C == 2:
        for c in range(C):
            m, s = legs.expect(row, C, c)
            mean[k, c], S[k, c] = m, s + g[c] * unit[c] * row[bank.at_legs(C) + legs.SCALE + c]
        if legs.are_hidden(row, C, T, unit):
            mean[k, 0] = math.nan
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
        for c in range(C):
            last = row[bank.of_coordinate(C, bank.LAST, c)]
            if not abs(mean[k, c] - last) < MADDEST * fastest * d:
                mean[k, 0] = math.nan  # nothing of the class goes there
        k += 1


@kernel
def weigh(row, C, mean, w):
    """Fill w: the weight of each member that has an opinion."""
    M, best, total = bank.members(C), -math.inf, 0.0
    for i in range(M):
        w[i] = row[bank.row_at(C).weights + i] + (TURNED * legs.turning(row, C) if bank.goes_by_legs(C, i) else 0.0)
        if math.isfinite(mean[i, 0]):
            best = max(best, w[i])
    for i in range(M):
        w[i] = exp(w[i] - best) if math.isfinite(mean[i, 0]) else 0.0
        total += w[i]
    for i in range(M):
        w[i] /= total


@kernel
def set_legs_aside(C, w):
    """Take the weight of the member that goes by legs: some turn explains noise that has jumped, in any place."""
    rest = 0.0
    for i in range(bank.members(C)):
        rest += 0.0 if bank.goes_by_legs(C, i) else w[i]
    if rest > LEAST_REST:
        for i in range(bank.members(C)):
            w[i] = 0.0 if bank.goes_by_legs(C, i) else w[i] / rest


@kernel
def moves(task, row, C, i, T, unit):
    """Say how a member sees the target: 1 in a manoeuvre, 0 without, -1 if it does not say.

    A manoeuvre is an acceleration beyond what takes a target of the class from rest to its speed in ``GENTLE`` seconds:
    of the state, or, where velocity is under white noise, of what that noise does between two plots.
    """
    least, size2 = task.fastest / GENTLE, 0.0
    if i < bank.LINES:
        for c in range(C):
            r = unit[c] * row[bank.at_linear(C, i, c) + linear.SCALE]
            size2 = max(size2, bank.STRAIGHT[i][1] * r / (T * T * T * T))
        return 1 if i > 0 and size2 > least * least else 0
    if i < bank.KALMAN:
        for c in range(C):
            size2 += square(row[bank.at_linear(C, i, c) + linear.A])
        return 1 if size2 > least * least else 0
    if i < bank.KALMAN + bank.circles(C):
        at = bank.at_circle(C, i - bank.KALMAN)
        size2 = square(row[at + 4]) * (square(row[at + 1]) + square(row[at + 3]))
        return 1 if size2 > least * least else 0
    if i < bank.moving(C):
        size2, apart2 = legs.acceleration(row, C, T)
        return 1 if size2 > max(least * least, apart2) else 0  # and likelier on a turn than straight on
    return -1


@kernel
def bends(row, C, i, T, unit):
    """Whether a member's acceleration is beyond twice its standard deviation."""
    if i < bank.LINES:
        return False
    if i < bank.KALMAN:
        size2, variance = 0.0, 0.0
        for c in range(C):
            at = bank.at_linear(C, i, c)
            size2 += square(row[at + linear.A])
            variance += row[at + linear.AA] * unit[c] * row[at + linear.SCALE]
        return size2 > 4.0 * variance
    if bank.goes_by_legs(C, i):
        size2, apart2 = legs.acceleration(row, C, T)
        return size2 > 4.0 * apart2
    at = bank.at_circle(C, i - bank.KALMAN)
    return square(row[at + 4]) > 4.0 * row[at + circle.P + circle.index(4, 4)]


@kernel
def judge(task, row, C, T, y, unit, w, mean, S, exact, scores):
    """Give each member the density it had for the plot, and move the probability of a manoeuvre."""
    M, best, top, straight = bank.members(C), -math.inf, -math.inf, -math.inf
    for i in range(M):
        scores[i] = 0.0
        for c in range(C):
            if math.isfinite(mean[i, c]) and not learning.shows_lattice(row, C, c, exact):
                z2 = square(y[c] - mean[i, c]) / S[i, c]
                freedom = legs.FREEDOM if bank.goes_by_legs(C, i) else FREEDOM
                usual = -0.5 * (freedom + 1.0) * log1p(z2 / freedom)
                if usual < LOUDER:
                    usual = max(usual, LOUDER - 0.5 * log(max(z2, 1.0)))
                scores[i] += usual - 0.5 * log(S[i, c])
        if i < bank.LINES and bank.STRAIGHT[i][0] == 0.0:
            straight = max(straight, scores[i])
        if bank.goes_by_legs(C, i):
            scores[i] = min(scores[i], straight + LOUDEST)
        if math.isfinite(mean[i, 0]):
            top = max(top, scores[i])
    of_all = 0.0
    for i in range(M):  # who had no opinion is believed as much as all others together (Freund et al. 1997)
        of_all += w[i] * exp(scores[i] - top) if math.isfinite(mean[i, 0]) else 0.0
    silent = top + log(max(of_all, 1e-300))
    for i in range(M):
        scores[i] = scores[i] if math.isfinite(mean[i, 0]) else silent
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
            bent += w[i] if bends(row, C, i, T, unit) else 0.0
    so_far = max(row[bank.MANOEUVRE], (2.0 * bent - alive - still) / (alive + still))
    before = so_far * (1.0 - task.ends) + (1.0 - so_far) * task.starts
    moving += tiny * (quiet / still - 1.0)  # where none sees a manoeuvre the plot is no evidence of one
    quiet, moving = (1.0 - before) * quiet / still, before * moving / alive
    row[bank.MANOEUVRE] = moving / (moving + quiet)
    at = bank.row_at(C).weights
    kept = 1.0 - (1.0 - task.forgetting) * (LASTING if T > GENTLE else 1.0)
    for i in range(M):
        row[at + i] = kept * row[at + i] + task.rate * (scores[i] - top)
        best = max(best, row[at + i])
    for i in range(M):
        row[at + i] -= best


@kernel
def density(C, parts):
    """Return the log density of a plot in a forecast."""
    total = 0.0
    for c in range(C):
        p = 0.0
        for j in range(bank.TAILS):
            p += parts[c * bank.TAILS + j]
        total += log(max(p, 1e-300))
    return total
