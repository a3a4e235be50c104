"""How a target moves between two plots: straight, with an acceleration that is forgotten, or on a circle.

    Singer (1970)         a' = -alpha a + white noise; alpha = 0 is constant acceleration, no a constant velocity
    coordinated turn      (v_E + i v_N)' = -i omega (v_E + i v_N), omega > 0 to the right

Sources: Singer (1970); Li and Jilkov (2003), sections IV and V.
"""

from ..engine.dispatch import kernel
from ..engine.elementary import cos, exp, expm1, sin, square

# Gauss-Legendre on [-1, 1], exact to degree 15
NODES = (0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363)
SHARES = (0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763)


@kernel
def response(alpha, s):
    """Return position, velocity and acceleration s seconds after a unit of acceleration."""
    if alpha * s < 1e-4:
        x = alpha * s
        return 0.5 * s * s * (1 - x / 3 * (1 - x / 4)), s * (1 - 0.5 * x * (1 - x / 3)), exp(-x)
    lost = expm1(-alpha * s)
    return (alpha * s + lost) / (alpha * alpha), -lost / alpha, 1.0 + lost


@kernel
def spread(alpha, d):
    """Return the upper triangle of the integral of g g' over d seconds, g the response to a unit of jerk."""
    if alpha * d > 1.0:  # a sum of 8 terms misses what is forgotten fast
        x, e = alpha * d, exp(-alpha * d)
        p, v, a = response(alpha, d)
        half = -0.5 * expm1(-2 * x)
        pp = ((x - 1) * square(x - 1) + 1) / 3 - 2 * x * e + half
        return (
            pp / (alpha * square(square(alpha))),
            p * p / 2,
            (half - x * e) / (alpha * square(alpha)),
            (x + 2 * (e - 1) + half) / (alpha * square(alpha)),
            v * v / 2,
            half / alpha,
        )
    pp, pv, pa, vv, va, aa = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(8):
        node = NODES[i // 2] if i % 2 == 0 else -NODES[i // 2]
        p, v, a = response(alpha, 0.5 * d * (1.0 + node))
        w = 0.5 * d * SHARES[i // 2]
        pp += w * p * p
        pv += w * p * v
        pa += w * p * a
        vv += w * v * v
        va += w * v * a
        aa += w * a * a
    return pp, pv, pa, vv, va, aa


@kernel
def arc(omega, d):
    """Return (sin omega d)/omega, (1 - cos omega d)/omega and their derivatives by omega."""
    x = omega * d
    if abs(x) < 1e-4:
        return d * (1 - x * x / 6), 0.5 * d * x * (1 - x * x / 12), -d * d * x / 3, d * d * (0.5 - x * x / 8)
    half = sin(0.5 * x)
    s, c = sin(x) / omega, 2 * half * half / omega
    return s, c, (d * cos(x) - s) / omega, (d * sin(x) - c) / omega
