"""A record that is followed with every member's state kept: what a smoother needs of each of two directions.

What comes from the end is kept as its plots alone have it. A velocity that is forgotten has a prior of its own, which
both directions would count:

    N(x; m, P)/N(v; 0, V)   is   k N(x; m + p v/(V - P_vv), P + p p'/(V - P_vv)),   p the column of v in P
"""

import math
from typing import NamedTuple

from ...engine.dispatch import kernel, pass_over
from ...engine.elementary import log, square
from . import bank, learning, legs, linear, output, step

UNKNOWN = 1e-6  # of the prior variance of a velocity, what plots take from it at least

FIELDS = *step.Tracking.__annotations__.items(), ("ahead", float)
Remembering = NamedTuple("Remembering", FIELDS)  # type: ignore[misc]  # fields that are known at run time
"""The numbers of a tracker, and which states are kept: 0 those after each plot, 1 those before it."""


@kernel
def told(C):
    """Return how many members have a state: all but those with a learnt pole."""
    return bank.moving(C)


@kernel
def each(C):
    """Return the numbers kept of a member: log weight, mean, upper triangle of the covariance."""
    return 1 + 3 * C + bank.triangle(3 * C)


@kernel
def take_out_prior(row, C, i, T, fastest, unit, x, V):
    """Take what member i thinks of velocities beforehand out of x and V; return log k.

    It stays where it is wider than the class of the object. Members that forget no velocity have none of their own: any
    is as likely as what is fastest forgotten expects of the velocity between two plots.
    """
    evidence = 0.0
    for c in range(C):
        r = unit[c] * row[bank.at_linear(C, bank.LINES - 1, c) + linear.SCALE]
        between, prior, p, v = bank.STRAIGHT[-1][1] * r / square(bank.STRAIGHT[-1][0] * T), math.inf, 3 * c, 3 * c + 1
        if i < bank.LINES and bank.STRAIGHT[i][0] > 0.0:
            r = unit[c] * row[bank.at_linear(C, i, c) + linear.SCALE]
            prior = bank.STRAIGHT[i][1] * r / (2.0 * bank.STRAIGHT[i][0] * square(T))
        if not prior < square(fastest):
            evidence += 0.5 * log(between)
            continue
        pv, vv, speed = V[p, v], V[v, v], x[v]
        left = max(prior - vv, UNKNOWN * prior, square(speed))
        evidence += 0.5 * (log(prior) + log(prior / left) + square(speed) / left)
        x[p] += pv / left * speed
        x[v] += vv / left * speed
        V[p, p] += pv / left * pv
        V[p, v] += pv / left * vv
        V[v, v] += vv / left * vv
    return evidence


@kernel
def keep(task, row, C, R, kept, to):
    """Write every member's weight and state into ``to``; weights of -inf where they have not begun, or no opinion."""
    M, n, size = bank.members(C), max(3 * C, 5), each(C)
    for k in range(told(C)):
        to[k * size] = -math.inf
    T = bank.period(row)
    unit, g, x, V = kept[1, :C], kept[1, C : 2 * C], kept[1, 3 * C : 3 * C + n], kept[4 + 2 * M :]
    learning.measure_units(task, row, C, T, R, unit, g)
    output.clear(V, 3 * C)
    for k in range(told(C)):
        if bank.goes_by_legs(C, k) and legs.are_hidden(row, C, T, unit):
            continue
        at = k * size
        to[at] = row[bank.row_at(C).weights + k]
        output.member_state(row, C, k, T, unit, x, V)
        if task.ahead > 0.0:
            to[at] += task.rate * take_out_prior(row, C, k, T, task.fastest, unit, x, V)
        at += 1
        for i in range(3 * C):
            to[at + i] = x[i]
        at += 3 * C
        for i in range(3 * C):
            for j in range(i, 3 * C):
                to[at] = V[i, j]
                at += 1


@pass_over.on(Remembering)
def pass_over_remembering(task, rows, q, kept, out, numbers):
    """Track over a record as `Tracking` does; what is kept of the members stands behind the columns of the trace."""
    C = int(task.coordinates)
    width, nothing = bank.columns(C), kept[kept.shape[0] - 1, :C]
    for k in range(rows.shape[0]):
        told_of, to = out[k, :width], out[k, width:]
        for i in range(to.size):
            to[i] = -math.inf
        if task.ahead > 0.0 and numbers[bank.SEEN] > 0.0:
            for c in range(C):
                nothing[c] = math.nan
            step.advance(task, numbers, rows[k, 0], nothing, q[k], told_of, kept)
            keep(task, kept[0], C, q[k], kept, to)
        step.advance(task, numbers, rows[k, 0], rows[k, 1:], q[k], told_of, kept)
        if task.ahead == 0.0 and numbers[bank.SEEN] > 1.0:  # where the plot is not in the row, the room has it then
            keep(task, numbers if numbers[bank.TIME] == rows[k, 0] else kept[0], C, q[k], kept, to)
