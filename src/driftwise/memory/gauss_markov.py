"""The time update of parameters that relax and wander: theta <- Phi theta, P <- Phi P Phi' + Q on P = U D U'."""

from ..engine.dispatch import kernel
from ..engine.ud import variance, widen, widen_along

FORGOTTEN = 1e-280  # a variance that relaxed to nothing: the column of U, relative to it, would overflow


@kernel
def widen_within(U, D, i, q, cap, scratch):
    """Add variance q to element i, at most up to cap; say whether all of it found room."""
    if q <= 0.0:
        return True
    room = cap - variance(U, D, i)
    widen(U, D, i, min(q, max(room, 0.0)), scratch)
    return room >= q


@kernel
def relax(theta, U, D, phi, a):
    """theta <- Phi theta, P <- Phi P Phi' for the last ``phi.size`` unknowns, Phi diagonal; ``a`` is scratch."""
    first = max(D.size - phi.size, 0)
    at = first * (first - 1) // 2
    for j in range(first, D.size):
        share = phi[j - first]
        theta[j] *= share
        column, before = U[at : at + j], D[j]
        D[j] *= share * share
        for i in range(j):
            a[i] = phi[i - first] * column[i] if i >= first else column[i]
            column[i] = a[i] / share if D[j] > FORGOTTEN else 0.0
        if D[j] <= FORGOTTEN:  # what the others shared with this parameter is theirs alone now
            widen_along(U, D, a, before, j - 1)
        at += j
