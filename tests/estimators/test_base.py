"""What every estimator has in common: the protocols, the shapes it shows, and what it does with instants."""

import numpy as np
import pytest

import driftwise as dw
from driftwise.estimators.protocols import Learns, Model, Runs

PLANT = dw.Plant([[0.0]])
LEARNING = [
    dw.Joint(1), dw.AR(1), dw.ARX(1, 1), dw.Regression(["slope"]), dw.ARMAX(1, 1, 1), dw.JointMIMO((1,)), dw.ARXMIMO(2),
    dw.ContinuousJoint(1), dw.AdaptiveGain(), dw.tracking.Manoeuvre(), dw.estimators.AdaptiveObserver(1),
    dw.StateSpace(0.9, Q=1.0, R=1.0),  # what is unknown are its states: it answers of them
    dw.GreyBox("battery"),
]  # fmt: skip
RUNNING = [
    dw.WindowObserver(PLANT, 2.0, noise_std=1.0, dt=1.0),
    dw.AlgebraicObserver(PLANT, dt=1.0, degree=-1),
    dw.ModelAverage([dw.AR(1)]),
]


@pytest.mark.parametrize("est", LEARNING + RUNNING, ids=lambda est: type(est).__name__)
def test_every_estimator_keeps_the_protocol(est):
    assert isinstance(est, Runs) and isinstance(est.model, Model)
    assert isinstance(est, Learns) == (est in LEARNING)


@pytest.mark.parametrize("est, shape", [(dw.Joint(1), ()), (dw.JointMIMO((1,)), (1,)), (dw.JointMIMO((1, 1)), (2,))])
def test_what_is_shown_has_the_shape_of_y_whatever_the_data(est, shape):
    assert est.outputs == (shape[0] if shape else None)
    y = np.random.default_rng(0).standard_normal((6, *shape))
    trace = est.scan(y)
    assert (y - trace.prediction).shape == y.shape == trace.y.shape
    _, step = est.update(est.start(), y[0])
    assert np.shape(step.prediction) == np.shape(step.status) == shape
    _, steps = est.update_batch(est.start(2), np.stack([y, y]))
    assert np.shape(steps.innovation) == np.shape(steps.status) == (2, *y.shape)


@pytest.mark.parametrize("est", RUNNING, ids=lambda est: type(est).__name__)
def test_a_sample_is_shown_by_four_numbers_however_many_columns_there_are(est):
    _, step = est.update(est.start(), 1.0)
    assert len(step) == 4 and np.shape(step) == (4,)
    assert step.status == est.update_batch(est.start(1), [1.0])[1].status[0]


def test_an_estimator_of_regular_samples_takes_no_instants():
    est = dw.AR(1)
    with pytest.raises(dw.InputError, match="AR counts samples, dt apart, and goes by no instants"):
        est.update(est.start(), 1.0, time=3.0)
    with pytest.raises(dw.InputError, match="goes by no instants"):
        est.update_batch(est.start(2), [1.0, 2.0], time=[3.0, 3.0])
    assert est.scan([1.0, 2.0], time=[3.0, 7.0]).time.tolist() == [3.0, 7.0]  # a trace shows them all the same


def test_a_column_is_no_record_of_one_output():
    with pytest.raises(dw.InputError, match=r"Use y\[:, 0\]"):
        RUNNING[0].scan(np.zeros((5, 1)))


def test_scaled_to_units_of_the_data_where_something_is_relative_to_them():
    y = 1000 * np.random.default_rng(0).standard_normal((50, 2))
    assert dw.AR(1).scaled_to(y[:, 0]).y_scale == 1024
    assert dw.ARXMIMO(2, na=1).scaled_to(y).y_scale.tolist() == [1024, 1024]
    assert dw.ContinuousJoint(1).scaled_to(y[:, 0], time=2.0 * np.arange(50)).dt == 2.0
