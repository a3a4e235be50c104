"""What nobody can beat who does not know when: the mixture over the moment of a jump, told everything else.

It knows Q, the noise of every sample, which parameters jump and how far (as a variance), and that a jump comes once in
`EVERY` samples; not when. Its odds are exact (Willsky and Jones 1976, with a Gaussian size instead of the likeliest),
its bars those of the mixture. Where it does not tell a jump, or its bars do not hold, no memory is to blame.
Systems with outliers or gaps are left out.

Run: python -m driftwise_studies.score.worlds.ceiling [systems] [records]
"""

from __future__ import annotations

import sys
from itertools import pairwise

import numpy as np

from .drawing import draw
from .field import SIZES, table
from .judged import CHOOSING
from .measured import AFTER, BAR, HEARD
from .simulation import records, regressors
from .system import System
from .told import WIDE, told, walk

EVERY, ODDS = 1000.0, 5.0
BEFORE = 30  # samples before the jump whose moments compete as well


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
    """Every moment at which the jump may have been, one more a sample: what each would have made of the estimate."""

    def __init__(self, variances):
        self.jumping = np.flatnonzero(variances)
        self.precision = np.diag(1 / variances[self.jumping])
        n, m = len(variances), len(self.jumping)
        self.A, self.M, self.v = np.zeros((0, n, m)), np.zeros((0, m, m)), np.zeros((0, m))  # error = A d; information
        self.start = np.eye(n)[:, self.jumping]

    def take(self, psi, e, S, K):
        """Take a sample; return the log odds of each moment against no jump, size and covariance of each jump."""
        self.A = np.concatenate([self.A, self.start[None]])
        self.M = np.concatenate([self.M, np.zeros((1, *self.precision.shape))])
        self.v = np.concatenate([self.v, np.zeros((1, len(self.jumping)))])
        s = np.einsum("n,knm->km", psi, self.A)
        self.M = self.M + s[:, :, None] * s[:, None] / S
        self.v = self.v + s * e / S
        self.A = self.A - K[:, None] * s[:, None]
        C = np.linalg.inv(self.precision + self.M)
        d = np.einsum("kij,kj->ki", C, self.v)
        logs = 0.5 * np.einsum("ki,ki->k", d, self.v) + 0.5 * np.linalg.slogdet(C @ self.precision)[1]
        return logs, d, C


def of_record(system: System, psi, y, sigma, theta, jumps, moved) -> list[tuple[bool, float]]:
    """Return of each jump whether the mixture tells it in time, and what share of parameters its bars hold after it."""
    q, found, start = walk(system, len(y)), [], 0
    mean, P = np.zeros(psi.shape[1]), np.diag(WIDE * np.maximum(np.array(system.deviations) ** 2, 1.0))
    for k, step in zip(jumps, moved):
        for part in (slice(start, k - BEFORE), slice(k - BEFORE, k + HEARD)):  # the second believes in no jump
            rows = (psi[part], y[part], sigma[part], q[part])
            if part.start == start:
                *_, mean, P = last(filtered(*rows, mean, P))
                P = P + np.diag(q[part.stop - 1])
            else:
                found.append(weighed(filtered(*rows, mean, P), theta[part], step**2))
        start, q = k - BEFORE, q.copy()
        q[k - 1] += step**2  # from here on it is told
    return found


def last(path):
    """Return the last of what is yielded."""
    for one in path:
        found = one
    return found


def weighed(path, theta, variances) -> tuple[bool, float]:
    """Return whether the mixture tells a jump of these ``variances`` after `BEFORE` samples, and how its bars hold."""
    moments, held, is_told = Moments(variances), [], False
    for k, (psi, e, S, K, mean, P) in enumerate(path):
        logs, d, C = moments.take(psi, e, S, K)
        logs = np.append(logs - np.log(EVERY), 0.0)  # of each moment, and of no jump
        weights = np.exp(logs - logs.max())
        is_told |= bool(k >= BEFORE and weights[:-1].sum() > ODDS * weights[-1])
        weights /= weights.sum()
        means = np.vstack([np.einsum("knm,km->kn", moments.A, d), np.zeros_like(mean)])
        spread = np.vstack([np.einsum("knm,kml,knl->kn", moments.A, C, moments.A), np.zeros_like(mean)])
        shift = weights @ means
        variance = np.diag(P) + weights @ (spread + means**2) - shift**2
        if BEFORE <= k < BEFORE + AFTER:
            held.append(np.abs(mean + shift - theta[k]) < BAR * np.sqrt(variance))
    return is_told, float(np.mean(held))


def main(systems: int = 300, count: int = 4) -> None:
    """Print, by the size of the jump, what could be told and what was, and how often the bars held."""
    rows: list[tuple[float, bool, bool, float]] = []
    for number in range(systems):
        system = draw(CHOOSING, number)
        if not system.jumps or system.outliers[0] or system.missing[0]:
            continue
        r = records(system, range(count))
        psi, can = regressors(system, r.y, r.u), told(system, r).tellable
        sizes = np.abs(r.moved / np.array(system.deviations)).max(axis=2)
        for s in range(count):
            found = of_record(system, psi[s], r.y[s], r.sigma[s], r.theta[s], r.jumps[s], r.moved[s])
            rows += [(size, c, *one) for size, c, one in zip(sizes[s], can[s], found)]
    sized = np.array(rows, float)
    cells = []
    for low, high in [*pairwise(SIZES), (SIZES[0], SIZES[-1])]:
        some = sized[(sized[:, 0] >= low) & (sized[:, 0] < high)]
        sure = some[some[:, 1] > 0]
        cells.append([
            f"{low:g} to {high:g}", f"{len(some)}", f"{len(sure)}", f"{sure[:, 2].mean():.2f}",
            f"{some[:, 3].mean():.2f}", f"{sure[:, 3].mean():.2f}",
        ])  # fmt: skip
    head = ("deviations", "jumps", "the oracle tells", "share told of these", "bars hold after", "after these")
    print(table(head, cells))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]))
