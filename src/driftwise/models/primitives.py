"""What formulas may call besides arithmetic: in kernels, so that they have the same bits everywhere."""

import math

from ..engine.dispatch import kernel
from ..engine.elementary import exp


@kernel
def root(x):
    """Return the square root; nan of a negative number."""
    return math.sqrt(x) if x >= 0.0 else math.nan


@kernel
def signum(x):
    """Return -1, 0 or 1."""
    return 1.0 if x > 0.0 else -1.0 if x < 0.0 else 0.0 * x


@kernel
def hyperbolic_tangent(x):
    """Return tanh x."""
    fading = exp(-2.0 * abs(x))
    return signum(x) * (1.0 - fading) / (1.0 + fading)


@kernel
def divided(a, b):
    """Return a/b, as C does where b is zero."""
    if b != 0.0:
        return a / b
    return math.nan if a == 0.0 or a != a else math.copysign(math.inf, a) * math.copysign(1.0, b)


@kernel
def piece(points, first, count, x):
    """Return which piece of a table x lies in: the table has ``count`` arguments from ``first`` on, then its values."""
    low, high = 0, count - 1
    while high - low > 1:
        middle = (low + high) // 2
        if points[first + middle] <= x:
            low = middle
        else:
            high = middle
    return low


@kernel
def table_slope(points, first, count, x):
    """Return the slope of a table's piece at x; the last pieces go on beyond its ends."""
    i = first + piece(points, first, count, x)
    return (points[i + count + 1] - points[i + count]) / (points[i + 1] - points[i])


@kernel
def table_value(points, first, count, x):
    """Return what a table says at x, on straight lines between its points."""
    i = first + piece(points, first, count, x)
    slope = (points[i + count + 1] - points[i + count]) / (points[i + 1] - points[i])
    return points[i + count] + slope * (x - points[i])
