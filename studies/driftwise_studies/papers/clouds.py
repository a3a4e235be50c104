"""Tests 1 to 4 of section 3.2: what each assumes, and the cloud of estimates that many records give."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy import stats

import driftwise as dw

from .records import TRUE_D, ljung_box, scan_all

DRIFT = 1e-4  # variance per sample of the walk with which "does not settle" can be had
LATE = slice(500, None)


class Test(NamedTuple):
    """One of the paper's tests: the d it assumes, what it prints, and where theory says the estimate ends."""

    number: int
    d: list
    printed: list | None
    limit: list
    std: list  # sandwich formula, T = 1000
    claim: str


TESTS = [
    Test(
        1,
        list(TRUE_D),
        [0.18, -1.05, 1.83],
        [0.24, -1.18, 1.9],
        [0.0307, 0.0562, 0.0307],
        "d at its true value; the state components are all well estimated",
    ),
    Test(
        2,
        [0.5, 0.06, 0.5],
        None,
        [-0.387452, 0.476881, -0.007333],
        [0.0275, 0.0361, 0.0262],
        "d very far from the truth; x1, x2 poorly estimated, the position well; the estimate does not settle",
    ),
    Test(
        3,
        [-0.125, 0.75, -1.5],
        [0.33, -1.39, 2.02],
        [0.385759, -1.508141, 2.088839],
        [0.0285, 0.0526, 0.0284],
        "d closer to the truth; all components of the state well estimated",
    ),
    Test(
        4,
        [0.25, -1.0],
        None,
        [-0.623544, 1.545078],
        [0.0225, 0.0224],
        "an order too low; the position still good, the parameters do not stop fluctuating",
    ),
]


class Cloud:
    """What one test gives over all records: estimates with the paper's signs, innovations, errors of the state."""

    def __init__(self, test: Test, y, x, walk: float = 0.0):
        self.test, self.n, self.truth = test, len(test.d), x
        memory = dw.RandomWalk(walk) if walk else dw.Constant()
        est = dw.Joint(self.n, noise=dw.models.NoisePolynomial(test.d, 1.0), memory=memory, P0=100.0)
        self.e, self.variance, self.x, parameters = scan_all(est, y)
        self.path = -parameters[:, :, ::-1]  # the paper's sign and order: a_0 first
        self.final = self.path[:, -1]

    @cached_property
    def mean(self):
        return self.final.mean(axis=0)

    @cached_property
    def std(self):
        return self.final.std(axis=0, ddof=1)

    @cached_property
    def mse(self):
        return float(np.mean(self.e[:, LATE] ** 2))

    @cached_property
    def state_error(self):
        """Root mean square error of x(t | t) over the standard deviation of x, x_1 first."""
        x = self.truth[:, LATE, -self.n :]
        return np.sqrt(np.mean((self.x[:, LATE] - x) ** 2, axis=(0, 1))) / x.std(axis=(0, 1))

    @cached_property
    def rejected(self):
        """Share of the records whose innovations Ljung-Box (10 lags) calls coloured at 1 %."""
        return float(np.mean(ljung_box(self.e / np.sqrt(self.variance)) < 0.01))

    def distance(self, vector) -> float:
        """Return the squared Mahalanobis distance of a vector from the estimates."""
        gap = np.asarray(vector) - self.mean
        return float(gap @ np.linalg.solve(np.cov(self.final.T), gap))

    def wandering(self, since: int):
        """Return the median standard deviation of each entry of one estimate from a sample on."""
        return np.median(self.path[:, since:].std(axis=1), axis=0)

    def settled(self):
        """Return the median of the last sample at which an entry lies two standard deviations from its end."""
        away = np.abs(self.path - self.final[:, None]) > 2 * self.std
        away = away.any(axis=2)
        last = away.shape[1] - 1 - np.argmax(away[:, ::-1], axis=1)
        return float(np.median(np.where(away.any(axis=1), last, 0)))


def same_noise(one: Cloud, three: Cloud):
    """Return test 3's vector as predicted from test 1's, its std, p, log ratio against independent records, p of all.

    The paper's digits are rounded to .01, which adds a variance of .01^2 / 12 to both vectors.
    """
    first, second = np.array(one.test.printed), np.array(three.test.printed)
    joint = np.hstack([one.final, three.final])
    mean, C = joint.mean(axis=0), np.cov(joint.T) + np.eye(6) * 0.01**2 / 12
    gain = C[3:, :3] @ np.linalg.inv(C[:3, :3])
    center = mean[3:] + gain @ (first - mean[:3])
    spread = C[3:, 3:] - gain @ C[:3, 3:]
    gap, all_gap = second - center, np.concatenate([first, second]) - mean
    p = float(stats.chi2.sf(gap @ np.linalg.solve(spread, gap), 3))
    ratio = stats.multivariate_normal.logpdf(second, center, spread) - stats.multivariate_normal.logpdf(
        second, mean[3:], C[3:, 3:]
    )
    return (
        center,
        np.sqrt(np.diag(spread)),
        p,
        float(ratio),
        float(stats.chi2.sf(all_gap @ np.linalg.solve(C, all_gap), 6)),
    )
