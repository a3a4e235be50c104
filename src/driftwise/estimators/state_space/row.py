"""What a state row and the scratch of a filter with the user's matrices hold, and where those of a sample stand."""

from __future__ import annotations

from typing import NamedTuple

from ...engine.dispatch import Size, Vector, kernel, open_scratch
from ...engine.layout import Field, Layout, each, numbers, policy
from ..common.columns import SAMPLE

SAMPLES, OBSERVED, STATUS, CHI2, SCORE, TIME, READY = range(7)  # of the head of a row
NIS, DENSITY, STATISTIC = range(3)  # behind the columns of the outputs


class StateSpaceForm(NamedTuple):
    """Sizes and matrices, row after row; Q = U D U'."""

    n: Size
    inputs: Size
    outputs: Size
    memory_size: Size
    detector_size: Size
    dt: float
    settle: float  # outputs taken in before the detector watches
    fade: float  # what is left of the past's weight after a sample: 1, nothing fades
    scale_fade: float  # what is left of the weight of what sigma^2 was learnt from
    exact: float  # 1: something may be known without error
    F: Vector
    G: Vector
    H: Vector
    D: Vector
    Uq: Vector
    Dq: Vector
    R: Vector
    A: Vector  # in continuous time, for steps of any length; empty where all are dt
    B: Vector
    W: Vector  # spectral density of the noise
    mean: Vector  # of the prior
    U0: Vector
    D0: Vector


HEAD = numbers(
    "head",
    samples="samples taken",
    observed="outputs taken in",
    status="bits of the last one",
    chi2="sum of e^2/T over them",
    score="sum of log p(y)",
    time="of the last sample",
    ready="1: there is an estimate",
)
STATE_SPACE = Layout(
    *HEAD,
    Field("x", ("n",), "state, given all samples so far", trace="their names"),
    Field("D", ("n",), "its covariance U D U', relative to sigma^2: the diagonal"),
    Field("U", ("n * (n - 1) // 2",), "and the factor above it, column by column"),
    Field("held", ("inputs",), "each input: its last known value"),
    Field("in_a_row", ("outputs",), "each output: outliers in a row, until now"),
    policy("memory_state", of="memory"),
    policy("detector_state", of="detector"),
)
STATE_SPACE.on(StateSpaceForm)


@kernel
def widest(form):
    """Return the length of each power that an exponential takes; 0 where all steps are dt."""
    n, k = int(form.n), int(form.inputs)
    return 0 if form.A.size == 0 else max(4 * n * n, n * k)


SCRATCH = Layout(
    *each("n", a="vector", b="vector", f="vector"),
    *each("2 * n", weight="of the columns of Y", g="vector"),
    Field("Y", ("n", "2 * n")),
    *each(
        "outputs",
        z="y - D u of what was taken, less what the noise of those before says",
        d="its own noise variance",
        e="its innovation",
    ),
    Field("rows", ("outputs * n",), "and its row of H"),
    Field("L", ("outputs", "outputs"), "R = L diag(d) L' of what was taken"),
    Field("is_moved", ("1",), "1: the state was predicted, 0: it begins here; what follows is for looking back"),
    Field("FU", ("n * n",), "F times the factor U before the prediction"),
    *each("n", before="D before the prediction", D1="and after it"),
    Field("U1", ("n * (n - 1) // 2",), "U after it"),
    Field("F", ("on * n * n",), "step of an interval that is not dt"),
    *each("on * n * inputs", G="likewise", slope="of inputs that are straight lines: not used"),
    Field("Uq", ("on * n * (n - 1) // 2",), "likewise"),
    Field("Dq", ("on * n",), "likewise"),
    Field("Q", ("on * n * n",)),
    *each("on * 4 * n * n", M="", E=""),
    Field("powers", ("5", "wide")),
    widest=widest,
    wide="widest(form)",
    on="int(wide > 0)",
)
open_scratch.on(StateSpaceForm)(SCRATCH.open)

STATE_SAMPLE = SAMPLE.replace(
    Field("nis", ("1",), "e' S^-1 e of the outputs taken in"),
    Field("density", ("1",), "log p(y) of them, given everything before"),
    Field("statistic", ("1",), "of the detector, over its threshold"),
)


def sizes(n: int, k: int, p: int) -> dict[str, int]:
    """Return how many numbers each matrix of a sample has, in their order behind its instant."""
    return {"F": n * n, "G": n * k, "H": p * n, "D": p * k, "Uq": n * (n - 1) // 2, "Dq": n, "R": p * p}
