"""Updates by the hundred million: `python -m tests.hostile.soak joint --updates 100000000`.

The record never ends: parameters jump, samples are missing, the input rests, outliers come, the noise and the scale
change. After every stretch the state is finite or its samples say LOST, the diagonal of the covariance is not negative,
and the process has not grown.
"""

from __future__ import annotations

import argparse
import resource
import sys
import time
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

import driftwise as dw
from driftwise.engine.status import LOST

STRETCH = 100_000
GROWTH = 48 << 20  # bytes that a process may gain after the first stretches


def record(rng, samples: int) -> tuple[np.ndarray, np.ndarray]:
    """Return outputs and inputs of a plant of order two that a bad week happens to."""
    y, u, at = np.empty(samples), np.empty(samples), 0
    while at < samples:
        end = min(samples, at + int(rng.integers(50, 20_000)))
        part = slice(at, end)
        radius, angle = rng.uniform(0.2, 0.97), rng.uniform(0.1, 3.0)
        drive = rng.standard_normal(end - at) * 10 ** rng.uniform(-3, 3)
        if rng.random() < 0.3:
            drive[:] = rng.choice([0.0, 1.0])  # a rest
        noise = rng.standard_normal(end - at) * 10 ** rng.uniform(-4, 2)
        shape = [1.0, -2 * radius * np.cos(angle), radius**2]
        y[part] = lfilter([0.0, *rng.standard_normal(2)], shape, drive) + lfilter([1.0], shape, noise)
        y[part] += rng.choice([0.0, 0.0, 100.0])
        u[part] = drive
        at = end
    for values, share in ((y, 0.02), (u, 0.005)):
        values[rng.random(samples) < share] = np.nan
    spots = rng.integers(0, samples, samples // 500)
    y[spots] += rng.standard_cauchy(len(spots)) * 100
    for _ in range(3):  # gaps
        first = int(rng.integers(samples))
        y[first : first + int(rng.integers(1, 3000))] = np.nan
    return y, u


def path(rng, plots: int, begin: float) -> tuple[np.ndarray, np.ndarray]:
    """Return times and positions of an object that turns, rests, is lost, and is seen where it is not."""
    step = rng.choice([0.1, 1.0, 4.0, 12.0, 300.0], plots, p=[0.1, 0.3, 0.5, 0.0999, 0.0001])
    clock = begin + np.cumsum(step)
    turn = np.repeat(rng.choice([0.0, 0.0, 0.03, -0.05], plots // 100 + 1), 100)[:plots]
    speed = np.repeat(rng.choice([0.0, 150.0, 250.0], plots // 300 + 1), 300)[:plots]
    course = np.cumsum(turn * step)
    way = np.cumsum(np.stack([speed * step * np.sin(course), speed * step * np.cos(course)], axis=1), axis=0)
    seen = way + rng.standard_normal(way.shape) * 10 ** rng.uniform(0, 2.5)
    seen[rng.random(plots) < 0.03] = np.nan
    spots = rng.integers(0, plots, plots // 1000 + 1)
    seen[spots] += rng.standard_cauchy((len(spots), 2)) * 1e4
    return clock, seen


@dataclass
class Found:
    """What a soak came to."""

    updates: int = 0
    lost: int = 0
    seconds: float = 0.0
    grown: int = 0


def _held() -> int:
    """Return the bytes this process holds now."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * resource.getpagesize()


def refuse(state, lost: bool) -> None:
    """Raise where a state is not finite, or a variance is below nothing."""
    unknown = {"plots"}
    numbers = {
        name: np.asarray(state[name], float)
        for name in state.dtype.names
        if name not in unknown and state.dtype[name].names is None
    }
    wrong = [name for name, values in numbers.items() if not np.isfinite(values).all()]
    if wrong and not lost:
        raise AssertionError(f"not finite, and not LOST: {', '.join(wrong)}")
    if "D" in numbers and not lost and not (numbers["D"] >= 0).all():
        raise AssertionError(f"a negative variance: {numbers['D']}")


KINDS = {
    "joint": lambda: dw.Joint(2, inputs=1, memory=dw.ExponentialForgetting(0.999)),
    "joint-auto": lambda: dw.Joint(1, inputs=1, memory=dw.AutoMemory()),
    "arx-auto": lambda: dw.ARX(2, 2, memory=dw.AutoMemory()),
    "track": lambda: dw.TrackEstimator("aircraft"),
}


def soak(kind: str, updates: int, seed: int = 1, tell=None) -> Found:
    """Run so many updates; raise `AssertionError` where a promise breaks. ``tell`` hears how far it is."""
    rng, est, found = np.random.default_rng(seed), KINDS[kind](), Found()
    state, begin, held = None, 0.0, 0
    while found.updates < updates:
        count = min(STRETCH, updates - found.updates)
        if kind == "track":
            clock, seen = path(rng, count, begin)
            begin = float(clock[-1])
        else:
            y, u = record(rng, count)
        begun = time.process_time()
        trace = (
            est.scan(clock, seen, state=state) if kind == "track" else est.scan(y, u, state=state, keep="innovations")
        )
        found.seconds += time.process_time() - begun
        state, status = trace.state, np.asarray(trace.status, int)
        found.updates += count
        found.lost += int((status & LOST != 0).sum())
        refuse(state, bool(status[-1] & LOST))
        finite = np.isfinite(trace.prediction).reshape(count, -1).all(axis=1) | (status & LOST != 0)
        if kind != "track" and not finite.all():
            raise AssertionError(f"prediction {int(finite.argmin())} is not finite, and not LOST")
        del trace
        held = held or (_held() if found.updates >= 5 * STRETCH else 0)
        found.grown = _held() - held if held else 0
        if found.grown > GROWTH:
            raise AssertionError(f"grew by {found.grown >> 20} MB")
        if tell is not None and found.updates % (100 * STRETCH) == 0:
            tell(found)
    return found


def friendly(kind: str, updates: int, seed: int = 1) -> Found:
    """Run updates one by one through the friendly call."""
    rng, est, found = np.random.default_rng(seed), KINDS[kind](), Found()
    state, begin, held = est.start(), 0.0, 0
    while found.updates < updates:
        count = min(10_000, updates - found.updates)
        if kind == "track":
            clock, seen = path(rng, count, begin)
            begin, samples = float(clock[-1]), zip(clock.tolist(), seen)
        else:
            samples = zip(*(values.tolist() for values in record(rng, count)))
        begun = time.process_time()
        for first, second in samples:
            state, step = est.update(state, first, second)
        found.seconds += time.process_time() - begun
        found.updates += count
        refuse(state, bool(int(np.max(step.status)) & LOST))
        held = held or (_held() if found.updates >= 30_000 else 0)
        found.grown = _held() - held if held else 0
        if found.grown > GROWTH // 4:
            raise AssertionError(f"grew by {found.grown >> 20} MB")
    return found


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.hostile.soak", description=__doc__)
    parser.add_argument("kind", nargs="*", help=f"of {', '.join(KINDS)}; all if omitted")
    parser.add_argument("--updates", type=int, default=10**8)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--friendly", action="store_true", help="one by one, through the friendly call")
    asked = parser.parse_args()
    for kind in asked.kind or KINDS:

        def tell(found, kind=kind):
            each, grown = found.seconds / found.updates * 1e9, found.grown / 1e6
            print(
                f"{kind}: {found.updates} updates, {each:.0f} ns each, {found.lost} LOST, grew {grown:.1f} MB",
                flush=True,
            )

        if asked.friendly:
            tell(friendly(kind, asked.updates, asked.seed))
        else:
            tell(soak(kind, asked.updates, asked.seed, tell))
    return 0


if __name__ == "__main__":
    sys.exit(main())
