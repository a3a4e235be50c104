"""A cheap gas sensor calibrated against an analyser that is there always, an hour a day, or a day in fourteen."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import driftwise as dw

from ...reproduce.verdict import Verdict
from ..records import columns, stack
from .verdicts import needs, verdict

FILE = "air_quality_sensors.csv"
SENSORS = ["PT08.S4(NO2)", "T", "AH"]
TRAINED = np.datetime64("2004-06-01")  # up to here the analyser stands beside the sensor
TARGETS = {"every hour": 64.0, "one hour a day": 36.0, "one day in fourteen": 32.0}
NIS = (0.7, 1.4)


def read(where: Path):
    """Return the analyser and the sensors (NaN where there is no reading), and which hours are of the training."""
    table = columns(where / FILE)
    time = np.asarray(table["time"]).astype("datetime64[m]")
    return np.asarray(table["NO2(GT)"], float), stack(table, SENSORS), time < TRAINED, (time.astype(int) // 60) % 24


def references(train, hour) -> dict[str, np.ndarray]:
    """Return for each schedule at which hours the reference is shown."""
    day = np.arange(len(train)) // 24
    shown = {"every hour": np.ones(len(train), bool), "one hour a day": hour == 8, "one day in fourteen": day % 14 == 0}
    return {name: train | now for name, now in shown.items()}


def judged(y, prediction, variance) -> tuple[float, float]:
    """Return fit in percent and NIS."""
    error = y - prediction
    return 100 * (1 - np.linalg.norm(error) / np.linalg.norm(y - y.mean())), float(np.mean(error**2 / variance))


def measured(where: Path) -> dict[str, tuple[float, float]]:
    """Return fit and NIS of each schedule, at hours whose reference was not used (or, where all are, not yet)."""
    y, u, train, hour = read(where)
    known = np.isfinite(y) & np.isfinite(u).all(axis=1)
    first = known & train
    u = (u - u[first].mean(axis=0)) / u[first].std(axis=0)
    y = (y - y[first].mean()) / y[first].std()
    est, found = dw.sensor_calibration(SENSORS), {}
    for name, shown in references(train, hour).items():
        trace = est.scan(np.where(shown & known, y, np.nan), u)
        scored = known & ~train & (~shown | shown.all())
        found[name] = judged(y[scored], trace.prediction[scored], trace.variance[scored])
    return found


@needs(FILE, (12, "gas sensor: fit and NIS"))
def gas_sensor(where: Path) -> list[Verdict]:
    """Row 12: fit and NIS of `sensor_calibration`, which is told nothing but the names of the sensors."""
    told = []
    for name, (fit, nis) in measured(where).items():
        least = TARGETS[name]
        told.append(verdict(12, f"gas sensor, reference {name}: fit", f"{fit:.1f} %", f">= {least:g} %", fit >= least))
        told.append(
            verdict(
                12,
                f"gas sensor, reference {name}: NIS",
                f"{nis:.2f}",
                f"{NIS[0]:g} to {NIS[1]:g}",
                NIS[0] <= nis <= NIS[1],
            )
        )
    return told
