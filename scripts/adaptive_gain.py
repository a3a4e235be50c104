"""Print the tables of docs/adaptive-gain.md: K-MSE, state error and alarms of each way to learn a gain.

The plant of Perriot-Mathonna (1981), section 5: Phi = .99, best gain .1 / .3 / .1 / .3 for 500 samples each.
"""

import sys
import time

import numpy as np

import driftwise as dw
from driftwise.models.gain import noise_of_gain

PHI = 0.99
PAPER = dict(K0=0.0, x0=0.0)
PRIOR = dw.models.InverseGamma(2.5, 2.5)  # five samples of variance 1
SLOW = dict(K0=0.0, P0=0.04, x0=0.0)  # the prior of the tables of 1981's successors: K = 0 +- .2


def records(runs, levels=(0.1, 0.3, 0.1, 0.3), jumps="Q", seed=1, segment=500, louder=(1, 1, 1, 1)):
    """Return x, y (runs, T), the best gain (T,), and Q, R (T,), both ``louder`` times what they are otherwise."""
    rng = np.random.default_rng(seed)
    K = np.repeat(levels, segment)
    Q = noise_of_gain(K, PHI) if jumps == "Q" else np.full(K.size, noise_of_gain(levels[0], PHI))
    R = Q / noise_of_gain(K, PHI) * np.repeat(louder, segment)
    Q = Q * np.repeat(louder, segment)
    x = np.empty((runs, K.size))
    x[:, 0] = rng.standard_normal(runs) * np.sqrt(Q[0] / (1 - PHI**2))
    for t in range(1, K.size):
        x[:, t] = PHI * x[:, t - 1] + np.sqrt(Q[t - 1]) * rng.standard_normal(runs)
    return x, x + np.sqrt(R) * rng.standard_normal(x.shape), K, Q, R


def optimal(y, Q, R):
    """Return the filtered states of the Kalman filter that knows Q and R."""
    x, P, found = np.zeros(len(y)), Q[0] / (1 - PHI**2), np.empty_like(y)
    for t in range(y.shape[1]):
        gain = P / (P + R[t])
        found[:, t] = x + gain * (y[:, t] - x)
        x, P = PHI * found[:, t], PHI**2 * (1 - gain) * P + Q[t]
    return found


def run(est, y):
    """Return gains, filtered states and alarms (signed samples since the change), each (runs, T)."""
    outs = np.empty((*y.shape, est.n_columns + 2))
    est.drive(est._rows(est.start(len(y)), is_one=False), y[..., None].copy(), np.zeros((*y.shape, 0)), outs, est.spec,
              est.scratch())  # fmt: skip
    return outs[..., est.n_columns + 1], outs[..., est.n_columns], outs[..., 6]


def found(alarms, segment=500, ways=(1, -1, 1)):
    """Return the share of runs that alarm in the right direction within the segment after each jump."""
    cut = [alarms[:, segment * (i + 1) : segment * (i + 2)] for i in range(len(ways))]
    return [float(np.mean(np.any(c * way > 0, axis=1))) for c, way in zip(cut, ways)]


WAYS = {
    "plr, 1/n (the paper's first)": dict(method="plr", memory=dw.Constant(), **PAPER),
    "plr, forgetting .996 (its second)": dict(method="plr", memory=dw.ExponentialForgetting(0.996), **PAPER),
    "plr, limited gain 250": dict(method="plr", memory=dw.memory.GainFloor(250), **PAPER),
    "plr, Hinkley on Z (its third)": dict(
        method="plr", memory=dw.Constant(), detector=dw.detect.PullTest(), restart=(6, 15), **PAPER
    ),
    "plr, Hinkley on Z, one alarm per 2000": dict(
        method="plr",
        memory=dw.Constant(),
        detector=dw.detect.PullTest((0.15, 0.07), (18.3, 24.4)),
        restart=26.5,
        **PAPER,
    ),
    "plr, probes": dict(
        method="plr", memory=dw.Constant(), scale_samples=50, detector=dw.detect.GainProbes(), restart=26.5, **PAPER
    ),
    "rpem, 1/n, probes": dict(
        memory=dw.Constant(), scale_samples=50, detector=dw.detect.GainProbes(threshold=5.64), restart=10, **PAPER
    ),
    "rpem, matched walk": dict(memory=dw.RandomWalk(8e-5), **SLOW),
    "rpem, matched walk, prior scale": dict(memory=dw.RandomWalk(8e-5), scale=PRIOR, **SLOW),
    "rpem, walk too slow (1e-5)": dict(memory=dw.RandomWalk(1e-5), scale_samples=50, **SLOW),
    "rpem, walk too slow, probes": dict(
        memory=dw.RandomWalk(1e-5),
        scale_samples=50,
        detector=dw.detect.GainProbes(threshold=5.68),
        restart=0.5**0.5,
        **SLOW,
    ),
    "the defaults": {},
    "the defaults, prior scale": dict(scale=PRIOR),
    "the defaults, probes": dict(detector=dw.detect.GainProbes()),
}


def table(runs, **options):
    """Print one line for each way."""
    x, y, K, Q, R = records(runs, **options)
    best = np.mean((optimal(y, Q, R) - x) ** 2)
    fixed = {"fixed at the middle of the levels": dict(memory=dw.RandomWalk(0.0), K0=K.mean(), P0=0.0, x0=0.0)}
    for name, settings in (fixed | WAYS).items():
        gains, states, alarms = run(dw.AdaptiveGain(PHI, **settings), y)
        error = 1000 * (gains - K) ** 2
        per_run = error.mean(axis=1)
        segments = " ".join(f"{v:5.1f}" for v in error.reshape(runs, 4, -1).mean(axis=(0, 2)))
        ratio = np.mean((states - x) ** 2) / best
        line = f"{name:40s} {per_run.mean():6.2f} +- {per_run.std() / runs**0.5:.2f} | {segments} | {ratio:.3f}"
        if "detector" in settings:
            shares = " ".join(f"{v:.2f}" for v in found(alarms))
            line += f" | found {shares}, {np.mean(np.sum(alarms != 0, axis=1)):.1f} alarms a run"
        print(line)


MEMORIES = {
    "none given: a matched walk": None,
    "`Constant()`": dw.Constant(),
    "`GainFloor(250)`": dw.memory.GainFloor(250),
    "`ExponentialForgetting(.996)`": dw.ExponentialForgetting(0.996),
    "`VariableForgetting(250)`": dw.memory.VariableForgetting(250),
    "`DirectionalForgetting(.996)`": dw.memory.DirectionalForgetting(0.996),
    "`Drift(nvr=1e-4)`": dw.memory.Drift(nvr=1e-4),
    "`Window(250)`": dw.memory.Window(250),
    "`BayesianChangePoint(.2, 500, 10)`": dw.memory.BayesianChangePoint(0.2, 500, 10),
    "`LikelihoodDrift()`": dw.memory.LikelihoodDrift(),
    "`AutocovarianceLS(5)`": dw.memory.AutocovarianceLS(5),
    "`MultipleModel()`": dw.memory.MultipleModel(),
    "`IMM()`": dw.memory.IMM(),
    "`AutoMemory()`": dw.AutoMemory(),
}
CASES = {
    "Q jumps .1/.3": {},
    "R jumps .1/.3": dict(jumps="R"),
    "Q jumps .4/.6": dict(levels=(0.4, 0.6, 0.4, 0.6)),
    ".2/.25": dict(levels=(0.2, 0.25, 0.2, 0.25)),
    ".05/.7": dict(levels=(0.05, 0.7, 0.05, 0.7)),
    "rests at .3": dict(levels=(0.3,) * 4),
    "both 25 times louder": dict(levels=(0.3,) * 4, louder=(1, 25, 1, 25)),
}


def table_of_memories(runs):
    """Print, of each memory in each case, K-MSE x 1000 and the state error over that of the filter that knows."""
    worlds = [records(runs, **options) for options in CASES.values()]
    best = [np.mean((optimal(y, Q, R) - x) ** 2) for x, y, _, Q, R in worlds]
    print(f"\n| memory | {' | '.join(CASES)} |\n{'|---' * (len(CASES) + 1)}|")
    for name, memory in MEMORIES.items():
        est, cells = dw.AdaptiveGain(PHI, memory=memory), []
        for (x, y, K, *_), least in zip(worlds, best):
            gains, states, _ = run(est, y)
            cells.append(f"{1000 * np.mean((gains - K) ** 2):.1f}, {np.mean((states - x) ** 2) / least:.2f}")
        print(f"| {name} | {' | '.join(cells)} |", flush=True)


def tracker(runs=50, T=4000, q=0.01, seed=3, **settings):
    """Print how a constant-velocity tracker of unknown noise does: gain, state error and NIS in the second half."""
    from driftwise.models.gain import kalman_gain

    Phi, H = np.array([[1.0, 1.0], [0.0, 1.0]]), np.array([1.0, 0.0])
    Q = q * np.array([[1 / 3, 1 / 2], [1 / 2, 1.0]])
    best, rng, L = kalman_gain(Phi, H, Q, 1.0), np.random.default_rng(seed), np.linalg.cholesky(Q)
    ratios, gains, nis = [], [], []
    for _ in range(runs):
        x = np.zeros((T, 2))
        for t in range(1, T):
            x[t] = Phi @ x[t - 1] + L @ rng.standard_normal(2)
        y = x[:, 0] + rng.standard_normal(T)
        trace, fixed = dw.AdaptiveGain(Phi, **settings).scan(y), np.zeros(2)
        known = np.empty_like(x)
        for t in range(T):
            known[t] = fixed + best * (y[t] - fixed[0])
            fixed = Phi @ known[t]
        late = slice(T // 2, None)
        ratios.append(np.mean((trace.x - x)[late] ** 2, axis=0) / np.mean((known - x)[late] ** 2, axis=0))
        gains.append(trace.parameters[-1])
        nis.append(np.mean(trace.innovation[late] ** 2 / trace.variance[late]))
    print(f"best gain {best.round(3)}, learnt {np.mean(gains, 0).round(3)} +- {np.std(gains, 0).round(3)}")
    print(
        f"state error / best {np.mean(ratios, 0).round(3)}, NIS {np.mean(nis):.3f} ({min(nis):.2f} to {max(nis):.2f})"
    )


if __name__ == "__main__":
    runs, begin = int(sys.argv[1]) if len(sys.argv) > 1 else 1000, time.perf_counter()
    table_of_memories(runs)
    for title, options in {
        "Q jumps, .1 / .3": {},
        "R jumps, .1 / .3": dict(jumps="R"),
        "Q jumps, .4 / .6": dict(levels=(0.4, 0.6, 0.4, 0.6)),
        "Q jumps, .2 / .25": dict(levels=(0.2, 0.25, 0.2, 0.25)),
        "Q jumps, .05 / .7": dict(levels=(0.05, 0.7, 0.05, 0.7)),
    }.items():
        print(f"\n{title}: K-MSE x 1000 | by segment | state error / best")
        table(runs, **options)
    for q in (1e-4, 1e-2, 1.0):
        for name, settings in {"the defaults": {}, "memory=Constant()": dict(memory=dw.Constant())}.items():
            print(f"\nconstant-velocity tracker, Q/R = {q:g}, {name}")
            tracker(q=q, **settings)
    print(f"{time.perf_counter() - begin:.0f} s")
