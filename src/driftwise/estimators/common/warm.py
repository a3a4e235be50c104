"""Compile ahead, so that the first estimate of a process starts at once.

* `Joint`: every noise whose coefficients are known, constant parameters or `RandomWalk`, with and without a gate, the
  scale known or learnt; and with its defaults otherwise, `RestartOnChange` and `UnknownPolynomial`
* `Joint.smooth`: the defaults, also with `RandomWalk` or `RestartOnChange`
* `JointMIMO` (split) and `ContinuousJoint`: the defaults
* `ARX`, with it `AR` and `Regression`: constant parameters, `ExponentialForgetting`, `RandomWalk`, `RestartOnChange`
  (default, `ScoreCUSUM`, `SelfStarting`), `AutoMemory`
* their `smooth` and `tune`, whatever the settings
* `ARMAX`, with it `ARMA`, `OE` and `BJ`; `ARXMIMO`; `AdaptiveGain`; `Manoeuvre`: the defaults
* `WindowObserver` on regular samples
* `ModelAverage` of any of these, `TrackEstimator`, and the detector `SelfStarting`

`front` is what most people need first: `identify`, `driftwise run` without options, and `Joint`. Whatever else one
combines compiles when it is first used.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import Any

import numpy as np

from ...detect.gate import InnovationGate
from ...detect.score import ScoreCUSUM
from ...detect.self_starting import SelfStarting
from ...engine import compile
from ...memory.auto import AutoMemory
from ...memory.constant import Constant
from ...memory.exponential_forgetting import ExponentialForgetting
from ...memory.random_walk import RandomWalk
from ...memory.restart_on_change import RestartOnChange
from ...models.filtering import linear_filter
from ...models.lags import shares_left
from ...models.noise import EquationError, NoisePolynomial, OutputError, UnknownPolynomial
from ...models.plant import Plant
from ...models.regression import filtered_rows, robustly_fitted
from ..adaptive_gain.estimator import AdaptiveGain
from ..armax.estimator import ARMAX
from ..arx.estimator import ARX
from ..arx_mimo.estimator import ARXMIMO
from ..continuous.estimator import ContinuousJoint
from ..joint.estimator import Joint
from ..joint_mimo.estimator import JointMIMO
from ..manoeuvre.estimator import Manoeuvre
from ..model_average.step import Averaging
from ..smoothing.moments import Backward
from ..smoothing.passes import Disturbances, Forward, Information
from ..track.both_ways import BothWays
from ..track.remembered import Remembering
from ..track.step import Tracking
from ..window_observer.estimator import WindowObserver


def combinations() -> list[dict[str, Any]]:
    """Return the settings of `Joint` that select different code: noise, memory, gate, and known or learnt scale."""
    kinds: tuple[Any, ...] = (OutputError, EquationError, lambda v: NoisePolynomial((0.0,), v))
    return [
        dict(noise=noise(variance), memory=memory, gate=gate)
        for noise, variance, memory, gate in product(
            kinds,
            (None, 1.0),
            (Constant(), RandomWalk(1e-6)),
            (None, InnovationGate()),
        )
    ]


def front() -> Iterator[str]:
    """Compile what comes first, loop by loop, and yield what it is."""
    automatic = ARX(1, 1), ARX(1, 1, memory=ExponentialForgetting(0.99)), ARX(1, 1, memory=AutoMemory())
    for est in (*automatic, ARMAX(1, 1, 1), Joint(1), Joint(1, noise=UnknownPolynomial())):
        est.drive  # noqa: B018  (compiles)
        yield repr(est)
    SelfStarting().scan([0.0])
    yield repr(SelfStarting())
    compile.passage(Averaging)
    yield "ModelAverage"
    linear_filter([1.0], [1.0], [0.0])
    yield "linear_filter"
    signals, row = np.ones((1, 2)), np.ones(1, np.int64)
    robustly_fitted(filtered_rows(np.ones(1), signals, np.zeros(2, np.int64), signals, row, np.ones(1)), 1.0)
    yield "regression"
    shares_left(np.arange(9.0), np.arange(9.0), 1, 1, 1.0)
    yield "lags"


def warm() -> Iterator[str]:
    """Compile one combination after the other and yield its name."""
    for settings in [*combinations(), dict(memory=RestartOnChange()), dict(noise=UnknownPolynomial())]:
        est = Joint(1, **settings)
        est.update(est.start(), 0.0)
        yield repr(est)
    for est in (Joint(1), Joint(1, memory=RandomWalk(1e-6)), Joint(1, memory=RestartOnChange())):
        est.smooth([0.0])
        yield f"{est!r}.smooth"
    memories = (
        Constant(),
        ExponentialForgetting(0.99),
        RandomWalk(1e-6),
        RestartOnChange(),
        RestartOnChange(ScoreCUSUM()),
        RestartOnChange(SelfStarting()),
        AutoMemory(),
    )
    recursive = [ARX(1, 1, memory=memory) for memory in memories]
    window = WindowObserver(Plant([[0.0]]), 2.0, noise_std=1.0, dt=1.0)
    others = JointMIMO((1, 1)), ContinuousJoint(1), ARMAX(1, 1, 1), ARXMIMO(1, 1), AdaptiveGain(), Manoeuvre(), window
    for other in (*recursive, *others):
        other.drive  # noqa: B018  (compiles)
        yield repr(other)
    for task in (Forward, Disturbances, Information, Backward):
        compile.passage(task)
    yield "ARX.smooth, ARX.tune"
    for passage in (Tracking, Remembering, BothWays):
        compile.passage(passage)
    yield "TrackEstimator"
    yield from front()
