"""Normal densities, standard tail areas, and back."""

import math

from .dispatch import kernel
from .elementary import erfc, exp, log

ROOT_2PI = math.sqrt(2 * math.pi)
RAREST = 1e-300  # smallest tail area that is told from none; 37 standard deviations


@kernel
def density(e, v):
    """Return the density of N(0, v), never quite zero."""
    return exp(-0.5 * min(e * e / v, 1400.0)) / (ROOT_2PI * math.sqrt(v))


@kernel
def tail(z):
    """Return P(Z > z)."""
    return 0.5 * erfc(z / math.sqrt(2.0))


@kernel
def deviate(p):
    """Return the z >= 0 with P(Z > z) = p, p in (0, 1/2]: Newton on log p, which is concave in z, from above."""
    p = min(max(p, RAREST), 0.5)
    z = math.sqrt(-2.0 * log(2.0 * p))  # above: P(Z > z) <= exp(-z^2/2)/2
    for _ in range(40):
        area = tail(z)
        step = area * log(area / p) * math.sqrt(2.0 * math.pi) * exp(0.5 * z * z)
        z = max(z + step, 0.0)
        if abs(step) < 1e-12 * (1.0 + z):
            break
    return z
