"""Twenty pumps, and one day each loses 31 % of its gain: which did, when, and how much?

A pump drives flow by its speed: a level, a gain of so many m3/h for each rpm, a lag of some minutes. Its speed is set
in steps. The flow trembles (turbulence passes the same lag), the sensor adds noise of its own and rounds to .01 m3/h.
Then a seal goes, and from one minute to the next the gain is .69 of what it was. Nobody says how large a jump to look
for, how loud the noise is, or that there is a jump at all: the only number given is how often an alarm may be false,
once in ten thousand minutes.

Process noise and sensor noise together make the first-order plant an ARMAX(1, 1, 1). The same from a table:

    driftwise run pump.csv -o flow -i speed --model armax:1,1,1 --jumps parameters:10000

    python examples/gallery/pumps.py        # exit code 0: at least 19 are found, and all is within two error bars
"""

from __future__ import annotations

import sys

import numpy as np
from scipy.signal import lfilter
from scipy.stats import binom, poisson

import driftwise as dw

PUMPS, MINUTES, LEFT, SEED = 20, 2000, 0.69, 31
PROMISE = 10_000  # minutes between false alarms


def pump(number: int):
    """Return flow, speed, the minute of the fault, and the gains before and after."""
    rng = np.random.default_rng([SEED, number])
    lag, gain, at = rng.uniform(3.0, 20.0), rng.uniform(0.05, 0.15), int(rng.integers(0.4 * MINUTES, 0.7 * MINUTES))
    speed = np.repeat(rng.choice([-100.0, -60.0, 60.0, 100.0], MINUTES), rng.integers(5, 60, MINUTES))[:MINUTES]
    pole, swing = np.exp(-1.0 / lag), 80.0 * gain
    turbulence, sensor = swing * rng.uniform(0.01, 0.05), swing * rng.uniform(0.005, 0.03)
    path = gain * np.where(np.arange(MINUTES) < at, 1.0, LEFT)
    drive = np.r_[0.0, (1 - pole) * (path * speed)[:-1]]
    wobble = turbulence * (1 - pole**2) ** 0.5 * rng.standard_normal(MINUTES)
    flow = 120.0 + lfilter([1.0], [1.0, -pole], drive + wobble) + sensor * rng.standard_normal(MINUTES)
    return flow.round(2), 1450.0 + speed, at, gain, LEFT * gain


def gain_of(trace):
    """Return the steady-state gain of the model that a trace ends with, and its error bar."""
    model = trace.model()
    return float(np.ravel(model.dc_gain)[0]), float(np.ravel(model.dc_gain_std)[0])


def watch(flow, speed, at):
    """Return the alarm that tells the fault, how many others there are, and the gains before it and at the end."""
    y, u = flow - flow[:32].mean(), speed - speed[:32].mean()
    est = dw.ARMAX(1, 1, 1, offset=True, memory=dw.RestartOnChange(dw.detect.ScoreCUSUM(PROMISE))).scaled_to(y, u)
    trace = est.scan(y, u)
    jumps = [event for event in trace.events() if event.kind == "JUMP"]
    told = next((event for event in jumps if event.sample >= at), None)
    before = est.scan(y[: told.since], u[: told.since]) if told else trace
    return told, len(jumps) - (told is not None), gain_of(before), gain_of(trace)


def off(answer, truth):
    """Return how many bars an answer (value, bar) is off."""
    return abs(answer[0] - truth) / answer[1]


def main() -> int:
    """Print truth beside answer; return 0 where all is within two error bars."""
    found = false = within = 0
    drops, bars = [], []
    print("pump fault at  told at  since  gain before            answer   after answer")
    for number in range(PUMPS):
        flow, speed, at, *gains = pump(number)
        told, others, *answers = watch(flow, speed, at)
        found, false = found + (told is not None), false + others
        within += sum(off(answer, gain) < 2 for answer, gain in zip(answers, gains))
        (first, bar), (last, end) = answers
        drops.append(1 - last / first)
        bars.append(last / first * np.hypot(bar / first, end / last))
        when = f"{told.sample:8d} {told.since:6d}" if told else f"{'never':>8} {'':6}"
        said = [f"{value:.4f} ± {std:.4f}" for value, std in answers]
        truth = [f"{gain:.4f}" for gain in gains]
        print(f"{number:4d} {at:8d} {when} {truth[0]:>12} {said[0]:>17}  {truth[1]} {said[1]}")
    weight = 1 / np.square(bars)
    drop = float(weight @ drops / weight.sum()), float(weight.sum() ** -0.5)
    promised = PUMPS * MINUTES / PROMISE
    low, high = poisson.ppf([0.025, 0.975], promised)
    least = binom.ppf(0.025, 2 * PUMPS, 0.954)
    print(f"\nfound: {found} of {PUMPS} (at least {PUMPS - 1} are expected)")
    print(f"other alarms: {false}; promised {promised:.0f}, 95 % of the time {low:.0f} to {high:.0f}")
    print(f"gains within two bars: {within} of {2 * PUMPS} (at least {least:.0f}, where bars are right)")
    print(
        f"the drop, over all pumps: truth {100 * (1 - LEFT):.1f} %, answer {100 * drop[0]:.1f} ± {100 * drop[1]:.1f} %"
    )
    right = found >= PUMPS - 1 and low <= false <= high and within >= least and off(drop, 1 - LEFT) < 2
    print("all within two bars" if right else "NOT within two bars")
    return 0 if right else 1


if __name__ == "__main__":
    sys.exit(main())
