"""Print mean run lengths of cumulative sums, simulated and by every formula: python scripts/run_lengths.py

Part 1: white Gaussian signals. Part 2: products of successive innovations, whose low thresholds foretell the high ones.
Part 3: how long one threshold takes to design.
"""

import time

import numpy as np

import driftwise as dw
from driftwise.detect import average_run_length as rl

G = 1 / 0.99  # of the test signal in Hampton's filter of pole 0.99


def gaussian(std):
    """White Gaussian samples of all runs still going."""

    def signal(generator, runs):
        while True:
            going = yield std * generator.standard_normal(runs)
            runs = np.count_nonzero(going)

    return signal


def products(generator, runs):
    """Products G e(n) e(n+1) of all runs still going."""
    source = rl.lagged_products(generator, runs)
    z = next(source)
    while True:
        z = source.send((yield G * z))


def off(value, truth):
    return f"{100 * (value / truth - 1):+.1f} %"


def white(runs):
    print("| reference | threshold | std | simulated | exact | overshoot corrected | Brownian |")
    print("|---|---|---|---|---|---|---|")
    for k, h, std in ((0.5, 4, 1.0), (0.15, 15, 1.01), (0.07, 20, 1.01), (0.1, 5, 1.0), (1.0, 3, 1.0)):
        T = rl.simulate_run_length(gaussian(std), k, [h], runs)[0]
        formulas = (rl.brownian_run_length(k, h + rl.OVERSHOOT * std, std), rl.brownian_run_length(k, h, std))
        print(f"| {k} | {h} | {std} | {T:.4g} | {dw.detect.run_length(h, k, std):.4g} |", end="")
        print("".join(f" {off(value, T)} |" for value in formulas))


def correlated(low_runs, high_runs):
    print("| reference | threshold | simulated | two-point fit | exponent | overshoot corrected | Brownian |")
    print("|---|---|---|---|---|---|---|")
    for k, low, high in ((0.15, (8, 15), (25, 32)), (0.07, (10, 20), (40,)), (0.3, (6, 10), (20,))):
        fit = rl.extrapolate_run_length(low, rl.simulate_run_length(products, k, low, low_runs), k)
        simulated = rl.simulate_run_length(products, k, high, high_runs)
        for h, T in zip(high, simulated):
            formulas = (
                fit.run_length(h),
                rl.product_run_length(h, k, G),
                rl.brownian_run_length(k, h + rl.OVERSHOOT * G, G),
                rl.brownian_run_length(k, h, G),
            )
            print(f"| {k} | {h} | {T:.4g} |" + "".join(f" {off(value, T)} |" for value in formulas))


def design():
    for wanted, k in ((1000, 0.5), (10_000, 0.1), (10_000, 0.02)):
        begun = time.perf_counter()
        h = dw.detect.threshold_for(wanted, k)
        took = 1e3 * (time.perf_counter() - begun)
        print(f"threshold for one alarm per {wanted} at reference {k}: {h:.4f}, {took:.0f} ms")


if __name__ == "__main__":
    white(runs=40_000)
    print()
    correlated(low_runs=20_000, high_runs=1000)
    print()
    design()
