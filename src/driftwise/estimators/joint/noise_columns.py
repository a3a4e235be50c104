"""Columns of noise that the time update of the joint filter appends to x before it is made triangular again."""

from ...engine.dispatch import choice, kernel, rare
from ...engine.ud import entry
from ...models.noise import Coloured, Sensor, Unknown, White


@rare
def add_spread(U, D, first, last, weight, n, rows, Y, d, g, at):
    """Append noise of covariance weight P_pp to x, p the n parameters from ``first`` on; return the next column.

    It is the spread of p times an error of that variance. Parameter ``last`` (none: -1) multiplies the same error
    into y: ``g`` takes its columns.
    """
    for c in range(first, D.size):
        d[at] = weight * D[c]
        g[at] = entry(U, last, c) if 0 <= last <= c else 0.0
        for i in range(rows):
            Y[i, at] = entry(U, first + i, c) if i < n and first + i <= c else 0.0
        at += 1
    return at


@rare
def add_difference_spread(U, D, first, second, weight, n, rows, Y, d, at):
    """Append noise of covariance weight cov(p - q) to x, p and q the n parameters from ``first`` and ``second`` on."""
    for c in range(min(first, second), D.size):
        d[at] = weight * D[c]
        for i in range(rows):
            Y[i, at] = 0.0
            if i < n and first + i <= c:
                Y[i, at] += entry(U, first + i, c)
            if i < n and second + i <= c:
                Y[i, at] -= entry(U, second + i, c)
        at += 1
    return at


@kernel
def add_square(c, weight, n, rows, Y, d, at):
    """Append noise of covariance weight c c' to x; return the next column."""
    d[at] = weight
    for i in range(rows):
        Y[i, at] = c[i] if i < n else 0.0
    return at + 1


@rare
def covariance_with_output(U, D, f, first, count, c):
    """Fill c with cov(s_i, y) = (U D f)_i for ``count`` indices from ``first`` on."""
    for i in range(count):
        c[i] = 0.0
        for j in range(first + i, D.size):
            c[i] += entry(U, first + i, j) * D[j] * f[j]


@choice
def add_columns(noise, rows, Y, d, at):
    """Append the constant noise columns to Y and return the next free column."""


@add_columns.on(White, Sensor, Unknown)
def add_columns_white(noise, rows, Y, d, at):
    return at


@add_columns.on(Coloured)
def add_columns_coloured(noise, rows, Y, d, at):
    G = noise.G
    for k in range(G.size // rows):
        d[at] = 1.0
        for i in range(rows):
            Y[i, at] = G[k * rows + i]
        at += 1
    return at
