"""What each memory costs beside none: ARX(2, 2)."""

from __future__ import annotations

from collections.abc import Iterator

import driftwise as dw

from .clock import ratio
from .verdicts import Verdict, for_information

SOURCE = "bench/memories.py"
MEMORIES = (
    dw.LimitedGain(100),
    dw.Weighted(0.99),
    dw.VariableForgetting(),
    dw.DirectionalForgetting(0.99),
    dw.Walk(1e-6),
    dw.UntilJump(dw.Score(), dw.GainReset()),
    dw.Window(100),
    dw.RunLengths(0.1, 500),
)


def verdicts(samples: int = 10_000) -> Iterator[Verdict]:
    """Yield the overhead of each memory: the same record, scan with std."""
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=samples, noise_std=0.1, noise="equation", seed=1)
    plain = dw.ARX(2, 2)
    for memory in MEMORIES:
        est = dw.ARX(2, 2, memory=memory)
        value, ours, theirs = ratio(lambda: est.scan(y, u), lambda: plain.scan(y, u), rounds=7)
        note = f"{ours / samples * 1e9:.0f} ns a sample, Never {theirs / samples * 1e9:.0f} ns"
        yield for_information(f"ARX(2, 2), memory {type(memory).__name__}", value, "x Never", SOURCE, note)
