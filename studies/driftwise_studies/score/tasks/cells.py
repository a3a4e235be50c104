"""Two battery cells: the ohmic resistance of one from uneven samples, the capacity of another from cycle to cycle."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.stats import t as student

import driftwise as dw

from ...papers.verdict import Verdict, numbers
from ..records import columns
from .verdicts import needs, verdict

PULSES, CYCLES = "leaf_cell_hppc_25C.csv", "nasa_battery_B0005.csv"
TAU = 60.0  # s, of the slow voltage behind R1
AFTER = 5.0  # s, from an edge of the current to the look at R0
EDGE, SETTLED = 10.0, 0.3  # A: what is an edge, and what no longer
RARE = 1e-3  # of the cycles may be told falsely
RECOVERIES = (48, 90)


def slow_current(t, current) -> np.ndarray:
    """Return the current through a first-order lag of TAU, exact for a current that is held between the samples."""
    keep = np.exp(-np.diff(t) / TAU)
    lagged = np.zeros(len(t))
    for k, share in enumerate(keep):
        lagged[k + 1] = share * lagged[k] + (1 - share) * current[k]
    return lagged


def edges(current) -> list[tuple[int, int]]:
    """Return (last sample before, first sample after) of each edge of the current."""
    found = []
    for before in np.flatnonzero(np.abs(np.diff(current)) > EDGE):
        after = before + 1
        while after + 1 < len(current) and abs(current[after + 1] - current[after]) > SETTLED:
            after += 1
        found.append((int(before), int(after)))
    return found


def ohmic(t, voltage, current):
    """Return R0 in ohm after each increment (T - 1,), and its trace.

    dV = R0 dI + R1 d(slow I) + dOCV, where the open-circuit voltage wanders: its increments are independent, of a
    variance that grows with the time between the samples. Divided by the root of that time, all count alike.
    """
    root = np.sqrt(np.diff(t))
    y = np.diff(voltage) / root
    phi = np.column_stack([np.diff(current), np.diff(slow_current(t, current))]) / root[:, None]
    trace = dw.Regression(["R0", "R1"], memory=dw.AutoMemory()).scan(y, phi)
    return trace.parameters[:, 0], trace


@needs(PULSES, (17, "battery cell: R0 against the edges"))
def resistance(where: Path) -> list[Verdict]:
    """Row 17: the ohmic resistance against what each edge of the current shows, uneven stamps as they are."""
    table = columns(where / PULSES)
    t, voltage, current = (np.asarray(table[name], float) for name in ("t_s", "voltage_V", "current_A"))
    R0, _ = ohmic(t, voltage, current)
    seen = edges(current)
    truth = np.array([(voltage[b] - voltage[a]) / (current[b] - current[a]) for a, b in seen])
    at = np.array([np.searchsorted(t[1:], t[b] + AFTER, side="right") - 1 for _, b in seen])
    error = 1e3 * np.abs(R0[at] - truth)
    value = f"median {np.median(error):.3f} mOhm, worst {error.max():.3f}, {len(seen)} edges"
    return [verdict(17, "battery cell: R0 5 s after an edge", value, "median <= .08 mOhm", np.median(error) <= 0.08)]


def capacities(where: Path) -> np.ndarray:
    """Return the capacity of each discharge in Ah."""
    table = columns(where / CYCLES)
    cycle, t, current = (np.asarray(table[name], float) for name in ("cycle", "t_s", "current_A"))
    return np.array([-np.trapezoid(current[cycle == c], t[cycle == c]) / 3600 for c in np.unique(cycle)])


@needs(CYCLES, (18, "ageing cell: capacity"))
def ageing(where: Path) -> list[Verdict]:
    """Row 18: the capacity is a random walk that fades steadily; a recovery is what such a walk hardly ever does."""
    capacity = capacities(where)
    lost, one = np.diff(capacity), np.ones((len(capacity) - 1, 1))
    trace = dw.Regression(["fade"]).scan(lost, one)
    rms = float(np.sqrt(np.mean(trace.innovation**2)))
    chance = 2 * student.sf(np.abs(trace.innovation) / np.sqrt(trace.variance), trace.dof)
    told = (np.flatnonzero(chance < RARE) + 2).tolist()  # cycles count from 1
    others = [cycle for cycle in told if cycle not in RECOVERIES]
    auto = dw.Regression(["fade"], memory=dw.AutoMemory()).scan(lost, one)
    doubted = np.flatnonzero(auto.status & int(dw.Status.OUTLIER | dw.Status.JUMP)) + 2
    return [
        verdict(18, "ageing cell: rms of the next capacity", f"{rms:.4f} Ah", "<= .0130 Ah", round(rms, 4) <= 0.0130),
        verdict(
            18,
            "ageing cell: recoveries told at one false alarm in 1000 cycles",
            f"cycles {numbers(told, 0)} (AutoMemory's outliers: {numbers(doubted, 0)})",
            "48 and 90, at most 2 others",
            set(RECOVERIES) <= set(told) and len(others) <= 2,
        ),
    ]
