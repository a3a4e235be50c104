"""Whether plots lead away from straight flight as a manoeuvre does: by this an onset is told.

lead         p/(p + (1 - p)(1 + N/n)), p = sum_j mu_j of the courses j that are manoeuvres (`courses`), under the noise
             of the members that lead: where it was learnt from few plots n, it is wrong in all plots at once
n            one more with each plot, and as much fewer as that makes the variance of the noise larger
odds needed  of the lead; more where plots come fast: one more is soon there, and one second has many that may be wrong

A plot that a publisher drew on the line of those before it says nothing. A position whose stamp is wrong by tau is off
along the way, by tau times the speed; and so is the next, if that is late as well: a course of its own. A turn leads
across the way. Where a plot shows that the noise was far louder than all believed, courses begin anew for some plots.
"""

import math

from ...engine.dispatch import kernel, rare
from ...engine.elementary import exp, log
from . import bank, courses, learning, linear

SOONEST, RESTS = 6.0, 10.0  # plots until something is told, at first; and in which courses rest before they begin anew
ODDS, MOST_ODDS, PATIENCE = 2.3, 5.0, 1.5  # of the lead: an onset; where plots are nearer than so many seconds
OVER_BELOW = 0.3  # of the lead: when another may come
DOUBTED = 15.0  # plots that must have shown the noise until odds are half of what they seem
STEADY = 0.1  # of a log variance by which it may rise at a plot, and be known from as many
LOUDER = 4.0  # of a log variance by which it rises at one plot, where a precise start has ended: no manoeuvre does
LEADING = 1e-6  # weight of all members of which the noise is taken, at least


@kernel
def noise(row, C, c, w):
    """Return the scale of a plot's variance by those that lead: no manoeuvre makes it louder."""
    level, share = 0.0, 0.0
    for i in range(bank.KALMAN):
        level += w[i] * log(row[bank.at_linear(C, i, c) + linear.SCALE])
        share += w[i]
    return exp(level / share) if share > LEADING else 1.0


@kernel
def loudness(row, C, w):
    """Return the log variance of a plot by those that lead, all coordinates together."""
    level = 0.0
    for c in range(C):
        level += row[bank.of_coordinate(C, bank.LOG, c)] + log(noise(row, C, c, w))
    return level


@kernel
def needed(T):
    """Return the lead above which an onset is told, where plots are T seconds apart."""
    odds = min(ODDS * math.sqrt(max(PATIENCE / T, 1.0)), MOST_ODDS)
    return odds / (1.0 + odds)


@kernel
def doubt(row, C, before, w):
    """Let fewer plots have shown noise that rose above what it was ``before``; where all were too sure, begin anew."""
    rise, known = (loudness(row, C, w) - before) / C, bank.row_at(C).known
    row[known] = max(row[known] * exp(min(STEADY - rise, 0.0)), 1.0)
    if rise > LOUDER:
        row[bank.row_at(C).courses + courses.at_share(courses.AHEAD, C)] = 0.0
        row[bank.LEAD] = -RESTS  # and it counts up to 0


@rare
def watch(task, row, C, T, d, y, unit, g, w, exact, room):
    """Follow what the target may do: from the second plot on, and from the plot before where nothing was followed."""
    size = bank.courses_size(C)
    K, E, N = row[bank.row_at(C).courses :], bank.of_coordinate(C, bank.WAY, 0), bank.of_coordinate(C, bank.WAY, C - 1)
    e, r, mixed, parts = room[:C], room[C : 2 * C], room[2 * C : 2 * C + size], room[2 * C + size :]
    held = min(row[bank.LEAD] + 1.0, 0.0)
    is_begun = K[courses.at_share(courses.AHEAD, C)] > 0.0 and held == 0.0
    dE, dN = y[0] - row[bank.of_coordinate(C, bank.LAST, 0)], y[C - 1] - row[bank.of_coordinate(C, bank.LAST, C - 1)]
    if not is_begun:
        far = math.sqrt(dE * dE + dN * dN) if C == 2 else 0.0
        row[N], row[E] = 0.0, 1.0
        if far > 0.0:
            row[E], row[N] = dE / far, dN / far
    e[0] = row[E] * dE
    r[0] = g[0] * unit[0] * noise(row, C, 0, w)
    if C == 2:
        first, second, E2, N2 = r[0], g[1] * unit[1] * noise(row, C, 1, w), row[E] * row[E], row[N] * row[N]
        e[0], e[1] = row[E] * dE + row[N] * dN, row[E] * dN - row[N] * dE
        r[0], r[1] = E2 * first + N2 * second, N2 * first + E2 * second
    row[bank.LEAD] = held
    if not is_begun:
        courses.begin(task, K, C, d, e, r)
        return
    courses.mix(task, K, C, mixed)
    courses.go_on(task, K, mixed, C, d, T, r)
    if learning.is_ruled(C, exact):
        courses.leave_out(parts)
    else:
        courses.weigh(row, mixed, C, e, r, parts)
    courses.correct(K, mixed, C, e, r, parts)
    if row[bank.SEEN] > SOONEST:
        moves = 0.0
        for j in range(courses.MOVES, bank.COURSES):
            moves += K[courses.at_share(j, C)]
        row[bank.LEAD] = moves / (moves + (1.0 - moves) * (1.0 + DOUBTED / row[bank.row_at(C).known]))
    if C == 2:
        courses.turn(row, K, C)
