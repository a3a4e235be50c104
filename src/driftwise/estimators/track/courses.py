"""What a target may do from plot to plot: go straight on, be seen late, or be in a manoeuvre of some strength.

courses      x_j, P_j: position, velocity, acceleration along the way and across it, each by itself (interacting
             multiple models; Blom and Bar-Shalom 1988)
mixing       P(i|j) = mu_i p_ij/c_j      c_j = sum_i mu_i p_ij
acceleration forgotten in ``LASTS`` plots; of what begins N(0, s_j^2), s_j the j-th strength
late         straight on, but anywhere along the way: the first plot by an age, the next by what that changes
plots        usual, a Student-t of as many degrees as plots have shown of their noise; wide; or wild, which move nothing
"""

import math

from ...engine.dispatch import kernel
from ...engine.elementary import exp, log, square
from . import bank, judging, linear

AHEAD, LATE, MOVES = 0, 1, bank.AHEADS  # courses; and the first of those that are manoeuvres
STRENGTHS = tuple(2.0 * 6.0**k for k in range(bank.MOVES))  # of the gentlest manoeuvre of a class
BEGINS, ENDS = 0.01, 0.03  # a manoeuvre, at a plot
LATE_BEGINS, LATE_ENDS = 0.01, 0.3  # and plots that are late
OLD, CHANGES = 1.0, 0.3  # times between plots, that the first is old, and by which that changes
DELAY, SCANS = 0.3, 3.0  # s, that it is older, whatever the time between plots; as so many of those at most
LASTS = 20.0  # plots, an acceleration
WOBBLES = 0.2  # what goes straight: of the gentlest manoeuvre, from plot to plot ..
NOISE = 1e-4  # .. and q T^3/r
WIDE, WIDER2 = 0.003, 9.0  # share of plots that err by more, and their variance
WILD, WILDER2 = 1e-3, 900.0  # .. of those that are wild, where none was, and the same of them
WILD_FREEDOM = 3.0  # of the Student-t of those
UNSURE, SURE = 5.0, 40.0  # plots that say nothing of the noise to be expected; after which it is no better known
LEAST_FREEDOM = 2.0
LEAST = 1e-12  # probability of a course
POINTS = 4.0  # variances of a velocity, that its square is beyond where it shows the way
USUAL, WIDELY, WILDLY = 0, 1, 2  # of what a plot may be


@kernel
def at_course(j, C, c):
    """Return where coordinate c of a course starts among the numbers of all: as those of a linear member stand."""
    if j < MOVES:
        return (j * C + c) * bank.LINE
    return MOVES * C * bank.LINE + ((j - MOVES) * C + c) * bank.CURVE


@kernel
def at_share(j, C):
    """Return where the probability of a course stands: for the scale of its first coordinate."""
    return at_course(j, C, 0) + linear.SCALE


@kernel
def strength(task, j):
    """Return the standard deviation of the acceleration of a course when it begins."""
    return STRENGTHS[j - MOVES] * task.fastest / judging.GENTLE if j >= MOVES else 0.0


@kernel
def follows(i, j):
    """Return how likely course j follows on i."""
    if i >= MOVES:
        return ENDS if j == AHEAD else (1.0 - ENDS if i == j else 0.0)
    if j >= MOVES:
        return BEGINS / bank.MOVES
    passes = LATE_BEGINS if i == AHEAD else LATE_ENDS
    return 1.0 - BEGINS - passes if i == j else passes


@kernel
def begin(task, K, C, d, e, r):
    """Start all courses at the second plot, ``e`` (C,) after the first, d seconds before; r (C,) is their variance."""
    K[: bank.courses_size(C)] = 0.0
    for j in range(bank.COURSES):
        K[at_share(j, C)] = BEGINS if j >= MOVES else LATE_BEGINS
        for c in range(C):
            x = at_course(j, C, c)
            K[x + linear.V] = e[c] / d
            K[x + linear.PP], K[x + linear.PV], K[x + linear.VV] = r[c], r[c] / d, 2.0 * r[c] / (d * d)
            if j >= MOVES:
                K[x + linear.AA] = square(strength(task, j))
    K[at_share(AHEAD, C)] = 1.0 - LATE_BEGINS - bank.MOVES * BEGINS


@kernel
def mix(task, K, C, mixed):
    """Fill what each course is about to go on from: itself, and those on which it follows, with a new acceleration."""
    mixed[: bank.courses_size(C)] = 0.0
    for j in range(bank.COURSES):
        total, fresh = 0.0, square(strength(task, j))
        for i in range(bank.COURSES):
            total += K[at_share(i, C)] * follows(i, j)
        for i in range(bank.COURSES):
            w = K[at_share(i, C)] * follows(i, j) / total
            if w > 0.0:
                for c in range(C):
                    m, x = at_course(j, C, c), at_course(i, C, c)
                    mixed[m], mixed[m + linear.V] = mixed[m] + w * K[x], mixed[m + linear.V] + w * K[x + linear.V]
                    if i == j and j >= MOVES:
                        mixed[m + linear.A] += w * K[x + linear.A]
        for i in range(bank.COURSES):
            w = K[at_share(i, C)] * follows(i, j) / total
            if w > 0.0:
                for c in range(C):
                    m, x = at_course(j, C, c), at_course(i, C, c)
                    p, v = K[x] - mixed[m], K[x + linear.V] - mixed[m + linear.V]
                    mixed[m + linear.PP] += w * (K[x + linear.PP] + p * p)
                    mixed[m + linear.PV] += w * (K[x + linear.PV] + p * v)
                    mixed[m + linear.VV] += w * (K[x + linear.VV] + v * v)
                    if j >= MOVES:
                        a, pa, va, aa = -mixed[m + linear.A], 0.0, 0.0, fresh
                        if i == j:
                            a += K[x + linear.A]
                            pa, va, aa = K[x + linear.PA], K[x + linear.VA], K[x + linear.AA]
                        mixed[m + linear.PA] += w * (pa + p * a)
                        mixed[m + linear.VA] += w * (va + v * a)
                        mixed[m + linear.AA] += w * (aa + a * a)
        mixed[at_share(j, C)] = total


@kernel
def go_on(task, K, mixed, C, d, T, r):
    """Take all courses d seconds on."""
    f = exp(-d / (LASTS * T))
    for j in range(bank.COURSES):
        for c in range(C):
            q = NOISE * r[c] / (T * T * T) + square(WOBBLES * task.fastest / judging.GENTLE) * T
            white, aa = q * d, (1.0 - f * f) * square(strength(task, j))
            at, pp, pv = at_course(j, C, c), white * d * d / 3.0, 0.5 * white * d
            if j < MOVES:
                linear.predict_line(mixed, at, d, 1.0, 1.0, pp, pv, white)
            else:
                linear.predict_curve(mixed, at, d, f, d, 0.5 * d * d, 1.0, pp, pv, 0.0, white, 0.0, aa)
    v2 = 0.0
    for c in range(C):
        v2 += square(mixed[at_course(LATE, C, c) + linear.V])
    first = K[at_share(AHEAD, C)] * follows(AHEAD, LATE) / mixed[at_share(LATE, C)]
    age2 = first * (square(OLD * T) + square(min(DELAY, SCANS * T))) + (1.0 - first) * square(CHANGES * T)
    mixed[at_course(LATE, C, 0) + linear.PP] += v2 * age2


@kernel
def wider(which):
    """Return the variance of a plot that is usual, wide or wild, of what is usual."""
    return 1.0 if which == USUAL else (WIDER2 if which == WIDELY else WILDER2)


@kernel
def weigh(row, mixed, C, e, r, parts):
    """Fill how likely a plot is usual, wide or wild on each course, and the probability of each with it."""
    tails, seen, best = bank.row_at(C).tails, 0.0, -math.inf
    for k in range(bank.TAILS):
        seen += row[tails + k]
    wild = WILD + row[tails + bank.WILD] / seen
    freedom = max(min(row[bank.row_at(C).known] - UNSURE, SURE), LEAST_FREEDOM)
    usual, widely, wildly = log(1.0 - WIDE - min(wild, 0.5)), log(WIDE), log(wild)
    for j in range(bank.COURSES):
        top, total, own = -math.inf, 0.0, parts[3 * j : 3 * j + 3]
        for which in range(3):
            nu, volume, far = WILD_FREEDOM if which == WILDLY else freedom, 1.0, 1.0
            for c in range(C):
                x = at_course(j, C, c)
                S = mixed[x + linear.PP] + wider(which) * r[c]
                volume *= S
                far *= 1.0 + square(e[c] - mixed[x]) / (S * nu)
            own[which] = usual if which == USUAL else (widely if which == WIDELY else wildly)
            own[which] -= 0.5 * log(volume) + 0.5 * (nu + 1.0) * log(far)
            top = max(top, own[which])
        for which in range(3):
            own[which] = exp(own[which] - top)
            total += own[which]
        for which in range(3):
            own[which] /= total
        mixed[at_share(j, C)] = top + log(total * mixed[at_share(j, C)])
        best = max(best, mixed[at_share(j, C)])
    total = 0.0
    for j in range(bank.COURSES):
        mixed[at_share(j, C)] = exp(mixed[at_share(j, C)] - best)
        total += mixed[at_share(j, C)]
    for j in range(bank.COURSES):
        mixed[at_share(j, C)] = max(mixed[at_share(j, C)] / total, LEAST)


@kernel
def leave_out(parts):
    """Fill the same of a plot that says nothing."""
    for j in range(bank.COURSES):
        parts[3 * j + USUAL], parts[3 * j + WIDELY], parts[3 * j + WILDLY] = 0.0, 0.0, 1.0


@kernel
def correct(K, mixed, C, e, r, parts):
    """Let all courses learn of a plot, as far as it is not wild; positions are from there on relative to it."""
    for j in range(bank.COURSES):
        K[at_share(j, C)] = mixed[at_share(j, C)]
        for c in range(C):
            x, gain, gain2 = at_course(j, C, c), 0.0, 0.0
            pp, pv = mixed[x + linear.PP], mixed[x + linear.PV]
            for which in range(WILDLY):
                one = 1.0 / (pp + wider(which) * r[c])
                gain, gain2 = gain + parts[3 * j + which] * one, gain2 + parts[3 * j + which] * one * one
            off = e[c] - mixed[x]
            spread = off * off * max(gain2 - gain * gain, 0.0) - gain
            K[x], K[x + linear.V] = mixed[x] + pp * off * gain - e[c], mixed[x + linear.V] + pv * off * gain
            K[x + linear.PP], K[x + linear.PV] = pp + pp * pp * spread, pv + pp * pv * spread
            K[x + linear.VV] = mixed[x + linear.VV] + pv * pv * spread
            if j >= MOVES:
                pa = mixed[x + linear.PA]
                K[x + linear.A] = mixed[x + linear.A] + pa * off * gain
                K[x + linear.PA], K[x + linear.VA] = pa + pp * pa * spread, mixed[x + linear.VA] + pv * pa * spread
                K[x + linear.AA] = mixed[x + linear.AA] + pa * pa * spread


@kernel
def turn(row, K, C):
    """Let the way be that of the velocity, where it shows one; what accelerates across it goes on to do so."""
    along, across, variance = 0.0, 0.0, 0.0
    for j in range(bank.COURSES):
        w, a, b = K[at_share(j, C)], at_course(j, C, 0), at_course(j, C, 1)
        along, across = along + w * K[a + linear.V], across + w * K[b + linear.V]
        variance += w * (K[a + linear.VV] + K[b + linear.VV])
    v2 = along * along + across * across
    if not v2 > POINTS * variance:
        return
    cos, sin = along / math.sqrt(v2), across / math.sqrt(v2)
    E, N = bank.of_coordinate(C, bank.WAY, 0), bank.of_coordinate(C, bank.WAY, 1)
    row[E], row[N] = cos * row[E] - sin * row[N], cos * row[N] + sin * row[E]
    for j in range(bank.COURSES):
        a, b = at_course(j, C, 0), at_course(j, C, 1)
        for k in range(linear.PP):
            K[a + k], K[b + k] = cos * K[a + k] + sin * K[b + k], cos * K[b + k] - sin * K[a + k]
        for k in range(linear.PP, linear.SCALE):
            first, second = K[a + k], K[b + k]
            K[a + k] = cos * cos * first + sin * sin * second
            K[b + k] = sin * sin * first + cos * cos * second
