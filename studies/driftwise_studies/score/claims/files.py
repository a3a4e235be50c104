"""A record as a file: headers, clocks, separators and idle columns as people write them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .plant import Plant
from .simulation import Record

OUTPUTS = "temperature [degC]", "level_m", "pressure (bar)", "speed [rpm]", "Temperatur [°C]", "outlet_temp"
INPUTS = "heater [%]", "valve [%]", "pump_voltage [V]", "fan_power (W)", "Ventil [%]", "heater_current [A]"
ODD = "x1", "ch2", "sensor_7", "Kanal 3", "A", "signal_b", "v_17", "col9"
START = np.datetime64("2023-03-01T00:00:00")


@dataclass(frozen=True)
class Written:
    """What stands in the file: who is who, and whether a name says so."""

    path: Path
    output: str
    inputs: tuple[str, ...]
    time: str | None
    is_named: bool  # by the published vocabulary
    dt: float  # seconds between instants of the grid, 1 where the file has no clock
    idle: tuple[str, ...]


def write(plant: Plant, record: Record, seed: int, folder: Path) -> Written:
    """Write the record of a plant as a CSV of some dialect."""
    rng = np.random.default_rng([seed, plant.number, 24])
    k, rows = len(plant.gains), record.rows
    is_named = bool(rng.random() < 0.75)
    if is_named:
        output, inputs = str(rng.choice(OUTPUTS)), tuple(rng.choice(INPUTS, k, replace=False).tolist())
    else:
        output, *inputs = rng.choice(ODD, k + 1, replace=False).tolist()
    clock = str(rng.choice(["seconds", "stamps", "stamps", "none"]))
    if plant.is_irregular and clock == "none":
        clock = "stamps"
    comma = bool(rng.random() < 0.25)
    columns: dict[str, list[str]] = {}
    for name, values in zip((output, *inputs), (record.y, *record.u.T)):
        columns[str(name)] = [_cell(v, comma) for v in values[rows]]
    idle = _idle(rng, rows, columns)
    order = [str(name) for name in rng.permutation(list(columns))]
    time = {"seconds": "time_s", "stamps": str(rng.choice(["Time", "timestamp", "Datum"])), "none": None}[clock]
    if clock == "seconds":
        columns["time_s"] = [_cell(plant.dt * t, comma) for t in rows]
    elif time:
        stamps = START + np.round(1000 * plant.dt * rows).astype(int).astype("timedelta64[ms]")
        form = str(rng.choice(["T", " "]))
        columns[time] = [str(s).replace("T", form) for s in stamps]
    order = ([time] if time else []) + order
    separator = ";" if comma else str(rng.choice([",", ",", ";", "\t"]))
    lines = [separator.join(order), *(separator.join(cells) for cells in zip(*(columns[name] for name in order)))]
    path = folder / f"plant{plant.number}.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    dt = plant.dt if time else 1.0
    return Written(path, output, tuple(map(str, inputs)), time, is_named, dt, idle)


def _idle(rng, rows, columns) -> tuple[str, ...]:
    """Put columns into the table that play no part, and return their names."""
    before = set(columns)
    if rng.random() < 0.3:
        columns["status"] = ["0"] * len(rows)
    if rng.random() < 0.2:
        columns["record_id"] = [str(1000 + i) for i in range(len(rows))]
    if rng.random() < 0.2:
        columns["remark"] = ["ok" if v < 0.9 else "" for v in rng.random(len(rows))]
    return tuple(set(columns) - before)


def _cell(value: float, comma: bool) -> str:
    text = "" if np.isnan(value) else f"{value:.6g}" if abs(value) < 1e5 else f"{value:.10g}"
    return text.replace(".", ",") if comma else text
