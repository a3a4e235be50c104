"""Jumps of single parameters, found by filtering the last samples anew: named, dated, sized, the others unmoved."""

import numpy as np
import pytest
from draws import slow

import driftwise as dw
from driftwise.analysis.laws import same
from driftwise.estimators.grey_box.jump_fit import JumpFit

CELL = """
[states]
v1 = {unit = "V", std = 0.01, walk = 1e-5}
rest = {unit = "V", start = 3.7, std = 0.5, walk = 1e-5}
[inputs]
i = {unit = "A"}
[outputs]
v = {unit = "V", noise = 1e-3}
[parameters]
R0 = {unit = "Ohm", start = 0.01}
R1 = {unit = "Ohm", start = 0.02}
C1 = {unit = "F", start = 1000}
[formulas]
dv1 = "(i - v1 / R1) / C1"
drest = "0"
v = "rest + R0 * i + v1"
"""
TRUTH = {"R0": 0.02, "R1": 0.015, "C1": 1500.0}
U = np.repeat(np.random.default_rng(1).choice([-1.0, 0.0, 1.0], 46), 10)


def record(name, at=300, seed=1):
    """Return a record in which a parameter is 30 % larger from a sample on; the state goes on where it was."""
    x, y, rng, now = np.array([0.0, 3.7]), [], np.random.default_rng(seed), dict(TRUTH)
    for t, i in enumerate(U):
        if t == at and name:
            now[name] *= 1.3
        y.append(x[1] + now["R0"] * i + x[0] + 1e-3 * rng.standard_normal())
        a = np.exp(-1 / (now["R1"] * now["C1"]))
        x = np.array([a * x[0] + (1 - a) * now["R1"] * i, x[1]])
    return np.array(y)


@pytest.mark.parametrize("name", ["R0", slow("R1"), slow("C1")])
def test_a_jump_of_one_parameter_is_named_and_dated_and_the_others_stay(name):
    est = dw.GreyBox(CELL, jumps="fit")
    trace = est.scan(record(name), U)
    (event,) = trace.jumps()
    assert event.parameter == name and event.direction == 1
    assert abs(event.since - 300) <= 10 and event.sample - 300 <= 96 and f"{name} rose by" in event.text
    truth = est.transformed(TRUTH | {name: 1.3 * TRUTH[name]})
    off = (trace.state["theta"] - truth) / np.sqrt(np.diag(est.covariance(trace.state)))[2:]
    assert np.all(abs(off) < 3)


def test_without_a_jump_nothing_is_told_and_the_filter_is_the_same():
    y = record(None)
    trace, plain = dw.GreyBox(CELL, jumps="fit").scan(y, U), dw.GreyBox(CELL).scan(y, U)
    assert trace.jumps() == [] and same(trace.table, plain.table)


def test_what_the_start_has_not_fitted_yet_is_no_jump():
    """Far off from what is believed, the filter of the prior alone would see one before the first fit."""
    est = dw.GreyBox(CELL.replace("noise = 1e-3", "noise = 1e-4"), jumps="fit")
    assert est.scan(est.simulate(U, {"R0": 0.045, "R1": 0.08, "C1": 300.0}, seed=1), U).jumps() == []


def test_every_way_of_feeding_samples_finds_the_same_jump():
    est, y = dw.GreyBox(CELL, jumps=JumpFit(0.3)), record("R0")
    y[[250, 310]] = np.nan
    whole = est.scan(y, U)
    first = est.scan(y[:307], U[:307])
    second = est.scan(y[307:], U[307:], state=first.state)
    assert same(second.state, whole.state) and same(np.concatenate([first.table, second.table]), whole.table)
    state = first.state
    for t in range(307, len(y)):
        state, _ = est.update(state, y[t], U[t])
    assert same(state, whole.state)
    states, _ = est.update_batch(est.start(2), np.stack([y, y]), np.stack([U, U]))
    assert same(states[1], whole.state)


def test_what_is_no_search_for_jumps_is_refused():
    with pytest.raises(dw.InputError, match="jumps must be None, 'fit' or JumpFit"):
        dw.GreyBox(CELL, jumps="often")
    with pytest.raises(dw.InputError, match=r"between which parameters are Constant\(\), not AutoMemory"):
        dw.GreyBox(CELL, jumps="fit", memory=dw.AutoMemory())
