"""`Joint` with `AutoMemory`, which is told nothing, against the joint filter that is told Q, sigma, jumps and outliers.

Six plants of order 1 to 3, each with what makes it hard, and four more that are harder; a seed draws coefficients,
input and all that happens.
Printed: RMS error of the parameters and of the state over that of the filter that knows, each coordinate in units of
that filter's own error; the share of truths within 1.96 deviations; microseconds a sample.

    python scripts/joint_memory.py [--seeds 200] [--samples 1000] [--memory auto]
"""

import argparse
import time
from itertools import pairwise
from typing import NamedTuple

import numpy as np

import driftwise as dw
from driftwise.cli import specs
from driftwise.engine import ud

BEGIN = 100  # samples before errors count: nobody knows anything yet


class World(NamedTuple):
    """What happens in a plant: order, NVR of its drift, jumps (where; size of those of b), and what is wrong."""

    order: int
    nvr: float = 0.0
    jumps: tuple[float, ...] = ()
    size: float = 0.0
    louder: float = 1.0  # times the noise's deviation, from the middle on
    outliers: float = 0.0
    missing: float = 0.0
    output_error: bool = False


WORLDS = {
    "drift": World(2, nvr=1e-3),
    "jumps": World(2, jumps=(0.3, 0.7), size=0.5),
    "drift and a jump": World(2, nvr=1e-3, jumps=(0.5,), size=0.5),
    "noise step": World(1, nvr=1e-4, louder=4.0),
    "outliers": World(2, nvr=3e-4, outliers=0.02),
    "output error": World(2, nvr=3e-4, output_error=True),
    "20 % missing": World(3, nvr=3e-4, missing=0.2),
    "output error, a jump": World(2, nvr=3e-4, jumps=(0.5,), size=0.5, output_error=True),
    "outliers and a jump": World(2, nvr=3e-4, jumps=(0.5,), size=0.5, outliers=0.02),
    "5 % outliers": World(2, nvr=3e-4, outliers=0.05),
}
SIX = "drift", "jumps", "noise step", "outliers", "output error", "20 % missing"
SIGMA = 0.2


class Record(NamedTuple):
    """A record and its truth: x and theta of every sample, variances of the steps of theta, and what happened when."""

    y: np.ndarray
    u: np.ndarray
    x: np.ndarray
    theta: np.ndarray
    q: np.ndarray
    jumps: list[int]
    sigma: np.ndarray
    wrong: np.ndarray


def drawn(world: World, samples: int, seed: int) -> Record:
    """Draw a record; theta is a1..an, b1..bn as the filter has them."""
    rng, n, T = np.random.default_rng(seed), world.order, samples
    poles = rng.uniform(0.3, 0.85, n) * rng.choice([-1.0, 1.0], n, p=[0.2, 0.8])
    a, b = np.poly(poles)[1:], rng.uniform(0.5, 1.5, n) * rng.choice([-1.0, 1.0], n)
    u = rng.standard_normal(T)
    sigma = np.where(np.arange(T) < T // 2, SIGMA, SIGMA * world.louder)
    theta, x, y = np.empty((T, 2 * n)), np.empty((T, n)), np.empty(T)
    gain = 1.0 + np.sum(b**2) / max(1 - max(abs(poles)) ** 2, 0.1)  # about the variance of y
    q = world.nvr * SIGMA**2 / np.repeat([gain, 1.0], n)
    jumps = [int(share * T) for share in world.jumps]
    now, state = np.concatenate([a, b]), np.zeros(n)
    for t in range(T):
        if t in jumps:
            now = now + np.concatenate([0.1 * rng.standard_normal(n), world.size * rng.choice([-1.0, 1.0], n)])
        if max(abs(np.roots(np.r_[1.0, now[:n]]))) > 0.97:  # no step that would make it run away
            now[:n] = theta[t - 1, :n] if t else a
        theta[t], x[t] = now, state
        noise = sigma[t] * rng.standard_normal()
        y[t] = state[0] + noise
        feeds = state[0] if world.output_error else y[t]
        state = np.append(state[1:], 0.0) - now[:n] * feeds + now[n:] * u[t]
        now = now + np.sqrt(q) * rng.standard_normal(2 * n)
    wrong = rng.random(T) < world.outliers
    y = y + np.where(wrong, 10 * SIGMA * rng.choice([-1.0, 1.0], T) * rng.uniform(1, 2, T), 0.0)
    y[rng.random(T) < world.missing] = np.nan
    return Record(y, u, x, theta, q, jumps, sigma, wrong)


def noise_of(world, variance=None):
    """Return the noise of the plant."""
    return dw.models.OutputError(variance) if world.output_error else dw.models.EquationError(variance)


def told(world: World, record: Record):
    """Return x, theta and their deviations of the filter that is told everything."""
    y = np.where(record.wrong, np.nan, record.y)
    steps = sorted({0, len(y), *record.jumps, *np.flatnonzero(np.diff(record.sigma)) + 1})
    memory = dw.memory.Drift(q=record.q) if world.nvr else dw.Constant()
    state, parts = None, []
    for first, last in pairwise(steps):
        est = dw.Joint(world.order, 1, noise=noise_of(world, record.sigma[first] ** 2), memory=memory)
        if state is None:
            state = est.start()
        if first in record.jumps:
            P, n = est._covariance(state), world.order
            P[n:, n:] += np.diag(np.repeat([0.1**2, world.size**2], n))
            U, D = ud.factor(P)
            state["U"], state["D"] = U[ud.packed_indices(len(D))], D
        trace = est.scan(y[first:last], record.u[first:last], state=state)
        state = trace.state
        parts.append([trace.x, trace.parameters, trace.x_std, trace.parameters_std])
    return [np.concatenate(part) for part in zip(*parts)]


def untold(world: World, record: Record, memory, kind=dw.Joint):
    """Return the same of the filter that is told nothing."""
    order = (world.order,) if kind is dw.JointMIMO else world.order
    trace = kind(order, 1, noise=noise_of(world), memory=memory).scaled_to(record.y, record.u)
    trace = trace.scan(record.y, record.u)
    return [trace.x, trace.parameters, trace.x_std, trace.parameters_std]


def measure(world: World, memory, seeds: int, samples: int, first: int = 0, kind=dw.Joint):
    """Return ratios of x and theta, coverage of both (and of the filter that knows), and microseconds a sample."""
    mine, best, inside, known, spent = [], [], [], [], 0.0
    for seed in range(first, first + seeds):
        record = drawn(world, samples, seed)
        truth = np.hstack([record.x, record.theta])[BEGIN:]
        reference = told(world, record)
        begun = time.perf_counter()
        found = untold(world, record, memory, kind)
        spent += time.perf_counter() - begun if seed > first else 0.0
        for errors, covered, (x, theta, x_std, theta_std) in ((mine, inside, found), (best, known, reference)):
            off = np.hstack([x, theta])[BEGIN:] - truth
            errors.append((off**2).mean(0))
            covered.append((abs(off) <= 1.96 * np.hstack([x_std, theta_std])[BEGIN:] + 1e-12).mean(0))
    n = world.order
    ratio = np.mean(mine, axis=0) / np.mean(best, axis=0)
    x, theta = np.sqrt(ratio[:n].mean()), np.sqrt(ratio[n:].mean())
    cover, reference = np.mean(inside, axis=0), np.mean(known, axis=0)
    cost = 1e6 * spent / max(seeds - 1, 1) / samples
    return x, theta, cover[:n].mean(), cover[n:].mean(), reference[:n].mean(), reference[n:].mean(), cost


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--samples", type=int, default=1000)
    parser.add_argument("--memory", default="auto", help="as the command line writes it")
    parser.add_argument("--mimo", action="store_true", help="by JointMIMO, of one output: it has no output errors")
    parser.add_argument("--only", default="", help="part of the name of a plant")
    given = parser.parse_args()
    print(f"{'':22s}  error: state  theta   inside: state  theta   told: state  theta   us/sample")
    found = {}
    for name, world in WORLDS.items():
        if given.only not in name or (given.mimo and world.output_error):
            continue
        x, theta, in_x, in_theta, told_x, told_theta, cost = measure(
            world,
            specs.memory(given.memory),
            given.seeds,
            given.samples,
            given.first,
            dw.JointMIMO if given.mimo else dw.Joint,
        )
        found[name] = x, theta
        inside = f"{in_x:15.3f} {in_theta:6.3f} {told_x:12.3f} {told_theta:6.3f}"
        print(f"{name:22s} {x:13.2f} {theta:6.2f} {inside} {cost:9.1f}", flush=True)
    for text, names in (("of the six", SIX), ("of all", tuple(WORLDS))):
        some = [ratios for name, ratios in found.items() if name in names]
        if some:
            print(f"{text}: geometric mean {np.exp(np.mean(np.log(some))):.3f}, worst {np.max(some):.2f}")


if __name__ == "__main__":
    main()
