"""Quantities that follow from parameters: bars against closed forms, against draws, and along a record."""

import math

import numpy as np
import pytest

import driftwise as dw
from driftwise.engine.errors import InputError
from driftwise.models.quantities import derive

P = np.array([[4e-4, 3e-4], [3e-4, 9e-4]])


def test_what_is_straight_has_the_variance_of_the_joint_law():
    found = derive(["a", "b"], [1.0, 2.0], P, {"sum": lambda p: 3 * p["a"] - 2 * p["b"]})["sum"]
    std = math.sqrt(9 * 4e-4 + 4 * 9e-4 - 2 * 6 * 3e-4)
    assert found.value == -1.0 and found.std == pytest.approx(std) and not found.is_sampled
    assert found.interval == pytest.approx((-1 - 1.96 * std, -1 + 1.96 * std), abs=1e-4)


def test_what_bends_is_told_by_draws():
    """Of exp(x) with x normal, the quantiles are those of x."""
    found = derive(["x"], [0.0], [[0.25]], {"R0": lambda p: math.exp(p["x"])})["R0"]
    assert found.is_sampled and found.value == 1.0
    assert found.interval == pytest.approx((math.exp(-0.98), math.exp(0.98)), rel=0.05)
    square = derive(["x"], [0.0], [[1.0]], {"x2": lambda p: p["x"] ** 2})["x2"]  # its slope is zero
    assert square.is_sampled and square.std == pytest.approx(math.sqrt(3), rel=0.1)


def test_what_has_no_value_has_no_bars():
    found = derive(["x"], [0.1], [[1.0]], {"log": lambda p: math.log(p["x"])})["log"]
    assert found.value == math.log(0.1) and math.isnan(found.std)
    with pytest.raises(InputError, match="'q' asks for a parameter 'z'; there are x"):
        derive(["x"], [0.1], [[1.0]], {"q": lambda p: p["z"]})


@pytest.mark.parametrize("est", [dw.ARX(1, 1), dw.Joint(1, inputs=1)])
def test_a_gain_is_that_of_the_model_sample_by_sample(est):
    y, u = dw.simulate([-0.8], [1.0], samples=300, noise_std=0.1, seed=1)
    trace = est.scan(y, u, keep="covariance")
    quantities = {"gain": lambda p: p["b1"] / (1 + p["a1"])}
    columns = trace.derived(quantities, every=50)
    assert len(columns["gain"]) == 6
    for k, at in enumerate(range(0, 300, 50)):
        if at:
            model = trace.model(at)
            assert columns["gain"][k] == pytest.approx(model.dc_gain[0])
            if columns["gain_std"][k] < 0.05:
                assert columns["gain_std"][k] == pytest.approx(model.dc_gain_std[0], rel=0.05)
    now = est.derived(trace.state, quantities)["gain"]
    assert (now.value, now.std) == pytest.approx((trace.model().dc_gain[0], trace.model().dc_gain_std[0]), rel=0.02)
    assert now.value == pytest.approx(trace.derived(quantities)["gain"][-1])
