"""A finite window over samples at any instants: segments in a queue of two stacks, joined by orthogonal transformations.

The newest samples lie behind: one segment over all of them. Those before lie in front: for each, the segment from it to
the last of them. A new sample is joined to the segment behind; an old one leaves the front by being forgotten, so that
nothing is ever subtracted. When the front is empty the samples behind become it, one pass backwards: two joins a sample
on average, whatever the window's length. Of the front only each ``block``-th segment is kept, and the block in use:
twice the root of the window, for one more join a sample.

    window:  front[oldest], .., front[newest] | behind        estimate: prior, first of the front + behind

A sample is in the window while it is less than round(window/dt) dt old: it has left at equality. The prior of the
disturbances holds at the oldest sample, missing or not.
"""

import math
from typing import NamedTuple

import numpy as np

from ...kernel.compose import Vector, advance, kernel, open_row, open_work, rare
from ...kernel.qr import invert, solve_triangular, triangularise
from ..gain.step import take_inputs
from ..recursive.row import HUGE
from .row import DETERMINED, HEAD, TIME, along, elapse, observe, report
from .segment import Layout, combine, copy, driven, find_moves, layout, measure, split, stand, travel

ROUNDING = 4 * float(np.finfo(float).eps)  # of an instant
SAME = 1e-9  # ages that differ by less, relative to the window, are the same
CONDITION = 1e12  # of the unknowns (columns of length one), above which z is not determined
MISSING = 2 * HUGE  # an output in the queue

FIRST, COUNT, FRONT, SECONDS, FOUND = range(5)  # marks of the queue
MARKS = 5


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
    marks: float
    s: float  # modes that stay
    straight: float  # 1: the input is a straight line between its samples
    window: float  # age at which a sample leaves
    capacity: float  # most samples in the queue
    block: float
    plant: Vector  # As, Bs, Au, Bu; outputs as measured in units of their noise (`segment.Layout`)
    V: Vector  # z and the derived outputs are V w
    prior: Vector  # 1 / prior deviation of each w at the window's start


class Queue(NamedTuple):
    """Views of the part of a row that holds the samples."""

    marks: np.ndarray  # FIRST, ..
    moves: np.ndarray  # what the last interval did: found once for all that are equal
    ring: np.ndarray  # samples: (seconds since the one before, inputs, outputs)
    behind: np.ndarray  # segment
    block: np.ndarray  # segments of the front's block in use
    blocks: np.ndarray  # the oldest segment of each block


class Row(NamedTuple):
    """Views of one state row."""

    head: np.ndarray
    z: np.ndarray
    std: np.ndarray
    ahead: np.ndarray
    held: np.ndarray
    marks: np.ndarray
    w: np.ndarray  # estimate in coordinates of its own
    C: np.ndarray  # its covariance is C C'
    queue: Queue


class Bench(NamedTuple):
    """Scratch for segments: rows stacked, powers of a matrix, two segments."""

    M: np.ndarray
    powers: np.ndarray
    leaf: np.ndarray
    whole: np.ndarray


class Work(NamedTuple):
    """Layout of segments, and scratch."""

    at: Layout
    z: np.ndarray
    ahead: np.ndarray
    y: np.ndarray
    before: np.ndarray  # inputs of the sample before
    w: np.ndarray
    X: np.ndarray
    bench: Bench


def build(observer, common) -> QueueForm:
    """Return the form of an observer."""
    plant, length = observer.plant, observer.length
    n, m = plant.n, plant.m
    V, inverse, s = split(plant.A, n, observer.window)
    A, B = inverse @ plant.A @ V, inverse @ plant.B
    weight = 1 / np.sqrt(common["r"])
    E = weight[:, None] * plant.H @ V
    prior = np.zeros(m)
    with np.errstate(divide="ignore"):
        prior[s - (m - n) : s] = V[range(n, m), range(s - (m - n), s)] / plant.prior_std[n:]
    return QueueForm(
        **common, s=s, straight=observer.hold == "foh", window=length * observer.dt, capacity=observer.capacity,
        block=math.ceil(math.sqrt(observer.capacity)), V=np.vstack([V, observer.derived_rows @ V]).ravel(), prior=prior,
        plant=np.concatenate([x.ravel() for x in (A[:s, :s], B[:s], A[s:, s:], B[s:], E, plant.D, weight)]),
    )  # fmt: skip


@kernel
def laid_out(form):
    """Return the layout."""
    return layout(int(form.s), int(form.m), int(form.inputs), int(form.outputs), int(form.straight))


def fields(form) -> list[tuple]:
    """Return the fields of a row behind the common ones."""
    at, capacity, block = laid_out(form), int(form.capacity), int(form.block)
    return [
        ("w", "f8", (at.m,)), ("C", "f8", (at.m, at.m)), ("queue", "f8", (MARKS,)), ("moves", "f8", (at.moves,)),
        ("ring", "f8", (capacity, 1 + at.k + at.p)), ("behind", "f8", (at.size,)), ("block", "f8", (block, at.size)),
        ("blocks", "f8", (capacity // block, at.size)),
    ]  # fmt: skip


def scratch_size(form) -> int:
    """Return how many numbers `Work` takes."""
    m, k, p, size = int(form.m), int(form.inputs), int(form.outputs), laid_out(form).size
    return 2 * m + 2 * p + k + (m + 1) * (2 * m + p) + m * m + 5 * m * max(m, k) + 2 * size


@open_row.on(QueueForm)
def _(form, row):
    at, capacity, block = laid_out(form), int(form.capacity), int(form.block)
    m, wide = at.m, 1 + at.k + at.p
    z = len(HEAD)
    std = z + m
    ahead = std + form.tolerance.size
    held = ahead + at.p
    marks = held + at.k
    w = marks + int(form.marks)
    C = w + m
    queue = C + m * m
    moves = queue + MARKS
    ring = moves + at.moves
    behind = ring + capacity * wide
    use = behind + at.size
    blocks = use + block * at.size
    return Row(
        row[:z], row[z:std], row[std:ahead], row[ahead:held], row[held:marks], row[marks:w], row[w:C],
        row[C:queue].reshape(m, m),
        Queue(
            row[queue:moves], row[moves:ring], row[ring:behind].reshape(capacity, wide), row[behind:use],
            row[use:blocks].reshape(block, at.size), row[blocks:].reshape(capacity // block, at.size),
        ),
    )  # fmt: skip


@open_work.on(QueueForm)
def _(form, scratch):
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
        at, scratch[:ahead], scratch[ahead:y], scratch[y:before], scratch[before:w], scratch[w:X],
        scratch[X:M].reshape(m, m),
        Bench(
            scratch[M:powers].reshape(m + 1, 2 * m + at.p), scratch[powers:leaf].reshape(5, m * max(m, k)),
            scratch[leaf:whole], scratch[whole : whole + at.size],
        ),
    )  # fmt: skip


# --- the queue ---------------------------------------------------------------------------------------------


@kernel
def move_over(at, plant, queue, bench, seconds):
    """Find what so many seconds do, unless they are those of the last time."""
    if queue.marks[FOUND] == 0.0 or queue.marks[SECONDS] != seconds:
        find_moves(at, plant, seconds, queue.moves, bench.powers)
        queue.marks[FOUND], queue.marks[SECONDS] = 1.0, seconds


@rare
def fill_front(at, plant, queue, bench, start, stop):
    """Find the segments of the front's samples ``start`` to ``stop``, counted from its newest."""
    ring, leaf, k = queue.ring, bench.leaf, at.k
    capacity, block = ring.shape[0], queue.block.shape[0]
    newest = int(queue.marks[FIRST]) + int(queue.marks[FRONT]) - 1
    for i in range(start, stop):
        one, own = ring[(newest - i) % capacity], queue.block[i % block]
        if i == 0:
            stand(at, own)
            measure(at, plant, own, one[1 + k :], one[1:], False, bench.M)
        else:
            after = ring[(newest - i + 1) % capacity]
            move_over(at, plant, queue, bench, after[0])
            travel(at, leaf, queue.moves, after[0], one[1:], after[1:])
            measure(at, plant, leaf, one[1 + k :], one[1:], False, bench.M)
            later = queue.blocks[i // block - 1] if i % block == 0 else queue.block[i % block - 1]
            combine(at, leaf, later, own, bench.M)
        if i % block == block - 1:
            copy(own, queue.blocks[i // block])


@kernel
def turn(at, plant, queue, bench):
    """Let the samples behind become the front."""
    queue.marks[FRONT] = queue.marks[COUNT]
    fill_front(at, plant, queue, bench, 0, int(queue.marks[FRONT]))


@kernel
def span(at, queue):
    """Return the seconds from the oldest sample to the newest."""
    marks, total = queue.marks, 0.0
    if marks[FRONT] > 0.0:
        total += queue.block[(int(marks[FRONT]) - 1) % queue.block.shape[0], at.seconds]
    if marks[COUNT] > marks[FRONT]:
        total += queue.behind[at.seconds]
    return total


@rare
def drop_older(at, plant, queue, bench, seconds):
    """Let samples leave until there is room, and the oldest is younger than so many seconds."""
    marks, block = queue.marks, queue.block.shape[0]
    while marks[COUNT] > 0.0 and (marks[COUNT] >= queue.ring.shape[0] or span(at, queue) >= seconds):
        if marks[FRONT] == 0.0:
            turn(at, plant, queue, bench)
        marks[FRONT] -= 1.0
        marks[COUNT] -= 1.0
        marks[FIRST] = (marks[FIRST] + 1.0) % queue.ring.shape[0]
        front = int(marks[FRONT])
        if front == 0 and marks[COUNT] > 0.0:
            turn(at, plant, queue, bench)
        elif front > 0 and front % block == 0:
            fill_front(at, plant, queue, bench, front - block, front)


@rare
def append(at, plant, queue, bench, seconds, before, u, y):
    """Let outputs y, so many seconds after the last sample, be the newest."""
    marks, leaf = queue.marks, bench.leaf
    if marks[COUNT] == 0.0:
        stand(at, leaf)
    else:
        travel(at, leaf, queue.moves, seconds, before, u)
    measure(at, plant, leaf, y, u, True, bench.M)
    if marks[COUNT] == marks[FRONT]:
        copy(leaf, queue.behind)
    else:
        combine(at, queue.behind, leaf, bench.whole, bench.M)
        copy(bench.whole, queue.behind)
    own = queue.ring[int(marks[FIRST] + marks[COUNT]) % queue.ring.shape[0]]
    own[0] = seconds
    for l in range(at.k):
        own[1 + l] = u[l]
    for i in range(at.p):
        own[1 + at.k + i] = y[i] if y[i] == y[i] else MISSING
    marks[COUNT] += 1.0


# --- the estimate ------------------------------------------------------------------------------------------


@kernel
def gather(at, queue, bench, prior):
    """Stack what is known of the state at the window's start (of v: its end): the whole queue, and the prior.

    Return how many rows, 0 where too few; ``bench.whole`` is the segment of the whole window.
    """
    marks, M, c, m = queue.marks, bench.M, bench.whole, at.m
    if marks[FRONT] > 0.0:
        combine(at, queue.block[(int(marks[FRONT]) - 1) % queue.block.shape[0]], queue.behind, c, M)
    else:
        copy(queue.behind, c)
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
    if not invert(M, m, X) < CONDITION:
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
def _(form, noise, memory, gate, scale, detector, state, work, y, u, out, t):
    head, queue, at, bench, w, X, m = state.head, state.queue, work.at, work.bench, work.w, work.X, work.at.m
    seconds = elapse(form, state, u, t)
    rounding = ROUNDING * abs(head[TIME])
    if abs(seconds - form.dt) <= min(rounding, SAME * form.dt):  # instants tell no more: equal moves are found once
        seconds = form.dt
    for l in range(at.k):
        work.before[l] = state.held[l]
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
        carry(at, queue.moves, work.before, state.held, state.w, state.C, w, X)
        for i in range(m):
            work.z[i] = along(form.V, i * m, w)
        for i in range(at.p):
            work.ahead[i] = form.r[i] * (1.0 + square(form.plant, at.E + i * m, X, w))
    alarm = observe(form, scale, detector, state, work, y, out, t)

    # correct
    append(at, form.plant, queue, bench, seconds, work.before, state.held, work.y)
    head[DETERMINED] = 0.0
    if estimate(at, form.prior, queue, bench, state.w, state.C, w, X):
        head[DETERMINED] = 1.0
        for i in range(state.std.size):
            if i < m:
                state.z[i] = along(form.V, i * m, state.w)
            state.std[i] = math.sqrt(square(form.V, i * m, state.C, w))
    report(form, scale, state, out, t, status, alarm)
