"""What does not fit is refused at the door, in words: name, expectation, what came, likely cause."""

import math

import numpy as np
import pytest

import driftwise as dw
from driftwise.engine import validation

Y = np.arange(10.0)

REFUSED = {
    "y of records": (lambda: dw.AR(1).scan(np.zeros(5, [("volts", float)])), "y must hold real numbers"),
    "order 0": (lambda: dw.Joint(0), "order must be a whole number of at least 1, got 0"),
    "order 1.5": (lambda: dw.Joint(1.5), "order"),
    "order True": (lambda: dw.Joint(True), "order"),
    "negative inputs": (lambda: dw.Joint(1, inputs=-1), "inputs"),
    "dt beyond data": (lambda: dw.Joint(1, dt=1e308), "dt must lie between 1e-100 and 1e+100"),
    "d beyond data": (
        lambda: dw.Joint(2, noise=dw.models.NoisePolynomial([1e300, 1.0], 1.0)),
        "d must not be beyond 1e+100",
    ),
    "jump beyond data": (
        lambda: dw.ARX(1, 1, memory=dw.RestartOnChange(response=dw.memory.CovarianceInflation(1e300))),
        "step must not be beyond 1e+100",
    ),
    "dt 0": (lambda: dw.Joint(1, dt=0.0), "dt must be a positive"),
    "P0 negative": (lambda: dw.Joint(1, P0=-1.0), "sign"),
    "P0 indefinite": (lambda: dw.Joint(1, P0=np.array([[1.0, 2.0], [2.0, 1.0]])), "negative eigenvalue"),
    "P0 lopsided": (lambda: dw.Joint(1, P0=np.array([[1.0, 2.0], [0.0, 1.0]])), "symmetric"),
    "P0 infinite": (lambda: dw.Joint(1, P0=np.inf), "finite"),
    "P0 of another size": (lambda: dw.Joint(1, P0=np.eye(3)), "shape (3, 3)"),
    "s0 of another size": (lambda: dw.Joint(1, s0=[1.0]), "s0"),
    "variance negative": (lambda: dw.Joint(1, noise=dw.models.EquationError(-1.0)), "noise variance"),
    "S without R": (lambda: dw.Joint(1, noise=dw.models.NoiseCovariance([[1.0]], [1.0], 0.0)), "inconsistent"),
    "S too large": (lambda: dw.Joint(1, noise=dw.models.NoiseCovariance([[1.0]], [2.0], 1.0)), "standard deviation"),
    "Q of another size": (lambda: dw.Joint(2, noise=dw.models.NoiseCovariance(np.eye(3), np.zeros(3), 1.0)), "Q "
    "must be"),
    "d of another size": (lambda: dw.Joint(2, noise=dw.models.NoisePolynomial([0.1], 1.0)), "d must list the 2"),
    "q negative": (lambda: dw.Joint(1, memory=dw.RandomWalk(-1.0)), "q must not be negative"),
    "q of another size": (lambda: dw.Joint(2, memory=dw.RandomWalk([1.0, 1.0, 1.0])), "q"),
    "no such memory": (lambda: dw.Joint(1, memory=0.98), "memory must be"),
    "no such form": (lambda: dw.Joint(1, form="dense"), "form"),
    "two outputs": (lambda: dw.Joint(1).scan(np.zeros((10, 2))), "inputs and outputs together"),
    "column vector": (lambda: dw.Joint(1).scan(np.zeros((10, 1))), "y[:, 0]"),
    "infinity": (lambda: dw.Joint(1).scan([1.0, np.inf]), "infinite at index [1]"),
    "text": (lambda: dw.Joint(1).scan(["a", "b"]), "real numbers"),
    "complex": (lambda: dw.Joint(1).scan(Y * 1j), "real numbers"),
    "ragged": (lambda: dw.Joint(1, inputs=2).scan([1.0, 2.0], [[1.0, 2.0], [1.0]]), "unequal length"),
    "input forgotten": (lambda: dw.Joint(1, inputs=1).scan(Y), "u was not given"),
    "input not expected": (lambda: dw.Joint(1).scan(Y, Y), "did you forget inputs=1"),
    "lengths": (lambda: dw.Joint(1, inputs=1).scan(Y, Y[:5]), "y has 10 samples but u has 5"),
    "transposed": (lambda: dw.Joint(1, inputs=2).scan(Y, np.zeros((2, 10))), "transposed"),
    "foreign state": (lambda: dw.Joint(1).scan(Y, state=dw.Joint(2).start()), "another estimator"),
    "record in update": (lambda: dw.Joint(1).update(dw.Joint(1).start(), [1.0, 2.0]), "for records use scan"),
    "infinite sample": (lambda: dw.Joint(1).update(dw.Joint(1).start(), np.inf), "NaN where missing"),
    "input of update": (lambda: dw.Joint(1, inputs=2).update(dw.Joint(1, inputs=2).start(), 1.0, 1.0), "2 input(s)"),
    "fleet size": (lambda: dw.Joint(1).update_batch(dw.Joint(1).start(3), [1.0, 2.0]), "one row per state"),
    "fleet input": (lambda: dw.Joint(1, inputs=1).update_batch(dw.Joint(1, inputs=1).start(2), [1.0, 2.0]),
                    "not given"),
    "fleet in update": (lambda: dw.Joint(1).update(dw.Joint(1).start(3), 1.0), "advance a fleet with update_batch"),
    "fleet in scan": (lambda: dw.Joint(1).scan(Y, state=dw.Joint(1).start(3)), "advance a fleet with update_batch"),
    "fleet input turned": (
        lambda: dw.Joint(1, inputs=1).update_batch(dw.Joint(1, inputs=1).start(2), np.ones((2, 5)), np.ones((2, 1, 5))),
        "inputs last",
    ),
    "noise as a word": (lambda: dw.Joint(1, noise="output-error"), "noise must be OutputError()"),
    "noise as a class": (lambda: dw.Joint(1, noise=dw.models.EquationError), "brackets"),
    "variance as a word": (lambda: dw.Joint(1, noise=dw.models.EquationError("a")), "must be a number"),
    "P0 as a word": (lambda: dw.Joint(1, P0="big"), "P0 must hold numbers"),
    "dt as a word": (lambda: dw.Joint(1, dt="a"), "dt must be a positive"),
    "floor": (lambda: dw.Joint(1, floor=-1.0), "floor is a relative error"),
    "scale": (lambda: dw.Joint(1, scale=dw.models.InverseGamma(1.0, -1.0)), "positive beta"),
    "numbers as text": (lambda: dw.Joint(1).scan(["1", "2"]), "text"),
    "keep": (lambda: dw.Joint(1).scan(Y, keep="all"), "keep must be one of"),
    "time": (lambda: dw.Joint(1).scan(Y, time=Y[:3]), "time must be (10,)"),
    "not kept": (lambda: dw.Joint(1).scan(Y, keep="innovations").parameters, 'keep=\'means\''),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_refused_in_words(case):
    action, words = REFUSED[case]
    with pytest.raises(dw.InputError) as caught:
        action()
    assert words in str(caught.value), str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_absurd_value_past_the_door_is_missing_and_flagged():
    est = dw.Joint(1, inputs=1)
    trace = est.scan([1.0, 1e200, 0.5, 0.2], [1.0, -1.0, 1e300, 1.0])
    assert trace.status[1] & dw.Status.BAD_VALUE and trace.status[2] & dw.Status.BAD_VALUE
    assert np.isfinite(np.atleast_1d(trace.state).view(float)).all()
    assert [e.kind for e in trace.events()].count("BAD_VALUE") == 1


def test_short_and_empty_records_are_records():
    est = dw.Joint(3, inputs=1)
    assert len(est.scan([], [])) == 0
    trace = est.scan([1.0], [0.0])
    assert np.isfinite(trace.parameters).all()
    assert trace.summary().samples == 1


def test_constant_output_is_learned_not_crashed():
    trace = dw.Joint(2, inputs=1).scan(np.full(50, 7.0), np.zeros(50))
    assert np.isfinite(trace.prediction).all()
    assert [d for d, _ in trace.summary().unlearned if "b" in d]


def test_a_long_gap_with_an_unstable_model_never_overflows():
    est = dw.Joint(1, s0=[1.0, -1.5], P0=1.0, noise=dw.models.EquationError(1.0))
    trace = est.scan(np.r_[1.0, np.full(5000, np.nan), 1.0, 2.0])
    assert np.isfinite(np.atleast_1d(trace.state).view(float)).all()
    assert "LOST" in {e.kind for e in trace.events()}


def test_masked_means_missing():
    est = dw.Joint(1)
    masked = np.ma.array([1.0, 2.0, 1e6], mask=[False, False, True])
    assert est.scan(masked).status.tolist()[-1] & dw.Status.MISSING_OUTPUT


def test_nothing_measured_says_nothing():
    s = dw.Joint(2, inputs=1).scan(np.full(50, np.nan), np.ones(50)).summary()
    assert "too few" in s.words
    assert all(np.isinf(std) for _, _, std in s.parameters)


@pytest.mark.parametrize("size", [1e-300, 1.0, 1e200, 1e300])
def test_deviations_know_no_unit(size):
    x = np.array([1.0, np.nan, 2.0, 4.0])
    assert validation.deviation(size * x) == pytest.approx(size * np.std([1, 2, 4]), rel=1e-12)
    assert validation.root_mean_square(size * x) == pytest.approx(size * math.sqrt(7), rel=1e-12)
    assert math.isnan(validation.deviation(x[1:2])) and validation.deviation(np.zeros(3)) == 0.0
