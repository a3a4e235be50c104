"""Battery cells under a drive cycle, and one day R0 jumps by 30 %: what are R0, R1 and C1, and when did R0 jump?

A cell is a resistance R0 in series with a pair R1, C1: V = OCV + R0 I + V1, where V1 follows R1 I with the time
constant R1 C1. Sampled once a second, with the current held between samples and a = exp(-1/(R1 C1)), that is

    V - OCV = (b0 + b1 q^-1)/(1 - a q^-1) I,    b0 = R0,  b1 = R1 (1 - a) - a R0

a first-order model with a direct term. The voltmeter has 1-2 mV of noise, the jump is 50-200 times as large, and nobody
says when. Least squares (`ARX`; the noise is small) with a detector dates it. Output error (`OE`) with `IMM`, filters
for seven speeds of drift, is told nothing at all and the most accurate in the end. OCV is an offset to the first, and
known to the second.

    python examples/gallery/battery.py      # exit code 0: every jump is dated, and all is within two error bars
"""

from __future__ import annotations

import sys

import numpy as np
from scipy.stats import binom

import driftwise as dw

CELLS, SECONDS, JUMP, OCV, SEED = 20, 3000, 1.3, 3.7, 21
STILL = 0.5  # A: below it R0 does not show


def drive_cycle(rng, seconds):
    """Return the current in A: acceleration, cruising, braking, rest, each for a few to some tens of seconds."""
    current = np.zeros(seconds)
    at = 0
    while at < seconds:
        low, high = [(5.0, 40.0), (2.0, 12.0), (-20.0, -3.0), (0.0, 0.0)][rng.choice(4, p=[0.35, 0.3, 0.2, 0.15])]
        end = min(at + int(rng.integers(3, 25)), seconds)
        current[at:end] = rng.uniform(low, high) + (high > low) * rng.standard_normal(end - at)
        at = end
    return current


def cell(number, seconds=SECONDS, jump=JUMP, seed=SEED):
    """Return voltage, current, R0 (seconds,), R1, C1, and the second of the jump."""
    rng = np.random.default_rng([seed, number])
    R0, R1, tau = 0.03 * rng.uniform(0.5, 2.0), 0.015 * rng.uniform(0.5, 2.0), rng.uniform(30.0, 60.0)
    noise, at = rng.uniform(1e-3, 2e-3), int(rng.integers(seconds // 3, 2 * seconds // 3))
    current, a, slow = drive_cycle(rng, seconds), np.exp(-1.0 / tau), np.zeros(seconds)
    for t in range(1, seconds):
        slow[t] = a * slow[t - 1] + R1 * (1.0 - a) * current[t - 1]
    path = np.where(np.arange(seconds) < at, R0, jump * R0)
    voltage = OCV + path * current + slow + noise * rng.standard_normal(seconds)
    return voltage, current, path, R1, tau / R1, at


def elements(trace):
    """Return (value, bar) of R0, R1 and C1 by the delta method, from the model that a trace ends with."""
    est, state, names = trace.estimator, trace.state, list(trace.names)
    at = [names.index(name) for name in ("b0", "b1", "f1" if "f1" in names else "a1")]
    (b0, b1, f), P = trace.parameters[-1][at], est.sigma2(state) * est.covariance(state)[np.ix_(at, at)]
    R1 = (b1 - f * b0) / (1.0 + f)
    C1 = -1.0 / (np.log(-f) * R1)
    by_R1 = np.array([-f, 1.0, -(b0 + b1) / (1.0 + f)]) / (1.0 + f)
    by_C1 = -C1 / R1 * by_R1 + np.array([0.0, 0.0, 1.0 / (R1 * f * np.log(-f) ** 2)])
    slopes = np.array([[1.0, 0.0, 0.0], by_R1, by_C1])
    return list(zip((b0, R1, C1), np.sqrt(np.diag(slopes @ P @ slopes.T))))


def estimates(voltage, current):
    """Return the traces of least squares that watches for jumps, and of output error that is told nothing."""
    watching = dw.RestartOnChange(response=dw.memory.CovarianceInflation(0.02))
    return (
        dw.ARX(1, 2, 0, offset=True, memory=watching).scan(voltage, current),
        dw.OE(2, 1, 0, memory=dw.memory.IMM()).scan(voltage - OCV, current),
    )


def told_by(trace, current, at):
    """Return the event that tells the jump, soon after it can be seen, and how many other alarms there are."""
    jumps = [event for event in trace.events() if event.kind == "JUMP"]
    visible = at + int(np.argmax(np.abs(current[at:]) > STILL))
    hit = next((event for event in jumps if at <= event.sample <= visible + 10), None)
    return hit, len(jumps) - (hit is not None)


def main() -> int:
    """Print truth beside answer; return 0 where all is within two error bars."""
    told = false = 0
    within = np.zeros((2, 3), int)
    head = [f"{name:>7}  {'ARX':15}  {'OE':15}" for name in ("R0/mOhm", "R1/mOhm", "C1/F")]
    print(f"cell  jump  told since  {'  '.join(head)}")
    for number in range(CELLS):
        voltage, current, path, R1, C1, at = cell(number)
        traces = estimates(voltage, current)
        hit, others = told_by(traces[0], current, at)
        told, false = told + (hit is not None), false + others
        line = f"{number:4d} {at:5d}" + (f" {hit.sample:5d} {hit.since:5d}" if hit else f"{'never':>12}")
        for k, (truth, unit) in enumerate(((path[-1], 1e3), (R1, 1e3), (C1, 1.0))):
            line += f"  {unit * truth:7.2f}"
            for way, trace in enumerate(traces):
                value, bar = elements(trace)[k]
                within[way, k] += abs(value - truth) < 2.0 * bar
                line += f"  {unit * value:7.2f} ± {unit * bar:<5.2g}"
        print(line)
    least = int(binom.ppf(0.025, CELLS, 0.954))
    print(f"\njumps told and dated: {told} of {CELLS}; other alarms: {false}")
    for name, (R0, R1, C1) in zip(("ARX, watching", "OE, IMM"), within):
        print(f"within two bars, {name}: R0 {R0}, R1 {R1}, C1 {C1} of {CELLS} (where bars are right, {least} or more)")
    right = told == CELLS and false <= 2 and within.min() >= least
    print("all within two bars" if right else "NOT within two bars")
    return 0 if right else 1


if __name__ == "__main__":
    sys.exit(main())
