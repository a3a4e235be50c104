"""Whether plots lead away from straight flight as a manoeuvre does: by this an onset is told.

watched      z = (y - mu)/sqrt(s) of one member of constant velocity, under the noise of those that lead
mean         m_i <- m_i + f_i (z_i - m_i)    i: along the way, and across it
lead         sum_i n log(1 + m_i^2 (2 - f_i)/f_i/n)    chi-squared under noise that n plots have shown: a Student-t's

A position whose stamp is wrong by tau is off along the way, by tau times the speed; and so is the next, if that is late
as well. A turn leads across the way. So along it a plot counts less, and what is off takes more plots to be told.
"""

import math

from ...engine.dispatch import kernel
from ...engine.elementary import exp, log, log1p, square
from . import bank, judging, linear

PLAIN = 3  # the member of constant velocity from which a manoeuvre leads away ..
OFTEN = 0.05, 0.3  # .. or one or two that remember longer, where the gentlest moves less than so many deviations a plot
COUNTS = 1.0, 0.8, 0.55  # what those lead away counts: they come back late, too
FRESH = 0.25, 0.35  # of the mean of its innovations along the way and across it: what the last one counts
ALONG, FARTHEST = 2.25, 3.5  # deviations that one counts at most: along the way until an onset is told, and else
BEHIND = 3.0  # squares of the time between plots, times the least acceleration of a manoeuvre: it is behind by more
SOONEST = 6.0  # plots
AWAY2 = 12.0  # squared deviations that the plot before was off, at least, where a target comes back
NEARER2 = 0.5  # of that square, what is left of it then
HELD = 3.0  # plots, with one that came back, in which nothing is told
UNSURE, SURE = 5.0, 40.0  # plots that say nothing of the noise to be expected; after which it is no better known
TOLD_ABOVE, OVER_BELOW = 10.0, 5.0  # of the lead: an onset, and when another may come


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
    gentlest = task.fastest / judging.GENTLE * T * T / math.sqrt(unit[c] * r)
    quieter = 2 if gentlest < OFTEN[0] else (1 if gentlest < OFTEN[1] else 0)
    i = PLAIN - quieter
    return quieter, S[i, c] * r / row[bank.at_linear(C, i) + bank.LINEAR * c + linear.SCALE]


@kernel
def compare(task, row, C, T, d, y, unit, w, mean, S, s, z, before, way):
    """Fill how far a plot and the one before are off, in deviations, and which way the target goes, of length 1.

    ``s`` is their variance. All are 0 where nothing is watched. Return what the members that are count.
    """
    v2, counts = 0.0, 0.0
    for c in range(C):
        quieter, variance = watched(task, row, C, c, T, unit, w, S)
        s[c] = z[c] = before[c] = way[c] = 0.0
        if variance > 0.0:
            i = PLAIN - quieter
            at, sd = bank.at_linear(C, i) + bank.LINEAR * c, math.sqrt(variance)
            left = row[bank.of_coordinate(C, bank.LAST, c)] - (row[at] - d * row[at + 1])
            last = left * S[i, c] / (unit[c] * row[at + linear.SCALE])  # the innovation of which the gain left that
            s[c], z[c], before[c], way[c] = variance, (y[c] - mean[i, c]) / sd, last / sd, row[at + 1] / sd
            v2 += square(way[c])
            counts += COUNTS[quieter] / C
    for c in range(C):
        way[c] = way[c] / math.sqrt(v2) if v2 > 0.0 else (1.0 if c == 0 else 0.0)
    return counts


@kernel
def dot(C, a, b):
    """Return the inner product of two vectors of C numbers."""
    total = 0.0
    for c in range(C):
        total += a[c] * b[c]
    return total


@kernel
def comes_back(C, z, before):
    """Say whether a plot agrees with no manoeuvre: the one before was far off, and this is nearer or to the other side.

    A target that is led away goes farther from plot to plot, to the same side. What a position repeated, a late stamp
    or a wild plot leads away comes back, and takes the member that followed it to the other side.
    """
    now2, before2 = dot(C, z, z), dot(C, before, before)
    return before2 > AWAY2 and (now2 < NEARER2 * before2 or dot(C, z, before) < 0.0)


@kernel
def watch(task, row, C, T, d, y, unit, w, mean, S, room):
    """Follow by how many deviations plots lead away from straight flight: a fading mean of one member's innovations.

    The deviation is that of the member under the noise of those that lead: its own grows while it is left behind. After
    a plot that comes back, unless a manoeuvre has been told, some count little and tell nothing: the lead counts up to
    zero.
    """
    s, z, before, way = room[:C], room[C : 2 * C], room[2 * C : 3 * C], room[3 * C : 4 * C]
    counts = compare(task, row, C, T, d, y, unit, w, mean, S, s, z, before, way)
    is_told = row[bank.ALERT] > 0.0
    if not is_told and comes_back(C, z, before):
        row[bank.LEAD] = -HELD
        for c in range(C):
            row[bank.of_coordinate(C, bank.DRIFT, c)] = 0.0
    is_held = row[bank.LEAD] < 0.0
    lead, size2, known = 0.0, 0.0, min(max(row[bank.SEEN] - UNSURE, 1.0), SURE)
    for c in range(C):  # along the way, then across it
        off, variance = dot(C, z, way) if c == 0 else z[1] * way[0] - z[0] * way[1], 0.0
        for k in range(C):
            variance += square(way[k if c == 0 else 1 - k]) * s[k]
        most = 1.0 if is_held else (FARTHEST if c > 0 or is_told else ALONG)
        at = bank.of_coordinate(C, bank.DRIFT, c)
        row[at] += FRESH[c] * (min(max(off, -most), most) - row[at])
        lead += counts * known * log1p(square(row[at]) * (2.0 - FRESH[c]) / FRESH[c] / known)
        size2 += square(row[at]) * variance * max(1.0, square(off / FARTHEST))
    is_far = size2 > square(BEHIND * task.fastest / judging.GENTLE * T * T) and row[bank.SEEN] > SOONEST
    row[bank.LEAD] = row[bank.LEAD] + 1.0 if is_held else (lead if is_far else 0.0)
