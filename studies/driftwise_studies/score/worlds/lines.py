"""Which lines of the judgement can be met? The default memory beside filters that know the generator.

All three are judged alike, on all jumps of drawn systems, with outliers and gaps: what is told within 50 samples of the
jumps that the oracle of `told` tells, and what bars hold in the 15 samples after any. The filters below know more than
any memory can: every level of the noise, which samples are wrong, and what those and the missing ones really were
where they stand among the regressors; and the jumps before the one in question.

* *All but when*: told besides Q, which parameters jump, and how far (as a variance). It tells a jump at 5:1.
* *The law of jumps*: told Q. Of a jump it knows that it comes once in 1000 samples, in one parameter or in all, and how
  sizes are spread. It tells at 100:1, or at 50:1: who is wrong .02 times in 2000 samples, as allowed, can do no more.
* *The laws*: of Q only that it is one of six, or the true one, each as probable as the generator draws it; and the
  noise may become another one, once in 3000 samples, which it did not. That is what a memory has to weigh a jump
  against; it still knows sigma, and what is wrong.

Their odds are exact sums over moments (`ceiling.Moments`), bars those of the mixture. Left out are loops whose input
felt a wrong or a missing number, which no record shows without it.

Run: python -m driftwise_studies.score.worlds.lines [--seed 0] [--systems 300] [--records 1] [--every 1] [--bars .95]
"""

from __future__ import annotations

import argparse
import sys
from itertools import pairwise

import numpy as np
from scipy.stats import norm

from .ceiling import BEFORE, EVERY, all_but_when, default, filtered, statistics
from .drawing import draw
from .field import SIZES, table
from .judged import CHOOSING
from .measured import AFTER, BAR, HEARD
from .simulation import Records, records, regressors
from .system import System, changed
from .told import WIDE, told, walk, without_outliers

WHO = ("all but when", "the law of jumps", "the laws")
ODDS = (5.0, 100.0, 50.0)  # at which the first tells; the others; and the others if they may be wrong .02 times
SPEEDS = 1e-6, 1e-5, 1e-4, 1e-3, 1e-2  # NVR, of all parameters
WALKS = 0.4  # of the systems do
KNOWLEDGE = (all_but_when, True, False), (statistics, True, False), (statistics, False, True)
FAINT = 12.0  # logs below the likeliest Q, from which on one is left out
STEPS = 3000.0  # samples between two steps of the noise, about
LOUDER = np.geomspace(1.5, 10, 4)  # what another level of the noise is times this one, or the inverse


def clean(system: System, r: Records, seeds) -> np.ndarray | None:
    """Return the outputs (S, T) as they were, nothing missing or wrong; None if those of the record felt it."""
    wrong = bool(system.outliers[0]) and not system.of_process
    if not (wrong or system.missing[0]):
        return r.y
    if system.input[0] == "closed loop":
        return None
    same = changed(system, missing=(0.0, 1), outliers=(0.0, system.outliers[1]) if wrong else system.outliers)
    y = records(same, seeds).y
    seen = np.isfinite(r.y) & ~(r.outliers & wrong)
    return y if np.array_equal(y[seen], r.y[seen]) else None


class Path:
    """The filter that believes in no jump, from a state on, over rows that may be missing."""

    def __init__(self, mean, P):
        self.mean, self.P, self.logs = mean, P, 0.0

    def over(self, psi, y, sigma, q):
        """Yield psi, innovation, its variance, gain, estimate and covariance; nothing but the last two of a gap."""
        for k in range(len(y)):
            if np.isfinite(y[k]):
                for one in filtered(psi[k : k + 1], y[k : k + 1], sigma[k : k + 1], q[k : k + 1], self.mean, self.P):
                    self.mean, P = one[4], one[5]
                    self.logs -= 0.5 * (np.log(one[2]) + one[1] ** 2 / one[2])
                    yield *one[:4], self.mean, P
                self.P = P + np.diag(q[k])
            else:
                yield None, 0.0, 1.0, None, self.mean, self.P
                self.P = self.P + np.diag(q[k])


class Levels:
    """Log odds that the noise has become another one at some sample, while it has not."""

    def __init__(self):
        self.square, self.count = np.zeros(0), np.zeros(0)

    def take(self, e, S) -> float:
        """Take a sample; return the log odds against the same level."""
        self.square, self.count = np.append(self.square, 0.0) + e * e / S, np.append(self.count, 0.0) + 1
        ratio = np.concatenate([LOUDER, 1 / LOUDER])[:, None]
        logs = -self.count * np.log(ratio) - 0.5 * self.square * (ratio**-2 - 1)
        return float(np.logaddexp.reduce(logs, axis=None) - np.log(len(ratio) * STEPS))


def mixed(paths, weights, guesses, rows, qs, theta, levels: bool, bar: float = BAR):
    """Return log odds of a jump against none at every sample, and which parameters the bars of the mixture hold.

    ``paths`` believe in no jump, each with its own q; ``guesses`` are `Moments` of each; ``bar`` is in deviations.
    """
    n, odds, held = theta.shape[1], [], []
    runs = [path.over(*rows, q) for path, q in zip(paths, qs)]
    others, before = [Levels() for _ in paths], [path.logs for path in paths]
    kept: list = [(np.zeros(0), np.zeros((0, n)), np.zeros((0, n)), -np.inf) for _ in paths]
    for k in range(len(theta)):
        logs, means, variances, none = [], [], [], []
        for m, run in enumerate(runs):
            psi, e, S, K, mean, P = next(run)
            if psi is not None:
                parts = [one.take(psi, e, S, K) for one in guesses[m]]
                found = [np.concatenate(each) for each in zip(*parts)]
                kept[m] = (found[0] - np.log(EVERY), found[1], found[2], others[m].take(e, S) if levels else -np.inf)
            base = weights[m] + paths[m].logs - before[m]
            logs += [kept[m][0] + base, np.array([base])]
            none.append(base + np.logaddexp(0.0, kept[m][3]))
            means += [mean + kept[m][1], mean[None]]
            variances += [np.diag(P) + kept[m][2], np.diag(P)[None]]
        jump = np.concatenate(logs[::2])
        odds.append(np.logaddexp.reduce(jump) - np.logaddexp.reduce(none) if len(jump) else -np.inf)
        w, every, spread = np.concatenate(logs), np.concatenate(means), np.concatenate(variances)
        w = np.exp(w - w.max())
        w /= w.sum()
        mean = w @ every
        held.append(np.abs(mean - theta[k]) < bar * np.sqrt(w @ (spread + (every - mean) ** 2)))
    return np.array(odds), np.array(held)


def of_record(system: System, psi, y, sigma, theta, jumps, moved, bar: float = BAR):
    """Return of each jump which of `ODDS` each of `WHO` passes, (J, 3, 3), and what share its bars hold, (J, 3)."""
    own, T = np.array(system.deviations), len(y)
    true, start = walk(system, T), np.diag(WIDE * np.maximum(np.array(system.deviations) ** 2, 1.0))
    banks = [true, np.zeros_like(true), *(np.full_like(true, v) * own**2 for v in SPEEDS)]
    prior = np.log([WALKS / 6, 1 - WALKS, *[WALKS / 6] * 5])
    if not system.nvr:  # the true one is none
        banks, prior = banks[1:], np.log([1 - WALKS, *[WALKS / 5] * 5])
    paths, every, begun = [Path(np.zeros(len(own)), start) for _ in banks], np.arange(len(banks)), 0
    told_, held_ = [], []
    for k, step in zip(jumps, moved):
        end = min(k + HEARD, T)
        for path, q in zip(paths, banks):
            for _ in path.over(psi[begun : k - BEFORE], y[begun : k - BEFORE], sigma[begun : k - BEFORE], q[begun:]):
                pass
        part = slice(k - BEFORE, end)
        rows, near = (psi[part], y[part], sigma[part]), slice(BEFORE, BEFORE + AFTER)
        posterior = prior + np.array([path.logs for path in paths])
        passed, held = [], []
        for guess, knows_q, levels in KNOWLEDGE:
            some = every[:1] if knows_q else every[posterior > posterior.max() - FAINT]
            w = posterior[some] - posterior[some].max()
            copies = [copied(paths[m]) for m in some]
            odds, inside = mixed(
                copies,
                w,
                [guess(step, own) for _ in some],
                rows,
                [banks[m][part] for m in some],
                theta[part],
                levels,
                bar,
            )
            passed.append([odds[BEFORE:].max() > np.log(v) for v in ODDS])
            held.append(inside[near].mean())
        told_.append(passed)
        held_.append(held)
        begun = k - BEFORE
        banks = [q.copy() for q in banks]
        for q in banks:
            q[k - 1] += step**2  # from here on it is told
    return np.array(told_), np.array(held_)


def copied(path: Path) -> Path:
    """Return a path that goes on by itself."""
    other = Path(path.mean, path.P)
    other.logs = path.logs
    return other


def groups(system: System) -> list[str]:
    """Return the groups of a system."""
    kind = "regressions" if system.na < 0 else "ARX" if system.nb else "no input"
    found = ["all", kind]
    found += ["outliers"] if system.outliers[0] else []
    found += ["gaps"] if system.missing[0] else []
    found += ["neither"] if not (system.outliers[0] or system.missing[0]) else []
    return found + (["walks"] if system.nvr else [])


def page(rows) -> str:
    """Return the table; a row of ``rows`` is groups, size, whether the oracle tells, ours, and what others found."""
    names = ["all", "regressions", "no input", "ARX", "neither", "outliers", "gaps", "walks"]
    parts = [(name, [row for row in rows if name in row[0]]) for name in names]
    parts += [(f"{a:g} to {b:g}", [row for row in rows if a <= row[1] < b]) for a, b in pairwise(SIZES)]
    cells = []
    for name, some in parts:
        sure = [row for row in some if row[2]]
        if not sure:
            continue
        told_ = np.array([row[5] for row in sure]).mean(axis=0)
        shares = [np.mean([row[3] for row in sure]), told_[0, 0], told_[1, 1], told_[1, 2], told_[2, 1], told_[2, 2]]
        held = [np.mean([row[4] for row in some]), *np.array([row[6] for row in some]).mean(axis=0)]
        cells.append([name, f"{len(some)}", f"{len(sure)}", *(f"{v:.3f}" for v in (*shares, *held))])
    head = ("jumps", "number", "the oracle tells", "told: default", "all but when", "the law of jumps, 100:1", "50:1",
            "the laws, 100:1", "50:1", "bars hold after: default", *WHO)  # fmt: skip
    return table(head, cells)


def main(arguments=None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=CHOOSING)
    parser.add_argument("--systems", type=int, default=300)
    parser.add_argument("--records", type=int, default=1)
    parser.add_argument("--every", type=int, default=1, help="of those whose parameters jump, each so many")
    parser.add_argument("--bars", type=float, default=0.95, help="share of normal errors that theirs hold")
    asked = parser.parse_args(arguments)
    bar = float(norm.ppf((1 + asked.bars) / 2))
    jumping = [one for one in (draw(asked.seed, number) for number in range(asked.systems)) if one.jumps]
    rows, used, left = [], 0, 0
    for system in jumping[:: asked.every]:
        seeds = range(asked.records)
        r = records(system, seeds)
        true = clean(system, r, seeds)
        if true is None:
            left += 1
            continue
        used += 1
        (y, sigma), psi = without_outliers(system, r), regressors(system, true, r.u)
        can, size = told(system, r).tellable, np.abs(r.moved / np.array(system.deviations)).max(axis=2)
        for s in range(len(y)):
            ours = default(system, r.y[s], r.u[s], r.theta[s], r.jumps[s])
            found = of_record(system, psi[s], y[s], sigma[s], r.theta[s], r.jumps[s], r.moved[s], bar)
            for j, one in enumerate(ours):
                rows.append((groups(system), size[s, j], can[s, j], one.told, one.held, found[0][j], found[1][j]))
        print(used, left, len(rows), system.about, file=sys.stderr, flush=True)
    print(f"Seed {asked.seed}: {used} systems whose parameters jump, {left} left out, {asked.records} records of each.")
    print()
    print(page(rows))


if __name__ == "__main__":
    main()
