"""A known plant with disturbances: augmented, discretised, refused where a mode is hidden."""

import numpy as np
import pytest
from paper_motor import MOTOR
from scipy import signal

import driftwise as dw
from driftwise.models.plant import Augmented

PAPER = (dw.models.Polynomial([0, 0, 5], np.inf), dw.models.Sinusoid(50.0, [0, 0, 5], 2.0))


def test_the_augmented_motor():
    a = Augmented(MOTOR, PAPER)
    assert a.names == ["x1", "x2", "x3", "q1", "q2_c", "q2_s"] and a.m == 6
    np.testing.assert_array_equal(a.A[2], [0, -10, -10, 5, 5, 0])
    np.testing.assert_array_equal(a.prior_std, [np.inf] * 4 + [2, 2])
    np.testing.assert_allclose(sorted(a.modes.imag), [-50, 0, 0, 0, 0, 50])


@pytest.mark.parametrize(
    "plant, disturbances, hidden",
    [
        (MOTOR, PAPER, []),
        (dw.Plant([[0.0]]), (), []),
        (MOTOR._replace(C=[0, 1, 0]), PAPER[:1], [0]),
        (dw.Plant([[0, 0.2], [-10, -10]], [0, 10], [0, 1]), (dw.models.Polynomial([0, 10], np.inf),), [0]),
        (MOTOR, (dw.models.Polynomial([0, 0.2, 0], np.inf), dw.models.Polynomial([0, 0, 10], np.inf)), [0]),
        (dw.Plant([[0, 1], [-1, -1]], [0, 1], [9, 0]), (dw.models.Sinusoid(3.0, [-9, 0], np.inf, outputs=9.0),), []),
        (
            dw.Plant([[-1.0]], [1], [1]),
            (dw.models.Sinusoid(3.0, [0], 1.0, outputs=1), dw.models.Sinusoid(3.0, [1], 1.0)),
            [3j, -3j],
        ),
    ],
)
def test_hidden_modes_are_named(plant, disturbances, hidden):
    assert Augmented(plant, disturbances).hidden == hidden


def test_a_disturbance_at_a_zero_of_the_plant_is_hidden():
    # y = x1'' + 9 x1 in companion form: zeros at +-3j
    plant = dw.Plant([[0, 1, 0], [0, 0, 1], [-6, -11, -6]], [0, 0, 1], [9, 0, 1])
    with pytest.raises(dw.InputError, match=r"the mode at 3 rad/s cannot be seen in y"):
        Augmented(plant, dw.models.Sinusoid(3.0, [0, 0, 1], np.inf)).require_observable()
    Augmented(plant, dw.models.Sinusoid(3.0, [0, 0, 1], 1.0)).require_observable()  # a prior tells


@pytest.mark.parametrize("hold", ["zoh", "foh"])
def test_discretisation_agrees_with_fine_steps(hold):
    a, dt, fine = Augmented(MOTOR, PAPER), 0.05, 20_000
    Phi, G0, G1 = a.discretise(dt, hold)
    z0 = np.arange(1.0, 7.0)
    h = dt / fine
    F, g, _ = a.discretise(h)
    z = z0.copy()
    for i in range(fine):
        u = 3.0 if hold == "zoh" else 3.0 + (i + 0.5) / fine * (7.0 - 3.0)
        z = F @ z + g[:, 0] * u
    np.testing.assert_allclose(Phi @ z0 + G0[:, 0] * 3 + G1[:, 0] * 7, z, rtol=1e-8, atol=1e-9)


def test_walk_noise_of_a_random_walk_into_an_integrator():
    a = Augmented(dw.Plant([[0.0]], None, [1.0]), dw.models.Polynomial(1.0, np.inf, walk=2.0))
    dt = 0.3
    np.testing.assert_allclose(a.noise(dt), 4 * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]]), rtol=1e-12)


@pytest.mark.parametrize(
    "make, message",
    [
        (lambda: Augmented(MOTOR, dw.models.Sinusoid(0.0, [0, 0, 1], 1.0)), "a frequency of 0 is a constant"),
        (
            lambda: Augmented(MOTOR, dw.models.Polynomial([0, 0, 1], 1.0, degree=-1)),
            "whole number of at least 0, got -1",
        ),
        (lambda: Augmented(MOTOR, dw.models.Polynomial([0, 0, 1], None)), "prior_std must be stated"),
        (
            lambda: Augmented(MOTOR, dw.models.Polynomial([0, 0, 1], 1.0, degree=1)),
            "2 numbers, of q and its derivatives",
        ),
        (lambda: Augmented(MOTOR, dw.models.Polynomial(0, 1.0)), "enters neither a state nor an output"),
        (lambda: Augmented(dw.Plant([[1, 2]])), "A must be square"),
        (lambda: Augmented(MOTOR._replace(B=[1, 2])), "do not fit"),
        (lambda: Augmented(MOTOR._replace(states=["a", "a", "b"])), "3 different names"),
        (lambda: Augmented(MOTOR._replace(states=7)), "3 different names"),
        (lambda: Augmented(MOTOR._replace(states=[["a"], "b", "c"])), "3 different names"),
        (lambda: Augmented(MOTOR, dw.models.Polynomial([0, 0, 1], 1.0, name="x1")), "different names"),
        (lambda: Augmented(MOTOR, dw.models.Polynomial("current", 1.0)), "one for each state.*, got 'current'"),
        (lambda: Augmented(MOTOR, dw.models.Polynomial([0, 0, 1], "wide")), "prior_std must be stated .* got 'wide'"),
        (lambda: Augmented(MOTOR, None), r"or a list of them \(none: \(\)\), got None"),
        (lambda: Augmented(MOTOR, dw.models.Sinusoid), "or a list of them"),
        (lambda: Augmented(signal.StateSpace([[0]], [[1]], [[1]], [[0]])), r"Plant\(sys.A, sys.B, sys.C, sys.D\)"),
        (lambda: Augmented(MOTOR).discretise(0.1, "linear"), 'hold must be "zoh"'),
    ],
)
def test_what_does_not_fit_is_refused(make, message):
    with pytest.raises(dw.InputError, match=message):
        make()


def test_a_level_that_stays_is_seen():
    """A = 0 has no size of its own to compare H with."""
    assert Augmented(dw.Plant([[0.0]])).hidden == [] and Augmented(dw.Plant([[0.0]], C=[0.0])).hidden == [0]


def test_noise_of_a_step_many_time_constants_long():
    """x' = 1000 (q - x): x follows q but for its walk of the last millisecond; exp(1000) appears nowhere."""
    Q = Augmented(dw.Plant([[-1000.0]]), dw.models.Polynomial([1000.0], np.inf, walk=2.0)).noise(1.0)
    np.testing.assert_allclose(Q, 4 * np.array([[1 - 1.5e-3, 1 - 1e-3], [1 - 1e-3, 1]]), rtol=1e-12)
