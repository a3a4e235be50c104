"""How near the filter that knows can one be who is told all but the moment? The ceiling of `joint_memory.py`.

A mixture over the moments at which the parameters may have jumped, or the noise become louder: every one goes on with
the joint filter that it makes true, and counts by how well it predicts. It is told Q, both levels of the noise, the
outliers, how far the parameters jump as a variance, and how often. Where `AutoMemory` is behind it no delay is to
blame; the rest is what knowing Q, sigma and sizes is worth.

    python scripts/joint_ceiling.py [--seeds 40] [--samples 1000] [--only jump]
"""

import argparse

import numpy as np
from joint_memory import BEGIN, WORLDS, drawn, noise_of, told

import driftwise as dw
from driftwise.engine import ud

MOST, PARENTS, FAINT = 24, 6, -30.0  # hypotheses, those that may jump now, log odds below which one is dropped


def jumped(est, states, variances):
    """Return the states with theta wider by these variances, x as it is."""
    states, n = states.copy(), est.model.n
    for row in states:
        P = est._covariance(row)
        P[n:, n:] += np.diag(variances)
        U, D = ud.factor(P)
        row["U"], row["D"] = U[ud.packed_indices(len(D))], D
    return states


def advanced(est, states, y, u):
    """Return the states one sample on, and the rows of the trace that they write."""
    rows, outs = est._rows(states, is_one=False), np.empty((len(states), 1, est.table_width("std")))
    est.drive(rows, np.full((len(rows), 1, 1), y), np.full((len(rows), 1, 1), u), outs, est.spec, est.scratch())
    return rows.view(est.dtype).reshape(len(rows)), outs[:, 0]


def mixture(world, record):
    """Return x and theta of every sample, (T, 3 n), as the mixture has them."""
    T, n = len(record.y), world.order
    y = np.where(record.wrong, np.nan, record.y)
    memory = dw.memory.Drift(q=record.q) if world.nvr else dw.Constant()
    levels = sorted({record.sigma[0], record.sigma[-1]})
    filters = [dw.Joint(n, 1, noise=noise_of(world, level**2), memory=memory) for level in levels]
    states, level, logs = filters[0].start(1), np.zeros(1, int), np.zeros(1)
    variances, mean = np.repeat([0.1**2, world.size**2], n), np.empty((T, 3 * n))
    for t in range(T):
        if t and world.jumps:
            rate, best = len(world.jumps) / T, np.argsort(-logs)[:PARENTS]
            states = np.concatenate([states, jumped(filters[0], states[best], variances)])
            logs = np.concatenate([logs + np.log1p(-rate), logs[best] + np.log(rate)])
            level = np.concatenate([level, level[best]])
        if len(levels) > 1:
            quiet = level == 0
            states = np.concatenate([states, states[quiet]])
            logs = np.concatenate([logs, logs[quiet] - np.log(T)])
            level = np.concatenate([level, np.ones(quiet.sum(), int)])
        rows = np.empty((len(states), filters[0].table_width("std")))
        for which, est in enumerate(filters):
            some = np.flatnonzero(level == which)
            if some.size:
                states[some], rows[some] = advanced(est, states[some], y[t], record.u[t])
        if y[t] == y[t]:
            logs = logs - 0.5 * (np.log(rows[:, 2]) + rows[:, 1] ** 2 / rows[:, 2])
        logs = logs - logs.max()
        kept = [i for i in np.argsort(-logs)[:MOST] if logs[i] > FAINT]
        states, level, logs = states[kept], level[kept], logs[kept]
        odds = np.exp(logs)
        mean[t] = odds @ rows[kept, 4 : 4 + 3 * n] / odds.sum()
    return mean


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seeds", type=int, default=40)
    parser.add_argument("--samples", type=int, default=1000)
    parser.add_argument("--only", default="", help="part of the name of a plant")
    given = parser.parse_args()
    print(f"{'':22s}  error: state  theta")
    for name, world in WORLDS.items():
        if given.only not in name or (not world.jumps and world.louder == 1.0):
            continue  # of the others nothing happens at a moment that could be told
        found, best, n = [], [], world.order
        for seed in range(given.seeds):
            record = drawn(world, given.samples, seed)
            truth = np.hstack([record.x, record.theta])[BEGIN:]
            found.append(((mixture(world, record)[BEGIN:] - truth) ** 2).mean(0))
            best.append(((np.hstack(told(world, record)[:2])[BEGIN:] - truth) ** 2).mean(0))
        ratio = np.mean(found, axis=0) / np.mean(best, axis=0)
        print(f"{name:22s} {np.sqrt(ratio[:n].mean()):13.2f} {np.sqrt(ratio[n:].mean()):6.2f}", flush=True)


if __name__ == "__main__":
    main()
