"""The machine's limit for a fleet: C that knows the order, one series at a time or eight at once, beside a `Fleet`."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from functools import cache

import numpy as np

import driftwise as dw

from .clock import alternate
from .compiler import NATIVE, library, pointer
from .plant import VARIANCE
from .verdicts import Verdict, for_information, not_measured

SOURCE = "bench/lanes.py"
WHY = {
    1: "no status, no logarithm, nothing may be missing; products and sums are fused",
    8: "no status, no logarithm, nothing may be missing; states stay side by side, ours are put there and back",
}


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


def verdicts(series: int = 64, samples: int = 500) -> Iterator[Verdict]:
    """Yield the time of a fleet over that of C, one series at a time and eight at once."""
    est = dw.Joint(3, noise=dw.models.EquationError(VARIANCE))
    y = np.stack([dw.simulate([-1.5, 0.9, -0.3], samples=samples, noise_std=0.1, seed=k)[0] for k in range(8)])
    y = np.tile(y, (series // 8, 1))
    at, ys, us = np.repeat(np.arange(series), samples), y.reshape(-1, 1), np.empty((y.size, 0))
    for lanes in (1, 8):
        fleet = dw.Fleet(est, range(series), threads=1, lanes=lanes == 8)
        fresh = fleet.states.copy()

        def ours():
            fleet.states[:] = fresh
            return fleet.advance(at, ys, us)

        name = f"fleet of Joint(3), no input, C {'one series at a time' if lanes == 1 else 'eight series at once'}"
        try:
            theirs = Lanes(est, y, lanes)
        except OSError as error:
            yield not_measured(name, "no budget (x C)", SOURCE, str(error))
            continue
        np.testing.assert_allclose(ours().reshape(series, samples, 4)[:, :, :3], theirs.answer(), rtol=1e-9, atol=1e-9)
        seconds = alternate(ours, theirs, rounds=15)
        ratio = float(np.median(seconds[:, 0] / seconds[:, 1]))
        each = np.median(seconds, axis=0) / y.size * 1e9
        note = f"ours {each[0]:.0f} ns a sample, C {each[1]:.1f} ns"
        yield for_information(name, ratio, "x C", SOURCE, note).beside("C -O3 -march=native", ratio, WHY[lanes])
