"""What a memory can attain that is told all but the dates, and one that is told the law alone.

The reference of a ratio knows what no causal filter can: the sample at which the noise becomes louder, and which
samples are outliers. Two mixtures say what that is worth, and what knowing speeds and sizes is worth besides:

* *All but the dates*: told Q, sigma, how far which parameters jump, how much louder the noise becomes, share and size
  of outliers; not when, nor in which direction. Nobody who has to find out more can be better.
* *The law*: told sigma and deviations at first, and the law that systems are drawn by. `WORLDS` of them are drawn for
  the plant; each goes on as long as it explains the outputs, its speeds of drift moved a little now and then.

Each hypothesis is a Kalman filter with the dates it believes in; one more begins at every sample for each thing that
may happen then, and as many are kept as say most, the others by lot so that no sum is biased (Fearnhead and Clifford
2003, "On-line inference for hidden Markov models via particle filters", J. R. Statist. Soc. B 65, 887-899). Systems
whose regressors have gaps or wrong numbers (ARX with outliers or missing outputs) have no such filter: left out.

Run: python -m driftwise_studies.score.worlds.attainable [--systems 300] [--records 3] [--every 1]
"""

from __future__ import annotations

import argparse
import sys
from typing import NamedTuple

import numpy as np

import driftwise as dw

from .drawing import draw, move, several, trouble
from .field import geometric, table
from .judged import CHOOSING
from .measured import measure
from .simulation import APART, FIRST, QUIET, Records, records, regressors
from .system import ALONE, System, changed
from .told import WIDE, error, told

KEPT, WORLDS = 150, 500  # hypotheses of who is told all but the dates; and of who is told the law
OFTEN, SPREAD = 100, 0.2  # samples after which speeds move, by so many decades
RATES = 1e-3, 3e-4  # of jumps and steps of the noise, a sample, to who is told the law
NEVER = -1e30
LATE = 10**9


class Worlds(NamedTuple):
    """What may be true of a system, a row for each."""

    q: np.ndarray  # (W, n)
    steps: np.ndarray  # (W, 4, n), how far its jumps go
    jump_at: np.ndarray  # (W, 5, 2), first date of each, and the one after the last
    levels: np.ndarray  # (W, 2), what the noise is multiplied with
    level_at: np.ndarray  # (W, 3, 2)
    outliers: np.ndarray  # (W, 2): share, size
    weight: np.ndarray  # (W,), one over the mean square error of who knows it, about
    own: np.ndarray  # (n,), deviations


def dates(count: int, most: int, samples: int) -> np.ndarray:
    """Return between which dates each of ``count`` things happens (`simulation.moments`)."""
    found = np.full((most + 1, 2), LATE)
    slot = (samples - FIRST) / max(count, 1)
    for i in range(count):
        found[i] = FIRST + slot * i, FIRST + slot * i + max(slot - APART, 1)
    return found


def worlds(systems: list[System], samples: int) -> Worlds:
    """Return these systems as what may be true."""
    n, rows = len(systems[0].theta), []
    for s in systems:
        own, steps = np.array(s.deviations), np.zeros((4, n))
        for j, (size, who) in enumerate(s.jumps):
            steps[j, list(who)] = size * own[list(who)]
        nvr = np.array(s.nvr or np.zeros(n))
        levels = np.ones(2)
        levels[: len(s.steps)] = s.steps
        about = np.mean(np.sqrt(nvr + (steps / own / 3).sum(axis=0) ** 2 / samples) + 0.002)
        rows.append((
            nvr * own**2, steps, dates(len(s.jumps), 4, samples), levels, dates(len(s.steps), 2, samples),
            np.array(s.outliers if s.outliers[0] else (0.0, 10.0)), 1 / about,
        ))  # fmt: skip
    return Worlds._make([*(np.array(each) for each in zip(*rows)), np.array(systems[0].deviations)])


def law(system: System, count: int, rng) -> list[System]:
    """Return so many systems with the plant of this one, their troubles drawn as all are."""
    found, plain = [], changed(system, nvr=(), jumps=(), steps=(), outliers=(0.0, 0.0))
    for _ in range(count):
        chosen = {str(rng.choice(ALONE))} if rng.random() < 1 / 3 else several(rng)
        found.append(move(rng, trouble(rng, plain, chosen), chosen))
    return found


def hazard(at, which, k: int):
    """Return the probability that the next thing happens at sample k, for each hypothesis."""
    begin, end = at[np.arange(len(which)), which].T
    inside = (k >= np.floor(begin)) & (k < end)
    return np.where(inside, 1.0 / np.maximum(np.floor(end) + 1 - k, 1.0), 0.0)


def chosen(logs, most: int, rng):
    """Return which of these log weights are kept, at most so many, and their new logarithms."""
    w = np.exp(logs - logs.max())
    w /= w.sum()
    alive = np.flatnonzero(w > 1e-14)
    if len(alive) <= most:
        return alive, np.log(w[alive])
    w = w[alive]
    order = np.sort(w)[::-1]
    rest = np.cumsum(order[::-1])[::-1]  # of those from the i-th on
    room = most - np.arange(len(order))
    i = int(np.argmax((room > 0) & (order * room <= rest)))  # as many are kept for certain
    c = rest[i] / room[i]
    sure = w > c
    some = np.flatnonzero(~sure)
    ticks = (np.arange(room[i]) + rng.random()) * c
    drawn = some[np.minimum(np.searchsorted(np.cumsum(w[some]), ticks), len(some) - 1)]
    return np.concatenate([alive[sure], alive[drawn]]), np.concatenate(
        [np.log(w[sure]), np.full(len(drawn), np.log(c))]
    )


def fresh(may: Worlds, count: int, rng):
    """Return how far a jump goes by the law, for so many hypotheses."""
    n, own = may.q.shape[1], may.own
    size = np.exp(rng.uniform(np.log(0.5), np.log(8), count))
    one = np.eye(n)[rng.integers(n, size=count)]
    return size[:, None] * own * np.where(rng.random((count, 1)) < 0.3, 1.0, one)


def other(level, rng):
    """Return what the noise is multiplied with after a step, by the law: back to what it was, or anew."""
    anew = np.exp(rng.uniform(np.log(1.5), np.log(10), len(level)) * rng.choice([-1.0, 1.0], len(level)))
    return np.where(level == 1.0, anew, 1.0)


def density(e, S):
    """Return the log density of errors."""
    return -0.5 * (e * e / S + np.log(S))


def follow(may: Worlds, psi, y, sigma, start, most: int, rng, is_weighted: bool, shy=1.0):
    """Return the mean of theta at every sample; ``sigma`` is that of the noise before it steps; ``start`` the prior.

    ``shy``: what hypotheses of a jump count in that mean, over their probability.
    """
    W, n = may.q.shape
    q, who = may.q.copy(), np.arange(W)
    theta, P = np.zeros((W, n)), np.tile(np.diag(start), (W, 1, 1))
    jumped, stepped, level, logs = np.zeros(W, int), np.zeros(W, int), np.ones(W), np.zeros(W)
    found = np.empty((len(y), n))
    for k in range(len(y)):
        if y[k] == y[k] and np.isfinite(psi[k]).all():
            gain = np.einsum("mij,j->mi", P, psi[k])
            S0, e = gain @ psi[k], y[k] - theta @ psi[k]
            if W == 1:
                H, L = hazard(may.jump_at[who], jumped, k), hazard(may.level_at[who], stepped, k)
                steps, then = may.steps[who, np.minimum(jumped, 3)], level * may.levels[who, np.minimum(stepped, 1)]
            else:
                H, L = (np.full(len(who), rate * (k >= FIRST)) for rate in RATES)
                steps, then = fresh(may, len(who), rng), other(level, rng)
            share, size = may.outliers[who].T
            R = (sigma[k] * level) ** 2
            R2 = (sigma[k] * then) ** 2
            shift = steps @ psi[k]
            with np.errstate(divide="ignore"):
                log_h, log_l, log_o, none = np.log(H / 2), np.log(L), np.log(share), np.log1p(-np.minimum(H + L, 1))
            stays = logs + none + np.log1p(-share)
            far, wide = size * np.sqrt(R), S0 + R + (0.17 * size) ** 2 * R
            wrong = np.logaddexp(density(e - far, wide), density(e + far, wide)) - np.log(2)
            every = np.concatenate([
                stays + density(e, S0 + R),
                logs + log_h + density(e - shift, S0 + R),
                logs + log_h + density(e + shift, S0 + R),
                logs + log_l + density(e, S0 + R2),
                logs + none + log_o + wrong,
            ])  # fmt: skip
            every[~np.isfinite(every)] = NEVER
            kept, logs = chosen(every, most, rng)
            kind, m = np.divmod(kept, len(who))
            who, theta, P, gain, S0, e = who[m], theta[m], P[m], gain[m], S0[m], e[m]
            sign = (kind == 1).astype(float) - (kind == 2)
            move_by = sign[:, None] * steps[m]
            theta, e = theta + move_by, e - move_by @ psi[k]
            level = np.where(kind == 3, then[m], level[m])
            jumped, stepped, q = jumped[m] + (sign != 0), stepped[m] + (kind == 3), q[m]
            K = gain / (S0 + (sigma[k] * level) ** 2)[:, None] * (kind != 4)[:, None]
            theta = theta + K * e[:, None]
            P = P - K[:, :, None] * gain[:, None]
        weights = np.exp(logs - logs.max()) * (may.weight[who] if is_weighted else 1.0)
        weights = weights * np.where(jumped > 0, shy, 1.0)
        found[k] = weights @ theta / weights.sum()
        if W > 1 and k and k % OFTEN == 0:
            p = np.exp(logs - logs.max())
            m = np.minimum(np.searchsorted(np.cumsum(p / p.sum()), (np.arange(most) + rng.random()) / most), len(p) - 1)
            who, theta, P, q = who[m], theta[m], P[m], q[m]
            jumped, stepped, level = jumped[m], stepped[m], level[m]
            logs, q = np.zeros(len(m)), q * 10 ** (SPREAD * rng.standard_normal(q.shape))
        P[:, np.arange(n), np.arange(n)] += q
    return found


def quiet(system: System, sigma) -> np.ndarray:
    """Return what the noise of each sample would be, had it no steps: quieter where it rests."""
    change = np.ones(len(sigma))
    if system.rest[1]:
        drop = np.flatnonzero(sigma[1:] < 4 * QUIET * sigma[:-1])
        change[drop[0] + 1 : drop[0] + 1 + system.rest[0] - 50] = QUIET
    return system.sigma * change


def attained(system: System, r: Records, rng) -> list[float]:
    """Return the mean square error of each mixture: all but the dates, the law, the law with worlds weighed."""
    psi, lags = regressors(system, r.y, r.u), 0 if system.na < 0 else max(system.na, *system.nb, 1)
    start, squares = WIDE * np.maximum(np.array(system.deviations) ** 2, 1.0), []
    T = r.y.shape[1]
    for s in range(len(r.y)):
        y, sigma = r.y[s].copy(), quiet(system, r.sigma[s])
        y[:lags] = np.nan
        drawn = worlds(law(system, WORLDS, rng), T)
        paths = (
            follow(worlds([system], T), psi[s], y, sigma, start, KEPT, rng, False),
            follow(drawn, psi[s], y, sigma, start, WORLDS, rng, False),
            follow(drawn, psi[s], y, sigma, start, WORLDS, rng, True),
        )
        squares.append([error(system, path, r.theta[s]) for path in paths])
    return np.mean(squares, axis=0).tolist()


def has_exact(system: System) -> bool:
    """Say whether its regressors are all known and right."""
    return system.na < 0 or not (system.outliers[0] or system.missing[0])


def ratios(system: System, count: int) -> list[float]:
    """Return errors over the reference: of each mixture, and of the default memory."""
    r = records(system, range(count))
    known = told(system, r)
    found = attained(system, r, np.random.default_rng([system.number, 29]))
    return [*(v**0.5 / known.reference for v in found), measure(system, r, known, dw.AutoMemory()).ratio]


def page(found: list[tuple[System, list[float]]]) -> str:
    """Return the table: mean, 95th percentile and worst of the ratios of each, by trouble."""
    groups = [("all", found)]
    groups += [(f"with {one}", [x for x in found if one in x[0].troubles]) for one in ALONE[1:]]
    groups += [
        ("nothing but rests and inputs", [x for x in found if x[0].rests and not x[0].steps and not x[0].outliers[0]])
    ]
    rows = []
    for words, some in groups:
        if some:
            each = np.array([values for _, values in some]).T
            cells = (f"{geometric(v):.2f} / {np.quantile(v, 0.95):.2f} / {v.max():.2f}" for v in each)
            rows.append([words, f"{len(some)}", *cells])
    return table(
        ("mean / 95th / worst", "systems", "all but the dates", "the law", "the law, by what is at stake", "default"),
        rows,
    )


def main(arguments=None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--systems", type=int, default=300)
    parser.add_argument("--records", type=int, default=3)
    parser.add_argument("--every", type=int, default=1, help="of those that have such a filter, each so many")
    asked = parser.parse_args(arguments)
    some = [one for one in (draw(CHOOSING, number) for number in range(asked.systems)) if has_exact(one)][
        :: asked.every
    ]
    found = []
    for system in some:
        found.append((system, ratios(system, asked.records)))
        print(" ".join(f"{v:.2f}" for v in found[-1][1]), system.about, file=sys.stderr, flush=True)
    print(page(found))


if __name__ == "__main__":
    main()
