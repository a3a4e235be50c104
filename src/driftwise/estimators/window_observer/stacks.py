"""Two stacks of segments that are a queue: the newest sample is joined, the oldest forgotten, nothing is undone.

The newest samples lie behind: one segment over all of them. Those before lie in front: for each, the segment from it to
the last of them. A new sample is joined to the segment behind; an old one leaves the front by being forgotten. When the
front is empty the samples behind become it, one pass backwards: two joins a sample on average, however long the window.
Of the front only every ``block``-th segment is kept, and those of the block in use: twice the root of the window, for
one more join a sample.

    front[oldest], .., front[newest] | behind              whole window: first of the front, joined with behind
"""

from typing import NamedTuple

import numpy as np

from ...engine.dispatch import kernel, rare
from ..arx.row import HUGE
from .segment import combine, copy, find_moves, measure, stand, travel

MISSING = 2 * HUGE  # an output in the ring
FIRST, COUNT, FRONT, SECONDS, FOUND = range(5)  # marks: oldest sample in the ring, samples, those in front; last move
MARKS = 5


class Queue(NamedTuple):
    """Views of the part of a row that holds the samples."""

    marks: np.ndarray  # FIRST, ..
    moves: np.ndarray  # what the last interval did: found once for all that are equal
    ring: np.ndarray  # samples: (seconds since the one before, inputs, outputs)
    behind: np.ndarray  # segment
    block: np.ndarray  # segments of the front's block in use
    blocks: np.ndarray  # the oldest segment of each block


class Bench(NamedTuple):
    """Scratch for segments: rows stacked, powers of a matrix, two segments."""

    M: np.ndarray
    powers: np.ndarray
    leaf: np.ndarray
    whole: np.ndarray


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


@rare
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
        marks[FIRST] = float((int(marks[FIRST]) + 1) % queue.ring.shape[0])
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


@kernel
def join_all(at, queue, bench):
    """Make ``bench.whole`` the segment of the whole window."""
    marks = queue.marks
    if marks[FRONT] > 0.0:
        first = queue.block[(int(marks[FRONT]) - 1) % queue.block.shape[0]]
        combine(at, first, queue.behind, bench.whole, bench.M)
    else:
        copy(queue.behind, bench.whole)
