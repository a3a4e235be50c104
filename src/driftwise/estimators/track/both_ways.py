"""Two filters meet: what the past says of each instant, what the future says, and how well each pair agrees.

    pair (i, j)     x = xi + Pi (Pi + Pj)^-1 (xj - xi),   P = Pi - Pi (Pi + Pj)^-1 Pi
    its weight      wi uj p(i, j) N(xi - xj; 0, Pi + Pj)^rate, over positions and velocities

i is a member after the plots up to the instant, j one that comes from the end of the record, before the instant's plot
and without what it thought of velocities beforehand (`remembered`). The smoothed state is the mixture of all pairs.

Two-filter smoothing (Fraser and Potter 1969), of jumping models (Helmick, Blair and Hoffman 1995).
"""

import math
from typing import NamedTuple

from ...engine.dispatch import kernel, pass_over
from ...engine.elementary import exp, log
from . import bank, output, remembered

FAINT = 10.0  # log weight below the best pair's at which one no longer counts


class BothWays(NamedTuple):
    """How two passes are joined."""

    coordinates: float
    rate: float  # what the agreement of a pair counts: as the evidence of a plot
    stay: float  # log odds of the same member before and after, against any other


@kernel
def factor(A, n):
    """Replace the lower triangle of A by its Cholesky factor; return the log determinant, NaN where there is none."""
    total = 0.0
    for j in range(n):
        d = A[j, j]
        for k in range(j):
            d -= A[j, k] * A[j, k]
        if not d > 1e-13 * A[j, j]:
            return math.nan
        A[j, j] = math.sqrt(d)
        total += 2.0 * log(A[j, j])
        for i in range(j + 1, n):
            for k in range(j):
                A[i, j] -= A[i, k] * A[j, k]
            A[i, j] /= A[j, j]
    return total


@kernel
def forward_solve(A, n, b):
    """Replace b by the solution of A x = b, A lower triangular."""
    for i in range(n):
        for k in range(i):
            b[i] -= A[i, k] * b[k]
        b[i] /= A[i, i]


@kernel
def unpack(member, n, x, V):
    """Fill mean and covariance from what is kept of a member."""
    at = 1 + n
    for i in range(n):
        x[i] = member[1 + i]
        for j in range(i, n):
            V[i, j] = V[j, i] = member[at]
            at += 1


@kernel
def agreement(C, xi, Vi, xj, Vj, S, e):
    """Return the log density of two members' positions and velocities agreeing; NaN where it cannot be told."""
    for a in range(2 * C):
        at = 3 * (a // 2) + a % 2
        e[a] = xj[at] - xi[at]
        for b in range(a + 1):
            bt = 3 * (b // 2) + b % 2
            S[a, b] = Vi[at, bt] + Vj[at, bt]
    total = -0.5 * factor(S, 2 * C)
    forward_solve(S, 2 * C, e)
    for a in range(2 * C):
        total -= 0.5 * e[a] * e[a]
    return total


@kernel
def fuse(n, xi, Vi, xj, Vj, S, G, x, V):
    """Fill x and V with the product of two normal densities; 0 where the sum of their covariances has no root."""
    for a in range(n):
        x[a] = xj[a] - xi[a]
        for b in range(n):
            S[a, b], G[a, b] = Vi[a, b] + Vj[a, b], Vi[a, b]
    if not math.isfinite(factor(S, n)):
        return 0.0
    forward_solve(S, n, x)
    for a in range(n):  # row a of G becomes S^-1/2 Vi e_a
        forward_solve(S, n, G[a])
    for a in range(n):
        for b in range(n):
            V[a, b] = Vi[a, b]
            for k in range(n):
                V[a, b] -= G[a, k] * G[b, k]
    for a in range(n):
        S[a, a] = xi[a]
        for k in range(n):
            S[a, a] += G[a, k] * x[k]
    for a in range(n):
        x[a] = S[a, a]
        V[a, a] = max(V[a, a], 0.0)
    return 1.0


@pass_over.on(BothWays)
def pass_over_both_ways(task, rows, q, kept, out, numbers):
    """Fill state, covariance and turn of ``out`` (T, columns) from members of the past ``rows`` and future ``q``."""
    C = int(task.coordinates)
    n, K, size = 3 * C, remembered.told(C), remembered.each(C)
    xi, xj, x, e = kept[0, :n], kept[1, :n], kept[2, :n], kept[3, :n]
    score, Vi, Vj = kept[4 : 4 + K], kept[4 + K : 4 + K + n], kept[4 + K + n : 4 + K + 2 * n]
    S, G, V = kept[4 + K + 2 * n :], kept[4 + K + 3 * n :], kept[4 + K + 4 * n :]
    total = kept[4 + K + 5 * n :]
    at_state, at_spread = bank.sample_at(C).state, bank.sample_at(C).covariance
    for k in range(rows.shape[0]):
        best, sum_i, sum_j = -math.inf, -math.inf, -math.inf
        for i in range(K):
            sum_i, sum_j = max(sum_i, rows[k, i * size]), max(sum_j, q[k, i * size])
        if not (math.isfinite(sum_i) and math.isfinite(sum_j)):
            continue
        for i in range(K):
            for j in range(K):
                prior = rows[k, i * size] - sum_i + q[k, j * size] - sum_j + (task.stay if i == j else 0.0)
                score[i, j] = -math.inf
                if prior > -2.0 * FAINT - 10.0:
                    unpack(rows[k, i * size : (i + 1) * size], n, xi, Vi)
                    unpack(q[k, j * size : (j + 1) * size], n, xj, Vj)
                    evidence = agreement(C, xi, Vi, xj, Vj, S, e)
                    if math.isfinite(evidence):
                        score[i, j] = prior + task.rate * evidence
                        best = max(best, score[i, j])
        if not math.isfinite(best):
            continue
        share = 0.0
        mean = out[k, at_state : at_state + n]
        first = mean[0]
        for i in range(K):
            for j in range(K):
                if score[i, j] < best - FAINT:
                    continue
                unpack(rows[k, i * size : (i + 1) * size], n, xi, Vi)
                unpack(q[k, j * size : (j + 1) * size], n, xj, Vj)
                if fuse(n, xi, Vi, xj, Vj, S, G, x, V) == 0.0:
                    continue
                w = exp(score[i, j] - best)
                before, share = share, share + w
                old, new = before / share, w / share
                for a in range(n):
                    if before == 0.0:
                        mean[a] = x[a]
                    for b in range(a, n):
                        apart = (x[a] - mean[a]) * (x[b] - mean[b])
                        total[a, b] = V[a, b] if before == 0.0 else old * total[a, b] + new * (V[a, b] + old * apart)
                if before > 0.0:
                    for a in range(n):
                        mean[a] += new * (x[a] - mean[a])
        if share == 0.0:
            mean[0] = first
            continue
        at = at_spread
        for a in range(n):
            for b in range(a, n):
                out[k, at] = total[a, b]
                at += 1
        for c in range(C):
            mean[3 * c] += numbers[c]
        output.tell_turn(C, out[k])


def room(C) -> tuple[int, int]:
    """Return the shape of the room that it needs."""
    K, n = remembered.told(C), 3 * C
    return 4 + K + 6 * n, max(K, n)
