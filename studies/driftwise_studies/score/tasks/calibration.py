"""A cheap gas sensor calibrated against an analyser that is there always, an hour a day, or a day in fourteen."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import driftwise as dw

from ...papers.verdict import Verdict
from ..records import columns, stack
from .verdicts import needs, verdict

FILE = "air_quality_sensors.csv"
SENSORS = ["PT08.S4(NO2)", "T", "AH"]
TRAINED = np.datetime64("2004-06-01")  # up to here the analyser stands beside the sensor
TARGETS = {"every hour": 64.0, "one hour a day": 36.0, "one day in fourteen": 32.0}
NIS = (0.7, 1.4)


def read(where: Path, reference="NO2(GT)", sensors=SENSORS):
    """Return the analyser and the sensors (NaN where there is no reading), of the training or not, the hour."""
    table = columns(where / FILE)
    time = np.asarray(table["time"]).astype("datetime64[m]")
    return np.asarray(table[reference], float), stack(table, sensors), time < TRAINED, (time.astype(int) // 60) % 24


def references(train, hour) -> dict[str, np.ndarray]:
    """Return for each schedule at which hours the reference is shown."""
    day = np.arange(len(train)) // 24
    shown = {"every hour": np.ones(len(train), bool), "one hour a day": hour == 8, "one day in fourteen": day % 14 == 0}
    return {name: train | now for name, now in shown.items()}


def judged(y, prediction, variance) -> tuple[float, float]:
    """Return fit in percent and NIS."""
    error = y - prediction
    return 100 * float(1 - np.linalg.norm(error) / np.linalg.norm(y - y.mean())), float(np.mean(error**2 / variance))


def hidden(known, train, shown) -> np.ndarray:
    """Return which hours are scored: those whose reference was not used, or, where all are, not yet."""
    return known & ~train & (~shown | shown.all())


def measured(est, y, u, train, schedules) -> dict[str, tuple[float, float]]:
    """Return fit and NIS of each schedule; all is centred and scaled by what the training shows."""
    known, found = np.isfinite(y) & np.isfinite(u).all(axis=1), {}
    first = known & train
    u = (u - u[first].mean(axis=0)) / u[first].std(axis=0)
    y = (y - y[first].mean()) / y[first].std()
    for name, shown in schedules.items():
        trace, scored = est.scan(np.where(shown & known, y, np.nan), u), hidden(known, train, shown)
        found[name] = judged(y[scored], trace.prediction[scored], trace.variance[scored])
    return found


@needs(FILE, (12, "gas sensor: fit and NIS"))
def gas_sensor(where: Path) -> list[Verdict]:
    """Row 12: fit and NIS of `sensor_calibration`, which is told nothing but the names of the sensors."""
    y, u, train, hour = read(where)
    told = []
    for name, (fit, nis) in measured(
        dw.estimators.sensor_calibration(SENSORS), y, u, train, references(train, hour)
    ).items():
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
