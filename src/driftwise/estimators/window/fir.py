"""The window of regular samples: fixed gains, and least squares anew where a sample of the window is missing.

    z(t) = sum_i K_i y_i + V_i u_i                          all samples of the window there: (L (p + k)) m products
    z(t) = QR of the rows of the outputs at hand            still filling, or some missing: the same, for that window

Each sample lies in the ring twice, L places apart, so that the window is always one piece, its oldest sample first.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from ...errors import InputError
from ...kernel.compose import Vector, advance, kernel, open_row, open_work, rare
from ..gain.step import take_inputs
from .gains import WORST, Design, require_usable
from .row import DETERMINED, HEAD, along, elapse, observe, report

AT, FILLED, GAPS = range(3)  # own numbers: place in the ring, samples in it, outputs missing among them


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
    marks: float
    length: float  # samples in the window, L
    unknowns: float  # free unknowns of a window, w
    bounded: float  # of these bounded forwards, the first ones
    gains: Vector  # (m or m + 1, L, p + k): of each sample's y and u, in an even number of rows
    std: Vector  # (N,) of the full window
    ahead: Vector  # (p,) variances of the prediction after a full window
    Phi: Vector  # (m, m)
    G0: Vector  # (m, k)
    G1: Vector  # (m, k)
    HPhi: Vector  # (p, m)
    design: Vector  # (L, p, w): row i of what is bounded forwards from the start, L-1-i backwards from the end
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


class Row(NamedTuple):
    """Views of one state row."""

    head: np.ndarray
    z: np.ndarray
    std: np.ndarray
    ahead: np.ndarray
    held: np.ndarray
    marks: np.ndarray
    own: np.ndarray
    ring: np.ndarray  # (2 L (p + k)): y and u of each sample; 0 where y is missing
    there: np.ndarray  # (L p): 1 where y is there


class Work(NamedTuple):
    """Scratch."""

    z: np.ndarray  # prediction
    ahead: np.ndarray
    y: np.ndarray
    spare: np.ndarray  # (m,)
    R: np.ndarray  # (w, w) triangle
    w: np.ndarray  # its right-hand side, and the solution
    row: np.ndarray  # (w,)
    end: np.ndarray  # (m, w): z of w
    a: np.ndarray  # forced response (s,), and the next
    a2: np.ndarray
    b: np.ndarray  # (L, b)


def build(est, common) -> Fir:
    """Return the form of a `WindowObserver`."""
    system, dt, L = est.plant, est.dt, est.length
    if L < 1:
        raise InputError(f"window must hold samples: {est.window:g} s is less than half of dt = {dt:g} s")
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
    est.design = design
    return Fir(
        **common, length=L, unknowns=w, bounded=design.ends.shape[2], gains=gains.ravel(),
        std=np.linalg.norm(np.vstack([C, est.derived_rows @ C]), axis=1),
        ahead=np.linalg.norm(system.H @ Phi @ C, axis=1) ** 2 + common["r"],
        Phi=Phi.ravel(), G0=G0.ravel(), G1=G1.ravel(), HPhi=(system.H @ Phi).ravel(),
        design=design.rows.ravel(), ends=design.ends.ravel(), Tb=frame.Tb.ravel(), prior=prior.ravel(),
        Ta=frame.Ta.ravel(), Pa=expm(frame.Aa * dt).ravel(), Ga0=(frame.to_a @ G0).ravel(),
        Ga1=(frame.to_a @ G1).ravel(), HTa=(system.H @ frame.Ta).ravel(), Pb=expm(-frame.Ab * dt).ravel(),
        Gb0=(frame.to_b @ G0).ravel(), Gb1=(frame.to_b @ G1).ravel(), HTb=(system.H @ frame.Tb).ravel(),
    )  # fmt: skip


def fields(form) -> list[tuple]:
    """Return the fields of a row that follow the common ones; the order is that of `Row`."""
    L, p, k = int(form.length), int(form.outputs), int(form.inputs)
    return [("own", "f8", (3,)), ("ring", "f8", (2 * L * (p + k),)), ("there", "f8", (L * p,))]


def _sizes(form) -> tuple[int, int, int]:
    """Return the unknowns, and those of the forced response bounded forwards and backwards."""
    m = int(form.m)
    return int(form.unknowns), len(form.Ta) // m, len(form.Tb) // m


def scratch_size(form) -> int:
    """Return how many numbers `Work` takes."""
    (w, s, b), m, p = _sizes(form), int(form.m), int(form.outputs)
    return 2 * m + 2 * p + w * w + 2 * w + m * w + 2 * s + int(form.length) * b


@open_row.on(Fir)
def _(form, row):
    m, k, p, L = int(form.m), int(form.inputs), int(form.outputs), int(form.length)
    z = HEAD_SIZE
    std = z + m
    ahead = std + form.tolerance.size
    held = ahead + p
    marks = held + k
    own = marks + int(form.marks)
    ring = own + 3
    there = ring + 2 * L * (p + k)
    return Row(
        row[:z], row[z:std], row[std:ahead], row[ahead:held], row[held:marks], row[marks:own], row[own:ring],
        row[ring:there], row[there:],
    )  # fmt: skip


HEAD_SIZE = len(HEAD)


@open_work.on(Fir)
def _(form, scratch):
    m, p, w = int(form.m), int(form.outputs), int(form.unknowns)
    s = form.Ta.size // m
    ahead = m
    y = ahead + p
    spare = y + p
    R = spare + m
    v = R + w * w
    row = v + w
    end = row + w
    a = end + m * w
    a2 = a + s
    b = a2 + s
    return Work(
        scratch[:ahead], scratch[ahead:y], scratch[y:spare], scratch[spare:R], scratch[R:v], scratch[v:row],
        scratch[row:end], scratch[end:a], scratch[a:a2], scratch[a2:b], scratch[b:],
    )  # fmt: skip


@kernel
def predict(form, state, work):
    """work.z <- Phi z + G0 u, u still that of the sample before."""
    m, k = state.z.size, state.held.size
    for i in range(m):
        work.z[i] = along(form.Phi, i * m, state.z) + along(form.G0, i * k, state.held)


@kernel
def push(form, state, work):
    """Put the sample into the ring, twice, over the oldest one."""
    own, p, k, L = state.own, work.y.size, state.held.size, int(form.length)
    at, q = int(own[AT]), p + k
    for i in range(p):
        y = work.y[i]
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
def convolve(form, state):
    """z <- gains times window: two rows at a time and two samples, so that four sums run side by side."""
    m, size = state.z.size, form.gains.size // (state.z.size + state.z.size % 2)
    first = int(state.own[AT]) * (size // int(form.length))
    x = state.ring[first : first + size]
    half = size // 2
    for i in range(0, m, 2):
        g, h = form.gains[i * size : (i + 1) * size], form.gains[(i + 1) * size : (i + 2) * size]
        a = b = c = d = 0.0
        for j in range(half):
            even, odd = x[2 * j], x[2 * j + 1]
            a += g[2 * j] * even
            b += h[2 * j] * even
            c += g[2 * j + 1] * odd
            d += h[2 * j + 1] * odd
        if size % 2 == 1:
            a += g[size - 1] * x[size - 1]
            b += h[size - 1] * x[size - 1]
        state.z[i] = a + c
        if i + 1 < m:
            state.z[i + 1] = b + d


@kernel
def rotate_in(R, v, row, y):
    """Rotate the row (and its right-hand side y) into the triangle R (Givens); the row is destroyed."""
    w = row.size
    for j in range(w):
        if row[j] == 0.0:
            continue
        r = math.hypot(R[j * w + j], row[j])
        c, s = R[j * w + j] / r, row[j] / r
        R[j * w + j] = r
        for i in range(j + 1, w):
            R[j * w + i], row[i] = c * R[j * w + i] + s * row[i], c * row[i] - s * R[j * w + i]
        v[j], y = c * v[j] + s * y, c * y - s * v[j]


@kernel
def solve_up(R, v):
    """v <- R^-1 v; return whether R has all the digits that takes."""
    w = v.size
    for j in range(w):
        most = 0.0
        for i in range(j + 1):
            most = max(most, abs(R[i * w + j]))
        if not abs(R[j * w + j]) * WORST > most:
            return False
    for j in range(w - 1, -1, -1):
        for i in range(j + 1, w):
            v[j] -= R[j * w + i] * v[i]
        v[j] /= R[j * w + j]
    return True


@kernel
def spread(R, row):
    """Return the variance of row' w, w of the information R' R; the row is overwritten by R'^-1 row."""
    w, total = row.size, 0.0
    for j in range(w):
        for i in range(j):
            row[j] -= R[i * w + j] * row[i]
        row[j] /= R[j * w + j]
        total += row[j] * row[j]
    return total


@kernel
def force_backwards(form, state, work, first, count):
    """Fill work.b with what the inputs of the window make of b, which is zero at its end."""
    k, p = state.held.size, work.y.size
    n, q = form.Tb.size // state.z.size, p + k
    b = work.b
    for j in range(n):
        b[(count - 1) * n + j] = 0.0
    for i in range(count - 2, -1, -1):
        for j in range(n):
            total = b[(i + 1) * n + j]
            for l in range(k):
                total -= form.Gb0[j * k + l] * state.ring[(first + i) * q + p + l]
                total -= form.Gb1[j * k + l] * state.ring[(first + i + 1) * q + p + l]
            work.row[j] = total
        for j in range(n):
            b[i * n + j] = 0.0
            for l in range(n):
                b[i * n + j] += form.Pb[j * n + l] * work.row[l]


@kernel
def force_on(form, state, work, at):
    """work.a <- Pa a + Ga0 u + Ga1 u+, from the ring's place ``at`` to the next."""
    k, p, s = state.held.size, work.y.size, work.a.size
    u = at * (p + k) + p
    for j in range(s):
        total = along(form.Pa, j * s, work.a)
        for l in range(k):
            total += form.Ga0[j * k + l] * state.ring[u + l] + form.Ga1[j * k + l] * state.ring[u + p + k + l]
        work.a2[j] = total
    for j in range(s):
        work.a[j] = work.a2[j]


@rare
def solve(form, state, work):
    """Estimate from the outputs at hand by QR: state.z, its deviations, and the variance of the next prediction."""
    m, k, p, w = state.z.size, state.held.size, work.y.size, work.w.size
    L, count, q, bounded = int(form.length), int(state.own[FILLED]), p + k, int(form.bounded)
    n = w - bounded
    first = int(state.own[AT]) + L - count  # of the window, in the ring
    for i in range(w * w):
        work.R[i] = form.prior[i]
    for i in range(w):
        work.w[i] = 0.0
    for j in range(work.a.size):
        work.a[j] = 0.0
    if n > 0:
        force_backwards(form, state, work, first, count)
    for i in range(count):
        place = first + i
        if i > 0 and k > 0:
            force_on(form, state, work, place - 1)
        for o in range(p):
            if state.there[(place % L) * p + o] == 0.0:
                continue
            y = state.ring[place * q + o] - along(form.HTa, o * work.a.size, work.a)
            for l in range(n):
                y -= form.HTb[o * n + l] * work.b[i * n + l]
            for l in range(k):
                y -= form.D[o * k + l] * state.ring[place * q + p + l]
            for j in range(w):
                work.row[j] = form.design[((i if j < bounded else L - count + i) * p + o) * w + j]
            rotate_in(work.R, work.w, work.row, y / math.sqrt(form.r[o]))
    if not solve_up(work.R, work.w):
        return False
    for i in range(m):
        for j in range(w):
            is_first = j < bounded
            at = ((count - 1) * m + i) * bounded + j if is_first else i * n + j - bounded
            work.end[i * w + j] = form.ends[at] if is_first else form.Tb[at]
        state.z[i] = along(work.end, i * w, work.w) + along(form.Ta, i * work.a.size, work.a)
    for i in range(m):
        for j in range(w):
            work.row[j] = work.end[i * w + j]
        state.std[i] = math.sqrt(spread(work.R, work.row))
    for i in range(m, state.std.size):
        blend(form.rows, (i - m) * m, work.end, m, work.row)
        state.std[i] = math.sqrt(spread(work.R, work.row))
    for o in range(p):
        blend(form.HPhi, o * m, work.end, m, work.row)
        state.ahead[o] = spread(work.R, work.row) + form.r[o]
    return True


@kernel
def blend(weights, at, rows, m, out):
    """out <- weights[at : at + m] times the rows."""
    for j in range(out.size):
        out[j] = 0.0
        for l in range(m):
            out[j] += weights[at + l] * rows[l * out.size + j]


@advance.on(Fir)
def _(form, noise, memory, gate, scale, detector, state, work, y, u, out, t):
    head, m, k = state.head, state.z.size, state.held.size
    elapse(form, state, u, t)

    # predict
    predict(form, state, work)
    status = take_inputs(state, u, t)
    for i in range(m if k > 0 else 0):
        work.z[i] += along(form.G1, i * k, state.held)
    for i in range(work.ahead.size):
        work.ahead[i] = state.ahead[i]
    alarm = observe(form, scale, detector, state, work, y, out, t)

    # estimate
    push(form, state, work)
    if state.own[FILLED] == form.length and state.own[GAPS] == 0.0:
        convolve(form, state)
        if head[DETERMINED] < 2.0:
            for i in range(state.std.size):
                state.std[i] = form.std[i]
            for i in range(work.ahead.size):
                state.ahead[i] = form.ahead[i]
        head[DETERMINED] = 2.0  # by the gains
    else:
        head[DETERMINED] = 1.0 if solve(form, state, work) else 0.0
    report(form, scale, state, out, t, status, alarm)
