"""What a sample of `AutoMemory` costs in a fleet, and how far its numbers are from those of another version
(docs/decisions).

python scripts/auto_speed.py                       # processor time a sample
python scripts/auto_speed.py --save before.npz     # with one version
python scripts/auto_speed.py --against before.npz  # with the other
"""

import argparse
import statistics
import time

import numpy as np

import driftwise as dw

SERIES, SAMPLES, LONG = 2000, 500, 10_000


def plant(series, samples, kind, seed=1):
    """Outputs and inputs of y = 1.2 y1 - .5 y2 + b u1 + .5 u2 + e, (series, samples)."""
    rng = np.random.default_rng(seed)
    u, e = rng.standard_normal((series, samples)), 0.3 * rng.standard_normal((series, samples))
    if kind == "white":
        return e, u
    if kind == "outliers":
        e[rng.random(e.shape) < 0.01] *= 20
    y, b = np.zeros_like(u), np.ones(series)
    for t in range(2, samples):
        b = -b if kind == "jumps" and t % 100 == 0 else b
        b = b + 0.02 * rng.standard_normal(series) if kind in ("drifts", "gaps") else b
        y[:, t] = 1.2 * y[:, t - 1] - 0.5 * y[:, t - 2] + b * u[:, t - 1] + 0.5 * u[:, t - 2] + e[:, t]
    if kind == "gaps":
        y[rng.random(y.shape) < 0.05] = np.nan
    return y, u


def speed(kind):
    """Print nanoseconds of processor time a sample, one core."""
    est, at, found = dw.ARX(2, 2, memory=dw.AutoMemory()), np.repeat(np.arange(SERIES), SAMPLES), []
    y, u = (np.ascontiguousarray(x.reshape(-1, 1)) for x in plant(SERIES, SAMPLES, kind))
    dw.Fleet(est, range(1), threads=1).advance(at[:1], y[:1], u[:1])
    for _ in range(5):
        fleet = dw.Fleet(est, range(SERIES), threads=1)
        start = time.process_time()
        fleet.advance(at, y, u)
        found.append((time.process_time() - start) / y.size * 1e9)
    print(f"{kind:9s} best {min(found):5.0f} ns, median {statistics.median(found):5.0f} ns")


def numbers():
    """Return parameters, deviations and status of long records."""
    found = {}
    for kind in ("constant", "drifts", "jumps", "outliers", "gaps", "wide"):
        y, u = plant(1, LONG, kind)
        options = {"P0": 1e12} if kind == "wide" else {}
        trace = dw.ARX(2, 2, memory=dw.AutoMemory(), **options).scan(y[0], u[0])
        found |= {f"{kind} theta": trace.parameters, f"{kind} std": trace.parameters_std, f"{kind} bits": trace.status}
    return found


def compare(old, new):
    """Print the largest changes: of theta (relative to it, or its deviation), of its deviation, of status."""
    for kind in (key.split()[0] for key in new if key.endswith("theta")):
        theta, std = old[f"{kind} theta"], old[f"{kind} std"]
        moved = abs(new[f"{kind} theta"] - theta) / np.maximum(abs(theta), std)
        other = np.sum(np.asarray(old[f"{kind} bits"]) != np.asarray(new[f"{kind} bits"]))
        print(
            f"{kind:9s} theta {np.nanmax(moved):.1e}, deviations {np.nanmax(abs(new[f'{kind} std'] / std - 1)):.1e}",
            end="",
        )
        print(f", status of {other} samples")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--save")
    parser.add_argument("--against")
    given = parser.parse_args()
    if given.save:
        np.savez(given.save, **numbers())
    elif given.against:
        compare(dict(np.load(given.against)), numbers())
    else:
        for kind in ("white", "constant", "outliers", "jumps"):
            speed(kind)
