"""What a plot showed, as columns of the trace: forecast and density, then where the target is and how it moves."""

import math

from ...engine.dispatch import kernel
from ...engine.elementary import log, square
from ...engine.elementary.complementary import erfc_both
from ...engine.normal import density
from ...engine.status import NOT_READY
from . import bank, circle, learning, legs, linear, pole

MISSES = 0.005  # chance that a plot, whatever its size, tells nothing of the place: no forecast shows that it did ..
KNOWN = 4.0  # .. once so many plots were seen: before, what the class can do is all that is expected


@kernel
def expect(C, w, mean, S, told):
    """Fill ``told``: mean and variance of each coordinate in the mixture, from the first plot; their covariance.

    Places are left for what the unforeseen adds to the variances, and for its share.
    """
    for c in range(C):
        m, s = 0.0, 0.0
        for i in range(bank.members(C)):
            if w[i] > 0.0:
                m += w[i] * mean[i, c]
        for i in range(bank.members(C)):
            if w[i] > 0.0:
                s += w[i] * (S[i, c] + square(mean[i, c] - m))
        told[c], told[C + c] = m, s
    told[2 * C] = 0.0
    if C == 2:
        for i in range(bank.members(C)):
            if w[i] > 0.0:
                told[2 * C] += w[i] * (mean[i, 0] - told[0]) * (mean[i, 1] - told[1])


@kernel
def blend(C, share, other, told):
    """Give what is expected the mean and the covariance that it has with a share of ``other``."""
    if C == 2:
        both = share * (1.0 - share) * (other[0] - told[0]) * (other[1] - told[1])
        told[2 * C] = (1.0 - share) * told[2 * C] + share * other[2 * C] + both
    for c in range(C):
        apart = other[c] - told[c]
        told[c] += share * apart
        told[C + c] = (1.0 - share) * told[C + c] + share * (other[C + c] + (1.0 - share) * apart * apart)


@kernel
def tell(row, C, y, w, told, parts, out):
    """Write forecast, density and where the plot (relative to the first, NaN is missing) lies in it.

    ``parts`` (C * TAILS,) take what each scale of the tails has of the density, but for what is unforeseen.
    """
    total = 0.0
    for j in range(bank.TAILS):
        total += row[bank.row_at(C).tails + j]
    spreading, rare = 0.0, told[3 * C + 1]
    out[bank.sample_at(C).unforeseen] = rare
    for j in range(bank.TAILS):
        out[bank.sample_at(C).shares + j] = row[bank.row_at(C).tails + j] / total
        spreading += bank.COUNTED[j] * out[bank.sample_at(C).shares + j]
    out[bank.sample_at(C).reported + bank.SPREADING] = spreading
    for c in range(C):
        m, s = told[c], told[C + c]
        e, p, lower, upper = y[c] - m, 0.0, 0.0, 0.0
        for j in range(bank.TAILS):
            v, share = bank.SCALES[j] * s, out[bank.sample_at(C).shares + j]
            parts[c * bank.TAILS + j] = share * density(e, v)
            p += parts[c * bank.TAILS + j]
            above, below = erfc_both(e / math.sqrt(2.0 * v))
            lower += share * 0.5 * below
            upper += share * 0.5 * above
        out[bank.sample_at(C).wider + c] = told[2 * C + 1 + c]
        v = s + told[2 * C + 1 + c]
        above, below = erfc_both(e / math.sqrt(2.0 * v))
        p = (1.0 - rare) * p + rare * density(e, v)
        lower = (1.0 - rare) * lower + rare * 0.5 * below
        upper = (1.0 - rare) * upper + rare * 0.5 * above
        out[bank.column(C, 0, c)], out[bank.column(C, 1, c)] = m + row[bank.of_coordinate(C, bank.FIRST, c)], e
        out[bank.column(C, 2, c)], out[bank.column(C, 3, c)] = s, log(max(p, 1e-300))
        out[bank.column(C, 4, c)], out[bank.column(C, 5, c)] = lower, upper
    out[bank.sample_at(C).reported + bank.CROSS] = told[2 * C]
    for i in range(bank.members(C)):
        out[bank.sample_at(C).shares + bank.TAILS + i] = w[i]


@kernel
def clear(V, n):
    """Fill a matrix (n, n) with zeros."""
    for j in range(n):
        for k in range(n):
            V[j, k] = 0.0


@kernel
def member_state(row, C, i, T, unit, x, V):
    """Fill x (3C,) and the upper triangle of V (3C, 3C): position, velocity, acceleration as member i has them.

    Members that are linear leave what links two coordinates, which is zero, as it is: `clear` it before the first.
    """
    if bank.goes_by_legs(C, i):
        legs.member_state(row, C, T, unit, x, V)
    elif i >= bank.KALMAN:
        circle.member_state(row, C, i - bank.KALMAN, x, V)
    else:
        for c in range(C):
            at, h = bank.at_linear(C, i, c), 3 * c
            r = unit[c] * row[at + linear.SCALE]
            x[h], x[h + 1] = row[at], row[at + linear.V]
            V[h, h], V[h, h + 1], V[h + 1, h + 1] = (
                row[at + linear.PP] * r,
                row[at + linear.PV] * r,
                row[at + linear.VV] * r,
            )
            if i < bank.LINES:  # the mean acceleration between two plots
                x[h + 2], V[h, h + 2], V[h + 1, h + 2] = 0.0, 0.0, 0.0
                V[h + 2, h + 2] = bank.STRAIGHT[i][1] * r / square(square(T))
            else:
                x[h + 2], V[h, h + 2] = row[at + linear.A], row[at + linear.PA] * r
                V[h + 1, h + 2], V[h + 2, h + 2] = row[at + linear.VA] * r, row[at + linear.AA] * r


@kernel
def tell_state(task, row, C, T, w, unit, x, V, total, out):
    """Write mean and covariance of position (from the first plot), velocity, acceleration: of members that have them.

    Member after member (West 1979), so that nothing cancels.
    """
    n, share = 3 * C, 0.0
    mean = out[bank.sample_at(C).state : bank.sample_at(C).state + n]
    for j in range(n):
        mean[j] = 0.0
    clear(V, n)
    clear(total, n)
    for i in range(bank.moving(C)):
        if w[i] > 0.0:
            before, share = share, share + w[i]
            old, new = before / share, w[i] / share
            member_state(row, C, i, T, unit, x, V)
            for c in range(C):  # relative to the last plot: the square of a position is large
                x[3 * c] -= row[bank.of_coordinate(C, bank.LAST, c)]
            for j in range(n):
                for k in range(j, n):
                    apart = (x[j] - mean[j]) * (x[k] - mean[k])
                    total[j, k] = old * total[j, k] + new * (V[j, k] + old * apart)
            for j in range(n):
                mean[j] += new * (x[j] - mean[j])
    for c in range(C):  # plots that repeat themselves on a lattice have one error, and not as many
        if row[bank.of_coordinate(C, bank.STILL, c)] > 0.0:
            total[3 * c, 3 * c] = max(total[3 * c, 3 * c], learning.cell_variance(task, row, C, c))
    at = bank.sample_at(C).covariance
    for j in range(n):
        for k in range(j, n):
            out[at] = total[j, k]
            at += 1
    for c in range(C):
        mean[3 * c] += row[bank.of_coordinate(C, bank.LAST, c)]


@kernel
def blend_state(C, share, other, out):
    """Give the state in ``out`` the mean and the covariance that it has with a share of the one in ``other``."""
    n, x, at = 3 * C, bank.sample_at(C).state, bank.sample_at(C).covariance
    for j in range(n):
        for k in range(j, n):
            apart = (other[x + j] - out[x + j]) * (other[x + k] - out[x + k])
            out[at] = (1.0 - share) * out[at] + share * (other[at] + (1.0 - share) * apart)
            at += 1
    for j in range(n):
        out[x + j] += share * (other[x + j] - out[x + j])


@kernel
def allow_for_error(row, C, g, out):
    """Widen the variances of the place by the chance that the plot says nothing of it: it is where it was expected.

    Noise that jumps looks like motion to members that follow every plot, and they swear to its old size. ``g``: what a
    plot has of the variance of others; one that says that it is more precise is believed in proportion.
    """
    if row[bank.SEEN] < KNOWN:
        return
    at, n = bank.sample_at(C).covariance, 3 * C
    for j in range(n):
        if j % 3 == 0:
            e, s = out[bank.column(C, 1, j // 3)], out[bank.column(C, 2, j // 3)]
            out[at] += MISSES * min(g[j // 3], 1.0) * (s + e * e)
        at += n - j


@kernel
def tell_place(row, C, out):
    """Write positions from where the first plot was counted."""
    for c in range(C):
        out[bank.sample_at(C).state + 3 * c] += row[bank.of_coordinate(C, bank.FIRST, c)]


@kernel
def tell_turn(C, out):
    """Write the turn rate, positive to the right, and its standard deviation by the delta method; NaN at rest."""
    reported = bank.sample_at(C).reported
    out[reported + bank.TURN] = out[reported + bank.TURN_SD] = math.nan
    if C != 2:
        return
    x, at = out[bank.sample_at(C).state :], bank.sample_at(C).covariance
    vE, aE, vN, aN = x[1], x[2], x[4], x[5]
    v2 = vE * vE + vN * vN
    if not v2 > 0.0 or out[at] == math.inf:
        return
    omega, variance = (aE * vN - aN * vE) / v2, 0.0
    for j in range(6):
        for k in range(j, 6):
            both = turn_slope(j, omega, vE, aE, vN, aN, v2) * turn_slope(k, omega, vE, aE, vN, aN, v2)
            variance += both * out[at] * (1.0 if j == k else 2.0)
            at += 1
    out[reported + bank.TURN], out[reported + bank.TURN_SD] = omega, math.sqrt(max(variance, 0.0))


@kernel
def turn_slope(j, omega, vE, aE, vN, aN, v2):
    """Return the derivative of (aE vN - aN vE)/v^2 by entry j of (E, vE, aE, N, vN, aN)."""
    if j == 1:
        return (-aN - 2.0 * omega * vE) / v2
    if j == 2:
        return vN / v2
    if j == 4:
        return (aE - 2.0 * omega * vN) / v2
    if j == 5:
        return -vE / v2
    return 0.0


@kernel
def tell_pole(row, C, w, out):
    """Write the manoeuvre pole and its standard deviation; NaN before the third plot."""
    first, share, mean, size2 = bank.moving(C), 0.0, 0.0, 0.0
    n = pole.size(C)
    for i in range(bank.POLES):
        share += w[first + i]
    for i in range(bank.POLES):
        at, v = bank.at_pole(C, i), w[first + i] / share if share > 0.0 else 1.0 / bank.POLES
        mean += v * row[at + n - 1]
        size2 += v * (square(row[at + n - 1]) + row[at + n + bank.triangle(n) - 1])
    is_known = row[bank.SEEN] > 2.0
    out[bank.sample_at(C).reported + bank.POLE] = mean if is_known else math.nan
    out[bank.sample_at(C).reported + bank.POLE_SD] = math.sqrt(max(size2 - mean * mean, 0.0)) if is_known else math.nan


@kernel
def blank(task, row, C, t, y, out):
    """Write what is known before there are two plots: nothing, or one place and the speed of the class."""
    for k in range(bank.columns(C)):
        out[k] = 0.0
    share = bank.sample_at(C).shares
    for j in range(bank.TAILS):
        out[share + j] = 1.0 if bank.SCALES[j] == 1.0 else 0.0
    out[bank.sample_at(C).reported + bank.SPREADING] = 1.0
    tell_turn(C, out)
    out[bank.sample_at(C).reported + bank.POLE] = out[bank.sample_at(C).reported + bank.POLE_SD] = math.nan
    out[bank.sample_at(C).reported + bank.STATUS] = NOT_READY
    out[bank.sample_at(C).reported + bank.MANOEUVRING] = row[bank.MANOEUVRE]
    for c in range(C):
        for k in range(6):
            out[bank.column(C, k, c)] = math.nan
        out[bank.column(C, 2, c)] = math.inf
        out[bank.sample_at(C).state + 3 * c] = y[c]
    at, n = bank.sample_at(C).covariance, 3 * C
    for j in range(n):
        for k in range(j, n):
            out[at] = math.inf if j == k else 0.0
            at += 1
