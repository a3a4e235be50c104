"""The oracle of suspicion, and of what most rows say of sigma^2: of one series each."""

import numpy as np

from oracle.banks import Bank, outer, update
from oracle.second_start import Second


class Suspicion:
    """Of one series: do the last sixteen innovations lean on a parameter, or are their squares too large or small?"""

    def __init__(self, n):
        self.score, self.known, self.energy = np.zeros(n), np.zeros(n), 0.0

    def see(self, row, z, variance):
        x, z = row / np.sqrt(variance), np.clip(z, -3, 3)
        self.score, self.known = 15 / 16 * self.score + x * z, 15 / 16 * self.known + x**2
        self.energy = 15 / 16 * self.energy + z**2 - 1
        return np.any(self.score**2 > 4 * self.known) or self.energy > 10 or self.energy < -7.5

    def calm(self):
        self.score, self.energy = np.zeros_like(self.score), 0.0


class Most:
    """Of one series: the sigma^2 that most of the last rows say, by the mean logarithm of their squares."""

    def __init__(self):
        self.logs, self.rows = 0.0, 0.0

    def hear(self, square, s2):
        self.logs = 15 / 16 * self.logs + np.log(max(square, 1e-4 * s2))
        self.rows = 15 / 16 * self.rows + 1

    @property
    def says(self):
        return np.exp(self.logs / self.rows + np.euler_gamma + np.log(2)) if self.rows > 8 else np.inf


class Quiet(Second):
    """Of one series: the likeliest filter of its bank with less noise, and what it is better by than all others."""

    def __init__(self, bank, s2):
        leader = int(np.argmax(bank.w[0]))
        one = Bank(*(getattr(bank, f)[:, [leader]] for f in ("theta", "P", "w", "nu", "chi2"))).at([0])
        one.P = one.P * one.s2[0, 0] / s2
        one.w, one.nu, one.chi2 = np.ones((1, 1)), np.full((1, 1), 8.0), np.full((1, 1), 8 * s2)
        self.filter, self.age, self.score, self.struck = one, 1, 0.0, 0.0

    def see(self, row, y, pi, evidence, phi):
        share, before = max(pi, min((self.struck + 0.2) / (self.age + 20), 0.25)), self.filter.s2[0, 0]
        self.filter, taken = update(self.filter, row[None], np.array([y]), True, share)
        self.filter.P = self.filter.P * before / self.filter.s2[0, 0] * outer(phi, phi)
        self.filter.theta = self.filter.theta * phi
        self.age, self.struck = self.age + 1, self.struck + taken.rho[0, 0]
        self.score += taken.evidence[0] - evidence

    def is_over(self):
        return self.score < -8 or self.age > 100

    def has_won(self, trial, shown):
        """Whether it takes over from what is shown with that sigma^2."""
        is_due = self.age > 16 if self.filter.s2[0, 0] > shown else self.struck > 1.5
        return self.score > np.log(1000) and is_due and not self.is_explained(trial)


class Loud(Quiet):
    """Of one series: the filter of its bank that never forgets, with louder noise."""

    def __init__(self, bank):
        one = Bank(*(getattr(bank, f)[:, [0]] for f in ("theta", "P", "w", "nu", "chi2"))).at([0])
        one.w, one.nu, one.chi2 = np.ones((1, 1)), np.ones((1, 1)), 3 * one.s2
        one.P, self.weight = one.P / 3, bank.w[0, 0]
        self.filter, self.age, self.score, self.struck = one, 1, 0.0, 0.0
