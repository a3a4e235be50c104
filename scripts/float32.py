"""What a fleet would gain and lose with rows of 32 bits: speed, bytes, errors. Writes the tables of float32.md.

Three loops: rows as they are; rows of 32 bits, taken into 64 for the samples of one call and rounded after it; rows
and scratch of 32 bits, so that everything that is stored is rounded. Run: ``python scripts/float32.py`` (5 minutes).
"""

import time

import numba
import numpy as np
from numba import types

import driftwise as dw
from driftwise.engine import jit, ud
from driftwise.engine.dispatch import advance, open_row, open_scratch, read_all
from driftwise.fleet.crew import Crew

WAYS = {"64 bits": ("float64", "float64"), "stored in 32": ("float32", "float64"), "all in 32": ("float32", "float32")}
SERIES, SAMPLES = 10, 100_000


def make(kinds, sizes, shapes):
    """Return `compose.crew`'s loop over rows that are copied before and after."""
    width, outputs, inputs, columns, _, room = shapes

    def go(rows, starts, ys, us, outs, spec, scratch, row):
        if row.shape[0] != width or rows.shape[1] != width or scratch.shape[0] != room:
            return
        if ys.shape[1] != outputs or us.shape[1] != inputs or outs.shape[1] != columns:
            return
        for i in range(rows.shape[0]):
            for j in range(width):
                row[j] = rows[i, j]
            form, noise, memory, gate, scale, detector = read_all(kinds, sizes, spec)
            work, state = open_scratch(form, scratch), open_row(form, row)
            for t in range(starts[i], starts[i + 1]):
                advance(form, noise, memory, gate, scale, detector, state, work, ys, us, outs, t)
            for j in range(width):
                rows[i, j] = row[j]

    return go


class Series:
    """A fleet in one of the three ways."""

    def __init__(self, estimator, count, kept, computed):
        crew = Crew(estimator)
        shapes = crew.width, crew.outputs, crew.inputs, 4, crew.numbers, crew.room
        jit._bind()
        self.estimator, self.go = estimator, numba.njit(**jit.OPTIONS)(make(crew.kinds, crew.sizes, shapes))
        start = estimator.start().reshape(1).view(float)
        self.rows = np.tile(start, (count, 1)).astype(kept)
        self.scratch, self.row = np.empty(crew.room, computed), np.empty(crew.width, computed)
        numbers = {"float32": types.float32, "float64": types.float64}
        kept, table, work = numbers[kept][:, ::1], types.float64[:, ::1], numbers[computed][::1]
        before, numba.config.LOOP_VECTORIZE = numba.config.LOOP_VECTORIZE, 0  # as `compose`
        self.go.compile((kept, types.int64[::1], table, table, table, types.float64[::1], work, work))
        numba.config.LOOP_VECTORIZE = before

    def take(self, starts, y, u):
        outs = np.empty((len(y), 4))
        self.go(self.rows, starts, y, u, outs, self.estimator.spec, self.scratch, self.row)
        return outs

    @property
    def states(self):
        return self.rows.astype(float).view(self.estimator.dtype).reshape(-1)


def speed(name, estimator):
    """Print CPU time of a tick of 100 000 series and of long stretches, the ways alternating."""
    rng, inputs, cells = np.random.default_rng(1), estimator.model.inputs, []
    for count, each in ((100_000, 1), (1000, 500)):
        fleets = [Series(estimator, count, *way) for way in WAYS.values()]
        starts, times = np.arange(0, count * each + 1, each), []
        for _ in range(15):
            y, u = rng.standard_normal((count * each, 1)), rng.standard_normal((count * each, inputs))
            times.append([])
            for fleet in fleets:
                begun = time.process_time()
                fleet.take(starts, y, u)
                times[-1].append((time.process_time() - begun) / len(y) * 1e9)
        cells.append(np.median(times[3:], axis=0))
    for i, way in enumerate(WAYS):
        print(
            f"| {name} | {way} | {fleets[i].rows.itemsize * fleets[i].rows.shape[1]} | "
            + " | ".join(f"{c[i]:.0f}" for c in cells)
            + " |"
        )


def data(offset, rng):
    """Return outputs and inputs (T, S) of an ARX(2, 2) plant around a working point."""
    u, y = rng.standard_normal((SAMPLES, SERIES)), 0.1 * rng.standard_normal((SAMPLES, SERIES))
    for t in range(2, SAMPLES):
        y[t] += 1.5 * y[t - 1] - 0.7 * y[t - 2] + u[t - 1] + 0.5 * u[t - 2]
    return y + offset, u


def errors(name, estimator, y, u):
    """Print how far rows of 32 bits get from those of 64, one sample a call, in posterior deviations."""
    fleets = [Series(estimator, SERIES, *way) for way in WAYS.values()]
    starts, inputs = np.arange(SERIES + 1), estimator.model.inputs
    worst = np.zeros((2, 2, 3))  # way; until SAMPLES / 100, until the end; theta, P, prediction
    for t in range(SAMPLES):
        outs = [f.take(starts, y[t][:, None], np.ascontiguousarray(u[t][:, None])[:, :inputs].copy()) for f in fleets]
        if t % (SAMPLES // 100) == SAMPLES // 100 - 1:
            states = [f.states for f in fleets]
            P = [
                ud.unpack(s["U"], s["D"]).diagonal(axis1=1, axis2=2)[:, -states[0]["theta"].shape[1] :] for s in states
            ]
            deviation = np.sqrt([[estimator.sigma2(s)] for s in states[0]] * P[0])
            for i in (1, 2):
                found = (
                    np.max(abs(states[i]["theta"] - states[0]["theta"]) / deviation),
                    np.max(abs(P[i] / P[0] - 1)),
                    np.max(abs(outs[i][:, 0] - outs[0][:, 0]) / np.sqrt(outs[0][:, 2])),
                )
                spans = [0, 1] if t < SAMPLES // 100 else [1]
                worst[i - 1, spans] = np.maximum(worst[i - 1, spans], found)
    for way, (early, late) in zip(list(WAYS)[1:], worst):
        print(f"| {name} | {way} | {early[0]:.0e} | {late[0]:.0e} | {late[1]:.0e} | {late[2]:.0e} |")


def main():
    """Print both tables."""
    print("| estimator | rows | bytes a series | one sample a call, ns | 500 a call, ns |\n|---|---|---|---|---|")
    speed("`Joint(3)`", dw.Joint(3))
    speed("`ARX(2, 2)`", dw.ARX(2, 2))
    spans = f"theta, {SAMPLES // 100} samples | theta, {SAMPLES}"
    print(f"\n| estimator | rows | {spans} | P | prediction |\n|---|---|---|---|---|---|")
    for offset in (0.0, 1e3):
        y, u = data(offset, np.random.default_rng(2))
        where = f", y about {offset:g}" if offset else ""
        for memory in (dw.Constant(), dw.ExponentialForgetting(0.99), dw.RandomWalk(1e-4)):
            errors(f"`ARX(2, 2, memory={type(memory).__name__})`{where}", dw.ARX(2, 2, memory=memory), y, u)
        errors(f"`Joint(3)`{where}", dw.Joint(3), y, u)
    few = [Series(dw.Joint(3), 1, *WAYS["stored in 32"]) for _ in range(2)]
    y = np.random.default_rng(3).standard_normal((100, 1))
    none = np.empty((100, 0))
    few[0].take(np.array([0, 100]), y, none)
    for cut in (slice(0, 50), slice(50, 100)):
        few[1].take(np.array([0, 50]), y[cut], none[cut])
    print(f"\nstored in 32, one record in one call and in two: equal {np.array_equal(few[0].rows, few[1].rows)}")


if __name__ == "__main__":
    main()
