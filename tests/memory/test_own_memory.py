"""A memory of a user's own that remembers something: on every family that takes it, in units, saved, lawful."""

from typing import NamedTuple

import numpy as np
import pytest

import driftwise as dw
from driftwise.analysis.laws import example, same
from driftwise.engine import compile
from driftwise.engine.dispatch import flatten, part
from driftwise.engine.status import CAPPED
from driftwise.memory import PerParameter, adapt, begin, least_squares, register, resolve, time_update
from driftwise.memory.gauss_markov import widen_within
from driftwise.memory.questions import MEMORIES
from driftwise.memory.registry import ENTRIES


class Restless(NamedTuple):
    """A random walk that hurries after surprises: it remembers their mean, and how long each parameter walked."""

    q: PerParameter
    cap: PerParameter = ()
    pace: float = 0.1

    def state_size(self, parameters):
        return 1 + parameters


@resolve.on(Restless)
def resolve_restless(memory, setting):
    return Restless(np.broadcast_to(memory.q, setting.N) * setting.units, setting.cap, memory.pace)


@begin.on(Restless)
def begin_restless(memory, state, view):
    state[0] = 1.0


@time_update.on(Restless)
def time_update_restless(memory, state, elapsed, view):
    status = 0
    if view.surprise >= 0.0:
        state[0] += memory.pace * (view.surprise - state[0])
    for i in range(memory.q.size):
        state[1 + i] += elapsed
        q = memory.q[i] * state[0] * elapsed
        if not widen_within(view.U, view.D, view.first + i, q, memory.cap[i], view.b):
            status = CAPPED
    return 1.0, status


class Learned(NamedTuple):
    """A memory that corrects by itself, and has one setting of each parameter."""

    share: PerParameter = 1.0


@adapt.on(Learned)
def adapt_learned(memory, state, e, R, view):
    return least_squares(e * memory.share[0], R, view)


@pytest.fixture
def uncompiled(monkeypatch):
    monkeypatch.setattr(compile, "driver", compile.plain_driver)
    monkeypatch.setattr(compile, "crew", compile.plain_crew)


@pytest.fixture
def registered():
    register("restless:Q", about="a walk that hurries")(Restless)
    yield
    del ENTRIES["Restless"]


MEMORY = Restless(1e-6)
FAMILIES = {
    "ARX": dw.ARX(2, 1, memory=MEMORY),
    "offset": dw.ARX(1, 1, offset=True, memory=MEMORY, gate=dw.InnovationGate()),
    "AR": dw.AR(2, memory=MEMORY),
    "Regression": dw.Regression(2, memory=MEMORY),
    "ARMAX": dw.ARMAX(1, 1, 1, memory=MEMORY),
    "OE": dw.OE(1, 1, memory=MEMORY),
    "BJ": dw.BJ(1, 1, 1, 1, memory=MEMORY),
    "ARXMIMO": dw.ARXMIMO(2, 1, 1, 1, memory=MEMORY),
    "AdaptiveObserver": dw.estimators.AdaptiveObserver(1, [0.5], 1, memory=MEMORY),
    "Joint": dw.Joint(2, 1, memory=MEMORY),
    "Joint, direct": dw.Joint(1, 1, True, noise=dw.models.OutputError(), memory=MEMORY),
    "JointMIMO": dw.JointMIMO((1, 1), 1, memory=MEMORY),
    "ContinuousJoint": dw.ContinuousJoint(1, 1, memory=MEMORY),
}


@pytest.mark.parametrize("name", FAMILIES)
def test_every_family_runs_it_saves_it_and_goes_on(name, uncompiled, registered, tmp_path):
    est = FAMILIES[name]
    y, u = example(est, samples=40)
    whole = est.scan(y, u)
    first = est.scan(y[:25], None if u is None else u[:25])
    kept = np.atleast_1d(first.state["memory_state"])
    walked = kept[1:3] if name in ("ARXMIMO", "JointMIMO") else kept[1:]
    assert (walked == 25).all() and 0 < kept[0] != 1.0
    dw.save_state(est, first.state, tmp_path / "state.json")
    other, state = dw.load_state(tmp_path / "state.json")
    assert flatten(other.policies).tolist() == flatten(est.policies).tolist() and same(state, first.state)
    assert same(other.scan(y[25:], None if u is None else u[25:], state=state).state, whole.state)


def test_its_settings_are_in_the_units_of_the_data():
    est = dw.ARX(1, 1, y_scale=8.0, u_scale=2.0, memory=Restless(1e-6))
    assert est.policies[2].q.tolist() == [1e-6, 16e-6]
    assert est.policies[2].cap.tolist() == np.diag(est.prior_covariance).tolist()
    assert dw.ARX(1, 1, memory=Learned(0.5)).policies[2].share.tolist() == [0.5, 0.5]


def test_it_does_what_it_says(uncompiled):
    y, u = dw.simulate([-0.8], [1.0], samples=60, noise_std=0.1, seed=2)
    y[30:] += 2.0  # surprising
    calm = dw.ARX(1, 1, memory=dw.RandomWalk(1e-6)).scan(y, u)
    hurried = dw.ARX(1, 1, memory=Restless(1e-6)).scan(y, u)
    assert hurried.state["memory_state"][0] > 0 and hurried.state["memory_state"][1] == 60
    steady = dw.ARX(1, 1, memory=Restless(1e-6, pace=0.0)).scan(y, u)
    assert same(steady.table, calm.table)
    assert not same(hurried.table, calm.table)


def test_only_what_is_registered_is_saved(tmp_path):
    est = dw.ARX(1, 1, memory=MEMORY)
    with pytest.raises(dw.InputError, match="not driftwise's own"):
        dw.save_state(est, est.start(), tmp_path / "state.json")


def test_a_file_of_a_memory_that_nobody_registered_is_refused_in_words(registered, tmp_path):
    est = dw.ARX(1, 1, memory=MEMORY)
    dw.save_state(est, est.start(), tmp_path / "state.json")
    entry = ENTRIES.pop("Restless")
    with pytest.raises(dw.InputError, match="a Restless is not known here: import the module"):
        dw.load_state(tmp_path / "state.json")
    ENTRIES["Restless"] = entry


def test_a_name_is_one_memorys_own():
    other = type("Window", (Restless,), {})
    with pytest.raises(dw.InputError, match="take another name"):
        register("window:N")(other)


def test_one_that_learns_by_itself_learns_beside_a_state(uncompiled):
    y, u = dw.simulate([-0.8], [1.0], samples=60, noise_std=0.1, seed=2)
    plain, learned = (dw.Joint(1, 1, memory=memory).scan(y, u) for memory in (dw.Constant(), Learned(1.0)))
    np.testing.assert_allclose(learned.parameters[5:], plain.parameters[5:], rtol=1e-6, atol=1e-9)
    assert not np.allclose(dw.Joint(1, 1, memory=Learned(0.5)).scan(y, u).parameters[-1], plain.parameters[-1])


def test_plain_answers_are_those_of_constant_parameters(uncompiled):
    y, u = example(dw.ARX(1, 1), samples=40)
    assert Learned in MEMORIES and Learned not in time_update.table
    assert same(dw.ARX(1, 1, memory=Learned()).scan(y, u).table, dw.ARX(1, 1).scan(y, u).table)


def test_a_part_of_it_has_the_settings_of_these_parameters_alone():
    few = part(Restless(np.arange(4.0), np.ones(4), 0.3), 1, 3)
    assert few.q.tolist() == [1.0, 2.0] and few.cap.tolist() == [1.0, 1.0] and few.pace == 0.3
    assert flatten([few]).tolist() == [2, 1, 2, 2, 1, 1, 0.3]


def test_compiled_it_obeys_the_laws(registered):
    dw.check_policy(MEMORY)
