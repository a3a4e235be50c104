"""Regressors of an adaptive observer: outputs and inputs through a stable filter 1/Lambda(q), and their errors.

    w(t) = v(t) - lambda_1 w(t-1) - .. - lambda_n w(t-n)        for v = y and each input

The registers keep the last n of each w, newest first, and the covariance (n, n) of their errors where a y or u had to
be predicted.
"""

from typing import NamedTuple

from ...engine.dispatch import Vector, kernel
from ..arx.gaps import shift, spread
from ..arx.row import push, regress, renew
from ..arx.step import steps_like_lags

FADED = 1e-6  # errors of past predictions that add less than this fraction of the noise are forgotten


@steps_like_lags
class Filtered(NamedTuple):
    """yhat = sum (lambda_k - a_k) w_y(t-k) + sum b_k w_u(t-k) + offset, theta = [a1.., b of each input.., offset]."""

    N: float
    na: float  # 1: the last output
    inputs: float
    deep: float  # 1: the inputs of this sample
    registers: float
    memory_size: float
    detector_size: float
    missing: float
    settle: float
    fill: float
    offset: float
    mixture_columns: float
    noise: float  # variance of e, relative to sigma^2
    lam: Vector


@regress.on(Filtered)
def regress_filtered(form, state, scratch, s2):
    psi, theta, lam, registers = scratch.psi, state.theta, form.lam, state.registers
    n, own = lam.size, scratch.own
    yhat = added = 0.0
    for l in range(1 + state.held.size):
        w = registers[l * n : (l + 1) * n]
        at = (1 + state.held.size) * n + l * n * n
        for i in range(n):
            psi[l * n + i] = -w[i] if l == 0 else w[i]
            own[i] = theta[l * n + i]
            if l == 0:
                yhat += lam[i] * w[i]
                own[i] = lam[i] - theta[i]
        added += spread(registers[at : at + n * n], own[:n], state.U, state.D, l * n, s2)
    if form.offset != 0.0:
        psi[psi.size - 1] = form.offset
    for i in range(psi.size):
        yhat += psi[i] * theta[i]
    return yhat, added if added > FADED * s2 * form.noise else 0.0


@kernel
def filter_into(w, P, lam, value, variance, buffer):
    """w <- [value - lam' w; w shifted], the covariance P of its errors likewise; ``variance`` is that of value."""
    n, new, top, known = w.size, value, variance, 0.0
    for i in range(n):
        new -= lam[i] * w[i]
        known += P[i * n + i]
    push(w, new)
    if variance + known == 0.0:
        return
    for i in range(n):  # covariance of the new error with the old ones, and its variance
        buffer[i] = 0.0
        for j in range(n):
            buffer[i] -= lam[j] * P[j * n + i]
    for i in range(n):
        top -= lam[i] * buffer[i]
    shift(P, n, max(top, 0.0), buffer)


@renew.on(Filtered)
def renew_filtered(form, state, scratch, y, y_variance, e, T):
    registers, n, k = state.registers, form.lam.size, state.held.size
    push(state.ys, y)
    push(state.ys_covariance, y_variance)
    for l in range(1 + k):
        at = (1 + k) * n + l * n * n
        value, variance = (y, y_variance) if l == 0 else (state.us[l - 1, 0], state.us_variance[l - 1, 0])
        filter_into(registers[l * n : (l + 1) * n], registers[at : at + n * n], form.lam, value, variance, scratch.own)
    return 0
