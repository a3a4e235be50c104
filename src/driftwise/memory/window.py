"""A window: the last so many samples, and nothing before.

The posterior of the last T rows is computed afresh at every sample, from two triangles: what the rows of the present
round say together, and what those of the round before say from row k on, stored for every k when that round ended (a
queue made of two stacks). Nothing is ever subtracted, so nothing is left of a row that has gone. A triangle is the QR
factor of rows [psi' | y] in coordinates in which the prior is a unit covariance; merging two costs O(N^3).
"""

import math
from typing import NamedTuple

from ..engine import validation
from ..engine.dispatch import PerParameter, Vector, kernel, rare
from ..engine.errors import InputError
from ..engine.layout import Field, Layout, each, numbers
from ..engine.ud import predicted_variance, project
from .questions import adapt, count, resolve
from .registry import register
from .settings import LARGEST

AT, IS_FULL = range(2)  # of the head


WINDOW = Layout(
    *numbers("head", at="next slot", is_full="whether a round is complete"),
    *each("size", now="triangle of the rows of this round", whole="of all rows of the window"),
    Field("row", ("N + 1",), "scratch"),
    Field("slots", ("samples", "size"), "of the round before: triangle of the rows from each on; or a row of this one"),
    given=("N", "samples"),
    size="(N + 1) * (N + 2) // 2",
)
open_window = kernel(WINDOW.open)


@register("window:T", about="the last T samples", read=lambda words: Window(words.whole()), samples=10)
class Window(NamedTuple):
    """The last ``samples`` measured samples and the prior are all that counts: batch least squares that moves along.

    Exact to round-off, noise variance included; a jump is forgotten completely after ``samples`` samples. The state
    holds (N + 1)(N + 2)/2 numbers for each sample of the window. Bad at: noise (each estimate has only so many
    samples), and windows without excitation, which fall back on the prior.

    Examples
    --------
    >>> import driftwise as dw
    >>> b = [[1.0]] * 400 + [[2.0]] * 200  # b1 jumps
    >>> y, u = dw.simulate([-0.8], b, samples=600, noise_std=0.1, seed=1)
    >>> trace = dw.ARX(1, 1, memory=dw.memory.Window(100)).scan(y, u)
    >>> trace.parameters[-1].round(1).tolist(), trace.parameters_std[-1].round(2).tolist()
    ([-0.8, 2.0], [0.0, 0.01])
    """

    samples: int


class WindowKernel(NamedTuple):
    """What the kernel sees of `Window`: its length, and the prior of sigma^2 and of theta."""

    samples: float
    freedom: float
    chi2: float
    theta: PerParameter
    U: Vector
    D: PerParameter

    def state_size(self, parameters: int) -> int:
        """Return how many numbers it keeps."""
        return WINDOW.size(parameters, int(self.samples))


@resolve.on(Window)
def resolve_window(memory, setting):
    samples, (freedom, chi2) = validation.count("samples", memory.samples, least=1), setting.prior_counts
    if setting.is_learnt and freedom + samples < 2:
        raise InputError(
            f"a window of {samples} samples cannot learn {setting.N} parameters and the variance of the noise: "
            f"it needs {setting.N + 1} samples, better ten times that. Is the variance known? Then say variance=..."
        )
    found = WindowKernel(samples, freedom, chi2, *setting.prior)
    if found.state_size(setting.N) > LARGEST:
        raise InputError(
            f"a window of {samples} samples of {setting.N} parameters keeps {found.state_size(setting.N):.2g} numbers, "
            "more than "
            f"{LARGEST:.0e}: take a shorter one, or GainFloor(samples), which keeps next to nothing"
        )
    return found


@kernel
def absorb(R, row, first):
    """Rotate a row, zero before index ``first``, into the packed upper triangle R; the row is destroyed."""
    width = row.size
    at = first * width - first * (first - 1) // 2
    for i in range(first, width):
        x = row[i]
        square = R[at] * R[at] + x * x
        if x != 0.0 and square > 0.0:  # (below 1e-162 squares vanish, and so does what such a row says)
            h = math.sqrt(square)
            c, s = R[at] / h, x / h
            R[at] = h
            for k in range(1, width - i):
                r, x = R[at + k], row[i + k]
                R[at + k] = c * r + s * x
                row[i + k] = c * x - s * r
        at += width - i


@rare
def merge(R, other, row):
    """Rotate the triangle ``other`` into R; ``row`` is scratch."""
    at, width = 0, row.size
    for i in range(width):
        for k in range(i, width):
            row[k] = other[at + k - i]
        absorb(R, row, i)
        at += width - i


@rare
def turn(slots, now, row, size):
    """End a round: let slot k hold the triangle of rows k to the end, and ``now`` the prior alone."""
    width, last = row.size, slots.shape[0] - 1
    for k in range(last, -1, -1):
        slot = slots[k]
        for i in range(width):
            row[i] = slot[i]
        for i in range(size):
            slot[i] = slots[k + 1, i] if k < last else 0.0
        absorb(slot, row, 0)
    start_round(now, width)


@kernel
def start_round(now, width):
    """Let the triangle hold the prior: unit information, mean zero."""
    at = 0
    for i in range(width):
        for k in range(width - i):
            now[at + k] = 1.0 if k == 0 and i < width - 1 else 0.0
        at += width - i


@adapt.on(WindowKernel)
def adapt_window(memory, state, e, R, view):
    theta, U, D, N = view.theta, view.U, view.D, view.D.size
    width, size, T = N + 1, (N + 1) * (N + 2) // 2, predicted_variance(view.f, D, R)
    head, now, whole, row, slots = open_window(state, N, int(memory.samples))
    at = int(head[AT])
    if at == 0 and head[IS_FULL] > 0.0:
        turn(slots, now, row, size)
    elif at == 0:
        start_round(now, width)

    # the new row in the prior's coordinates: theta = theta0 + U0 sqrt(D0) w
    project(memory.U, view.psi, view.f)
    y = e
    for i in range(N):
        y += view.psi[i] * (theta[i] - memory.theta[i])
        row[i] = view.f[i] * math.sqrt(memory.D[i] / R)
    row[N] = y / math.sqrt(R)
    for i in range(width):
        slots[at, i] = row[i]
    absorb(now, row, 0)
    for i in range(size):
        whole[i] = now[i]
    if head[IS_FULL] > 0.0 and at + 1 < slots.shape[0]:
        merge(whole, slots[at + 1], row)
    head[AT] = at + 1.0
    if at + 1 == slots.shape[0]:
        head[AT], head[IS_FULL] = 0.0, 1.0
    solve(memory, whole, theta, U, D, view.b, view.c)
    return T


@rare
def solve(memory, R, theta, U, D, w, g):
    """Read theta and the factors of P off a triangle: P = G G', G = U0 sqrt(D0) R^-1 is upper triangular."""
    N = D.size
    for i in range(N - 1, -1, -1):
        at = i * (N + 1) - i * (i - 1) // 2
        w[i] = R[at + N - i]
        for k in range(i + 1, N):
            w[i] -= R[at + k - i] * w[k]
        w[i] /= R[at]
    into_theta(memory, w, N)
    for i in range(N):
        theta[i] = memory.theta[i] + w[i]
    for j in range(N):
        for i in range(j, -1, -1):
            at = i * (N + 1) - i * (i - 1) // 2
            g[i] = 1.0 if i == j else 0.0
            for k in range(i + 1, j + 1):
                g[i] -= R[at + k - i] * g[k]
            g[i] /= R[at]
        into_theta(memory, g, j + 1)
        D[j] = g[j] * g[j]
        for i in range(j):
            U[j * (j - 1) // 2 + i] = g[i] / g[j] if g[j] > 0.0 else 0.0


@kernel
def into_theta(memory, w, size):
    """w <- U0 sqrt(D0) w, for a vector that is zero from index ``size`` on."""
    for i in range(size):
        w[i] *= math.sqrt(memory.D[i])
    for i in range(size):
        for k in range(i + 1, size):
            w[i] += memory.U[k * (k - 1) // 2 + i] * w[k]


@count.on(WindowKernel)
def count_window(memory, state, count, chi2, weight, gain):
    parts = open_window(state, memory.theta.size, int(memory.samples))
    rho = parts.whole[parts.whole.size - 1]
    filled = memory.samples if parts.head[IS_FULL] > 0.0 else parts.head[AT]
    return memory.freedom + filled, memory.chi2 + rho * rho, filled
