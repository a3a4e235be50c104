"""Recursive estimators and their policies at the door: each refusal names argument, expectation, what came, and why."""

import numpy as np
import pytest
from draws import slow

import driftwise as dw

NAN = float("nan")
RECORD = np.random.default_rng(0).standard_normal(12)

# every model that takes a memory, with the least it needs
MODELS = {
    "AR": lambda **options: dw.AR(2, **options),
    "ARX": lambda **options: dw.ARX(1, 1, **options),
    "ARMA": lambda **options: dw.ARMA(1, 1, **options),
    "ARMAX": lambda **options: dw.ARMAX(1, 1, 1, **options),
    "OE": lambda **options: dw.OE(1, 1, **options),
    "BJ": lambda **options: dw.BJ(1, 1, 1, 1, **options),
    "Regression": lambda **options: dw.Regression(2, **options),
    "ARXMIMO": lambda **options: dw.ARXMIMO(2, 1, **options),
    "AdaptiveObserver": lambda **options: dw.estimators.AdaptiveObserver(1, 0.5, 1, **options),
}


def until(detector):
    return dict(memory=dw.RestartOnChange(detector))


OPTIONS = [
    (dict(memory=dw.ExponentialForgetting), "were the brackets forgotten"),
    (dict(memory=0.98), r"ExponentialForgetting\(0.98\)"),
    (dict(memory=100), r"GainFloor\(100\)"),
    (dict(memory=dw.ExponentialForgetting(0.0)), "lam must be a positive finite number, got 0.0"),
    (dict(memory=dw.ExponentialForgetting(1.1)), "at most 1, got 1.1"),
    (dict(memory=dw.ExponentialForgetting(NAN)), "lam must be a positive finite number, got nan"),
    (dict(memory=dw.RandomWalk(NAN)), "q must be a finite number.* got nan"),
    (dict(memory=dw.RandomWalk(1.0, matched=(1, 2))), r"got q = 1.0 and matched = \(1, 2\)"),
    (dict(memory=dw.memory.Window(0)), "samples must be a whole number of at least 1, got 0"),
    (dict(memory=dw.RestartOnChange(response=dw.memory.GainReset(0.5))), "samples must exceed 1"),
    (dict(memory=dw.RestartOnChange(response=dw.memory.GainReset)), "brackets"),
    (dict(memory=dw.RestartOnChange(response=dw.memory.CovarianceInflation(1.0, only_named="b1"))),
     "only_named must be True or False, got 'b1'"),
    (until(dw.PageHinkley), "brackets"),
    (until(dw.PageHinkley(threshold=np.inf)), "threshold must be positive and finite"),
    (until(dw.PageHinkley(threshold=1e30)), "threshold must be at most 1e.12, got 1e.30: it never alarms"),
    (until(dw.detect.VarianceCUSUM(threshold=1e30)), "it never alarms"),
    (until(dw.detect.GLR(threshold=1e30)), "it never alarms"),
    (until(dw.detect.ScoreCUSUM(threshold=1e30)), "it never alarms"),
    (until(dw.PageHinkley("1 per 1e300")), "at most 1e.18 samples between false alarms"),
    (until(dw.detect.GLR("1 per 1e40")), "never alarms"),
    (until(dw.PageHinkley(sides=["up"])), "sides must be 'both', 'up' or 'down', got"),
    (until(dw.detect.ProbeBank([1.0, 1.0])), "which only AdaptiveGain runs"),
    (until(dw.detect.GainProbes()), "which only AdaptiveGain runs"),
    (until(dw.detect.PullTest()), "which only AdaptiveGain runs"),
    (dict(gate=dw.InnovationGate(settle=-1)), "settle must be a whole number of at least 0, got -1"),
    (dict(gate=dw.InnovationGate(settle=NAN)), "settle must be a whole number of at least 0, got nan"),
    (dict(gate=dw.InnovationGate), "brackets"),
    (dict(offset="yes"), "offset must be True or False, got 'yes'"),
    (dict(scale=3.0), r"scale must be InverseGamma\(alpha, beta\).*got 3.0"),
    (dict(scale=dw.models.InverseGamma(1.0, np.inf)), "finite numbers"),
    (dict(missing=["hold"]), "missing must be one of predict, hold, skip, got"),
    (dict(y_scale=1e200), "y_scale must lie between 1e-100 and 1e.100, got 1e.200. Is the unit right"),
    (dict(theta0=np.array([1j, 0.0])), "theta0 (must hold numbers|of several outputs is given by name)"),
]  # fmt: skip


@pytest.mark.parametrize("model", MODELS)
def test_every_model_refuses(model):
    for options, words in OPTIONS:
        with pytest.raises(dw.InputError, match=words):
            MODELS[model](**options)


REFUSED = [
    (lambda: dw.AdaptiveGain("a"), "Phi must hold numbers, got 'a'"),
    (lambda: dw.AdaptiveGain(NAN), "Phi must be a finite square matrix or a number, got nan"),
    (lambda: dw.AdaptiveGain(1.0, "a"), "H must hold numbers"),
    (lambda: dw.AdaptiveGain(1.0, B="a"), "B must hold numbers"),
    (lambda: dw.AdaptiveGain(limits=("a", "b")), "limits must be"),
    (lambda: dw.AdaptiveGain(scale=3.0), "scale must be InverseGamma"),
    (lambda: dw.AdaptiveGain(detector=dw.detect.GainProbes), "brackets"),
    (lambda: dw.AdaptiveGain(detector=dw.detect.GainProbes([NAN])), "no number"),
    (lambda: dw.AdaptiveGain(detector=dw.detect.ProbeBank([1.0])), "got ProbeBank"),
    (lambda: dw.AdaptiveGain(detector=dw.detect.GainProbes(threshold=1e30)), "it never alarms"),
    (lambda: dw.AdaptiveGain(memory=dw.RestartOnChange()), r"option of its own here: detector"),
    (lambda: dw.ARX(1, 1, method=["ls"]), "method must be one of ls, iv, nlms, lms, got"),
    (lambda: dw.OE(1, 1, method=["ls"]), "method must be one of rpem, plr, got"),
    (lambda: dw.Regression(1.5), "regressors must be a whole number"),
    (lambda: dw.Regression("speed"), "regressors must be a whole number of at least 1, got 'speed'"),
    (lambda: dw.Regression(["a", "a"]), "different names"),
    (lambda: dw.AR(1).scan(None), "a single number: for one sample use update"),
    (lambda: dw.AR(1).scan(3.0), "a single number"),
    (lambda: dw.AR(1).update(dw.AR(1).start(), "1"), "one sample is a number y"),
    (lambda: dw.AR(1).update(dw.AR(1).start(), 1j), "one sample is a number y"),
    (lambda: dw.AR(1).scan(RECORD, time="noon"), "time must hold numbers"),
    (lambda: dw.AR(1).scan(RECORD).state_before(1.5), "sample must be a whole number"),
    (lambda: dw.AR(1).scan(RECORD).state_before(12), "sample must lie between 0 and 11"),
    (lambda: dw.AR(1).predict(dw.AR(1).start()), "say how far"),
    (lambda: dw.ARXMIMO(1, 1).predict(dw.ARXMIMO(1, 1).start(), [1.0]), "ARXMIMO has no predict"),
    (lambda: dw.AdaptiveGain().predict(dw.AdaptiveGain().start(), None, 3), "AdaptiveGain has no predict"),
    (lambda: dw.estimators.AdaptiveObserver().predict(dw.estimators.AdaptiveObserver().start(), [1.0]),
    "AdaptiveObserver has no predict"),
    (lambda: dw.Joint(1).predict(dw.Joint(1).start()), "say how far"),
]  # fmt: skip


@pytest.mark.parametrize("case", range(len(REFUSED)))
def test_refused_in_words(case):
    action, words = REFUSED[case]
    with pytest.raises(dw.InputError, match=words):
        action()


def test_numpy_integers_and_names_are_welcome():
    assert dw.Regression(np.int64(2)).names == ["theta1", "theta2"]
    assert dw.Regression(np.array(["a", "b"])).names == ["a", "b"]
    assert (
        dw.AdaptiveGain(memory=dw.RandomWalk(matched=(0.1, 400))).policies[2]
        == dw.AdaptiveGain(memory=dw.RandomWalk(0.1**2 / 400)).policies[2]
    )


@pytest.mark.parametrize(
    "sides, ratio", [("down", 1.05), ("up", 1.5), ("down", 30.0), slow("up", 1.05), slow("down", 1.5), slow("up", 30.0)]
)
def test_a_variance_change_is_designed_or_refused(ratio, sides):
    """Where the numerics end (small ratios, rare alarms) there are words, not a threshold that is none."""
    for wanted in (1e3, 1e6):
        detector = dw.detect.VarianceCUSUM(ratio, false_alarms=wanted, sides=sides)
        if ratio < 1.5 and wanted > 1e5:
            with pytest.raises(dw.InputError, match="cannot be computed"):
                detector.resolve()
        else:
            assert abs(np.log(detector.run_length / wanted)) < 0.01


def test_score_watches_for_jumps_in_units_of_the_data():
    """A jump of b has the units of y over u, as the prior and the step of a restart have."""
    est = dw.ARX(
        1,
        1,
        offset=True,
        memory=dw.RestartOnChange(dw.detect.ScoreCUSUM(jump=[0.1, 0.2, 0.3])),
        y_scale=8.0,
        u_scale=2.0,
    )
    np.testing.assert_allclose(est.policies[-1].d, [0.1, 0.2 * 4.0, 0.3 * 8.0])


def test_data_far_below_any_unit_counts_as_none():
    est = dw.AR(1).scaled_to(1e-150 * RECORD)
    assert est.y_scale == 1.0 and np.isfinite(est.scan(1e-150 * RECORD).variance).all()
