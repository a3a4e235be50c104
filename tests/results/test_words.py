"""What a user is told: verdicts by their intervals, caveats, and what to write instead."""

import numpy as np
import pytest

import driftwise as dw
from driftwise.results.sentences import pole_words, size_words
from driftwise.results.whiteness import Nis

Y, U = dw.simulate([-0.8], [1.0], samples=300, noise_std=0.1, seed=1)


@pytest.mark.parametrize(
    "nis, words",
    [
        (Nis(0.98, 0.95, 1.05, 3000, True), ""),
        (Nis(0.86, 0.95, 1.05, 3000, False), "about right, slightly too wide"),
        (Nis(1.20, 0.95, 1.05, 3000, False), "about right, slightly too narrow"),
        (Nis(1.30, 0.60, 1.50, 30, True), ""),
        (Nis(1.30, 0.95, 1.05, 3000, False), "too narrow"),
        (Nis(0.70, 0.95, 1.05, 3000, False), "too wide"),
    ],
)
def test_error_bars_are_judged_by_the_interval_of_nis(nis, words):
    assert size_words(nis) == words


@pytest.mark.parametrize("size, words", [(1.0, "can be believed"), (1.16, "are about right, slightly too wide")])
def test_a_summary_says_so(size, words):
    """The noise's variance as it is, and stated a little too large: NIS .86."""
    y, u = dw.simulate([-0.8], [1.0], samples=3000, noise_std=0.1, seed=2)
    s = dw.ARX(1, 1, variance=0.01 * size).scan(y, u).summary()
    assert s.nis_interval.is_consistent == (size == 1.0) and 0.8 < s.nis < 1.25
    assert f"The error bars {words} (NIS {s.nis:.2f}" in s.words
    y, u = dw.models.simulate_mimo(
        (1, 1), [-0.8, 0.1, 1.0, -0.5, 0.1, 0.5], samples=3000, inputs=1, noise_std=0.1, seed=2
    )
    told = dw.ARXMIMO(2, 1, 1, 1, variance=0.01 * size).scan(y, u).summary().words
    assert told.count(f"the error bars {words}") == 2


def test_bars_of_a_pseudolinear_regression_come_with_a_caveat():
    y, u = dw.simulate([-0.8], [1.0], samples=3000, noise_std=0.1, d=[0.3], seed=1)
    exact, plr = (dw.ARMAX(1, 1, 1, method=method).scan(y, u).summary() for method in ("rpem", "plr"))
    assert "The error bars can be believed" in exact.words and "can be believed" not in plr.words
    assert "bars of the parameters assume the exact gradient, which plr is not" in plr.words


# --- what to write instead -------------------------------------------------------------------------------------

CLASSES = {
    "memory": lambda: dw.ARX(1, 1, memory=dw.ExponentialForgetting),
    "memory, Joint": lambda: dw.Joint(1, memory=dw.Constant),
    "memory, continuous": lambda: dw.ContinuousJoint(1, memory=dw.Constant),
    "memory, several outputs": lambda: dw.JointMIMO((1, 1), memory=dw.RandomWalk),
    "memory, gain": lambda: dw.AdaptiveGain(1.0, memory=dw.Constant),
    "gate": lambda: dw.ARX(1, 1, gate=dw.InnovationGate),
    "detector": lambda: dw.ARX(1, 1, memory=dw.RestartOnChange(dw.PageHinkley)),
    "detector, Monitor": lambda: dw.detect.Monitor(dw.PageHinkley),
    "detector, gain": lambda: dw.AdaptiveGain(1.0, detector=dw.detect.GainProbes),
    "response": lambda: dw.ARX(1, 1, memory=dw.RestartOnChange(response=dw.memory.GainReset)),
    "response, Joint": lambda: dw.Joint(1, memory=dw.RestartOnChange(response=dw.memory.CovarianceInflation)),
}


@pytest.mark.parametrize("case", CLASSES)
def test_a_class_in_place_of_a_policy(case):
    with pytest.raises(dw.InputError, match=rf"{case.split(',')[0]} must be .*were the brackets forgotten"):
        CLASSES[case]()


ALL = (
    dw.Constant(), dw.memory.GainFloor(50), dw.ExponentialForgetting(0.98), dw.memory.VariableForgetting(50),
    dw.memory.DirectionalForgetting(0.98),
    dw.RandomWalk(1e-4), dw.RandomWalk(matched=(0.1, 500)), dw.memory.Window(50), dw.memory.BayesianChangePoint(0.1,
    500),
    dw.RestartOnChange(response=dw.memory.CovarianceInflation()), dw.RestartOnChange(response=dw.memory.GainReset(10)),
)  # fmt: skip
NEVER, LIMITED, WEIGHTED, VARIABLE, *_, RESET = ALL
TAKES = {
    "ARX": (dw.ARX, ALL),
    "OE": (dw.OE, ALL),
    "AdaptiveObserver": (dw.estimators.AdaptiveObserver, ALL),
    "ARXMIMO": (lambda **o: dw.ARXMIMO(2, 1, **o), ALL),
    "iv": (lambda **o: dw.ARX(method="iv", **o), (NEVER, LIMITED, WEIGHTED, VARIABLE, RESET)),
    "nlms": (lambda **o: dw.ARX(method="nlms", **o), (NEVER, LIMITED, WEIGHTED)),
    "Joint": (lambda **o: dw.Joint(2, **o), ALL),
    "JointMIMO": (lambda **o: dw.JointMIMO((2, 1), **o), ALL),
    "ContinuousJoint": (lambda **o: dw.ContinuousJoint(2, **o), (*ALL[:6], *ALL[7:])),  # a walk goes by seconds
    "AdaptiveGain": (dw.AdaptiveGain, ALL[:-2]),
}


@pytest.mark.parametrize("name", TAKES)
def test_who_takes_which_memory_is_as_the_page_says(name):
    make, taken = TAKES[name]
    for memory in ALL:
        if any(memory is one for one in taken):  # tuples of equal numbers are equal
            make(memory=memory)
        else:
            with pytest.raises(dw.InputError, match=r"memory|response|RandomWalk"):
                make(memory=memory)


@pytest.mark.parametrize("make", [dw.ARX, lambda **options: dw.Joint(1, **options)])
def test_a_walk_needs_its_speed(make):
    with pytest.raises(dw.InputError, match="a walk needs its speed"):
        make(memory=dw.RandomWalk())
    with pytest.raises(dw.InputError, match="either q or matched"):
        make(memory=dw.RandomWalk(1e-4, matched=(0.1, 500)))
    make(memory=dw.RandomWalk(0.0)), make(memory=dw.RandomWalk(matched=(0.1, 500)))


@pytest.mark.parametrize("slopes", [(), 1.0, [1.0], [[1.0, 2.0]]], ids=str)
def test_a_monitor_of_slopes_says_how_many(slopes):
    monitor = dw.detect.Monitor(dw.detect.ScoreCUSUM(), parameters=2)
    with pytest.raises(dw.InputError, match="slopes must be 2 numbers"):
        monitor.update(monitor.start(), 1.0, slopes)


@pytest.mark.parametrize(
    "est", [dw.OE(1, 1), dw.ARMAX(1, 1, 1), dw.ARXMIMO(2, 1), dw.AdaptiveGain(1.0)], ids=lambda est: type(est).__name__
)
def test_who_does_not_smooth_says_who_does(est):
    with pytest.raises(dw.InputError, match=r"has no smoother: use ARX, AR or Regression, or Joint\(order, inputs\)"):
        est.smooth(Y, U)
    with pytest.raises(dw.InputError, match="has no tune: drift is learnt from a record by ARX, AR and Regression"):
        est.tune(Y, U)


def test_who_does_not_predict_says_what_to_do_and_it_works():
    """A record with its end missing: for constant inputs and parameters the forecast of the very ARX model."""
    with pytest.raises(dw.InputError, match=r"scan\(np.full\(h, np.nan\), u, state=state\)"):
        dw.ARXMIMO(1, 1).predict(None)
    est, arx = dw.Joint(1, inputs=1), dw.ARX(1, 1)
    trace = est.scan(Y, U)
    several = dw.ARXMIMO(1, 1)
    with pytest.raises(dw.InputError, match="has no predict"):
        several.scan(Y[:, None], U).predict(np.ones(4))
    ahead = est.scan(np.full(4, np.nan), np.ones(4), state=trace.state)
    mean, std = arx.predict(arx.scan(Y, U).state, np.ones(4))
    np.testing.assert_allclose(ahead.prediction, mean, rtol=1e-3)
    np.testing.assert_allclose(np.sqrt(ahead.variance), std, rtol=0.02)


def test_a_frame_of_a_library_that_is_not_there(monkeypatch):
    import narwhals

    def absent(columns, backend):
        raise ModuleNotFoundError(f"No module named {backend!r}")

    trace = dw.ARX(1, 1).scan(Y, U)
    assert trace.to_frame("pyarrow").num_rows == len(Y)
    monkeypatch.setattr(narwhals, "from_dict", absent)
    with pytest.raises(
        ImportError, match=r"needs pandas: pip install driftwise\[frames\]; or take to_frame\('pyarrow'\)"
    ):
        trace.to_frame()


def test_an_interval_has_the_unit_of_its_number():
    """It was said as 22 h (19.7 h to 1.07 d)."""
    table = dw.identify({"u": U, "y": Y}, dt=3600.0).table
    assert table.lasting_between(79200.0, 70920.0, 92448.0) == ("22 h", "19.7 to 25.7 h")
    table = dw.identify({"u": U, "y": Y}).table
    assert table.lasting_between(1.0, 0.9, 1.2) == ("1 sample", "0.9 to 1.2 samples")


@pytest.mark.parametrize(
    "pole, std, said",
    [
        (1.02, 0.004, "an unstable mode"),
        (1.02, 0.04, "an integrator"),
        (1.2, 0.3, "a mode that cannot be told from an integrator"),
        (1.01 * np.exp(0.9j), 0.04, "hardly dies out"),
        (1.05 * np.exp(0.9j), 0.01, "an unstable mode"),
        (-1.01, 0.04, "an alternating mode"),
    ],
)
def test_a_mode_runs_away_only_where_that_is_sure(pole, std, said):
    assert said in pole_words(complex(pole), std, 1.0)
