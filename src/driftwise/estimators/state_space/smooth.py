"""The filter backwards, in the coordinates of its own factors: what `driftwise.estimators.joint.smooth` explains.

Here x+ = F x + w, S+^-1 F S is X, and a sample's outputs were taken one after the other: the last is undone first.
What a step did stands in its note, so matrices of every sample, gaps and steps of any length make no difference.
"""

import math
from typing import NamedTuple

from ...engine.dispatch import Size, kernel, pass_over, remember
from ...engine.layout import Field, Layout, each, numbers
from ...engine.ud import correct, project
from ...models.scale import sigma2
from ..joint.smooth import before_correction, before_prediction, hindsight, in_coordinates
from .row import CHI2, OBSERVED, StateSpaceForm

NOTE = Layout(
    *numbers("head", sigma2="after the sample", is_moved="1: its state follows from the one before"),
    Field("FU", ("n * n",)),
    *each("n", before="D before the prediction", D1="and after it"),
    Field("U1", ("n * (n - 1) // 2",), "U after it"),
    *each("p", d="noise variance of each output taken, -1 of the others", e="its innovation"),
    Field("rows", ("p * n",), "and its row"),
    given=("n", "p"),
)
SPACE = Layout(
    *each("n", mu="what later samples say of the state's coordinates", f="", D="", b="", weight="", shrink=""),
    *each("n", "n", C="and their covariance", X="", Z=""),
    Field("U", ("n * (n - 1) // 2",)),
    Field("g", ("p", "n"), "of each output: S' h"),
    Field("step", ("p",), "its innovation over that one's variance, 0 where nothing was learnt"),
    given=("n", "p"),
)
open_note, open_space = kernel(NOTE.open), kernel(SPACE.open)


class LookBack(NamedTuple):
    """The way back over a stretch of rows with their notes, to its first so many ``samples``."""

    n: Size
    p: Size
    at: Size  # where x, D and U begin in a row
    width: Size  # of a row; its note follows
    samples: Size
    lag: float  # samples to look ahead; -1: all
    sigma2: float  # of the whole record


@remember.on(StateSpaceForm)
def remember_sample(form, scale, state, scratch, note):
    kept = open_note(note, int(form.n), int(form.outputs))
    kept.head[0], kept.head[1] = sigma2(scale, state.head[OBSERVED], state.head[CHI2]), scratch.is_moved[0]
    for i in range(kept.FU.size):
        kept.FU[i] = scratch.FU[i]
    for i in range(kept.D1.size):
        kept.before[i], kept.D1[i] = scratch.before[i], scratch.D1[i]
    for i in range(kept.U1.size):
        kept.U1[i] = scratch.U1[i]
    for i in range(kept.d.size):
        kept.d[i], kept.e[i] = scratch.d[i], scratch.e[i]
    for i in range(kept.rows.size):
        kept.rows[i] = scratch.rows[i]


@kernel
def forget(space):
    """Nothing is known from later."""
    for i in range(space.mu.size):
        space.mu[i] = 0.0
        for j in range(space.mu.size):
            space.C[i, j] = 1.0 if i == j else 0.0


@kernel
def step_back(note, space):
    """Take mu and C from after a sample to after the one before it."""
    if note.head[1] == 0.0:
        forget(space)
        return
    n, p, D, U = note.D1.size, note.d.size, space.D, space.U
    for i in range(n):
        D[i] = note.D1[i]
    for i in range(U.size):
        U[i] = note.U1[i]
    for i in range(p):  # the corrections once more
        space.step[i] = 0.0
        if note.d[i] >= 0.0:
            project(U, note.rows[i * n : (i + 1) * n], space.f)
            for j in range(n):
                space.g[i, j] = math.sqrt(D[j]) * space.f[j]
            T = correct(U, D, space.f, note.d[i], space.b)
            space.step[i] = note.e[i] / T if T > 0.0 else 0.0
            note.d[i] = note.d[i] if T > 0.0 else -1.0
    for i in range(p - 1, -1, -1):
        if note.d[i] >= 0.0:
            before_correction(space.mu, space.C, space.g[i], space.weight, space.shrink, note.d[i], space.step[i])
    for i in range(n):
        for j in range(n):
            space.X[i, j] = note.FU[i * n + j]
    in_coordinates(note.U1, note.D1, note.before, n, space.X)
    before_prediction(space.mu, space.C, n, space.X, space.Z, space.f)


@pass_over.on(LookBack)
def pass_over_look_back(task, rows, q, kept, out, numbers):
    n, p, at, width, size = int(task.n), int(task.p), int(task.at), int(task.width), kept.shape[0] - 1
    space = open_space(numbers, n, p)
    for t in range(int(task.samples) - 1, -1, -1):
        s2 = task.sigma2
        if task.lag >= 0.0:
            last = min(t + int(task.lag), size - 1)
            s2 = kept[last, width]
            forget(space)
            for j in range(last, t, -1):
                step_back(open_note(kept[j, width:], n, p), space)
        row = kept[t + 1, at:]
        hindsight(
            row[:n], row[2 * n : 2 * n + space.U.size], row[n : 2 * n], space.mu, space.C, space.X, space.Z, s2, out[t]
        )
        if task.lag < 0.0:
            step_back(open_note(kept[t, width:], n, p), space)
