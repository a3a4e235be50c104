"""The configurations whose numbers are taken, by name."""

from __future__ import annotations

import functools

import numpy as np

import driftwise as dw

from .records import (
    alarms,
    algebraic,
    boxed,
    column,
    flown,
    found_out,
    growing,
    halves,
    herd,
    hindsight,
    irregular,
    jumped,
    kept,
    motion,
    named_jump,
    normal,
    observed,
    readings,
    record,
    smoothed,
    tracked,
    ways,
)

MEMORIES = {
    "constant": lambda: dw.Constant(),
    "walk": lambda: dw.RandomWalk(1e-4),
    "walk, matched": lambda: dw.RandomWalk(matched=(0.1, 100)),
    "weighted": lambda: dw.ExponentialForgetting(0.97),
    "limited": lambda: dw.memory.GainFloor(40),
    "variable": lambda: dw.memory.VariableForgetting(50),
    "directional": lambda: dw.memory.DirectionalForgetting(0.95),
    "window": lambda: dw.memory.Window(20),
    "run lengths": lambda: dw.memory.BayesianChangePoint(0.3, 50, 5),
    "drift": lambda: dw.memory.Drift(0.99, nvr=1e-3),
    "until a jump": lambda: dw.RestartOnChange(dw.detect.VarianceCUSUM(threshold=3.0), settle=12),
    "until a jump, gain": lambda: dw.RestartOnChange(
        dw.detect.GLR(threshold=3.0, window=10), dw.memory.GainReset(5), settle=12
    ),
    "until a jump, level": lambda: dw.RestartOnChange(dw.PageHinkley(threshold=3.0), settle=12),
    "until a jump, learnt": lambda: dw.RestartOnChange(dw.detect.SelfStarting(), settle=12),
    "auto": lambda: dw.AutoMemory(),
    "auto, outliers": lambda: dw.AutoMemory("outliers"),
    "auto, jumps": lambda: dw.AutoMemory("jumps", 0.95),
    "bank": lambda: dw.memory.MultipleModel(),
    "interacting": lambda: dw.memory.IMM(),
    "interacting, two": lambda: dw.memory.IMM((0.0, 1e-2), 0.9, 0.0, 0.9),
    "fuzzy": lambda: dw.memory.FuzzyDrift(),
    "fuzzy, published": lambda: dw.memory.FuzzyDrift(geometric=True, as_published=True, phi=0.9),
    "matching": lambda: dw.memory.CovarianceMatching(),
    "matching, gain": lambda: dw.memory.CovarianceMatching("gain"),
    "matching, myers": lambda: dw.memory.CovarianceMatching("myers-tapley"),
    "matching, em": lambda: dw.memory.CovarianceMatching("em"),
    "auxiliary": lambda: dw.memory.AuxiliaryFilter(),
    "autocovariance": lambda: dw.memory.AutocovarianceLS(3),
    "likelihood": lambda: dw.memory.LikelihoodDrift(),
    "likelihood, shared": lambda: dw.memory.LikelihoodDrift(shared=True),
    "variational": lambda: dw.memory.VariationalBayes(),
    "variational, both": lambda: dw.memory.VariationalBayes("both"),
}
FEW = ("walk", "weighted", "window", "until a jump", "auto", "likelihood")  # tried on the kin of ARX, too

Q2 = np.array([[0.3, 0.1], [0.1, 0.2]])
FULL = np.diag([0.2, 0.1, 1e-4, 1e-5, 1e-4, 1e-4])
JOINTS = {
    "default": lambda: ways(dw.Joint(2, 1)),
    "no input": lambda: ways(dw.Joint(3), 0),
    "two inputs, direct": lambda: ways(dw.Joint(1, 2, True), 2),
    "offset": lambda: ways(dw.Joint(2, 1, True, offset=True)),
    "known noise": lambda: ways(dw.Joint(2, 1, True, noise=dw.models.EquationError(0.04))),
    "output error": lambda: ways(dw.Joint(2, 1, noise=dw.models.OutputError())),
    "polynomial": lambda: ways(dw.Joint(2, 1, noise=dw.models.NoisePolynomial((0.1, -0.4), 0.01))),
    "colour unknown": lambda: ways(dw.Joint(2, 1, noise=dw.models.UnknownPolynomial())),
    "colour unknown, els": lambda: ways(
        dw.Joint(1, 2, noise=dw.models.UnknownPolynomial(variance=0.01, method="els")), 2
    ),
    "covariances": lambda: ways(dw.Joint(2, 1, noise=dw.models.NoiseCovariance(Q2, [0.1, 0.05], 0.5))),
    "array": lambda: ways(
        dw.Joint(2, 1, noise=dw.models.NoiseCovariance(FULL, [0.1, 0.02, 1e-3, 0, 0, 0], 0.5), P0=10.0)
    ),
    "walk, gate": lambda: ways(dw.Joint(2, 1, memory=dw.RandomWalk(1e-4), gate=dw.InnovationGate(4.0))),
    "walk, matched": lambda: ways(dw.Joint(2, 1, memory=dw.RandomWalk(matched=(0.1, 100)))),
    "until a jump": lambda: ways(dw.Joint(2, 1, memory=dw.RestartOnChange(settle=10))),
    "until a jump, level": lambda: ways(
        dw.Joint(2, 1, memory=dw.RestartOnChange(dw.PageHinkley(), dw.memory.CovarianceInflation(0.5)))
    ),
    "scale": lambda: ways(
        dw.Joint(2, 1, scale=dw.models.InverseGamma(2.0, 0.1), noise=dw.models.EquationError(1.0), P0=1e3)
    ),
    "algebraic start": lambda: ways(dw.Joint(2, 1, noise=dw.models.OutputError(), start="algebraic")),
    "units": lambda: ways(dw.Joint(2, 1).scaled_to(*record())),
    "prior": lambda: ways(dw.Joint(1, 1, s0=[0.5, 0.3, 0.2], P0=np.eye(3) + 0.2, y_scale=4.0, u_scale=2.0, floor=1e-6)),
    "halves": lambda: halves(dw.Joint(2, 1, memory=dw.RestartOnChange())),
    "kept": lambda: kept(dw.Joint(2, 1, noise=dw.models.UnknownPolynomial())),
    "smooth": lambda: smoothed(dw.Joint(2, 1)),
    "smooth, lag, walk": lambda: smoothed(dw.Joint(2, 1, memory=dw.RandomWalk(1e-4)), lag=5, keep="covariance"),
    "batch": lambda: {"state": dw.Joint(2, 1).batch(*record(missing=0.0))},
    "readings": lambda: readings(dw.Joint(2, 1)),
}


ARX = {
    "gate": lambda: ways(dw.ARX(2, 2, gate=dw.InnovationGate(4.0))),
    "two inputs, delays, offset": lambda: ways(dw.ARX(2, (2, 1), (1, 0), offset=True), 2),
    "known noise": lambda: ways(dw.ARX(1, 1, variance=0.04, gate=dw.InnovationGate(), P0=10.0)),
    "scale": lambda: ways(dw.ARX(2, 2, scale=dw.models.InverseGamma(2.0, 0.1))),
    "at rest": lambda: ways(dw.ARX(2, 2, at_rest=True)),
    "hold": lambda: ways(dw.ARX(2, 2, missing="hold")),
    "skip": lambda: ways(dw.ARX(2, 2, missing="skip", memory=dw.ExponentialForgetting(0.95))),
    "instruments": lambda: ways(dw.ARX(2, (2, 1), (1, 0), offset=True, method="iv"), 2),
    "instruments, delayed": lambda: ways(
        dw.ARX(1, 1, method="iv", instruments="delayed", memory=dw.ExponentialForgetting(0.98))
    ),
    "normalised gradient": lambda: ways(dw.ARX(2, 2, method="nlms", gate=dw.InnovationGate())),
    "gradient": lambda: ways(dw.ARX(2, 2, method="lms", step=0.01, memory=dw.ExponentialForgetting(0.99))),
    "score": lambda: ways(dw.ARX(2, (2, 1), memory=named_jump()), 2),
    "score, any size": lambda: ways(
        dw.ARX(2, (2, 1), memory=dw.RestartOnChange(dw.detect.ScoreCUSUM(threshold=3.0), settle=12)), 2
    ),
    "auto, known noise": lambda: ways(dw.ARX(2, 2, memory=dw.AutoMemory(), variance=0.04, P0=10.0), samples=80),
    "prior": lambda: ways(dw.ARX(1, 1, theta0=[-0.5, 0.3], P0=np.eye(2) + 0.2, y_scale=4.0, u_scale=2.0)),
    "algebraic start": lambda: ways(dw.ARX(2, 2, start="algebraic")),
    "units": lambda: ways(dw.ARX(2, 2).scaled_to(*record())),
    "halves": lambda: halves(dw.ARX(2, 2, memory=dw.ExponentialForgetting(0.98))),
    "halves, auto": lambda: halves(dw.ARX(2, 2, memory=dw.AutoMemory()), samples=80),
    "halves, jumps": lambda: halves(dw.ARX(2, 2, memory=named_jump())),
    "kept": lambda: kept(dw.ARX(2, 2)),
    "smooth": lambda: hindsight(dw.ARX(1, 1)),
    "smooth, average": lambda: hindsight(dw.AR(1), 0, hyper="average"),
    "smooth, given": lambda: hindsight(dw.ARX(2, 2), hyper=1e-3, drift="integrated", jumps=[40], lag=5),
    "readings": lambda: readings(dw.ARX(2, 2)),
}


KIN = {
    "ar": lambda **o: ways(dw.AR(3, **o), 0),
    "regression": lambda **o: ways(dw.Regression(2, offset=True, **o), 2),
    "arma": lambda **o: ways(dw.ARMA(2, 1, **o), 0),
    "armax": lambda **o: ways(dw.ARMAX(2, 2, 2, **o)),
    "oe": lambda **o: ways(dw.OE((1, 2), (1, 2), (0, 2), offset=True, gate=dw.InnovationGate(), **o), 2),
    "bj": lambda **o: ways(dw.BJ((2, 1), 1, 2, (1, 0), **o), 2),
    "arx mimo": lambda **o: ways(dw.ARXMIMO(2, 1, **o), 1, 2),
    "adaptive observer": lambda **o: ways(
        dw.estimators.AdaptiveObserver(2, (0.5 + 0.2j, 0.5 - 0.2j), 2, offset=True, **o), 2
    ),
}

MOTOR = dw.Plant([[0, 1, 0], [0, 0, 0.2], [0, -10, -10]], [0, 0, 10], [1, 0, 0])
PUSH = dw.models.Polynomial([0, 0, 5], np.inf)
WINDOWS = {
    "window/default": lambda: observed(dw.WindowObserver(
        MOTOR, 0.4, noise_std=0.01, disturbances=(PUSH, dw.models.Sinusoid(5.0, [0, 0, 5], 2.0)), dt=0.02, hold="foh",
        detector=dw.detect.Parity())),
    "window/two outputs": lambda: observed(dw.WindowObserver(
        MOTOR._replace(C=[[1, 0, 0], [0, 0, 1]], D=[0, 0.3]), 0.3, noise_std=(0.01, 0.2), dt=0.02, hold="zoh",
        disturbances=PUSH, derived={"acceleration": [0, 0, 0.2]}, tolerance=[0.1, 0.1, 2.0]), 1, 2),
    "window/noise learnt": lambda: observed(dw.WindowObserver(
        dw.Plant([[0, 1], [9, 0]]), 0.3, noise_std=None, disturbances=dw.models.Polynomial([0, 1], np.inf),
        dt=0.02, detector=dw.PageHinkley()), 0),
    "window/halves": lambda: halves(dw.WindowObserver(
        dw.Plant([[0, 1], [0, -1]], [0, 1]), 20.0, noise_std=0.5, dt=1.0, hold="zoh")),
    "window/irregular": lambda: observed(dw.WindowObserver(
        dw.Plant([[0, 1], [0, 0]]), 8.0, noise_std=0.05, disturbances=dw.models.Polynomial([0, 1], 1.0), dt=1.0,
        irregular=True, capacity=12), 0, time=motion()[0]),
    "window/growing": lambda: observed(growing(), 0),
    "window/algebraic": lambda: observed(dw.AlgebraicObserver(
        dw.Plant([[0, 1], [-1, 0]]), into=[0, 1], dt=0.1, noise_std=0.05, tolerance=0.02), 0),
    "window/algebraic, equation": lambda: observed(dw.AlgebraicObserver.of_equation(
        [0, 2, 10, 1], [2], dt=0.05, hold="foh", frequencies=[5])),
}  # fmt: skip
SPRING = [[1.0, 0.1], [-0.3, 0.9]], [[0.0], [1.0]], [1.0, 0.0]  # F, G, H
OTHERS = {
    "state space/default": lambda: ways(dw.StateSpace(*SPRING, Q=[0, 0.1], R=0.04)),
    "state space/no input, two outputs": lambda: ways(dw.StateSpace(SPRING[0], H=np.eye(2), Q=0.1, R=Q2), 0, 2),
    "state space/gate, detector": lambda: ways(
        dw.StateSpace(*SPRING, Q=[0, 0.1], R=0.04, gate=dw.InnovationGate(4.0), detector=dw.PageHinkley())
    ),
    "state space/scale, forgetting": lambda: ways(
        dw.StateSpace(
            *SPRING, Q=[0, 2.0], R=1.0, scale=dw.models.InverseGamma(2.0, 0.1), memory=dw.ExponentialForgetting(0.98)
        )
    ),
    "state space/noise learnt": lambda: ways(
        dw.StateSpace(*SPRING, Q=[0, 0.1], R=0.04, memory=dw.memory.LikelihoodDrift())
    ),
    "state space/continuous": lambda: ways(
        dw.StateSpace([[0.0, 1.0], [-1.0, -0.2]], [[0.0], [1.0]], [1.0, 0.0], Q=[0, 0.1], R=0.04, continuous=True),
        time=motion()[0],
    ),
    "state space/halves": lambda: halves(dw.StateSpace(*SPRING, Q=[0, 0.1], R=0.04)),
    "armax/plr": lambda: ways(dw.ARMAX(2, (2, 1), 1, (1, 0), method="plr", offset=True), 2),
    "armax/skip": lambda: ways(dw.ARMAX(1, 1, 1, missing="skip")),
    "armax/halves": lambda: halves(dw.ARMAX(2, 2, 2)),
    "bj/hold": lambda: ways(dw.BJ(1, 1, 1, 1, missing="hold")),
    "regression/disturbance": lambda: ways(
        dw.Regression(2, disturbance=dw.models.Disturbance(0.8), memory=dw.memory.Drift(nvr=(1e-3, 1e-4))), 2
    ),
    "regression/smooth": lambda: hindsight(dw.Regression(1), drift="walk"),
    "mimo/split": lambda: ways(dw.JointMIMO((2, 1), 1), 1, 2),
    "mimo/whole": lambda: ways(dw.JointMIMO((2, 1), 1, split=False), 1, 2),
    "mimo/one output": lambda: {"table": (t := dw.JointMIMO((2,), 1).scan(*column())).table, "state": t.state},
    "mimo/direct, known noise": lambda: ways(dw.JointMIMO((1, 2), 2, True, noise=dw.models.EquationError(0.04)), 2, 2),
    "mimo/walk, gate": lambda: ways(
        dw.JointMIMO((1, 1), 1, memory=dw.RandomWalk(1e-4), gate=dw.InnovationGate()), 1, 2
    ),
    "mimo/until a jump": lambda: ways(dw.JointMIMO((1, 1), 1, memory=dw.RestartOnChange(settle=12)), 1, 2),
    "mimo/covariances": lambda: ways(
        dw.JointMIMO((1, 1), 1, noise=dw.models.NoiseCovariance(Q2, 0.1 * np.eye(2), np.eye(2))), 1, 2
    ),
    "mimo/scale, prior": lambda: ways(dw.JointMIMO((1, 1), 1, scale=dw.models.InverseGamma(2.0, 0.1), P0=10.0), 1, 2),
    "mimo/halves": lambda: halves(dw.JointMIMO((2, 1), 1), 1, 2),
    "mimo/auto": lambda: ways(dw.JointMIMO((1, 1), 1, memory=dw.AutoMemory()), 1, 2),
    "mimo/exponential, coupled": lambda: ways(
        dw.JointMIMO((1, 1), 1, memory=dw.ExponentialForgetting(0.97), split=False), 1, 2
    ),
    "joint/exponential": lambda: ways(dw.Joint(2, 1, memory=dw.ExponentialForgetting(0.97))),
    "joint/likelihood": lambda: ways(dw.Joint(2, 1, memory=dw.memory.LikelihoodDrift())),
    "joint/window": lambda: ways(dw.Joint(2, 1, memory=dw.memory.Window(20))),
    "joint/auto": lambda: ways(dw.Joint(2, 1, memory=dw.AutoMemory())),
    "joint/auto, output error": lambda: ways(dw.Joint(2, 1, noise=dw.models.OutputError(), memory=dw.AutoMemory())),
    "mimo/kept": lambda: kept(dw.JointMIMO((1, 1), 1), 1, 2),
    "mimo/readings": lambda: readings(dw.JointMIMO((1, 1), 1), 1, 2),
    "arx mimo/orders": lambda: ways(
        dw.ARXMIMO(2, 1, [[2, 2], [1, 1]], [2, 1], gate=dw.InnovationGate(), offset=True), 1, 2
    ),
    "arx mimo/known noise, hold": lambda: ways(
        dw.ARXMIMO(2, 1, 1, 1, 0, variance=(0.04, 0.1), missing="hold", P0=10.0), 1, 2
    ),
    "arx mimo/halves": lambda: halves(dw.ARXMIMO(2, 1, 1, 1, memory=dw.ExponentialForgetting(0.98)), 1, 2),
    "arx mimo/readings": lambda: readings(dw.ARXMIMO(2, 1), 1, 2),
    "continuous/default": lambda: ways(dw.ContinuousJoint(2, 1)),
    "continuous/instants": lambda: irregular(dw.ContinuousJoint(2, 1, observer=0.5)),
    "continuous/walk, gate": lambda: irregular(
        dw.ContinuousJoint(2, 1, memory=dw.RandomWalk(1e-4), gate=dw.InnovationGate())
    ),
    "continuous/until a jump": lambda: irregular(dw.ContinuousJoint(1, 1, memory=dw.RestartOnChange(settle=12))),
    "continuous/known noise": lambda: irregular(dw.ContinuousJoint(2, 1, noise=dw.models.EquationError(0.01))),
    "continuous/halves": lambda: halves(dw.ContinuousJoint(2, 1)),
    "continuous/auto": lambda: irregular(dw.ContinuousJoint(2, 1, memory=dw.AutoMemory())),
    "grey box/default": lambda: boxed(),
    "grey box/auto, gate": lambda: boxed(memory=dw.AutoMemory(), gate=dw.InnovationGate()),
    "grey box/walk": lambda: boxed(memory=dw.RandomWalk(1e-5)),
    "grey box/exact gradient": lambda: boxed(method="rpem"),
    "grey box/bends": lambda: boxed("tank", noise=0.01),
    "gain/default": lambda: ways(dw.AdaptiveGain(0.9), 0),
    "gain/plr, pull": lambda: ways(
        dw.AdaptiveGain(
            0.9, method="plr", memory=dw.ExponentialForgetting(0.98), detector=dw.detect.PullTest(threshold=2.0)
        ),
        0,
    ),
    "gain/two states, probes": lambda: ways(
        dw.AdaptiveGain(
            [[1.0, 1.0], [0.0, 1.0]],
            B=[0.5, 1.0],
            detector=dw.detect.GainProbes(threshold=1.0),
            scale=dw.models.InverseGamma(2.0, 1.0),
        ),
    ),
    "gain/walk": lambda: ways(dw.AdaptiveGain(0.9, memory=dw.RandomWalk(1e-4), scale_samples=30), 0),
    "gain/variable": lambda: ways(dw.AdaptiveGain(0.9, memory=dw.memory.VariableForgetting(50)), 0),
    "gain/drift": lambda: ways(dw.AdaptiveGain(0.9, memory=dw.memory.Drift(nvr=1e-3)), 0),
    "gain/window": lambda: ways(dw.AdaptiveGain(0.9, memory=dw.memory.Window(20)), 0),
    "gain/run lengths": lambda: ways(dw.AdaptiveGain(0.9, memory=dw.memory.BayesianChangePoint(0.2, 50, 5)), 0),
    "gain/likelihood": lambda: ways(dw.AdaptiveGain(0.9, memory=dw.memory.LikelihoodDrift()), 0),
    "gain/auto": lambda: ways(dw.AdaptiveGain([[1.0, 1.0], [0.0, 1.0]], memory=dw.AutoMemory()), 0),
    "gain/halves": lambda: halves(dw.AdaptiveGain(0.9), 0),
    "manoeuvre/default": lambda: ways(dw.tracking.Manoeuvre(), 0),
    "manoeuvre/units, gate": lambda: ways(
        dw.tracking.Manoeuvre(gate=dw.InnovationGate(), dt=4.0).scaled_to(record(0)[0]), 0
    ),
    "manoeuvre/halves": lambda: halves(dw.tracking.Manoeuvre(), 0),
    "average/default": lambda: ways(
        dw.ModelAverage([dw.ARX(1, 1), dw.ARX(2, 2), dw.ARX(2, 2, memory=dw.ExponentialForgetting(0.98))]), samples=100
    ),
    "average/halves": lambda: halves(dw.ModelAverage([dw.ARX(1, 1), dw.ARX(2, 2)]), samples=100),
    "average/joint": lambda: ways(dw.ModelAverage([dw.Joint(1, 1), dw.AR(1)], names=["a", "b"]), samples=100),
    "average/sensor": lambda: ways(dw.estimators.sensor_calibration(["sensor"]), samples=40),
    "track/estimator": lambda: tracked(dw.TrackEstimator("aircraft")),
    "track/boat": lambda: tracked(dw.TrackEstimator("boat", noise=5.0), np.diag([25.0, 100.0])),
    "track/one coordinate": lambda: tracked(dw.TrackEstimator(20.0, coordinates=1)),
    "track/tracks": flown,
    "track/tracks, single, delay": lambda: flown("boat", single=True, delay=9.0),
    "fleet/arx": lambda: herd(dw.ARX(2, 2)),
    "fleet/ar, weighted": lambda: herd(dw.AR(2, memory=dw.ExponentialForgetting(0.98)), inputs=0),
    "fleet/joint": lambda: herd(dw.Joint(2, 1, memory=dw.RestartOnChange(settle=10))),
    "fleet/mimo": lambda: herd(dw.JointMIMO((1, 1), 1), outputs=2),
    "fleet/arx mimo": lambda: herd(dw.ARXMIMO(2, 1, 1, 1), outputs=2),
    "fleet/armax": lambda: herd(dw.ARMAX(1, 1, 1)),
    "detector/level": lambda: alarms(dw.PageHinkley("1 per 1000")),
    "detector/level, growing": lambda: alarms(dw.PageHinkley(jump=(1.0, 2.0), threshold=5.0, growing=True)),
    "detector/variance": lambda: alarms(
        dw.detect.VarianceCUSUM(false_alarms="1 per 1000", threshold=None, sides="both")
    ),
    "detector/likelihood": lambda: alarms(dw.detect.GLR("1 per 1000", 50)),
    "detector/score": lambda: alarms(dw.detect.ScoreCUSUM("1 per 1000", jump=0.5), 2),
    "detector/score, any size": lambda: alarms(dw.detect.ScoreCUSUM("1 per 1000"), 2),
    "detector/self-starting": lambda: alarms(dw.detect.SelfStarting("1 per 1000")),
    "detector/self-starting, learnt": lambda: alarms(dw.detect.SelfStarting("1 per 1000", noise="learnt")),
}
ANALYSIS = {
    "algebraic identification": algebraic,
    "simulate": lambda: [
        *dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=50, noise_std=0.1, d=[0.5, 0.1], missing=0.1, seed=1),
        *dw.models.simulate_mimo((1, 1), [-0.5, 0.1, 1.0, -0.2, 0.0, 2.0], samples=50, inputs=1, noise_std=0.1, seed=1),
        *dw.models.simulate_continuous([0.8, 4.0], [0.0, 3.0], time=motion()[0], noise_std=0.1, seed=1),
    ],
    "noise polynomials": lambda: [*dw.models.spectral_factor([1.25, 0.5]), *dw.models.minimum_phase([2.0, 0.1])],
    "ellipse": lambda: list(dw.models.confidence_ellipse([[4.0, 1.0], [1.0, 1.0]])),
    "wrong noise": lambda: [(found := dw.models.asymptotic_bias([-0.8], [0.5], [0.0])).a, found.prediction_variance],
    "singer": lambda: [(model := dw.models.Singer(0.1, 1.0, 1.0)).Q, model.canonical(100.0).d],
    "least variance": lambda: dw.models.cramer_rao([-0.24, 1.18, -1.9], [-0.056, 0.5, -1.3], samples=1000).a_std,
    "run length": lambda: [dw.detect.run_length(5.0, 0.5), dw.detect.threshold_for("1 per 1_000", 0.5)],
    "restart": lambda: [(found := dw.detect.design_restart(1.0, 500)).threshold, found.restart],
    "score test": lambda: dw.detect.score_test(normal(100, 3), normal(100), variance=1.0).scores,
    "probes": lambda: [
        (found := dw.detect.probe_bank(normal(300), normal(300, 4), threshold=8.0)).samples,
        found.statistic,
    ],
    "whiteness": lambda: [*dw.results.ljung_box(normal(300)), *dw.results.nis(normal(300), 1.1)],
    "orders": lambda: dw.analysis.choose_order(*record(missing=0.02), range(1, 4)).probability,
    "structures": lambda: dw.analysis.choose_structure(*record(1, 2, 100, missing=0.0), largest=2).log_evidence,
    "tune": lambda: readings(dw.ARX(1, 1).tune(*record(samples=80, missing=0.02))),
    "tune a window": lambda: growing().tune(motion()[1]).tuned.walk,
    "forecast": lambda: [list(dw.ARX(2, 2).scan(*record()).predict(normal(9))), jumped()],
    "frequency": lambda: (
        dw.analysis.find_frequency(
            dw.Plant([[0.0]]), motion()[1], dt=1.0, noise_std=0.1, band=(0.1, 1.0), outputs=1.0
        ).statistics
    ),
    "found out": found_out,
}


NUMBERS = {
    **{f"joint/{name}": case for name, case in JOINTS.items()},
    **{f"arx/{name}": functools.partial(lambda m: ways(dw.ARX(2, 2, memory=m())), m) for name, m in MEMORIES.items()},
    **{f"arx/{name}": case for name, case in ARX.items()},
    **{f"{kin}/default": case for kin, case in KIN.items()},
    **{
        f"{kin}/{name}": functools.partial(lambda case, m: case(memory=m()), case, MEMORIES[name])
        for kin, case in KIN.items()
        for name in FEW
    },
    **WINDOWS,
    **OTHERS,
    **{f"analysis/{name}": case for name, case in ANALYSIS.items()},
}
