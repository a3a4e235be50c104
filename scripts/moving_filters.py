"""Measure how output error, Box-Jenkins and ARMAX keep up with cells whose R0 jumps: docs/decisions/moving-filters.md.

    python scripts/moving_filters.py [--cells 100] [--seed 21]

Cells as in examples/gallery/battery.py, at rest with their parameters or with R0 jumping by 30 %.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

import driftwise as dw

sys.path.insert(0, str(Path(__file__).parents[1] / "examples" / "gallery"))
from battery import OCV, cell

FAMILIES = {
    "OE": lambda memory: dw.OE(2, 1, 0, memory=memory),
    "BJ": lambda memory: dw.BJ(2, 1, 1, 1, 0, memory=memory),
    "ARMAX": lambda memory: dw.ARMAX(1, 2, 1, 0, memory=memory),
    "ARX": lambda memory: dw.ARX(1, 2, 0, memory=memory),
}
MEMORIES = {
    "AutoMemory": dw.AutoMemory(),
    "IMM": dw.memory.IMM(),
    "MultipleModel": dw.memory.MultipleModel(),
    "LikelihoodDrift": dw.memory.LikelihoodDrift(),
    "BayesianChangePoint": dw.memory.BayesianChangePoint(0.01, 1500),
    "RestartOnChange": dw.RestartOnChange(response=dw.memory.CovarianceInflation(0.02)),
}


def measure(family, memory, cells, jump, seed):
    """Return error in bars at the end (cells,), coverage of b0 by two bars, median and largest NIS, error in %."""
    off, cover, nis, error = [], [], [], []
    for number in range(cells):
        voltage, current, R0, *_ = cell(number, jump=jump, seed=seed)
        trace = FAMILIES[family](memory).scan(voltage - OCV, current)
        at = list(trace.names).index("b0")
        b0, bar = trace.parameters[:, at], trace.parameters_std[:, at]
        bars = np.abs(b0 - R0) / bar
        off.append(bars[-1])
        cover.append(np.mean(bars[300:] < 2.0))
        nis.append(np.mean((trace.innovation**2 / trace.variance)[-500:]))
        error.append(100.0 * abs(b0[-1] / R0[-1] - 1.0))
    return np.array(off), np.mean(cover), np.median(nis), np.max(nis), np.median(error)


def main() -> None:
    """Print a line for each family and memory."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, default=100)
    parser.add_argument("--seed", type=int, default=21)
    parser.add_argument("--memory", nargs="*", default=list(MEMORIES), choices=list(MEMORIES))
    given = parser.parse_args()
    print("| memory | family | R0 | in two bars | worst, bars | coverage | NIS, median and worst | error of b0, % |")
    print("|---|---|---|---|---|---|---|---|")
    for name in given.memory:
        for family in FAMILIES:
            for jump in (1.0, 1.3):
                off, cover, nis, worst, error = measure(family, MEMORIES[name], given.cells, jump, given.seed)
                within = np.mean(off < 2.0)
                words = "rests" if jump == 1.0 else "jumps"
                print(
                    f"| `{name}` | `{family}` | {words} | {within:.2f} | {np.max(off):.1f} | {cover:.3f} | "
                    f"{nis:.2f}, {worst:.3g} | {error:.3f} |"
                )


if __name__ == "__main__":
    main()
