"""Do bars hold where what a plant's model leaves over is not white? Drawn plants, noise of five colours, one variance.

Run: python -m driftwise_studies.score.plants.coloured [--seed 0] [--records 16]
"""

from __future__ import annotations

import argparse

import numpy as np
from scipy.signal import lfilter

from .drawing import draw
from .field import BAR, average
from .measured import estimator, scan
from .simulation import unmoved

PLANTS = "battery", "mass_spring_damper", "tank", "exchanger"
COLOURS = {  # of noise: numerator and denominator by the delay
    "white": ([1.0], [1.0]),
    "e' = .6 e + w": ([1.0], [1.0, -0.6]),
    "e' = .9 e + w": ([1.0], [1.0, -0.9]),
    "mean of 6": ([1.0] * 6, [1.0]),
    "resonance, 31 samples": ([1.0], [1.0, -2 * 0.93 * np.cos(0.2), 0.93**2]),
}
BEFORE = 300  # samples that are let go, until noise is stationary


def record(drawn, colour: str):
    """Return the outputs (T, p) of a drawn record with coloured noise in place of the white one."""
    clean, _ = unmoved(drawn)
    rng, (T, p) = np.random.default_rng([*drawn.key, 5]), clean.shape
    e = lfilter(*COLOURS[colour], rng.standard_normal((BEFORE + T, p)), axis=0)[BEFORE:]
    e /= np.sqrt(np.sum(lfilter(*COLOURS[colour], np.eye(1, BEFORE)[0]) ** 2))
    drift = np.concatenate([[0.0], np.cumsum(rng.standard_normal(T - 1) * np.sqrt(np.diff(drawn.t)))])
    y = clean + drawn.plant.walk * drift[:, None] + drawn.noise * np.std(clean, axis=0) * e
    y[rng.random(y.shape) < drawn.missing] = np.nan
    return y


def held(seed: int, colour: str, records: int) -> tuple[float, float, float]:
    """Return the share of parameters within their 95 % bars, that within bars of white noise, and the median factor."""
    off, wide = [], []
    for drawn in (draw(seed, name, number) for name in PLANTS for number in range(records)):
        state = scan(drawn, record(drawn, colour), "").state
        std = np.sqrt(np.diag(estimator(drawn.name, "").covariance(state)))[-len(drawn.theta) :]
        off.append((np.asarray(state["theta"]) - np.log(drawn.theta)) / std)
        wide.append(np.asarray(state["wide"]))
    z, factor = np.concatenate(off), np.concatenate(wide)
    share = [average(np.abs(one) < BAR) for one in (z, z * np.sqrt(factor))]
    return share[0], share[1], float(np.median(factor))


def main(arguments=None) -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--records", type=int, default=16, help="of each plant")
    asked = parser.parse_args(arguments)
    print("| noise | within bars | within those of white noise | factor of the variance, median |")
    print("| --- | --- | --- | --- |")
    for colour in COLOURS:
        own, white, factor = held(asked.seed, colour, asked.records)
        print(f"| {colour} | {own:.3f} | {white:.3f} | {factor:.1f} |", flush=True)


if __name__ == "__main__":
    main()
