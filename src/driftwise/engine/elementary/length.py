"""The length of a vector of two."""

import math

from ..dispatch import rare
from .pairs import add, multiply


@rare
def hypot(x, y):
    """Return the root of x^2 + y^2; the squares do not overflow. The error is below 1 of the last place."""
    if abs(x) == math.inf or abs(y) == math.inf:
        return math.inf
    if x != x or y != y:
        return math.nan
    a, b = max(abs(x), abs(y)), min(abs(x), abs(y))
    if b == 0.0:
        return a
    e = math.frexp(a)[1]
    a, b = math.ldexp(a, -e), math.ldexp(b, -e)
    aa, aa_low = multiply(a, a)
    bb, bb_low = multiply(b, b)
    total, low = add(aa, bb)
    low += aa_low + bb_low
    root = math.sqrt(total)
    whole, rest = multiply(root, root)
    root += ((total - whole) - rest + low) / (2.0 * root)  # Newton, once
    return math.ldexp(root, e) if e < 1024 else math.ldexp(root, 1023) * 2.0
