"""When does `Joint` with `AutoMemory` lose what it loses to the filter that is told everything?

Of each plant of `joint_memory.py`: by how much the squared errors of state and parameters exceed those of the filter
that knows, each coordinate in units of its own mean square, split by samples since something happened. The parts add
up to the square of the ratio, less one.

    python scripts/joint_excess.py [--seeds 60] [--first 1000] [--samples 1000] [--memory auto] [--only jumps]
"""

import argparse
from itertools import pairwise

import numpy as np
from joint_memory import BEGIN, WORLDS, drawn, told, untold

from driftwise.cli import specs

SINCE = (0, 3, 6, 10, 20, 50, 100)  # samples after a jump or a step of the noise
YOUNG = (100, 200, 300, 500)  # samples from the start, where nothing has happened yet


def edges(world, samples: int) -> list[int]:
    """Return where the parts of a record begin, and its end."""
    events = [int(share * samples) for share in world.jumps] + [samples // 2] * (world.louder != 1.0)
    at = {BEGIN, samples, *(k for k in YOUNG if k < min([*events, samples]))}
    for event, last in pairwise([*events, samples]):
        at |= {event + k for k in SINCE if event + k < last}
    return sorted(at)


def excess(world, memory, seeds, samples: int):
    """Return excess of state and of parameters, (T,) each, and the share of truths within the 95 % bars, likewise."""
    mine, best, inside, n = 0.0, 0.0, 0.0, world.order
    for seed in seeds:
        record = drawn(world, samples, seed)
        truth = np.hstack([record.x, record.theta])
        x, theta, x_std, theta_std = untold(world, record, memory)
        off = np.hstack([x, theta]) - truth
        mine = mine + off**2
        inside = inside + (abs(off) <= 1.96 * np.hstack([x_std, theta_std]) + 1e-12)
        best = best + (np.hstack(told(world, record)[:2]) - truth) ** 2
    over = (mine - best) / best[BEGIN:].mean(0) / (samples - BEGIN)
    inside = inside / len(seeds)
    return over[:, :n].mean(1), over[:, n:].mean(1), inside[:, :n].mean(1), inside[:, n:].mean(1)


def main():
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seeds", type=int, default=60)
    parser.add_argument("--first", type=int, default=1000, help="first seed")
    parser.add_argument("--samples", type=int, default=1000)
    parser.add_argument("--memory", default="auto", help="as the command line writes it")
    parser.add_argument("--only", default="", help="part of the name of a plant")
    given = parser.parse_args()
    for name, world in WORLDS.items():
        if given.only not in name:
            continue
        seeds = range(given.first, given.first + given.seeds)
        x, theta, in_x, in_theta = excess(world, specs.memory(given.memory), seeds, given.samples)
        print(f"{name}: {x[BEGIN:].sum():.2f} of the state, {theta[BEGIN:].sum():.2f} of the parameters")
        print(f"{'samples':>13s}   excess: state  theta   inside: state  theta")
        for a, b in pairwise(edges(world, given.samples)):
            parts = f"{x[a:b].sum():15.3f} {theta[a:b].sum():6.3f} {in_x[a:b].mean():15.3f} {in_theta[a:b].mean():6.3f}"
            print(f"{a:6d}-{b:6d} {parts}", flush=True)


if __name__ == "__main__":
    main()
