"""Members that are Kalman filters: constant velocity, wandering, constant acceleration, Singer; a coordinate each.

All in units of the variance of a plot, so that the gain of a member depends on its number and the times alone; the unit
itself follows the innovations.
"""

import math

from ...engine.dispatch import kernel
from ...engine.elementary import square
from ...models.manoeuvre import response, spread
from .bank import CURVE, CURVED, KALMAN, LINE, LINES, STRAIGHT, at_linear

X, V, PP, PV, VV, SCALE, A, PA, VA, AA = range(CURVE)  # of a member's numbers; a line has the first six
RATES = tuple(sorted({alpha for alpha, _ in (*STRAIGHT, *CURVED)}))  # alpha T: what differs takes an integral each


@kernel
def begin(row, C, T, fastest, unit):
    """Start all of them on the first plot: at rest, within the speed of the class (units of the plots' variance)."""
    for i in range(KALMAN):
        for c in range(C):
            at = at_linear(C, i, c)
            row[at : at + (LINE if i < LINES else CURVE)] = 0.0
            row[at + PP], row[at + VV], row[at + SCALE] = 1.0, fastest * fastest / unit[c], 1.0
            if i >= LINES:
                row[at + AA] = 1.0 / square(square(T))


@kernel
def predict_line(row, at, d, f, share, pp, pv, vv):
    """Take position, velocity and their covariance on; the velocity keeps a factor f."""
    row[at] += d * row[at + V]
    row[at + V] *= f
    b, c = row[at + PV] + d * row[at + VV], row[at + VV]
    row[at + PP] = max(row[at + PP] + d * row[at + PV] + d * b, 0.0) + share * pp
    row[at + PV] = f * b + share * pv
    row[at + VV] = f * f * c + share * vv


@kernel
def predict_curve(row, at, d, f, g, s, share, pp, pv, pa, vv, va, aa):
    """Take position, velocity, acceleration and their covariance d seconds on."""
    row[at] += d * row[at + V] + s * row[at + A]
    row[at + V] += g * row[at + A]
    row[at + A] *= f
    a = row[at + PP] + d * row[at + PV] + s * row[at + PA]
    b = row[at + PV] + d * row[at + VV] + s * row[at + VA]
    c = row[at + PA] + d * row[at + VA] + s * row[at + AA]
    e, h = row[at + VV] + g * row[at + VA], row[at + VA] + g * row[at + AA]
    row[at + PP] = max(a + d * b + s * c, 0.0) + share * pp
    row[at + PV] = b + g * c + share * pv
    row[at + PA] = f * c + share * pa
    row[at + VV] = e + g * h + share * vv
    row[at + VA] = f * h + share * va
    row[at + AA] = f * f * row[at + AA] + share * aa


@kernel
def predict_all(row, C, T, d):
    """Take all members d seconds on, those of the same alpha together."""
    for rate in RATES:
        s, g, f = response(rate / T, d)
        pp, pv, pa, vv, va, aa = spread(rate / T, d)
        for i in range(KALMAN):
            if (STRAIGHT[i][0] if i < LINES else CURVED[i - LINES][0]) != rate:
                continue
            for c in range(C):
                at = at_linear(C, i, c)
                if i < LINES:
                    predict_line(row, at, g, f, STRAIGHT[i][1] / (T * T * T), vv, va, aa)
                else:
                    predict_curve(
                        row, at, d, f, g, s, CURVED[i - LINES][1] / (T * square(square(T))), pp, pv, pa, vv, va, aa
                    )


@kernel
def correct(row, at, i, e, g):
    """Let the position be measured: innovation e, g the variance of the plot in units of the plots'.

    The covariance becomes C + u u' g/(s pp): u is the position's column, C what velocity and acceleration have without
    it. A sum, so that nothing cancels after a long gap.
    """
    pp, pv = row[at + PP], row[at + PV]
    s = pp + g
    vv, share = max(row[at + VV] - pv / pp * pv, 0.0), g / s
    row[at] += pp / s * e
    row[at + V] += pv / s * e
    if i >= LINES:
        pa = row[at + PA]
        aa = max(row[at + AA] - pa / pp * pa, 0.0)
        most = math.sqrt(vv * aa)
        row[at + A] += pa / s * e
        row[at + AA] = aa + share * (pa / pp) * pa
        row[at + VA] = min(max(row[at + VA] - pv / pp * pa, -most), most) + share * (pv / pp) * pa
        row[at + PA] = share * pa
    row[at + VV] = vv + share * (pv / pp) * pv
    row[at + PV] = share * pv
    row[at + PP] = share * pp


@kernel
def corrected(P, j, k, h, a, b, r, S):
    """Return entry (j, k) of a covariance P once entry h was measured with variance r: a, b are (j, h), (k, h).

    S is (h, h) + r. It does not subtract what nearly cancels after a long gap, and no variance falls below its bound.
    """
    if j == h or k == h:
        return P * (r / S)
    return max(P - a * b / S, P * (r / S)) if j == k else P - a * b / S
