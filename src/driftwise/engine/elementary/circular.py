"""Sine and cosine, after fdlibm's k_sin.c and k_cos.c (Sun Microsystems, 1993)."""

import math

from ..dispatch import kernel, rare
from .turns import quarters

S1, S2, S3 = -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04
S4, S5, S6 = 2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10
C1, C2, C3 = 4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05
C4, C5, C6 = -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11


@kernel
def sin_part(r, low):
    """Return sin(r + low), |r| up to pi/4."""
    z = r * r
    tail = S2 + z * (S3 + z * S4) + z * (z * z) * (S5 + z * S6)
    cube = z * r
    return r - ((z * (0.5 * low - cube * tail) - low) - cube * S1)


@kernel
def cos_part(r, low):
    """Return cos(r + low), |r| up to pi/4."""
    z = r * r
    w = z * z
    tail = z * (C1 + z * (C2 + z * C3)) + w * w * (C4 + z * (C5 + z * C6))
    half = 0.5 * z
    most = 1.0 - half
    return most + (((1.0 - most) - half) + (z * tail - r * low))


@rare
def sin(x):
    """Return the sine of x (radians), nan where it is not finite. The error is below 1 of the last place, anywhere.

    Angles from 2^40 on are slower: their whole turns are taken off with 1200 digits of pi.
    """
    if not abs(x) < math.inf:
        return math.nan
    n, r, low = quarters(x)
    found = sin_part(r, low) if n % 2 == 0 else cos_part(r, low)
    return found if n < 2 else -found


@rare
def cos(x):
    """Return the cosine of x (radians), nan where it is not finite. Accuracy and cost are those of `sin`."""
    if not abs(x) < math.inf:
        return math.nan
    n, r, low = quarters(x)
    found = cos_part(r, low) if n % 2 == 0 else sin_part(r, low)
    return found if n == 0 or n == 3 else -found
