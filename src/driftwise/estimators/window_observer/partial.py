"""A window that is still filling, or has samples missing: least squares on the rows at hand, by QR.

The rows are those of `gains`: unknowns bounded forwards begin at the window's first sample, those bounded backwards end
at its last. What the inputs do is taken off in the same two directions, so nothing grows.
"""

import math

from ...engine.dispatch import kernel, rare
from ...engine.elementary import square
from ...engine.qr import invert, solve_triangular, triangularise
from .gains import WORST
from .row import along

# own numbers of a row: place in the ring, samples in it, outputs missing among them, samples in a row that full windows
# predicted
AT, FILLED, GAPS, FORESEEN = range(4)


@kernel
def force_backwards(form, state, scratch, first, count):
    """Fill work.b with what the inputs of the window make of b, which is zero at its end."""
    k, p = state.held.size, scratch.y.size
    n, q, b = form.Tb.size // state.z.size, p + k, scratch.b
    for j in range(n):
        b[(count - 1) * n + j] = 0.0
    for i in range(count - 2, -1, -1):
        u = (first + i) * q + p
        for j in range(n):
            scratch.row[j] = b[(i + 1) * n + j]
            for l in range(k):
                scratch.row[j] -= form.Gb0[j * k + l] * state.ring[u + l] + form.Gb1[j * k + l] * state.ring[u + q + l]
        for j in range(n):
            b[i * n + j] = 0.0
            for l in range(n):
                b[i * n + j] += form.Pb[j * n + l] * scratch.row[l]


@kernel
def force_on(form, state, scratch, at):
    """work.a <- Pa a + Ga0 u + Ga1 u+, from the ring's place ``at`` to the next."""
    k, q, s = state.held.size, scratch.y.size + state.held.size, scratch.a.size
    u = at * q + scratch.y.size
    for j in range(s):
        total = along(form.Pa, j * s, scratch.a)
        for l in range(k):
            total += form.Ga0[j * k + l] * state.ring[u + l] + form.Ga1[j * k + l] * state.ring[u + q + l]
        scratch.next[j] = total
    for j in range(s):
        scratch.a[j] = scratch.next[j]


@kernel
def collect(form, state, scratch, first, count):
    """Write the prior's rows and those of the outputs at hand into work.M; return how many."""
    k, p, w, M, s = state.held.size, scratch.y.size, scratch.w.size, scratch.M, scratch.a.size
    L, q, bounded, n = int(form.length), p + k, int(form.bounded), form.Tb.size // state.z.size
    for i in range(w):
        for j in range(w):
            M[j, i] = form.prior[i * w + j]
        M[w, i] = 0.0
    rows = w
    for j in range(s):
        scratch.a[j] = 0.0
    if n > 0:
        force_backwards(form, state, scratch, first, count)
    for i in range(count):
        place = first + i
        if i > 0 and k > 0:
            force_on(form, state, scratch, place - 1)
        for o in range(p):
            if state.there[(place if place < L else place - L) * p + o] == 0.0:
                continue
            y = state.ring[place * q + o] - along(form.HTa, o * s, scratch.a)
            for l in range(n):
                y -= form.HTb[o * n + l] * scratch.b[i * n + l]
            for l in range(k):
                y -= form.D[o * k + l] * state.ring[place * q + p + l]
            for j in range(w):
                M[j, rows] = form.design[(o * w + j) * L + (i if j < bounded else L - count + i)]
            M[w, rows] = y / math.sqrt(form.r[o])
            rows += 1
    return rows


@kernel
def deviation(X, weights, at, end, row):
    """Return the norm of weights[at : at + m] end X: a deviation, given the triangle's inverse X."""
    w, total = row.size, 0.0
    m = end.size // w
    for j in range(w):
        row[j] = 0.0
        for l in range(m):
            row[j] += weights[at + l] * end[l * w + j]
    for j in range(w):
        entry = 0.0
        for i in range(j + 1):
            entry += row[i] * X[i, j]
        total += entry * entry
    return math.sqrt(total)


@rare
def solve(form, state, scratch):
    """Estimate from the outputs at hand: state.z, its deviations, and the variance of the next prediction.

    Return whether these tell the unknowns apart.
    """
    m, p, w, s = state.z.size, scratch.y.size, scratch.w.size, scratch.a.size
    count, bounded, n = int(state.own[FILLED]), int(form.bounded), form.Tb.size // state.z.size
    first = int(state.own[AT]) + int(form.length) - count  # of the window, in the ring
    triangularise(scratch.M, collect(form, state, scratch, first, count), w)
    if not invert(scratch.M, w, scratch.X) <= w * WORST:
        return False
    solve_triangular(scratch.M, w, scratch.w)
    for i in range(m):
        for j in range(w):
            at = i * n + j - bounded if j >= bounded else ((count - 1) * m + i) * bounded + j
            scratch.end[i * w + j] = form.Tb[at] if j >= bounded else form.ends[at]
        state.z[i] = along(scratch.end, i * w, scratch.w) + along(form.Ta, i * s, scratch.a)
    for i in range(state.std.size):
        state.std[i] = deviation(scratch.X, form.outlook, i * m, scratch.end, scratch.row)
    for o in range(p):
        state.ahead[o] = (
            square(deviation(scratch.X, form.outlook, (state.std.size + o) * m, scratch.end, scratch.row)) + form.r[o]
        )
    return True
