"""Plants that noise alone drives say as much when the noise is quieter; those that are switched off do not."""

import numpy as np
import pytest

import driftwise as dw

A, STEP, SAMPLES = (-1.5, 0.7), 600, 1200
REST = int(dw.Status.AT_REST)


def driven_by_noise(seed, left, jump=0.0, outliers=0.0):
    """An AR(2) whose noise falls to ``left`` of its deviation; a hundred samples later a1 jumps."""
    rng = np.random.default_rng(seed)
    e = rng.standard_normal(SAMPLES) * np.where(np.arange(SAMPLES) < STEP, 1.0, left)
    y, a1 = np.zeros(SAMPLES), A[0] + jump * (np.arange(SAMPLES) >= STEP + 100)
    for k in range(2, SAMPLES):
        y[k] = -a1[k] * y[k - 1] - A[1] * y[k - 2] + e[k]
    wrong = rng.random(SAMPLES) < outliers
    return y + wrong * 12.0 * np.where(np.arange(SAMPLES) < STEP, 1.0, left) * rng.choice([-1.0, 1.0], SAMPLES), a1


def rests(trace):
    return np.mean((trace.status[STEP + 50 :] & REST) > 0)


@pytest.mark.parametrize("outliers", [0.0, 0.03])
@pytest.mark.parametrize("left", [0.1, 0.06])
def test_quieter_noise_is_no_rest_where_noise_alone_moves_the_plant(left, outliers):
    """What jumps then is followed as before: nothing was learnt of such samples, and a1 stayed .25 off."""
    errors = []
    for seed in range(6):
        y, a1 = driven_by_noise(seed, left, 0.25, outliers)
        trace = dw.AR(2, memory=dw.AutoMemory()).scan(y)
        assert rests(trace) < 0.1
        errors.append(trace.parameters[-200:, 0] - a1[-200:])
    assert np.sqrt(np.mean(np.square(errors))) < 0.06


def test_a_plant_whose_noise_all_but_ends_is_switched_off():
    for seed in range(3):
        y, _ = driven_by_noise(seed, 0.01)
        trace = dw.AR(2, memory=dw.AutoMemory()).scan(y)
        assert rests(trace) > 0.9 and np.ptp(trace.parameters[STEP + 50 :, 0]) < 0.1


def test_where_inputs_rest_the_plant_does_however_quiet_its_noise_is():
    rng, u = np.random.default_rng(3), np.zeros(SAMPLES)
    u[:STEP] = rng.choice([-1.0, 1.0], STEP)
    e, y = 0.1 * rng.standard_normal(SAMPLES) * np.where(np.arange(SAMPLES) < STEP + 50, 1.0, 0.1), np.zeros(SAMPLES)
    for k in range(1, SAMPLES):
        y[k] = 0.8 * y[k - 1] + u[k - 1] + e[k]
    assert rests(dw.ARX(1, 1, memory=dw.AutoMemory()).scan(y, u)) > 0.95


@pytest.mark.parametrize("scale", [1e-9, 1e6])
def test_loudness_has_no_units(scale):
    y, _ = driven_by_noise(7, 0.1)
    one, two = (dw.AR(2, memory=dw.AutoMemory(), y_scale=s).scan(s * y) for s in (1.0, scale))
    np.testing.assert_allclose(one.parameters, two.parameters, rtol=1e-6, atol=1e-8)
    assert np.array_equal(one.status & REST, two.status & REST)
