"""A finite window over samples at any instants: least squares by a queue of segments (`stacks`).

At the window's end, z = V w with w = [s; v] as `segment` has it:

    least squares for [s at the oldest sample; v at the newest]: the whole queue, and the prior of the disturbances
    w = [F s + d; v],   covariance C C',   C = [F, 0; 0, I] R^-1

A sample is in the window while it is less than round(window/dt) dt old: at equality it has left, so that regular
samples are those of the fixed gains. The prior holds at the oldest sample, missing or not.
"""

import math
from typing import NamedTuple

import numpy as np

from ...engine.dispatch import Vector, advance, kernel, open_scratch, rare
from ...engine.errors import InputError
from ...engine.layout import Field, Layout, joined
from ...engine.qr import invert, solve_triangular, triangularise
from ..adaptive_gain.step import take_inputs
from .gains import WORST, Coordinates, Design, require_usable
from .row import COMMON, DETERMINED, TIME, along, elapse, observe, report
from .segment import Places, coordinates, driven, places
from .stacks import COUNT, FRONT, MARKS, Bench, Queue, append, drop_older, join_all, move_over

ROUNDING = 4 * float(np.finfo(float).eps)  # of an instant
SAME = 1e-9  # ages that differ by less, relative to the window, are the same


class QueueForm(NamedTuple):
    """The fields of `row.Common`; the plant in coordinates w = [s; v] that do not grow, z = V w; sizes of the queue."""

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
    s: float  # modes that stay
    straight: float  # 1: the input is a straight line between its samples
    window: float  # age at which a sample leaves
    capacity: float  # most samples in the queue
    block: float
    plant: Vector  # As, Bs, Au, Bu; outputs as measured in units of their noise (`segment.Places`)
    V: Vector  # z and the derived outputs are V w
    prior: Vector  # 1 / prior deviation of each w at the window's start


@kernel
def laid_out(form):
    """Return where numbers lie in a segment."""
    return places(int(form.s), int(form.m), int(form.inputs), int(form.outputs), int(form.straight))


QUEUE = Layout(
    *COMMON,
    Field("w", ("m",), "estimate in coordinates of its own"),
    Field("C", ("m", "m"), "its covariance is C C'"),
    *joined("marks", Field("queue", (f"{MARKS}",), "oldest sample in the ring, samples, those in front, last move")),
    Field("moves", ("laid_out(form).moves",), "what the last interval did: found once for all that are equal"),
    Field("ring", ("capacity", "1 + inputs + outputs"), "samples: seconds since the one before, inputs, outputs"),
    Field("behind", ("size",), "segment of the newest samples"),
    Field("block", ("block", "size"), "segments of the front's block in use"),
    Field("blocks", ("capacity // block", "size"), "the oldest segment of each block"),
    laid_out=laid_out,
    size="laid_out(form).size",
)
QUEUE.on(QueueForm)


@kernel
def open_queue(state):
    """Return the views of the samples."""
    return Queue(state.marks, state.moves, state.ring, state.behind, state.block, state.blocks)


class Work(NamedTuple):
    """Places in a segment, and scratch."""

    at: Places
    z: np.ndarray
    ahead: np.ndarray
    y: np.ndarray
    before: np.ndarray  # inputs of the sample before
    w: np.ndarray
    X: np.ndarray
    bench: Bench


def build(est, common) -> QueueForm:
    """Return the form of a `WindowObserver`."""
    plant, n, m, length = est.plant, est.plant.n, est.plant.m, est.length
    if est.capacity < 2:
        raise InputError(f"capacity must be at least 2 samples, got {est.capacity}")
    usual = Design(plant, est.dt, min(length, est.capacity), np.sqrt(common["r"]), est.hold)
    require_usable(usual, None if est.noise_std is None else est.tolerance[:m])
    V, inverse, s = coordinates(Coordinates(plant, length * est.dt), plant.A, n)
    A, B = inverse @ plant.A @ V, inverse @ plant.B
    weight = 1 / np.sqrt(common["r"])
    E = weight[:, None] * plant.H @ V
    prior = np.zeros(m)
    with np.errstate(divide="ignore"):
        prior[s - (m - n) : s] = V[range(n, m), range(s - (m - n), s)] / plant.prior_std[n:]
    return QueueForm(
        **common, s=s, straight=est.hold == "foh", window=length * est.dt, capacity=est.capacity,
        block=math.ceil(math.sqrt(est.capacity)), V=np.vstack([V, est.derived_rows @ V]).ravel(), prior=prior,
        plant=np.concatenate([x.ravel() for x in (A[:s, :s], B[:s], A[s:, s:], B[s:], E, plant.D, weight)]),
    )  # fmt: skip


def scratch_size(form) -> int:
    """Return how many numbers `Work` takes."""
    m, k, p, size = int(form.m), int(form.inputs), int(form.outputs), laid_out(form).size
    return 2 * m + 2 * p + k + (m + 1) * (2 * m + p) + m * m + 5 * m * max(m, k) + 2 * size


@open_scratch.on(QueueForm)
def open_scratch_queue_form(form, buffer):
    at = laid_out(form)
    m, k = at.m, at.k
    ahead = m
    y = ahead + at.p
    before = y + at.p
    w = before + k
    X = w + m
    M = X + m * m
    powers = M + (m + 1) * (2 * m + at.p)
    leaf = powers + 5 * m * max(m, k)
    whole = leaf + at.size
    return Work(
        at, buffer[:ahead], buffer[ahead:y], buffer[y:before], buffer[before:w], buffer[w:X],
        buffer[X:M].reshape(m, m),
        Bench(
            buffer[M:powers].reshape(m + 1, 2 * m + at.p), buffer[powers:leaf].reshape(5, m * max(m, k)),
            buffer[leaf:whole], buffer[whole : whole + at.size],
        ),
    )  # fmt: skip


# --- the estimate ------------------------------------------------------------------------------------------


@kernel
def gather(at, queue, bench, prior):
    """Stack what is known of [s; v], the whole queue and the prior; return how many rows."""
    M, c, m = bench.M, bench.whole, at.m
    join_all(at, queue, bench)
    rows = int(c[at.rows])
    for j in range(m + 1):
        is_out = j < m and prior[j] == np.inf  # known to be 0: its column leaves, but for a row of its own
        for i in range(rows):
            M[j, i] = 0.0 if is_out else c[at.R + i * (m + 1) + j]
    for j in range(m):
        if prior[j] > 0.0:
            for l in range(m + 1):
                M[l, rows] = 0.0
            M[j, rows] = prior[j] if prior[j] < np.inf else 1.0
            rows += 1
    return rows


@rare
def estimate(at, prior, queue, bench, w, C, w0, X):
    """Fill w and C from all that is in the queue, and the prior; say whether that determines them."""
    M, c, m, s = bench.M, bench.whole, at.m, at.s
    rows = gather(at, queue, bench, prior)
    if rows < m:
        return False
    triangularise(M, rows, m)
    if not invert(M, m, X) <= m * WORST:
        return False
    solve_triangular(M, m, w0)
    for j in range(m):
        if prior[j] == np.inf:
            X[j, j] = 0.0
    for i in range(m):  # from the start of the window to its end
        w[i] = c[at.d + i] if i < s else w0[i]
        for j in range(m):
            C[i, j] = 0.0 if i < s else X[i, j]
        for l in range(s if i < s else 0):
            w[i] += c[i * s + l] * w0[l]
            for j in range(l, m):
                C[i, j] += c[i * s + l] * X[l, j]
    return True


@kernel
def square(row, at, C, spare):
    """Return the squared length of C' row."""
    total = 0.0
    for j in range(spare.size):
        spare[j] = 0.0
    for i in range(spare.size):
        for j in range(spare.size):
            spare[j] += row[at + i] * C[i, j]
    for j in range(spare.size):
        total += spare[j] * spare[j]
    return total


@rare
def carry(at, moves, before, u, w0, C0, w, C):
    """Fill w and C with the state w0, whose covariance is C0 C0', after the interval just found."""
    s, v, m = at.s, at.v, at.m
    for i in range(m):
        n, where, first, own = (s, 0, 0, i) if i < s else (v, at.ahead, s, i - s)
        w[i] = driven(at, moves, where, n, own, before, u)
        for j in range(m):
            C[i, j] = 0.0
        for l in range(n):
            f = moves[where + own * n + l]
            w[i] += f * w0[first + l]
            for j in range(m):
                C[i, j] += f * C0[first + l, j]


@advance.on(QueueForm)
def advance_queue_form(form, noise, memory, gate, scale, detector, state, scratch, y, u, out, t):
    head, queue, at, bench, w, X, m = (
        state.head,
        open_queue(state),
        scratch.at,
        scratch.bench,
        scratch.w,
        scratch.X,
        scratch.at.m,
    )
    seconds = elapse(form, state, u, t)
    rounding = ROUNDING * abs(head[TIME])
    if abs(seconds - form.dt) <= min(rounding, SAME * form.dt):  # instants tell no more: equal moves are found once
        seconds = form.dt
    for l in range(at.k):
        scratch.before[l] = state.held[l]
    status = take_inputs(state, u, t)

    # what is too old leaves
    age = form.window - max(SAME * form.window, rounding)
    if seconds >= age:
        queue.marks[COUNT] = queue.marks[FRONT] = head[DETERMINED] = 0.0
    drop_older(at, form.plant, queue, bench, age - seconds)

    # predict
    if queue.marks[COUNT] > 0.0 or head[DETERMINED] > 0.0:
        move_over(at, form.plant, queue, bench, seconds)
    if head[DETERMINED] > 0.0:
        carry(at, queue.moves, scratch.before, state.held, state.w, state.C, w, X)
        for i in range(m):
            scratch.z[i] = along(form.V, i * m, w)
        for i in range(at.p):
            scratch.ahead[i] = form.r[i] * (1.0 + square(form.plant, at.E + i * m, X, w))
    alarm = observe(form, scale, detector, state, scratch, y, out, t)

    # correct
    append(at, form.plant, queue, bench, seconds, scratch.before, state.held, scratch.y)
    head[DETERMINED] = 0.0
    if estimate(at, form.prior, queue, bench, state.w, state.C, w, X):
        head[DETERMINED] = 1.0
        for i in range(state.std.size):
            if i < m:
                state.z[i] = along(form.V, i * m, state.w)
            state.std[i] = math.sqrt(square(form.V, i * m, state.C, w))
    report(form, scale, state, out, t, status, alarm)
