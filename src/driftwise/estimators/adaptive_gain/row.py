"""The state row of the adaptive gain: what is kept between samples, where, and the scratch of a run."""

from typing import NamedTuple

import numpy as np

from ...engine.dispatch import Vector, open_scratch
from ...engine.layout import Field, Layout, policy
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
    Field("held", ("inputs",), "each input: its last known value"),
    Field("input_missed", ("1",), "1: an input was missing since the last measured output"),
    Field("probes", ("len(form.probes) // n", "n"), "state of each probe of the detector, as predicted"),
    policy("memory_state", of="memory"),
    policy("detector_state", of="detector"),
)
GAIN.on(GainForm)


class Work(NamedTuple):
    """Scratch: psi is the gradient of the prediction, f = U' psi; G = W U."""

    psi: np.ndarray
    f: np.ndarray
    b: np.ndarray
    c: np.ndarray
    slope: np.ndarray
    old: np.ndarray
    p: np.ndarray
    q: np.ndarray
    polynomial: np.ndarray
    G: np.ndarray
    ratios: np.ndarray


def scratch_size(form) -> int:
    """Return how many numbers `Work` takes."""
    n = int(form.n)
    return 9 * n + n * n + len(form.probes) // n


@open_scratch.on(GainForm)
def open_scratch_gain_form(form, scratch):
    n = int(form.n)
    v, end = scratch[: 9 * n].reshape(9, n), 9 * n + n * n
    return Work(v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8], scratch[9 * n : end].reshape(n, n), scratch[end:])
