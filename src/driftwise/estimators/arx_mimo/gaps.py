"""What a gap leaves unknown in the past outputs of all equations: one covariance S of their errors, (M, M), M = p past.

Equation i predicts with an error e_i = c_i' errors + its own; errors of its own are taken for independent of those of
the others. With one output this is `recursive.gaps`, bit for bit; negative variances are as there.
"""

from ...engine.dispatch import kernel, rare
from ...engine.ud import entry
from ..arx.gaps import is_clear
from ..arx.row import renew, tell
from .row import FRESH, Channel

Y, Y_VARIANCE, E, T, SHARE = range(FRESH)  # of `Work.fresh`: as `renew` has them; what S added to T


@renew.on(Channel)
def renew_channel(form, state, scratch, y, y_variance, e, variance):
    """Note the output; all are taken at once."""
    fresh, past, M = state.fresh, state.all_ys.shape[1], state.all_ys.size
    fresh[Y], fresh[Y_VARIANCE], fresh[E], fresh[T] = y, y_variance, e, variance
    if y_variance != 0.0 or not is_clear(state.all_covariance, M):
        for m in range(M):
            fresh[FRESH + m] = 0.0
        at = 0
        for j in range(form.past.size):
            for lag in range(int(form.past[j])):
                fresh[FRESH + j * past + lag] = -state.theta[at]
                at += 1
    return 0


@tell.on(Channel)
def tell_channel(form, memory, state, scratch, view):
    """Regressors that are data leave theta and P alone."""


@rare
def spread_over(form, state, s2):
    """Return what errors of the past outputs add to the variance of the prediction of an equation."""
    S, theta, U, D, past, M = (
        state.all_covariance,
        state.theta,
        state.U,
        state.D,
        state.all_ys.shape[1],
        state.all_ys.size,
    )
    total, a = 0.0, 0
    for i in range(form.past.size):
        for lag in range(int(form.past[i])):
            b = 0
            for j in range(form.past.size):
                for other in range(int(form.past[j])):
                    s = S[(i * past + lag) * M + j * past + other]
                    s = abs(s) if a == b else s
                    if s != 0.0:
                        both = 0.0
                        for k in range(max(a, b), D.size):
                            both += entry(U, min(a, b), k) * entry(U, max(a, b), k) * D[k]
                        total += s * (theta[a] * theta[b] + s2 * both)
                    b += 1
            a += 1
    return total


@kernel
def times(S, c, g):
    """g <- S c; return c' S c."""
    M, s = c.size, 0.0
    for i in range(M):
        g[i] = 0.0
        if S[i * M + i] > 0.0:
            for j in range(M):
                g[i] += S[i * M + j] * c[j]
        s += c[i] * g[i]
    return s


@rare
def pass_gap(S, ys, fresh, moved):
    """Correct past outputs by the innovations of this sample, one after the other; let errors of predicted ones in."""
    p, past, M = ys.shape[0], ys.shape[1], ys.size
    for m in range(M):
        moved[m] = 0.0
    was_clear = is_clear(S, M)
    if not was_clear:
        for i in range(p):
            fresh[i, SHARE] = times(S, fresh[i, FRESH : FRESH + M], fresh[i, FRESH + M :])
    for i in range(p):
        if was_clear or not abs(fresh[i, E]) >= 0.0:
            continue
        c, g = fresh[i, FRESH : FRESH + M], fresh[i, FRESH + M :]
        s, e = times(S, c, g), fresh[i, E]
        for m in range(M):
            e -= c[m] * moved[m]
        variance = max(fresh[i, T] + fresh[i, Y_VARIANCE] - (fresh[i, SHARE] - s), s)
        if variance > 0.0:
            for m in range(M):
                moved[m] += g[m] * (e / variance)
                for n in range(M):
                    S[m * M + n] -= g[m] * g[n] / variance
    for i in range(p):
        for lag in range(past):
            ys[i, lag] += moved[i * past + lag]

    for i in range(p):
        c, g = fresh[i, FRESH : FRESH + M], fresh[i, FRESH + M :]
        is_predicted = fresh[i, Y_VARIANCE] > 0.0 and not abs(fresh[i, E]) >= 0.0
        if not is_predicted or fresh[i, Y] == 0.0 or was_clear:  # measured, or lost: nothing in common with the past
            for m in range(M):
                g[m] = 0.0
                c[m] = 0.0
            if not is_predicted:
                fresh[i, Y_VARIANCE] = -fresh[i, Y_VARIANCE]
        else:
            fresh[i, Y_VARIANCE] -= fresh[i, SHARE] - times(S, c, g)
            for m in range(M):
                fresh[i, Y] += c[m] * moved[m]
    for a in range(past - 1, -1, -1):
        for b in range(past - 1, -1, -1):
            for i in range(p):
                for j in range(p):
                    at = (i * past + a) * M + j * past + b
                    if a > 0 and b > 0:
                        S[at] = S[at - M - 1]
                    elif a > 0:
                        S[at] = fresh[j, FRESH + M + i * past + a - 1]
                    elif b > 0:
                        S[at] = fresh[i, FRESH + M + j * past + b - 1]
                    else:
                        S[at] = fresh[i, Y_VARIANCE] if i == j else 0.0
    for i in range(p):
        for j in range(p):
            if i != j and past > 0:
                s = 0.0
                for m in range(M):
                    s += fresh[i, FRESH + m] * fresh[j, FRESH + M + m]
                S[i * past * M + j * past] = s
