"""What a memory of a regression needs to know of a filter that estimates a state x beside the parameters theta.

Every joint Gaussian is p(theta) p(x | theta), and in U D U' with x first it is written so: the trailing block is the
factor of p(theta), and E[x | theta] = x^ + A (theta - theta^) with A = U_x,theta U_theta,theta^-1, var[x | theta] =
U_xx D_x U_xx'. An innovation e = h'(s - s^) + v is then that of a regression on theta alone:

    e = psi'(theta - theta^) + v',    psi = A' h_x + h_theta,    var v' = h_x' var[x | theta] h_x + R

A memory takes e into p(theta) as it does in any regression, by whatever rule; x | theta takes it in as a Kalman filter
that knows theta does, and A becomes A - K psi'. Nothing is approximated. Source: Friedland (1969), "Treatment of bias
in recursive filtering", IEEE Trans. AC-14, 359-367, theta being his bias; Bierman (1977), chapter VII.
"""

import math
from typing import NamedTuple

import numpy as np

from ...engine.dispatch import kernel
from ...engine.ud import correct, marginal, predicted_variance
from ...memory.questions import View, adapt, begin, outlier_probability, time_update
from ...models.scale import sigma2
from .fresh import correct_fresh, follow_fresh, show_fresh

VAGUE = 100.0
COUNT, WEIGHT, SCORE, COUNTS = range(4)  # of the numbers kept where samples fade, and how many


class Room(NamedTuple):
    """Scratch: A (rows, N), the factor of p(theta), psi, theta before, what a memory sees, and the gain of x."""

    A: np.ndarray
    U: np.ndarray
    psi: np.ndarray
    before: np.ndarray
    row: np.ndarray
    f: np.ndarray
    b: np.ndarray
    c: np.ndarray
    gain: np.ndarray
    fresh: np.ndarray


@kernel
def room_size(rows, N):
    """Return how many numbers of scratch ``rows`` unknowns before N parameters need."""
    return rows * N + N * (N - 1) // 2 + 7 * N + rows + 1


@kernel
def open_room(space, rows, N):
    """Return the views."""
    U = rows * N
    psi = U + N * (N - 1) // 2
    before = psi + N
    row = before + N
    f = row + N
    b = f + N
    c = b + N
    gain = c + N
    fresh = gain + rows
    return Room(
        space[:U].reshape(rows, N), space[U:psi], space[psi:before], space[before:row], space[row:f], space[f:b],
        space[b:c], space[c:gain], space[gain:fresh], space[fresh : fresh + N + 1],
    )  # fmt: skip


@kernel
def separate(U, f, room):
    """Fill the factor of p(theta) and, given f = U'h, psi: U_theta' psi = f_theta."""
    N = room.psi.size
    rows = f.size - N
    marginal(U, rows, N, room.U)
    at = 0
    for j in range(N):
        total = f[rows + j]
        for i in range(j):
            total -= room.U[at + i] * room.psi[i]
        room.psi[j] = total
        at += j


@kernel
def slopes(U, room):
    """Fill A = dE[x | theta]/dtheta: A U_theta = U_x,theta."""
    rows, N, at = room.gain.size, room.psi.size, 0
    for j in range(N):
        column = U[(rows + j) * (rows + j - 1) // 2 :]
        for i in range(rows):
            total = column[i]
            for k in range(j):
                total -= room.A[i, k] * room.U[at + k]
            room.A[i, j] = total
        at += j


@kernel
def put_together(U, room):
    """Write p(theta) back, with A: U_x,theta = A U_theta."""
    rows, N, at = room.gain.size, room.psi.size, 0
    for j in range(N):
        column = U[(rows + j) * (rows + j - 1) // 2 :]
        for i in range(rows):
            total = room.A[i, j]
            for k in range(j):
                total += room.A[i, k] * room.U[at + k]
            column[i] = total
        for k in range(j):
            column[rows + k] = room.U[at + k]
        at += j


@kernel
def sigma2_of_few(scale, left, chi2):
    """Return sigma^2 where samples fade; of the few that are left it may be anything up to the data's own."""
    s2 = sigma2(scale, left, chi2)
    return s2 if left >= 1.0 else max(s2, 1.0)


@kernel
def view_of_parameters(s, D, room, s2, weight, surprise, y, fresh, has_past):
    """Return what a memory sees of a regression on theta."""
    rows = room.gain.size
    return View(
        0, s[rows:], room.U, D[rows:], room.row, room.f, room.b, room.c,
        s2, weight, surprise, 0.0, s[:0], room.row, y, fresh, has_past,
    )  # fmt: skip


@kernel
def begin_given_state(memory, memory_state, s, U, D, room):
    """Let the memory begin with the prior of the parameters."""
    marginal(U, room.gain.size, room.psi.size, room.U)
    begin(memory, memory_state, view_of_parameters(s, D, room, 1.0, 0.0, math.nan, math.nan, s[:0], 0.0))


@kernel
def adapt_given_state(memory, memory_state, e, R, usual, s, U, D, f, room, s2, weight, y, fresh, has_past):
    """Take the innovation e of the row h, f = U'h, into s and U D U' by the memory's own rule; return its variance T.

    ``usual`` is the variance of the noise, y the output, NaN if e is in other units. A row that says next to nothing,
    since the state is lost or has never been known, may be of any size: the memory sees it in units in which var v' is
    VAGUE times that, so that no mean square of regressors is spoilt. An outlier, as the memory has it, teaches x
    nothing. ``fresh``: see `common.fresh`; ``has_past``: 1 where the state has one of its own (`View`).
    """
    rows, N = room.gain.size, room.psi.size
    separate(U, f, room)
    slopes(U, room)
    Dx, fx = D[:rows], f[:rows]
    own = predicted_variance(fx, Dx, R)
    share = min(VAGUE * usual / own, 1.0) if usual > 0.0 else 1.0
    root = math.sqrt(share)
    for j in range(N):
        room.before[j] = s[rows + j]
        room.row[j], room.f[j] = root * room.psi[j], root * f[rows + j]
    if fresh.size > 0:
        show_fresh(fresh, room.fresh, room.A, room.psi, root)
    view = view_of_parameters(s, D, room, s2, weight, math.nan, y, room.fresh if fresh.size > 0 else s[:0], has_past)
    T = adapt(memory, memory_state, root * e, share * own, view) / share
    if not T > 0.0:
        return T
    left = e
    for j in range(N):
        room.before[j] = s[rows + j] - room.before[j]
        left -= room.psi[j] * room.before[j]
    if fresh.size > 0:
        left += follow_fresh(fresh, room.fresh, s, room.A, room.psi)
    is_clean = own > R and not outlier_probability(memory, memory_state) > 0.5
    if is_clean:
        own = correct(U[: rows * (rows - 1) // 2], Dx, fx, R, room.gain)
    for i in range(rows):
        if is_clean:
            K = room.gain[i] / own
            s[i] += K * left
            for j in range(N):
                s[i] += room.A[i, j] * room.before[j]
                room.A[i, j] -= K * room.psi[j]
        else:
            for j in range(N):
                s[i] += room.A[i, j] * room.before[j]
    if fresh.size > 0 and is_clean:
        correct_fresh(fresh, room.gain, own, N)
    put_together(U, room)
    return T


@kernel
def pass_time_given_state(memory, memory_state, s, U, D, room, s2, weight, surprise):
    """Let the memory forget, or the parameters drift, as in a regression; return lambda and status bits.

    The state given the parameters stays what it is, and moves with them.
    """
    rows, N = room.gain.size, room.psi.size
    marginal(U, rows, N, room.U)
    slopes(U, room)
    for j in range(N):
        room.before[j] = s[rows + j]
    view = view_of_parameters(s, D, room, s2, weight, surprise, math.nan, s[:0], 0.0)
    lam, status = time_update(memory, memory_state, 1.0, view)
    for i in range(rows):
        for j in range(N):
            s[i] += room.A[i, j] * (s[rows + j] - room.before[j])
    put_together(U, room)
    return lam, status
