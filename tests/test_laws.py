"""Every estimator obeys the laws, with every policy once and a few chosen pairs."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from memories_of_joint import MEMORIES
from paper_motor import CONSTANT, MOTOR

import driftwise as dw
from driftwise.analysis.laws import LAWS, example, same

Q2 = np.array([[0.3, 0.1], [0.1, 0.2]])
FULL = np.diag([0.2, 0.1, 1e-4, 1e-5, 1e-4, 1e-4])

ESTIMATORS = {
    "default": dw.Joint(2, inputs=1),
    "output error": dw.Joint(2, inputs=1, noise=dw.models.OutputError()),
    "AR, no input": dw.Joint(3, noise=dw.models.EquationError()),
    "ARX, direct term": dw.Joint(2, inputs=1, direct=True, noise=dw.models.EquationError(0.01)),
    "two inputs": dw.Joint(1, inputs=2, direct=True),
    "known polynomial": dw.Joint(2, inputs=1, noise=dw.models.NoisePolynomial([0.1, -0.4], 0.01)),
    "known covariances": dw.Joint(2, inputs=1, noise=dw.models.NoiseCovariance(Q2, [0.1, 0.05], 0.5)),
    "noise on the parameters": dw.Joint(
        2, inputs=1, noise=dw.models.NoiseCovariance(FULL, [0.1, 0.02, 1e-3, 0, 0, 0], 0.5), P0=10.0
    ),
    "walk": dw.Joint(2, inputs=1, memory=dw.RandomWalk(1e-4)),
    "gate": dw.Joint(2, inputs=1, gate=dw.InnovationGate(4.0)),
    "all together": dw.Joint(
        3,
        inputs=2,
        direct=True,
        noise=dw.models.OutputError(0.01),
        memory=dw.RandomWalk(1e-6),
        gate=dw.InnovationGate(),
        P0=100.0,
    ),
    "until a jump": dw.Joint(2, inputs=1, memory=dw.RestartOnChange(settle=10)),
    "offset": dw.Joint(2, inputs=1, offset=True),
    "offset, direct terms, unknown polynomial": dw.Joint(
        1, inputs=2, direct=True, offset=True, noise=dw.models.UnknownPolynomial(), memory=dw.RandomWalk(1e-5)
    ),
    "unknown polynomial": dw.Joint(2, inputs=1, noise=dw.models.UnknownPolynomial()),
    "extended least squares": dw.Joint(
        1,
        inputs=2,
        direct=True,
        noise=dw.models.UnknownPolynomial(variance=0.01, method="els"),
        memory=dw.RandomWalk(1e-5),
    ),
    "dead-beat": dw.Joint(2, inputs=1, noise=dw.models.EquationError(0.0), P0=100.0),
    "ARX": dw.ARX(2, 2),
    "ARX, two inputs, delays, offset": dw.ARX(2, (2, 1), (1, 0), offset=True),
    "ARX, weighted": dw.ARX(2, 2, memory=dw.ExponentialForgetting(0.98)),
    "ARX, limited gain": dw.ARX(2, 2, memory=dw.memory.GainFloor(50)),
    "ARX, walk": dw.ARX(2, 2, memory=dw.RandomWalk(1e-5)),
    "ARX, known noise": dw.ARX(1, 1, variance=0.01, gate=dw.InnovationGate(), P0=10.0),
    "ARX, missing held": dw.ARX(2, 2, missing="hold"),
    "ARX, missing skipped": dw.ARX(2, 2, missing="skip", memory=dw.ExponentialForgetting(0.95)),
    "AR": dw.AR(3),
    "regression": dw.Regression(3, offset=True),
    "ARX, variable forgetting": dw.ARX(2, 2, memory=dw.memory.VariableForgetting(50)),
    "ARX, directional forgetting": dw.ARX(2, 2, memory=dw.memory.DirectionalForgetting(0.95)),
    "ARX, matched walk": dw.ARX(2, 2, memory=dw.RandomWalk(matched=(0.1, 100))),
    "ARX, window": dw.ARX(2, 2, memory=dw.memory.Window(20)),
    "ARX, window of one": dw.ARX(1, 1, memory=dw.memory.Window(1), variance=0.01),
    "ARX, run lengths": dw.ARX(2, 2, memory=dw.memory.BayesianChangePoint(0.3, 50, 5)),
    "ARX, fuzzy drift": dw.ARX(2, 2, memory=dw.memory.FuzzyDrift()),
    "ARX, fuzzy drift as published": dw.ARX(
        2, 2, memory=dw.memory.FuzzyDrift(geometric=True, as_published=True, phi=0.9)
    ),
    "ARX, scalar matching": dw.ARX(2, 2, memory=dw.memory.CovarianceMatching()),
    "ARX, gain matching": dw.ARX(2, 2, memory=dw.memory.CovarianceMatching("gain")),
    "ARX, Myers-Tapley": dw.ARX(2, 2, memory=dw.memory.CovarianceMatching("myers-tapley")),
    "ARX, on-line EM": dw.ARX(2, 2, memory=dw.memory.CovarianceMatching("em")),
    "ARX, auxiliary filter": dw.ARX(2, 2, memory=dw.memory.AuxiliaryFilter()),
    "ARX, correlation": dw.ARX(2, 2, memory=dw.memory.AutocovarianceLS(3)),
    "ARX, likelihood drift": dw.ARX(2, 2, memory=dw.memory.LikelihoodDrift(phi=(1.0, 0.5, 1.0, 0.0))),
    "ARX, likelihood drift, shared": dw.ARX(2, 2, memory=dw.memory.LikelihoodDrift(shared=True)),
    "ARX, variational drift": dw.ARX(2, 2, memory=dw.memory.VariationalBayes()),
    "ARX, variational noise": dw.ARX(2, 2, memory=dw.memory.VariationalBayes("noise")),
    "ARX, variational, both": dw.ARX(2, 2, memory=dw.memory.VariationalBayes("both")),
    "ARX, bank": dw.ARX(2, 2, memory=dw.memory.MultipleModel(phi=(1.0, 0.5, 1.0, 0.0))),
    "ARX, interacting": dw.ARX(2, 2, memory=dw.memory.IMM()),
    "ARX, interacting, two speeds": dw.ARX(2, 2, memory=dw.memory.IMM((0.0, 1e-2), 0.9, 0.0, phi=0.9)),
    "ARX, auto": dw.ARX(2, 2, memory=dw.AutoMemory()),
    "ARX, auto, only outliers": dw.ARX(2, 2, memory=dw.AutoMemory("outliers"), missing="skip"),
    "regression, auto, no outliers": dw.Regression(3, memory=dw.AutoMemory("jumps", phi=0.95), offset=True),
    "ARX, auto, known noise": dw.ARX(2, 2, memory=dw.AutoMemory(), variance=0.01, P0=10.0),
    "ARX, until the mean jumps": dw.ARX(2, 2, memory=dw.RestartOnChange(dw.PageHinkley(threshold=2.0), settle=10)),
    "ARX, until the score jumps": dw.ARX(
        2,
        (2, 1),
        memory=dw.RestartOnChange(
            dw.detect.ScoreCUSUM(jump=0.5, threshold=1.0),
            dw.memory.CovarianceInflation(0.5, only_named=True),
            settle=10,
        ),
    ),
    "ARX, until a parameter jumps by any size": dw.ARX(
        2, (2, 1), memory=dw.RestartOnChange(dw.detect.ScoreCUSUM(threshold=3.0), settle=10)
    ),
    "ARX, until the variance jumps": dw.ARX(
        2, 2, memory=dw.RestartOnChange(dw.detect.VarianceCUSUM(threshold=1.0), settle=10)
    ),
    "ARX, until the likelihood jumps": dw.ARX(
        2, 2, memory=dw.RestartOnChange(dw.detect.GLR(threshold=2.0, window=5), dw.memory.GainReset(5), settle=10)
    ),
    "ARX, self-starting": dw.ARX(2, 2, memory=dw.RestartOnChange(dw.detect.SelfStarting(), settle=10)),
    "regression, disturbance": dw.Regression(
        2, offset=True, disturbance=dw.models.Disturbance(0.8), memory=dw.memory.Drift(nvr=(1e-3, 1e-4, 0.0))
    ),
    "matched walk": dw.Joint(2, inputs=1, memory=dw.RandomWalk(matched=(0.1, 100))),
    "proper scale": dw.Joint(
        2, inputs=1, scale=dw.models.InverseGamma(2.0, 0.1), noise=dw.models.EquationError(1.0), P0=1e3
    ),
    "ARMA": dw.ARMA(2, 1),
    "ARMAX": dw.ARMAX(2, 2, 2),
    "ARMAX, pseudolinear, offset": dw.ARMAX(2, (2, 1), 1, (1, 0), method="plr", offset=True),
    "ARMAX, missing skipped": dw.ARMAX(1, 1, 1, missing="skip"),
    "output error, polynomials": dw.OE((1, 2), (1, 2), (0, 2), offset=True, gate=dw.InnovationGate()),
    "Box-Jenkins": dw.BJ(2, 1, 1, 2),
    "Box-Jenkins, walk": dw.BJ((2, 1), 1, 2, (1, 0), memory=dw.RandomWalk(1e-5)),
    "Box-Jenkins, missing held": dw.BJ(1, 1, 1, 1, missing="hold"),
    "adaptive gain": dw.AdaptiveGain(0.9),
    "adaptive gain, plr, pull test": dw.AdaptiveGain(
        0.9,
        method="plr",
        memory=dw.ExponentialForgetting(0.98),
        detector=dw.detect.PullTest(threshold=2.0),
        gate=dw.InnovationGate(),
    ),
    "adaptive gain, two states, input, probes": dw.AdaptiveGain(
        [[1.0, 1.0], [0.0, 1.0]],
        B=[0.5, 1.0],
        detector=dw.detect.GainProbes(threshold=1.0),
        scale=dw.models.InverseGamma(2.0, 1.0),
    ),
    "manoeuvre": dw.tracking.Manoeuvre(),
    "ARX, instruments": dw.ARX(2, (2, 1), (1, 0), offset=True, method="iv"),
    "ARX, delayed instruments": dw.ARX(1, 1, method="iv", instruments="delayed", memory=dw.ExponentialForgetting(0.98)),
    "ARX, normalised gradient": dw.ARX(2, 2, method="nlms", gate=dw.InnovationGate()),
    "ARX, gradient": dw.ARX(2, 2, method="lms", step=0.01, memory=dw.ExponentialForgetting(0.99)),
    "adaptive observer": dw.estimators.AdaptiveObserver(2, [0.5 + 0.2j, 0.5 - 0.2j], 2, offset=True),
    "adaptive observer, weighted": dw.estimators.AdaptiveObserver(
        1, 0.3, 1, memory=dw.ExponentialForgetting(0.98), missing="hold"
    ),
    **{f"joint, {name}": dw.Joint(2, inputs=1, memory=memory) for name, memory in MEMORIES.items()},
    "joint, exponential, the state too": dw.Joint(
        2, inputs=1, memory=dw.ExponentialForgetting(0.95), noise=dw.models.OutputError(), forget_state=True
    ),
    "joint, drift of matrices": dw.Joint(
        1, inputs=1, memory=dw.memory.Drift([[0.9, 0.1], [0.0, 0.99]], [[2e-4, 1e-4], [1e-4, 1e-3]])
    ),
    "joint, auto, output error": dw.Joint(2, inputs=1, memory=dw.AutoMemory(), noise=dw.models.OutputError()),
    "joint, auto, known polynomial": dw.Joint(
        2, inputs=1, memory=dw.AutoMemory(), noise=dw.models.NoisePolynomial([0.1, -0.4], 0.01)
    ),
    "joint, auto, unknown polynomial, gate": dw.Joint(
        1, inputs=1, direct=True, memory=dw.AutoMemory(), noise=dw.models.UnknownPolynomial(), gate=dw.InnovationGate()
    ),
    "joint, auto, offset": dw.Joint(2, inputs=1, memory=dw.AutoMemory(), offset=True),
    "joint, likelihood, two inputs": dw.Joint(1, inputs=2, direct=True, memory=dw.memory.LikelihoodDrift()),
    "joint, until the score jumps": dw.Joint(
        2,
        inputs=1,
        memory=dw.RestartOnChange(
            dw.detect.ScoreCUSUM(jump=0.5, threshold=1.0),
            dw.memory.CovarianceInflation(0.5, only_named=True),
            settle=10,
        ),
    ),
}

OBSERVERS = {
    "window": dw.WindowObserver(
        MOTOR, 0.4, noise_std=0.01, disturbances=(CONSTANT, dw.models.Sinusoid(5.0, [0, 0, 5], 2.0)), dt=0.02,
        hold="foh",
        detector=dw.detect.Parity(),
    ),
    "window, irregular": dw.WindowObserver(MOTOR, 0.5, noise_std=0.02, hold="zoh", dt=0.05, irregular=True),
    "window, two outputs, derived, tolerance": dw.WindowObserver(
        MOTOR._replace(C=[[1, 0, 0], [0, 0, 1]], D=[0, 0.3]), 0.3, noise_std=(0.01, 0.2), disturbances=CONSTANT,
        dt=0.02, hold="zoh", derived={"acceleration": [0, 0, 0.2]}, tolerance=[0.1, 0.1, 2.0],
    ),
    "window, unstable, noise learnt": dw.WindowObserver(
        dw.Plant([[0, 1], [9, 0]]), 0.3, noise_std=None, disturbances=dw.models.Polynomial([0, 1], np.inf), dt=0.02,
        detector=dw.PageHinkley(),
    ),
    "grey box": dw.GreyBox("battery", start=None, memory=dw.AutoMemory()),
    "state space": dw.StateSpace([[1, 1], [0, 1]], [[0.5], [1]], [1, 0], Q=[0, 0.1], R=1.0),
}  # fmt: skip


@pytest.mark.parametrize("name", OBSERVERS)
def test_laws_of_observers(name):
    dw.check_estimator(OBSERVERS[name])


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.__name__)
@pytest.mark.parametrize("name", ESTIMATORS)
def test_law(name, law):
    est = ESTIMATORS[name]
    law(est, *example(est))


@settings(max_examples=60, deadline=None)
@given(
    name=st.sampled_from(sorted(ESTIMATORS)),
    seed=st.integers(0, 2**32 - 1),
    cut=st.integers(0, 40),
    missing=st.sampled_from([0.0, 0.2, 0.9]),
    exponent=st.integers(-20, 20),
)
def test_any_cut_of_any_record_changes_nothing(name, seed, cut, missing, exponent):
    est = ESTIMATORS[name]
    y, u = example(est, samples=40, seed=seed, missing=missing)
    y = np.ldexp(y, exponent)
    whole = est.scan(y, u)
    first = est.scan(y[:cut], None if u is None else u[:cut])
    second = est.scan(y[cut:], None if u is None else u[cut:], state=first.state)
    assert same(second.state, whole.state)
    assert np.all(whole.state["D"] >= 0)
    assert np.isfinite(np.atleast_1d(whole.state).view(float)).all()


HOSTILE = {
    "nothing": lambda y, u: (0 * y, 0 * u),
    "all constant": lambda y, u: (0 * y + 3.0, 0 * u + 1.0),
    "collinear inputs": lambda y, u: (y, 0 * u + u[:, :1]),
    "no input": lambda y, u: (y, 0 * u),
    "tiny": lambda y, u: (1e-150 * y, 1e-150 * u),
    "absurd": lambda y, u: (1e150 * y, 1e150 * u),
    "an outlier below absurd": lambda y, u: (np.where(np.arange(len(y)) == 40, 9e59, y), u),
    "a long gap": lambda y, u: (np.where(abs(np.arange(len(y)) - 45) < 30, np.nan, y), u),
    "all missing": lambda y, u: (y * np.nan, u * np.nan),
    "one sample": lambda y, u: (y[:1], u[:1]),
    "no sample": lambda y, u: (y[:0], u[:0]),
}


@pytest.mark.parametrize("name", ESTIMATORS)
def test_no_record_leaves_anything_silent(name):
    """Finite states, predictions and bars; NaN only where a sample was missing; no variance of zero without EXACT."""
    est = ESTIMATORS[name]
    y, u = example(est, samples=80, missing=0.0)
    for kind, change in HOSTILE.items():
        changed = change(y, np.zeros((80, 0)) if u is None else u)
        trace = est.scan(changed[0], None if u is None else changed[1], keep="covariance")
        status, variance = trace.status, trace.variance
        assert np.isfinite(np.atleast_1d(trace.state).view(float)).all(), kind
        assert np.isfinite(trace.prediction).all() and np.isfinite(variance).all(), kind
        assert np.array_equal(np.isnan(trace.innovation), (status & dw.Status.MISSING_OUTPUT) > 0), kind
        assert np.all((variance > 0) | (status & (dw.Status.EXACT | dw.Status.MISSING_OUTPUT) > 0)), kind
        assert np.isfinite(trace.x).all() and np.isfinite(trace.parameters).all(), kind
        assert not np.isnan(trace.parameters_std).any(), kind
        P = est.covariance(trace.state)
        if np.isfinite(P).all():
            root = np.sqrt(np.diag(P).clip(1e-300))
            assert np.linalg.eigvalsh(P / root / root[:, None]).min() > -1e-8, kind
        summary = trace.summary()
        assert summary.missing_outputs == np.sum((status & dw.Status.MISSING_OUTPUT) > 0), kind
        assert summary.missing_inputs == np.sum((status & dw.Status.MISSING_INPUT) > 0), kind
        assert "nan" not in summary.words, (kind, summary.words)


@pytest.mark.parametrize("name", [name for name in ESTIMATORS if "jumps" in name])
def test_an_event_is_replayed_bit_for_bit(name):
    """From the state before it, one sample makes the same event, evidence and state; the laws see alarms at all."""
    est = ESTIMATORS[name]
    y, u = example(est)
    trace = est.scan(y, u)
    assert len(trace.jumps()) > 1
    for event in trace.jumps():
        at = slice(event.sample, event.sample + 1)
        before = trace.state_before(event.sample)
        again = est.scan(y[at], u[at], state=before)
        assert same(again.table, trace.table[at])
        assert [(e.kind, e.time, e.text) for e in again.jumps()] == [("JUMP", event.time, event.text)]
        state, step = est.update(before, y[event.sample], u[event.sample])
        assert same(state, again.state) and step.status & dw.Status.JUMP
        rest = slice(event.sample + 1, None)
        assert same(est.scan(y[rest], u[rest], state=state).state, trace.state)


@pytest.mark.slow
@pytest.mark.parametrize(
    "est",
    [
        dw.ARMAX(2, 2, 1, memory=dw.AutoMemory()),
        dw.BJ(1, 1, 1, 1, memory=dw.AutoMemory("jumps")),
        dw.ARXMIMO(2, 1, memory=dw.AutoMemory()),
        dw.ARXMIMO(2, 1, memory=dw.memory.MultipleModel()),
    ],
    ids=repr,
)
def test_every_model_takes_a_bank(est):
    dw.check_estimator(est)


@given(st.floats(0.5, 2.0), st.floats(0.5, 2.0))
@settings(max_examples=20, deadline=None)
def test_any_scaling_scales_the_answer(c, g):
    """Not only powers of two: with the prior given in units of the data, to round-off."""
    est = dw.Joint(2, inputs=1, noise=dw.models.EquationError(0.01), P0=np.full(6, 10.0))
    y, u = example(est)
    P0 = 10.0 * np.array([c * c, c * c, 1, 1, (c / g) ** 2, (c / g) ** 2])
    scaled = dw.Joint(2, inputs=1, noise=dw.models.EquationError(0.01 * c * c), P0=P0)
    one, two = est.scan(y, u), scaled.scan(c * y, g * u)
    np.testing.assert_allclose(c * one.prediction, two.prediction, rtol=1e-9, atol=1e-11)


def test_threads_share_a_driver():
    from concurrent.futures import ThreadPoolExecutor

    est = dw.Joint(3, inputs=1)
    records = [example(est, samples=500, seed=s) for s in range(16)]
    alone = [est.scan(*r).state for r in records]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda r: est.scan(*r).state, records))
    assert all(same(a, b) for a, b in zip(alone, together))


@pytest.mark.slow
def test_covariance_stays_non_negative_over_ten_million_samples():
    est = dw.Joint(2, inputs=1, noise=dw.models.OutputError(0.01), memory=dw.RandomWalk(1e-9), P0=1e16)
    state = est.start()
    for k in range(100):
        y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=100_000, noise_std=0.1, missing=0.01, seed=k % 7)
        trace = est.scan(y, u, state=state, keep="innovations")
        state = trace.state
        assert np.all(state["D"] >= 0) and np.isfinite(np.atleast_1d(state).view(float)).all()
        eigenvalues = np.linalg.eigvalsh(est.covariance(state))
    assert eigenvalues[0] >= -1e-14 * eigenvalues[-1]  # round-off of the eigenvalues themselves; D is exact
    assert state["samples"] == 1e7


@pytest.mark.slow
def test_covariance_stays_non_negative_over_a_million_samples():
    est = dw.Joint(2, inputs=1, noise=dw.models.EquationError(0.01), P0=1e16)
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=1_000_000, noise_std=0.1, noise="equation", seed=1)
    state = est.scan(y, u, keep="innovations").state
    assert np.all(state["D"] >= 0)
    eigenvalues = np.linalg.eigvalsh(est.covariance(state))
    assert eigenvalues[0] >= -1e-14 * eigenvalues[-1]  # round-off of the eigenvalues themselves; D is exact


@pytest.mark.parametrize("name", ESTIMATORS | OBSERVERS)
def test_what_lay_in_the_memory_of_a_run_is_not_read(name, monkeypatch):
    est, found = (ESTIMATORS | OBSERVERS)[name], []
    for lies in (0.0, np.nan):
        monkeypatch.setattr(est, "scratch", lambda: np.full(est.scratch_size, lies), raising=False)
        found.append(est.scan(*example(est, samples=40)))
    zeros, nans = found
    assert same(zeros.table, nans.table) and same(zeros.state, nans.state)
