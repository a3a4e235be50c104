"""Stretches of time, what each has taught about a state that moves without noise, and how two become one.

The state w = [s; v] moves by s' = As s + Bs u, v' = Au v + Bu u: s holds what decays or stays, v what grows.
A segment from time a to time b knows

    s(b) = F s(a) + d,    v(a) = G v(b) + g,    sum of squares = |R [s(a); v(b)] - z|^2 + what no w explains

so that each mode is told where it is large: nothing ever grows, and no transition is ever inverted. `combine` is
associative, by orthogonal transformations alone; it is never undone. A segment is one row of numbers (`Places`).
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import matrix_balance, null_space

from ...engine.dispatch import kernel, rare
from ...engine.expm import exponential, product
from ...engine.layout import Field, Layout, each
from ...engine.qr import triangularise
from ..arx.row import HUGE


def coordinates(frame, A, n):
    """Return V, its inverse and s: z = V [s; v], of a `gains.Coordinates`; units balanced by powers of two.

    The states behind the first n (disturbances, which never grow) are the last of s, but for their units.
    """
    V, back, m, s = frame.Ta, frame.to_a, len(A), frame.Ta.shape[1]
    if s < m:
        own = V[n:]
        basis = np.vstack([null_space(own).T, own]) if m > n else np.eye(s)
        V, back = V @ np.linalg.inv(basis), basis @ back
    V, back = np.hstack([V, frame.Tb]), np.vstack([back, frame.to_b])
    V[n:], back[s - (m - n) : s] = np.eye(m - n, m, s - (m - n)), np.eye(m - n, m, n)  # so they are, but for round-off
    _, (scale, _) = matrix_balance(back @ A @ V, permute=False, separate=True)
    return V * scale, back / scale[:, None], s


class Places(NamedTuple):
    """Sizes, and where numbers lie: in a segment, in the plant, in what an interval does."""

    s: int
    v: int
    m: int
    k: int
    p: int
    straight: int  # 1: the input is a straight line between its samples, 0: it is held
    d: int  # of a `SEGMENT`
    G: int
    g: int
    R: int
    rows: int
    seconds: int
    size: int
    B: int  # of a `PLANT`
    Au: int
    Bu: int
    E: int
    D: int
    weight: int
    ahead: int  # of `MOVES`, of an interval
    back: int
    moves: int


SEGMENT = Layout(
    Field("F", ("s", "s")),
    Field("d", ("s",)),
    Field("G", ("v", "v")),
    Field("g", ("v",)),
    Field("R", ("m", "m + 1"), "[R | z], upper triangular"),
    Field("rows", (), "how many of its rows are in use"),
    Field("seconds", (), "how long it is"),
    given=("s", "m", "k"),
    v="m - s",
)
PLANT = Layout(
    Field("As", ("s", "s")),
    Field("B", ("s", "k")),
    Field("Au", ("v", "v")),
    Field("Bu", ("v", "k")),
    Field("E", ("p", "m"), "H / noise deviation"),
    Field("D", ("p", "k"), "likewise"),
    Field("weight", ("p",), "1 / noise deviation"),
    given=("s", "m", "k", "p"),
    v="m - s",
)
MOVES = Layout(
    *each("stay", stays="s: F, whole and slope"),
    *each("grow", ahead="the same of v", back="and of v backwards"),
    given=("s", "m", "k"),
    stay="s * (s + 2 * k)",
    grow="(m - s) * (m - s + 2 * k)",
)
segment_places, plant_places, moves_places = kernel(SEGMENT.places), kernel(PLANT.places), kernel(MOVES.places)
segment_size, moves_size = kernel(SEGMENT.size), kernel(MOVES.size)


@kernel
def places(s, m, k, p, straight):
    """Return the places for s modes that stay and m - s that grow, k inputs and p outputs."""
    own, plant, moves = segment_places(s, m, k), plant_places(s, m, k, p), moves_places(s, m, k)
    return Places(
        s, m - s, m, k, p, straight,
        own.d, own.G, own.g, own.R, own.rows, own.seconds, segment_size(s, m, k),
        plant.B, plant.Au, plant.Bu, plant.E, plant.D, plant.weight,
        moves.ahead, moves.back, moves_size(s, m, k),
    )  # fmt: skip


@rare
def find_moves(at, plant, seconds, moves, powers):
    """Fill in what so many seconds do to s, to v, and to v backwards: F, whole and slope (`kernel.expm`)."""
    s, v, k = at.s, at.v, at.k
    exponential(plant, plant[at.B :], s, k, seconds, moves, moves[s * s :], moves[s * (s + k) :], powers)
    if v > 0:
        Au, Bu, F, R = plant[at.Au :], plant[at.Bu :], moves[at.ahead :], moves[at.back :]
        exponential(Au, Bu, v, k, seconds, F, F[v * v :], F[v * (v + k) :], powers)
        exponential(Au, Bu, v, k, -seconds, R, R[v * v :], R[v * (v + k) :], powers)


@kernel
def driven(at, moves, where, n, i, first, last):
    """Return what the input, ``first`` and ``last`` at the two ends, adds to mode i of the n that lie there."""
    whole, total = where + n * n + i * at.k, 0.0
    for l in range(at.k):
        total += moves[whole + l] * first[l]
        if at.straight:
            total += moves[whole + n * at.k + l] * (last[l] - first[l])
    return total


@kernel
def stand(at, c):
    """Make c a segment of no time."""
    for i in range(at.s):
        for j in range(at.s):
            c[i * at.s + j] = 1.0 if i == j else 0.0
        c[at.d + i] = 0.0
    for i in range(at.v):
        for j in range(at.v):
            c[at.G + i * at.v + j] = 1.0 if i == j else 0.0
        c[at.g + i] = 0.0
    c[at.rows] = c[at.seconds] = 0.0


@rare
def travel(at, c, moves, seconds, before, after):
    """Make c a segment without samples over so many seconds, the input being ``before`` and ``after`` at its ends."""
    for i in range(at.s * at.s):
        c[i] = moves[i]
    for i in range(at.s):
        c[at.d + i] = driven(at, moves, 0, at.s, i, before, after)
    for i in range(at.v * at.v):
        c[at.G + i] = moves[at.back + i]
    for i in range(at.v):  # backwards a line starts at its end; what is held is the same
        first, last = (after, before) if at.straight else (before, after)
        c[at.g + i] = driven(at, moves, at.back, at.v, i, first, last)
    c[at.rows], c[at.seconds] = 0.0, seconds


@rare
def measure(at, plant, c, y, u, is_end, M):
    """Let segment c, which knows nothing yet, see outputs y (NaN or huge: missing) at its end, or else at its start."""
    rows = 0
    for i in range(at.p):
        if not abs(y[i]) < HUGE:
            continue
        e, rhs = at.E + i * at.m, y[i]
        for l in range(at.k):
            rhs -= plant[at.D + i * at.k + l] * u[l]
        rhs *= plant[at.weight + i]
        for j in range(at.s):
            total = plant[e + j]
            if is_end:
                total = 0.0
                for l in range(at.s):
                    total += plant[e + l] * c[l * at.s + j]
                rhs -= plant[e + j] * c[at.d + j]
            M[j, rows] = total
        for j in range(at.v):
            total = plant[e + at.s + j]
            if not is_end:
                total = 0.0
                for l in range(at.v):
                    total += plant[e + at.s + l] * c[at.G + l * at.v + j]
                rhs -= plant[e + at.s + j] * c[at.g + j]
            M[at.s + j, rows] = total
        M[at.m, rows] = rhs
        rows += 1
    keep(at, c, M, rows)


@kernel
def keep(at, c, M, rows):
    """Make the rows stacked in M those of c; the others are 0, for c may become part of a state."""
    triangularise(M, rows, at.m)
    rows = min(rows, at.m)
    for i in range(at.m):
        for j in range(at.m + 1):
            c[at.R + i * (at.m + 1) + j] = M[j, i] if i < rows else 0.0
    c[at.rows] = rows


@rare
def combine(at, a, b, c, M):
    """Make c the segment of a, and then b: v at the end of a, and s at the start of b, are told by the other one."""
    s, v, m = at.s, at.v, at.m
    above, below = int(a[at.rows]), int(b[at.rows])
    for i in range(above):
        r = at.R + i * (m + 1)
        rhs = a[r + m]
        for j in range(s):
            M[j, i] = a[r + j]
        for j in range(v):
            total = 0.0
            for l in range(v):
                total += a[r + s + l] * b[at.G + l * v + j]
            M[s + j, i] = total
            rhs -= a[r + s + j] * b[at.g + j]
        M[m, i] = rhs
    for i in range(below):
        r = at.R + i * (m + 1)
        rhs = b[r + m]
        for j in range(s):
            total = 0.0
            for l in range(i, s):  # R is triangular
                total += b[r + l] * a[l * s + j]
            M[j, above + i] = total
            rhs -= b[r + j] * a[at.d + j]
        for j in range(v):
            M[s + j, above + i] = b[r + s + j]
        M[m, above + i] = rhs
    keep(at, c, M, above + below)
    product(b, a, c, s, s, s)
    product(b, a[at.d :], c[at.d :], s, s, 1)
    product(a[at.G :], b[at.G :], c[at.G :], v, v, v)
    product(a[at.G :], b[at.g :], c[at.g :], v, v, 1)
    for i in range(s):
        c[at.d + i] += b[at.d + i]
    for i in range(v):
        c[at.g + i] += a[at.g + i]
    c[at.seconds] = a[at.seconds] + b[at.seconds]


@kernel
def copy(a, c):
    """Make c equal to a."""
    for i in range(a.size):
        c[i] = a[i]
