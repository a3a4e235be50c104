"""Changes that are told where none comes at once: plants whose level, or gain, wanders as no model of the library does.

Run: python -m driftwise_studies.score.claims.wander                 the records to choose by (seed 0)
     python -m driftwise_studies.score.claims.wander --judge         those of the last commit; into docs/judged.md
Options: --records 60, of each kind

Plants, inputs and noise are those of the claims (`drawing`), without their troubles. To the output are added a quarter
to one of its deviations of: a slow process of the first order (its time a twentieth to a third of the record), long
memory (fractional noise; Granger and Joyeux, 1980), or a season whose amplitude is such a slow process; or the gain of
the first input is such a process about its value, with a deviation of a twentieth to a quarter of it. Or the level is
a random walk beside white noise (the local level; Harvey, 1989), of which a step has a hundredth of the noise's
deviation to three times it; or beside noise of the first order; or the slope is one, by steps a hundredth as large:
every other record without the inputs and what they do. Or nothing wanders, but a plant of 8 to 20 samples answers steps
of its input the quicker the further it has to go, and each step some part of a sample late, beside a hundredth to a
thousandth of a noise that nearly integrates: what a response has wrong of it comes at once, whenever the input moves.
Or the noise is a share of a level that grows or falls, as of prices: no moment has made it louder.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Callable

import numpy as np
from scipy.signal import fftconvolve, lfilter

from driftwise.analysis.segmentation import hindsight
from driftwise.engine.errors import InputError

from ..worlds import judged
from .drawing import draw
from .plant import Plant
from .simulation import numerator, record

DYNAMICS = (
    "samples", "dt", "poles", "numerators", "gains", "delays", "excitation", "level", "snr", "noise", "rho",
)  # fmt: skip


def slow(rng, T: int) -> np.ndarray:
    """Return a process of the first order, (T,), of deviation one."""
    phi = np.exp(-1 / (T * rng.uniform(0.05, 0.33)))
    return lfilter([np.sqrt(1 - phi**2)], [1, -phi], rng.standard_normal(4 * T))[3 * T :]


def long_memory(rng, T: int) -> np.ndarray:
    """Return fractional noise (1 - q)^-d e, (T,), of deviation one, with d from 0.3 to 0.45."""
    d, k = rng.uniform(0.3, 0.45), np.arange(1, 2 * T)
    weights = np.cumprod(np.append(1.0, (k - 1 + d) / k))
    x = fftconvolve(rng.standard_normal(3 * T), weights)[2 * T : 3 * T]
    return x / x.std()


def swelling(rng, T: int) -> np.ndarray:
    """Return a season of eight to forty turns whose amplitude and phase wander, (T,)."""
    angle = 2 * np.pi * np.arange(T) / (T / rng.uniform(8, 40))
    return np.cos(angle) * (1 + 0.5 * slow(rng, T)) + 0.5 * np.sin(angle) * slow(rng, T)


LEVELS: dict[str, Callable] = {"slow process": slow, "long memory": long_memory, "season that swells": swelling}
WALK, COLOURED_WALK, SLOPE = "walk beside white noise", "walk beside coloured noise", "slope that walks"
WALKS = WALK, COLOURED_WALK, SLOPE
SHARE = "noise that is a share"
KINDS = (*LEVELS, "gain", *WALKS, "late moves", SHARE)


def walking(rng, T: int, kind: str) -> np.ndarray:
    """Return noise of deviation one on a level that walks, or whose slope does, (T,)."""
    step, phi = np.exp(rng.uniform(np.log(0.01), np.log(3))), rng.uniform(0.3, 0.9) if kind == COLOURED_WALK else 0.0
    noise = lfilter([np.sqrt(1 - phi**2)], [1, -phi], rng.standard_normal(T + 200))[200:]
    level = step * np.cumsum(rng.standard_normal(T))
    return noise + (np.cumsum(level) / 100 if kind == SLOPE else level)


def shares(rng, T: int) -> np.ndarray:
    """Return a level that grows or falls two- to twentyfold, and noise of a fiftieth to a fifth of it, (T,)."""
    grown, phi = np.log(rng.uniform(2, 20)), rng.choice([0.0, rng.uniform(0.3, 0.9)])
    level = np.linspace(0, rng.choice([-1, 1]) * grown, T) + grown / 10 * slow(rng, T)
    noise = lfilter([np.sqrt(1 - phi**2)], [1, -phi], rng.standard_normal(T + 200))[200:]
    return np.exp(level) * np.maximum(1 + np.exp(rng.uniform(np.log(0.02), np.log(0.2))) * noise, 0.01)


def late_moves(rng, T: int):
    """Return y (T,) and u (T, 1) of a plant that is no response, and whose input acts some part of a sample late."""
    hold, slow, hasty = int(rng.integers(30, 60)), rng.uniform(8, 20), rng.uniform(0.3, 1.0)
    u = np.repeat(rng.uniform(-1, 1, T // hold + 1), hold)[:T]
    late = rng.uniform(0.1, 1) * np.append(0.0, rng.uniform(0, 1, T - 1) * np.diff(u))
    x, size = np.zeros(T), np.exp(rng.uniform(np.log(0.001), np.log(0.01)))
    for t in range(1, T):
        gap = u[t - 1] - x[t - 1]
        x[t] = x[t - 1] + gap / slow * (1 + hasty * abs(gap))
    x += lfilter([0.0, 1 / slow], [1, 1 / slow - 1], late)
    drift = lfilter([1.0], [1, -0.995], rng.standard_normal(T))
    return x + size * (drift + 0.2 * rng.standard_normal(T)), u[:, None]


def wandering(seed: int, number: int, kind: str):
    """Return y (T,) and u (T, k) of a record in which nothing changes at once."""
    plant = draw(seed, number)
    plant = Plant(number, frozenset(), *(getattr(plant, name) for name in DYNAMICS))
    data, rng = record(plant, seed), np.random.default_rng([seed, number, 26])
    if kind == "gain":
        moved = lfilter(numerator(plant, 0), [1.0], data.u[:, 0]) * rng.uniform(0.05, 0.25) * slow(rng, plant.samples)
        return data.y + lfilter([1.0], plant.a, moved), data.u
    if kind == "late moves":
        return late_moves(rng, plant.samples)
    if kind == SHARE:
        return shares(rng, plant.samples), data.u[:, :0]
    if kind in WALKS:
        y = walking(rng, plant.samples, kind)
        return (y, data.u[:, :0]) if number % 2 else (data.clean + np.std(data.y - data.clean) * y, data.u)
    return data.y + data.unit * rng.uniform(0.25, 1.0) * LEVELS[kind](rng, plant.samples), data.u


def table(seed: int, records: int) -> str:
    """Return how many records have a change that is told, by what wanders, as a table of Markdown."""
    rows = [
        "| what wanders | records | with a change told | level | gain | noise |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for kind in KINDS:
        told = Counter[str]()
        for number in range(records):
            found = hindsight(*wandering(seed, number, kind))
            kinds = {jump.kind for jump in found.jumps()} if found else set()
            told.update([*kinds, *(["any"] if kinds else [])])
        shares = " | ".join(f"{told[what] / records:.3f}" for what in ("any", "level", "gain", "noise"))
        rows.append(f"| {kind} | {records} | {shares} |")
    return "\n".join(rows)


def main(arguments=None) -> None:
    """Run, print, and write down what was judged."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--judge", action="store_true", help="with the seed of the last commit that changed an answer")
    parser.add_argument("--records", type=int, default=60, help="of each kind")
    asked = parser.parse_args(arguments)
    answers = "src/driftwise", "studies/driftwise_studies/score/claims"
    commit, seed = judged.seed(answers) if asked.judge else ("", judged.CHOOSING)
    title = f"## {commit[:8]}: changes told on {asked.records} wandering records of each kind"
    if asked.judge:
        judged.refuse_twice(title)
    found = table(seed, asked.records)
    print(f"seed {seed}\n\n{found}")
    if asked.judge:
        judged.append([title, "", f"Seed {seed} = 0x{commit[:8]}; [what is counted](claims.md).", "", found])


if __name__ == "__main__":
    try:
        main()
    except InputError as error:
        sys.exit(str(error))
