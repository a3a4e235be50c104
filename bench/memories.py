"""What each memory costs beside none: ARX(2, 2)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import driftwise as dw

from .clock import ratio
from .verdicts import Verdict, at_least, at_most, for_information

SOURCE = "bench/memories.py"
MEMORIES = (
    dw.memory.GainFloor(100),
    dw.ExponentialForgetting(0.99),
    dw.memory.VariableForgetting(),
    dw.memory.DirectionalForgetting(0.99),
    dw.RandomWalk(1e-6),
    dw.RestartOnChange(dw.detect.ScoreCUSUM(), dw.memory.GainReset()),
    dw.memory.Window(100),
    dw.memory.BayesianChangePoint(0.1, 500),
    dw.memory.Drift(nvr=1e-3),
    dw.memory.FuzzyDrift(),
    dw.memory.CovarianceMatching(),
    dw.memory.AuxiliaryFilter(),
    dw.memory.AutocovarianceLS(),
    dw.memory.LikelihoodDrift(),
    dw.memory.VariationalBayes(rule="drift"),
    dw.memory.MultipleModel(),
    dw.memory.IMM(),
    dw.AutoMemory(),
)
MOST = 3.0  # us a sample of `AutoMemory`


def verdicts(samples: int = 10_000) -> Iterator[Verdict]:
    """Yield the overhead of each memory: the same record, scan with std."""
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=samples, noise_std=0.1, noise="equation", seed=1)
    plain = dw.ARX(2, 2)
    for memory in MEMORIES:
        est = dw.ARX(2, 2, memory=memory)
        value, ours, theirs = ratio(lambda: est.scan(y, u), lambda: plain.scan(y, u), rounds=7)
        note = f"{ours / samples * 1e9:.0f} ns a sample, Constant {theirs / samples * 1e9:.0f} ns"
        yield for_information(f"ARX(2, 2), memory {type(memory).__name__}", value, "x Constant", SOURCE, note)
        if isinstance(memory, dw.AutoMemory):
            yield at_most("AutoMemory, four parameters, a record", ours / samples * 1e6, MOST, "us a sample", SOURCE)
            lean, ours, _ = ratio(lambda: est.scan(y, u, keep="means"), lambda: _three_filters(y, u), rounds=3)
            note = f"filterpy's IMMEstimator of three filters with known speeds {ours / lean / samples * 1e6:.0f} us"
            yield at_least(
                "AutoMemory, filterpy's interacting filters' time over ours", 1 / lean, 100, "x", SOURCE, note
            ).beside("filterpy", lean)


def _three_filters(y, u) -> None:
    """filterpy's interacting bank of as many filters, whose speeds and noise are told."""
    from filterpy.kalman import IMMEstimator, KalmanFilter

    filters = []
    for q in (0.0, 1e-5, 1e-3):
        one = KalmanFilter(dim_x=4, dim_z=1)
        one.P *= 1e3
        one.R[:], one.Q = 0.01, q * np.eye(4)
        filters.append(one)
    bank = IMMEstimator(filters, np.full(3, 1 / 3), 0.0005 + (0.999 - 0.0005) * np.eye(3))
    for t in range(2, len(y)):
        row = np.array([[-y[t - 1], -y[t - 2], u[t - 1], u[t - 2]]])
        for one in bank.filters:
            one.H = row
        bank.predict()
        bank.update(y[t : t + 1])
