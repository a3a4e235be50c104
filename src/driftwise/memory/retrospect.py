"""Has something jumped in the last rows? A smoother over rows that are kept says so; it is told, and moves nothing.

A trial knows one moment, the bank follows a small jump as well as who knows of it, and then nobody tells. So the last
rows are kept, and the filter that never forgets and the learnt one as they were before them. From there on each goes
over the rows as if nothing had happened; then r and M, backwards, are score and information of a jump before a row:

    r <- (I - psi K') Phi r + psi e/T,    M <- (I - psi K') Phi M Phi (I - K psi') + psi psi'/T

Summed up are moments, one parameter or all, and both filters by what they say of the rows; against a jump stand none,
and another level of the noise. Source: de Jong and Penzer (1998), "Diagnosing shocks in time series", J. American
Statistical Association 93, 796-806, with a prior in place of a maximum, and sigma^2 unknown.
"""

import math

from ..engine.dense import add_square, at, dot, multiply, solve
from ..engine.dispatch import kernel, rare
from ..engine.elementary import exp, lgamma, log, log1p
from ..engine.layout import Field, Layout, each, numbers
from .auto_constants import (
    ALL_JUMP,
    ANEW,
    FAST_SAYS,
    KEPT_FILTERS,
    KEPT_ROWS,
    LATE,
    LATE_GOES_ON,
    LATE_TRIAL,
    LATE_WORTH,
    LEVELS,
    LOOK,
    OF_JUMPS,
    RATE,
    RECENT,
    STEP,
)
from .modes import CHI2, FREEDOM, WEIGHT, mode, own_sigma2
from .moments import most_lessened
from .sensitivity import pass_time, stays
from .verdict import jump_on_trial

COUNTED, ELAPSED, FOUND, ODDS, SINCE, AGO = range(6)  # of the head
HIGHEST = 300.0  # log evidence, at most: sums of exponentials must not overflow
MOST_EXPLAINED = 0.99  # share of the sum of squares: numbers that are almost without noise say no more

FILTERS = Layout(
    *each("2", weight="its probability", freedom="samples behind its sigma^2", chi2="sum of e^2/T over them"),
    Field("theta", ("2", "N"), "of the filter that never forgets, and of the learnt one"),
    Field("P", ("2", "N * (N + 1) // 2"), "packed"),
    Field("q", ("N",), "the learnt variances of drift"),
    given=("N",),
)
open_filters, filters_size = kernel(FILTERS.open), kernel(FILTERS.size)

RETROSPECT = Layout(
    *numbers(
        "head",
        counted="rows since all was forgotten",
        elapsed="samples since the last row",
        found="whether a jump is told now",
        odds="its log odds, or those of a look that told none; far below where none was taken",
        since="samples since its likeliest moment",
        ago="samples since one was last told, this one included; 0: long ago",
    ),
    *each(
        "kept * KEPT_ROWS",
        y="what each row says",
        share="1, or 0: it is an outlier",
        steps="samples since the row before",
    ),
    Field("psi", ("kept * KEPT_ROWS", "N"), "its regressors; the next takes the place of the oldest"),
    Field("sets", ("kept * KEPT_FILTERS * filters_size(N)",), "filters as they were, some rows apart"),
    given=("N", "kept"),
    KEPT_ROWS=KEPT_ROWS,
    KEPT_FILTERS=KEPT_FILTERS,
    filters_size=filters_size,
)
open_retrospect, retrospect_size = kernel(RETROSPECT.open), kernel(RETROSPECT.size)

WORK = Layout(  # scratch, where the first samples' rows stood; it has room there, whatever N is
    Field("theta", ("KEPT_ROWS // LOOK", "N"), "before each eighth row"),
    Field("P", ("KEPT_ROWS // LOOK", "N * (N + 1) // 2"), "packed"),
    *each("LOOK", z="e/T", precision="1/T"),
    Field("gain", ("LOOK", "N"), "P psi/T"),
    given=("N",),
    KEPT_ROWS=KEPT_ROWS,
    LOOK=LOOK,
)
open_work = kernel(WORK.open)


@kernel
def forget_rows(late):
    """Begin again: the filters are others, or what happened in these rows is told."""
    late.head[COUNTED] = late.head[ELAPSED] = 0.0


@kernel
def wait_on(late):
    """Let a sample pass, seen or not."""
    head = late.head
    head[FOUND] = 0.0
    head[ELAPSED] += 1.0
    if head[AGO] > 0.0:
        head[AGO] = head[AGO] + 1.0 if head[AGO] < 2.0 * KEPT_ROWS else 0.0


@kernel
def is_known(late, since):
    """Say whether a jump that began ``since`` samples ago is one that was told late: it began before that."""
    return late.head[AGO] > 0.0 and since + STEP > late.head[AGO]


@kernel
def keep_row(late, psi, y, weight, share):
    """Keep a row, in place of the oldest; one in doubt is made as much smaller as its noise is louder.

    ``share`` is the probability that it is no outlier; whatever else happened makes it look like one a little, and
    evidence that is counted in part is lost.
    """
    head, root = late.head, math.sqrt(weight)
    k = int(head[COUNTED]) % KEPT_ROWS
    late.y[k], late.share[k], late.steps[k] = root * y, 1.0 if share > 0.5 else 0.0, head[ELAPSED]
    for i in range(psi.size):
        late.psi[k, i] = root * psi[i]
    head[ELAPSED] = 0.0
    head[COUNTED] += 1.0


@kernel
def filters_at(late, count, N):
    """Return the filters as they were when so many rows were counted."""
    size = filters_size(N)
    k = (count // ANEW) % KEPT_FILTERS
    return open_filters(late.sets[k * size : (k + 1) * size], N)


@rare
def keep_filters(late, own, q):
    """Keep the filter that never forgets and the learnt one as they are; P stands in ``own.dense``."""
    N, half = q.size, own.P.size
    M = own.dense.size // half - 1
    kept = filters_at(late, int(late.head[COUNTED]), N)
    for x in range(2):
        m = x * (M - 1)
        one = mode(own.bank, m, N)
        kept.weight[x], kept.freedom[x], kept.chi2[x] = one.own[WEIGHT], one.own[FREEDOM], one.own[CHI2]
        for i in range(N):
            kept.theta[x, i] = one.theta[i]
        for i in range(half):
            kept.P[x, i] = own.dense[m * half + i]
    for i in range(N):
        kept.q[i] = q[i]


@kernel
def look_back_late(memory, parts, psi, y, weight, share):
    """Keep a row; every eighth find a jump, if looking back pays; every sixteenth keep the filters."""
    late, own, drift, head = parts.late, parts.own, parts.drift, parts.late.head
    keep_row(late, psi, y, weight, share)
    count = int(head[COUNTED])
    if count % LOOK != 0:
        return
    first = count // ANEW * ANEW - (KEPT_ROWS if count % ANEW == 0 else KEPT_ROWS - ANEW)
    if first >= ANEW and (head[ODDS] > LATE_GOES_ON or does_it_pay(memory, parts)):
        weigh_rows(memory, late, parts.spare, own, drift.unit, first, count)
    else:
        head[ODDS] = -HIGHEST
    if count % ANEW == 0:
        keep_filters(late, own, drift.q)
    if head[ODDS] > LATE:
        forget_rows(late)
        head[FOUND] = head[AGO] = 1.0


@kernel
def does_it_pay(memory, parts):
    """Say whether sums over moments, or a trial, make a jump likely enough to look back for it."""
    unit = parts.drift.unit
    s2 = own_sigma2(memory, mode(parts.own.bank, 0, unit.size).own)
    return most_lessened(memory, parts.moments, unit) > LATE_WORTH * s2 or jump_on_trial(parts.trial) > LATE_TRIAL


@rare
def weigh_rows(memory, late, spare, own, unit, first, count):
    """Set the log odds of a jump since row ``first``, and how long ago it was."""
    N, half, head, work = unit.size, own.P.size, late.head, open_work(spare, unit.size)
    kept = filters_at(late, first, N)
    scratch = own.old
    M, A = scratch[:half], scratch[half : 2 * half]
    theta, r = scratch[2 * half : 2 * half + N], scratch[2 * half + N : 2 * half + 2 * N]
    x, c = scratch[2 * half + 2 * N : 2 * half + 3 * N], scratch[2 * half + 3 * N : 2 * half + 4 * N]
    jump = none = best = 0.0
    top, where = 0.0, first
    for k in range(2):
        says, total, energy, s2 = go_over(memory, late, work, kept, k, 0.0, unit, own.P, theta, c, first, count)
        says += log(max(kept.weight[k], RATE))
        if k == 0:
            top = says
        share = exp(min(says - top, HIGHEST))
        jumped, level, highest, at_row = weigh_back(
            memory, late, work, kept, k, M, A, r, x, c, unit, total, energy, s2, first, count
        )
        jump += share * jumped
        none += share * (1.0 + level)
        if share * highest > best:
            best, where = share * highest, at_row
    head[ODDS] = log(max(jump, exp(-HIGHEST)) / none)
    if head[ODDS] > LATE_GOES_ON:  # else it is over: fast drift only lessens them
        says, _, _, _ = go_over(memory, late, work, kept, 1, LEVELS[1], unit, own.P, theta, c, first, count)
        none += exp(min(says + log(FAST_SAYS) - top, HIGHEST))
        head[ODDS] = log(jump / none)
    head[SINCE] = 1.0
    for k in range(where + 1, count):
        head[SINCE] += late.steps[k % KEPT_ROWS]


@kernel
def take_in(memory, late, kept, k, speed, unit, P, theta, b, row):
    """Let filter k go on to a row and take it in, as if nothing had happened; return e and T. ``b`` is its gain.

    One that is an outlier it does not look at: 0 and 1.
    """
    N, psi = theta.size, late.psi[row]
    for _ in range(0 if stays(memory.phi[:N]) else int(late.steps[row])):
        pass_time(theta, P, memory.phi[:N])
    for i in range(N):
        P[at(i, i)] += late.steps[row] * (k * kept.q[i] + speed * unit[i])
    if late.share[row] == 0.0:
        return 0.0, 1.0
    T = multiply(P, psi, b) + memory.R
    e = late.y[row] - dot(psi, theta)
    add_square(P, -1.0 / T, b)
    for i in range(N):
        b[i] /= T
        theta[i] += e * b[i]
    return e, T


@kernel
def go_over(memory, late, work, kept, k, speed, unit, P, theta, b, first, count):
    """Let filter k go over the rows; return what it says of them, their number, the sum of e^2/T, and its sigma^2.

    ``P``, ``theta`` and ``b`` are scratch. Before each eighth row it is kept.
    """
    N, logs, total, energy = theta.size, 0.0, 0.0, 0.0
    freedom, chi2 = kept.freedom[k], kept.chi2[k]
    is_learnt = memory.learns > 0.0 and freedom >= 1.0
    s2 = chi2 / freedom if is_learnt else 1.0
    for i in range(N):
        theta[i] = kept.theta[k, i]
    for i in range(P.size):
        P[i] = kept.P[k, i]
    for now in range(first, count):
        if (now - first) % LOOK == 0:
            part = (now - first) // LOOK
            for i in range(N):
                work.theta[part, i] = theta[i]
            for i in range(P.size):
                work.P[part, i] = P[i]
        e, T = take_in(memory, late, kept, k, speed, unit, P, theta, b, now % KEPT_ROWS)
        logs -= 0.5 * log(T)
        total += late.share[now % KEPT_ROWS]
        energy += e * e / T
    if not is_learnt:
        return logs - 0.5 * energy, total, energy, s2
    amount = 0.5 * (freedom + total)
    logs += lgamma(amount) - lgamma(0.5 * freedom) - 0.5 * total * log(chi2) - amount * log1p(energy / chi2)
    return logs, total, energy, s2


@kernel
def go_over_again(memory, late, work, kept, k, unit, P, theta, first):
    """Let filter k go over eight rows from ``first`` on once more, and keep the gain of each."""
    for j in range(LOOK):
        e, T = take_in(memory, late, kept, k, 0.0, unit, P, theta, work.gain[j], (first + j) % KEPT_ROWS)
        work.z[j], work.precision[j] = e / T, 1.0 / T


@kernel
def weigh_back(memory, late, work, kept, k, M, A, r, x, c, unit, total, energy, s2, first, count):
    """Go back over the rows; return the odds of a jump, of another level, the best moment's, and its row.

    All against none, as filter k sees them. ``M`` and ``A`` (packed), ``r``, ``x`` and ``c`` are scratch.
    """
    N, after, squares = r.size, 0.0, 0.0
    freedom, chi2 = kept.freedom[k], kept.chi2[k]
    amount = freedom + total if memory.learns > 0.0 and freedom >= 1.0 else 0.0
    jump = level = best = 0.0
    where = first
    for i in range(N):
        r[i] = 0.0
    for i in range(M.size):
        M[i] = 0.0
    for back in range(count - first):
        now = count - 1 - back
        row, place = now % KEPT_ROWS, (now - first) % LOOK
        if place == LOOK - 1:
            part = (now - first) // LOOK
            go_over_again(memory, late, work, kept, k, unit, work.P[part], work.theta[part], first + part * LOOK)
        if late.share[row] > 0.0:
            psi, gain, z, precision = late.psi[row], work.gain[place], work.z[place], work.precision[place]
            square = multiply(M, gain, c)
            h = z - dot(gain, r)
            for j in range(N):
                r[j] += h * psi[j]
                for i in range(j + 1):
                    M[at(i, j)] += (square + precision) * psi[i] * psi[j] - psi[i] * c[j] - c[i] * psi[j]
            after += 1.0
            squares += z * z / precision
        if now % STEP == 0:
            if back >= RECENT:
                odds = RATE * STEP * weigh_moment(M, A, r, x, unit, amount, chi2 + energy)
                jump += odds
                if odds > best:
                    best, where = odds, now
            if amount > 0.0 and after > 1.0:
                level += RATE * STEP * weigh_level(amount, chi2 + energy, after, squares, s2)
        for _ in range(0 if stays(memory.phi[:N]) else int(late.steps[row])):
            pass_time(r, M, memory.phi[:N])
    return jump, level, best, where


@kernel
def explains(square, amount, chi2):
    """Return the log evidence of what lessens by ``square`` the sum chi2 that sigma^2 rests on, by ``amount`` samples.

    Nought of them: sigma^2 is known.
    """
    return 0.5 * square if amount == 0.0 else -0.5 * amount * log1p(-min(square / chi2, MOST_EXPLAINED))


@kernel
def weigh_moment(M, A, r, x, unit, amount, chi2):
    """Return the Bayes factor of a jump of one parameter, or of all, of score r and information M."""
    small = weigh_size(M, A, r, x, unit, amount, chi2, OF_JUMPS[0])
    large = weigh_size(M, A, r, x, unit, amount, chi2, OF_JUMPS[1])
    return 0.5 * (small + large)


@kernel
def weigh_size(M, A, r, x, unit, amount, chi2, size):
    """Return the same for jumps of one variance, in units."""
    N, one, logs = r.size, 0.0, 0.0
    for i in range(N):
        wide = 1.0 + size * unit[i] * M[at(i, i)]
        one += exp(min(explains(r[i] * r[i] * size * unit[i] / wide, amount, chi2), HIGHEST)) / math.sqrt(wide)
    if N == 1:
        return one
    for i in range(M.size):
        A[i] = M[i]
    for i in range(N):
        A[at(i, i)] += 1.0 / (size * unit[i])
        x[i] = r[i]
    solve(A, x)
    for i in range(N):  # where the inverse of each pivot stands now
        logs += log(A[at(i, i)] / (size * unit[i]))
    every = exp(min(explains(dot(r, x), amount, chi2) + 0.5 * logs, HIGHEST))
    return (1.0 - ALL_JUMP) / N * one + ALL_JUMP * every


@kernel
def weigh_level(amount, chi2, after, squares, s2):
    """Return the Bayes factor of another level of the noise in the last rows, ``after`` of them, of these squares."""
    before, rest = amount - after, max(chi2 - squares, (1.0 - MOST_EXPLAINED) * chi2)
    logs = lgamma(0.5 * before) - lgamma(0.5 * amount) + 0.5 * amount * log(chi2) - 0.5 * before * log(rest)
    logs += log(s2) + lgamma(1.0 + 0.5 * after) - (1.0 + 0.5 * after) * log(2.0 * s2 + squares) + log(2.0)
    return exp(min(logs, HIGHEST))
