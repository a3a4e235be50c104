"""The growing window: exact least squares from the first sample on, handed over to a covariance as soon as it can be.

What nothing was known of at the start is kept apart, where it stays well conditioned (`anchored`), until the triangle
that knows it has a condition below `HAND_OVER`. Then it is folded into a covariance U D U', and what follows is the
Kalman filter (Bierman and Thornton), disturbances that walk included.
"""

import math
from typing import NamedTuple

import numpy as np

from ...engine import ud
from ...engine.dispatch import Vector, advance, kernel, open_scratch, rare
from ...engine.elementary import log
from ...engine.layout import Field, Layout, each
from ...engine.status import LOST
from ...engine.ud import correct, predicted_variance, project
from ..adaptive_gain.step import take_inputs
from ..arx.row import HUGE
from .anchored import ANCHORED, LOGDET, OUTPUTS, SQUARES, START, add, begin, fold, orthonormalise, resolve
from .motion import discretise, move
from .row import COMMON, DETERMINED, SAMPLES, along, elapse, observe, report

KNOWN = 1e12  # condition of the triangle up to which the unknown counts as determined
HAND_OVER = 1e8  # and up to which a covariance is made of it: half the digits are left


class Growing(NamedTuple):
    """The plant over one step, where it starts, and what is asked of an estimate."""

    n: float
    m: float
    inputs: float
    outputs: float
    dt: float
    settle: float
    H: Vector
    D: Vector
    r: Vector
    rows: Vector
    feeds: Vector
    tolerance: Vector
    detector_size: float
    line: float  # 1: inputs are straight lines between samples, 0: they are held
    Phi: Vector  # (m, m) over dt, G0 and G1 (m, k)
    G0: Vector
    G1: Vector
    Uq: Vector  # covariance of the walks over dt, factored; empty without walks
    Dq: Vector
    A: Vector  # in continuous time, for steps of any length; empty where all are dt
    B: Vector
    W: Vector  # spectral density of the walks, (m, m)
    mean: Vector  # (m,) prior, its variances (0 where infinite), and which elements those are
    prior: Vector
    free: Vector


GROWING = Layout(
    *COMMON,
    Field(
        "start",
        (f"{len(START)}",),
        "whether delta is apart, of which nothing was known; of all rows squares, log variances, number",
    ),
    Field("zhat", ("m",), "z = zhat + X delta: what is known of it"),
    Field("D", ("m",), "its covariance is U D U': the diagonal"),
    Field("U", ("m * (m - 1) // 2",), "and the factor above it, column by column"),
    Field("X", ("m", "d"), "what delta makes of it"),
    Field("R", ("d + 1", "d"), "what is known of delta: R delta = .., transposed"),
    d="len(form.free)",
)
GROWING.on(Growing)


@kernel
def widest(form):
    """Return the length of each power that an exponential takes; 0 where all steps are dt."""
    m, k = int(form.m), int(form.inputs)
    return 0 if form.A.size == 0 else max(4 * m * m, m * k)


SCRATCH = Layout(
    *each("outputs", y="sample", ahead="variance of its prediction"),
    *each("m", z="prediction", a="vector", f="vector", b="vector"),
    Field("delta", ("d",)),
    Field("u", ("inputs",), "of the sample before"),
    Field("row", ("d + 1",)),
    *each("2 * m", weight="of the columns of Y", g="vector"),
    Field("S", ("m", "d"), "X R^-1"),
    Field("inverse", ("d", "d")),
    Field("Y", ("m", "2 * m")),
    Field("Phi", ("on * m * m",), "step of an interval that is not dt"),
    *each("on * m * inputs", G0="likewise", G1="likewise"),
    Field("Uq", ("walks * m * (m - 1) // 2",), "likewise"),
    Field("Dq", ("walks * m",), "likewise"),
    Field("Q", ("on * m * m",)),
    *each("on * 4 * m * m", M="", F=""),
    Field("powers", ("5", "wide")),
    d="len(form.free)",
    widest=widest,
    wide="widest(form)",
    on="int(wide > 0)",
    walks="on * int(len(form.Dq) > 0)",
)
open_scratch.on(Growing)(SCRATCH.open)
scratch_size = SCRATCH.size


def build(estimator, common) -> Growing:
    """Return the form of a `WindowObserver` whose window is infinite."""
    system, dt, n = estimator.plant, estimator.dt, estimator.plant.n
    none = np.zeros(0)
    std = np.concatenate([estimator.x_std, system.prior_std[n:]])
    steps = [M.ravel() for M in system.discretise(dt, estimator.hold)]
    is_walking, is_irregular = np.any(system.walk > 0), estimator.irregular
    U, D = ud.factor(system.noise(dt)) if is_walking else (np.zeros((0, 0)), none)
    return Growing(
        **common, line=float(estimator.hold == "foh"), Phi=steps[0], G0=steps[1], G1=steps[2],
        Uq=U[ud.packed_indices(len(D))], Dq=D, A=system.A.ravel() if is_irregular else none,
        B=system.B.ravel() if is_irregular else none, W=np.diag(system.walk**2).ravel(),
        mean=np.concatenate([estimator.x0, np.zeros(system.m - n)]), prior=np.where(np.isinf(std), 0.0, std) ** 2,
        free=np.flatnonzero(np.isinf(std)).astype(float),
    )  # fmt: skip


def fresh(form, state) -> None:
    """Set the prior in a state, or in several, that are zero."""
    state["zhat"], state["D"] = form.mean, form.prior
    state["X"] = np.eye(int(form.m))[:, form.free.astype(int)]
    state["start"][..., ANCHORED] = float(len(form.free) > 0)


# --- one sample --------------------------------------------------------------------------------------------


@kernel
def advance_time(form, state, scratch, seconds):
    """Take state and covariance to this sample, so many seconds after the one before."""
    if form.A.size > 0 and seconds != form.dt:
        discretise(form, scratch, seconds)
        move(scratch.Phi, scratch.G0, scratch.G1, scratch.Uq, scratch.Dq, state, scratch)
    else:
        move(form.Phi, form.G0, form.G1, form.Uq, form.Dq, state, scratch)


@kernel
def is_lost(state):
    """Say whether anything has left every bound: an unstable mode that nothing has shown for long."""
    total = 0.0
    for i in range(state.zhat.size):
        total += abs(state.zhat[i]) + state.D[i]
        if state.start[ANCHORED] > 0.0:
            for j in range(state.X.shape[1]):
                total += abs(state.X[i, j])
    return not total < HUGE


@kernel
def spread(state, scratch, M, at):
    """Return the variance of row @ z, the row's numbers standing at M[at:]."""
    project(state.U, M[at : at + state.zhat.size], scratch.f)
    total = predicted_variance(scratch.f, state.D, 0.0)
    if state.start[ANCHORED] > 0.0:
        for j in range(state.X.shape[1]):
            part = 0.0
            for i in range(state.zhat.size):
                part += M[at + i] * scratch.S[i, j]
            total += part * part
    return total


@rare
def deviations(form, state, scratch):
    """Fill the standard deviations of z and of the derived outputs."""
    m = state.zhat.size
    for i in range(state.std.size):
        if i < m:
            for j in range(m):
                scratch.a[j] = 1.0 if i == j else 0.0
            state.std[i] = math.sqrt(spread(state, scratch, scratch.a, 0))
        else:
            state.std[i] = math.sqrt(spread(state, scratch, form.rows, (i - m) * m))


@kernel
def know(state, scratch):
    """Fill work.z with the best z of now; return the condition of what is yet to be handed over, 0 if nothing is."""
    if state.start[ANCHORED] > 0.0:
        return resolve(state, scratch)
    for i in range(state.zhat.size):
        scratch.z[i] = state.zhat[i]
    return 0.0


@kernel
def take(form, state, scratch):
    """Correct zhat and P by the outputs in work.y, one after the other; tell the triangle what is left."""
    start, zhat, m, k, d = state.start, state.zhat, state.zhat.size, state.held.size, state.X.shape[1]
    for l in range(scratch.y.size):
        if scratch.y[l] != scratch.y[l]:
            continue
        e = scratch.y[l] - along(form.H, l * m, zhat) - along(form.D, l * k, state.held)
        project(state.U, form.H[l * m : (l + 1) * m], scratch.f)
        T = correct(state.U, state.D, scratch.f, form.r[l], scratch.b)
        if start[ANCHORED] > 0.0:
            for j in range(d):
                h = 0.0
                for i in range(m):
                    h += form.H[l * m + i] * state.X[i, j]
                scratch.row[j] = h / math.sqrt(T)
                for i in range(m):
                    state.X[i, j] -= scratch.b[i] * (h / T)
            scratch.row[d] = e / math.sqrt(T)
            start[SQUARES] += add(state.R, scratch.row)
        else:
            start[SQUARES] += e * e / T
        for i in range(m):
            zhat[i] += scratch.b[i] * (e / T)
        start[LOGDET] += log(T)
        start[OUTPUTS] += 1.0


@advance.on(Growing)
def advance_growing(form, noise, memory, gate, scale, detector, state, scratch, y, u, out, t):
    head, m, status = state.head, state.zhat.size, 0
    seconds = elapse(form, state, u, t)
    for l in range(state.held.size):
        scratch.u[l] = state.held[l]
    status |= take_inputs(state, u, t)

    # predict
    if head[SAMPLES] > 0.0:
        advance_time(form, state, scratch, seconds)
        if is_lost(state):
            begin(form, state)
            status |= LOST
        if state.start[ANCHORED] > 0.0 and state.start[OUTPUTS] == 0.0:
            orthonormalise(state.X)
    condition = know(state, scratch)
    head[DETERMINED] = 1.0 if condition < KNOWN else 0.0
    for l in range(scratch.y.size):
        scratch.ahead[l] = spread(state, scratch, form.H, l * m) + form.r[l]
    alarm = observe(form, scale, detector, state, scratch, y, out, t)

    # correct, and hand over
    take(form, state, scratch)
    condition = know(state, scratch)
    if state.start[ANCHORED] > 0.0 and condition < HAND_OVER:
        fold(state, scratch)
    head[DETERMINED] = 1.0 if condition < KNOWN else 0.0
    if head[DETERMINED] > 0.0:
        for i in range(m):
            state.z[i] = scratch.z[i]
        deviations(form, state, scratch)
    report(form, scale, state, out, t, status, alarm)


def loglik(estimator, state) -> float:
    """Return log p(y_1..y_t), exact: the unknown at the start is integrated out (de Jong's diffuse likelihood)."""
    squares, logdet, outputs = (float(state["start"][i]) for i in (SQUARES, LOGDET, OUTPUTS))
    if state["start"][ANCHORED] > 0:
        logdet += 2 * float(np.sum(np.log(np.abs(np.diagonal(state["R"])))))
    return -0.5 * ((outputs - state["R"].shape[-1]) * math.log(2 * math.pi) + logdet + squares)
