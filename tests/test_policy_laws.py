"""Policies of one's own and of ours obey the public checks, and a broken one is named."""

from typing import NamedTuple

import numpy as np
import pytest

import driftwise as dw
from driftwise.analysis.laws import LAWS, example, same
from driftwise.detect.watch import OWN, SINCE, STATISTIC, WHICH, watch
from driftwise.engine import ud
from driftwise.memory import time_update


class Impatient(NamedTuple):
    """A detector that alarms after every so many samples."""

    every: float

    def state_size(self, parameters):
        return OWN + 1


@watch.on(Impatient)
def _(detector, marks, z, slope):
    marks[OWN] += 1.0
    marks[STATISTIC] = marks[OWN] / detector.every
    if marks[OWN] < detector.every:
        return 0.0
    marks[OWN], marks[SINCE], marks[WHICH] = 0.0, 1.0, -1.0
    return 1.0 if z > 0.0 else -1.0


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.__name__)
@pytest.mark.parametrize(
    "restart", [dw.memory.CovarianceInflation(0.5), dw.memory.GainReset(5)], ids=lambda r: type(r).__name__
)
def test_law_of_restarts(restart, law):
    est = dw.ARX(2, 2, memory=dw.RestartOnChange(Impatient(15.0), restart, settle=5))
    law(est, *example(est))


class Swelling(NamedTuple):
    """A memory without a cap: it winds up."""

    q: float


@time_update.on(Swelling)
def _(memory, state, elapsed, view):
    ud.widen(view.U, view.D, view.first, memory.q, view.b)
    return 1.0, 0


IDLE = [
    (dict(memory=dw.RandomWalk(0.0)), {}),
    (dict(gate=dw.InnovationGate(1e9)), {}),
    (dict(memory=dw.RestartOnChange(dw.detect.VarianceCUSUM(4.0, threshold=1e9))), {}),
    (dict(floor=0.0), dict(floor=1e-300)),
]


@pytest.mark.parametrize("idle, plain", IDLE)
def test_a_policy_with_nothing_to_do_changes_nothing(idle, plain):
    est = dw.Joint(2, inputs=1, **plain)
    y, u = example(est)
    assert same(est.scan(y, u).table, dw.Joint(2, inputs=1, **idle).scan(y, u).table)


@pytest.mark.parametrize(
    "policy",
    [
        dw.detect.ScoreCUSUM(jump=0.5, threshold=1.0),
        dw.detect.ScoreCUSUM(threshold=3.0),
        dw.RestartOnChange(dw.detect.GLR(threshold=2.0, window=5), dw.memory.GainReset(5), settle=10),
        dw.memory.CovarianceInflation(0.5, only_named=True),
        dw.memory.GainReset(5),
        dw.detect.GainProbes(threshold=1.0),
        dw.detect.PullTest(threshold=2.0),
        dw.InnovationGate(4.0),
        dw.memory.FuzzyDrift(),
        dw.memory.LikelihoodDrift(shared=True),
    ],
    ids=repr,
)
def test_every_policy_passes_the_public_check(policy):
    dw.check_policy(policy)


class Deaf(NamedTuple):
    """A detector that forgets to keep its state finite."""

    def state_size(self, parameters):
        return OWN


@watch.on(Deaf)
def _(detector, marks, z, slope):
    marks[STATISTIC] = np.nan
    return 0.0


class Amnesia(NamedTuple):
    """A memory that forgets without a bound."""

    p: float


@time_update.on(Amnesia)
def _(memory, state, elapsed, view):
    for j in range(view.D.size):
        view.D[j] /= memory.p
    return memory.p, 0


def test_a_broken_policy_is_named():
    with pytest.raises(AssertionError, match="breaks a law: Without excitation"):
        dw.check_policy(Amnesia(0.98))
    with pytest.raises(AssertionError, match="breaks a law"):
        dw.check_policy(Deaf())
    with pytest.raises(dw.InputError, match=r"were the brackets forgotten"):
        dw.check_policy(dw.ExponentialForgetting)
    with pytest.raises(dw.InputError, match="check GainProbes"):
        dw.check_policy(dw.detect.ProbeBank([1.0]))
    with pytest.raises(AssertionError, match="breaks a law: Without excitation"):
        dw.check_policy(Swelling(1.0))
    with pytest.raises(dw.InputError, match="memory, a gate or a detector"):
        dw.check_policy(0.98)
