"""Print the tables of docs/unknown-noise.md: memories that need no Q, ranked; outliers against jumps; cost.

The ranking is that of `driftwise reproduce policies`.

Run: python scripts/unknown_noise.py [records] (200 by default: three minutes).
"""

import sys
import time

import numpy as np
from driftwise_studies.papers.abid import automatic, ranking
from driftwise_studies.papers.abid.entrants import ENTRANTS, KNOWN, LEARNT
from driftwise_studies.papers.abid.systems import RANKED, SIGMA2, system
from make_figures import surprises

import driftwise as dw

SKIP = 50  # samples that do not count
DIRTY = {
    'AutoMemory("both")': dict(memory=dw.AutoMemory()),
    'AutoMemory("outliers")': dict(memory=dw.AutoMemory("outliers")),
    'AutoMemory("jumps")': dict(memory=dw.AutoMemory("jumps")),
    "IMM()": dict(memory=dw.memory.IMM()),
    "MultipleModel()": dict(memory=dw.memory.MultipleModel()),
    "MultipleModel(), gate=InnovationGate(5)": dict(memory=dw.memory.MultipleModel(), gate=dw.InnovationGate(5)),
    "LikelihoodDrift()": dict(memory=dw.memory.LikelihoodDrift()),
    "LikelihoodDrift(), gate=InnovationGate(5)": dict(memory=dw.memory.LikelihoodDrift(), gate=dw.InnovationGate(5)),
    "CovarianceMatching()": dict(memory=dw.memory.CovarianceMatching()),
    "FuzzyDrift()": dict(memory=dw.memory.FuzzyDrift()),
    "ExponentialForgetting(.98)": dict(memory=dw.ExponentialForgetting(0.98)),
}


def rmse(errors):
    return np.sqrt(np.mean(np.square(errors)))


def table_of_ranks(seeds):
    """Errors over those of the filter that knows Q and sigma^2."""
    lines = {(one.name, one.sigma2): ranking.line(seeds, one.name, one.sigma2) for one in ENTRANTS}
    blind = sorted((one for (_, how), one in lines.items() if how != KNOWN), key=lambda one: one.mean)
    cases = [name for name in RANKED if name not in ("f10", "f01")]  # to who is told nothing, both are c
    print(f"\n| nothing told | {' | '.join(cases)} | mean | worst | 95 % bars hold | mean, sigma^2 known | ns |")
    print("|---" * 12 + "|")
    for one in blind:
        known = lines.get((one.entrant.name, KNOWN))
        inside = [one.outcome[name].inside for name in RANKED]
        name = one.entrant.name + ("" if one.entrant.sigma2 == LEARNT else ", sigma^2 told to start from")
        cells = [name, *(f"{one.ratio[case]:.2f}" for case in cases), f"{one.mean:.3f}", f"{one.worst:.2f}"]
        cells += [f"{min(inside):.2f} .. {max(inside):.2f}", f"{known.mean:.2f}" if known else "", f"{one.ns:.0f}"]
        print(f"| {' | '.join(cells)} |")
    for (name, how), one in lines.items():
        if how == KNOWN and (name, LEARNT) not in lines:
            print(f"sigma^2 known only: {name} mean {one.mean:.2f}, worst {one.worst:.2f}, {one.ns:.0f} ns")
    for expect in ("AutoMemory", "AutoMemory, expect jumps", "AutoMemory, expect outliers"):
        d, e = (
            automatic.detection(lines[expect, LEARNT].outcome[c].status, j) for c, j in (("d", (200, 400)), ("e", ()))
        )
        print(
            f"{expect}: {d[0]:.3f} of the jumps of d within 20, delay {d[1]:.1f}, false {d[2]:.3f} (d), {e[2]:.3f} (e)"
        )


def table_of_outliers(seeds):
    """Errors on c, d, e, clean and with 3 % of outliers of 20 deviations; then with these among the regressors too."""
    print("\n| memory | c | c dirty | d | d dirty | e | e dirty | e dirty, ARX | jumps told there |")
    print("|---" * 9 + "|")
    systems = [system(name, seeds, dirty=dirty) for name in "cde" for dirty in (False, True)]
    for name, options in DIRTY.items():
        est, row = dw.Regression(4, **options), []
        for s in systems:
            paths = [est.scan(y, psi, keep="means").parameters for y, psi in zip(s.y, s.psi)]
            row.append(f"{rmse((np.array(paths) - s.theta)[:, SKIP:]):.3f}")
        s, est = systems[-1], dw.ARX(2, 2, at_rest=True, **options)
        traces = [est.scan(y, u, keep="means") for y, u in zip(s.y, s.u)]
        row.append(f"{rmse((np.array([t.parameters for t in traces]) - s.theta)[:, SKIP:]):.3f}")
        row.append(f"{np.mean([len(t.jumps()) for t in traces]):.2f}")
        print(f"| `{name}` | {' | '.join(row)} |", flush=True)


def table_of_surprises(records=40):
    """The record of docs/figures/auto.png, with 40 seeds: who tells of what, and follows how well."""
    print(
        "\n| memory | jump told within 20 | others | louder noise within 100 | others | error of b1 | 95 % bars hold |"
    )
    print("|---" * 7 + "|")
    made = [surprises(seed) for seed in range(records)]
    for name in (
        'AutoMemory("both")',
        "IMM()",
        "MultipleModel()",
        "LikelihoodDrift()",
        "LikelihoodDrift(), gate=InnovationGate(5)",
        "ExponentialForgetting(.98)",
    ):
        est, told = dw.ARX(1, 1, **DIRTY[name]), []
        for y, u, b1 in made:
            trace = est.scan(y, u)
            jumps, noise = (np.flatnonzero(trace.status & int(bit)) for bit in (dw.Status.JUMP, dw.Status.NOISE))
            jump, louder = (jumps >= 1500) & (jumps < 1520), (noise >= 2400) & (noise < 2500)
            error = (trace.parameters[:, 1] - b1)[SKIP:]
            holds = np.abs(error) < 1.96 * trace.parameters_std[SKIP:, 1]
            told.append([jump.any(), np.sum(~jump), louder.any(), np.sum(~louder), np.mean(error**2), holds.mean()])
        jump, false, louder, other, square, holds = np.mean(told, axis=0)
        cells = f"{jump:.2f} | {false:.2f} | {louder:.2f} | {other:.2f} | {square**0.5:.3f} | {holds:.2f}"
        print(f"| `{name}` | {cells} |", flush=True)


def augmented():
    """How far an extended Kalman filter with log q in its state moves log q: its Jacobian has no entry to do so."""
    s = system("c", 1)
    n = s.psi.shape[2]
    x, P = np.r_[np.zeros(n), np.full(n, np.log(1e-3))], np.diag([1e3] * n + [4.0] * n)
    for psi, y in zip(s.psi[0], s.y[0]):
        h = np.r_[psi, np.zeros(n)]
        K = P @ h / (h @ P @ h + SIGMA2)
        x, P = x + K * (y - h @ x), P - np.outer(K, h @ P)
        P[:n, :n] += np.diag(np.exp(x[n:]))
    moved, cross = np.max(abs(x[n:] - np.log(1e-3))), np.max(abs(P[:n, n:]))
    print(f"\naugmented filter, 600 samples of c: log q moved by {moved}, covariance of theta and log q {cross}")


def table_of_costs(samples=100_000, sizes=(1, 2, 4, 8)):
    """Processor time a sample of a long record, ns."""
    print(f"\n| memory | {' | '.join(f'N = {N}' for N in sizes)} |\n|---" + "|---" * len(sizes) + "|")
    rng = np.random.default_rng(1)
    memories = {
        "Constant()": dw.Constant(),
        "LikelihoodDrift()": dw.memory.LikelihoodDrift(),
        "MultipleModel()": dw.memory.MultipleModel(),
    }
    for name, memory in {**memories, "IMM()": dw.memory.IMM(), "AutoMemory()": dw.AutoMemory()}.items():
        row = []
        for N in sizes:
            psi, est, spent = rng.standard_normal((samples, N)), dw.Regression(N, memory=memory), []
            y = psi.sum(axis=1) + rng.standard_normal(samples)
            for _ in range(5):
                began = time.process_time()
                est.scan(y, psi, keep="innovations")
                spent.append(time.process_time() - began)
            row.append(f"{1e9 * min(spent) / samples:.0f}")
        print(f"| `{name}` | {' | '.join(row)} |", flush=True)


def told_jumps(size, seeds):
    """Share of jumps of b1 by ``size`` noise deviations that are told within 50 samples: ARX(2, 2), white input."""
    told = 0
    for seed in range(seeds):
        rng = np.random.default_rng([77, seed])
        b1 = np.where(np.arange(1000)[:, None] < 500, [1.0, 0.5], [1.0 + 0.1 * size, 0.5])
        u = rng.standard_normal(1000)
        y, u = dw.simulate([-1.2, 0.5], b1, u=u, samples=1000, noise_std=0.1, seed=seed)
        told += any(500 <= jump.sample < 550 for jump in dw.ARX(2, 2, memory=dw.AutoMemory()).scan(y, u).jumps())
    return told / seeds


def walker(n, seeds):
    """Share of samples at which the bars hold the one of n coefficients that walks."""
    held = []
    for seed in range(seeds):
        rng = np.random.default_rng([78, seed])
        phi, walk = rng.standard_normal((3000, n)), 1 + np.cumsum(0.01 * rng.standard_normal(3000))
        y = phi[:, 0] * walk + phi[:, 1:].sum(axis=1) + 0.3 * rng.standard_normal(3000)
        trace = dw.Regression(n, memory=dw.AutoMemory()).scan(y, phi)
        held.append(np.abs(trace.parameters[300:, 0] - walk[300:]) < 1.96 * trace.parameters_std[300:, 0])
    return np.mean(held)


def limits():
    """Print what `AutoMemory` is bad at: small jumps, and one walk among constants."""
    print("\nauto tells a jump of b1 within 50 samples, by its size over the noise (40 records):", end=" ")
    print(", ".join(f"{size}: {told_jumps(size, 40):.2f}" for size in (2, 3, 4, 5, 7)))
    print("its 95 % bars hold the one of n coefficients that walks (20 records):", end=" ")
    print(", ".join(f"n = {n}: {walker(n, 20):.2f}" for n in (1, 2, 4, 6)), flush=True)


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    augmented()
    limits()
    table_of_costs()
    table_of_surprises()
    table_of_outliers(max(count // 2, 2))
    table_of_ranks(count)
