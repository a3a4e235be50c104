"""How near the filter that knows can one be who is not told what happens? Two ceilings of `joint_memory.py`.

A mixture over what may have happened at any moment: the parameters jumped, the noise became louder, an output was
wrong. Every hypothesis goes on with the joint filter that it makes true, and counts by how well it predicts. All are
told Q and the noise at first.

"When" is told besides what happens in this plant, how far and how often, and which outputs are wrong. Where
`AutoMemory` is behind it no delay is to blame. "What and when" is told nothing else: jumps of four sizes, noise two,
four and eight times as loud and outliers, as frequent as they have been, are possible in every plant. Who has to be
right in all of them loses in each; who is told less can do better in one hardly without doing worse in another.

    python scripts/joint_ceiling.py [--seeds 20] [--first 1000] [--samples 1000] [--only jump]
"""

import argparse
from typing import NamedTuple

import numpy as np
from joint_memory import BEGIN, WORLDS, drawn, noise_of, told

import driftwise as dw
from driftwise.engine import ud

PARENTS, FAINT = 6, -30.0  # hypotheses of which something may happen now; log odds below which one is dropped
STRUCK, CHANCES = 0.2, 20.0  # outliers before data, of so many samples
WIDER = 400.0  # variance of an outlier over that of the noise
FAR = 8.0  # logs below the likeliest, beyond which no hypothesis has an output that is wrong


class Possible(NamedTuple):
    """What may happen at a sample: sizes of jumps (of a, of b), and factors of the noise, each kind at its rate."""

    jumps: tuple[tuple[float, float], ...]
    jump_rate: float
    louder: tuple[float, ...]
    loud_rate: float
    is_wrong: bool  # whether an output may be
    most: int  # hypotheses that are kept


def when(world, samples: int) -> Possible:
    """Return what happens in a plant."""
    jumps, louder = bool(world.jumps), world.louder != 1.0
    sizes = ((0.1, world.size),) if jumps else ()
    return Possible(sizes, len(world.jumps) / samples, (world.louder,) * louder, 1.0 / samples, False, 24)


def what_and_when(world, samples: int) -> Possible:
    """Return what may happen in any."""
    sizes = tuple((0.1 * k, 0.5 * k) for k in (0.5, 1.0, 2.0, 4.0))
    return Possible(sizes, 1.0 / samples, (2.0, 4.0, 8.0), 1.0 / samples, True, 120)


class Hypotheses(NamedTuple):
    """States of the filters, which noise each has, and log odds."""

    states: np.ndarray
    level: np.ndarray
    logs: np.ndarray

    def some(self, which, less=0.0):
        """Return some of them, their odds less by this."""
        return Hypotheses(self.states[which], self.level[which], self.logs[which] + less)


def joined(parts):
    """Return all of these hypotheses as one table."""
    return Hypotheses(*(np.concatenate(fields) for fields in zip(*parts)))


def jumped(est, states, variances):
    """Return the states with theta wider by these variances, x as it is."""
    states, n = states.copy(), est.model.n
    for row in states:
        P = est._covariance(row)
        P[n:, n:] += np.diag(variances)
        U, D = ud.factor(P)
        row["U"], row["D"] = U[ud.packed_indices(len(D))], D
    return states


def advanced(filters, now, y, u):
    """Return the states one sample on, each by its own filter, and the rows of the trace that they write."""
    states, rows = now.states.copy(), np.empty((len(now.states), filters[0].table_width("std")))
    for which, est in enumerate(filters):
        some = np.flatnonzero(now.level == which)
        if some.size:
            mine, outs = est._rows(states[some], is_one=False), np.empty((some.size, 1, rows.shape[1]))
            given = np.full((some.size, 1, 1), y), np.full((some.size, 1, 1), u)
            est.drive(mine, *given, outs, est.spec, est.scratch())
            states[some], rows[some] = mine.view(est.dtype).reshape(some.size), outs[:, 0]
    return states, rows


def branched(filters, now, possible, n):
    """Return the hypotheses, and those that something happens now."""
    best = np.argsort(-now.logs)[:PARENTS]
    parts = [now.some(slice(None), np.log1p(-possible.jump_rate) if possible.jumps else 0.0)]
    for sizes in possible.jumps:
        more = now.some(best, np.log(possible.jump_rate / len(possible.jumps)))
        parts.append(more._replace(states=jumped(filters[0], more.states, np.repeat(np.square(sizes), n))))
    now = joined(parts)
    quiet, parts = np.flatnonzero(now.level == 0), [now]
    for k in range(1, 1 + len(possible.louder)):
        more = now.some(quiet, np.log(possible.loud_rate / len(possible.louder)))
        parts.append(more._replace(level=np.full(len(quiet), k)))
    return joined(parts)


def weighed(filters, now, y, u, share, noise):
    """Return the hypotheses a sample on, their rows, and which of them take y for wrong: this share of outputs is."""
    states, rows = advanced(filters, now, y, u)
    if np.isnan(y):
        return now._replace(states=states), rows, np.zeros(len(rows), bool)
    right = now.logs - 0.5 * (np.log(rows[:, 2]) + rows[:, 1] ** 2 / rows[:, 2]) + np.log1p(-share)
    if share == 0.0:
        return Hypotheses(states, now.level, right), rows, np.zeros(len(rows), bool)
    wide = rows[:, 2] + WIDER * noise[now.level]
    wrong = now.logs - 0.5 * (np.log(wide) + rows[:, 1] ** 2 / wide) + np.log(share)
    some = np.flatnonzero(wrong > right.max() - FAR)
    doubted = now.some(some)
    missed, missed_rows = advanced(filters, doubted, np.nan, u)
    parts = Hypotheses(states, now.level, right), Hypotheses(missed, doubted.level, wrong[some])
    is_wrong = np.arange(len(rows) + len(some)) >= len(rows)
    return joined(parts), np.concatenate([rows, missed_rows]), is_wrong


def mixture(world, record, possible):
    """Return x and theta of every sample, (T, 3 n), as the mixture has them."""
    T, n = len(record.y), world.order
    y = record.y if possible.is_wrong else np.where(record.wrong, np.nan, record.y)
    memory = dw.memory.Drift(q=record.q) if world.nvr else dw.Constant()
    noise = (record.sigma[0] * np.array([1.0, *possible.louder])) ** 2
    filters = [dw.Joint(n, 1, noise=noise_of(world, variance), memory=memory) for variance in noise]
    now, mean, struck = Hypotheses(filters[0].start(1), np.zeros(1, int), np.zeros(1)), np.empty((T, 3 * n)), STRUCK
    for t in range(T):
        if t:
            now = branched(filters, now, possible, n)
        share = struck / (CHANCES + t) if possible.is_wrong else 0.0
        now, rows, is_wrong = weighed(filters, now, y[t], record.u[t], share, noise)
        now = now._replace(logs=now.logs - now.logs.max())
        kept = np.argsort(-now.logs)[: possible.most]
        kept = kept[now.logs[kept] > FAINT]
        now, odds = now.some(kept), np.exp(now.logs[kept])
        mean[t] = odds @ rows[kept, 4 : 4 + 3 * n] / odds.sum()
        struck += odds @ is_wrong[kept] / odds.sum()
    return mean


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=1000, help="first seed")
    parser.add_argument("--samples", type=int, default=1000)
    parser.add_argument("--only", default="", help="part of the name of a plant")
    given = parser.parse_args()
    print(f"{'all but':22s}    when: state  theta    what and when: state  theta")
    found = []
    for name, world in WORLDS.items():
        if given.only not in name:
            continue
        errors, best, n = [], [], world.order
        for seed in range(given.first, given.first + given.seeds):
            record = drawn(world, given.samples, seed)
            truth = np.hstack([record.x, record.theta])[BEGIN:]
            means = [mixture(world, record, told_of(world, given.samples)) for told_of in (when, what_and_when)]
            errors.append([((mean[BEGIN:] - truth) ** 2).mean(0) for mean in means])
            best.append(((np.hstack(told(world, record)[:2])[BEGIN:] - truth) ** 2).mean(0))
        ratio = np.mean(errors, axis=0) / np.mean(best, axis=0)
        found.append(np.sqrt([ratio[:, :n].mean(1), ratio[:, n:].mean(1)]))
        (x, less_x), (theta, less_theta) = found[-1]
        print(f"{name:22s} {x:14.2f} {theta:6.2f} {less_x:23.2f} {less_theta:6.2f}", flush=True)
    means, worst = np.exp(np.mean(np.log(found), axis=(0, 1))), np.max(found, axis=(0, 1))
    for text, line in (("geometric mean", means), ("worst", worst)):
        print(f"{text:22s} {line[0]:21.3f} {line[1]:30.3f}")


if __name__ == "__main__":
    main()
