"""When the answer to a step is 63 % done: exact for known plants, with an interval that holds the truth."""

import numpy as np
import pytest

import driftwise as dw
from driftwise.analysis.step_response import step_responses
from driftwise.models.canonical import Canonical
from driftwise.models.convert import Model


def model(values, n, inputs=1, std=1e-4):
    return Model(Canonical(n, inputs=inputs), np.array(values), std**2 * np.eye(len(values)))


def test_a_plant_of_first_order_is_63_percent_done_after_its_time_constant():
    (answer,) = step_responses(model([-0.9, 0.3], 1))
    assert answer.time == pytest.approx(-1 / np.log(0.9), abs=0.05) and answer.interval[0] < answer.time
    assert answer.overshoot < 0.01


def test_a_delay_counts_and_each_input_has_its_own():
    first, second = step_responses(model([-0.9, 0.0, 0.0, 0.3, 0.0, 0.0, 0.0, 0.0, 0.3], 3, inputs=2))
    assert second.time == pytest.approx(first.time + 2, abs=0.05)


def test_a_pole_that_a_zero_cancels_does_not_matter():
    """As the poles that a model needs for its noise: (q - 0.99)/((q - 0.99)(q - 0.5))."""
    (answer,) = step_responses(model([-1.49, 0.495, 0.5, -0.495], 2, std=1e-6))
    assert answer.time == pytest.approx(-1 / np.log(0.5), abs=0.1)


def test_a_plant_that_swings_overshoots():
    p = 0.9 * np.exp(0.5j)
    (answer,) = step_responses(model([-2 * p.real, abs(p) ** 2, 0.1, 0.0], 2))
    assert answer.overshoot > 0.3 and answer.rebound == pytest.approx(answer.overshoot**2, rel=0.1) and answer.swings


def test_a_direct_part_that_dies_out_overshoots_and_does_not_swing():
    """Beside a pair that a model has for its noise, or for what inputs did between samples."""
    p = 0.5 * np.exp(1.5j)
    pair, lead = np.array([1, -2 * p.real, abs(p) ** 2]), np.array([1.0, -0.97])
    a, b = np.convolve([1, -0.9], pair), 1.02 * np.convolve(lead, pair)
    (answer,) = step_responses(model([*a[1:], *b[:3]], 3))
    assert answer is None or not answer.swings


def test_what_does_not_settle_has_no_end():
    assert step_responses(model([-1.01, 0.3], 1)) == [None]
    assert step_responses(model([-0.99, 0.3], 1, std=0.02)) == [None]


def test_the_interval_holds_the_truth():
    held = 0
    for seed in range(20):
        y, u = dw.simulate([-0.9], [0.3], samples=400, noise_std=0.3, seed=seed)
        (answer,) = step_responses(dw.ARX(1, 1).scan(y, u).model())
        held += answer.interval[0] <= -1 / np.log(0.9) <= answer.interval[1]
    assert held >= 17
