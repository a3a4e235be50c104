"""Rows 12 to 18 of the scoreboard: what is promised of single recordings. Needs recordings that are not shipped."""

import numpy as np
import pytest
from driftwise_studies.score import records, run
from driftwise_studies.score.tasks import calibration, cells, motor

import driftwise as dw

WHERE = records.folder()


def needs(file):
    return pytest.mark.skipif(
        not (WHERE / file).exists(), reason=f"no {file} in {WHERE}: set DRIFTWISE_DATA to the folder of recordings"
    )


def all_hold(verdicts, count):
    assert len(verdicts) == count
    assert not [v for v in verdicts if not v.confirmed]


def test_without_recordings_every_task_says_that_it_was_skipped(tmp_path):
    for path in run.TASKS.values():
        if path.startswith("tasks."):
            found = run.measure(run.Job(path, ""), tmp_path)
            assert found
            assert all(v.confirmed is None and "skipped" in v.value for v in found)


@needs(calibration.FILE)
def test_a_gas_sensor_is_calibrated_by_sparse_references():
    all_hold(calibration.gas_sensor(WHERE), 6)


@needs(motor.FILE)
def test_parameters_of_a_drive_on_line():
    all_hold(motor.motor_parameters(WHERE), 3)


@pytest.mark.slow
@needs(motor.FILE)
def test_motion_of_a_drive():
    all_hold(motor.motor_motion(WHERE), 4)


@needs(cells.PULSES)
def test_resistance_of_a_cell_from_uneven_samples():
    all_hold(cells.resistance(WHERE), 1)


@needs(cells.CYCLES)
def test_a_cell_fades_and_recovers():
    all_hold(cells.ageing(WHERE), 2)


def test_uneven_samples_of_a_wandering_voltage_give_the_resistances():
    """No recording needed: a cell made up, sampled between 0.1 and 60 s, as the one above."""
    rng = np.random.default_rng(0)
    t = np.cumsum(rng.choice([0.1, 0.5, 1.0, 60.0], 4000, p=[0.3, 0.3, 0.35, 0.05]))
    current = np.where(np.arange(4000) // 60 % 3 == 0, -30.0, 0.0)
    wander = np.cumsum(1e-4 * np.sqrt(np.diff(t, prepend=t[0])) * rng.standard_normal(4000))
    voltage = 4.0 + 1.5e-3 * current + 0.8e-3 * cells.slow_current(t, current) + wander
    R0, trace = cells.ohmic(t, voltage, current)
    assert R0[-1] == pytest.approx(1.5e-3, rel=0.01)
    assert trace.parameters[-1, 1] == pytest.approx(0.8e-3, rel=0.15)


def test_variance_inflation_is_that_of_a_regression_on_the_others():
    """Marquardt's factor is 1/(1 - R^2) of one regressor on the others."""
    rng = np.random.default_rng(1)
    phi = rng.standard_normal((500, 3)) @ np.array([[1.0, 0.9, 0.0], [0.0, 0.3, 0.4], [0.0, 0.0, 1.0]])
    est = dw.Regression(3, P0=1e12)
    found = est.variance_inflation(est.scan(phi @ [1.0, 2.0, 3.0] + rng.standard_normal(500), phi).state)
    for i in range(3):
        others = np.delete(phi, i, axis=1)
        rest = phi[:, i] - others @ np.linalg.lstsq(others, phi[:, i])[0]
        assert found[i] == pytest.approx(np.sum(phi[:, i] ** 2) / np.sum(rest**2), rel=1e-6)
