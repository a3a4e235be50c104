"""Series of outputs and inputs that no sensor gives, and estimators that they are fed to."""

from __future__ import annotations

import numpy as np

import driftwise as dw
from driftwise.engine.errors import InputError
from driftwise.engine.status import LOST, UNDEFINED

T = 120


def _with(value, at=slice(40, 41), of=0):
    def make(rng):
        y, u = rng.standard_normal(T), rng.standard_normal(T)
        (y, u)[of][at] = value
        return y, u

    return make


SERIES = {
    "nothing": lambda rng: (np.full(T, np.nan), np.full(T, np.nan)),
    "zeros": lambda rng: (np.zeros(T), np.zeros(T)),
    "constant": lambda rng: (np.full(T, 1e6), np.ones(T)),
    "one sample": lambda rng: (np.ones(1), np.ones(1)),
    "huge": lambda rng: (1e99 * rng.standard_normal(T), rng.standard_normal(T)),
    "huge inputs": lambda rng: (rng.standard_normal(T), 1e99 * rng.standard_normal(T)),
    "tiny": lambda rng: (1e-300 * rng.standard_normal(T), 1e-300 * rng.standard_normal(T)),
    "denormal": lambda rng: (np.full(T, 5e-324), np.full(T, 5e-324)),
    "growing": lambda rng: (1.8 ** np.arange(T), rng.standard_normal(T)),
    "alternating": lambda rng: (1e50 * (-1.0) ** np.arange(T), np.ones(T)),
    "ramp": lambda rng: (np.arange(T) * 1e12, np.arange(T) * 1.0),
    "spike": _with(1e80),
    "spike of the input": _with(1e59, of=1),
    "spikes": _with(1e30, slice(10, None, 17)),
    "step of scale": _with(1e20, slice(60, None)),
    "gap": _with(np.nan, slice(10, 90)),
    "gap of the input": _with(np.nan, slice(10, 90), 1),
    "same as the input": lambda rng: (u := rng.standard_normal(T), u),
    "integers": lambda rng: (rng.integers(0, 2, T).astype(float), np.zeros(T)),
}


def drawn(rng):
    """Return a series of pieces, each of a scale of its own."""
    y, u = rng.standard_normal(T), rng.standard_normal(T)
    for values in (y, u):
        for _ in range(int(rng.integers(1, 6))):
            first = int(rng.integers(T))
            part = slice(first, first + int(rng.integers(1, 60)))
            what = int(rng.integers(5))
            if what == 0:
                values[part] *= 10.0 ** rng.uniform(-90, 60)
            elif what == 1:
                values[part] = np.nan
            elif what == 2:
                values[part] = 10.0 ** rng.uniform(-20, 60)
            elif what == 3:
                values[part] = 0.0
            else:
                values[part] = np.cumsum(values[part])
    return y, u


ESTIMATORS = {
    "ARX": lambda: dw.ARX(2, 2),
    "ARX constant": lambda: dw.ARX(2, 2, memory=dw.Constant()),
    "ARX exponential": lambda: dw.ARX(2, 2, memory=dw.ExponentialForgetting(0.9)),
    "ARX restart": lambda: dw.ARX(2, 2, memory=dw.RestartOnChange(dw.detect.PageHinkley())),
    "ARX run lengths": lambda: dw.ARX(2, 2, memory=dw.memory.BayesianChangePoint(0.5, 1000)),
    "ARMAX": lambda: dw.ARMAX(1, 1, 1),
    "OE": lambda: dw.OE(1, 1),
    "BJ": lambda: dw.BJ(1, 1, 1, 1),
    "Joint": lambda: dw.Joint(2, inputs=1),
    "Joint auto": lambda: dw.Joint(1, inputs=1, memory=dw.AutoMemory()),
    "Joint output error": lambda: dw.Joint(2, inputs=1, noise=dw.models.OutputError()),
    "Joint unknown": lambda: dw.Joint(2, inputs=1, noise=dw.models.UnknownPolynomial()),
    "StateSpace": lambda: dw.estimators.StateSpace(
        [[0.9, 1.0], [0.0, 0.8]], [[0.0], [1.0]], Q=[0.01, 0.1], R=1.0, gate=dw.detect.InnovationGate(5.0)
    ),
    "StateSpace unstable": lambda: dw.estimators.StateSpace(
        [[1e3, 1.0], [0.0, 1e-9]], [[1e50], [1.0]], Q=[0.0, 1e-30], R=1e-90
    ),
    "GreyBox": lambda: dw.estimators.GreyBox("mass_spring_damper", dt=0.1),
    "GreyBox tank": lambda: dw.estimators.GreyBox("tank", start=None),
    "GreyBox exact gradient": lambda: dw.estimators.GreyBox("battery", start=None, method="rpem"),
    "GreyBox tank, exact gradient": lambda: dw.estimators.GreyBox("tank", start=None, method="rpem"),
    "Track": lambda: dw.TrackEstimator("aircraft"),
}


def broken(name: str, y, u) -> str:
    """Return what is wrong with what an estimator makes of a series; nothing where it is finite, LOST, or refused."""
    est = ESTIMATORS[name]()
    try:
        if name == "Track":
            trace = est.scan(np.arange(len(y)) * 4.0, np.stack([y, u], axis=1))
        else:
            trace = est.scan(y, u)
    except InputError:
        return ""
    status, state = np.asarray(trace.status, int).reshape(len(y), -1).max(axis=1), trace.state
    numbers = {
        n: np.asarray(state[n], float) for n in state.dtype.names if state.dtype[n].names is None and n != "plots"
    }
    wrong = [n for n, values in numbers.items() if not np.isfinite(values).all()]
    if wrong and not status[-1] & (LOST | UNDEFINED):
        return f"{', '.join(wrong)} not finite at the end, and not LOST"
    if "D" in numbers and not wrong and not (numbers["D"] >= 0).all():
        return f"a variance below nothing: {numbers['D'].min():g}"
    prediction = np.asarray(trace.prediction).reshape(len(y), -1)
    lost = ~np.isfinite(prediction).all(axis=1) & (status & (LOST | UNDEFINED) == 0)
    return f"prediction {int(lost.argmax())} not finite, and not LOST" if name != "Track" and lost.any() else ""
