"""Numbers of about 100 binary digits: a pair of doubles, the rounded value and what is missing from it.

Sources: Dekker (1971), "A floating-point technique for extending the available precision"; Knuth, The Art of Computer
Programming, volume 2, section 4.2.2.
"""

import math

from ..dispatch import kernel, rare

SPLIT = 134217729.0  # 2^27 + 1
ROOT_HALF = 0.7071067811865476
LN2_HIGH = 6.93147180369123816490e-01  # 32 digits: k LN2_HIGH is exact for |k| < 2^20
LN2_LOW = 1.90821492927058770002e-10
PER_LN2 = 1.44269504088896338700e00

# 1/3 of twice the digits, and 1/5, 1/7, .. of the series of log
THIRD, THIRD_LOW = 1 / 3, 1.850371707708594e-17
L2, L3, L4, L5, L6, L7 = 1 / 5, 1 / 7, 1 / 9, 1 / 11, 1 / 13, 1 / 15
L8, L9, L10, L11, L12, L13 = 1 / 17, 1 / 19, 1 / 21, 1 / 23, 1 / 25, 1 / 27

# 1/n! of the series of exp
E3, E4, E5, E6, E7, E8 = 1 / 6, 1 / 24, 1 / 120, 1 / 720, 1 / 5040, 1 / 40320
E9, E10, E11, E12 = 1 / 362880, 1 / 3628800, 1 / 39916800, 1 / 479001600
E13, E14 = 1 / 6227020800, 1 / 87178291200


@kernel
def about_one(x):
    """Return m and k: x = m 2^k, m from the root of 1/2 to that of 2; x is an ordinary positive number.

    In C it is a few operations with the bits of x (`translate/formats.py`): of a branch, half of all numbers go
    either way, and a processor that cannot foresee it waits as long as for all the rest.
    """
    m, e = math.frexp(x)
    is_low = m < ROOT_HALF
    return m + m if is_low else m, e - 1 if is_low else e


@kernel
def add(a, b):
    """Return a + b, and what is missing from it (Knuth)."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


@kernel
def multiply(a, b):
    """Return a b, and what is missing from it, where neither overflows when split (Veltkamp, Dekker)."""
    product = a * b
    wide = SPLIT * a
    a1 = wide - (wide - a)
    a2 = a - a1
    wide = SPLIT * b
    b1 = wide - (wide - b)
    b2 = b - b1
    return product, ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2


@rare
def log_pair(x):
    """Return log x, 0 < x < inf, and what is missing from it: the error is 2^-64 of it.

    x = 2^k m, m about 1, s = (m - 1)/(m + 1):  log x = k log 2 + 2 s (1 + s^2/3 + s^4/5 + ..)
    """
    m, k = math.frexp(x)
    if m < ROOT_HALF:
        m, k = m + m, k - 1
    f = m - 1.0
    below, below_low = add(2.0, f)
    s = f / below
    whole, rest = multiply(s, below)
    s_low = ((f - whole) - rest - s * below_low) / below
    z, z_low = multiply(s, s)
    z_low += 2.0 * s * s_low
    w = z * z
    even = L2 + w * (L4 + w * (L6 + w * (L8 + w * (L10 + w * L12))))
    odd = L3 + w * (L5 + w * (L7 + w * (L9 + w * (L11 + w * L13))))
    q, q_low = multiply(z, THIRD)
    q, left = add(q, w * (even + z * odd))
    q_low += left + (z * THIRD_LOW + z_low * THIRD)
    u, u_low = multiply(2.0 * s, q)
    h, l = add(2.0 * s, u)
    l += 2.0 * s_low + (u_low + 2.0 * (s * q_low + s_low * q))
    h, left = add(k * LN2_HIGH, h)
    l += left + k * LN2_LOW
    log = h + l
    return log, l - (log - h)


@rare
def exp_pair(x, low):
    """Return k, y and what is missing from y: exp(x + low) = 2^k y, y about 1; the error is 2^-58 of it.

    |x| < 800, and ``low`` is what is missing from x, no more.
    """
    k = int(x * PER_LN2 + math.copysign(0.5, x))
    r, r_low = add(x - k * LN2_HIGH, -k * LN2_LOW)
    r_low += low
    h, h_low = multiply(r, 0.5 * r)
    z = r * r
    odd = E3 + z * (E5 + z * (E7 + z * (E9 + z * (E11 + z * E13))))
    even = E4 + z * (E6 + z * (E8 + z * (E10 + z * (E12 + z * E14))))
    y, left = add(r, h)
    y_low = left + (h_low + z * (r * odd + z * even))
    y, left = add(1.0, y)
    y_low += left + r_low * (y + y_low)
    exp = y + y_low
    return k, exp, y_low - (exp - y)
