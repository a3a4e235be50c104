"""Hash the numbers of every model and memory, and keep the words of reports: proof that a change moved none of them.

    python scripts/fingerprint.py --out before.json        # on the tree before
    python scripts/fingerprint.py --against before.json    # on the tree after: prints what moved, exit code 1 if any

Numbers are the float64 bytes of states, traces and columns (NaN is one NaN, the sign of zero counts); a configuration
is a line of `NUMBERS` or `WORDS` below. Loops run uncompiled, unless ``--compiled``: no waiting. The numbers are then
the same but for the last bits of exp and log: compare like with like, on one machine. Words are compared after `NAMES`:
a class may be renamed, what is said of it may not change by accident.
"""

from __future__ import annotations

import argparse
import contextlib
import difflib
import fnmatch
import functools
import hashlib
import html
import io
import json
import os
import re
import runpy
import sys
import tempfile
import time
import warnings
from pathlib import Path
from typing import Any

os.environ |= {"OPENBLAS_NUM_THREADS": "1", "COLUMNS": "110", "NO_COLOR": "1", "TERM": "dumb", "TZ": "UTC"}
time.perf_counter = lambda: 0.0  # reports say how long they took

import numpy as np  # noqa: E402

import driftwise as dw  # noqa: E402

SAMPLES = 200


def run_uncompiled() -> None:
    """Let every loop that is asked for be the Python function that would have been compiled."""
    os.environ["DRIFTWISE_ENGINE"] = "python"


# --- records ---------------------------------------------------------------------------------------------------


@functools.cache
def record(inputs=1, outputs=1, samples=SAMPLES, missing=0.08, wild=True):
    """Return y (T,) or (T, p) and u (T,) or (T, k): a plant whose gain jumps half-way, gaps in both, two outliers."""
    rng = np.random.default_rng(19)
    p, k = outputs, max(inputs, 1)
    A, B = np.full((p, p), -0.1) + 0.8 * np.eye(p), 1.0 + rng.random((p, k))
    y, u, e = np.zeros((samples, p)), rng.standard_normal((samples, k)), 0.2 * rng.standard_normal((samples, p))
    for t in range(2, samples):
        y[t] = A @ y[t - 1] - 0.3 * y[t - 2] + (B if t < samples // 2 else 0.5 * B) @ u[t - 1] + e[t] + 0.4 * e[t - 1]
    if wild:
        y[samples // 4], y[samples // 3] = 30.0, -25.0
    y[rng.random(y.shape) < missing], u[rng.random(u.shape) < missing / 4] = np.nan, np.nan
    return y[:, 0] if p == 1 else y, None if inputs == 0 else u[:, 0] if k == 1 else u


@functools.cache
def motion(samples=SAMPLES, missing=0.05):
    """Return instants that are no clock's, a position that swings, and the force on it."""
    rng = np.random.default_rng(7)
    at = np.cumsum(rng.uniform(0.5, 1.5, samples))
    y = 3 * np.sin(0.3 * at) + 0.05 * rng.standard_normal(samples)
    y[rng.random(samples) < missing] = np.nan
    return at, y, np.sign(np.sin(0.1 * at))


def plots(samples=40, objects=2):
    """Return the columns of a table of plots: objects that turn, one without an address, one plot that is wild."""
    rng, k, rows = np.random.default_rng(3), np.arange(samples), []
    for i in range(objects + 1):
        course = i + np.cumsum(np.where((k > 15) & (k < 31), np.radians(1.5) * 4, 0.0))
        path = np.cumsum(600 * np.stack([np.sin(course), np.cos(course)], axis=1), axis=0) + 9000 * i
        path = path + 20 * rng.standard_normal((samples, 2))
        rows += [(1.7e9 + 0.3 * i + 4 * j, *path[j], f"AB000{i}" if i < objects else "") for j in k]
    rows[20] = (rows[20][0], 9e5, 9e5, "AB0000")
    return dict(zip(("time", "east", "north", "icao24"), map(list, zip(*sorted(rows)))))


# --- what is done with an estimator ----------------------------------------------------------------------------


def seen(trace) -> dict[str, Any]:
    """Return the numbers of a trace."""
    return {"state": trace.state, "table": trace.table, "columns": list(trace.columns().values())}


def ways(est, inputs=1, outputs=1, samples=SAMPLES, few=6, **options) -> dict[str, Any]:
    """Return the numbers of an estimator along a record, a few more samples one by one, and two series at once."""
    y, u = record(inputs, outputs, samples)
    found = seen(trace := est.scan(y, u, **options))
    state, steps = trace.state, []
    for t in range(few):
        state, step = est.update(state, y[t], None if u is None else u[t])
        steps.append(step)
    two = [np.stack([c[:few], c[few : 2 * few]]) for c in (y, u) if c is not None]
    return found | {"stream": [state, steps], "fleet": list(est.update_batch(est.start(2), *two))}


def halves(est, inputs=1, outputs=1, samples=SAMPLES):
    """Return the numbers of the second half of a record, gone on with from a file."""
    (y, u), cut = record(inputs, outputs, samples), samples // 2
    first = est.scan(y[:cut], None if u is None else u[:cut])
    dw.save_state(est, first.state, "state.json")
    est, state = dw.load_state("state.json")
    return seen(est.scan(y[cut:], None if u is None else u[cut:], state=state))


def kept(est, inputs=1, outputs=1):
    """Return the numbers of a trace with covariances, and again from its file."""
    trace = est.scan(*record(inputs, outputs), keep="covariance")
    trace.save("trace.npz")
    again = type(trace).load("trace.npz")
    return seen(trace) | {"again": seen(again), "P": [trace.covariance, est.covariance(trace.state)]}


def boxed(plant="battery", noise=1e-3, **options):
    """Return the numbers of a plant in formulas: a record, samples one by one, two series, and the other half."""
    est = dw.GreyBox(plant, start=None, **options)
    _, _, u = motion()
    y = est.simulate(0.02 + 0.01 * u, noise=noise, seed=3)
    found, half = seen(trace := est.scan(y, u, time=np.cumsum(0.5 + abs(u)))), len(y) // 2
    state, step = est.update(trace.state, y[0], u[0])
    two = [np.stack([c[:30], c[30:60]]) for c in (y, u)]
    rest = est.scan(y[half:], u[half:], state=est.scan(y[:half], u[:half]).state)
    return found | {"stream": [state, step], "fleet": list(est.update_batch(est.start(2), *two)), "rest": seen(rest)}


def observed(est, inputs=1, outputs=1, **options):
    """Return the numbers of an observer of a known plant."""
    _, y, u = motion()
    y = y if outputs == 1 else np.stack([y] * outputs, axis=1)
    u = u if inputs else None
    found = seen(trace := est.scan(y, u, **options))
    if options:
        return found
    state, step = est.update(trace.state, y[0], None if u is None else u[0])
    two = [np.stack([c[:30], c[30:60]]) for c in (y, u) if c is not None]
    return found | {"stream": [state, step], "fleet": list(est.update_batch(est.start(2), *two))}


def herd(est, series=5, inputs=1, outputs=1, samples=40):
    """Return the numbers of a fleet: a long table in any order, then one sample of some of its series."""
    y, u = record(inputs, outputs, series * samples)
    keys = np.random.default_rng(5).permutation(np.repeat(np.arange(series), samples))
    fleet = dw.Fleet(est, threads=1)
    step = fleet.scan(keys, y, u)
    some = fleet.update_batch([3, 1], y[:2], None if u is None else u[:2])
    fleet.save("fleet.parquet")
    return {"states": fleet.states, "steps": [step, some], "again": dw.Fleet.load("fleet.parquet").states}


def alarms(detector, slopes=0):
    """Return what a detector says of a shift, and one sample at a time."""
    rng = np.random.default_rng(11)
    z, c = rng.standard_normal(3 * SAMPLES), rng.standard_normal((3 * SAMPLES, slopes))
    z[150:], z[50] = z[150:] * 1.5 + 1.0, np.nan
    found = detector.scan(z, c) if slopes else detector.scan(z)
    monitor = dw.detect.Monitor(detector, parameters=slopes) if slopes else dw.detect.Monitor(detector)
    state, signs = monitor.start(), []
    for t in range(100, 170):
        state, sign = monitor.update(state, z[t], *([c[t]] if slopes else []))
        signs.append(sign)
    return {
        "alarms": [found.samples, found.changes, found.directions, found.which, found.statistic, found.state],
        "monitor": [state, signs],
    }


def smoothed(est, **options):
    """Return a smoothed record of the joint filter."""
    found = est.smooth(*record(samples=60), **options)
    return {"state": found.state, "table": found.table, "bars": [found.x_std, found.parameters_std]}


def hindsight(est, inputs=1, **options):
    """Return parameters in hindsight."""
    found = est.smooth(*record(inputs, samples=80, missing=0.05), **options)
    return {"columns": list(found.columns().values()), "found": [found.nvr, found.q, found.sigma2, found.loglik]}


def readings(est, inputs=1, outputs=1):
    """Return what else a state can be asked."""
    y, u = record(inputs, outputs)
    trace = est.scan(y, u)
    return {
        "state": [
            est.loglik(trace.state),
            est.sigma2(trace.state),
            est.covariance(trace.state),
            est.mean(trace.state),
            est.information_ratio(trace.state),
            est.prior_covariance,
        ],
        "model": [trace.model().poles],
        "band": trace.band(0.9),
    }


def irregular(est):
    """Return the numbers of a continuous filter at instants that are no clock's."""
    at, y, u = motion()
    found = seen(trace := est.scan(y[:-1], u[:-1], time=at[:-1]))
    return found | {"stream": list(est.update(trace.state, y[-1], u[-1], time=float(at[-1])))}


def tracked(est, covariance=None):
    """Return the numbers of one object's track: a record of it, and its last plots one by one."""
    at, C = 4.0 * np.arange(36), est.coordinates
    turn = np.clip(at - 60, 0, 60) * np.radians(3)
    path = np.cumsum(600 * np.stack([np.sin(turn), np.cos(turn)], axis=1), axis=0)
    place = (path + 50 * np.random.default_rng(1).standard_normal(path.shape))[:, :C]
    place[7] = np.nan
    R = None if covariance is None else np.broadcast_to(covariance, (36, C, C))
    found, steps = seen(trace := est.scan(at[:32], place[:32], None if R is None else R[:32])), []
    state = trace.state
    for t in range(32, 36):
        state, step = est.update(state, at[t], place[t], None if R is None else R[t])
        steps.append(step)
    return found | {"stream": [state, steps], "ahead": list(est.predict(state, at[-1] + 10))}


def flown(*args, **options):
    """Return the numbers of all tracks in a table of plots."""
    tracks = dw.track(plots(24), *args, **options)
    return {"tracks": [[t.state, t.trace.table, t.plots.position] for t in tracks]}


def named_jump():
    """Return the memory that frees only the parameter that jumped."""
    return dw.RestartOnChange(
        dw.detect.ScoreCUSUM(jump=0.5, threshold=2.0), dw.memory.CovarianceInflation(0.5, only_named=True), settle=12
    )


def column():
    """Return a record whose outputs are a table of one column."""
    y, u = record()
    return y[:, None], u


def growing():
    """Return the observer of a tank with a leak, by all samples so far."""
    leak = dw.models.Polynomial([1.0], np.inf)
    return dw.WindowObserver(dw.Plant([[-1.0]]), np.inf, noise_std=0.05, disturbances=leak, dt=0.1)


def normal(*shape):
    """Return Gaussian numbers."""
    return np.random.default_rng(2).standard_normal(shape)


def jumped():
    """Return what the score test says of the first jump of a record."""
    trace = dw.ARX(2, 2, memory=dw.RestartOnChange()).scan(*record())
    found = trace.what_changed(trace.jumps()[0])
    return [found.statistic, found.scores, trace.state_before(50)]


def found_out():
    """Return the numbers of what is found out about a record without a word about it."""
    y, u = record(samples=120, missing=0.02)
    found = dw.identify({"heater": u, "temperature": y})
    return {"trace": seen(found.trace), "forecast": seen(found.forecast)}


def algebraic():
    """Return the numbers of an algebraic identification."""
    t = 0.02 * np.arange(151)
    y, u = dw.models.simulate_continuous(
        [0.8, 4.0], [0.0, 3.0], time=t, u=1 - 2.0 * (t // 1 % 2), noise_std=0.01, seed=1
    )
    found = dw.estimators.algebraic_identification(y, u, order=2, zeros=0, dt=0.02, hold="zoh", disturbance=0)
    return [found.values, found.covariance]


# --- numbers ---------------------------------------------------------------------------------------------------

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

# --- words -----------------------------------------------------------------------------------------------------


def csv(name, columns) -> str:
    """Write a table and return its name."""
    cells = ("" if isinstance(v, float) and np.isnan(v) else str(v) for row in zip(*columns.values()) for v in row)
    rows = zip(*[cells] * len(columns))
    Path(name).write_text("\n".join([",".join(columns), *map(",".join, rows)]) + "\n")
    return name


def plant(samples=SAMPLES, wild=False) -> str:
    """Write a record as a table with a clock and return its name."""
    y, u = record(samples=samples, wild=wild)
    return csv("plant.csv", {"t": (0.5 * np.arange(samples)).tolist(), "u": u.tolist(), "y": y.tolist()})


def said(*arguments) -> str:
    """Return what the command line prints for these arguments, and its pages and results, as text."""
    out, before, code = io.StringIO(), sys.argv, 0
    sys.argv = ["driftwise", *map(str, arguments)]
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
            runpy.run_module("driftwise", run_name="__main__")
    except SystemExit as done:
        code = done.code
    finally:
        sys.argv = before
    pages = [bare(path.read_text()) for path in sorted(Path().rglob("*.html"))]
    return "\n".join(
        [f"exit code {code or 0}", out.getvalue(), *pages, *map(Path.read_text, Path().glob("found.json"))]
    )


def bare(page: str) -> str:
    """Return the text of a page without tags, scripts and drawings."""
    page = re.sub(r"<(script|style|svg)\b.*?</\1>", " ", page, flags=re.DOTALL)
    return html.unescape(re.sub(r"<[^>]*>", "\n", page))


def told(est, inputs=1, outputs=1, samples=SAMPLES, wild=False) -> str:
    """Return summary, verdicts and events of a run."""
    trace = est.scan(*record(inputs, outputs, samples, wild=wild))
    events = [f"{event.kind} at {event.sample}: {event.text}" for event in trace.events()]
    return "\n".join([repr(est), trace.summary().words, repr(trace.diagnose()), *events])


def refusals() -> str:
    """Return what is said of settings that cannot be."""
    cases = [
        lambda: dw.ARX(2, 2, memory=dw.ExponentialForgetting),
        lambda: dw.ARX(2, 2, memory=dw.ExponentialForgetting(1.5)),
        lambda: dw.Joint(2, memory=dw.memory.Window(20)),
        lambda: dw.JointMIMO((1, 1), memory=dw.AutoMemory()),
        lambda: dw.ContinuousJoint(1, memory=dw.ExponentialForgetting(0.9)),
        lambda: dw.AdaptiveGain(1.0, memory=dw.memory.FuzzyDrift()),
        lambda: dw.ARX(2, 2, gate=dw.InnovationGate(-1.0)),
        lambda: dw.ARX(2, 2, memory=dw.RestartOnChange(dw.PageHinkley)),
        lambda: dw.ARX(2, 2, memory=dw.RandomWalk()),
        lambda: dw.ARX(2, 2, scale=3.0),
        lambda: dw.ARX(2, 2, method="ml"),
        lambda: dw.Joint(2, noise=dw.models.NoisePolynomial((2.0, 0.0))),
        lambda: dw.Joint(0),
        lambda: dw.ARX(2, 2).scan([1.0]),
        lambda: dw.Joint(2, 1).scan([1.0, 2.0], [1.0]),
        lambda: dw.ARX(2, 2, memory=dw.memory.MultipleModel((0.1,), 2.0)),
        lambda: dw.OE().smooth([1.0], [1.0]),
        lambda: dw.AR(1).update(dw.AR(2).start(), 1.0),
    ]
    found = []
    for case in cases:
        try:
            case()
            found.append("taken")
        except dw.InputError as error:
            found.append(str(error))
    return "\n".join(found)


CART = """[plant]
states = ["position", "speed"]
A = [[0, 1], [0, 0]]
B = [0, 1]
[[disturbance]]
name = "push"
into = [0, 1]
prior_std = inf
[observer]
window = 20
noise_std = 0.05
hold = "zoh"
"""


def cart() -> str:
    """Return what is said of a cart whose equations are known."""
    Path("cart.toml").write_text(CART)
    _, y, u = motion()
    csv("cart.csv", {"t": (0.5 * np.arange(len(y))).tolist(), "pos": y.tolist(), "force": u.tolist()})
    return said("run", "cart.csv", "-o", "pos", "-i", "force", "-t", "t", "--plant", "cart.toml", *PAGES)


def pumps() -> str:
    """Return what is said of a fleet of pumps."""
    said("fleet", "simulate", "pumps", "--series", 20, "--samples", 50)
    columns = ("--by", "asset", "-o", "flow", "-i", "speed", "-t", "time")
    return said(
        "fleet", "run", "pumps", *columns, "--model", "joint:1", "--every", 0, "--out", "out", "--json", "found.json"
    )


PAGES = ("--report", "page.html", "--json", "found.json")
YU = ("-o", "y", "-i", "u", "-t", "t")
WORDS = {
    "run, joint": lambda: said("run", plant(), *YU, *PAGES),
    "run, arx, auto": lambda: said("run", plant(120), *YU, "--model", "arx:2,2,1", *PAGES),
    "run, arx, jumps": lambda: said("run", plant(), *YU, "--model", "arx:2,2", "--jumps", "parameters:1000", *PAGES),
    "run, found out": lambda: said("run", plant(120), *PAGES),
    "run, orders": lambda: said("run", plant(), *YU, "--order", "auto", "--orders", "1-3"),
    "run, plant known": cart,
    "run, smooth": lambda: said("run", plant(80), *YU, "--model", "arx:1,1", "--smooth", "all", *PAGES),
    "compare": lambda: said("compare", plant(), "arx:1,1", "arx:2,2", "ar:2", *YU, *PAGES),
    "track": lambda: said("track", csv("plots.csv", plots(24)), *PAGES),
    "fleet": pumps,
    "wrong commands": lambda: "".join(
        said("run", plant(), "-o", "y", *wrong) for wrong in (["-i", "v"], ["--noise", "pink"], ["--memory", "walk"])
    ),
    "help": lambda: "".join(said(*command, "--help") for command in ([], ["run"], ["fleet", "run"], ["track"])),
    "refusals": refusals,
    "joint": lambda: told(dw.Joint(2, 1)),
    "joint, jumps": lambda: told(dw.Joint(2, 1, memory=dw.RestartOnChange(), gate=dw.InnovationGate()), wild=True),
    "arx": lambda: told(dw.ARX(2, 2)),
    "arx, auto": lambda: told(dw.ARX(2, 2, memory=dw.AutoMemory()), samples=120),
    "arx, score": lambda: told(dw.ARX(2, 2, memory=named_jump())),
    "armax": lambda: told(dw.ARMAX(1, 1, 1, memory=dw.RandomWalk(1e-4))),
    "mimo": lambda: told(dw.JointMIMO((1, 1), 1), 1, 2),
    "arx mimo": lambda: told(dw.ARXMIMO(2, 1, memory=dw.ExponentialForgetting(0.97)), 1, 2),
    "gain": lambda: told(dw.AdaptiveGain(0.9), 0),
    "manoeuvre": lambda: told(dw.tracking.Manoeuvre(), 0),
    "compared": lambda: dw.compare(*record(wild=False), {"first": dw.ARX(1, 1), "none": dw.AR(2)}).words,
    "advised": lambda: repr(
        dw.analysis.advise_window(
            dw.Plant([[0, 1], [0, 0]], [0, 1], states=("position", "speed")),
            dt=0.1,
            noise_std=0.1,
            disturbances=dw.models.Polynomial([0, 1], np.inf),
            windows=[0.5, 1, 2],
            tolerance=[0.1, 0.1],
        )
    ),
    "restart": lambda: dw.detect.design_restart(1.0, 500).words,
    "hindsight": lambda: dw.ARX(1, 1).smooth(*record(samples=80)).words,
    "identifiability": lambda: dw.analysis.identifiability(*record(missing=0.0), order=2).words,
    "reprs": lambda: "\n".join(repr(memory()) for memory in MEMORIES.values()),
    "detectors": lambda: "\n".join(d.words for d in (dw.PageHinkley(), dw.detect.Parity("1 per 5000"))),
}

# What is called otherwise after the change of names: in words to be compared, the left is read as the right. (The ~
# is left out of the old names; it keeps them old where a tool renames all the others in this file.)
NAMES = """
N~ever=Constant  W~eighted=ExponentialForgetting  L~imitedGain=GainFloor  W~alk=RandomWalk  U~ntilJump=RestartOnChange
R~unLengths=BayesianChangePoint  A~uto=AutoMemory  I~nteracting=IMM  B~ank=MultipleModel  C~orrelation=AutocovarianceLS
I~nflate=CovarianceInflation  H~inkley=PageHinkley  S~core=ScoreCUSUM  V~arianceChange=VarianceCUSUM
G~ate=InnovationGate  U~nknownScale=InverseGamma  r~estart=response  t~ick=update_batch
"""
RENAMED = dict(pair.replace("~", "").split("=") for pair in NAMES.split())


def read_alike(text: str) -> str:
    """Return words as they are compared: one clause a line, new names for old, no times, no drawn lines."""
    text = re.sub(rf"\b({'|'.join(RENAMED)})\b", lambda found: RENAMED[found[0]], text)
    text = re.sub(
        r"(?<=Forgetting\()p(?=[=)])|\bp(?= is a weight per sample)", lambda found: found[0].replace("p", "lam"), text
    )
    text = re.sub(r"took \S+ s\b|\S+ (samples|rows)/s|\d+ MB of memory|(?<=seconds\": )[\d.]+", "..", text)
    text = re.sub(r"[\u2500-\u257f]+|driftwise \d\S*|\x1b\[[\d;]*m", " ", text)
    return re.sub(r"(?<=[.:;,}]) ", "\n", " ".join(text.split()))


# --- hashing and comparing -------------------------------------------------------------------------------------


def feed(digest, thing) -> None:
    """Take the numbers of anything into a hash: arrays, states, steps, lists and dictionaries of them."""
    if isinstance(thing, dict | list | tuple) or (isinstance(thing, np.ndarray) and thing.dtype == object):
        for part in thing.values() if isinstance(thing, dict) else thing:
            feed(digest, part)
        return
    if isinstance(thing, str):
        digest.update(thing.encode())
        return
    array = np.ascontiguousarray(np.nan if thing is None else thing)
    array = array.view(np.float64) if array.dtype.names or array.dtype.kind == "c" else array.astype(np.float64)
    digest.update(np.where(np.isnan(array), np.nan, array).tobytes())


def hashed(found) -> str:
    """Return a hash for each part of what a configuration gave."""
    parts = found if isinstance(found, dict) else {"all": found}
    digests = {name: hashlib.sha256() for name in parts}
    for name, digest in digests.items():
        feed(digest, parts[name])
    return " ".join(f"{name}:{digest.hexdigest()[:12]}" for name, digest in digests.items())


def take(name: str) -> str:
    """Return the fingerprint of one configuration, in an empty folder; of one that fails, how."""
    is_words = name.startswith("words/")
    case = WORDS[name.removeprefix("words/")] if is_words else NUMBERS[name]
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return read_alike(case()) if is_words else hashed(case())
        except Exception as error:
            return f"failed: {type(error).__name__}: {error}"


def difference(name: str, before: str, after: str, most: int = 40) -> list[str]:
    """Return the lines that say what moved; of words, at most so many."""
    if before == after:
        return []
    if "failed: " in (before[:8], after[:8]):
        return [f"{name} {after[:300]}" if after.startswith("failed: ") else f"{name}: worked"]
    if not name.startswith("words/"):
        return [f"{name}: {', '.join(sorted(part.split(':')[0] for part in {*after.split()} - {*before.split()}))}"]
    pair = read_alike(before).split("\n"), read_alike(after).split("\n")
    lines = [f"    {line}" for line in difflib.unified_diff(*pair, lineterm="", n=0) if line[:3] not in ("---", "+++")]
    lines = [line for line in lines if not line.startswith("    @@")]
    return [f"{name}:", *lines[:most], *(["    .."] if len(lines) > most else [])] if lines else []


def main() -> None:
    """Take the fingerprint of the tree that is imported; write it, or say what moved."""
    arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    arguments.add_argument("--out", metavar="FILE", help="write the fingerprint")
    arguments.add_argument("--against", metavar="FILE", help="compare with this one; exit code 1 where anything moved")
    arguments.add_argument("--only", metavar="PATTERN", default="*", help="such as 'arx/*' or '*auto*'")
    arguments.add_argument("--compiled", action="store_true", help="with compiled loops")
    arguments.add_argument("--slow", action="store_true", help="print what takes more than a second")
    asked = arguments.parse_args()
    if not asked.compiled:
        run_uncompiled()
    else:  # what runs as plain Python proves nothing of compiled loops
        warnings.filterwarnings("error", "(?s).*plain Python", RuntimeWarning)
    names = [n for n in [*NUMBERS, *(f"words/{name}" for name in WORDS)] if fnmatch.fnmatch(n, asked.only)]
    found, begun = {}, time.process_time()
    for name in names:
        start = time.process_time()
        found[name] = take(name)
        if asked.slow and time.process_time() - start > 1:
            print(f"{name}: {time.process_time() - start:.1f} s")
    taken = time.process_time() - begun
    failed = [f"{name} {what}" for name, what in found.items() if what.startswith("failed: ")]
    moved, known = [], {}
    if asked.out:
        Path(asked.out).write_text(json.dumps(found, indent=0, sort_keys=True, ensure_ascii=False) + "\n")
    if asked.against:
        known = json.loads(Path(asked.against).read_text())
        moved = [lines for name in names if name in known and (lines := difference(name, known[name], found[name]))]
        moved += [[f"{name}: gone"] for name in known if name not in found and fnmatch.fnmatch(name, asked.only)]
    new = sum(name not in known for name in names) if asked.against else 0
    for lines in moved or [[line] for line in failed]:
        print("\n".join(lines))
    print(f"{len(names)} configurations, {len(moved)} moved, {len(failed)} failed, {new} new, {taken:.0f} s")
    sys.exit(1 if moved or failed else 0)


if __name__ == "__main__":
    main()
