"""Powers: exp(y log x), with log x and the product as pairs."""

import math

from ..dispatch import kernel, rare
from .pairs import exp_pair, log_pair, multiply

LARGEST = 2.0**70  # x^y is 0, 1 or inf beyond
MOST, LEAST = 709.782712893384, -745.5  # exp overflows beyond, and is 0


@kernel
def square(x):
    """Return x x: ``x**2`` is, in plain Python, the C library's power, which is not always this."""
    return x * x


@rare
def pow(x, y):
    """Return x to the y, for x >= 0; nan below. The error is below 1 of the last place."""
    if y == 0.0 or x == 1.0:
        return 1.0
    if not x >= 0.0 or y != y:
        return math.nan
    if x == 0.0:
        return 0.0 if y > 0.0 else math.inf
    if x == math.inf:
        return math.inf if y > 0.0 else 0.0
    v = min(max(y, -LARGEST), LARGEST)
    log, log_low = log_pair(x)
    e, low = multiply(v, log)
    low += v * log_low
    if e > MOST:
        return math.inf
    if e < LEAST:
        return 0.0
    k, power, power_low = exp_pair(e, low)
    return math.ldexp(power + power_low, k - 1) * 2.0 if k > 1000 else math.ldexp(power + power_low, k)
