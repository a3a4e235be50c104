"""The window of regular samples: fixed gains, and least squares anew where a sample of the window is missing.

    z(t) = sum_i K_i y_i + V_i u_i                          all samples of the window there: (L (p + k)) m products
    z(t) = QR of the rows of the outputs at hand            still filling, or some missing: the same, for that window

Each sample lies in the ring twice, L places apart, so that the window is always one piece, its oldest sample first.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from ...engine.dispatch import Vector, advance, kernel, open_scratch
from ...engine.layout import Field, Layout, each
from ..adaptive_gain.step import take_inputs
from .gains import Design, require_usable
from .parity import contradiction, tables
from .partial import AT, FILLED, FORESEEN, GAPS, solve
from .row import COMMON, DETERMINED, along, elapse, observe, products, report, unit

BY_GAINS, BY_ROWS = 2.0, 1.0  # how z was determined


class Fir(NamedTuple):
    """The fields of `Common`, then gains for the full window and tables for any other."""

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
    length: float  # samples in the window, L
    unknowns: float  # free unknowns of a window, w
    bounded: float  # of these bounded forwards, the first ones
    gains: Vector  # (m or m + 1, L, p + k): of each sample's y and u, in an even number of rows
    std: Vector  # (N,) of the full window
    ahead: Vector  # (p,) variances of the prediction after a full window
    Phi: Vector  # (m, m)
    G0: Vector  # (m, k)
    G1: Vector  # (m, k)
    outlook: Vector  # (N + p, m): z, derived outputs, and the outputs a sample ahead, of z
    design: Vector  # (p, w, L): rows of the window, whitened; what is bounded forwards by its place from the start
    ends: Vector  # (L, m, bounded): what that makes of z, i samples on
    Tb: Vector  # (m, w - bounded)
    prior: Vector  # (w, w): triangle of the prior's rows
    Ta: Vector  # (m, s): forced response, bounded forwards ..
    Pa: Vector  # (s, s)
    Ga0: Vector  # (s, k)
    Ga1: Vector  # (s, k)
    HTa: Vector  # (p, s)
    Pb: Vector  # (b, b): .. and backwards
    Gb0: Vector  # (b, k)
    Gb1: Vector  # (b, k)
    HTb: Vector  # (p, b)
    parity: float  # threshold of the parity test; 0: none
    restart: float  # whether an alarm of it empties the window
    new: Vector  # (degrees or degrees + 1, m), an even number of rows: the test's white combinations of the estimate,
    old: Vector  # (degrees, m): of what the window before predicted for the first sample of this one,
    feed: Vector  # (degrees, L, p + k): and of the inputs between (0 for the outputs)


FIR = Layout(
    *COMMON,
    Field("own", ("4",), "where the ring stands, how full it is, gaps in it, .."),
    Field("ring", ("2 * length * (outputs + inputs)",), "y and u of each sample, twice; 0 where y is missing"),
    Field("there", ("length * outputs",), "1 where y is there"),
    Field("predicted", ("length * m * (form.parity > 0)",), "z predicted for each sample, for the parity test"),
)
FIR.on(Fir)


SCRATCH = Layout(
    Field("z", ("m",), "prediction"),
    *each("outputs", ahead="its variance", y="sample"),
    *each("unknowns", w="unknowns of a window", row="scratch"),
    Field("end", ("m * unknowns",), "z of w"),
    *each("len(form.Ta) // m", a="forced response, bounded forwards", next="and the next"),
    Field("b", ("length * (len(form.Tb) // m)",), "and backwards"),
    Field("M", ("unknowns + 1", "unknowns + length * outputs"), "rows of a window with what they equal, transposed"),
    Field("X", ("unknowns", "unknowns")),
)
open_scratch.on(Fir)(SCRATCH.open)
scratch_size = SCRATCH.size


def build(est, common) -> Fir:
    """Return the form of a `WindowObserver`."""
    system, dt, L = est.plant, est.dt, est.length
    design = Design(system, dt, L, np.sqrt(common["r"]), est.hold)
    require_usable(design, None if est.noise_std is None else est.tolerance[: system.m])
    frame, m, p, k = design.frame, system.m, system.outputs, system.inputs
    gains = np.concatenate([design.gains, design.input_gains], axis=2)
    gains = np.concatenate([gains, np.zeros((m % 2, L, p + k))])
    Phi, G0, G1 = system.discretise(dt, est.hold)
    C = design.factor
    w = C.shape[1]
    prior = np.zeros((w, w))
    triangle = np.linalg.qr(design.prior, mode="r")
    prior[: len(triangle)] = triangle
    outlook = np.vstack([np.eye(m), est.derived_rows, system.H @ Phi])
    spread, N = np.linalg.norm(outlook @ C, axis=1), m + len(est.derived_rows)
    est.design = design
    parity = tables(system, dt, L, design.noise_std, est.hold, est.parity)
    return Fir(
        **common, length=L, unknowns=w, bounded=design.ends.shape[2], gains=gains.ravel(),
        std=spread[:N], ahead=spread[N:] ** 2 + common["r"], Phi=Phi.ravel(), G0=G0.ravel(), G1=G1.ravel(),
        outlook=outlook.ravel(), design=design.rows.transpose(1, 2, 0).ravel(), ends=design.ends.ravel(),
        Tb=frame.Tb.ravel(), prior=prior.ravel(),
        Ta=frame.Ta.ravel(), Pa=expm(frame.Aa * dt).ravel(), Ga0=(frame.to_a @ G0).ravel(),
        Ga1=(frame.to_a @ G1).ravel(), HTa=(system.H @ frame.Ta).ravel(), Pb=expm(-frame.Ab * dt).ravel(),
        Gb0=(frame.to_b @ G0).ravel(), Gb1=(frame.to_b @ G1).ravel(), HTb=(system.H @ frame.Tb).ravel(),
        parity=parity.threshold, restart=parity.restart, new=parity.new.ravel(), old=parity.old.ravel(),
        feed=parity.gains.ravel(),
    )  # fmt: skip


@kernel
def predict(form, state, scratch):
    """work.z <- Phi z + G0 u, u still that of the sample before."""
    m, k = state.z.size, state.held.size
    for i in range(m):
        scratch.z[i] = along(form.Phi, i * m, state.z) + along(form.G0, i * k, state.held)


@kernel
def push(form, state, scratch):
    """Put the sample into the ring, twice, over the oldest one."""
    own, p, k, L = state.own, scratch.y.size, state.held.size, int(form.length)
    at, q = int(own[AT]), p + k
    for i in range(p):
        y = scratch.y[i]
        is_there = 1.0 if y == y else 0.0
        if own[FILLED] == form.length:
            own[GAPS] -= 1.0 - state.there[at * p + i]
        own[GAPS] += 1.0 - is_there
        state.there[at * p + i] = is_there
        state.ring[at * q + i] = state.ring[(at + L) * q + i] = y if is_there > 0.0 else 0.0
    for l in range(k):
        state.ring[at * q + p + l] = state.ring[(at + L) * q + p + l] = state.held[l]
    own[AT] = float(at + 1 if at + 1 < L else 0)
    own[FILLED] = min(own[FILLED] + 1.0, form.length)


@kernel
def remember_prediction(state, scratch):
    """Keep what is predicted, at the place that the sample takes in the ring, and count what full windows predict."""
    at, m = int(state.own[AT]), state.z.size
    state.own[FORESEEN] = state.own[FORESEEN] + 1.0 if state.head[DETERMINED] == BY_GAINS else 0.0
    for i in range(m):
        state.predicted[at * m + i] = scratch.z[i]


@kernel
def convolve(form, state):
    """z <- gains times window."""
    m, size = state.z.size, form.gains.size // (state.z.size + state.z.size % 2)
    first = int(state.own[AT]) * (size // int(form.length))
    x = state.ring[first : first + size]
    for i in range(0, m, 2):
        upper, lower = products(form.gains, i * size, x)
        state.z[i] = upper
        if i + 1 < m:
            state.z[i + 1] = lower


@advance.on(Fir)
def advance_fir(form, noise, memory, gate, scale, detector, state, scratch, y, u, out, t):
    head, m, k = state.head, state.z.size, state.held.size
    elapse(form, state, u, t)

    # predict
    predict(form, state, scratch)
    status = take_inputs(state, u, t)
    for i in range(m if k > 0 else 0):
        scratch.z[i] += along(form.G1, i * k, state.held)
    for i in range(scratch.ahead.size):
        scratch.ahead[i] = state.ahead[i]
    alarm = observe(form, scale, detector, state, scratch, y, out, t)
    if form.parity > 0.0:
        remember_prediction(state, scratch)

    # estimate
    push(form, state, scratch)
    if state.own[FILLED] == form.length and state.own[GAPS] == 0.0:
        convolve(form, state)
        if head[DETERMINED] < BY_GAINS:
            for i in range(state.std.size):
                state.std[i] = form.std[i]
            for i in range(scratch.ahead.size):
                state.ahead[i] = form.ahead[i]
        head[DETERMINED] = BY_GAINS
        if form.parity > 0.0:
            out[t, 4 * scratch.y.size] = contradiction(form, state) / (form.parity * unit(scale, head))
            alarm = 1.0 if out[t, 4 * scratch.y.size] >= 1.0 else 0.0
    else:
        head[DETERMINED] = BY_ROWS if solve(form, state, scratch) else 0.0
    report(form, scale, state, out, t, status, alarm)
    if alarm > 0.0 and form.restart > 0.0:
        state.own[FILLED] = state.own[GAPS] = head[DETERMINED] = 0.0
