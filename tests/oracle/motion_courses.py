"""What a target may do from plot to plot, in plain NumPy from the textbook: interacting multiple models.

Blom and Bar-Shalom (1988); each coordinate by itself, in axes along the way and across it. Nothing is shared with the
package but its table of constants.
"""

import numpy as np

from driftwise.estimators.track import bank, courses

MOVES, COURSES = courses.MOVES, bank.COURSES
MANOEUVRES = COURSES - MOVES


def transitions():
    """Return how likely each course follows on each."""
    p = np.diag([1 - courses.BEGINS] * MOVES + [1 - courses.ENDS] * MANOEUVRES)
    p[:MOVES, MOVES:], p[MOVES:, 0] = courses.BEGINS / MANOEUVRES, courses.ENDS
    p[:2, :2] += [[-courses.LATE_BEGINS, courses.LATE_BEGINS], [courses.LATE_ENDS, -courses.LATE_ENDS]]
    return p


class Courses:
    """Begun at the second plot of a track, ``e`` (C,) after the first; ``take`` takes each that follows."""

    def __init__(self, gentlest, e, r, d):
        C = len(e)
        way = e / np.linalg.norm(e) if C == 2 else np.ones(1)
        self.axes = np.array([way, [-way[1], way[0]]] if C == 2 else [way])
        e, r = self.axes @ e, self.axes**2 @ r
        self.gentlest, self.strength = gentlest, gentlest * np.array([0.0] * MOVES + list(courses.STRENGTHS))
        self.mu = np.array([0.0, courses.LATE_BEGINS] + [courses.BEGINS] * MANOEUVRES)
        self.mu[0] = 1 - self.mu.sum()
        self.x, self.P = np.zeros((COURSES, C, 3)), np.zeros((COURSES, C, 3, 3))
        self.x[:, :, 1] = e / d
        self.P[:, :, :2, :2] = r[:, None, None] * np.array([[1, 1 / d], [1 / d, 2 / d**2]])
        self.P[:, :, 2, 2] = self.strength[:, None] ** 2

    def take(self, e, r, d, T, counts, shown):
        """Take a plot ``e`` after the last, of variance r, d seconds on; wild ones are among the ``counts``."""
        e, r = self.axes @ e, self.axes**2 @ r
        mu, x, P = self.ahead(r, d, T)
        wild = courses.WILD + counts[bank.WILD] / counts.sum()
        nu = np.clip(shown - courses.UNSURE, courses.LEAST_FREEDOM, courses.SURE)
        part = np.tile(np.log([1 - courses.WIDE - wild, courses.WIDE, wild]), (COURSES, 1))
        sizes = np.array([1.0, courses.WIDER2, courses.WILDER2])
        S = P[:, :, 0, 0, None] + r[None, :, None] * sizes
        z2, freedom = (e - x[:, :, 0])[:, :, None] ** 2 / S, np.array([nu, nu, courses.WILD_FREEDOM])
        part += (-0.5 * np.log(S) - 0.5 * (freedom + 1) * np.log1p(z2 / freedom)).sum(axis=1)
        log = np.log(mu) + np.logaddexp.reduce(part, axis=1)
        self.mu = np.maximum(np.exp(log - np.logaddexp.reduce(log)), courses.LEAST)
        part = np.exp(part - np.logaddexp.reduce(part, axis=1)[:, None])[:, None, :2]
        gain, gain2 = (part / S[:, :, :2]).sum(axis=2), (part / S[:, :, :2] ** 2).sum(axis=2)
        off, column = e - x[:, :, 0], P[:, :, :, 0]
        self.x = x + column * (off * gain)[:, :, None]
        self.x[:, :, 0] -= e
        spread = off**2 * np.maximum(gain2 - gain**2, 0) - gain
        self.P = P + spread[:, :, None, None] * column[:, :, :, None] * column[:, :, None, :]
        v = self.mu @ self.x[:, :, 1]
        if len(e) == 2 and v @ v > courses.POINTS * (self.mu @ self.P[:, :, 1, 1].sum(axis=1)):
            self.turn(*(v / np.linalg.norm(v)))

    def ahead(self, r, d, T):
        """Return share, state and covariance of each course d seconds on, mixed before."""
        p = transitions()
        mu = self.mu @ p
        F = np.array([[1, d, d * d / 2], [0, 1, d], [0, 0, np.exp(-d / (courses.LASTS * T))]])
        x, P = np.zeros_like(self.x), np.zeros_like(self.P)
        for j, c in np.ndindex(x.shape[:2]):
            of, V = self.x[:, c].copy(), self.P[:, c].copy()
            for i in set(range(COURSES)) - {j}:  # it begins with an acceleration of its own
                of[i, 2], V[i, 2], V[i, :, 2] = 0.0, 0.0, 0.0
                V[i, 2, 2] = self.strength[j] ** 2
            w = self.mu * p[:, j] / mu[j]
            apart = of - w @ of
            q = courses.NOISE * r[c] / T**3 + (courses.WOBBLES * self.gentlest) ** 2 * T
            Q = np.diag([0, 0, (1 - F[2, 2] ** 2) * self.strength[j] ** 2])
            Q[:2, :2] = q * np.array([[d**3 / 3, d**2 / 2], [d**2 / 2, d]])
            x[j, c] = F @ (w @ of)
            P[j, c] = F @ (np.einsum("i,iab->ab", w, V) + apart.T @ (w[:, None] * apart)) @ F.T + Q
        first = self.mu[0] * p[0, 1] / mu[1]
        age2 = (courses.OLD * T) ** 2 + min(courses.DELAY, courses.SCANS * T) ** 2
        P[1, 0, 0, 0] += np.sum(x[1, :, 1] ** 2) * (first * age2 + (1 - first) * (courses.CHANGES * T) ** 2)
        return mu, x, P

    def turn(self, cos, sin):
        """Let the axes follow the way; an acceleration across it stays across."""
        turn = np.array([[cos, sin], [-sin, cos]])
        self.axes = turn @ self.axes
        self.x[:, :, :2] = turn @ self.x[:, :, :2]
        self.P[:, :, :2, :2] = np.einsum("cd,jdab->jcab", turn**2, self.P[:, :, :2, :2])
