"""Has one parameter jumped? A quotient of sums over the innovations of one filter says so, and needs no other filter.

That parameter i has been wrong by d since the trial began shows in the innovations of a filter that does not know as
psi' F_i d, F_i its sensitivity to its own start: F <- (I - K psi') F, F <- Phi F. Given those, d is a regression of
one unknown. Source: Willsky and Jones (1976), "A generalized likelihood ratio approach to the detection and estimation
of jumps in linear systems", IEEE Trans. AC-21, 108-112, with a prior of d in place of a maximum.
"""

import math

from ..engine.dense import add_square
from ..engine.dispatch import kernel
from ..engine.elementary import exp, log
from .auto_constants import LONE, SLIGHT
from .modes import mode
from .trial_state import ALONE, SAME, WHICH


@kernel
def weigh_alone(trial, error, rho, T, view, unit, s2):
    """Take a sample of the first copy into the evidence for a jump of one parameter; view.b is its P psi."""
    N, head, gain, best, total = unit.size, trial.head, (1.0 - rho) / T, 0.0, 0.0
    for i in range(N):
        column, c = trial.F[i * N : (i + 1) * N], 0.0
        for j in range(N):
            c += view.psi[j] * column[j]
        if view.fresh.size > 0:
            c += view.fresh[i] - view.psi[i]
        trial.known[i] += gain * c * c
        trial.score[i] += gain * c * error
        for j in range(N):
            column[j] -= view.b[j] * gain * c
        view.c[i] = 0.5 * trial.score[i] * trial.score[i] * spread_alone(trial, unit, i) / s2
        if view.c[i] > best:
            best, head[WHICH] = view.c[i], i
    head[ALONE] = 0.0
    if best > SLIGHT:
        for i in range(N):
            total += exp(view.c[i] - best) / math.sqrt(1.0 + LONE * unit[i] * trial.known[i])
        head[ALONE] = best + log(total / N)


@kernel
def spread_alone(trial, unit, i):
    """Return the variance of the jump of parameter i, if it jumped: as known as its information allows."""
    wide = LONE * unit[i]
    return wide / (1.0 + wide * trial.known[i])


@kernel
def move_alone(trial, unit, sign):
    """Let the first copy be what it is if its likeliest parameter jumped (sign 1), or undo that (-1)."""
    N = unit.size
    i, half = int(trial.head[WHICH]), N * (N + 1) // 2
    column, one, v = trial.F[i * N : (i + 1) * N], mode(trial.copies, SAME, N), spread_alone(trial, unit, i)
    for j in range(N):
        one.theta[j] += sign * v * trial.score[i] * column[j]
    add_square(trial.dense[SAME * half : (SAME + 1) * half], sign * v, column)


@kernel
def alone(trial, psi, unit):
    """Return by how much a jump of the likeliest parameter moves a prediction, and what it adds to its variance."""
    N = unit.size
    i, c = int(trial.head[WHICH]), 0.0
    for j in range(N):
        c += psi[j] * trial.F[i * N + j]
    v = spread_alone(trial, unit, i)
    return c * v * trial.score[i], c * c * v
