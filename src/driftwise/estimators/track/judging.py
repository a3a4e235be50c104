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
GENTLE = 250.0  # s, from rest to the speed of the class: an acceleration that is no manoeuvre
LOUDEST = 3.0  # log density of a plot by which legs are above the best straight flight, at most
TURNED = 1.75  # log weight that legs have more while they hold a turn
LASTING = 0.5  # of what a plot makes forget, where plots are farther apart than the gentlest manoeuvre is long
LEAST_REST = 1e-9  # weight of all other members
PLAIN = 3  # the member of constant velocity from which a manoeuvre leads away ..
OFTEN = 0.05, 0.3  # .. or one or two that remember longer, where the gentlest moves less than so many deviations a plot
COUNTS = 1.0, 0.8, 0.55  # what those lead away counts: they come back late, too
FRESH = 0.4  # of the mean of its innovations, what the last one counts
FARTHEST = 3.0  # deviations that one counts at most
BEHIND = 3.0  # squares of the time between plots, times the least acceleration of a manoeuvre: it is behind by more
SOONEST = 6.0  # plots
AWAY2, FAR_AWAY2 = 4.0, 16.0  # squared deviations that the plot before was off: where this one is far off, and else
NEARER2 = 0.5  # of that square, what is left of it where a target comes back
HELD = 4.0  # plots after one that came back in which nothing is told
UNSURE, SURE = 5.0, 40.0  # plots that say nothing of the noise to be expected; after which it is no better known
MADDEST = 3.0  # speed, of what is fast for the class, that no member believes


@kernel
def foresee(row, C, T, d, fastest, unit, g, mean, S):
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
            at = bank.at_linear(C, i) + bank.LINEAR * c
            size2 += square(row[at + 2])
            variance += row[at + linear.P + 5] * unit[c] * row[at + linear.SCALE]
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
def watched(task, row, C, c, T, unit, w, S):
    """Return how many members farther than ``PLAIN`` is watched in a coordinate, and its variance as those that lead.

    Who is seen often has hardly moved from plot to plot: a member that remembers few plots turns with him.
    """
    level, share = 0.0, 0.0
    for i in range(bank.KALMAN):
        level += w[i] * log(row[bank.at_linear(C, i) + bank.LINEAR * c + linear.SCALE])
        share += w[i]
    if not share > 1e-6:
        return 0, math.nan
    r = exp(level / share)
    gentlest = task.fastest / GENTLE * T * T / math.sqrt(unit[c] * r)
    quieter = 2 if gentlest < OFTEN[0] else (1 if gentlest < OFTEN[1] else 0)
    i = PLAIN - quieter
    return quieter, S[i, c] * r / row[bank.at_linear(C, i) + bank.LINEAR * c + linear.SCALE]


@kernel
def comes_back(task, row, C, T, d, y, unit, w, mean, S):
    """Say whether a plot agrees with no manoeuvre: the one before was far off, and farther or to the other side.

    A target that is led away goes farther from plot to plot, to the same side. What a position repeated, a late stamp
    or a wild plot leads away comes back, and takes the member that followed it to the other side.
    """
    now2, before2, both = 0.0, 0.0, 0.0
    for c in range(C):
        quieter, s = watched(task, row, C, c, T, unit, w, S)
        if s > 0.0:
            i = PLAIN - quieter
            at = bank.at_linear(C, i) + bank.LINEAR * c
            e = y[c] - mean[i, c]
            left = row[bank.of_coordinate(C, bank.LAST, c)] - (row[at] - d * row[at + 1])
            last = left * S[i, c] / (unit[c] * row[at + linear.SCALE])  # the innovation of which the gain left that
            now2 += e * e / s
            before2 += last * last / s
            both += e * last / s
    return before2 > (AWAY2 if now2 > square(FARTHEST) else FAR_AWAY2) and (both < 0.0 or now2 < NEARER2 * before2)


@kernel
def watch(task, row, C, T, d, y, unit, w, mean, S):
    """Follow by how many deviations plots lead away from straight flight: a fading mean of one member's innovations.

    The deviation is that of the member under the noise of those that lead: its own grows while it is left behind. That
    noise is known by the plots so far: chi-squared is that of a Student-t of as many degrees of freedom. After a plot
    that comes back, unless a manoeuvre has been told, some count little and tell nothing: the lead counts up to zero.
    """
    lead, size2, least = 0.0, 0.0, task.fastest / GENTLE
    known = min(max(row[bank.SEEN] - UNSURE, 1.0), SURE)
    if row[bank.ALERT] == 0.0 and comes_back(task, row, C, T, d, y, unit, w, mean, S):
        row[bank.LEAD] = -HELD
        for c in range(C):
            row[bank.of_coordinate(C, bank.DRIFT, c)] = 0.0
    is_held = row[bank.LEAD] < 0.0
    most = 1.0 if is_held else FARTHEST
    for c in range(C):
        quieter, s = watched(task, row, C, c, T, unit, w, S)
        if s > 0.0:
            e = y[c] - mean[PLAIN - quieter, c]
            at = bank.of_coordinate(C, bank.DRIFT, c)
            row[at] += FRESH * (min(max(e / math.sqrt(s), -most), most) - row[at])
            lead += COUNTS[quieter] * known * log1p(square(row[at]) * (2.0 - FRESH) / FRESH / known)
            size2 += square(row[at]) * max(s, square(e / FARTHEST))
    is_far = size2 > square(BEHIND * least * T * T) and row[bank.SEEN] > SOONEST
    row[bank.LEAD] = row[bank.LEAD] + 1.0 if is_held else (lead if is_far else 0.0)


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
