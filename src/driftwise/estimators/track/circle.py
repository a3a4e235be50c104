"""Members that turn: an extended Kalman filter of E, vE, N, vN and the turn rate omega, which walks.

Li and Jilkov (2003), section V: coordinated turn with unknown rate; the transition is exact, its slope to first order.
"""

from ...engine.dispatch import kernel
from ...engine.elementary import cos, hypot, sin, square
from ...models.manoeuvre import arc
from . import linear
from .bank import CIRCULAR, STRAIGHT, TURNS, at_circle, at_linear

N = 5
P = 5  # of a member's numbers; E, vE, N, vN, omega before it, scales of the noise behind
RATE = 1e-3  # variance by which the turn between two plots walks, rad^2
FIRST = 0.01  # .. and of what it is at first
SHARPEST = 1.5  # rad between two plots
OF = (0, 1, 3, 2, 3, 1)  # of E, vE, N, vN: what each of E, vE, aE, N, vN, aN is made of, the turn rate aside
LOST = 20.0  # periods without a plot after which nobody knows how far it has turned
LINE = tuple(STRAIGHT.index((0.0, q)) for q in TURNS)  # the member of constant velocity with the same noise


@kernel
def begin(row, C, i, T, fastest, unit):
    """Start one on the first plot."""
    at = at_circle(C, i)
    row[at : at + CIRCULAR] = 0.0
    for c in range(C):
        row[at + P + index(2 * c, 2 * c)] = unit[c]
        row[at + P + index(2 * c + 1, 2 * c + 1)] = fastest * fastest
        row[at + CIRCULAR + c] = 1.0
    row[at + P + index(4, 4)] = FIRST / square(T)


@kernel
def index(i, j):
    """Return where entry i <= j of the upper triangle stands."""
    return i * N - i * (i - 1) // 2 + j - i


@kernel
def predict(row, C, i, T, d, unit, F, A, B):
    """Take one d seconds on, after the members of constant velocity; F, A and B are room for 5 x 5 numbers each."""
    at = at_circle(C, i)
    if d > LOST * T:
        start_over(row, C, i, T, unit)
        return
    vE, vN, angle = row[at + 1], row[at + 3], row[at + 4] * d
    s, c, ds, dc = arc(row[at + 4], d)
    co, si = cos(angle), sin(angle)
    F[0, 1], F[0, 3], F[0, 4] = s, c, vE * ds + vN * dc  # F is the identity else, but for F[1, 1] and F[3, 3]
    F[1, 1], F[1, 3], F[1, 4] = co, si, (vN * co - vE * si) * d
    F[2, 1], F[2, 3], F[2, 4] = -c, s, vN * ds - vE * dc
    F[3, 1], F[3, 3], F[3, 4] = -si, co, -(vN * si + vE * co) * d
    row[at] += vE * s + vN * c
    row[at + 2] += vN * s - vE * c
    row[at + 1], row[at + 3] = vE * co + vN * si, vN * co - vE * si
    for j in range(N):
        for k in range(j, N):
            A[j, k] = A[k, j] = row[at + P + index(j, k)]
    for k in range(N):
        B[0, k] = A[0, k] + F[0, 1] * A[1, k] + F[0, 3] * A[3, k] + F[0, 4] * A[4, k]
        B[1, k] = F[1, 1] * A[1, k] + F[1, 3] * A[3, k] + F[1, 4] * A[4, k]
        B[2, k] = F[2, 1] * A[1, k] + A[2, k] + F[2, 3] * A[3, k] + F[2, 4] * A[4, k]
        B[3, k] = F[3, 1] * A[1, k] + F[3, 3] * A[3, k] + F[3, 4] * A[4, k]
        B[4, k] = A[4, k]
    q = TURNS[i] * 0.5 * (unit[0] * row[at + CIRCULAR] + unit[1] * row[at + CIRCULAR + 1]) / (T * T * T)
    for j in range(N):
        A[j, 0] = B[j, 0] + B[j, 1] * F[0, 1] + B[j, 3] * F[0, 3] + B[j, 4] * F[0, 4]
        A[j, 1] = B[j, 1] * F[1, 1] + B[j, 3] * F[1, 3] + B[j, 4] * F[1, 4]
        A[j, 2] = B[j, 1] * F[2, 1] + B[j, 2] + B[j, 3] * F[2, 3] + B[j, 4] * F[2, 4]
        A[j, 3] = B[j, 1] * F[3, 1] + B[j, 3] * F[3, 3] + B[j, 4] * F[3, 4]
        A[j, 4] = B[j, 4]
        for k in range(j, N):
            row[at + P + index(j, k)] = max(A[j, k], 0.0) if j == k else A[j, k]
    for j in range(2):
        row[at + P + index(2 * j, 2 * j)] += q * d * d * d / 3
        row[at + P + index(2 * j, 2 * j + 1)] += q * d * d / 2
        row[at + P + index(2 * j + 1, 2 * j + 1)] += q * d
    row[at + P + index(4, 4)] += RATE * d / (T * T * T)


@kernel
def speed(row, C, i):
    """Return how fast one is."""
    return hypot(row[at_circle(C, i) + 1], row[at_circle(C, i) + 3])


@kernel
def start_over(row, C, i, T, unit):
    """Take position and velocity from constant velocity: nothing is known of a turn."""
    at = at_circle(C, i)
    row[at : at + CIRCULAR] = 0.0
    for c in range(C):
        line, j = at_linear(C, LINE[i], c), 2 * c
        r = unit[c] * row[line + linear.SCALE]
        row[at + j], row[at + j + 1] = row[line], row[line + 1]
        row[at + P + index(j, j)] = r * row[line + linear.PP]
        row[at + P + index(j, j + 1)] = r * row[line + linear.PV]
        row[at + P + index(j + 1, j + 1)] = r * row[line + linear.VV]
    row[at + P + index(4, 4)] = FIRST / square(T)


@kernel
def correct(row, C, i, c, T, y, r, A):
    """Let coordinate c be measured with variance r; A is room for a column."""
    at, h = at_circle(C, i), 2 * c
    for j in range(N):
        A[0, j] = row[at + P + (index(j, h) if j <= h else index(h, j))]
    S, e, p = A[0, h] + r, y - row[at + h], at + P
    for j in range(N):
        row[at + j] += A[0, j] * e / S
        for k in range(j, N):
            row[p] = linear.corrected(row[p], j, k, h, A[0, j], A[0, k], r, S)
            p += 1
    sharpest = SHARPEST / T
    row[at + 4] = min(max(row[at + 4], -sharpest), sharpest)


@kernel
def member_state(row, C, i, x, V):
    """Fill x and the upper triangle of V: of E, vE, aE, N, vN, aN, to first order; aE = omega vN, aN = -omega vE."""
    at = at_circle(C, i)
    vE, vN, omega = row[at + 1], row[at + 3], row[at + 4]
    x[0], x[1], x[2], x[3], x[4], x[5] = row[at], vE, omega * vN, row[at + 2], vN, -omega * vE
    for j in range(6):
        a, Ja, Jw = OF[j], 1.0, 0.0  # entry j changes with entry a of E, vE, N, vN, omega, and with omega
        if j % 3 == 2:
            Ja, Jw = (omega, vN) if j == 2 else (-omega, -vE)
        for k in range(j, 6):
            b, Jb, Jv = OF[k], 1.0, 0.0
            if k % 3 == 2:
                Jb, Jv = (omega, vN) if k == 2 else (-omega, -vE)
            v = Ja * Jb * row[at + P + index(min(a, b), max(a, b))]
            if k % 3 == 2:
                v += Ja * Jv * row[at + P + index(a, 4)]
            if j % 3 == 2:
                v += Jw * Jb * row[at + P + index(b, 4)]
                if k % 3 == 2:
                    v += Jw * Jv * row[at + P + index(4, 4)]
            V[j, k] = v
