"""What a state row and the scratch of a grey box hold."""

from __future__ import annotations

from typing import NamedTuple

from ...engine.dispatch import Size, Vector, kernel, open_scratch
from ...engine.layout import Field, Layout, each, joined, numbers, policy
from ..common.columns import SAMPLE
from ..common.given_state import COUNTS, open_room, room_size
from ..state_space.row import CHI2, HEAD, OBSERVED, READY, SAMPLES, SCORE, STATUS, TIME  # noqa: F401
from .colour import KEPT, LEVELS, WEIGHTS

IS_NEW, EDGE, MODES, OTHER_LOGLIK = range(len(HEAD), len(HEAD) + 4)  # of the head of a row, behind those it shares
STATISTIC, SINCE, WHICH, DENSITY = range(4)  # behind the columns of the outputs


class GreyBoxForm(NamedTuple):
    """Sizes and constants of a grey box: n states, m parameters."""

    n: Size
    inputs: Size
    outputs: Size
    m: Size
    detector_size: Size
    memory_size: Size
    fades: Size  # 1: the memory says how many samples count
    learns: Size  # 1: it takes a sample in by its own rule
    slopes: Size  # 1: the detector wants the slopes of the innovations by the parameters
    colours: Size  # 1: bars are wider where residuals are not white
    exact: Size  # 1: the gain is differentiated, too
    is_continuous: float  # 1: the formulas are derivatives by time
    is_linear: float  # 1: they are linear in the state
    is_timed: float  # 1: the memory goes by seconds, else by samples
    walks: float  # 1: noise acts on the state
    dt: float
    settle: float  # outputs taken in before the detector watches
    kinds: Vector  # of each parameter: LINEAR, LOG, LOGISTIC
    low: Vector
    high: Vector
    walk: Vector  # (n, n): spectral density of the noise on the state
    start: Vector  # what is expected of state and transformed parameters at first
    spread: Vector  # deviations of the parameters at first


GREY_BOX = Layout(
    *HEAD,
    *numbers(
        "head",
        is_new="1: the memory is to begin with what is known now",
        edge="samples in a row with a parameter at the edge of its prior",
        modes="sets of parameters that explained the first samples as well",
        other_loglik="log likelihood of the second of these, less that of the first",
    ),
    *joined(
        "s",
        Field("x", ("n",), "state, given all samples so far", trace="their names"),
        Field("theta", ("m",), "transformed parameters: logarithms of positive ones", trace="their names"),
    ),
    Field("D", ("N",), "covariance U D U' of both, relative to sigma^2: the diagonal"),
    Field("U", ("N * (N - 1) // 2",), "and the factor above it, column by column"),
    Field("held", ("inputs",), "each input: its last known value"),
    Field("in_a_row", ("outputs",), "each output: outliers in a row, until now"),
    Field("noise", ("outputs",), "each output: deviation of its noise"),
    Field("bend", ("m",), "how much the record bends over one deviation of a parameter, per deviation"),
    Field("fitted", ("m",), "what the start has found so far"),
    Field("other", ("m",), "the second set of parameters, where there is one"),
    Field("wide", ("m",), "factor of each parameter's variance, for residuals that are not white"),
    Field("chain", ("outputs * colours", f"{WEIGHTS} + 2 * m"), "each output: what its innovations say of the next"),
    Field("counted", ("colours",), "samples that were counted for it"),
    Field("blocks", (f"{LEVELS * KEPT} * colours", "m"), "sums over them in blocks of 1, 2, 4, ..: colour.py"),
    Field("dP", ("m * exact", "n * n"), "slopes of the state's covariance, given the parameters, by each of them"),
    Field("sizes", ("(m + 1) * exact",), "mean slopes of log S by each of them, S that of an innovation; of how many"),
    policy("detector_state", of="detector"),
    policy("memory_state", of="memory"),
    Field("counts", (f"{COUNTS} * fades",), "samples that count, for sigma^2 and for the gain; log density of all"),
    N="n + m",
)
GREY_BOX.on(GreyBoxForm)


@kernel
def has_room(form):
    """Return 1 where the memory, the detector or the exact gradient looks at the parameters alone."""
    return int(max(form.learns, form.slopes, form.exact))


SCRATCH = Layout(
    *each("N", psi="row of an output", f="U' psi", b="vector", c="vector", point="where formulas are taken"),
    *each("m", values="parameters in their units", rates="their slopes by the transformed ones"),
    *each("m", c_part="of a sample: what it adds to each parameter", v_part="expected variance of that"),
    *each("n", dx="", next=""),
    Field("slopes", ("n", "n + inputs + m"), "of dx"),
    Field("y", ("outputs",)),
    Field("rows", ("outputs", "n + inputs + m"), "slopes of the outputs"),
    *each("n", "n + m", J="[F, S]: slopes of x(t+1) by x and by the parameters", K="", stage=""),
    *each("n", "n + 1", E="[F - I, g]", term="", spare=""),
    *each("m", "n * (n + 1)", slope_E="slopes of E by each parameter", slope_term="", slope_M=""),
    Field("M", ("n", "n + 1"), "[A, b]"),
    *each("2 * n", weight="of the columns of Y", g="vector"),
    Field("Y", ("n", "2 * n")),
    *each("n", "n", Q="what the walks of the state add", V="", G=""),
    Field("packed", ("n * (n + 1) // 2",), "Q"),
    *each("n * (n - 1) // 2", Uq="of Q"),
    *each("n", Dq="of Q", mean="of x"),
    *each("m * exact", "n * n", dF="slopes of F by each parameter", dQ="of Q"),
    Field("dH", ("m * exact", "outputs * n"), "of the slopes of the outputs by the state"),
    Field("dK", ("m * exact", "n"), "of the gain of an output"),
    Field("of_S", ("m * exact",), "of log S"),
    *each("n * exact", "n", P="covariance of the state, given the parameters", half=""),
    Field("room", ("has_room(form) * room_size(n, m)",)),
    N="n + m",
    has_room=has_room,
    room_size=room_size,
)
open_scratch.on(GreyBoxForm)(SCRATCH.open)

GREY_SAMPLE = SAMPLE.replace(
    Field("statistic", ("1",), "of the detector, over its threshold"),
    Field("since", ("1",), "at an alarm: samples since the change began"),
    Field("which", ("1",), "at an alarm: the parameter that the detector names, -1: it cannot say"),
    Field("density", ("1",), "log p(y) of the outputs taken in, given everything before"),
    *each(
        "outputs",
        taken="innovation given the outputs of the sample before it, too; NaN where none was taken in",
        taken_variance="its squared scale",
    ),
)


@kernel
def room_of(form, scratch):
    """Return where the memory, or the detector, sees the parameters alone."""
    return open_room(scratch.room, has_room(form) * int(form.n), has_room(form) * int(form.m))
