"""Physical parameters of four recorded plants: `GreyBox` on-line beside a batch fit of the whole record.

Each is written as formulas, with a walk of one state for what they leave out. Nobody says how large: of a ladder of
factors about the state's own deviation over the record's length, that is taken which makes the record likeliest (then
with rungs half and a quarter as high), and so is the walk of the parameters, where they may change. The noise is what
the start finds. The batch fit takes the same.

Of the carriage one position in fifteen is taken, as dense as drawn plants are sampled (.03 of the fastest time
constant, of what is believed beforehand): a millisecond ahead one predicts how it vibrates, not how it is driven.

Run: python -m driftwise_studies.score.tasks.physical FOLDER
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import driftwise as dw
from driftwise.estimators.grey_box.start import BatchStart

from ...papers.verdict import Verdict
from ..plants.drawing import FAST
from ..records import columns
from . import carriage_batch
from .cells import edges
from .prediction_error import Found, Linear, fit

PAGE = "docs/plants.md"
CARRIAGE = """
name = "carriage"
[states]
q = {unit = "m", std = 1e-3}
v = {unit = "m/s", std = 1e-3, walk = WALK}
[inputs]
u = {unit = "V"}
[outputs]
position = {unit = "m"}
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
lamp = {unit = "degC", start = 129, std = 30, walk = WALK}
[inputs]
u = {unit = "V"}
[outputs]
seen = {unit = "degC"}
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
T = {unit = "degC", start = 200, std = 5, walk = WALK}
[inputs]
set = {unit = "degC"}
[outputs]
seen = {unit = "degC"}
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
v2 = {unit = "V", std = 0.01}
rest = {unit = "V", start = 3.327, std = 0.1, walk = WALK}
[inputs]
i = {unit = "A"}
[outputs]
v = {unit = "V"}
[parameters]
R0 = {unit = "Ohm", start = 0.0015}
R1 = {unit = "Ohm", start = 0.00075}
C1 = {unit = "F", start = 7000}
R2 = {unit = "Ohm", start = 0.0015}
C2 = {unit = "F", start = 130000}
bulk = {unit = "F", start = 150000}
[formulas]
dv1 = "(i - v1 / R1) / C1"
dv2 = "(i - v2 / R2) / C2"
drest = "i / bulk"
v = "rest + R0 * i + v1 + v2"
"""  # the library's battery with two pairs, resistances .15 of that one's, with what a discharge adds
PLANTS: dict[str, Any] = {  # by hand: the state that walks, its deviation, and the plant
    "heated": (
        1, 30.0,
        {"gain": (20, 5), "tau": (100, 5), "lag": (10, 5), "ambient": (20, -10.2)},
        lambda x, u, p: [(x[1] - x[0]) / p["lag"], (p["gain"] * u + p["ambient"] - x[1]) / p["tau"]],
        lambda x, u, p: x[0], ((129.0, 1.0), (129.0, 30.0)),
    ),
    "solder": (
        0, 5.0,
        {"gain": (0.5, 5), "tau": (50, 5), "ambient": (50, -25.5)},
        lambda x, u, p: [(p["ambient"] + p["gain"] * u - x[0]) / p["tau"]],
        lambda x, u, p: x[0], ((200.0, 5.0),),
    ),
    "cell": (
        2, 0.1,
        {
            "R0": (0.0015, 5), "R1": (0.00075, 5), "C1": (7000, 5), "R2": (0.0015, 5), "C2": (130000, 5),
            "bulk": (150000, 5),
        },
        lambda x, u, p: [(u - x[0] / p["R1"]) / p["C1"], (u - x[1] / p["R2"]) / p["C2"], u / p["bulk"]],
        lambda x, u, p: x[2] + x[1] + x[0] + p["R0"] * u, ((0.0, 0.01), (0.0, 0.01), (3.327, 0.1)),
    ),
}  # fmt: skip
RUNG, RUNGS = 10**0.5, 8  # of a ladder of walks, and how many are tried to either side
LADDERS = 3  # one after the other about the best so far, each with rungs half as high
EVERY = round(FAST[0] * 50 / 100 / 1e-3)  # positions of the carriage: M / Fv to begin with, 1 ms apart
SLOWEST = 1e-9  # walk of parameters in the square of their logarithms a second, where that ladder begins


def batch(name: str, walk: float, noise: float) -> Linear:
    """Return a plant for the batch fit, with the deviations of its walk and of its noise."""
    which, _, starts, slopes, output, x0 = PLANTS[name]
    walks = [walk if i == which else 0.0 for i in range(len(x0))]
    return Linear(starts, slopes, output, x0, lambda p: walks, lambda p: noise)


def climbed(made, value, factor: float, least: float = -RUNGS, ladders: int = 1):
    """Return made(factor^k) of the whole k where its value is largest, seen from k = 0: up, else down the ladder."""
    best, at = made(1.0), 1.0
    for _ in range(ladders):
        middle = at
        for way in (1, -1):
            for k in range(way, way * (RUNGS + 1), way):
                if k < least or not value(one := made(middle * factor**k)) > value(best):
                    break
                best, at = one, middle * factor**k
            if at != middle:
                break
        factor **= 0.5
    return best


def likeliest(text: str, size: float, t, u, y, start: Any = "batch"):
    """Return walk and trace of `GreyBox` with the walk that makes a record likeliest; ``size``: of that state."""
    unit = size / np.sqrt(t[-1] - t[0])

    def made(factor):
        walk = float(f"{unit * factor:.2g}")
        return walk, dw.GreyBox(text.replace("WALK", repr(walk)), start=start).scan(y, u, time=t)

    return climbed(made, lambda one: one[1].estimator.loglik(one[1].state), RUNG, ladders=LADDERS)


def _verdict(name: str, value: str, expected: str, confirmed) -> Verdict:
    return Verdict(name, value, expected, bool(confirmed), PAGE)


class Beside(NamedTuple):
    """End values of a record, by name."""

    ours: dict[str, tuple[float, float]]  # value and deviation
    batch: Found
    trace: Any

    def off(self, bars) -> float:
        """How many of some bars the value that is furthest from the batch fit's is away from it."""
        return max(abs(v - self.batch.values[n]) / bars[n] for n, (v, _) in self.ours.items())

    def verdict(self, name: str) -> Verdict:
        """Say how far the values are from the batch fit's."""
        each = ", ".join(
            f"{n} {v:.4g} +- {s:.2g} ({self.batch.values[n]:.4g} +- {self.batch.bars[n]:.2g})"
            for n, (v, s) in self.ours.items()
        )
        off, white = self.off(self.batch.bars), self.off(self.batch.white)
        said = f"{each}: at most {off:.2f} bars, {white:.2f} of those for white residuals"
        return _verdict(f"{name}: ours (batch)", said, "within 1 bar", off <= 1)


def noises(trace, walk: float) -> tuple[float, float]:
    """Return walk and noise as the filter knows them at its end."""
    scale = float(np.sqrt(trace.estimator.sigma2(trace.state)))
    return scale * walk, scale * float(trace.state["noise"][0])


def ends(trace) -> dict[str, tuple[float, float]]:
    """Return end values and their deviations, by name."""
    found = zip(trace.estimator.names, trace.parameters[-1], trace.parameters_std[-1])
    return {name: (float(v), float(s)) for name, v, s in found}


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


def beside(text: str, t, u, y, start: Any = "batch") -> Beside:
    """Return the end values of `GreyBox` and those of the batch fit with the same walk and noise."""
    name = dw.GreyBox(text.replace("WALK", "0.0")).formulas.name
    walk, trace = likeliest(text, PLANTS[name][1], t, u, y, start)
    return Beside(ends(trace), fit(batch(name, *noises(trace, walk)), t, u, y), trace)


def heating_system(where: Path) -> list[Verdict]:
    """Gain, time constant, lag and ambient temperature of a lamp and its thermocouple."""
    return [beside(HEATED, *heating(where)).verdict("heating system")]


def soldering_station(where: Path) -> list[Verdict]:
    """Gain, time constant and ambient temperature of a soldering iron, from raw uneven samples."""
    return [beside(SOLDER, *soldering(where)).verdict("soldering station")]


def cell(where: Path) -> list[Verdict]:
    """R0 while the cell is emptied, against what each edge of the current shows; all values at the end.

    The filter starts with the first pulses in hand: before them nothing moves.
    """
    t, current, voltage = leaf(where)
    found = beside(CELL, t, current, voltage, BatchStart(edges(current)[2][1] + 1))
    error = pulses(found.trace.estimator, t, current, voltage)
    value = f"median {np.median(error):.3f} mOhm, worst {error.max():.3f}, {len(error)} edges"
    return [
        found.verdict("cell"),
        _verdict("cell: R0", value, "median <= .08, worst <= .3", np.median(error) <= 0.08 and error.max() <= 0.3),
    ]


def pulses(est, t, current, voltage) -> np.ndarray:
    """Return the error of R0 in mOhm 5 s after each edge of the current, against what the edge itself shows.

    Parameters walk as fast as makes the record likeliest.
    """

    def made(factor):
        return est.replace(memory=dw.RandomWalk(SLOWEST * factor)).scan(voltage, current, time=t)

    trace = climbed(made, lambda trace: trace.estimator.loglik(trace.state), 10.0, least=0)
    seen = edges(current)
    truth = np.array([(voltage[b] - voltage[a]) / (current[b] - current[a]) for a, b in seen])
    at = np.array([np.searchsorted(t, t[b] + 5.0, side="right") - 1 for _, b in seen])
    return 1e3 * np.abs(trace.parameters[at, 0] - truth)


def driven(where: Path, every: int = EVERY) -> Beside:
    """Return the end values of a positioning drive, of one position in so many."""
    table = columns(where / "emps_train.csv")
    u, position, t = (np.asarray(table[name], float) for name in ("u_V", "position_m", "t_s"))
    position = np.where(np.arange(len(position)) % every == 0, position, np.nan)
    kept = every * dw.GreyBox(CARRIAGE.replace("WALK", "0.0")).starting.samples
    walk, trace = likeliest(CARRIAGE, 1e-3, t, u, position, BatchStart(kept))
    return Beside(ends(trace), carriage_batch.fit(u, position, *noises(trace, walk)), trace)


def carriage(where: Path) -> list[Verdict]:
    """Mass, viscous and Coulomb friction of a positioning drive, beside those that its authors published."""
    both = driven(where)
    found = [both.verdict("carriage")]
    for name, published, share in (("M", 95.1089, 0.01), ("Fv", 203.5034, 0.03), ("Fc", 20.3935, 0.05)):
        value, std = both.ours[name]
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
