"""Print the table of docs/calibration.md: gas sensors against an analyser, by references that come now and then.

Run: python scripts/calibration.py (ten seconds; DRIFTWISE_DATA names the folder of recordings).
"""

import numpy as np
from driftwise_studies.score import records
from driftwise_studies.score.tasks import calibration as task

import driftwise as dw

GASES = {"NO2": ("NO2(GT)", ["PT08.S4(NO2)", "T", "AH"]), "CO": ("CO(GT)", ["PT08.S1(CO)", "T", "AH"])}


def estimators(sensors):
    """Return who takes part."""
    plain = dict(offset=True, missing="skip")
    colour = dw.models.Disturbance(0.8)
    nvr = 3e-4 * (1 + colour.ratio)
    return {
        "sensor_calibration": dw.estimators.sensor_calibration(sensors),
        "the same, learning rate 1": dw.ModelAverage(dw.estimators.sensor_calibration(sensors).members),
        "one of its members: pole .8, NVR 3e-4": dw.Regression(
            sensors, disturbance=colour, memory=dw.memory.Drift(nvr=nvr), **plain
        ),
        "Regression, AutoMemory, disturbance": dw.Regression(
            sensors, disturbance=colour, memory=dw.AutoMemory("outliers"), **plain
        ),
        "Regression, AutoMemory": dw.Regression(sensors, memory=dw.AutoMemory(), **plain),
        "Regression, ExponentialForgetting(.98)": dw.Regression(
            sensors, memory=dw.ExponentialForgetting(0.98), **plain
        ),
        "Regression, Constant": dw.Regression(sensors, **plain),
    }


def main():
    where = records.folder()
    if not (where / task.FILE).exists():
        raise SystemExit(f"{task.FILE} is not there: set DRIFTWISE_DATA to the folder of recordings")
    for gas, (reference, sensors) in GASES.items():
        y, u, train, hour = task.read(where, reference, sensors)
        shown = task.references(train, hour)
        print(f"\n| {gas}: fit % (NIS) | {' | '.join(shown)} |\n|---|{'---|' * len(shown)}")
        for name, est in estimators(sensors).items():
            found = task.measured(est, y, u, train, shown)
            print(f"| {name} | {' | '.join(f'{fit:.1f} ({nis:.2f})' for fit, nis in found.values())} |")
        known = np.isfinite(y) & np.isfinite(u).all(axis=1)
        rows = np.column_stack([u, np.ones(len(u))])
        frozen = rows @ np.linalg.lstsq(rows[known & train], y[known & train])[0]
        fits = [
            task.judged(y[m], frozen[m], np.ones(m.sum()))[0]
            for m in (task.hidden(known, train, s) for s in shown.values())
        ]
        print(f"| least squares on the training, frozen | {' | '.join(f'{fit:.1f}' for fit in fits)} |")


if __name__ == "__main__":
    main()
