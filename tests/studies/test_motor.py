"""A real motor: what scripts/motor.py prints for docs/motor.md holds. Needs a recording that is not shipped."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

path = Path(__file__).parents[2] / "scripts" / "motor.py"
spec = importlib.util.spec_from_file_location("motor", path)
assert spec and spec.loader
motor = importlib.util.module_from_spec(spec)
spec.loader.exec_module(motor)


@pytest.fixture(scope="module")
def record():
    found = motor.read()
    if found is None:
        pytest.skip("emps_train.csv is not there; set DRIFTWISE_DATA to the folder of recordings")
    return *found, motor.reference(*found)


@pytest.fixture(scope="module")
def walk(record):
    """The growing window at 20 um, its walk tuned on the first ten seconds, nothing else."""
    u, position, _ = record
    y, noise_std = motor.encoder(position, motor.ROUNDED)
    return motor.observer(noise_std).tune(y[: motor.LEARN], u[: motor.LEARN])


def test_velocity_acceleration_and_load_behind_a_coarse_encoder(record, walk):
    u, position, truth = record
    y, noise_std = motor.encoder(position, motor.ROUNDED)
    trace = walk.scan(y, u)
    for first in (500, motor.LEARN):
        v, a, load = motor.score(motor.read_out(trace), truth, first)
        assert v <= 0.35 and a <= 0.035 and load <= 3.2
    e, T = trace.innovation[motor.LEARN :], trace.variance[motor.LEARN :]
    assert 0.9 < np.mean(e**2 / T) < 1.1
    part = slice(0, 3000)  # a plain Kalman filter with the same tuning is as good: the page says so
    plain = motor.kalman(y[part], u[part], walk.tuned.walk[0], noise_std, motor.DIFFUSE)
    np.testing.assert_allclose(plain.velocity[100:], trace.of("velocity")[0][part][100:], atol=1e-5)


def test_windows_need_no_noise_model(record):
    u, position, truth = record
    y, _ = motor.encoder(position, motor.ROUNDED)
    window = motor.observer(None, 0.03).tune(y[: motor.LEARN], u[: motor.LEARN])
    v, a, load = motor.score(motor.read_out(window.scan(y, u)), truth)
    assert v <= 0.35 and a <= 0.035 and load <= 3.2
    v, a, _ = motor.score(motor.read_chain(motor.chain(2e-6, 3, 0.011).scan(position)), truth)
    assert v <= 0.04 and a <= 0.031  # as recorded: a cubic through eleven samples


def test_a_cold_start_takes_less_than_25_ms(record, walk):
    u, position, truth = record
    ms = motor.start_up(u, position, truth, motor.ROUNDED, {"walk": walk, "window": motor.observer(2e-6, 0.039)}, 20)
    first = next(iter(ms.values()))
    assert np.sort(first)[18] <= 25
