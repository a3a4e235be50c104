"""A month of the demonstration's pumps: how often it alarms for nothing, how soon a bearing and a drift are found.

`python scripts/live_month.py [SEED]`: prints the counts beside what was promised.
"""

from __future__ import annotations

import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.stats import chi2

from driftwise.cli.live import estimator_of
from driftwise.live import demo
from driftwise.live.board import EventView
from driftwise.live.config import Config, WebConfig
from driftwise.live.core import Core
from driftwise.live.decode import Chunk
from driftwise.live.sources.base import Parcel
from driftwise.live.store.sqlite import SqliteStore

PROMISED = 10_000  # samples from one false alarm to the next
MONTH = 30 * 86_400 // 10  # samples of a pump, one every ten seconds
MONTHS = 4
AT_ONCE = 5_000  # samples of each pump between two commits
SETTLED = 1_000  # samples of a sound pump before anything happens to it
WITHIN = 30  # samples in which a failed bearing is to be found
WEAR = 20_000  # samples in which a gain wears down by half
START = 1.7e9

Gain = Callable[[np.ndarray], np.ndarray]


def outputs(pumps: int, samples: int, seed: int, gain: Gain) -> tuple[np.ndarray, np.ndarray]:
    """Return flow and speed (pumps, samples) of the demonstration's pumps; ``gain`` is of the sample's number."""
    rng = np.random.default_rng(seed)
    turned = rng.random((samples, pumps)) < demo.STEP
    wanted = 50.0 + 2.0 * rng.standard_normal((samples, pumps))
    noise, b = demo.NOISE * rng.standard_normal((samples, pumps)), gain(np.arange(samples))
    flow, speed = np.empty((samples, pumps)), np.empty((samples, pumps))
    y, u = np.full(pumps, demo.LEVEL), np.full(pumps, 50.0)
    for t in range(samples):
        y = demo.LEVEL + demo.A * (y - demo.LEVEL) + b[t] * (u - 50.0) + noise[t]
        u = np.where(turned[t], wanted[t], u)
        flow[t], speed[t] = y, u
    return flow.T, speed.T


def events(flow: np.ndarray, speed: np.ndarray, jumps: str | None) -> Iterator[EventView]:
    """Yield what a service tells of pumps, ten seconds from sample to sample; without ``jumps`` by `AutoMemory`."""
    with tempfile.TemporaryDirectory(prefix="driftwise-month-") as folder:
        settings: Config = demo.configuration(None, Path(folder), WebConfig(enabled=False))
        model = replace(settings.model, jumps=jumps, memory="constant" if jumps else "auto")
        core = Core(replace(settings, model=model, series=()), SqliteStore(folder), estimator_of)
        for first in range(0, flow.shape[1], AT_ONCE):
            at = range(first, min(first + AT_ONCE, flow.shape[1]))
            time = [START + 10.0 * t for t in at]
            chunks = [
                Chunk(f"pump {k}", list(time), {"flow": y[at].tolist(), "speed": u[at].tolist()})
                for k, (y, u) in enumerate(zip(flow, speed))
            ]
            yield from core.take([Parcel(chunks)], time[-1])
            core.commit()
            part = core.history.part()
            if part is not None:
                core.store.forget(part.last)
                core.history.written(part)
        core.store.close()


def number(event: EventView) -> int:
    """Return the number of the sample that told an event."""
    return round((event.time - START) / 10.0)


def months(seeds: Iterable[int], pumps: int = 12) -> tuple[Counter, float, tuple[float, float]]:
    """Return the events of months of sound pumps by kind, the alarms promised, and the interval of 95 % for them."""
    found, promised = Counter[str](), 0.0
    for seed in seeds:
        found.update(event.kind for event in events(*outputs(pumps, MONTH, seed, sound), f"parameters:{PROMISED}"))
        promised += pumps * MONTH / PROMISED
    n = found["jump"]
    return found, promised, (chi2.ppf(0.025, 2 * n) / 2, chi2.ppf(0.975, 2 * n + 2) / 2)


def sound(t: np.ndarray) -> np.ndarray:
    """Return the gain of a pump that nothing happens to."""
    return np.full(len(t), demo.B)


def failing(t: np.ndarray) -> np.ndarray:
    """Return the gain of a pump whose bearing fails."""
    return np.where(t < SETTLED, demo.B, demo.LEFT * demo.B)


def wearing(t: np.ndarray) -> np.ndarray:
    """Return the gain of a pump that wears down slowly."""
    return demo.B * (1.0 - (1.0 - demo.LEFT) * np.clip((t - SETTLED) / WEAR, 0.0, 1.0))


def bearings(seed: int, pumps: int = 200) -> list[int]:
    """Return after how many samples each failed bearing was told, in order."""
    found: dict[str, int] = {}
    for event in events(*outputs(pumps, SETTLED + 500, seed, failing), "parameters:100000"):
        if event.kind == "jump" and number(event) >= SETTLED:
            found.setdefault(event.key, number(event) - SETTLED + 1)
    return sorted(found.values()) + [500] * (pumps - len(found))


def worn(seed: int, gain: Gain, pumps: int = 12, samples: int = SETTLED + WEAR) -> list[EventView]:
    """Return the drifts that are told of pumps."""
    return [event for event in events(*outputs(pumps, samples, seed, gain), None) if event.kind == "drift"]


def main(seed: int = 0) -> None:
    """Print all of it."""
    found, promised, (low, high) = months(range(seed, seed + MONTHS))
    verdict = "within" if low <= promised <= high else "MISSED:"
    print(f"{MONTHS} months of 12 pumps, {MONTHS * 12 * MONTH} samples: {dict(found)}")
    print(f"alarms: {found['jump']}, promised {promised:.0f}, {verdict} the interval {low:.0f} to {high:.0f}")
    delays = bearings(seed)
    share = np.mean(np.array(delays) <= WITHIN)
    print(f"failed bearings told: median {np.median(delays):.0f} samples, worst {delays[-1]}; within 30: {share:.1%}")
    drifts, none = worn(seed, wearing), worn(seed, sound, samples=40_000)
    keys = {event.key for event in drifts if event.sentence.startswith("b1")}
    print(f"12 gains that wear down by half in {WEAR} samples: {len(keys)} told, in {len(drifts)} events; "
          f"of 12 sound pumps in 40000 samples: {len(none)}")  # fmt: skip
    for event in drifts[:3]:
        print(f"  {event.key} at sample {number(event)}: {event.sentence}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
