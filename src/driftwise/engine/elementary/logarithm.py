"""Natural logarithms, after fdlibm's e_log.c and s_log1p.c (Sun Microsystems, 1993)."""

import math

from ..dispatch import kernel
from .pairs import LN2_HIGH, LN2_LOW, ROOT_HALF

MOST = 1.7976931348623157e308
TINY = 2.0**-54  # log(1 + x) is x below

L1, L2, L3 = 6.666666666666735130e-01, 3.999999999940941908e-01, 2.857142874366239149e-01
L4, L5, L6 = 2.222219843214978396e-01, 1.818357216161805012e-01, 1.531383769920937332e-01
L7 = 1.479819860511658591e-01


@kernel
def log_about_one(f, k, low):
    """Return k LN2_HIGH + log(1 + f) + low; 1 + f is between the roots of 1/2 and of 2.

    s = f/(2 + f):  log(1 + f) = 2 s + s R(s^2) = f - (f^2/2 - s (f^2/2 + R))
    """
    s = f / (2.0 + f)
    z = s * s
    w = z * z
    R = z * (L1 + w * (L3 + w * (L5 + w * L7))) + w * (L2 + w * (L4 + w * L6))
    half = 0.5 * f * f
    return k * LN2_HIGH - ((half - (s * (half + R) + low)) - f)


@kernel
def log(x):
    """Return the natural logarithm of x: -inf of 0, nan of less. The error is below 1 of the last place."""
    if not (x > 0.0 and x <= MOST):
        return math.inf if x > MOST else (-math.inf if x == 0.0 else math.nan)
    m, e = math.frexp(x)
    is_low = m < ROOT_HALF
    k = e - 1 if is_low else e
    return log_about_one((m + m if is_low else m) - 1.0, k, k * LN2_LOW)


@kernel
def log1p(x):
    """Return log(1 + x): -inf of -1, nan of less. The error is below 1 of the last place, also where x is small."""
    if not (x > -1.0 and x <= MOST and abs(x) > TINY):
        return x if abs(x) <= TINY or x > MOST else (-math.inf if x == -1.0 else math.nan)
    u = 1.0 + x
    m, e = math.frexp(u)
    is_low = m < ROOT_HALF
    f = (m + m if is_low else m) - 1.0
    k = e - 1 if is_low else e
    lost = (1.0 - (u - x) if u > 2.0 else x - (u - 1.0)) / u  # of x, when 1 was added
    return log_about_one(x if k == 0 else f, k, 0.0 if k == 0 else k * LN2_LOW + lost)
