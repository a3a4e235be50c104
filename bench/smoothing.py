"""Every sample in the light of the later ones: against the scan, against filterpy, and what it holds in memory."""

from __future__ import annotations

import tracemalloc
from collections.abc import Iterator

import numpy as np

import driftwise as dw
from driftwise.estimators.joint.smoother import smooth

from .clock import cpu, ratio
from .opponents import FilterPy
from .plant import VARIANCE, joint, record
from .verdicts import Verdict, at_most, for_information, not_measured

SOURCE = "bench/smoothing.py"


def verdicts() -> Iterator[Verdict]:
    """Yield the cost of smoothing Joint(3) with input and direct term (N = 10), and its memory."""
    yield from _against_scan()
    yield from _against_filterpy()
    yield from _memory()


def _against_scan(samples: int = 5_000) -> Iterator[Verdict]:
    y, u = record(samples)
    for noise in ("EquationError", "OutputError"):
        est = joint(noise)
        value, ours, theirs = ratio(lambda: est.smooth(y, u), lambda: est.scan(y, u), rounds=9)
        note = f"{ours / samples * 1e6:.2f} us a sample, scan {theirs / samples * 1e6:.2f} us; both keep std"
        yield for_information(f"smooth, whole record, {noise}", value, "x scan", SOURCE, note)
    est = joint("EquationError")
    value, ours, theirs = ratio(lambda: est.smooth(y, u, lag=20), lambda: est.scan(y, u), rounds=5)
    note = f"{ours / samples * 1e6:.1f} us a sample, scan {theirs / samples * 1e6:.2f} us; both keep std"
    yield for_information("smooth, fixed lag 20, EquationError", value, "x scan", SOURCE, note)


def _against_filterpy(samples: int = 1_000) -> Iterator[Verdict]:
    """Noise on every state, so that filterpy may invert P; without it P is singular."""
    name = "smooth, filterpy's time over ours"
    Q, y, u = 0.01 * np.eye(3), *record(samples)
    est = dw.Joint(3, 1, True, noise=dw.models.NoiseCovariance(Q, np.zeros(3), VARIANCE), P0=10.0)
    opponent = FilterPy(est, y, u, Q)
    try:
        mean, std = opponent.smooth()
    except ImportError:
        yield not_measured(name, "no budget (x)", SOURCE, "filterpy is not installed: pip install .[bench]")
        return
    ours = est.smooth(y, u)
    np.testing.assert_allclose(np.column_stack([ours.x, ours.parameters]), mean, atol=1e-6)
    np.testing.assert_allclose(np.column_stack([ours.x_std, ours.parameters_std]), std, atol=1e-6)
    seconds = np.array([[cpu(opponent.smooth), cpu(lambda: est.smooth(y, u))] for _ in range(5)])
    each = np.median(seconds, axis=0) / samples * 1e6
    note = f"filterpy's filter and RTS {each[0]:.0f} us a sample, ours {each[1]:.1f} us; noise on every state"
    value = float(np.median(seconds[:, 0] / seconds[:, 1]))
    yield for_information(name, value, "x", SOURCE, note).beside("filterpy", 1 / value)


def _memory(short: int = 20_000, long: int = 100_000) -> Iterator[Verdict]:
    est = joint("EquationError")
    est.smooth(*record(100))
    peaks = []
    for samples in (short, long):
        y, u = record(samples)
        outs, inputs, start = np.empty((samples, 2 * est.model.N)), u[:, None], est.start()
        tracemalloc.start()
        smooth(est, y, inputs, start, None, outs)
        peaks.append(tracemalloc.get_traced_memory()[1] / 1e6)
        tracemalloc.stop()
    states = long * est.dtype.itemsize / 1e6
    note = f"beyond record and result; all states would be {states:.0f} MB"
    yield for_information(f"smooth, {long} samples: peak memory", peaks[1], "MB", SOURCE, note)
    note = f"{peaks[1]:.2f} and {peaks[0]:.2f} MB"
    yield at_most(f"smooth: peak memory, {long} samples over {short}", peaks[1] / peaks[0], 1.05, "x", SOURCE, note)
