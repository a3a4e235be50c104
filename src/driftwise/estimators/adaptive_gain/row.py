"""The state row of the adaptive gain: what is kept between samples, where, and the scratch of a run."""

from typing import NamedTuple

from ...engine.dispatch import Vector, open_scratch
from ...engine.layout import Field, Layout, each, policy
from ..arx.row import HEAD
from ..common.columns import GAIN_SAMPLE

COLUMNS = GAIN_SAMPLE.size(1)
INNOVATION, PULL, PROBES = range(3)  # what the detector listens to


class GainForm(NamedTuple):
    """The plant, how its gain is learnt and kept stable, and what happens at an alarm."""

    n: float
    inputs: float
    score: float  # 1: full gradient of the prediction (rpem), 0: the last innovation only (plr)
    absolute: float  # 1: P is the covariance of K; 0: relative to the innovation variance
    whitened: float  # 1: absolute, and the memory sees row and innovation over the innovation's deviation
    start: float  # measured samples that set x by dead-beat (0: x was given)
    wait: float  # samples that make an innovation variance before K learns
    samples: float  # memory of that variance
    unit: float  # the variance before there is one
    settle: float  # measured samples before the detector counts
    signal: float
    low: float  # limits of H K, scalar state
    high: float
    radius: float  # poles of the filter stay inside; 0: not watched
    memory_size: float
    detector_size: float
    Phi: Vector
    H: Vector
    B: Vector
    dead_beat: Vector
    cap: Vector  # prior variances
    poles: Vector  # characteristic polynomial of the filter: poles + moves K
    moves: Vector
    reopen: Vector  # (up, down) answer to an alarm
    probes: Vector


GAIN = Layout(
    *HEAD,
    Field("x", ("n",), "state at the next sample, as predicted", trace="x{i}"),
    Field("theta", ("n",), "gain K", trace="K{i}"),
    Field("D", ("n",), "P = U D U' of K: the diagonal"),
    Field("U", ("n * (n - 1) // 2",), "and the factor above it, column by column"),
    Field("W", ("n", "n"), "dx/dK"),
    Field("relative", ("2 * whitened",), "samples and squares behind sigma^2, relative to the innovation variance"),
    Field("held", ("inputs",), "each input: its last known value"),
    Field("input_missed", ("1",), "1: an input was missing since the last measured output"),
    Field("probes", ("len(form.probes) // n", "n"), "state of each probe of the detector, as predicted"),
    policy("memory_state", of="memory"),
    policy("detector_state", of="detector"),
)
GAIN.on(GainForm)


SCRATCH = Layout(
    *each(
        "n",
        psi="gradient of the prediction",
        f="U' psi",
        b="P psi",
        c="vector",
        slope="psi/sqrt(T)",
        old="vector",
        p="vector",
        q="vector",
        polynomial="characteristic polynomial of the filter",
    ),
    Field("G", ("n", "n"), "W U"),
    Field("ratios", ("len(form.probes) // n",)),
)
open_scratch.on(GainForm)(SCRATCH.open)
