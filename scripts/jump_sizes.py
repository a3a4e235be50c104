"""Print how soon jumps of a parameter are found whose size nobody told, and how often nothing was: the tables of
docs/detectors.md.

    python scripts/jump_sizes.py            # three minutes
    python scripts/jump_sizes.py --choose   # the sizes that compete, chosen on signals of another seed

Signals are N(0, 1) with slopes that are white or constant; plants are drawn: order 1 or 2, poles .5 to .97, inputs that
are white, steps or slow, noise of the equation of 1 to 50 % of the output.
"""

from __future__ import annotations

import sys
import time

import numpy as np
from scipy.signal import lfilter
from scipy.stats import poisson

import driftwise as dw
from driftwise.detect import size_mixture as mixture
from driftwise.engine import compile
from driftwise.engine.dispatch import flatten

CHOOSE, JUDGE = 7, 2024  # seeds
PARAMETERS, RATE, BEFORE = 4, 10_000, 300
NOISES = {
    "normal": lambda rng, T: rng.standard_normal(T),
    "Student, 8 degrees": lambda rng, T: rng.standard_t(8, T) * 0.75**0.5,
    "Laplace": lambda rng, T: rng.laplace(0.0, 0.5**0.5, T),
    "skewed (gamma, 16)": lambda rng, T: (rng.gamma(16.0, size=T) - 16.0) / 4.0,
    "uniform": lambda rng, T: rng.uniform(-(3.0**0.5), 3.0**0.5, T),
}


def draw_slopes(rng, shape, are_constant):
    return np.ones(shape) if are_constant else rng.standard_normal(shape)


def delay(detector, size, are_constant=False, runs=300, seed=JUDGE, longest=20_000):
    """Return the mean delay of a jump of parameter 0 that moves z by ``size`` standard deviations (r.m.s.)."""
    rng, spec = np.random.default_rng(seed), flatten((detector,))
    states = np.zeros((runs, detector.state_size(PARAMETERS)))
    found, first = np.full(runs, float(longest)), 0
    block = max(min(int(30 / size**2), 4000), BEFORE)
    left = np.arange(runs)
    for start in range(-BEFORE, longest, block):
        samples = BEFORE if start < 0 else block
        slopes = draw_slopes(rng, (runs, samples, PARAMETERS), are_constant)[left]
        z = rng.standard_normal((runs, samples))[left] + (size * slopes[:, :, 0] if start >= 0 else 0.0)
        outs, kept = np.empty((len(left), samples, 1)), states[left]
        compile.watcher(type(detector))(kept, z, np.ascontiguousarray(slopes), outs, spec)
        states[left] = kept
        if start < 0:
            continue
        hit = outs[:, :, 0] != 0
        found[left] = np.where(hit.any(axis=1), first + hit.argmax(axis=1) + 1, longest)
        first, left = first + samples, left[~hit.any(axis=1)]
        if not len(left) or first >= longest:
            break
    return found.mean()


def run_length(detector, alarms=500, seed=CHOOSE, block=100_000):
    """Return samples per alarm, slopes white."""
    rng, state, found, samples = np.random.default_rng(seed), np.zeros((1, detector.state_size(PARAMETERS))), 0, 0
    while found < alarms:
        outs = np.empty((1, block, 1))
        z, slopes = rng.standard_normal((1, block)), rng.standard_normal((1, block, PARAMETERS))
        compile.watcher(type(detector))(state, z, slopes, outs, flatten((detector,)))
        found, samples = found + np.count_nonzero(outs), samples + block
    return samples / found


def choose():
    """Print the loss of delay of each set of sizes against the best of all, at one rate of false alarms."""
    sizes, found = (0.1, 0.15, 0.2, 0.3, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 5.0), {}
    print(f"| smallest, how many | {' | '.join(map(str, sizes))} | loss |\n|---|{'---|' * (len(sizes) + 1)}")
    for smallest in (0.08, 0.13, 0.2):
        for K in (3, 4, 5):
            low = mixture.SizeMixture(smallest, float(K), np.log(2 * PARAMETERS * 600.0))
            h = low.h + np.log(RATE / 600.0) - np.log(run_length(low) / 600.0)
            detector = low._replace(h=float(h))
            found[smallest, K] = [delay(detector, size, runs=150, seed=CHOOSE) for size in sizes]
    best = np.min(list(found.values()), axis=0)
    for (smallest, K), delays in found.items():
        loss = np.exp(np.mean(np.log(delays / best)))
        print(f"| {smallest}, {K} | {' | '.join(f'{d:.1f}' for d in delays)} | {loss:.3f} |")


def table_of_delays():
    sizes = (0.1, 0.15, 0.2, 0.3, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 5.0)
    print("| the jump moves z by, sd | any size | told the size | told, calibrated | told a third | told three times |")
    print("|---|---|---|---|---|---|")
    for size in sizes:
        told = dw.detect.ScoreCUSUM(RATE, size)
        made = [dw.detect.ScoreCUSUM(RATE), told, told.calibrated_to(np.ones(PARAMETERS))]
        made += [dw.detect.ScoreCUSUM(RATE, k * size) for k in (1 / 3, 3)]
        found = [delay(detector.resolve(PARAMETERS), size) for detector in made]
        print(f"| {size} | {' | '.join(f'{d:.1f}' for d in found)} |")


def plant(seed, samples, noise="normal", drop=0.0, at=0):
    """Return a record of a drawn plant, and its order; all its gains drop by this share, from sample ``at`` on."""
    rng = np.random.default_rng([JUDGE, seed])
    n = int(rng.integers(1, 3))
    a, b = np.poly(rng.uniform(0.5, 0.97, n)), np.r_[0.0, rng.standard_normal(n)]
    u = (
        lambda: rng.standard_normal(samples),
        lambda: np.repeat(rng.choice([-1.0, -0.6, 0.6, 1.0], samples), rng.integers(2, 40, samples))[:samples],
        lambda: lfilter([(1 - 0.95**2) ** 0.5], [1.0, -0.95], rng.standard_normal(samples)),
    )[rng.integers(3)]()
    path = np.where(np.arange(samples) < at, 1.0, 1.0 - drop) if drop else 1.0
    loud = 10 ** rng.uniform(-2.0, np.log10(0.5)) * np.std(lfilter(b, a, u))
    shaped = np.std(lfilter([1.0], a, rng.standard_normal(20_000)))
    return lfilter([1.0], a, path * lfilter(b, [1.0], u) + loud / shaped * NOISES[noise](rng, samples)), u, n


def alarms(detector, y, u, n):
    est = dw.ARX(n, n, memory=dw.RestartOnChange(detector)).scaled_to(y, u)
    return np.flatnonzero(est.scan(y, u).status & dw.Status.JUMP)


def table_of_promises(plants=300, samples=8000, rate=2000):
    print("\n| noise | promised | any size | 95 % interval of the promise | told a size of 1 |\n|---|---|---|---|---|")
    for noise in NOISES:
        counts, promised = np.zeros(2, int), 0.0
        for seed in range(plants):
            y, u, n = plant(seed, samples, noise)
            promised += (samples - 12 * n) / rate
            counts += [len(alarms(dw.detect.ScoreCUSUM(rate, jump), y, u, n)) for jump in (None, 1.0)]
        low, high = poisson.ppf([0.025, 0.975], promised)
        print(f"| {noise} | {promised:.0f} | {counts[0]} | {low:.0f} to {high:.0f} | {counts[1]} |")


def table_of_drops(plants=200, samples=3000):
    print("\n| gains drop by | any size: found, median delay | told a size of 1 | told .1 | `VarianceCUSUM` |")
    print("|---|---|---|---|---|")
    made = [dw.detect.ScoreCUSUM(RATE, jump) for jump in (None, 1.0, 0.1)]
    made.append(dw.detect.VarianceCUSUM(false_alarms=RATE, threshold=None))
    for drop in (0.1, 0.2, 0.31, 0.5):
        told = []
        for detector in made:
            late = [alarms(detector, *plant(k, samples, "normal", drop, samples // 2)) for k in range(plants)]
            late = [found[found >= samples // 2][:1] - samples // 2 for found in late]
            delays = [float(found[0]) if len(found) else np.inf for found in late]
            middle = np.median(delays)
            told.append(f"{100 * np.mean(np.isfinite(delays)):.0f} %, {middle:.0f}".replace("inf", "never"))
        print(f"| {100 * drop:.0f} % | {' | '.join(told)} |")


def table_of_cost():
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=50_000, noise_std=0.1, noise="equation", seed=1)
    print("\n| `ARX(2, 2)` with | ns a sample | numbers of a state |\n|---|---|---|")
    for name, jump in (("`ScoreCUSUM()`", None), ("`ScoreCUSUM(jump=1.0)`", 1.0)):
        est, taken = dw.ARX(2, 2, memory=dw.RestartOnChange(dw.detect.ScoreCUSUM(jump=jump))), []
        for _ in range(6):
            start = time.process_time()
            est.scan(y, u)
            taken.append(time.process_time() - start)
        print(f"| {name} | {1e9 * min(taken) / len(y):.0f} | {est.dtype.itemsize // 8} |")


if __name__ == "__main__":
    if "--choose" in sys.argv:
        choose()
    else:
        table_of_delays()
        table_of_promises()
        table_of_drops()
        table_of_cost()
