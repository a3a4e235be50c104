"""The same kernels by numba and by the compilers of C: time per sample, time to compile."""

from __future__ import annotations

import resource
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

import driftwise as dw
from driftwise.engine import compile, finish, jit, loops, objects
from driftwise.engine.compilers import MEMORY, Compiler, named, tcc

from .clock import alternate
from .verdicts import Table, Verdict, at_most, not_measured

SOURCE = "bench/engines.py"
SAMPLES = 4000
WORST = {"clang": 1.3, "gcc": 1.5}


def estimators() -> dict[str, tuple[Any, int, int]]:
    """Return estimators, and how many outputs and inputs each has."""
    memory, models = dw.memory, dw.models
    return {
        "ARX(2, 2)": (dw.ARX(2, 2), 1, 1),
        "ARX(2, 2), RandomWalk": (dw.ARX(2, 2, memory=memory.RandomWalk(1e-4)), 1, 1),
        "ARX(2, 2), RestartOnChange": (dw.ARX(2, 2, memory=memory.RestartOnChange()), 1, 1),
        "ARX(2, 2), AutoMemory": (dw.ARX(2, 2, memory=memory.AutoMemory()), 1, 1),
        "ARX(2, 2), IMM": (dw.ARX(2, 2, memory=memory.IMM()), 1, 1),
        "ARX(2, 2), LikelihoodDrift": (dw.ARX(2, 2, memory=memory.LikelihoodDrift()), 1, 1),
        "Joint(3)": (dw.Joint(3), 1, 0),
        "Joint(3), input, direct": (dw.Joint(3, inputs=1, direct=True), 1, 1),
        "Joint(3), equation error": (dw.Joint(3, noise=models.EquationError(1.0)), 1, 0),
        "ARMAX(2, 2, 1)": (dw.ARMAX(2, 2, 1), 1, 1),
        "JointMIMO((1, 1))": (dw.JointMIMO((1, 1)), 2, 0),
        "AdaptiveGain": (dw.AdaptiveGain(), 1, 0),
        "ContinuousJoint(2)": (dw.ContinuousJoint(2), 1, 0),
    }


def verdicts() -> Iterator[Verdict | Table]:
    """Yield each compiler's time over numba's, and a table by compiler."""
    try:
        import numba  # noqa: F401
    except ImportError:
        yield not_measured("records, C over numba", "<= 1 x", SOURCE, "numba is not installed")
        return
    makers: dict[str, Callable] = {"numba": lambda kinds: jit.compiled(loops.make_driver(kinds, 0), compile.DRIVER)}
    at_hand = {c.name: c for c in (*named("clang"), *named("gcc"), *tcc())}
    for name, compiler in at_hand.items():
        makers[name] = lambda kinds, compiler=compiler: _by(compiler, kinds)
    rows, ratios = [], {name: {} for name in at_hand}
    for title, (est, outputs, inputs) in estimators().items():
        kinds = tuple(map(type, est.policies))
        seconds, drives = {}, {}
        for name, make in makers.items():
            before = _spent()
            drives[name] = make(kinds)
            seconds[name] = _spent() - before
        nanoseconds = _times(est, outputs, inputs, drives)
        for name in at_hand:
            ratios[name][title] = nanoseconds[name] / nanoseconds["numba"]
        rows.append([title, *nanoseconds.values(), *seconds.values()])
    for name, worst in WORST.items():
        if name not in ratios:
            yield not_measured(f"records, {name} over numba", "<= 1 x", SOURCE, f"no {name} here")
            continue
        found = ratios[name]
        mean = float(np.exp(np.mean(np.log(list(found.values())))))
        slowest = max(found, key=lambda title: found[title])
        yield at_most(f"records, {name} over numba, geometric mean", mean, 1.0, "x", SOURCE, f"{len(found)} estimators")
        yield at_most(f"records, {name} over numba, the worst", found[slowest], worst, "x", SOURCE, slowest)
    names = list(makers)
    yield Table(
        "The same kernels, by compiler",
        ["estimator", *(f"{n}, ns a sample" for n in names), *(f"{n}, s to compile" for n in names)],
        rows,
        "A record of 4000 samples, no columns of estimates; every compiler gives the same bits. Compiling is CPU time, "
        "from kernels to a loop that runs, with nothing cached (translation to C included, .1-.3 s of it).",
    )


def _by(compiler: Compiler, kinds):
    """Return the loop of these policies, made by one compiler."""
    return made(compiler, compile.translated(loops.make_driver(kinds, 0), compile.DRIVER), compile.DRIVER)


def made(compiler: Compiler, text: str, dimensions, native: bool = False) -> Callable:
    """Return the loop in C that one compiler made machine code of."""
    folder = Path(tempfile.mkdtemp(prefix="driftwise-bench-"))
    source, target = folder / "loop.c", folder / "loop.tmp"
    source.write_text(text + MEMORY)
    trouble = compiler.run(source, target, native)
    if trouble:
        raise OSError(trouble)
    caller: Any = objects._caller()
    return caller.function(objects._entry(finish.put(target, "loop")), dimensions)[0]


def _times(est, outputs: int, inputs: int, drives) -> dict[str, float]:
    """Return nanoseconds a sample of each loop, which must give the same bits."""
    rng = np.random.default_rng(1)
    ys, us = rng.standard_normal((1, SAMPLES, outputs)), rng.standard_normal((1, SAMPLES, inputs))
    spec, scratch, width = est.spec, est.scratch(), 4 * outputs
    outs = {name: np.empty((1, SAMPLES, width)) for name in drives}
    start = est._rows(est.start())

    def run(name: str) -> Callable[[], object]:
        return lambda: drives[name](start.copy(), ys, us, outs[name], spec, scratch)

    seconds = np.median(alternate(*map(run, drives), rounds=15), axis=0)
    first = next(iter(outs.values()))
    if not all(np.array_equal(first, other, equal_nan=True) for other in outs.values()):
        raise AssertionError(f"{est!r}: not the same bits by {', '.join(drives)}")
    return dict(zip(drives, (seconds / SAMPLES * 1e9).tolist()))


def _spent() -> float:
    """Return CPU seconds of this process and of those it waited for."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime
