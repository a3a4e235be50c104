"""What an observer by windows refuses, and what it says of a length."""

import numpy as np
import pytest
from paper_motor import CONSTANT, COSINE, MOTOR, SIGMA
from windows_of_motors import FS, INF, SILENT, SOFT, observed

import driftwise as dw
from driftwise.analysis.laws import same
from driftwise.estimators.window_observer.gains import Design, smallest
from driftwise.models.plant import Augmented

TORQUE = dw.models.Polynomial([0, 0.2, 0], INF)
ZEROS = dw.Plant([[0, 1, 0], [0, 0, 1], [-6, -11, -6]], None, [9, 0, 1])  # y = x1'' + 9 x1
SLOW, CHAIN = dw.models.Sinusoid(1e-4, 0, INF, outputs=1), dw.Plant(np.eye(2, k=1))


def half_a_second(*disturbances, plant=SILENT, **options):
    return lambda: observed(0.5, disturbances or CONSTANT, plant, **options)


def scanned(*args, **options):
    return lambda: observed(0.5, CONSTANT).scan(*args, **options)


BAD = {
    "hidden": (half_a_second(plant=SILENT._replace(C=[0, 1, 0])), r"the constant mode \(0\) cannot be seen"),
    "two channels, one output": (half_a_second(TORQUE, CONSTANT), r"the constant mode \(0\) cannot be seen"),
    "frequency twice": (half_a_second(COSINE, COSINE), "the mode at 50 rad/s cannot be seen"),
    "frequency zero": (half_a_second(dw.models.Sinusoid(0.0, [0, 0, 5], INF)), "a frequency of 0 is a constant"),
    "a zero": (
        half_a_second(dw.models.Sinusoid(3.0, [0, 0, 1], INF), plant=ZEROS),
        "the mode at 3 rad/s cannot be seen",
    ),
    "no prior": (half_a_second(dw.models.Polynomial([0, 0, 5], None)), "prior_std must be stated"),
    "too short": (lambda: observed(0.003, CONSTANT), r"3 samples cannot tell 4 unknowns apart .* one is 0\.004 s"),
    "condition": (lambda: observed(0.01, SLOW, CHAIN), r"condition \d\.\de\+1[2-9].* one is 0\.\d+ s"),
    "no sample": (lambda: observed(1e-4, CONSTANT), "less than half of dt"),
    "no hold": (half_a_second(plant=MOTOR), r"hold must say what it does between them"),
    "wrong hold": (half_a_second(plant=MOTOR, hold="linear"), r"Got 'linear'"),
    "hold of nothing": (half_a_second(hold="zoh"), "has no input, so hold says nothing"),
    "no dt": (lambda: dw.WindowObserver(SILENT, 0.5, noise_std=1.0), "dt must be given"),
    "walk": (half_a_second(CONSTANT._replace(walk=1.0)), "a window knows none"),
    "prior of x": (half_a_second(x_std=1.0), "x0 and x_std are the prior of the first state"),
    "first state without a deviation": (
        lambda: observed(INF, CONSTANT, x0=[1, 0, 0]),
        "x0 says nothing where x_std is",
    ),
    "no samples to report": (lambda: observed(0.5, CONSTANT).scan([]).report("none.html"), "the trace has no samples"),
    "learnt noise and a prior": (
        lambda: dw.WindowObserver(SILENT, 0.5, noise_std=None, disturbances=SOFT, dt=FS),
        "State noise_std, or leave these infinite",
    ),
    "capacity": (half_a_second(capacity=5), "capacity is for a finite window with irregular=True"),
    "tolerance": (half_a_second(tolerance=[1.0, 2.0]), r"tolerance must be positive .* \(3,\) or \(4,\)"),
    "derived": (half_a_second(derived={"a": [1.0]}), r"derived\['a'\] must be a row of 3 numbers on x or 4 on z"),
    "derived name": (half_a_second(derived={"q": [1, 0, 0]}), "has the name of a state"),
    "name of a column": (
        half_a_second(dw.models.Polynomial([0, 0, 5], INF, name="status")),
        "status: a name must stand for",
    ),
    "name of an input": (half_a_second(plant=MOTOR._replace(inputs="x1"), hold="zoh"), "x1: a name must stand for one"),
    "too long": (lambda: observed(1e9, CONSTANT), "1000000000000 samples, and 200000 are the most"),
    "too long to keep": (lambda: observed(1e9, CONSTANT, irregular=True), "and 200000 are the most"),
    "hum at Nyquist": (
        half_a_second(dw.models.Sinusoid(np.pi / FS, [0, 1], INF), plant=dw.Plant([[0, 1], [0, -2]])),
        r"sample faster \(pi/dt = 3141\.59 is the limit",
    ),
    "detector": (half_a_second(detector=dw.detect.ScoreCUSUM()), "ScoreCUSUM watches parameters"),
    "dates": (scanned(np.zeros(3), time=np.arange(3).astype("M8[s]")), "got dates: take"),
    "clock": (scanned(np.zeros(3), time=[0.0, 1e-3, 5e-3]), r"say irregular=True"),
    "backwards": (scanned(np.zeros(3), time=[0.0, 1e-3, 0.0]), "time must increase"),
    "infinite": (scanned([0.0, np.inf]), "y is infinite at index"),
    "two outputs": (scanned(np.zeros((3, 2))), r"y must be one-dimensional, \(T,\)"),
    "covariance": (scanned(np.zeros(3), keep="covariance"), "keep must be one of"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_cannot_be_is_refused(name):
    make, message = BAD[name]
    with pytest.raises(dw.InputError, match=message):
        make()


def test_a_missing_input_is_told_where_bars_do_not_know():
    trace = observed(0.1, CONSTANT, MOTOR, hold="zoh").scan(np.zeros(400), np.where(np.arange(400) == 300, np.nan, 0.0))
    assert "In 1 samples an input was missing and held" in trace.summary().words
    assert "y is predicted without any error: is the sensor stuck" in trace.summary().words
    assert (300, "input missing, held at its last value") in [(event.sample, event.text) for event in trace.events()]


def test_smallest_window_is_found():
    design = [Design(Augmented(SILENT, CONSTANT), FS, L, [SIGMA]).is_usable for L in (3, 4)]
    assert design == [False, True] and smallest(lambda L: L >= 37, 1) == 37


def test_an_exact_record_has_no_best_window():
    est = dw.WindowObserver(dw.Plant([[0, 1], [0, -2]]), 0.5, noise_std=None, dt=0.01)
    with pytest.raises(dw.InputError, match="y is exactly what the plant says"):
        est.tune(np.zeros(300))


def test_an_output_called_like_a_state_is_told_from_it():
    y = np.arange(20) * 0.01
    est = dw.WindowObserver(dw.Plant([[0, 1], [0, 0]], states=("s", "v"), outputs="s"), 0.1, noise_std=0.01, dt=0.01)
    table = est.scan(y).columns()
    assert same(table["s_measured"], y) and not same(table["s"], y)
