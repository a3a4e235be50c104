"""A member that goes by legs: straight or on circles of fixed rates; a leg ends, and another begins.

    E + iN of leg j     p <- p + v (1 - exp(-i w d))/(i w),  v <- v exp(-i w d), under white acceleration
    a leg ends          with probability 1 - (1 - h)^(d/T)
    what follows        is leg j with probability pi_j; on the quiet one a manoeuvre, j with pi_j/(1 - pi_0)
    the plot            mu_j <- mu_j t(y; p_j, S_j): Student's

A turn is entered from where the others are, by mixing means and covariances: interacting multiple models (Blom and
Bar-Shalom 1988). Errors are as large North as East, which a turn does not change: as a complex number a leg is a filter
of two states, and its variances are real.
"""

import math

from ...engine.dispatch import abreast, kernel
from ...engine.elementary import cos, expm1, log1p, sin, square
from .bank import CIRCULAR, LEG, LEG_NOISES, LEG_RATES, LEG_SHARES, LEGS, RATES, TURNING, at_circle, at_legs

SHARE, E, VE, N, VN, PP, RE, IM, VV = (LEGS * k for k in range(LEG))  # RE + i IM is E[p v*]; PP, VV of one coordinate
SCALE = LEG * LEGS  # behind them: scale of the noise of each coordinate
QUIET = 1  # how many legs are no manoeuvre: they come first; one that is straight with more noise slows or hurries
CALM, LASTS = 0.06, 0.22  # h: of a quiet leg, of another
STRAIGHTS = LEGS - 2 * TURNING
BETWEEN = 0.04  # variance of the acceleration of a turn, of its square: rates between those of the grid
FREEDOM = 12.0  # of the Student-t by which legs are judged: (FREEDOM + 2)/2 is whole
FARTHEST = 1e25  # what x of its density x^-7 counts at most
KNOWN = 4.0  # times the variance of a velocity, the square of one that turns: else loud errors are turns
FAINTEST = 1e-12  # share of a leg


@kernel
def begin(row, C, fastest, unit):
    """Start all legs on the first plot: at rest, within the speed of the class."""
    at = at_legs(C)
    row[at : at + SCALE] = 0.0
    for j in range(LEGS):
        row[at + SHARE + j], row[at + PP + j] = LEG_SHARES[j], 0.5 * (unit[0] + unit[1])
        row[at + VV + j] = fastest * fastest
    for c in range(C):
        row[at + SCALE + c] = 1.0


@kernel
def variance(row, C, unit):
    """Return the variance of a plot of either coordinate, as this member sees it."""
    return 0.5 * (unit[0] * row[at_legs(C) + SCALE] + unit[1] * row[at_legs(C) + SCALE + 1])


@kernel
def mix(row, C, far, was, pool):
    """Let legs end over ``far`` periods: a manoeuvre follows on the quiet one, any leg on a manoeuvre.

    What begins has the mean and covariance of what it may have followed. ``was`` (LEGS,), ``pool`` (2 LEG,) are room.
    """
    calm, moved = -expm1(far * log1p(-CALM)), -expm1(far * log1p(-LASTS))
    L, after_manoeuvres, after_any = row[at_legs(C) :], pool[:LEG], pool[LEG:]
    for j in range(LEGS):
        was[j] = L[SHARE + j] * (calm if j < QUIET else moved)
    quiet = was[0]
    gather(L, was, QUIET, after_manoeuvres)
    was[0] = quiet / (1.0 - LEG_SHARES[0])
    gather(L, was, 0, after_any)
    was[0] = quiet
    begin_anew(L, was, 0, QUIET, after_manoeuvres)
    begin_anew(L, was, QUIET, LEGS, after_any)


@kernel
def gather(L, was, first, pool):
    """Fill ``pool``, by the numbers of a leg: share, mean and covariance of all that ended, ``was``, from the first."""
    total, pE, vE, pN, vN = 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(first, LEGS):
        w = was[j]
        total += w
        pE, vE, pN, vN = pE + w * L[E + j], vE + w * L[VE + j], pN + w * L[N + j], vN + w * L[VN + j]
    pE, vE, pN, vN = pE / total, vE / total, pN / total, vN / total
    pp, re, im, vv = 0.0, 0.0, 0.0, 0.0
    for j in range(first, LEGS):
        w = was[j]
        dE, dvE, dN, dvN = L[E + j] - pE, L[VE + j] - vE, L[N + j] - pN, L[VN + j] - vN
        pp += w * (L[PP + j] + 0.5 * (dE * dE + dN * dN))
        re += w * (L[RE + j] + 0.5 * (dE * dvE + dN * dvN))
        im += w * (L[IM + j] + 0.5 * (dN * dvE - dE * dvN))
        vv += w * (L[VV + j] + 0.5 * (dvE * dvE + dvN * dvN))
    pool[0], pool[1], pool[2], pool[3], pool[4] = total, pE, vE, pN, vN
    pool[5], pool[6], pool[7], pool[8] = pp / total, re / total, im / total, vv / total


@kernel
def begin_anew(L, was, first, end, pool):
    """Let legs of a range begin, each as often as it does, with the mean and covariance of the pool."""
    total, pE, vE, pN, vN = pool[0], pool[1], pool[2], pool[3], pool[4]
    pp, re, im, vv = pool[5], pool[6], pool[7], pool[8]
    for k in abreast(end - first):
        j = first + k
        stays = L[SHARE + j] - was[j]
        share = stays + LEG_SHARES[j] * total
        a = stays / share
        b = 1.0 - a
        dE, dvE, dN, dvN = L[E + j] - pE, L[VE + j] - vE, L[N + j] - pN, L[VN + j] - vN
        L[SHARE + j] = share
        L[E + j], L[VE + j], L[N + j], L[VN + j] = pE + a * dE, vE + a * dvE, pN + a * dN, vN + a * dvN
        half = 0.5 * a
        L[PP + j] = a * L[PP + j] + b * (pp + half * (dE * dE + dN * dN))
        L[RE + j] = a * L[RE + j] + b * (re + half * (dE * dvE + dN * dvN))
        L[IM + j] = a * L[IM + j] + b * (im + half * (dN * dvE - dE * dvN))
        L[VV + j] = a * L[VV + j] + b * (vv + half * (dvE * dvE + dvN * dvN))


@kernel
def arcs(T, d, s, c):
    """Fill (sin w d)/w and (1 - cos w d)/w of each leg; each rate is twice the one before."""
    half = 0.5 * RATES[0] * d / T
    si, co = sin(half), cos(half)
    for j in range(STRAIGHTS):
        s[j], c[j] = d, 0.0
    for k in range(TURNING):
        across, t = 2.0 * si * si, T / RATES[k]
        si = 2.0 * si * co
        co = 1.0 - across
        s[STRAIGHTS + k] = s[STRAIGHTS + TURNING + k] = si * t
        c[STRAIGHTS + k], c[STRAIGHTS + TURNING + k] = across * t, -across * t


@kernel
def predict(row, C, T, d, unit, room):
    """Take all legs d seconds on; ``room`` (LEGS + 2 LEG,) is some."""
    s, c = room[:LEGS], room[LEGS : 2 * LEGS]
    mix(row, C, d / T, s, room[LEGS:])
    arcs(T, d, s, c)
    L, r = row[at_legs(C) :], variance(row, C, unit)
    white, between = r / (T * T * T), BETWEEN / T
    for j in abreast(LEGS):
        omega, vE, vN, re, im, vv = LEG_RATES[j] / T, L[VE + j], L[VN + j], L[RE + j], L[IM + j], L[VV + j]
        q = LEG_NOISES[j] * white + between * LEG_RATES[j] * LEG_RATES[j] * (vE * vE + vN * vN)
        u, w = s[j], c[j]  # p + (u - iw) v
        co, si = 1.0 - omega * w, omega * u
        L[E + j] += u * vE + w * vN
        L[N + j] += u * vN - w * vE
        L[VE + j], L[VN + j] = co * vE + si * vN, co * vN - si * vE
        far = L[PP + j] + 2.0 * (u * re - w * im) + (u * u + w * w) * vv
        L[PP + j] = (far if far > 0.0 else 0.0) + q * d * d * d / 3
        x, y = re + u * vv, im - w * vv  # E[p v*] before v turns by exp(-i omega d)
        L[RE + j], L[IM + j] = co * x - si * y + q * d * d / 2, co * y + si * x
        L[VV + j] = vv + q * d


@kernel
def expect(row, C, c):
    """Return mean and variance of coordinate c in the mixture of legs, the plot's own error aside."""
    L, mean, spread = row[at_legs(C) :], 0.0, 0.0
    for j in range(LEGS):
        mean += L[SHARE + j] * L[E + 2 * LEGS * c + j]
    for j in range(LEGS):
        spread += L[SHARE + j] * (L[PP + j] + square(L[E + 2 * LEGS * c + j] - mean))
    return mean, spread


@kernel
def are_hidden(row, C, T, unit):
    """Say whether nobody can tell a turn: it goes less far between two plots than these err, or who knows how fast."""
    L, size2, vague = row[at_legs(C) :], 0.0, 0.0
    for j in range(LEGS):
        size2 += L[SHARE + j] * (square(L[VE + j]) + square(L[VN + j]))
        vague += L[SHARE + j] * 2.0 * L[VV + j]
    return not (size2 * T * T > variance(row, C, unit) and size2 > KNOWN * vague)


@kernel
def correct(row, C, y, g, unit, z2, post):
    """Take a plot; fill ``z2`` (C,): squared deviations that it was off, by what legs seem now. ``post`` is room."""
    L, total = row[at_legs(C) :], 0.0
    rE, rN = g[0] * unit[0] * L[SCALE], g[1] * unit[1] * L[SCALE + 1]
    r = 0.5 * (rE + rN)
    zE, zN = post[LEGS : 2 * LEGS], post[2 * LEGS : 3 * LEGS]
    for j in abreast(LEGS):
        eE, eN, pp, re, im = y[0] - L[E + j], y[1] - L[N + j], L[PP + j], L[RE + j], L[IM + j]
        sE, sN, s = pp + rE, pp + rN, 1.0 / (pp + r)
        zE[j], zN[j] = eE * eE / sE, eN * eN / sN
        x = 1.0 + (zE[j] + zN[j]) / FREEDOM
        x = x if x < FARTHEST else FARTHEST
        x2 = x * x
        post[j] = L[SHARE + j] / (math.sqrt(sE * sN) * (x2 * x2 * x2 * x))
        kp, kr, ki, kept = pp * s, re * s, im * s, r * s
        L[E + j] += kp * eE
        L[N + j] += kp * eN
        L[VE + j] += kr * eE + ki * eN
        L[VN + j] += kr * eN - ki * eE
        tied = (re / pp) * re + (im / pp) * im
        free = L[VV + j] - tied
        L[VV + j] = (free if free > 0.0 else 0.0) + kept * tied
        L[PP + j], L[RE + j], L[IM + j] = kept * pp, kept * re, kept * im
    for j in range(LEGS):
        total += post[j]
    inverse, total = 1.0 / total, 0.0
    for j in range(LEGS):
        post[j] = max(post[j] * inverse, FAINTEST)
        total += post[j]
    inverse, far_E, far_N = 1.0 / total, 0.0, 0.0
    for j in range(LEGS):
        w = post[j] * inverse
        L[SHARE + j] = w
        far_E += w * zE[j]
        far_N += w * zN[j]
    z2[0], z2[1] = far_E, far_N


@kernel
def turning(row, C):
    """Return how likely legs hold a turn."""
    L, share = row[at_legs(C) :], 0.0
    for j in range(STRAIGHTS, LEGS):
        share += L[SHARE + j]
    return share


@kernel
def acceleration(row, C, T):
    """Return the squared mean acceleration of the legs, and by how much they differ in it."""
    L, aE, aN, size2 = row[at_legs(C) :], 0.0, 0.0, 0.0
    for j in range(STRAIGHTS, LEGS):
        w, vE, vN = LEG_RATES[j] / T, L[VE + j], L[VN + j]
        aE += L[SHARE + j] * w * vN
        aN -= L[SHARE + j] * w * vE
        size2 += L[SHARE + j] * w * w * (vE * vE + vN * vN)
    mean2 = aE * aE + aN * aN
    return mean2, max(size2 - mean2, 0.0)


@kernel
def member_state(row, C, T, unit, x, V):
    """Fill x and the upper triangle of V: of E, vE, aE, N, vN, aN in the mixture of legs; aE = w vN, aN = -w vE.

    The rate w is that of the member whose rate walks: those of legs are few.
    """
    L, r, turn = row[at_legs(C) :], variance(row, C, unit), row[at_circle(C, 0) :]
    omega, vague = turn[4], turn[CIRCULAR - 1]
    for k in range(6):
        x[k] = 0.0
        for l in range(k, 6):
            V[k, l] = 0.0
    for j in range(LEGS):
        w = L[SHARE + j]
        x[0], x[1], x[3], x[4] = x[0] + w * L[E + j], x[1] + w * L[VE + j], x[3] + w * L[N + j], x[4] + w * L[VN + j]
        vague += w * square(LEG_RATES[j] / T - omega)
    x[2], x[5] = omega * x[4], -omega * x[1]
    pp, re, im, vv, white = 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(LEGS):
        w = L[SHARE + j]
        pp, re, im, vv = pp + w * L[PP + j], re + w * L[RE + j], im + w * L[IM + j], vv + w * L[VV + j]
        white += w * LEG_NOISES[j] * r / square(square(T))
        e0, e1, e3, e4 = L[E + j] - x[0], L[VE + j] - x[1], L[N + j] - x[3], L[VN + j] - x[4]
        V[0, 0], V[0, 1], V[1, 1] = V[0, 0] + w * e0 * e0, V[0, 1] + w * e0 * e1, V[1, 1] + w * e1 * e1
        V[3, 3], V[3, 4], V[4, 4] = V[3, 3] + w * e3 * e3, V[3, 4] + w * e3 * e4, V[4, 4] + w * e4 * e4
        V[0, 3], V[0, 4] = V[0, 3] + w * e0 * e3, V[0, 4] + w * e0 * e4
        V[1, 3], V[1, 4] = V[1, 3] + w * e1 * e3, V[1, 4] + w * e1 * e4
    V[0, 0], V[0, 1], V[1, 1] = V[0, 0] + pp, V[0, 1] + re, V[1, 1] + vv
    V[3, 3], V[3, 4], V[4, 4] = V[3, 3] + pp, V[3, 4] + re, V[4, 4] + vv
    V[0, 4], V[1, 3] = V[0, 4] - im, V[1, 3] + im
    V[0, 2], V[1, 2], V[2, 3], V[2, 4] = omega * V[0, 4], omega * V[1, 4], omega * V[3, 4], omega * V[4, 4]
    V[0, 5], V[1, 5], V[3, 5], V[4, 5] = -omega * V[0, 1], -omega * V[1, 1], -omega * V[1, 3], -omega * V[1, 4]
    V[2, 2] = omega * omega * V[4, 4] + vague * x[4] * x[4] + white
    V[5, 5] = omega * omega * V[1, 1] + vague * x[1] * x[1] + white
    V[2, 5] = -omega * omega * V[1, 4] - vague * x[4] * x[1]
