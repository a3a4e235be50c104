"""Why two recorded plants end where they do: what docs/plants.md says of the drive's friction and of the cell.

Run: python scripts/recorded_plants.py FOLDER (of recordings; a minute)
"""

import sys
from pathlib import Path

import numpy as np
from driftwise_studies.score.tasks import physical
from driftwise_studies.score.tasks.carriage_batch import GAIN
from driftwise_studies.score.tasks.prediction_error import innovations
from scipy.signal import butter, filtfilt

import driftwise as dw

WALK = 0.002  # that of the drive's velocity which makes the record likeliest, m/s in a root of a second
FORCE = (
    ("[inputs]", 'd = {unit = "N", std = 0.1, walk = 10.0}\n[inputs]'),
    ("- offset) / M", "- offset - d) / M"),
    ("dv =", 'dd = "0"\ndv ='),
)  # a force that wanders, beside a walk of the velocity a third as large


def least_squares(u, position, dt=1e-3, cutoff=50.0) -> None:
    """Print viscous friction by least squares on filtered accelerations, of samples beyond some speed."""
    b, a = butter(4, 2 * cutoff * dt)
    x, force = filtfilt(b, a, position), filtfilt(b, a, GAIN * u)
    v = np.gradient(x, dt)
    X = np.column_stack([np.gradient(v, dt), v, np.sign(v), np.ones_like(v)])
    inside = np.arange(len(v)) % 5 == 0
    inside[:200] = inside[-200:] = False
    for least in (0.0, 1e-3, 0.02):
        used = inside & (abs(v) > least)
        Fv = np.linalg.lstsq(X[used], force[used])[0][1]
        print(f"beyond {1e3 * least:g} mm/s, {used.sum() / inside.sum():.3f} of the samples: Fv {Fv:.1f}")


def carriage(where: Path) -> None:
    """Print viscous friction by several ways."""
    table = physical.columns(where / "emps_train.csv")
    u, position, t = (np.asarray(table[name], float) for name in ("u_V", "position_m", "t_s"))
    least_squares(u, position)
    wandering = physical.CARRIAGE
    for old, new in FORCE:
        wandering = wandering.replace(old, new)
    for words, text, walk, method in (
        ("a walk three times smaller", physical.CARRIAGE, WALK / 10**0.5, "joint"),
        ("the likeliest walk", physical.CARRIAGE, WALK, "joint"),
        ("the same, exact gradient", physical.CARRIAGE, WALK, "rpem"),
        ("a walk three times larger", physical.CARRIAGE, WALK * 10**0.5, "joint"),
        ("a force that wanders", wandering, WALK / 10**0.5, "joint"),
    ):
        est = dw.GreyBox(text.replace("WALK", f"{walk:.2g}"), method=method)
        trace = est.scan(position, u, time=t)
        at = est.names.index("Fv")
        Fv, bar = trace.parameters[-1, at], trace.parameters_std[-1, at]
        print(f"{words}: Fv {Fv:.1f} +- {bar:.1f}, log likelihood {est.loglik(trace.state):.0f}")


def cell(where: Path) -> None:
    """Print how much likelier the batch fit's values are than those on-line, of the whole record."""
    t, u, y = physical.leaf(where)
    found = physical.beside(physical.CELL, t, u, y)
    est, state = found.trace.estimator, found.trace.state
    scale, walk = float(np.sqrt(est.sigma2(state))), est.formulas.states[1].walk
    plant = physical.batch("cell", scale * walk, scale * float(state["noise"][0]))
    values = {name: np.array([found.ours[name][0], found.batch.values[name]]) for name in found.ours}
    z = [1.96 * np.log(values[name] / middle) / np.log(width) for name, (middle, width) in plant.starts.items()]
    e, S = innovations(plant, np.column_stack(z), t, u, y)
    ours, batch = -0.5 * np.nansum(e**2 / S + np.log(2 * np.pi * S), axis=0)
    print(f"cell: the batch fit is likelier by {batch - ours:.0f}")


if __name__ == "__main__":
    carriage(Path(sys.argv[1]))
    cell(Path(sys.argv[1]))
