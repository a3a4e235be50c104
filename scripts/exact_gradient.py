"""Where `GreyBox` ends by the joint filter and by the exact gradient: the table of docs/grey-box.md.

Run: python scripts/exact_gradient.py (20 seconds). Everything is simulated and seeded.
"""

import numpy as np

import driftwise as dw
from driftwise.estimators.grey_box.start import Batch

LAG = """
[states]
x = {{std = 1.0, walk = {walk}}}
[inputs]
u = {{}}
[outputs]
y = {{{noise}}}
[parameters]
tau = {{unit = "s", start = 8}}
gain = {{start = 1}}
[formulas]
dx = "(gain * u - x) / tau"
y = "x"
"""
SAMPLES, RECORDS, TAU, GAIN, NOISE = 800, 8, 4.0, 1.5, 0.3
METHODS = "joint", "rpem"


def record(seed: int, walk: float):
    """Return outputs and input of a lag that wanders."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], SAMPLES // 10), 10)
    f = np.exp(-1 / TAU)
    x, y, std = 0.0, np.empty(SAMPLES), walk * np.sqrt(TAU / 2 * (1 - f * f))
    for t in range(SAMPLES):
        y[t] = x + NOISE * rng.standard_normal()
        x = f * x + (1 - f) * GAIN * u[t] + std * rng.standard_normal()
    return y, u


def row(said: float, true: float, noise: str) -> str:
    """Return a row: distances of log tau from the batch fit, in its bars, and from the truth, by method."""
    text, off, error = LAG.format(walk=said, noise=noise), {m: [] for m in METHODS}, {m: [] for m in METHODS}
    for seed in range(RECORDS):
        y, u = record(seed, true)
        plant = dw.GreyBox(text)
        best = Batch(plant, y[:, None], np.column_stack([u, np.arange(float(SAMPLES))])).fits(np.zeros(2))[0]
        bar = np.sqrt(np.linalg.inv(best.information)[0, 0])
        for method in METHODS:
            tau = dw.GreyBox(text, method=method).scan(y, u).state["theta"][0]
            off[method].append((tau - best.z[0]) / bar)
            error[method].append(tau - np.log(TAU))
    cells = [f"{np.sqrt(np.mean(np.square(found[m]))):.{d}f}" for found, d in ((off, 2), (error, 3)) for m in METHODS]
    return f"| {said:g} | {true:g} | {'said' if noise else 'found at the start'} | {' | '.join(cells)} |"


if __name__ == "__main__":
    print("| walk said | true | noise | joint: off the batch fit, bars | rpem | joint: error of log tau | rpem |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for said, true in ((0.3, 0.3), (0.3, 0.05), (0.05, 0.3)):
        for noise in ("noise = 0.3", ""):
            print(row(said, true, noise))
