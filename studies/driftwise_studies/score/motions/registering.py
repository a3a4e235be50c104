"""Registration judged on drawn skies: radars with biases of range, azimuth and clock, aircraft that several see.

Run: python -m driftwise_studies.score.motions.registering             the choosing skies (seed 0), to work on
     python -m driftwise_studies.score.motions.registering --judge     those of the last commit; into docs/judged.md
Options: --scenes 100
"""

from __future__ import annotations

import argparse
import sys
import time
from typing import Any, NamedTuple

import numpy as np

from driftwise.engine.errors import InputError
from driftwise.tracking.frames import geographic
from driftwise.tracking.plots import Plots, plots
from driftwise.tracking.polar import linear_covariance
from driftwise.tracking.registration import Registration
from driftwise.tracking.sites import Site

from ..worlds import judged
from .drawing import between
from .scene import KINDS, Scene, Sensor
from .simulation import itinerary, walk

ANSWERS = "src/driftwise/tracking/registration.py", "studies/driftwise_studies/score/motions/registering.py"
ORIGIN = 47.0, 8.0
BIASES = 100.0, 0.2, 0.5  # m, degrees, s: deviations of what is drawn
NAMES = "range, m", "azimuth, degrees", "clock, s"
BARS, SHARE = 2.0, 0.95


class Sky(NamedTuple):
    """What radars say of aircraft, and what they do wrong."""

    plots: Plots
    sites: dict[str, Site]
    sensors: tuple[str, ...]
    reference: str | None
    truth: dict[str, tuple[float, float, float]]  # of each radar: range m, azimuth degrees, clock s


def draw(seed: int, number: int) -> Sky:
    """Return sky ``number`` of ``seed``: two or three radars, perhaps a receiver without biases, 3 to 12 aircraft.

    One plot in a hundred is wild, one in ten is missing.
    """
    rng = np.random.default_rng([seed, number, 27])
    radars = [f"25/{k + 1}" for k in range(int(rng.integers(2, 4)))]
    has_receiver, parts = rng.random() < 0.4, []
    where = {name: rng.uniform(-60e3, 60e3, 2) for name in radars}
    sds = {name: (between(rng, (20.0, 100.0)), between(rng, (0.04, 0.12))) for name in radars}
    scans = {name: between(rng, (4.0, 12.0)) for name in radars} | {"ADSB": 1.0 if rng.random() < 0.5 else 5.0}
    truth: dict[str, Any] = {name: tuple(map(float, rng.standard_normal(3) * BIASES)) for name in radars}
    if not has_receiver:
        truth[radars[0]] = (*truth[radars[0]][:2], 0.0)
    span = float(rng.uniform(600, 1800))
    for k in range(int(rng.integers(3, 13))):
        scene = Scene(k, (seed, number, k), "flight", KINDS["flight"], (), 100, (Sensor("A", 4.0, 30.0),))
        times, then = [], []
        names = [*radars, *(["ADSB"] if has_receiver else [])]
        for name in names:
            t = rng.uniform(0, scans[name]) + np.arange(0, span, scans[name])
            t = t[rng.random(len(t)) > 0.1]
            times.append(t)
            then.append(t - (truth[name][2] if name in truth else 0.0))
        path = walk(rng, scene, itinerary(rng, scene, span), np.concatenate(then))
        start, at = rng.uniform(-50e3, 50e3, 2) - path.position[0], 0
        for name, t in zip(names, times):
            x = path.position[at : at + len(t)] + start
            at += len(t)
            if name in truth:
                east, north = (x - where[name]).T
                far = np.hypot(east, north) + truth[name][0] + sds[name][0] * rng.standard_normal(len(t))
                turn = np.arctan2(east, north) + np.radians(truth[name][1] + sds[name][1] * rng.standard_normal(len(t)))
                x = where[name] + far[:, None] * np.column_stack([np.sin(turn), np.cos(turn)])
            else:
                x = x + 10.0 * rng.standard_normal(x.shape)
            x = x + (rng.random(len(t)) < 0.01)[:, None] * rng.uniform(-3e3, 3e3, x.shape)
            if name in truth:
                says = linear_covariance(far, turn, sds[name][0], np.radians(sds[name][1]))
            else:
                says = np.tile(100.0 * np.eye(2), (len(t), 1, 1))
            parts.append((t, x, np.full(len(t), f"AB{k:04}"), np.full(len(t), name), says))
    t, x, key, sensor, says = (np.concatenate(column) for column in zip(*parts))
    sites = {}
    for name in radars:
        latitude, longitude = geographic(where[name], ORIGIN)
        sites[name] = Site(float(latitude), float(longitude), 0.0, *sds[name])
    made = plots(t, x, covariance=says, key=key, sensor=sensor, origin=ORIGIN)
    return Sky(made, sites, tuple(names), "ADSB" if has_receiver else None, truth)


def run(seed: int, number: int) -> np.ndarray:
    """Return (radars, 3, 2): error of each bias in its standard deviation, and that deviation."""
    sky = draw(seed, number)
    found = Registration(sky.sensors, sky.sites, origin=ORIGIN, reference=sky.reference)
    found.feed(sky.plots)
    rows = []
    for name, truth in sky.truth.items():
        b = found.biases[name]
        told = ((b.first, b.first_sd), (b.second, b.second_sd), (b.clock, b.clock_sd))
        rows.append([((value - true) / sd if sd else 0.0, sd) for (value, sd), true in zip(told, truth)])
    return np.array(rows)


def main(arguments=None) -> None:
    """Run, print, and write down what was judged."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--judge", action="store_true", help="with the seed of the last commit that changed an answer")
    parser.add_argument("--scenes", type=int, default=100)
    asked = parser.parse_args(arguments)
    commit, seed = judged.seed(ANSWERS) if asked.judge else ("", judged.CHOOSING)
    title = f"## {commit[:8]}: biases of radars in {asked.scenes} skies"
    if asked.judge:
        judged.refuse_twice(title)
    began = time.time()
    skies = [run(seed, number) for number in range(asked.scenes)]
    found = np.concatenate(skies)
    free = found[:, :, 1] > 0
    lines = [
        "| bias | radars | within two bars | bar (deviation), median | largest error, deviations |",
        "|" + " --- |" * 5,
    ]
    for k, name in enumerate(NAMES):
        z, sd = found[free[:, k], k].T
        lines.append(
            f"| {name} | {len(z)} | {np.mean(np.abs(z) <= BARS):.3f} | {np.median(sd):.3g} | {np.abs(z).max():.1f} |"
        )
    share = float(np.mean(np.abs(found[:, :, 0][free]) <= BARS))
    worst = np.mean([np.abs(sky[:, :, 0]).max() <= BARS + 1 for sky in skies])
    said = [
        f"* {'met' if share >= SHARE else '**missed**'}: share of biases within two bars {share:.3f} ({SHARE})",
        f"* skies all of whose biases are within three bars: {worst:.2f}",
    ]
    print(f"seed {seed}, {asked.scenes} skies, {time.time() - began:.0f} s\n\n" + "\n".join([*lines, "", *said]))
    if asked.judge:
        words = f"Seed {seed} = 0x{commit[:8]}; two or three radars, 3 to 12 aircraft, 10 to 30 minutes."
        print("written:", judged.append([title, "", words, "", *said, "", *lines, ""]), file=sys.stderr)


if __name__ == "__main__":
    try:
        main()
    except InputError as error:
        sys.exit(str(error))
