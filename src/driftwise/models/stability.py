"""Polynomials that must keep their zeros inside a circle."""

from ..engine.dispatch import kernel


@kernel
def is_inside(c, radius, p, q):
    """Say whether 1 + c1/z + ... + cn/z^n has all zeros within ``radius`` (Schur and Cohn); p, q are scratch."""
    n, power = c.size, 1.0
    for i in range(n):
        power /= radius
        p[i] = c[i] * power
    for m in range(n, 0, -1):
        k = p[m - 1]
        if not abs(k) < 1.0:
            return False
        for i in range(m - 1):
            q[i] = (p[i] - k * p[m - 2 - i]) / (1.0 - k * k)
        for i in range(m - 1):
            p[i] = q[i]
    return True


@kernel
def shrink_inside(c, radius, p, q):
    """Scale c_k by 0.98^k until every zero lies within ``radius``; say whether anything moved."""
    turns = 0
    while turns < 1000 and not is_inside(c, radius, p, q):
        factor = 1.0
        for i in range(c.size):
            factor *= 0.98
            c[i] *= factor
        turns += 1
    return turns > 0
