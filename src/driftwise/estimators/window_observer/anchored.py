"""What nothing was known of at the start of a growing window: its triangle, and how it is handed over.

    z(t) = zhat(t) + X(t) delta + error of covariance U D U'

delta are the elements of z(0) whose prior is infinite. zhat, U, D are the Kalman filter as if delta were 0, X what it
makes of delta, so that each output h z is one row of a triangle that knows delta alone,

    [h X, y - h zhat] / sqrt(T)   into   [R, r],      delta = R^-1 r,   z = zhat + X delta,   P = U D U' + S S'

with S = X R^-1 (Rosenberg, 1973; de Jong, 1991). Nothing is approximated: walks count from the first sample on. Without
walks and priors D = 0 and X = Phi^t, which is least squares in the state at the window's START: a stable mode fades in
X and leaves R as it is, while the state at the end would be known worse and worse conditioned.
"""

import math

from ...engine.dispatch import rare
from ...engine.elementary import hypot, log
from ...engine.qr import invert, solve_triangular
from ...engine.ud import entry, orthogonalise

# what a row keeps of the start: 1 while delta is apart; of all rows so far their squares, log variances and number
START = ("anchored", "squares", "logdet", "outputs")
ANCHORED, SQUARES, LOGDET, OUTPUTS = range(len(START))


@rare
def begin(form, state):
    """Set the prior."""
    d = state.X.shape[1]
    for j in range(state.U.size):
        state.U[j] = 0.0
    for i in range(state.zhat.size):
        state.zhat[i], state.D[i] = form.mean[i], form.prior[i]
        for j in range(d):
            state.X[i, j] = 1.0 if form.free[j] == i else 0.0
    for i in range(d + 1):
        for j in range(d):
            state.R[i, j] = 0.0
    for i in range(state.start.size):
        state.start[i] = 0.0
    state.start[ANCHORED] = 1.0 if d > 0 else 0.0


@rare
def orthonormalise(X):
    """Make the columns of X orthonormal (Gram and Schmidt). Where nothing has been measured yet it is the space that
    counts, and what grows in a gap would soon leave only one direction of it.
    """
    m, d = X.shape
    for j in range(d):
        for l in range(j):
            share = 0.0
            for i in range(m):
                share += X[i, l] * X[i, j]
            for i in range(m):
                X[i, j] -= share * X[i, l]
        size = 0.0
        for i in range(m):
            size += X[i, j] * X[i, j]
        for i in range(m):
            X[i, j] /= math.sqrt(size)


@rare
def add(R, row):
    """Rotate a row [h, e] into the triangle [R, r] (Givens); return the square that is left of e: not of delta.

    R lies transposed, as `kernel.qr` has it.
    """
    d = R.shape[1]
    for j in range(d):
        if row[j] != 0.0:
            size = hypot(R[j, j], row[j])
            c, s = R[j, j] / size, row[j] / size
            for i in range(j, d + 1):
                old = R[i, j]
                R[i, j] = c * old + s * row[i]
                row[i] = c * row[i] - s * old
    return row[d] * row[d]


@rare
def resolve(state, scratch):
    """Fill delta, S = X R^-1 and work.z = zhat + X delta; return the condition of R, its columns of length one."""
    R, delta, d = state.R, scratch.delta, state.R.shape[1]
    condition = invert(R, d, scratch.inverse)
    if condition == math.inf:
        return condition
    solve_triangular(R, d, delta)
    for i in range(state.zhat.size):
        scratch.z[i] = state.zhat[i]
        for j in range(d):
            scratch.z[i] += state.X[i, j] * delta[j]
            scratch.S[i, j] = 0.0
            for l in range(j + 1):
                scratch.S[i, j] += state.X[i, l] * scratch.inverse[l, j]
    return condition


@rare
def refactor(state, scratch, columns):
    """U D U' <- Y diag(weight) Y', the first columns of the scratch: compiled once for all that ends here."""
    orthogonalise(scratch.Y, scratch.weight, scratch.g, state.D.size, columns, state.U, state.D, False)


@rare
def fold(state, scratch):
    """Hand delta over to zhat and U D U' <- U D U' + S S': S is a square root, nothing is squared on the way."""
    m, d = state.X.shape
    for i in range(m):
        state.zhat[i], scratch.weight[i] = scratch.z[i], state.D[i]
        for j in range(m):
            scratch.Y[i, j] = entry(state.U, i, j) if i <= j else 0.0
        for j in range(d):
            scratch.Y[i, m + j] = scratch.S[i, j]
            state.X[i, j] = 0.0
    for j in range(d):
        scratch.weight[m + j] = 1.0
    refactor(state, scratch, m + d)
    for j in range(d):
        state.start[LOGDET] += 2.0 * log(abs(state.R[j, j]))
        for i in range(d + 1):
            state.R[i, j] = 0.0
    state.start[ANCHORED] = 0.0
