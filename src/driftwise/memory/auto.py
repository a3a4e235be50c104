"""The default where nothing is known of drift, noise, outliers and jumps: every explanation competes.

A small interacting bank with one learnt speed explains slow change. Where it seems not to, a trial begins: have the
parameters, or one of them, just jumped, or has the noise another level? What is shown is the mixture of all that is
probable; the explanation that wins takes over, and the event is told.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from ..engine import validation
from ..engine.dispatch import PerParameter, Vector
from .auto_answers import (
    adapt_auto,
    additive_share_auto,
    begin_auto,
    count_auto,
    doubted_output_auto,
    found_jump_auto,
    mixture_auto,
    outlier_probability_auto,
    take_along_auto,
    time_update_auto,
)
from .auto_constants import BESIDE_STATE, JUMP_ODDS, LEAST, LEVELS, MOST, PRIOR, SAMPLES, SPEEDS, START, TAU
from .auto_state import auto_size
from .bank import common_of_banks
from .questions import (
    adapt,
    additive_share,
    begin,
    count,
    doubted_output,
    found_jump,
    mixture,
    outlier_probability,
    resolve,
    take_along,
    time_update,
)
from .registry import register
from .trial_state import COPIES
from .unknown_drift import drift_state_size


@register(
    "auto",
    "auto:outliers",
    "auto:jumps",
    about="how fast each parameter drifts, the noise, outliers and jumps are found out; or only these surprise",
    read=lambda words: AutoMemory(words.rest),
)
class AutoMemory(NamedTuple):
    """Nothing to tune: how fast each parameter drifts, sigma^2, outliers, jumps and louder noise are found out.

    Three Kalman filters interact: one that never forgets, one that does so fast (NVR .1), and one whose speeds are
    learnt for each parameter (recursive maximum likelihood); each has its own sigma^2. ``expect`` says what surprises
    may be: "outliers" (then nothing jumps), "jumps" (then every sample counts) or "both". An outlier is discounted by
    the odds that it is one (status ``OUTLIER``); a jump is told (``JUMP``) at odds of 100:1 against none, and against
    another level of the noise, which is told as such if it is louder (``NOISE``), and taken back in silence where what
    follows contradicts it. In regressions and `ARX` a jump that the filters have followed by then is told late, once
    what came after says so at 6:1 or more: with its odds and its date, and no estimate moves by it. A plant at rest
    (``AT_REST``) teaches nothing about speeds and noise. ``phi`` as in `Drift`.

    Bad at: records almost without noise, where a jump of more than two thousand of its deviations (`WIDEST`) may be
    followed a hundred samples late, or not at all; very smooth motion, and speeds that differ a thousandfold, where
    the right Q is 10 % better; for a few samples after a jump its bars are too narrow; frequent
    outliers still look like jumps now and then. Among the regressors of an `ARX` those of the sensor are replaced, and
    those of the process are not: what follows tells which they were. The learnt speeds take a few hundred samples.
    Source: Abid and Kamoun (2008) pose the problem; Blom and Bar-Shalom (1988), Willsky and Jones (1976) the parts.

    Examples
    --------
    >>> import driftwise as dw
    >>> b = [[1.0]] * 400 + [[2.0]] * 200  # b1 jumps
    >>> y, u = dw.simulate([-0.8], b, samples=600, noise_std=0.1, seed=1)
    >>> trace = dw.ARX(1, 1, memory=dw.AutoMemory()).scan(y, u)
    >>> [(event.sample, event.text) for event in trace.events() if event.kind == "JUMP"]
    [(405, 'b1 jumped from 0.993 to 2.05, it began about 5 samples ago (odds 1364:1)')]
    """

    expect: str = "both"
    phi: Any = 1.0

    @property
    def odds(self) -> float:
        """The odds at which a jump is told: a statistic of 1."""
        return math.exp(JUMP_ODDS)


class AutoMemoryKernel(NamedTuple):
    """What the kernel sees of `AutoMemory`."""

    R: float
    phi: PerParameter
    cap: PerParameter
    floor: float
    moving: float
    learns: float
    freedom: float
    chi2: float
    has_state: float  # 1: parameters act through a state, which takes an outlier for what it is on average
    stakes: float  # 1: the mean is weighed by what is at stake, as in regressions
    outliers: float  # 1: some samples are
    jumps: float  # 1: jumps are looked for
    start: float  # of the learnt speeds, see `LikelihoodDrift`
    least: float
    most: float
    samples: float
    tau: float
    prior: float
    home: float  # where they begin and are shrunk to, less ``start``
    past: float  # so many regressors at first are past outputs, of which outliers are replaced
    poles: float  # so many parameters at first say how the output of a state goes on
    keeps_rows: float  # 1: rows stay what they are, and another start may begin with those of the first samples
    lags: PerParameter  # samples later than the first that each acts, if all jump
    levels: Vector
    A: Vector

    def state_size(self, parameters: int) -> int:
        """Return how many numbers it keeps."""
        return drift_state_size(parameters, auto_size(parameters, len(self.levels), int(self.stakes)))

    @property
    def mixture_columns(self) -> int:
        """How many numbers tell what a prediction is mixed of: three of each mode."""
        return 3 * (len(self.levels) + COPIES)


@resolve.on(AutoMemory)
def resolve_auto_memory(memory, setting):
    expect = validation.one_of("expect", memory.expect, ("both", "outliers", "jumps"))
    levels = np.array([*LEVELS, np.nan])  # the last one is learnt
    return AutoMemoryKernel(
        **common_of_banks(setting, memory.phi), stakes=float(setting.is_regression),
        outliers=float(expect != "jumps"), jumps=float(expect != "outliers"),
        start=np.log(START), least=np.log(LEAST), most=np.log(MOST), samples=SAMPLES, tau=TAU, prior=PRIOR,
        home=np.log(BESIDE_STATE) if setting.lags.size else 0.0, past=float(setting.past),
        poles=float(setting.poles), keeps_rows=float(setting.is_regression or setting.rows_stay),
        lags=setting.lags if setting.lags.size else np.zeros(setting.N),
        levels=levels, A=np.ravel(SPEEDS),
    )  # fmt: skip


begin.on(AutoMemoryKernel)(begin_auto)
adapt.on(AutoMemoryKernel)(adapt_auto)
count.on(AutoMemoryKernel)(count_auto)
outlier_probability.on(AutoMemoryKernel)(outlier_probability_auto)
additive_share.on(AutoMemoryKernel)(additive_share_auto)
doubted_output.on(AutoMemoryKernel)(doubted_output_auto)
found_jump.on(AutoMemoryKernel)(found_jump_auto)
time_update.on(AutoMemoryKernel)(time_update_auto)
mixture.on(AutoMemoryKernel)(mixture_auto)
take_along.on(AutoMemoryKernel)(take_along_auto)
