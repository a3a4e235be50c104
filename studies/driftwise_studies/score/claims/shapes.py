"""What is claimed of plants of other shapes than the drawn files have: that integrate, lead, ring, or stick.

Run: python -m driftwise_studies.score.claims.shapes [--records 20] [--seed 0] [--kinds rings leads]

* integrates: a drive whose position is measured (a velocity of one time constant, summed), held by a controller;
* sticks: the same with dry friction of a tenth to a half of what its controller mostly does;
* charges: a store that sums its input, beside a direct part and one that dies out, as the voltage of a battery;
* leads: a direct part larger than the end, which dies out with one or two time constants: it overshoots, never swings;
* rings: three to six modes of little damping, of which each has a part of the gain.

Nothing changes in any of them. A gain, a time of 63 %, a swing or a change that is claimed is held against the plant.
"""

from __future__ import annotations

import argparse
from collections import Counter
from typing import NamedTuple

import numpy as np
from scipy.signal import lfilter

from driftwise.analysis.identify import identify

from .checking import NEAR, STRETCH

KINDS = "integrates", "sticks", "charges", "leads", "rings"
LONG = 4000  # samples in which every answer that ends has ended


class Shaped(NamedTuple):
    """A record of a plant, its answer to a step (T,), and the periods it has; without an end, no gain."""

    y: np.ndarray
    u: np.ndarray
    step: np.ndarray
    periods: tuple[float, ...]
    has_end: bool


def moves(rng, T: int) -> np.ndarray:
    """Return steps of random height and length, white or coloured noise, (T,)."""
    kind = rng.integers(3)
    if kind == 0:
        hold = int(rng.integers(5, 60))
        return np.repeat(rng.uniform(-1, 1, T // hold + 1), hold)[:T]
    white = rng.standard_normal(T)
    return white if kind == 1 else lfilter([0.44], [1, -0.9], white)


def noisy(rng, y, colour: float) -> np.ndarray:
    """Return y with noise, white or of the first order, of a thirtieth to a third of its deviation."""
    size = y.std() * np.exp(rng.uniform(np.log(0.03), np.log(0.3)))
    return y + size * np.sqrt(1 - colour**2) * lfilter([1.0], [1.0, -colour], rng.standard_normal(len(y)))


def drive(rng, T: int, friction: float) -> Shaped:
    """Return a drive under a controller of its position: steps of the set point, an encoder with little noise."""
    tau, slow = rng.uniform(5, 60), rng.uniform(4, 12)
    p, gain = np.exp(-1 / tau), rng.uniform(0.5, 2.0)
    kp = 1 / (gain * slow * max(tau, 4.0))
    kd = kp * tau * rng.uniform(0.3, 0.8)
    hold = int(8 * slow + 4 * tau)
    target = np.repeat(rng.uniform(-1, 1, T // hold + 1), hold)[:T]
    target = lfilter([1 / slow], [1, 1 / slow - 1], target)
    dither = 0.02 * kp * lfilter([0.44], [1, -0.9], rng.standard_normal(T))
    y, u, v = np.zeros(T), np.zeros(T), 0.0
    dry = friction * kp * 0.2
    for t in range(1, T):
        force = kp * (target[t - 1] - y[t - 1]) - kd * v + dither[t]
        u[t - 1] = force
        push = p * v + gain * (1 - p) * force
        held = gain * (1 - p) * dry
        v = push - np.sign(push) * held if abs(push) > held else 0.0
        y[t] = y[t - 1] + v
    size = y.std() * np.exp(rng.uniform(np.log(3e-5), np.log(3e-3)))
    one = np.ones(LONG)
    step = np.cumsum(lfilter([0.0, gain * (1 - p)], [1, -p], one))
    return Shaped(y + size * rng.standard_normal(T), u, step, (), False)


def charges(rng, T: int) -> Shaped:
    """Return a store that sums what comes in, slowly beside its other answers."""
    u, one = moves(rng, T), np.ones(LONG)
    p = np.exp(-1 / rng.uniform(3, 40))
    direct, dying, sums = rng.uniform(0.3, 1), rng.uniform(0.3, 1), np.exp(rng.uniform(np.log(0.003), np.log(0.03)))

    def answer(x):
        return direct * x + dying * lfilter([1 - p], [1, -p], x) + sums * np.cumsum(x)

    return Shaped(noisy(rng, answer(u), 0.0), u, answer(one), (), False)


def leads(rng, T: int) -> Shaped:
    """Return a plant that overshoots and does not swing."""
    u, one, end = moves(rng, T), np.ones(LONG), rng.uniform(0.5, 2.0)
    tau = np.exp(rng.uniform(np.log(2), np.log(40), int(rng.integers(1, 3))))
    over = rng.uniform(0.4, 3.0)

    def answer(x):
        low = x
        for one_tau in tau:
            q = np.exp(-1 / one_tau)
            low = lfilter([1 - q], [1, -q], low)
        return end * ((1 + over) * x - over * low)

    return Shaped(noisy(rng, answer(u), float(rng.choice([0.0, 0.8]))), u, answer(one), (), True)


def rings(rng, T: int) -> Shaped:
    """Return a plant of several modes that swing."""
    u, one, many = moves(rng, T), np.ones(LONG), int(rng.integers(3, 7))
    tau = np.exp(rng.uniform(np.log(5), np.log(60), many))
    period = np.exp(rng.uniform(np.log(2.3), np.log(60), many))
    parts = rng.uniform(0.2, 1.0, many) * rng.choice([-1.0, 1.0, 1.0], many)

    def answer(x):
        found = np.zeros(len(x))
        for t, T0, part in zip(tau, period, parts):
            p = np.exp(-1 / t + 2j * np.pi / T0)
            a = np.real(np.poly([p, p.conjugate()]))
            found += part * lfilter([0.0, a.sum()], a, x)
        return found

    return Shaped(noisy(rng, answer(u), 0.0), u, answer(one), tuple(period.tolist()), True)


def shaped(seed: int, number: int, kind: str) -> Shaped:
    """Return a record of a plant of one kind."""
    rng = np.random.default_rng([seed, number, 29, KINDS.index(kind)])
    T = int(np.exp(rng.uniform(np.log(800), np.log(4000))))
    if kind == "integrates":
        return drive(rng, T, 0.0)
    if kind == "sticks":
        return drive(rng, T, rng.uniform(0.1, 0.5))
    return {"charges": charges, "leads": leads, "rings": rings}[kind](rng, T)


def crossing(step) -> float:
    """Return when 63 % of an answer is done, between samples."""
    way = step / step[-1]
    at = int(np.argmax(way >= 1 - np.exp(-1)))
    before = way[at - 1] if at else 0.0
    return at - 1 + (1 - np.exp(-1) - before) / (way[at] - before)


def is_true(data: Shaped, claim) -> bool | None:
    """Whether a claim is true; None where nothing can be checked."""
    if claim.kind == "change":
        return None if claim.value is None or isinstance(claim.value, dict) or claim.subject == "others" else False
    if claim.kind not in ("gain", "time constant", "pole") or claim.value is None:
        return None
    if claim.kind == "pole":
        return any(abs(claim.value / period - 1) < NEAR for period in data.periods)
    if not data.has_end:
        return False
    truth = data.step[-1] if claim.kind == "gain" else crossing(data.step)
    slack = 0.0 if claim.kind == "gain" else 0.5
    low, high = (claim.value + STRETCH * (end - claim.value) for end in claim.interval)
    return bool(low - slack <= truth <= high + slack)


def table(seed: int, records: int, kinds=KINDS, is_shown: bool = False) -> str:
    """Return how many claims of each kind are said, and false, as a table of Markdown."""
    rows = ["| plant | records | " + " | ".join(f"{k} said | false" for k in WHAT) + " |", "| --- " * 10 + "|"]
    for kind in kinds:
        said, false = Counter[str](), Counter[str]()
        for number in range(records):
            data = shaped(seed, number, kind)
            found = identify({"u": data.u, "y": data.y}, output="y", input=["u"])
            for claim in found.claims:
                if (verdict := is_true(data, claim)) is not None:
                    said[claim.kind] += 1
                    false[claim.kind] += not verdict
                    if is_shown and not verdict:
                        print(number, kind, claim.text)
        rows.append(f"| {kind} | {records} | " + " | ".join(f"{said[k]} | {false[k]}" for k in WHAT) + " |")
    return "\n".join(rows)


WHAT = "gain", "time constant", "pole", "change"


def main(arguments=None) -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--records", type=int, default=20, help="of each kind")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--kinds", nargs="+", default=KINDS, choices=KINDS)
    parser.add_argument("--show", action="store_true", help="the false claims")
    asked = parser.parse_args(arguments)
    print(table(asked.seed, asked.records, asked.kinds, asked.show))


if __name__ == "__main__":
    main()
