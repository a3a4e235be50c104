"""Members that are Kalman filters: constant velocity, wandering, constant acceleration, Singer; a coordinate each.

All in units of the variance of a plot, so that the gain of a member depends on its number and the times alone; the unit
itself follows the innovations.
"""

import math

from ...engine.dispatch import kernel
from ...engine.elementary import square
from ...models.manoeuvre import response, spread
from .bank import CURVED, KALMAN, LINEAR, LINES, STRAIGHT, at_linear

X, P, SCALE = 0, 3, 9  # of a member's numbers
RATES = tuple(sorted({alpha for alpha, _ in (*STRAIGHT, *CURVED)}))  # alpha T: what differs takes an integral each


@kernel
def begin(row, C, T, fastest, unit):
    """Start all of them on the first plot: at rest, within the speed of the class (units of the plots' variance)."""
    for i in range(KALMAN):
        for c in range(C):
            at = at_linear(C, i) + LINEAR * c
            row[at : at + LINEAR] = 0.0
            row[at + P], row[at + P + 3], row[at + SCALE] = 1.0, fastest * fastest / unit[c], 1.0
            row[at + P + 5] = 0.0 if i < LINES else 1.0 / square(square(T))


@kernel
def predict_line(row, at, d, f, share, pp, pv, vv):
    """Take position, velocity and the upper triangle of their covariance on; the velocity keeps a factor f."""
    x, p = at + X, at + P
    row[x] += d * row[x + 1]
    row[x + 1] *= f
    b, c = row[p + 1] + d * row[p + 3], row[p + 3]
    row[p] = max(row[p] + d * row[p + 1] + d * b, 0.0) + share * pp
    row[p + 1] = f * b + share * pv
    row[p + 3] = f * f * c + share * vv


@kernel
def predict_curve(row, at, d, f, g, s, share, pp, pv, pa, vv, va, aa):
    """Take position, velocity, acceleration and the upper triangle of their covariance d seconds on."""
    x, p = at + X, at + P
    row[x] += d * row[x + 1] + s * row[x + 2]
    row[x + 1] += g * row[x + 2]
    row[x + 2] *= f
    a = row[p] + d * row[p + 1] + s * row[p + 2]
    b = row[p + 1] + d * row[p + 3] + s * row[p + 4]
    c = row[p + 2] + d * row[p + 4] + s * row[p + 5]
    e, h = row[p + 3] + g * row[p + 4], row[p + 4] + g * row[p + 5]
    row[p] = max(a + d * b + s * c, 0.0) + share * pp
    row[p + 1] = b + g * c + share * pv
    row[p + 2] = f * c + share * pa
    row[p + 3] = e + g * h + share * vv
    row[p + 4] = f * h + share * va
    row[p + 5] = f * f * row[p + 5] + share * aa


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
                at = at_linear(C, i) + LINEAR * c
                if i < LINES:
                    predict_line(row, at, g, f, STRAIGHT[i][1] / (T * T * T), vv, va, aa)
                else:
                    predict_curve(
                        row, at, d, f, g, s, CURVED[i - LINES][1] / (T * square(square(T))), pp, pv, pa, vv, va, aa
                    )


@kernel
def correct(row, at, e, g):
    """Let the position be measured: innovation e, g the variance of the plot in units of the plots'.

    The covariance becomes C + u u' g/(s pp): u is the position's column, C what velocity and acceleration have without
    it. A sum, so that nothing cancels after a long gap.
    """
    x, p = at + X, at + P
    pp, pv, pa = row[p], row[p + 1], row[p + 2]
    s = pp + g
    row[x] += pp / s * e
    row[x + 1] += pv / s * e
    row[x + 2] += pa / s * e
    vv, aa = max(row[p + 3] - pv / pp * pv, 0.0), max(row[p + 5] - pa / pp * pa, 0.0)
    most, share = math.sqrt(vv * aa), g / s
    row[p + 5] = aa + share * (pa / pp) * pa
    row[p + 4] = min(max(row[p + 4] - pv / pp * pa, -most), most) + share * (pv / pp) * pa
    row[p + 3] = vv + share * (pv / pp) * pv
    row[p + 2] = share * pa
    row[p + 1] = share * pv
    row[p] = share * pp


@kernel
def corrected(P, j, k, h, a, b, r, S):
    """Return entry (j, k) of a covariance P once entry h was measured with variance r: a, b are (j, h), (k, h).

    S is (h, h) + r. It does not subtract what nearly cancels after a long gap, and no variance falls below its bound.
    """
    if j == h or k == h:
        return P * (r / S)
    return max(P - a * b / S, P * (r / S)) if j == k else P - a * b / S
