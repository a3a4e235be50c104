"""How the registers of the general family follow parameters that move: a gradient reaches back no farther than they do.

The registers r (lags of e, -v, -w) were made by past parameters. With W = dr/dtheta their error is W (theta - estimate)
as long as theta stands still. Where it walks, or is set free, P grows by Q, and r tells less of theta: the regression
of its error on that of theta is W P (P + Q)^-1. The rest is an error of its own and enters S, which the samples then
take away. That is the time update of the joint filter of r and theta (Ljung 1979), parameter by parameter: W only
shrinks.
"""

from ...engine.dispatch import kernel
from ...engine.ud import variances


@kernel
def fade(form, state, kept, room, free, s2):
    """Let W and S be those of theta as it is after its time update: its variances were ``kept.variances`` before."""
    dr, S, lost, left, is_moved = kept.dr, kept.S, room.h, room.g, False
    variances(state.U, state.D, lost)
    for i in range(lost.size):
        before, after = kept.variances[i], lost[i]
        left[i] = before / after if 0.0 < before < after else 1.0
        lost[i] = s2 * before * (1.0 - left[i])
        is_moved = is_moved or left[i] < 1.0
    if not is_moved:
        return
    kept.is_uncertain[0] = 1.0
    for m in range(dr.shape[0]):
        for k in range(m + 1):
            added = 0.0
            for i in range(lost.size):
                added += dr[m, i] * lost[i] * dr[k, i]
            S[free + m, free + k] += added
            if k < m:
                S[free + k, free + m] += added
    for m in range(dr.shape[0]):
        for i in range(lost.size):
            dr[m, i] *= left[i]


@kernel
def correct_gradient(kept, room, theta, free, T):
    """W <- W - K dyhat/dtheta, where the registers were corrected by K = g/T times what was measured."""
    dr, g, h = kept.dr, room.g, room.h
    for i in range(theta.size):
        h[i] = room.phi[i]
    for m in range(dr.shape[0]):
        for i in range(theta.size):
            h[i] += theta[free + m] * dr[m, i]
    for m in range(dr.shape[0]):
        k = g[free + m] / T
        for i in range(theta.size):
            dr[m, i] -= k * h[i]
