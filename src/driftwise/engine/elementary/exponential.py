"""Exponentials: by Taylor's series, and expm1 after fdlibm's s_expm1.c (Sun Microsystems, 1993)."""

import math

from ..dispatch import kernel, rare
from .pairs import E3, E4, E5, E6, E7, E8, E9, E10, E11, E12, E13, LN2_HIGH, LN2_LOW, PER_LN2

LEAST, MOST = -746.0, 709.782712893384  # exp is 0 below, inf above
WHOLE = 6755399441055744.0  # 1.5 2^52: numbers beside it have no digits after the point
FAR = 708.0  # exp is an ordinary number up to there, on both sides
GONE = -40.0  # exp(x) - 1 is -1 below
TINY = 2.0**-54  # exp(x) - 1 is x below
HALF_LN2 = 0.34657359027997264

Q1, Q2, Q3 = -3.33333333333331316428e-02, 1.58730158725481460165e-03, -7.93650757867487942473e-05
Q4, Q5 = 4.00821782732936239552e-06, -2.01099218183624371326e-07


@kernel
def exp(x):
    """Return e to the x. The error is below 1 of the last place.

    x = k log 2 + r, |r| <= (log 2)/2:  exp x = 2^k (1 + r + r^2/2 + .. + r^13/13!), odd and even powers side by side
    """
    return near_exp(x) if abs(x) < FAR else far_exp(x)


@kernel
def near_exp(x):
    """Return the same, neither nan nor far from 0."""
    k = (x * PER_LN2 + WHOLE) - WHOLE  # to the nearest whole number: no conversion waits
    high, low = x - k * LN2_HIGH, k * LN2_LOW
    r = high - low
    z = r * r
    odd = E3 + z * (E5 + z * (E7 + z * (E9 + z * (E11 + z * E13))))
    even = 0.5 + z * (E4 + z * (E6 + z * (E8 + z * (E10 + z * E12))))
    return math.ldexp(1.0 + (high - (low - z * (even + r * odd))), int(k))


@rare
def far_exp(x):
    """Return the same of any number: 0 below all exponents, inf above."""
    found = near_exp(min(max(LEAST, x), MOST))
    return found if x <= MOST else (math.inf if x > MOST else x)


@rare
def expm1(x):
    """Return exp(x) - 1. The error is below 1 of the last place, also where x is small.

    x = k log 2 + r:  exp(x) - 1 = 2^k (1 + r - E) - 1, and E = r (..) - r^2/2 is a rational function of r.
    """
    if x > MOST:
        return math.inf
    if not abs(x) > TINY:
        return x
    v = max(x, GONE)
    k = 0 if abs(v) <= HALF_LN2 else int(v * PER_LN2 + math.copysign(0.5, v))
    high, low = v - k * LN2_HIGH, k * LN2_LOW
    r = high - low
    lost = (high - r) - low
    half = 0.5 * r
    z = r * half
    R = 1.0 + z * (Q1 + z * (Q2 + z * (Q3 + z * (Q4 + z * Q5))))
    t = 3.0 - R * half
    E = z * ((R - t) / (6.0 - r * t))
    if k == 0:
        return r - (r * E - z)
    E = (r * (E - lost) - lost) - z
    if k == -1:
        return 0.5 * (r - E) - 0.5
    if k == 1:
        return -2.0 * (E - (r + 0.5)) if r < -0.25 else 1.0 + 2.0 * (r - E)
    if k < 0 or k > 56:
        return math.ldexp(1.0 - (E - r), k) - 1.0
    one = math.ldexp(1.0, -k)
    return math.ldexp((1.0 - one) - (E - r) if k < 20 else 1.0 + (r - (E + one)), k)
