"""The recordings: how each becomes an output and inputs, and what is known of it. Files lie in ``DRIFTWISE_DATA``.

The one place of the package that knows recordings by name. Nothing of ours is told any of it: an estimator sees
``y``, ``u`` and ``time``.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from driftwise.engine.errors import InputError


class Record(NamedTuple):
    """One output, its inputs, and seconds (or years, cycles) since the first sample where they are known."""

    y: np.ndarray  # (T,)
    u: np.ndarray  # (T, m)
    time: np.ndarray | None = None


def folder(given: str | Path | None = None) -> Path:
    """Return where the recordings lie, or should lie: ``given``, ``DRIFTWISE_DATA``, or a neighbour of the project."""
    default = Path(__file__).resolve().parents[4] / "shared" / "data"
    found = Path(given or os.environ.get("DRIFTWISE_DATA") or default)
    return found if found.name == "sysid" else found / "sysid"


def columns(path: Path, delimiter: str = ",") -> dict[str, np.ndarray]:
    """Return the columns of a CSV by name; an empty cell is NaN, a time is a datetime64."""
    from pyarrow import csv

    try:
        table = csv.read_csv(path, parse_options=csv.ParseOptions(delimiter=delimiter))
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be read: {error}. Is DRIFTWISE_DATA the folder of recordings?") from None
    return {name: column.to_numpy() for name, column in zip(table.column_names, table.columns)}


def filled(x, most: int | None = None) -> np.ndarray:
    """Return a column whose gaps are bridged by straight lines; of a gap, its first ``most`` samples."""
    known = np.flatnonzero(np.isfinite(x))
    line = np.interp(np.arange(len(x)), known, x[known])
    if most is not None:
        before = np.searchsorted(known, np.arange(len(x)), side="right") - 1
        line[(before < 0) | (np.arange(len(x)) - known[before] > most)] = np.nan
    return line


def stack(table, names) -> np.ndarray:
    """Return columns side by side, (T, m)."""
    return np.column_stack([np.asarray(table[name], float) for name in names])


# --- one function each -------------------------------------------------------------------------------------


def plain(file: str, y: str, *u: str, dt: float = 1.0) -> Callable[[Path], Record]:
    """Return a reader of a file that can be used as it is."""

    def read(where: Path) -> Record:
        table = columns(where / file)
        inputs = stack(table, u) if u else np.zeros((len(table[y]), 0))
        return Record(np.asarray(table[y], float), inputs, dt * np.arange(len(inputs)))

    return read


def gas_sensor(where: Path) -> Record:
    """Return NO2 and three sensors: rows without a gap, one after the other."""
    table = stack(columns(where / "air_quality_sensors.csv"), ["NO2(GT)", "PT08.S4(NO2)", "T", "AH"])
    table = table[np.isfinite(table).all(axis=1)]
    return Record(table[:, 0], table[:, 1:])


def hanging_load(where: Path) -> Record:
    """Return every fifth row, .1 s."""
    y, u, time = plain("hydraulic_hanging_load.csv", "position", "reference", dt=0.02)(where)
    return Record(y[::5], u[::5], None if time is None else time[::5])


def drive(where: Path) -> Record:
    """Return mean velocity over 10 ms in mm/s; mean voltage, and the sign of the velocity before."""
    table = columns(where / "emps_train.csv")
    position, voltage = 1e3 * table["position_m"], table["u_V"]
    n = (len(position) - 1) // 10
    v = np.diff(position[: 10 * n + 1 : 10]) / 0.01
    u = voltage[: 10 * n].reshape(n, 10).mean(axis=1)
    return Record(v, np.column_stack([u, np.sign(np.r_[0.0, v[:-1]])]), 0.01 * np.arange(n))


def cell_of(file: str) -> Callable[[Path], Record]:
    """Return a reader of voltage and current of a cell, held to 1 s, from 60 s before the first discharge."""

    def read(where: Path) -> Record:
        table = columns(where / file)
        t, current = np.asarray(table["t_s"], float), np.asarray(table["current_A"], float)
        start = t[np.argmax(current < -1)] - 60
        grid = np.arange(start, t[-1] + 0.5, 1.0)
        at = np.searchsorted(t, grid, side="right") - 1
        return Record(np.asarray(table["voltage_V"], float)[at], current[at, None], grid - start)

    return read


def heat_load(name: str) -> Callable[[Path], Record]:
    """Return a reader of the heat load of one house, or the mean of sixteen, gaps bridged."""

    def read(where: Path) -> Record:
        table = columns(where / "building_heat_load.csv")
        u = np.column_stack([filled(table[c]) for c in ("Ta_obs_degC", "I_obs_Wm2")])
        return Record(filled(table[name]), u, 3600.0 * np.arange(len(u)))

    return read


def groundwater(where: Path) -> Record:
    """Return weekly means of the head, river, rain and evaporation, gaps of up to four weeks bridged."""
    table = stack(columns(where / "mur_groundwater.csv"), ["head_m", "river_m", "prec_mm", "evap_mm"])
    T = -(-len(table) // 7)
    days = np.full((7 * T, 4), np.nan)
    days[: len(table)] = table
    known = np.isfinite(days.reshape(T, 7, 4))
    with np.errstate(invalid="ignore"):
        means = np.nansum(days.reshape(T, 7, 4), axis=1) / known.sum(axis=1)
    weeks = np.column_stack([filled(c, 4) for c in means.T])
    whole = np.isfinite(weeks).all(axis=1)
    return Record(weeks[whole, 0], weeks[whole, 1:], 604800.0 * np.flatnonzero(whole))


def river_only(where: Path) -> Record:
    """Return head and river stage: the first-order plant whose gain is known before and after the dam."""
    y, u, time = groundwater(where)
    return Record(y, u[:, :1], time)


def rainfall(where: Path) -> Record:
    """Return the root of the flow; rain and evaporation."""
    table = columns(where / "canning_rainfall_flow.csv")
    u = np.column_stack([filled(table[c]) for c in ("rain_mm", "pet_mm")])
    return Record(np.sqrt(filled(table["flow_mm"])), u, 86400.0 * np.arange(len(u)))


FIRST_DAY = np.datetime64("2017-09-11")  # of the air handler, at midnight
AIR = ["Mixed_Air_T", "Cooling_Coil_Valve", "Heating_Coil_Valve", "Supply_Air_Fan_Speed"]


def air_handler(where: Path) -> Record:
    """Return the supply-air temperature; mixed air, both valves, fan."""
    table = columns(where / "ahu_faults_szvav.csv")
    u = np.column_stack([filled(np.asarray(table[c], float)) for c in AIR])
    stamps = np.asarray(table["Datetime"]).astype("datetime64[s]")
    return Record(np.asarray(table["Supply_Air_T"], float), u, (stamps - stamps[0]).astype(float))


def soldering(where: Path) -> Record:
    """Return temperature and set point without drop-outs, resampled to 1.5 s."""
    from pyarrow import csv

    path = where / "soldering_station.csv"
    names = ["time", "setpoint", "temperature", "setpoint2", "temperature2", "empty"]
    try:
        table = csv.read_csv(path, csv.ReadOptions(skip_rows=1, column_names=names))
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be read: {error}. Is DRIFTWISE_DATA the folder of recordings?") from None
    stamps = table["time"].to_numpy().astype("datetime64[us]")
    t = (stamps - stamps[0]).astype(float) * 1e-6
    y, u = table["temperature"].to_numpy().astype(float), table["setpoint"].to_numpy().astype(float)
    ok = (y > 60) & (u > -1e6)
    grid = np.arange(t[ok][0], t[ok][-1], 1.5)
    return Record(np.interp(grid, t[ok], y[ok]), np.interp(grid, t[ok], u[ok])[:, None], grid - grid[0])


def flow_of(name: str) -> Callable[[Path], Record]:
    """Return a reader of one file of the pump rig: the flow rate, no input."""

    def read(where: Path) -> Record:
        table = columns(where / "skab" / name, ";")
        stamps = np.asarray(table["datetime"]).astype("datetime64[s]")
        y = np.asarray(table["Volume Flow RateRMS"], float)
        return Record(y, np.zeros((len(y), 0)), (stamps - stamps[0]).astype(float))

    return read


def anomaly(where: Path, name: str) -> np.ndarray:
    """Return the labels of one file of the pump rig, (T,)."""
    return np.asarray(columns(where / "skab" / name, ";")["anomaly"], float) > 0


def pump_files(where: Path) -> list[str]:
    """Return the labelled files of the pump rig."""
    return sorted(p.name for p in (where / "skab").glob("*.csv") if p.name != "anomaly_free.csv")


def air_handler_days(*days: str) -> Callable[[Path], Record]:
    """Return a reader of some days of the air handler, from midnight to midnight, one after the other."""

    def read(where: Path) -> Record:
        y, u, time = air_handler(where)
        number = np.floor(time / 86400.0) if time is not None else np.zeros(len(y))
        wanted = [int((np.datetime64(day) - FIRST_DAY).astype(int)) for day in days]
        rows = np.concatenate([np.flatnonzero(number == day) for day in wanted])
        return Record(y[rows], u[rows], 60.0 * np.arange(len(rows)))

    return read


ROWS: dict[str, Callable[[Path], Record]] = {
    "air_quality_NO2": gas_sensor,
    "hair_dryer": plain("hair_dryer.csv", "air_temp_V", "heater_V", dt=0.08),
    "robot_arm": plain("robot_arm.csv", "acceleration", "reaction_torque"),
    "heating_system": plain("heating_system.csv", "temp_degC", "drive_V", dt=2.0),
    "gas_furnace": plain("gas_furnace.csv", "co2_percent", "gas_rate", dt=9.0),
    "heat_exchanger": plain("heat_exchanger.csv", "outlet_temp", "flow"),
    "hydraulic_hanging_load": hanging_load,
    "dc_motor_hoop": plain("dc_motor_hoop_random.csv", "speed_V", "u", dt=0.1),
    "emps_train": drive,
    "leaf_hppc_25C": cell_of("leaf_cell_hppc_25C.csv"),
    "building_heat_load": heat_load("heatload_kW"),
    "building_heat_load16": heat_load("heatload16_kW"),
    "mur_groundwater": groundwater,
    "canning_flow": rainfall,
    "ahu_szvav": air_handler,
    "soldering_station": soldering,
    "nile": plain("nile.csv", "flow_1e8m3"),
}
