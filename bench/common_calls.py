"""Calls that today's tree and former ones understand alike, by name: each a function that prepares what is timed."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np

import driftwise as dw

from .memories import MEMORIES
from .plant import joint, record

Call = Callable[[], object]
MORE = {  # calls that do more than the former ones did, and those of the same work
    "record ARX(2,2), RestartOnChange": "record ARX(2,2), RestartOnChange, a size told",
    "identify, 2000 samples": "identify, 2000 samples, its models compared",
}
PLANT = dw.Plant([[0, 1, 0], [0, 0, 0.2], [0, -10, -10]], [0, 0, 10], [1, 0, 0])


def equation(samples: int, noise_std: float = 0.1):
    """Return a record of ARX(2, 2)."""
    return dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=samples, noise_std=noise_std, noise="equation", seed=1)


def outputs(samples: int):
    """Return a record of two outputs."""
    truth = [-1.2, 0.5, -0.1, 1.0, 0.5, 0.2, -0.8, 0.3, 0.4]
    y, u = dw.models.simulate_mimo((2, 1), truth, samples=samples, inputs=1, noise_std=0.1, seed=1)
    return y, u[:, 0]


def several(few: Call, times: int) -> Call:
    """Return a call that makes it so many times."""

    def run():
        for _ in range(times):
            few()

    return run


def updates(est, y, u, time=None) -> Call:
    """Return a stream from a fresh state, a call for each sample."""
    inputs = [None] * len(y) if u is None else u.tolist()
    rows = list(zip(y.tolist(), inputs, [{}] * len(y) if time is None else [{"time": t} for t in time.tolist()]))

    def stream():
        state = est.start()
        for value, given, when in rows:
            state, _ = est.update(state, value, given, **when)

    return stream


def raw(est, samples: int = 3000) -> Call:
    """Return as many calls of the compiled loop, unchecked."""
    y, u = record(samples)
    ys, us, out = y.reshape(-1, 1, 1, 1), u.reshape(-1, 1, 1, 1), np.empty((1, 1, 4))
    rows, spec, scratch, drive = est.start(1).view("f8").reshape(1, -1), est.spec, est.scratch(), est.drive

    def calls():
        for t in range(samples):
            drive(rows, ys[t], us[t], out, spec, scratch)

    return calls


def fleet(est, series: int, *, lanes: bool, is_sorted: bool = False, ticks: int = 20) -> Call:
    """Return a table through a fleet, from the same states each time, in order of time or of series."""
    draws = [equation(200 + ticks, 0.1 + 0.01 * k) for k in range(10)]
    pick = np.arange(series) % len(draws)
    y, u = (np.stack([draw[i][200:] for draw in draws])[pick] for i in (0, 1))  # (series, ticks)
    at = np.tile(np.arange(series)[:, None], ticks)
    ys, us, at = (np.ascontiguousarray(a if is_sorted else a.T).reshape(-1) for a in (y, u, at))
    many = dw.Fleet(est, range(series), threads=1, lanes=lanes)
    given = [None if not est.model.inputs else draw[1][:200] for draw in draws]
    many.states[:] = np.concatenate([est.scan(d[0][:200], g).state[None] for d, g in zip(draws, given)])[pick]
    begun, inputs = many.states.copy(), us[:, None] if est.model.inputs else np.empty((us.size, 0))

    def run():
        many.states[:] = begun
        many.advance(at, ys[:, None], inputs)

    return run


def batches(est, series: int, ticks: int = 10) -> Call:
    """Return a call of `update_batch` for each tick."""
    y, u = equation(200 + ticks)
    inputs = u if est.model.inputs else None
    begun = np.repeat(est.scan(y[:200], None if inputs is None else inputs[:200]).state[None], series)
    rows = [
        (np.full(series, y[200 + t]), None if inputs is None else np.full(series, u[200 + t])) for t in range(ticks)
    ]

    def run():
        states = begun
        for row in rows:
            states, _ = est.update_batch(states, *row)

    return run


def observer(samples: int, *, irregular: bool = False) -> Call:
    """Return a record through `WindowObserver`."""
    u, draw = 24 * np.sin(1e-3 * np.arange(samples)), np.random.default_rng(0)
    y, time = np.cumsum(u) * 1e-4 + 0.0087 * draw.standard_normal(samples), np.cumsum(draw.exponential(1e-3, samples))
    modes = dw.models.Polynomial([0, 0, 5], np.inf), dw.models.Sinusoid(50.0, [0, 0, 5], 2.0)
    options = dict(noise_std=0.0087, disturbances=modes, hold="foh", dt=1e-3, irregular=irregular)
    return partial(dw.WindowObserver(PLANT, 0.5, **options).scan, y, u, time=time if irregular else None)


def continuous(samples: int, *, irregular: bool = True, is_stream: bool = False) -> Call:
    """Return a record, or a stream, through `ContinuousJoint`."""
    time = np.cumsum(np.random.default_rng(1).uniform(0.02, 0.18, samples)) if irregular else 0.1 * np.arange(samples)
    y, u = dw.models.simulate_continuous([0.3, 1.0], [0.0, 2.0], time=time, noise_std=0.005, seed=1)
    est = dw.ContinuousJoint(2, 1, dt=0.1)
    return updates(est, y, u, time) if is_stream else partial(est.scan, y, u, time=time if irregular else None)


def plots(count: int, *, is_stream: bool = False) -> Call:
    """Return the plots of an aircraft through `TrackEstimator`, as a record or one by one."""
    time, noise = 4.0 * np.arange(count), 50.0 * np.random.default_rng(1).standard_normal((count, 2))
    path, est = np.stack([200.0 * time, 50.0 * time], axis=1) + noise, dw.TrackEstimator("aircraft")

    def stream():
        state = est.start()
        for instant, plot in zip(time, path):
            state, _ = est.update(state, instant, plot)

    return stream if is_stream else partial(est.scan, time, path)


def airspace(aircraft: int = 300, scans: int = 6) -> Call:
    """Return turns of an antenna through a fresh tracker."""
    from driftwise.tracking.plots import plots

    draw = np.random.default_rng(1)
    start, velocity = 2e5 * draw.standard_normal((aircraft, 2)), 150.0 * draw.standard_normal((aircraft, 2))
    keys, turns = np.array([f"{k:06X}" for k in range(aircraft)], object), []
    for scan in range(scans):
        at = 4.0 * (scan + np.arange(aircraft) / aircraft)
        noise = 50.0 * draw.standard_normal((aircraft, 2))
        turns.append(plots(at, start + velocity * at[:, None] + noise, key=keys))

    def run():
        tracker = dw.tracking.Tracker("aircraft")
        for seen in turns:
            tracker.feed(seen)

    return run


def identified() -> Call:
    """Return `identify` of two thousand samples."""
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=2000, noise_std=0.3, seed=1)
    return partial(dw.identify, {"heater": u, "temperature": y})


def compared() -> Call:
    """Return the part of `identify` that compares models; the former one did no more."""
    from driftwise.analysis.identifier import Identifier

    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=2000, noise_std=0.3, seed=1)
    return lambda: Identifier(1).add(y, u[:, None])


def command(*words: str) -> Call:
    """Return a command in a process of its own; TABLE is a file of two thousand samples."""
    folder = Path(tempfile.mkdtemp(prefix="driftwise-bench-"))
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=2000, noise_std=0.3, seed=1)
    columns = np.column_stack([0.1 * np.arange(y.size), u, y])
    np.savetxt(folder / "TABLE", columns, "%.9g", ",", header="t,heater,temperature", comments="")
    line = [sys.executable, "-m", "driftwise", *words]
    return partial(subprocess.run, line, check=True, cwd=folder, capture_output=True)


def scan(make, data, **options) -> Callable[[], Call]:
    """Return what makes an estimator and its scan of a record."""
    return lambda: partial(make().scan, *data(), **options)


def calls() -> dict[str, Callable[[], Call]]:
    """Return them all: records, single calls, fleets, tracks, smoothing, answers, processes."""
    arx, auto = partial(dw.ARX, 2, 2), partial(dw.ARX, 2, 2, memory=dw.AutoMemory())
    plain, known, mimo = partial(dw.Joint, 3), partial(joint, "EquationError"), partial(dw.JointMIMO, (2, 1), 1)
    members = lambda: dw.ModelAverage([dw.ARX(1, 1), dw.ARX(2, 2), dw.ARX(3, 3)])  # noqa: E731
    found: dict[str, Callable[[], Call]] = {}
    for noise in ("EquationError", "OutputError"):
        make = partial(joint, noise)
        for keep in ("innovations", "std"):
            found[f"record Joint(3), {noise}, {keep}"] = scan(make, partial(record, 10_000), keep=keep)
        found[f"raw Joint(3), {noise}"] = lambda make=make: raw(make())
        found[f"update Joint(3), {noise}"] = lambda make=make: updates(make(), *record(3000))
        found[f"smooth Joint(3), {noise}"] = lambda make=make: partial(make().smooth, *record(3000))
    for memory in (dw.RandomWalk(1e-6), dw.RestartOnChange()):
        make = partial(dw.Joint, 3, 1, True, memory=memory)
        found[f"record Joint(3), {type(memory).__name__}"] = scan(make, partial(record, 5000))
    make = partial(dw.Joint, 3, 1, True, noise=dw.models.UnknownPolynomial())
    found["record Joint(3), UnknownPolynomial"] = scan(make, partial(record, 5000))
    for memory in (dw.Constant(), *MEMORIES):
        name = f"record ARX(2,2), {type(memory).__name__}"
        found[name] = scan(partial(dw.ARX, 2, 2, memory=memory), partial(equation, 4000))
    told = dw.RestartOnChange(dw.detect.ScoreCUSUM(jump=0.5), dw.memory.GainReset())  # the former default
    found["record ARX(2,2), RestartOnChange, a size told"] = scan(
        partial(dw.ARX, 2, 2, memory=told), partial(equation, 4000)
    )
    for name, make in {
        "ARX, nlms": partial(dw.ARX, 2, 2, method="nlms"),
        "ARX, iv": partial(dw.ARX, 2, 2, method="iv"),
        "ARMAX(2,2,2)": partial(dw.ARMAX, 2, 2, 2),
        "OE(2,2)": partial(dw.OE, 2, 2),
        "BJ(2,1,1,2)": partial(dw.BJ, 2, 1, 1, 2),
        "ModelAverage of three": members,
    }.items():
        found[f"record {name}"] = scan(make, partial(equation, 5000))
    for name, make, series in (
        ("Joint(3)", plain, 5000),
        ("ARX(2,2)", arx, 5000),
        ("ARX(2,2), AutoMemory", auto, 1000),
    ):
        for lanes, is_sorted in product((False, True), repeat=2):
            way = f"fleet {name}, {'lanes' if lanes else 'one by one'}, by {'series' if is_sorted else 'time'}"
            found[way] = partial(fleet, make(), series, lanes=lanes, is_sorted=is_sorted)
    return found | {
        "record AdaptiveGain": lambda: partial(dw.AdaptiveGain(0.9).scan, equation(5000)[0]),
        "record ARXMIMO(2,1)": scan(partial(dw.ARXMIMO, 2, 1), partial(outputs, 5000)),
        "record JointMIMO((2,1))": scan(mimo, partial(outputs, 5000)),
        "record ContinuousJoint(2), regular": partial(continuous, 5000, irregular=False),
        "record ContinuousJoint(2), irregular": partial(continuous, 5000),
        "record WindowObserver, regular": partial(observer, 10_000),
        "record WindowObserver, irregular": partial(observer, 3000, irregular=True),
        "raw ARX(2,2)": lambda: raw(arx()),
        "raw ARX(2,2), AutoMemory": lambda: raw(auto()),
        "update ARX(2,2)": lambda: updates(arx(), *equation(3000)),
        "update ARX(2,2), AutoMemory": lambda: updates(auto(), *equation(3000)),
        "update JointMIMO((2,1))": lambda: updates(mimo(), *outputs(1000)),
        "update ContinuousJoint(2)": partial(continuous, 1000, is_stream=True),
        "predict ARX(2,2), 24 ahead": lambda: several(
            partial(arx().predict, arx().scan(*equation(1000)).state, np.ones(24)), 100
        ),
        "batch Joint(3)": lambda: partial(known().batch, *record(10_000)),
        "choose_order, 1 to 5": lambda: partial(dw.analysis.choose_order, *record(5000), range(1, 6), direct=True),
        "update_batch Joint(3)": lambda: batches(plain(), 10_000),
        "update_batch ARX(2,2)": lambda: batches(arx(), 10_000),
        "update_batch ARX(2,2), AutoMemory": lambda: batches(auto(), 2000),
        "track, a record": partial(plots, 1000),
        "track, update": partial(plots, 200, is_stream=True),
        "tracker, 300 aircraft": airspace,
        "smooth Joint(3), lag 20": lambda: partial(known().smooth, *record(1000), lag=20),
        "smooth ARX(2,2)": lambda: partial(arx().smooth, *equation(500)),
        "identify, 2000 samples": identified,
        "identify, 2000 samples, its models compared": compared,
        "driftwise --help": partial(command, "--help"),
        "driftwise run": partial(command, "run", "TABLE"),
        "driftwise run --report": partial(command, "run", "TABLE", "--report", "page.html"),
    }
