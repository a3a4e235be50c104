"""What nobody can beat who does not know when: mixtures over the moment of a jump.

Both know Q, the noise of every sample, and that a jump comes once in `EVERY` samples; not when.

* *All but when*: told besides which parameters jump and how far (as a variance). It tells a jump at 5:1.
* *Statistics*: knows only the law that jumps are drawn by: one parameter or all, sizes spread evenly over logarithms.
  It tells at 100:1, as who may be wrong .02 times in a record of two thousand samples.

Their odds are exact (Willsky and Jones 1976, with Gaussian sizes instead of the likeliest), their bars those of the
mixture. Where they do not tell a jump, or their bars do not hold, no memory is to blame. Beside them the default
memory, which is told nothing. Systems with outliers or gaps are left out.

Run: python -m driftwise_studies.score.worlds.ceiling [systems] [records]
"""

from __future__ import annotations

import sys
from itertools import pairwise
from typing import NamedTuple

import numpy as np

import driftwise as dw
from driftwise import Status

from .drawing import draw
from .field import SIZES, table
from .judged import CHOOSING
from .measured import AFTER, BAR, HEARD
from .simulation import records, regressors
from .system import System
from .told import WIDE, estimator, told, walk

EVERY = 1000.0
BEFORE = 30  # samples before the jump whose moments compete as well
ALL = 0.3  # of the jumps are of all parameters (`drawing.jump`)
SCALES = 0.7, 1.4, 2.8, 5.6  # deviations of jumps, an octave each of .5 to 8


class Found(NamedTuple):
    """What became of a jump."""

    told: bool
    held: float  # share of the parameters that its bars hold in the `AFTER` samples after it
    square: float  # mean square error in deviations, of the `HEARD` samples after it


def filtered(psi, y, sigma, q, theta, P):
    """Yield psi, innovation, its variance, gain, estimate and covariance of the filter that believes in no jump."""
    for k in range(len(y)):
        Ph = P @ psi[k]
        S = psi[k] @ Ph + sigma[k] ** 2
        K, e = Ph / S, y[k] - psi[k] @ theta
        theta, P = theta + K * e, P - np.outer(K, Ph)
        yield psi[k], e, S, K, theta, P
        P = P + np.diag(q[k])


class Moments:
    """Every moment at which some parameters may have jumped, one more a sample, by each of some ``variances`` (V, n).

    ``log_prior`` is that of these parameters and each variance, given a jump.
    """

    def __init__(self, variances, log_prior: float):
        variances = np.atleast_2d(variances)
        n, jumping = variances.shape[1], np.flatnonzero(variances[0])
        m, self.log_prior = len(jumping), log_prior
        self.precision = np.array([np.diag(1 / v[jumping]) for v in variances])[:, None]
        self.A, self.M, self.v = np.zeros((0, n, m)), np.zeros((0, m, m)), np.zeros((0, m))  # error = A d; information
        self.start = np.eye(n)[:, jumping]

    def take(self, psi, e, S, K):
        """Take a sample: log odds of each variance and moment against no jump, and what it moves theta by; variances.

        The first (V k,), the others (V k, n).
        """
        self.A = np.concatenate([self.A, self.start[None]])
        self.M = np.concatenate([self.M, np.zeros((1, *self.M.shape[1:]))])
        self.v = np.concatenate([self.v, np.zeros((1, self.v.shape[1]))])
        s = np.einsum("n,knm->km", psi, self.A)
        self.M = self.M + s[:, :, None] * s[:, None] / S
        self.v = self.v + s * e / S
        self.A = self.A - K[:, None] * s[:, None]
        C = np.linalg.inv(self.precision + self.M)
        d = np.einsum("vkij,kj->vki", C, self.v)
        logs = 0.5 * np.einsum("vki,ki->vk", d, self.v) + 0.5 * np.linalg.slogdet(C @ self.precision)[1]
        moved = np.einsum("knm,vkm->vkn", self.A, d)
        spread = np.einsum("knm,vkml,knl->vkn", self.A, C, self.A)
        n = self.A.shape[1]
        return logs.ravel() + self.log_prior, moved.reshape(-1, n), spread.reshape(-1, n)


def all_but_when(step, own) -> list[Moments]:
    """Return the hypotheses of who is told which parameters jump, and how far."""
    return [Moments(step**2, 0.0)]


def statistics(step, own) -> list[Moments]:
    """Return the hypotheses of who knows the law of jumps: one parameter or all, of every scale."""
    n, scales = len(own), np.array(SCALES)[:, None]
    each = np.log((1 - ALL) / n / len(SCALES))
    lone = [Moments((scales * own * one) ** 2, each) for one in np.eye(n)] if n > 1 else []
    return [*lone, Moments((scales * own) ** 2, np.log((ALL if n > 1 else 1.0) / len(SCALES)))]


KNOWING = {"all but when": (all_but_when, 5.0), "statistics": (statistics, 100.0)}


def of_record(system: System, psi, y, sigma, theta, jumps, moved) -> list[list[Found]]:
    """Return of each jump what the filter that is told it finds, and every mixture of `KNOWING`."""
    q, own, found, start = walk(system, len(y)), np.array(system.deviations), [], 0
    mean, P = np.zeros(psi.shape[1]), np.diag(WIDE * np.maximum(own**2, 1.0))
    for k, step in zip(jumps, moved):
        for part in (slice(start, k - BEFORE), slice(k - BEFORE, k + HEARD)):  # the second believes in no jump
            rows = (psi[part], y[part], sigma[part], q[part])
            if part.start == start:
                *_, mean, P = last(filtered(*rows, mean, P))
                P = P + np.diag(q[part.stop - 1])
        jumping = q[part].copy()
        jumping[BEFORE - 1] += step**2
        told_of_it = weighed(filtered(*rows[:3], jumping, mean, P), theta[part], own, [], 0.0)
        some = (
            weighed(filtered(*rows, mean, P), theta[part], own, guess(step, own), odds)
            for guess, odds in KNOWING.values()
        )
        found.append([told_of_it, *some])
        start, q = k - BEFORE, q.copy()
        q[k - 1] += step**2  # from here on it is told
    return found


def last(path):
    """Return the last of what is yielded."""
    for one in path:
        found = one
    return found


def weighed(path, theta, own, guesses: list[Moments], odds: float) -> Found:
    """Return what a mixture over moments finds of a jump `BEFORE` samples after its first one."""
    held, squares, is_told = [], [], False
    for k, (psi, e, S, K, mean, P) in enumerate(path):
        parts = [one.take(psi, e, S, K) for one in guesses]
        none = np.zeros((1, len(mean)))
        logs, means, spread = (
            (np.concatenate([*every, end]) for every, end in zip(zip(*parts) or [()] * 3, (np.zeros(1), none, none)))
            if parts
            else (np.zeros(1), none, none)
        )
        logs = logs - np.log(EVERY) * (np.arange(len(logs)) < len(logs) - 1)  # of each moment, and of no jump
        weights = np.exp(logs - logs.max())
        is_told |= bool(k >= BEFORE and weights[:-1].sum() > odds * weights[-1])
        weights /= weights.sum()
        shift = weights @ means
        variance = np.diag(P) + weights @ (spread + means**2) - shift**2
        error = mean + shift - theta[k]
        if k >= BEFORE:
            squares.append(np.mean((error / own) ** 2))
        if BEFORE <= k < BEFORE + AFTER:
            held.append(np.abs(error) < BAR * np.sqrt(variance))
    return Found(is_told, float(np.mean(held)), float(np.mean(squares)))


def default(system: System, y, u, theta, jumps) -> list[Found]:
    """Return what the default memory finds of each jump."""
    trace, own = estimator(system, dw.AutoMemory()).scan(y, u if u.shape[1] else None), np.array(system.deviations)
    inside = np.abs(trace.parameters - theta) < BAR * trace.parameters_std
    squares, jump = np.mean(((trace.parameters - theta) / own) ** 2, axis=1), trace.status & int(Status.JUMP) != 0
    return [
        Found(bool(jump[k : k + HEARD].any()), inside[k : k + AFTER].mean(), squares[k : k + HEARD].mean())
        for k in jumps
    ]


def main(systems: int = 300, count: int = 4) -> None:
    """Print, by the size of the jump, what could be told and what was, how often the bars held, and the error."""
    sizes, can, rows = [], [], []
    for number in range(systems):
        system = draw(CHOOSING, number)
        if not system.jumps or system.outliers[0] or system.missing[0]:
            continue
        r = records(system, range(count))
        psi, tellable = regressors(system, r.y, r.u), told(system, r).tellable
        sizes += np.abs(r.moved / np.array(system.deviations)).max(axis=2).ravel().tolist()
        can += tellable.ravel().tolist()
        for s in range(count):
            ours = default(system, r.y[s], r.u[s], r.theta[s], r.jumps[s])
            found = of_record(system, psi[s], r.y[s], r.sigma[s], r.theta[s], r.jumps[s], r.moved[s])
            rows += [[*one, own] for one, own in zip(found, ours)]
    print(by_size(np.array(sizes), np.array(can), np.array(rows, float)))


def by_size(sizes, can, rows) -> str:
    """Return the table of ``rows``: jumps, what of `Found`, by the told filter, the mixtures, the default."""
    names = [*KNOWING, "default"]
    cells = []
    for low, high in [*pairwise(SIZES), (SIZES[0], SIZES[-1])]:
        here = (sizes >= low) & (sizes < high)
        sure, some = rows[here & can], rows[here]
        error = np.sqrt(some[:, 1:, 2].mean(axis=0) / some[:, 0, 2].mean())
        shares = (*sure[:, 1:, 0].mean(axis=0), *some[:, 1:, 1].mean(axis=0), *sure[:, 1:, 1].mean(axis=0), *error)
        cells.append([f"{low:g} to {high:g}", f"{len(some)}", f"{len(sure)}", *(f"{v:.2f}" for v in shares)])
    what = "told of these", "bars hold after", "after these", "error"
    head = ("deviations", "jumps", "the oracle tells", *(f"{words}: {name}" for words in what for name in names))
    return table(head, cells)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]))
