"""Recursive instrumental variables: least squares whose noise may be anything, at the price of wider bars.

theta = (sum zeta phi')^-1 sum zeta y, recursively (Soderstrom and Stoica 1983; Young 1984):

    K = P zeta/(R + phi' P zeta),   theta <- theta + K e,   P <- P - K phi' P,
    C <- (1 - K phi') C (1 - K phi')' + K R K'

P is not symmetric. C, the covariance of theta, is P (sum zeta zeta') P' written as what a given gain K does to it
(Joseph's form), on the factors U, D that every estimator carries: symmetric and non-negative whatever K is.
"""

from typing import NamedTuple

from ...engine.dispatch import Vector, kernel
from ...engine.errors import InputError
from ...engine.layout import Field, Layout
from ...engine.ud import correct, predicted_variance, widen_along
from ...memory.constant import Constant
from ...memory.exponential_forgetting import ExponentialForgetting
from ...memory.gain_floor import GainFloor
from ...memory.restart_on_change import GainReset, RestartOnChange
from ...memory.variable_forgetting import VariableForgetting
from ...models.stability import is_inside
from .methods import correct_by
from .row import OBSERVED, TOP, WEIGHT, Lags, push, renew
from .step import steps_like_lags, take_output

LEAST = 0.01  # below this fraction of R, 1 + phi' P zeta counts as zero
NEAR = 10.0  # the auxiliary model starts afresh from y beyond so many times the largest |y|
STEADY = 0.999  # ... and where a pole lies outside this circle


@steps_like_lags
class InstrumentalLags(Lags):
    """`Lags`, with a register of instruments.

    ``registers`` are those of `REGISTERS`.
    """

    __slots__ = ()


REGISTERS = Layout(
    Field("P", ("N * N",), "P, row after row"),
    Field("weight", ("1",), "that P belongs to"),
    Field("xs", ("na",), "past outputs of the auxiliary model, newest first"),
    given=("N", "na"),
)
open_registers = kernel(REGISTERS.open)


class Instruments(NamedTuple):
    """Gain P zeta/(R + phi' P zeta)."""

    R: float
    first: float  # lag of the first delayed input among the instruments; 0: outputs of the auxiliary model
    unit: float  # y_scale/u_scale: what brings delayed inputs to the size of outputs
    start: float  # samples of least squares before
    cap: Vector  # beyond these variances P is not forgotten any more


@renew.on(InstrumentalLags)
def renew_instrumental_lags(form, state, scratch, y, y_variance, e, T):
    # the auxiliary model: the same regressors, past outputs replaced by its own, with the new theta
    na, value = state.ys.size, 0.0
    xs = open_registers(state.registers, state.theta.size, na).xs
    for i in range(scratch.psi.size):
        value += state.theta[i] * (-xs[i] if i < na else scratch.psi[i])
    is_sound = abs(value) <= NEAR * state.head[TOP] and is_inside(state.theta[:na], STEADY, scratch.f, scratch.b)
    push(xs, value if is_sound else y)
    take_output(state, scratch, y, y_variance, e, T)
    return 0


@kernel
def forget(P, ratio, cap):
    """P <- P / ratio, unless that takes a variance beyond its cap."""
    N = cap.size
    for i in range(N):
        if not abs(P[i * N + i]) <= ratio * cap[i]:
            return
    for i in range(N * N):
        P[i] /= ratio


@correct_by.on(Instruments)
def correct_by_instruments(method, memory, state, e, R, s2, y, scratch):
    theta, psi, N, na = state.theta, scratch.psi, state.theta.size, state.ys.size
    (P, weight, xs), head = open_registers(state.registers, N, na), state.head
    zeta, K, v = scratch.own[:N], scratch.own[N : 2 * N], scratch.own[2 * N :]
    if weight[0] > 0.0 and head[WEIGHT] != weight[0]:  # the memory has forgotten since: so does P
        forget(P, head[WEIGHT] / weight[0], method.cap)
    first = int(method.first)
    for i in range(N):
        zeta[i] = psi[i]
        if i < na and head[OBSERVED] >= method.start:
            zeta[i] = method.unit * state.us[0, first + i] if first else -xs[i]
    T = predicted_variance(scratch.f, state.D, R)
    bottom = R
    for i in range(N):
        K[i] = 0.0
        for j in range(N):
            K[i] += P[i * N + j] * zeta[j]
        bottom += psi[i] * K[i]
    if not abs(bottom) >= LEAST * R:
        return -T
    for j in range(N):  # v = P' phi
        v[j] = 0.0
        for i in range(N):
            v[j] += P[i * N + j] * psi[i]
    for i in range(N):
        K[i] /= bottom
        theta[i] += K[i] * e
        for j in range(N):
            P[i * N + j] -= K[i] * v[j]
    weight[0] = head[WEIGHT] + 1.0
    # C - b b'/T is what the best gain b/T leaves, T (K - b/T)(K - b/T)' what this one loses against it
    T = correct(state.U, state.D, scratch.f, R, scratch.b)
    for i in range(N):
        v[i] = K[i] - scratch.b[i] / T
    widen_along(state.U, state.D, v, T, N - 1)
    return T


def instruments(kind, model, memory) -> int:
    """Return the lag of the first delayed input, 0 for the auxiliary model; raise InputError where neither works."""
    if kind not in ("model", "delayed"):
        raise InputError(f'instruments must be "model" or "delayed", got {kind!r}')
    if not model.na:
        raise InputError("instruments stand for past outputs, and na = 0 has none: least squares is right there")
    if not model.inputs or not sum(model.nb):
        raise InputError("instruments are made of inputs: give the model one (nb), or use method='ls'")
    is_reset = isinstance(memory, RestartOnChange) and isinstance(memory.response, GainReset)
    if not is_reset and not isinstance(memory, Constant | GainFloor | ExponentialForgetting | VariableForgetting):
        raise InputError(
            "with method='iv' memory must be Constant(), GainFloor(N), ExponentialForgetting(lam), "
            "VariableForgetting(N) "
            "or "
            f"RestartOnChange(response=GainReset(N)), which scale all of P alike; got {memory!r}"
        )
    return model.nk[0] + model.nb[0] if kind == "delayed" else 0
