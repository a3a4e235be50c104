"""One plot: every member predicts it, the mixture of all is the forecast, and the plot says who was right.

    prediction   m = sum w_i mu_i                                  per coordinate, one weight for all coordinates
    base         s = sum w_i (S_i + (mu_i - m)^2)
    density      y ~ (1 - w) sum q_j N(m, kappa_j s) + w N(m, s + v): the tails are learnt, w and v are `unforeseen`
    outlier      waits for the next plot: until then there are two banks, one that used it, and a blend is told
    lost         two plots in a row that were refused, and the next: they lie on a path of their own, or all are wild

What members expect and who was right stands in `judging`, what is learnt of noise and tails in `learning`.
A missing plot changes nothing but the columns: they tell where the target is by then.
"""

import math
from typing import NamedTuple

from ...engine.dispatch import kernel, pass_over
from ...engine.elementary import log, square
from ...engine.status import MISSING_OUTPUT, NOT_READY, OUTLIER, PROJECTED
from . import bank, circle, departure, judging, learning, legs, linear, onset, output, pole, unforeseen

SUREST = 0.98  # of a plot that waits: how likely it is wild, at most, and how likely true
MADE = 0.03  # by what it is less likely that a manoeuvre took an object farther off than its class goes in the time
EARLIEST = 2.0  # plots before any is suspected
LOST = 0.05  # of plots that were refused: that the object went there, from wherever the class can be by then
ANY = 1e-3  # a plot in thirty is wild, of any size, all alike in logarithms: what that has of the density
STARTS, ENDS = 0.02, 0.1  # of a manoeuvre, per plot
CLAIM = 10.0  # plots that a stated variance is worth


class Tracking(NamedTuple):
    """The numbers of a tracker of one object."""

    coordinates: float
    fastest: float  # m/s, what is fast for the class
    forgetting: float  # phi
    rate: float  # eta, what the evidence of a plot counts
    doubt: float  # log weight at first of all that curve
    noise: float  # plots by which the noise of a member is known
    tails: float  # plots by which the shape of the density is known
    starts: float  # probability of a manoeuvre to start, per plot
    ends: float
    claim: float  # plots that a measurement's stated variance is worth


@kernel
def predict_all(row, C, T, d, unit, F, A, B):
    """Take all that have a state d seconds on."""
    linear.predict_all(row, C, T, d)
    for i in range(bank.circles(C)):
        circle.predict(row, C, i, T, d, unit, F, A, B)
    if C == 2:
        legs.predict(row, C, T, d, unit, A[0])


@kernel
def correct_all(task, row, C, T, d, y, g, unit, mean, S, exact, A, B, w, share, least):
    """Take the plot into every member; return 1 where a pole was held."""
    for c in range(C):
        g[c] *= learning.repeated(row, C, c, y)
    calm = learning.was_calm(row, C, y)
    learning.prepare_to_follow(task, row, C, T, unit, exact, share, least)
    for i in range(bank.KALMAN):
        for c in range(C):
            at = bank.at_linear(C, i, c)
            linear.correct(row, at, i, y[c] - row[at], g[c])
            before = row[at + linear.SCALE]
            row[at + linear.SCALE] = learning.follow(row, C, i, y, mean, S, calm, share, least, before, c)
    k, held = bank.KALMAN, 0.0
    for i in range(bank.circles(C)):
        for c in range(C):
            scale = bank.at_circle(C, i) + bank.CIRCULAR + c
            circle.correct(row, C, i, c, T, y[c], g[c] * unit[c] * row[scale], A)
            row[scale] = learning.follow(row, C, k, y, mean, S, calm, share, least, row[scale], c)
        if d > circle.LOST * T or not circle.speed(row, C, i) < judging.MADDEST * task.fastest:
            circle.start_over(row, C, i, T, unit)  # where its slopes do not hold, and differences cancel
        k += 1
    if C == 2:
        legs.correct(row, C, y, g, unit, w, A[0])
        for c in range(C):
            scale = bank.at_legs(C) + legs.SCALE + c
            row[scale] = learning.follow_legs(row, C, w, calm, share, least, row[scale], c)
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
            row[scale] = learning.follow(row, C, k, y, mean, S, calm, share, least, row[scale], c)
        held = max(held, pole.step(row, C, i, w, A, B))
        k += 1
    return held


@kernel
def foretell(task, row, C, d, R, unit, g, mean, S, F, A, B, w, told):
    """Take a row d seconds on, fill what is expected of a plot, and return the typical time between plots."""
    if row[bank.SEEN] == 1.0:
        learning.start_members(task, row, d, C, unit)
    else:
        learning.follow_period(row, C, d)
    T = bank.period(row)
    learning.measure_units(task, row, C, T, R, unit, g)
    predict_all(row, C, T, d, unit, F, A, B)
    judging.foresee(row, C, T, d, task.fastest, unit, g, mean, S)
    judging.weigh(row, C, mean, w)
    output.expect(C, w, mean, S, told)
    for c in range(C):
        told[2 * C + 1 + c] = unforeseen.variance(task, row, C, d, c)
    told[3 * C + 1] = unforeseen.share(task, row, C, d)
    return T


@kernel
def absorb(task, row, C, T, d, y, unit, g, mean, S, A, B, w, told, parts, scores, room, leaves):
    """Let a row that is at the time of a plot learn from it; return the status of one where a pole was held.

    ``leaves``: as the plot of what was at rest.
    """
    n = pole.size(C)
    x, off, exact, share, least = (
        room[:n],
        room[n : n + C],
        room[n + C : n + 2 * C],
        room[n + 2 * C :],
        room[n + 3 * C :],
    )
    learning.compare_steps(row, C, d, y, off, exact)
    onset.watch(task, row, C, T, d, y, unit, g, w, exact, room[n + 4 * C :])
    before = onset.loudness(row, C, w)
    if row[bank.SEEN] >= 2.0 and not leaves:
        learning.learn_tails(task, row, C, exact, parts)
    if leaves:
        departure.leave(task, row, C, T, d, unit)
        judging.foresee(row, C, T, d, task.fastest, unit, g, mean, S)
        output.expect(C, w, mean, S, told)
    judging.judge(task, row, C, T, y, unit, w, mean, S, exact, scores)
    learning.learn_noise(row, C, d, y, g, unit, exact)
    held = correct_all(task, row, C, T, d, y, g, unit, mean, S, exact, A, B, x, share, least)
    onset.doubt(row, C, before, w)
    judging.set_legs_aside(C, w)
    output.expect(C, w, mean, S, told)
    learning.note(row, C, d, y, told, off, exact)
    return PROJECTED if held > 0.0 else 0.0


@kernel
def suspect(task, row, C, d, y, R, told, parts, off, exact):
    """Keep a plot that may be wild until the next one says whether it is; say whether this one may.

    The first that leaves a cell whose size nobody knows is none: how far it goes says nothing. What is farther off than
    the class goes in the time was hardly a manoeuvre, unless such plots have been true before.
    """
    row[bank.SUSPECTED] = 0.0
    if row[bank.SEEN] < EARLIEST or not learning.outlying(C, parts) > 0.5:
        return False
    learning.compare_steps(row, C, d, y, off, exact)
    for c in range(C):
        if learning.shows_lattice(row, C, c, exact):
            return False
    doubt, off2, left = 0.0, 0.0, departure.likelihood(task, row, C, d, y, parts)
    for c in range(C):
        off2 += square(y[c] - told[c])
    possible = 1.0 if off2 <= square(task.fastest * d) else MADE
    for c in range(C):
        far, wild = left, parts[c * bank.TAILS + bank.WILD]
        for j in range(bank.WILD):
            far += possible * parts[c * bank.TAILS + j] if bank.SCALES[j] > 10.0 else 0.0
        part = wild / (wild + far) if far > 0.0 else 1.0
        doubt = max(doubt, part)
    row[bank.SUSPECTED], row[bank.DOUBT] = d, min(max(doubt, 1.0 - SUREST), SUREST)
    for c in range(C):
        row[bank.of_coordinate(C, bank.SUSPECT, c)], row[bank.of_coordinate(C, bank.CLAIMED, c)] = y[c], R[c]
    return True


@kernel
def drop_suspect(task, row, C):
    """Call the plot that waits wild."""
    row[bank.REFUSED], row[bank.SUSPECTED] = row[bank.SUSPECTED], 0.0
    for c in range(C):
        row[bank.of_coordinate(C, bank.ASIDE, c)] = row[bank.of_coordinate(C, bank.SUSPECT, c)]
    learning.fade_tails(task, row, C, C)
    row[bank.row_at(C).tails + bank.WILD] += C


@kernel
def recall(row, C, is_last, y, R):
    """Fill place and variance of a plot that was refused, the one that waits or the one before; return when it came."""
    for c in range(C):
        y[c] = row[bank.of_coordinate(C, bank.SUSPECT if is_last else bank.ASIDE, c)]
        R[c] = row[bank.of_coordinate(C, bank.CLAIMED, c)] if is_last else math.nan
    return row[bank.SUSPECTED] if is_last else row[bank.REFUSED]


@kernel
def as_wild(C, y, told, parts):
    """Return the log density of a plot that is as expected or wild, by any size."""
    off2 = 0.0
    for c in range(C):
        off2 += square(y[c] - told[c]) + told[C + c]
    return max(judging.density(C, parts), log(ANY) - 0.5 * C * log(off2))


@kernel
def doubt_both(task, row, C, ahead, y, R, unit, g, mean, S, F, A, B, w, told, parts, out):
    """Return the log density of two plots that were refused if the object goes on as before."""
    total = 0.0
    for k in range(2):
        copy(row, ahead)
        foretell(task, ahead, C, recall(row, C, k == 1, y, R), R, unit, g, mean, S, F, A, B, w, told)
        output.tell(ahead, C, y, w, told, parts, out)
        total += as_wild(C, y, told, parts)
    return total


@kernel
def follow_both(task, row, C, y, R, unit, g, mean, S, F, A, B, w, told, parts, out, scores, room):
    """Take a row along two plots that were refused; return their log density if the object went there.

    By the first it has any velocity of the class, as after a departure, and is anywhere that this takes it.
    """
    second, first = row[bank.SUSPECTED], recall(row, C, False, y, R)
    T = foretell(task, row, C, first, R, unit, g, mean, S, F, A, B, w, told)
    absorb(task, row, C, T, first, y, unit, g, mean, S, A, B, w, told, parts, scores, room, True)
    d = recall(row, C, True, y, R) - first
    T = foretell(task, row, C, d, R, unit, g, mean, S, F, A, B, w, told)
    output.tell(row, C, y, w, told, parts, out)
    total = judging.density(C, parts) - C * log(2.0 * task.fastest * first)
    absorb(task, row, C, T, second - first, y, unit, g, mean, S, A, B, w, told, parts, scores, room, False)
    row[bank.REFUSED] = row[bank.SUSPECTED] = 0.0
    return total


@kernel
def advance(task, row, t, y, R, out, kept):
    """Take one plot into ``row`` and write what it showed; NaN is no plot. ``kept`` is room.

    Where the plot is not in ``row``, because it waits or there is none, ``kept[0]`` has the target at its time.
    """
    C = int(task.coordinates)
    M, n = bank.members(C), max(3 * C, 5)
    ahead, room, other, spare = kept[0], kept[1], kept[4], kept[5]
    unit, g, z, x = room[:C], room[C : 2 * C], room[2 * C : 3 * C], room[3 * C : 3 * C + n]
    was, stated, told, rival, learnt = room[20:22], room[22:24], room[24:32], room[32:40], room[40:]
    w, scores = kept[2], kept[3, :M]
    parts = kept[3, M : M + C * bank.TAILS]
    mean, S = kept[6 : 6 + M], kept[6 + M : 6 + 2 * M]
    F, A, B = kept[6 + 2 * M :], kept[6 + 2 * M + n :], kept[6 + 2 * M + 2 * n :]
    lost = kept[6 + 2 * M + 3 * n]
    reported = bank.sample_at(C).reported
    is_seen = True
    for c in range(C):
        is_seen = is_seen and math.isfinite(y[c])
    if row[bank.SEEN] == 0.0:
        output.blank(task, row, C, t, y, out)
        if is_seen:
            learning.enter(task, row, t, y, R, C)
        else:
            out[reported + bank.STATUS] = NOT_READY + MISSING_OUTPUT
        return
    for c in range(C):
        z[c] = y[c] - row[bank.of_coordinate(C, bank.FIRST, c)]
    status, begins, d = 0.0 if row[bank.SEEN] > 1.0 else float(NOT_READY), 0.0, t - row[bank.TIME]
    waiting, is_true, waits = row[bank.SUSPECTED] > 0.0, False, False
    T = bank.period(row)
    if waiting:  # as if the plot that waits were true, and what the less likely of the two expects
        doubt = row[bank.DOUBT]
        is_true = doubt <= 0.5
        copy(row, other)
        other[bank.SUSPECTED] = 0.0
        for c in range(C):
            was[c] = row[bank.of_coordinate(C, bank.SUSPECT, c)]
            stated[c] = row[bank.of_coordinate(C, bank.CLAIMED, c)]
        d = row[bank.SUSPECTED]
        T = foretell(task, other, C, d, stated, unit, g, mean, S, F, A, B, w, told)
        output.tell(other, C, was, w, told, parts, spare)
        leaves = departure.likelihood(task, other, C, d, was, parts) > 0.0
        absorb(task, other, C, T, d, was, unit, g, mean, S, A, B, w, told, parts, scores, learnt, leaves)
        copy(row if is_true else other, ahead)
        foretell(task, ahead, C, t - ahead[bank.TIME], R, unit, g, mean, S, F, A, B, w, rival)
        output.tell(ahead, C, z, w, rival, parts, spare)
        unlikely = judging.density(C, parts) + log(min(doubt, 1.0 - doubt)) if is_seen else -math.inf
        copy(other if is_true else row, ahead)
        T = foretell(task, ahead, C, t - ahead[bank.TIME], R, unit, g, mean, S, F, A, B, w, told)
        output.tell(ahead, C, z, w, told, parts, out)
        likely = judging.density(C, parts) + log(max(doubt, 1.0 - doubt)) if is_seen else 0.0
        output.blend(C, min(doubt, 1.0 - doubt), rival, told)
        output.tell(ahead, C, z, w, told, parts, out)
        if is_seen:
            is_true, is_lost = is_true if likely >= unlikely else not is_true, row[bank.REFUSED] > 0.0
            if is_lost:
                wild = max(max(likely, unlikely) - log(doubt), as_wild(C, z, told, parts))
                wild += doubt_both(task, row, C, ahead, was, stated, unit, g, mean, S, F, A, B, w, told, parts, spare)
                copy(row, lost)
                path = log(LOST) + follow_both(
                    task, lost, C, was, stated, unit, g, mean, S, F, A, B, w, told, parts, spare, scores, learnt
                )
                copy(lost, ahead)
                foretell(task, ahead, C, t - ahead[bank.TIME], R, unit, g, mean, S, F, A, B, w, told)
                output.tell(ahead, C, z, w, told, parts, spare)
                is_lost = path + judging.density(C, parts) > wild
            if is_lost:
                is_true = True
                copy(lost, row)
            elif is_true:
                copy(other, row)
            else:
                drop_suspect(task, row, C)
        d = t - row[bank.TIME]
    if is_seen or not waiting:
        copy(row, other)  # what it stays without this plot
        T = foretell(task, row, C, d, R, unit, g, mean, S, F, A, B, w, told)
        output.tell(row, C, z, w, told, parts, spare if waiting else out)
    if is_seen:
        waits = not is_true and suspect(task, other, C, d, z, R, told, parts, was, stated)
        if waits:
            status += OUTLIER if other[bank.DOUBT] > 0.5 else 0.0  # likelier wild than not
            output.tell_state(task, row, C, T, w, unit, x, A, F, spare)
        leaves = waits and departure.likelihood(task, row, C, d, z, parts) > 0.0
        status += absorb(task, row, C, T, d, z, unit, g, mean, S, A, B, w, told, parts, scores, learnt, leaves)
        judging.weigh(row, C, mean, w)
        if not waits:
            row[bank.TIME], row[bank.REFUSED] = t, 0.0
            if row[bank.ALERT] == 0.0 and row[bank.LEAD] > onset.needed(bank.period(row)):
                row[bank.ALERT] = begins = 1.0
            elif row[bank.LEAD] < onset.OVER_BELOW:
                row[bank.ALERT] = 0.0
    else:
        status += MISSING_OUTPUT
        for c in range(C):
            out[bank.column(C, 1, c)] = out[bank.column(C, 3, c)] = out[bank.column(C, 4, c)] = out[
                bank.column(C, 5, c)
            ] = math.nan
    if waits or not (is_seen or waiting):
        copy(row, ahead)
        copy(other, row)
    now = ahead if waits or not is_seen else row
    output.tell_state(task, now, C, T, w, unit, x, A, F, out)
    if waits:
        output.blend_state(C, row[bank.DOUBT], spare, out)
    if is_seen:
        output.allow_for_error(row, C, g, out)
    output.tell_place(row, C, out)
    output.tell_turn(C, out)
    output.tell_pole(now, C, w, out)
    out[reported + bank.MANOEUVRING], out[reported + bank.ONSET] = now[bank.MANOEUVRE], begins
    out[reported + bank.STATUS] = status


@kernel
def copy(row, other):
    """Copy a row."""
    for k in range(row.size):
        other[k] = row[k]


def room(C) -> tuple[int, int]:
    """Return the shape of the room that a step needs."""
    return 7 + 2 * bank.members(C) + 3 * max(3 * C, 5), bank.row_size(C)


@pass_over.on(Tracking)
def pass_over_tracking(task, rows, q, kept, out, numbers):
    """Track over a record: time and position in ``rows``, stated variances in ``q``."""
    for k in range(rows.shape[0]):
        advance(task, numbers, rows[k, 0], rows[k, 1:], q[k], out[k], kept)
