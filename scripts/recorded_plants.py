"""What the friction of a recorded drive is, by how densely it is sampled: the table of docs/decisions/sampling.md.

Run: python scripts/recorded_plants.py FOLDER (of recordings; some minutes)
"""

import sys
from pathlib import Path

import numpy as np
from driftwise_studies.score.tasks import physical
from driftwise_studies.score.tasks.carriage_batch import GAIN
from scipy.signal import butter, filtfilt


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
    """Print mass and viscous friction of positions that are taken more and less densely."""
    table = physical.columns(where / "emps_train.csv")
    least_squares(*(np.asarray(table[name], float) for name in ("u_V", "position_m")))
    for every in (1, 5, physical.EVERY, 30):
        both = physical.driven(where, every)
        e = both.batch.innovations
        told = ", ".join(f"{n} {both.ours[n][0]:.2f} +- {both.ours[n][1]:.2f}" for n in ("M", "Fv", "Fc"))
        beside = ", ".join(f"{both.batch.values[n]:.2f}" for n in ("M", "Fv", "Fc"))
        neighbours = [round(float(e[k:] @ e[:-k] / (e @ e)), 2) for k in range(1, 8)]
        print(f"one in {every}: {told}; batch {beside}, correlations of its innovations {neighbours}", flush=True)


if __name__ == "__main__":
    carriage(Path(sys.argv[1]))
