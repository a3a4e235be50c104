"""A `Fleet` beside the machine's limit, C that knows the order, and beside the former engine's lanes, by numba."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from functools import cache

import numpy as np

import driftwise as dw
from driftwise.engine import compile, objects, simd_fleet
from driftwise.engine.compilers import Compiler, named

from .clock import cpu
from .compiler import NATIVE, library, pointer
from .engines import made
from .former import Former
from .plant import VARIANCE
from .verdicts import Table, Verdict, at_least, at_most, for_information, not_measured

SOURCE = "bench/lanes.py"
WHY = {
    1: "no status, no logarithm, nothing may be missing; products and sums are fused",
    8: "no status, no logarithm, nothing may be missing; states stay side by side, ours are put there and back",
}
TEXT = (
    "64 series of 500 samples, nothing missing, through `Fleet.advance`; C and ours in this process, numba in one of "
    "its own (the former engine, out of this repository's history), in turn; medians of nine, CPU time."
)


@cache
def compiled(lanes: int) -> ctypes.CDLL:
    """Return ``lanes.c`` for so many series at once."""
    return library("lanes.c", NATIVE, *(["-DLANES"] if lanes == 8 else []))


def operations(n: int) -> int:
    """Return the operations of ``lanes.c`` per sample and series, counted by hand; 2 n of them are divisions."""
    N = 2 * n
    return 7 * N + 2 * N * (N - 1) + 4 + 2 * N + 2 * n + n * n


class Lanes:
    """Series y (S, T), S divisible by eight, filtered by C from the prior of a Joint(3) with `EquationError`."""

    def __init__(self, est, y: np.ndarray, lanes: int):
        series, samples = y.shape
        self.blocks, self.samples, self.run_blocks = series // lanes, samples, compiled(lanes).run_blocks
        blocks = y.reshape(self.blocks, lanes, samples).transpose(0, 2, 1)
        self.y = _aligned(blocks.shape)
        self.y[:] = blocks
        state = est.start()
        one = np.concatenate([state["x"], state["theta"], state["D"], state["U"], [0.0]])
        self.first = _aligned((self.blocks, one.size, lanes))
        self.first[:] = one[:, None]
        self.memory, self.out = _aligned(self.first.shape), _aligned((self.blocks, samples, 3, lanes))

    def __call__(self) -> None:
        self.memory[:] = self.first
        self.run_blocks(
            ctypes.c_long(self.blocks), ctypes.c_long(self.samples), pointer(self.y), ctypes.c_double(VARIANCE),
            pointer(self.memory), pointer(self.out),
        )  # fmt: skip

    def answer(self) -> np.ndarray:
        """Return prediction, innovation and variance (S, T, 3)."""
        self()
        return self.out.transpose(0, 3, 1, 2).reshape(-1, self.samples, 3).copy()


def _aligned(shape) -> np.ndarray:
    """Return memory where a vector of the machine may begin."""
    size = int(np.prod(shape))
    raw = np.zeros(size + 8)
    return raw[-raw.ctypes.data % 64 // 8 :][:size].reshape(shape)


class Ours:
    """A `Fleet` whose eight lanes one compiler made; called, it takes all samples from fresh states: CPU seconds."""

    def __init__(self, est, at, ys, us, compiler: Compiler | None):
        self.fleet, self.data = (
            dw.Fleet(est, range(int(at[-1]) + 1), threads=1, lanes=compiler is not None),
            (at, ys, us),
        )
        self.rows = self.fleet.states.view(float).reshape(len(self.fleet.states), -1)
        self.fresh = self.rows.copy()
        self.make = cache(lambda *sizes: _by(compiler, *sizes))
        self.run()

    def run(self) -> np.ndarray:
        """Return what each sample showed."""
        self.rows[:] = self.fresh
        before, simd_fleet.lane_crew = simd_fleet.lane_crew, self.make
        try:
            return self.fleet.advance(*self.data)
        finally:
            simd_fleet.lane_crew = before

    def __call__(self) -> float:
        return cpu(self.run)


def _by(compiler: Compiler, kinds, sizes, shapes):
    """Return the loop of eight lanes, made by one compiler."""
    text = compile.translated(simd_fleet.make_lanes(kinds, sizes, shapes, 0), simd_fleet.DIMENSIONS)
    return made(compiler, text, simd_fleet.DIMENSIONS, native=True)


def series_of(est, series: int, samples: int):
    """Return row numbers, outputs and inputs of a fleet, one series after the other."""
    b = [[1.0, 0.5, 0.0]] if est.model.inputs else []
    both = [dw.simulate([-1.5, 0.9, -0.3], *b, samples=samples, noise_std=0.1, seed=i) for i in range(8)]
    ys = np.tile(np.stack([y for y, _ in both]), (series // 8, 1)).reshape(-1, 1)
    us = np.tile(np.stack([u for _, u in both]), (series // 8, 1)).reshape(-1, 1) if b else np.empty((len(ys), 0))
    return np.repeat(np.arange(series), samples), ys, us


def verdicts(series: int = 64, samples: int = 500) -> Iterator[Verdict | Table]:
    """Yield the time of fleets over that of C which knows the order, and of numba's lanes over theirs."""
    compilers = {one.name: one for one in (*named("clang"), *named("gcc"))}
    est = dw.Joint(3, noise=dw.models.EquationError(VARIANCE))
    data = series_of(est, series, samples)
    y = data[1].reshape(series, samples)
    rows: list[tuple] = []
    for lanes in (1, 8):
        name = f"fleet of Joint(3), no input, C {'one series at a time' if lanes == 1 else 'eight series at once'}"
        try:
            theirs = Lanes(est, y, lanes)
        except OSError as error:
            yield not_measured(name, "no budget (x C)" if lanes == 1 else "<= 2 x", SOURCE, str(error))
            continue
        fleets = {"": Ours(est, *data, None)} if lanes == 1 else {n: Ours(est, *data, c) for n, c in compilers.items()}
        for ours in fleets.values():
            found = ours.run().reshape(series, samples, 4)[:, :, :3]
            np.testing.assert_allclose(found, theirs.answer(), rtol=1e-9, atol=1e-9)
        each = _alternate(*fleets.values(), lambda run=theirs: cpu(run)) / y.size * 1e9
        for by, ns in zip(fleets, each[:-1]):
            ratio, note = ns / each[-1], f"ours {ns:.1f} ns a sample, C {each[-1]:.1f} ns"
            if lanes == 1:
                yield for_information(name, ratio, "x C", SOURCE, note).beside("C -O3 -march=native", ratio, WHY[1])
                continue
            verdict = at_most(f"{name}, by {by}", ratio, 2.0, "x C", SOURCE, note)
            yield verdict.beside("C -O3 -march=native", ratio, WHY[8])
        rows.append(("Joint(3), known noise", f"C, {lanes}", each[-1], *([None] * 2 if lanes == 1 else each[:-1])))
    for name, est in {"ARX(2, 2)": dw.ARX(2, 2), "Joint(3)": dw.Joint(3)}.items():
        data = series_of(est, series, samples)
        try:
            former = Former(f"dw.{name}", *data)
        except OSError as error:
            yield not_measured(f"fleet of {name}, numba's eight lanes over ours", ">= 1.4 x", SOURCE, str(error))
            continue
        fleets = {by: Ours(est, *data, compiler) for by, compiler in compilers.items()}
        for ours in fleets.values():
            np.testing.assert_allclose(ours.run()[:, :3], former.answer[:, :3], rtol=1e-9, atol=1e-9)
        each = _alternate(*fleets.values(), former) / len(data[0]) * 1e9
        former.close()
        for by, ns in zip(fleets, each[:-1]):
            note = f"ours {ns:.1f} ns a sample, numba's {each[-1]:.1f} ns"
            title = f"fleet of {name}, numba's eight lanes over ours by {by}"
            yield at_least(title, each[-1] / ns, 1.4, "x", SOURCE, note)
        rows.append((name, "numba's lanes", each[-1], *each[:-1]))
    columns = ("fleet", "opponent", "opponent, ns a sample", *(f"ours by {by}, ns a sample" for by in compilers))
    yield Table("Eight series in a register", columns, rows, TEXT)


def _alternate(*timers: Callable[[], float]) -> np.ndarray:
    """Return the medians of nine rounds; each is called twice, and the second counts: its process had slept."""
    for timer in timers:
        timer()
    objects.wait()  # what an optimising compiler makes takes over
    return np.median([[[timer() for _ in range(2)][1] for timer in timers] for _ in range(9)], axis=0)
