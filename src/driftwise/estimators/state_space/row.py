"""What a state row and the scratch of a filter with the user's matrices hold, and where those of a sample stand."""

from __future__ import annotations

from typing import NamedTuple

from ...engine.dispatch import Size, Vector, open_scratch
from ...engine.layout import Field, Layout, each, numbers, policy
from ..common.columns import SAMPLE

SAMPLES, OBSERVED, STATUS, CHI2, SCORE, TIME, READY = range(7)  # of the head of a row
NIS, DENSITY, STATISTIC = range(3)  # behind the columns of the outputs


class StateSpaceForm(NamedTuple):
    """Sizes and matrices, row after row; Q = U D U'."""

    n: Size
    inputs: Size
    outputs: Size
    detector_size: Size
    dt: float
    settle: float  # outputs taken in before the detector watches
    fade: float  # what is left of the past's weight after a sample: 1, nothing fades
    exact: float  # 1: something may be known without error
    F: Vector
    G: Vector
    H: Vector
    D: Vector
    Uq: Vector
    Dq: Vector
    R: Vector
    mean: Vector  # of the prior
    U0: Vector
    D0: Vector


STATE_SPACE = Layout(
    *numbers(
        "head",
        samples="samples taken",
        observed="outputs taken in",
        status="bits of the last one",
        chi2="sum of e^2/T over them",
        score="sum of log p(y)",
        time="of the last sample",
        ready="1: there is an estimate",
    ),
    Field("x", ("n",), "state, given all samples so far", trace="their names"),
    Field("D", ("n",), "its covariance U D U', relative to sigma^2: the diagonal"),
    Field("U", ("n * (n - 1) // 2",), "and the factor above it, column by column"),
    Field("held", ("inputs",), "each input: its last known value"),
    Field("in_a_row", ("outputs",), "each output: outliers in a row, until now"),
    policy("detector_state", of="detector"),
)
STATE_SPACE.on(StateSpaceForm)

SCRATCH = Layout(
    *each("n", a="vector", b="vector", f="vector"),
    *each("2 * n", weight="of the columns of Y", g="vector"),
    Field("Y", ("n", "2 * n")),
    *each(
        "outputs", z="y - D u of what was taken, less what the noise of those before says", d="its own noise variance"
    ),
    Field("rows", ("outputs * n",), "and its row of H"),
    Field("L", ("outputs", "outputs"), "R = L diag(d) L' of what was taken"),
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
