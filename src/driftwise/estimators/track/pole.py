"""Members that learn a manoeuvre pole: the joint filter of Salut with two poles held at 1, for irregular times.

    v_k = (y_k - y_k-1)/d_k,   w_k = T (v_k - v_k-1),   (1 - phi q) w = (1 - rho q)^2 nu,   var nu = r (T/d_k)^2
    state per coordinate x2, x3 (w = x3 + nu), one phi for all coordinates; linear because w is measured:
    measured, nu = w - x3 is known:  x3 <- x2 + phi w - 2 rho nu,  x2 <- rho^2 nu

Salut, Aguilar, Favier and Alengrin (1979), sections 2 and 3.3, with A(q) = (1 - phi q)(1 - q)^2.
"""

import math

from ...engine.dispatch import kernel
from .bank import RADII, at_pole, triangle
from .linear import corrected

WALK = 1e-4  # variance by which phi walks, a plot
FIRST = 0.2  # variance of phi at first, about 0
LARGEST = 0.98  # of |phi|
LOOSE = 25.0  # times the variance of a plot: of the states at first


@kernel
def size(C):
    """Return the length of the state."""
    return 2 * C + 1


@kernel
def _index(n, i, j):
    """Return where entry i <= j of the upper triangle stands."""
    return i * n - i * (i - 1) // 2 + j - i


@kernel
def begin(row, C, i, unit):
    """Start one on the second plot: nothing known of the manoeuvre."""
    at, n = at_pole(C, i), size(C)
    row[at : at + n + triangle(n)] = 0.0
    for c in range(C):
        for j in (2 * c, 2 * c + 1):
            row[at + n + _index(n, j, j)] = LOOSE * unit[c]
        row[at + n + triangle(n) + c] = 1.0
    row[at + n + _index(n, n - 1, n - 1)] = FIRST


@kernel
def rescale(row, C, i, factor):
    """Write the states in units of another period."""
    at, n = at_pole(C, i), size(C)
    for j in range(n - 1):
        row[at + j] *= factor
        for k in range(j, n):
            row[at + n + _index(n, j, k)] *= factor * factor if k < n - 1 else factor


@kernel
def variance(row, C, i, c):
    """Return the variance of x3 of coordinate c."""
    n = size(C)
    return row[at_pole(C, i) + n + _index(n, 2 * c + 1, 2 * c + 1)]


@kernel
def widen(row, C, i, much):
    """Add to the variance of x3 of each coordinate."""
    n = size(C)
    for c in range(C):
        row[at_pole(C, i) + n + _index(n, 2 * c + 1, 2 * c + 1)] += much


@kernel
def measure(row, C, i, c, w, r, A):
    """Let w of coordinate c be measured with noise of variance r; A is room for a column."""
    at, n, h = at_pole(C, i), size(C), 2 * c + 1
    for j in range(n):
        A[0, j] = row[at + n + (_index(n, j, h) if j <= h else _index(n, h, j))]
    S, e, p = A[0, h] + r, w - row[at + h], at + n
    for j in range(n):
        row[at + j] += A[0, j] * e / S
        for k in range(j, n):
            row[p] = corrected(row[p], j, k, h, A[0, j], A[0, k], r, S)
            p += 1


@kernel
def step(row, C, i, w, A, B):
    """Go on to the next plot; w of all coordinates is known by now. Return 1 where phi was held, 0 elsewhere."""
    at, n, rho = at_pole(C, i), size(C), RADII[i]
    learnt = row[at + n - 1]
    phi = min(max(learnt, -LARGEST), LARGEST)  # before anything is built with it
    row[at + n - 1] = phi
    for c in range(C):
        x2, x3 = 2 * c, 2 * c + 1
        nu = w[c] - row[at + x3]
        row[at + x3] = row[at + x2] + phi * w[c] - 2 * rho * nu
        row[at + x2] = rho * rho * nu
    p = at + n
    for j in range(n):
        for k in range(j, n):
            A[j, k] = A[k, j] = row[p]
            p += 1
    for c in range(C):  # B = F A: of F, row x2 has -rho^2 at x3; row x3 has 1, 2 rho and w at x2, x3 and phi
        x2, x3 = 2 * c, 2 * c + 1
        for k in range(n):
            B[x2, k] = -rho * rho * A[x3, k]
            B[x3, k] = A[x2, k] + 2 * rho * A[x3, k] + w[c] * A[n - 1, k]
    for k in range(n):
        B[n - 1, k] = A[n - 1, k]
    p = at + n
    for j in range(n):  # B F', its upper triangle
        for k in range(j, n):
            if k == n - 1:
                row[p] = B[j, k]
            elif k % 2 == 0:
                row[p] = -rho * rho * B[j, k + 1]
            else:
                row[p] = B[j, k - 1] + 2 * rho * B[j, k] + w[k // 2] * B[j, n - 1]
            if j == k:
                row[p] = max(row[p], 0.0)
            p += 1
    last = p - 1
    row[last] += WALK
    if learnt != phi:  # held, and learnt anew
        shrink(row, at, n, 0.0)
        row[last] = FIRST
        return 1.0
    if row[last] > FIRST:  # nothing has excited it: no wider than at first
        shrink(row, at, n, math.sqrt(FIRST / row[last]))
    return 0.0


@kernel
def shrink(row, at, n, factor):
    """Narrow the last of a state by a factor: its row and column of the covariance."""
    for j in range(n - 1):
        row[at + n + _index(n, j, n - 1)] *= factor
    row[at + n + _index(n, n - 1, n - 1)] *= factor * factor
