"""Natural logarithms, after fdlibm's e_log.c and s_log1p.c (Sun Microsystems, 1993)."""

import math

from ..dispatch import kernel, rare
from .pairs import LN2_HIGH, LN2_LOW, about_one

LEAST, MOST = 2.2250738585072014e-308, 1.7976931348623157e308  # of ordinary numbers
LIFT, LIFTED = 54, 2.0**54  # by so much those below them are
TINY = 2.0**-54  # log(1 + x) is x below
NEAR = 0.29  # and log(1 + x) is that of a number between the roots

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
    low_powers = (L1 + z * L2) + w * (L3 + z * L4)  # side by side: who asks for a logarithm waits for it
    R = z * (low_powers + w * w * ((L5 + z * L6) + w * L7))
    half = 0.5 * f * f
    return k * LN2_HIGH - ((half - (s * (half + R) + low)) - f)


@kernel
def log(x):
    """Return the natural logarithm of x: -inf of 0, nan of less. The error is below 1 of the last place."""
    if not (x >= LEAST and x <= MOST):
        return far_log(x)
    m, k = about_one(x)
    return log_about_one(m - 1.0, k, k * LN2_LOW)


@rare
def far_log(x):
    """Return the same of any number that is not ordinary: of less than all exponents, of none, of inf and nan."""
    if not (x > 0.0 and x <= MOST):
        return math.inf if x > MOST else (-math.inf if x == 0.0 else math.nan)
    m, k = about_one(x * LIFTED)
    k -= LIFT
    return log_about_one(m - 1.0, k, k * LN2_LOW)


@kernel
def log1p(x):
    """Return log(1 + x): -inf of -1, nan of less. The error is below 1 of the last place, also where x is small."""
    if abs(x) < NEAR and abs(x) > TINY:  # 1 + x is between the roots: nothing is lost, and no exponent is there
        return log_about_one(x, 0, 0.0)
    return far_log1p(x)


@rare
def far_log1p(x):
    """Return the same of any number."""
    if not (x > -1.0 and x <= MOST and abs(x) > TINY):
        return x if abs(x) <= TINY or x > MOST else (-math.inf if x == -1.0 else math.nan)
    u = 1.0 + x
    m, k = about_one(u)
    lost = (1.0 - (u - x) if u > 2.0 else x - (u - 1.0)) / u  # of x, when 1 was added
    return log_about_one(x if k == 0 else m - 1.0, k, 0.0 if k == 0 else k * LN2_LOW + lost)
