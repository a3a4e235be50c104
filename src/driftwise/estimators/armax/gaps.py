"""What a gap leaves unknown in the regressors of the general family: its covariance S, carried and corrected.

For known parameters this is the Kalman filter of the noise C/(A D) e.
"""

from ...engine.dispatch import kernel, rare
from ...engine.ud import variance
from ..arx.row import HOLD, SKIP
from .follow import correct_gradient

CLEAR = 1e-6  # a variance below this fraction of the noise is none
FAINT = 0.3  # below this fraction of the noise what moving parameters leave unknown is not told, and counts as noise
ENOUGH = 0.01  # the same where uncertain samples teach nothing, and where it comes again at every sample


@kernel
def regressor_variance(form, state, kept, s2):
    """Let uncertain inputs enter S; return the variance that S adds to the prediction."""
    if form.missing == HOLD:
        return 0.0
    S, theta, at = kept.S, state.theta, state.ys.size
    for l in range(state.held.size):
        if form.nb[l] > 0.0:
            q = state.us_variance[l, int(form.nk[l])]
            if q > 0.0:
                S[at, at] = q
                kept.is_uncertain[0] = 1.0
        at += int(form.nb[l])
    if kept.is_uncertain[0] == 0.0:
        return 0.0
    size, added = 0.0, 0.0
    for i in range(theta.size):
        if S[i, i] > 0.0:
            free = s2 * S[i, i] * variance(state.U, state.D, i)
            size += free + S[i, i] * theta[i] * theta[i]
            added += free
        for j in range(theta.size):
            added += theta[i] * S[i, j] * theta[j]
    if size < (ENOUGH if form.missing == SKIP or form.follows > 0.0 else CLEAR) * s2 * form.R:
        kept.is_uncertain[0] = 0.0
        for i in range(theta.size):
            for j in range(theta.size):
                S[i, j] = 0.0
        return 0.0
    return max(added, 0.0) if form.follows == 0.0 or added > FAINT * s2 * form.R else 0.0


@rare
def revise(form, state, kept, room, y, y_variance, free):
    """Correct the regressors by a measured y (Kalman), and carry their covariance to the next sample.

    The error of e is -theta' times that of phi where y is measured, new noise n where it is missing; the next errors
    are M times those of phi, plus n where e enters.
    """
    S, M, MS, phi, g, theta = kept.S, room.M, room.MS, room.phi, room.g, state.theta
    N, na, nc, nd = theta.size, state.ys.size, int(form.nc), int(form.nd)
    is_missing = y_variance > 0.0
    s, e = 0.0, y
    for i in range(N):
        g[i] = 0.0
        for j in range(N):
            g[i] += S[i, j] * theta[j]
        s += theta[i] * g[i]
        e -= phi[i] * theta[i]
    if is_missing and s >= y_variance:  # lost
        s = 0.0
        for i in range(N):
            for j in range(N):
                S[i, j] = 0.0
    if not is_missing:
        T = s + room.s2[0] * form.R
        if form.follows > 0.0:
            correct_gradient(kept, room, theta, free, T)
        for i in range(N):
            phi[i] += g[i] * (e / T)
            for j in range(N):
                S[i, j] -= g[i] * g[j] / T
        put_back(form, state, kept, phi)

    kept.is_uncertain[0] = 1.0
    for i in range(N):
        for j in range(N):
            M[i, j] = 1.0 if j == i - 1 else 0.0
    if na > 0:
        for j in range(N):
            M[0, j] = -theta[j] if is_missing else 0.0
    if nc > 0:
        for j in range(N):
            M[free, j] = 0.0 if is_missing else -theta[j]
    if nd > 0:
        for j in range(N):
            is_coloured = free <= j < free + nc + nd
            M[free + nc, j] = (-theta[j] if is_coloured else 0.0) if is_missing else (0.0 if is_coloured else theta[j])
    b, f = na, free + nc + nd
    for l in range(state.held.size):
        nb, nf = int(form.nb[l]), int(form.nf[l])
        if nb > 0:
            for j in range(N):
                M[b, j] = 0.0
        if nf > 0:
            for j in range(N):
                M[f, j] = -theta[j] if b <= j < b + nb or f <= j < f + nf else 0.0
        b += nb
        f += nf
    if form.offset != 0.0:
        for j in range(N):
            M[N - 1, j] = 0.0
    for i in range(N):
        for j in range(N):
            MS[i, j] = 0.0
            for k in range(N):
                MS[i, j] += M[i, k] * S[k, j]
    for i in range(N):
        for j in range(N):
            S[i, j] = 0.0
            for k in range(N):
                S[i, j] += MS[i, k] * M[j, k]
    if is_missing:
        n = max(y_variance - s, room.s2[0] * form.R)
        for i in range(N):
            g[i] = 0.0
        if na > 0:
            g[0] = -1.0
        if nc > 0:
            g[free] = 1.0
        if nd > 0:
            g[free + nc] = -1.0
        for i in range(N):
            for j in range(N):
                S[i, j] += n * g[i] * g[j]


@kernel
def put_back(form, state, kept, phi):
    """Write corrected regressors back where they came from."""
    at = state.ys.size
    for i in range(at):
        state.ys[i] = -phi[i]
    for l in range(state.held.size):
        first = int(form.nk[l])
        for lag in range(first, first + int(form.nb[l])):
            state.us[l, lag] = phi[at]
            at += 1
    for m in range(kept.r.size):
        kept.r[m] = phi[at + m]
