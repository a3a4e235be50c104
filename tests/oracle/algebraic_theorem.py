"""Tian's theorem 1, corrected, in exact rational arithmetic; its kernels; variances of polynomial estimators.

Polynomials are lists of fractions, lowest power first. Plant: sum a_i y^(i) = sum b_i u^(i) + pi(t), pi of degree g and
of sines w_i; P = s^(g+1) prod(s^2 + w_i^2), D1 = P A, D2 = P B, N the degree of D1. The estimates are

    (-t)^N y^(mu) = M_mu(u) - F_mu(y) - sum_{h < mu} alpha[mu, h](t) y^(h)
"""

from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from math import comb, factorial

import numpy as np
from scipy.linalg import expm


def product(p, q):
    out = [Fraction(0)] * (len(p) + len(q) - 1)
    for i, a in enumerate(p):
        for j, b in enumerate(q):
            out[i + j] += a * b
    return out


def derivative(p, times):
    for _ in range(times):
        p = [i * a for i, a in enumerate(p)][1:]
    return p


def divided(p, q):
    """Quotient and rest, by long division; both stripped of leading zeros."""
    rest, quotient = [Fraction(a) for a in p], [Fraction(0)] * max(len(p) - len(q) + 1, 0)
    for i in reversed(range(len(quotient))):
        quotient[i] = rest[i + len(q) - 1] / q[-1]
        for j, b in enumerate(q):
            rest[i + j] -= quotient[i] * b
    return quotient, rest[: len(q) - 1]


def powers(p):
    """Return {power: coefficient} of what is not zero."""
    return {i: a for i, a in enumerate(p) if a}


@dataclass(frozen=True)
class Theorem:
    """Everything of theorem 1 for one model; a[-1] = 1, both lists of coefficients lowest power first."""

    a: list
    b: list
    g: int = -1
    w: list = field(default_factory=list)

    @cached_property
    def D1(self):
        return product(self.annihilator, [Fraction(x) for x in self.a])

    @cached_property
    def D2(self):
        return product(self.annihilator, [Fraction(x) for x in self.b])

    @property
    def annihilator(self):
        P = [Fraction(0)] * (self.g + 1) + [Fraction(1)]
        for w in self.w:
            P = product(P, [Fraction(w) ** 2, Fraction(0), Fraction(1)])
        return P

    @property
    def N(self):
        return len(self.D1) - 1

    def shifted(self, D, mu, j):
        return [Fraction(0)] * mu + derivative(D, j)

    def y_parts(self, mu, j):
        """Return k[mu, j, q] and the numerator of Qy[mu, j], from s^mu D1^(j) over D1."""
        return divided(self.shifted(self.D1, mu, j), self.D1)

    def u_parts(self, mu, j):
        """Return k'[mu, j, q] and the numerator of Qu[mu, j]."""
        return divided(self.shifted(self.D2, mu, j), self.D1)

    def brought_down(self, parts, mu, h):
        """Return sum_j c_j sum_q k[q] r[j, h, q], the coefficient of the h-th derivative, as {power of t: number}.

        s^q applied to (-t)^(N-j) f is the q-th derivative of a product; r[j, h, q] is its term in f^(h) (Leibniz).
        """
        found: dict[int, Fraction] = {}
        for j in range(self.N + 1):
            for q, k in enumerate(parts(mu, j)[0]):
                if k and h <= q <= self.N - j + h:
                    power = self.N - j - q + h
                    r = comb(q, h) * (-1) ** (self.N - j) * Fraction(factorial(self.N - j), factorial(power))
                    found[power] = found.get(power, 0) + comb(self.N, j) * k * r
        return {power: c for power, c in found.items() if c}

    def alpha(self, mu, h):
        """{power of t: coefficient}: D1^(0) = D1 itself is the term j = 0, which gives d~[mu, h]."""
        return self.brought_down(self.y_parts, mu, h)

    def beta(self, mu, h):
        return self.brought_down(self.u_parts, mu, h)

    def cD1(self, j):
        return [comb(self.N, j) * c for c in derivative(self.D1, j)]

    @property
    def companion(self):
        """A, B of the filters 1/D1: the coefficients of a numerator are its C."""
        A = np.eye(self.N, k=1)
        A[-1] = [-float(c) for c in self.D1[:-1]]
        return A, np.eye(self.N)[:, -1]

    def impulse(self, parts, x):
        """Inverse transforms at the instants x (K,) of numerators (list of lists) over D1: (len(parts), K)."""
        A, B = self.companion
        C = np.array([[float(c) for c in p] + [0.0] * (self.N - len(p)) for p in parts])
        x = np.asarray(x, dtype=float)
        if x[0] > x[-1]:
            return self.impulse(parts, x[::-1])[:, ::-1]
        steps = np.diff(x)  # forwards: backwards a stable mode grows
        if len(x) > 200 and np.ptp(steps) < 1e-9 * np.abs(steps).max():  # equidistant: one exponential
            E, states = expm(A * steps.mean()), [expm(A * x[0]) @ B]
            for _ in steps:
                states.append(E @ states[-1])
            return C @ np.array(states).T
        return C @ np.array([expm(A * each) @ B for each in x]).T

    def kernel(self, t, tau):
        """k(t, tau) of y_e(t) = int k y dtau, by h_j = L^-1[D1^(j)/D1] (identity 2 of the theory)."""
        tau, N = np.asarray(tau, dtype=float), self.N
        h = self.impulse([derivative(self.D1, j) for j in range(1, N + 1)], t - tau)
        return sum((-1) ** (j - 1) * comb(N, j) * tau ** (N - j) * h[j - 1] for j in range(1, N + 1)) / t**N

    def kernels(self, t, tau, orders):
        """Kernels (orders, K) of y, y', .. by the theorem itself: F_mu, then the lower ones weighted by alpha."""
        kept: list[np.ndarray] = []
        tau, N = np.asarray(tau, dtype=float), self.N
        for mu in range(orders):
            q = self.impulse([self.y_parts(mu, j)[1] for j in range(1, N + 1)], t - tau)
            F = sum(comb(N, j) * (-tau) ** (N - j) * q[j - 1] for j in range(1, N + 1))
            kept.append(-(F + sum(evaluate(self.alpha(mu, h), t) * kept[h] for h in range(mu))) / (-t) ** N)
        return np.array(kept)

    def derivatives(self, t, y, u_derivatives, orders, nodes=120):
        """y, y', .. at t from functions y and u only, integrals by Gauss-Legendre.

        `u_derivatives[h]` is the function u^(h); the h-th is used only where u enters the read-out.
        """
        x, weight = np.polynomial.legendre.leggauss(nodes)
        tau, weight = t / 2 * (x + 1), t / 2 * weight
        kernels, N = self.kernels(t, tau, orders), self.N
        kept: list[float] = []
        direct: list[float] = []
        for mu in range(orders):
            q = self.impulse([self.u_parts(mu, j)[1] for j in range(N + 1)], t - tau)
            M = sum(comb(N, j) * weight @ ((-tau) ** (N - j) * q[j] * u_derivatives[0](tau)) for j in range(N + 1))
            M += sum(evaluate(self.beta(mu, h), t) * u_derivatives[h](t) for h in range(len(u_derivatives)))
            direct.append((M - sum(evaluate(self.alpha(mu, h), t) * direct[h] for h in range(mu))) / (-t) ** N)
            kept.append(weight @ (kernels[mu] * y(tau)) + direct[mu])
        return np.array(kept)


def evaluate(coefficients, t):
    return sum(float(c) * t**power for power, c in coefficients.items())


def theorem_polynomials(N, orders):
    """Kernels of D1 = s^N on [0, 1] as the theorem gives them: exact coefficients in tau, lowest first."""
    chain = Theorem([0] * N + [1], [1])
    kept: list[list[Fraction]] = []
    for mu in range(orders):
        total = [Fraction(0)] * N
        for j in range(mu + 1, N + 1):  # s^mu D1^(j)/D1 = N!/(N-j)! s^(mu-j)
            gain = comb(N, j) * Fraction(factorial(N), factorial(N - j)) / factorial(j - mu - 1)
            term = [Fraction(0)] * (N - j) + [gain * (-1) ** (N - j)]  # (-tau)^(N-j)
            for _ in range(j - mu - 1):
                term = product(term, [Fraction(1), Fraction(-1)])  # (1 - tau)^(j-mu-1)
            for i, c in enumerate(term):
                total[i] += c
        for h in range(mu):
            weight = sum(chain.alpha(mu, h).values())
            total = [c + weight * lower for c, lower in zip(total, kept[h])]
        kept.append([-c * (-1) ** N for c in total])
    return kept


def solved(M, rhs):
    """Exact solution of a square system of fractions (Gauss-Jordan)."""
    n = len(M)
    rows = [[*map(Fraction, row), Fraction(r)] for row, r in zip(M, rhs)]
    for i in range(n):
        pivot = next(r for r in range(i, n) if rows[r][i])
        rows[i], rows[pivot] = rows[pivot], rows[i]
        rows[i] = [x / rows[i][i] for x in rows[i]]
        for r in range(n):
            if r != i:
                rows[r] = [x - rows[r][i] * y for x, y in zip(rows[r], rows[i])]
    return [row[-1] for row in rows]


def least_squares_kernel(N, m):
    """Shortest kernel on [0, 1] with int k tau^p = d^m/dtau^m tau^p at 1, p < N: the moment (Hilbert) system."""
    hilbert = [[Fraction(1, p + q + 1) for q in range(N)] for p in range(N)]
    return solved(hilbert, [Fraction(factorial(p), factorial(p - m)) if p >= m else 0 for p in range(N)])


def least_squares_variance(N, m):
    """Return the integral of k^2: V(N, m) for noise of unit density on [0, 1]."""
    k = least_squares_kernel(N, m)
    return sum(c * Fraction(factorial(p), factorial(p - m)) for p, c in enumerate(k) if p >= m)


def closed_variance(N, m):
    return Fraction(factorial(N + m), factorial(m) * factorial(N - m - 1)) ** 2 / (2 * m + 1)


def hidden_modes(A, H):
    """Eigenvalues of the unobservable part; the rank is decided exactly, in fractions."""
    n = len(A)
    A, rows = [[Fraction(str(x)) for x in row] for row in A], [[Fraction(str(x)) for x in row] for row in H]
    observed = list(rows)
    for _ in range(n - 1):
        rows = [[sum(row[i] * A[i][j] for i in range(n)) for j in range(n)] for row in rows]
        observed += rows
    pivots: list[int] = []
    reduced: list[list[Fraction]] = []
    for row in observed:
        for pivot, basis in zip(pivots, reduced):
            row = [x - row[pivot] * y for x, y in zip(row, basis)]
        if any(row):
            lead = next(i for i, x in enumerate(row) if x)
            row = [x / row[lead] for x in row]
            reduced = [[x - old[lead] * y for x, y in zip(old, row)] for old in reduced] + [row]
            pivots.append(lead)
    free = [i for i in range(n) if i not in pivots]
    unseen = np.zeros((n, len(free)))
    for column, i in enumerate(free):
        unseen[i, column] = 1
        for pivot, row in zip(pivots, reduced):
            unseen[pivot, column] = -float(row[i])
    matrix = np.array(A, dtype=float)
    return np.linalg.eigvals(np.linalg.lstsq(unseen, matrix @ unseen)[0]) if free else np.array([])
