"""Physical parameters of four recorded plants: `GreyBox` on-line beside a batch fit of the whole record.

Each is written as formulas, with a walk of the state for what they leave out, and a noise: those that the batch fit of
the same record finds (`prediction_error.fit`), rounded.

Run: python -m driftwise_studies.score.tasks.physical FOLDER
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np

import driftwise as dw
from driftwise.estimators.grey_box.start import BatchStart

from ...papers.verdict import Verdict
from ..records import columns
from . import carriage_batch
from .cells import edges
from .prediction_error import Found, Linear, fit

PAGE = "docs/plants.md"
CARRIAGE = """
name = "carriage"
[states]
q = {unit = "m", std = 1e-3}
v = {unit = "m/s", std = 1e-3, walk = 2.1e-3}
[inputs]
u = {unit = "V"}
[outputs]
position = {unit = "m", noise = 3.8e-8}
[parameters]
M = {unit = "kg", start = 50}
Fv = {unit = "N s/m", start = 100}
Fc = {unit = "N", start = 10}
offset = {unit = "N", start = 0, free = true, std = 10}
gain = {unit = "N/V", start = 35.15065188, fixed = true}
[formulas]
dq = "v"
dv = "(gain * u - Fv * v - Fc * sign(v) - offset) / M"
position = "q"
"""
HEATED = """
name = "heated"
[states]
T = {unit = "degC", start = 129, std = 1}
lamp = {unit = "degC", start = 129, std = 30, walk = 0.64}
[inputs]
u = {unit = "V"}
[outputs]
seen = {unit = "degC", noise = 0.085}
[parameters]
gain = {unit = "K/V", start = 20}
tau = {unit = "s", start = 100}
lag = {unit = "s", start = 10}
ambient = {unit = "degC", start = 20, free = true, std = 10.2}
[formulas]
dT = "(lamp - T) / lag"
dlamp = "(gain * u + ambient - lamp) / tau"
seen = "T"
"""
SOLDER = """
name = "solder"
[states]
T = {unit = "degC", start = 200, std = 5, walk = 0.45}
[inputs]
set = {unit = "degC"}
[outputs]
seen = {unit = "degC", noise = 0.67}
[parameters]
gain = {unit = "1", start = 0.5}
tau = {unit = "s", start = 50}
ambient = {unit = "degC", start = 50, free = true, std = 25.5}
[formulas]
dT = "(ambient + gain * set - T) / tau"
seen = "T"
"""
CELL = """
name = "cell"
[states]
v1 = {unit = "V", std = 0.01}
rest = {unit = "V", start = 3.327, std = 0.1, walk = 4.7e-4}
[inputs]
i = {unit = "A"}
[outputs]
v = {unit = "V", noise = 2.9e-4}
[parameters]
R0 = {unit = "Ohm", start = 0.0015}
R1 = {unit = "Ohm", start = 0.001}
C1 = {unit = "F", start = 50000}
bulk = {unit = "F", start = 150000}
[formulas]
dv1 = "(i - v1 / R1) / C1"
drest = "i / bulk"
v = "rest + R0 * i + v1"
"""
BATCH = {
    "heated": Linear(
        {"gain": (20, 5), "tau": (100, 5), "lag": (10, 5), "ambient": (20, -10.2)},
        lambda x, u, p: [(x[1] - x[0]) / p["lag"], (p["gain"] * u + p["ambient"] - x[1]) / p["tau"]],
        lambda x, u, p: x[0], ((129.0, 1.0), (129.0, 30.0)), lambda p: [0.0, 0.64], lambda p: 0.085,
    ),
    "solder": Linear(
        {"gain": (0.5, 5), "tau": (50, 5), "ambient": (50, -25.5)},
        lambda x, u, p: [(p["ambient"] + p["gain"] * u - x[0]) / p["tau"]],
        lambda x, u, p: x[0], ((200.0, 5.0),), lambda p: [0.45], lambda p: 0.67,
    ),
    "cell": Linear(
        {"R0": (0.0015, 5), "R1": (0.001, 5), "C1": (50000, 5), "bulk": (150000, 5)},
        lambda x, u, p: [(u - x[0] / p["R1"]) / p["C1"], u / p["bulk"]],
        lambda x, u, p: x[1] + x[0] + p["R0"] * u, ((0.0, 0.01), (3.327, 0.1)),
        lambda p: [0.0, 4.7e-4], lambda p: 2.9e-4,
    ),
}  # fmt: skip


def _verdict(name: str, value: str, expected: str, confirmed) -> Verdict:
    return Verdict(name, value, expected, bool(confirmed), PAGE)


class Beside(NamedTuple):
    """End values of a record, by name."""

    ours: dict[str, tuple[float, float]]  # value and deviation
    batch: Found
    trace: object

    @property
    def off(self) -> dict[str, float]:
        """How many of its bars each value is from the batch fit's."""
        return {n: abs(v - self.batch.values[n]) / self.batch.bars[n] for n, (v, _) in self.ours.items()}

    def __str__(self):
        return ", ".join(
            f"{n} {v:.4g} +- {s:.2g} ({self.batch.values[n]:.4g} +- {self.batch.bars[n]:.2g})"
            for n, (v, s) in self.ours.items()
        )


def heating(where: Path):
    """Return instants, drive and temperature of the heating system."""
    table = columns(where / "heating_system.csv")
    return tuple(np.asarray(table[name], float) for name in ("t_s", "drive_V", "temp_degC"))


def soldering(where: Path):
    """Return instants, set point and temperature; drop-outs are missing, an absurd set point is the one before."""
    rows = [line.split(",") for line in (where / "soldering_station.csv").read_text().splitlines()[1:]]
    stamps = np.array([np.datetime64(row[0]) for row in rows])
    wanted, seen = (np.array([float(row[k] or "nan") for row in rows]) for k in (1, 2))
    for k in np.flatnonzero(~((wanted > 0) & (wanted < 1000))):
        wanted[k] = wanted[k - 1]
    return (stamps - stamps[0]) / np.timedelta64(1, "s"), wanted, np.where(seen < 60, np.nan, seen)


def leaf(where: Path, name: str = "leaf_cell_hppc_25C.csv"):
    """Return instants, current and voltage of a cell, as they were recorded."""
    table = columns(where / name)
    return tuple(np.asarray(table[name], float) for name in ("t_s", "current_A", "voltage_V"))


def beside(text: str, t, u, y) -> Beside:
    """Return the end values of `GreyBox` and those of the batch fit with the same walk and noise."""
    est = dw.GreyBox(text)
    trace = est.scan(y, u, time=t)
    ours = zip(est.names, trace.parameters[-1], trace.parameters_std[-1])
    found = fit(BATCH[est.formulas.name], t, u, y)
    return Beside({name: (float(v), float(s)) for name, v, s in ours}, found, trace)


def heating_system(where: Path) -> list[Verdict]:
    """Gain, time constant, lag and ambient temperature of a lamp and its thermocouple."""
    found = beside(HEATED, *heating(where))
    return [_verdict("heating system: ours (batch)", str(found), "within 1 bar", max(found.off.values()) <= 1)]


def soldering_station(where: Path) -> list[Verdict]:
    """Gain, time constant and ambient temperature of a soldering iron, from raw uneven samples."""
    found = beside(SOLDER, *soldering(where))
    return [_verdict("soldering station: ours (batch)", str(found), "within 1 bar", max(found.off.values()) <= 1)]


def cell(where: Path) -> list[Verdict]:
    """R0 while the cell is emptied, against what each edge of the current shows; all values at the end."""
    t, current, voltage = leaf(where)
    found = beside(CELL, t, current, voltage)
    error = pulses(t, current, voltage)
    value = f"median {np.median(error):.3f} mOhm, worst {error.max():.3f}, {len(error)} edges"
    return [
        _verdict("cell: ours (batch)", str(found), "within 1 bar", max(found.off.values()) <= 1),
        _verdict("cell: R0", value, "median <= .08, worst <= .3", np.median(error) <= 0.08 and error.max() <= 0.3),
    ]


def pulses(t, current, voltage) -> np.ndarray:
    """Return the error of R0 in mOhm 5 s after each edge of the current, against what the edge itself shows.

    Parameters may change by 6 % an hour: a walk of 1e-6 in the square of their logarithms a second.
    """
    trace = dw.GreyBox(CELL, memory=dw.RandomWalk(1e-6)).scan(voltage, current, time=t)
    seen = edges(current)
    truth = np.array([(voltage[b] - voltage[a]) / (current[b] - current[a]) for a, b in seen])
    at = np.array([np.searchsorted(t, t[b] + 5.0, side="right") - 1 for _, b in seen])
    return 1e3 * np.abs(trace.parameters[at, 0] - truth)


def carriage(where: Path) -> list[Verdict]:
    """Mass, viscous and Coulomb friction of a positioning drive, beside those that its authors published."""
    table = columns(where / "emps_train.csv")
    u, position, t = (np.asarray(table[name], float) for name in ("u_V", "position_m", "t_s"))
    trace = dw.GreyBox(CARRIAGE, start=BatchStart(1000)).scan(position, u, time=t)  # it rests for the first half second
    ends = zip(trace.estimator.names, trace.parameters[-1], trace.parameters_std[-1])
    both = Beside({n: (float(v), float(s)) for n, v, s in ends}, carriage_batch.fit(u, position), trace)
    found = [_verdict("carriage: ours (batch)", str(both), "within 1 bar", max(both.off.values()) <= 1)]
    for name, published, share in (("M", 95.1089, 0.01), ("Fv", 203.5034, 0.03), ("Fc", 20.3935, 0.05)):
        j = trace.estimator.names.index(name)
        value, std = trace.parameters[-1, j], trace.parameters_std[-1, j]
        off = value - published
        said = f"{value:.2f} +- {std:.2f}: {100 * off / published:+.2f} %, {abs(off) / std:.1f} bars"
        expected = f"{published} within {100 * share:g} %"
        found.append(_verdict(f"carriage: {name}", said, expected, abs(off) <= share * published))
        found.append(_verdict(f"carriage: bar of {name}", said, f"{published} within 2 bars", abs(off) <= 2 * std))
    return found


TASKS = {
    "emps_train.csv": carriage,
    "leaf_cell_hppc_25C.csv": cell,
    "heating_system.csv": heating_system,
    "soldering_station.csv": soldering_station,
}

if __name__ == "__main__":
    for file, task in TASKS.items():
        where = Path(sys.argv[1])
        for one in task(where) if (where / file).exists() else [_verdict(file, "skipped: not there", "", False)]:
            print(f"{'met' if one.confirmed else 'MISSED':6} {one.name}: {one.value} ({one.expected})")
