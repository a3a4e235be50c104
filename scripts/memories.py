"""Print the tables of docs/memory.md and docs/decisions/wind-up.md: who follows jumps, survives a rest, at what cost.

Besides: who learns the noise, and what directional forgetting remembers where all directions are excited.

Run: python scripts/memories.py (a minute).
"""

import time

import numpy as np
from scipy.optimize import minimize_scalar

import driftwise as dw


def jumping(d, seed, samples=50_000, every=500):
    """Return a constant that jumps by +d or -d, and the constant in unit noise."""
    rng = np.random.default_rng(seed)
    moved = np.where(rng.random(samples) < 1 / every, d * rng.choice([-1.0, 1.0], samples), 0.0)
    theta = np.cumsum(moved)
    return theta, theta + rng.standard_normal(samples)


def resting(seed, samples=5000):
    """Return y = .8 y1 + u1 + e; from sample 1000 to 3999 the input rests and the noise nearly does."""
    rng = np.random.default_rng(seed)
    u, spread = rng.standard_normal(samples), np.full(samples, 0.05)
    u[1000:4000], spread[1000:4000] = 0.0, 0.001
    e, y = spread * rng.standard_normal(samples), np.zeros(samples)
    for t in range(1, samples):
        y[t] = 0.8 * y[t - 1] + u[t - 1] + e[t]
    return y, u


def table_of_jumps():
    """Mean square error of a jumping constant, by jump size over noise."""
    print("\n| memory | " + " | ".join(f"d = {d}" for d in (0.2, 0.5, 1.0, 2.0)) + " |\n|---|---|---|---|---|")
    memories = {
        "`RandomWalk(matched=(d, 500))`": lambda d: dw.RandomWalk(matched=(d, 500)),
        "`VariableForgetting(100, .5)`": lambda d: dw.memory.VariableForgetting(100, 0.5),
        "`ExponentialForgetting(1 - d / sqrt(500))`": lambda d: dw.ExponentialForgetting(1 - d / 500**0.5),
        "`Window(60)`": lambda d: dw.memory.Window(60),
        "`RestartOnChange(PageHinkley, GainReset(1 + 1/d^2))`": lambda d: dw.RestartOnChange(
            dw.PageHinkley(false_alarms="1 per 5000", jump=d), dw.memory.GainReset(1 + 1 / d**2), settle=0
        ),
        "`BayesianChangePoint(d, 500)`": lambda d: dw.memory.BayesianChangePoint(d, 500),
        "`BayesianChangePoint(d, 500, 60)`": lambda d: dw.memory.BayesianChangePoint(d, 500, 60),
    }
    for name, make in memories.items():
        row = []
        for d in (0.2, 0.5, 1.0, 2.0):
            est, found = dw.Regression(1, memory=make(d), variance=1.0, P0=1e3), []
            for seed in range(16):
                theta, y = jumping(d, seed)
                trace = est.scan(y, np.ones((len(y), 1)), keep="means")
                found.append(np.mean((trace.parameters[1000:, 0] - theta[1000:]) ** 2))
            row.append(f"{np.mean(found):.4f}")
        print(f"| {name} | " + " | ".join(row) + " |", flush=True)


def table_of_directions(samples=4000):
    """Root mean square error of b2, and over its bar, so many samples after it jumped by .3; white input, noise .1."""
    after = (-1, 100, 300, 500, 1000)
    b = np.where(np.arange(samples)[:, None] < samples // 2, [1.0, 0.5], [1.0, 0.8])
    inputs = [np.random.default_rng(seed).standard_normal(samples) for seed in range(50)]
    records = [dw.simulate([-1.5, 0.7], b, u=u, noise_std=0.1, seed=99 + seed) for seed, u in enumerate(inputs)]
    print("\n| memory | before | " + " | ".join(f"+{k}" for k in after[1:]) + " |\n|---|---|---|---|---|---|")
    for name, memory in {
        "`ExponentialForgetting(.99)`": dw.ExponentialForgetting(0.99),
        "`DirectionalForgetting(.99)`": dw.memory.DirectionalForgetting(0.99),
        "`DirectionalForgetting(.96)`": dw.memory.DirectionalForgetting(0.96),
    }.items():
        traces = [dw.ARX(2, 2, memory=memory).scan(y, u) for y, u in records]
        at = samples // 2 + np.array(after)
        error = np.array([t.parameters[at, 3] - b[at, 1] for t in traces])
        bar = np.array([t.parameters_std[at, 3] for t in traces])
        size, bars = (np.sqrt(np.mean(v**2, axis=0)) for v in (error, error / bar))
        print(f"| {name} | " + " | ".join(f"{e:.3f} ({z:.1f})" for e, z in zip(size, bars)) + " |", flush=True)


def rare_jump(noise_std, seed):
    """Return ARX(2, 2) of 3000 samples whose b2 jumps by .3 halfway."""
    theta = np.tile([-1.5, 0.7, 1.0, 0.5], (3000, 1))
    theta[1500:, 3] += 0.3
    return dw.simulate(theta[:, :2], theta[:, 2:], samples=3000, noise_std=noise_std, noise="equation", seed=seed)


def likeliest(memory, noise_std, y, u):
    """Return the noise's standard deviation, relative to the truth, that makes the record likeliest."""

    def surprise(log):
        est = dw.ARX(2, 2, memory=memory, variance=(noise_std * np.exp(log)) ** 2, P0=10.0)
        return -est.loglik(est.scan(y, u, keep="innovations").state)

    return np.exp(minimize_scalar(surprise, bounds=(-5, 1), method="bounded").x)


def table_of_noise():
    """Learnt standard deviation of the noise over the true one, where jumps are rare."""
    print("\n| memory | noise .1 | noise .01 |\n|---|---|---|")
    walk, records = (
        dw.RandomWalk(matched=(0.3, 1500)),
        {n: [rare_jump(n, seed) for seed in range(10)] for n in (0.1, 0.01)},
    )
    rows = {
        "Constant()": dw.Constant(),
        "BayesianChangePoint(.3, 1500)": dw.memory.BayesianChangePoint(0.3, 1500),
        "RandomWalk(matched=(.3, 1500))": walk,
    }
    for name, memory in rows.items():
        est = dw.ARX(2, 2, memory=memory)
        found = [[est.sigma2(est.scan(*r).state) ** 0.5 / noise for r in many] for noise, many in records.items()]
        print(f"| `{name}` | " + " | ".join(f"{np.mean(f):.2f}" for f in found) + " |")
    found = [[likeliest(walk, noise, *r) for r in many] for noise, many in records.items()]
    print("| the walk, maximum likelihood | " + " | ".join(f"{np.mean(f):.2f}" for f in found) + " |")


RESTED = {
    "`Constant()`": dw.Constant(),
    "`GainFloor(50)`": dw.memory.GainFloor(50),
    "`ExponentialForgetting(.98)`": dw.ExponentialForgetting(0.98),
    "`VariableForgetting(50)`": dw.memory.VariableForgetting(50),
    "`DirectionalForgetting(.98)`": dw.memory.DirectionalForgetting(0.98),
    "`RandomWalk(2e-4)`": dw.RandomWalk(2e-4),
    "`RandomWalk(matched=(.1, 500))`": dw.RandomWalk(matched=(0.1, 500)),
    "`Window(50)`": dw.memory.Window(50),
    "`BayesianChangePoint(.2, 500)`": dw.memory.BayesianChangePoint(0.2, 500),
    "`RestartOnChange(ScoreCUSUM(), GainReset(10))`": dw.RestartOnChange(
        dw.detect.ScoreCUSUM(), dw.memory.GainReset(10)
    ),
}


def table_of_rests():
    """Errors in the 50 samples after a rest of 3000, NIS before, in and after it, ns a sample of ARX(2, 2)."""
    print("\n| memory | worst error | median | NIS before | in the rest | after | held | ns a sample |")
    print("|---|---|---|---|---|---|---|---|")
    y2, u2 = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=20_000, noise_std=0.1, noise="equation", seed=1)
    for name, memory in RESTED.items():
        est, worst, nis, held = dw.ARX(1, 1, memory=memory, P0=100.0), [], [], []
        for seed in range(50):
            trace = est.scan(*resting(seed))
            worst.append(np.max(np.abs(trace.parameters - [-0.8, 1.0])[4000:4050]))
            ratio = trace.innovation**2 / trace.variance
            nis.append([ratio[200:1000].mean(), ratio[1200:4000].mean(), ratio[4100:].mean()])
            held.append(np.mean(trace.status[1000:4000] & dw.Status.CAPPED > 0))
        timed, seconds = dw.ARX(2, 2, memory=memory), []
        for _ in range(5):
            start = time.process_time()
            timed.scan(y2, u2)
            seconds.append(time.process_time() - start)
        numbers = [f"{np.max(worst):.3f}", f"{np.median(worst):.3f}", *(f"{v:.2f}" for v in np.mean(nis, axis=0))]
        cost = f"{np.median(seconds) / len(y2) * 1e9:.0f}"
        print(f"| {name} | " + " | ".join([*numbers, f"{np.mean(held):.0%}", cost]) + " |", flush=True)


if __name__ == "__main__":
    table_of_rests()
    table_of_jumps()
    table_of_directions()
    table_of_noise()
