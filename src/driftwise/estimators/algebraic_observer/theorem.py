"""Tian's theorem 1, corrected: its coefficients in whatever numbers it is given (fractions, floats, letters)."""

from __future__ import annotations

from fractions import Fraction
from math import comb, factorial
from typing import Any

Powers = dict[int, Any]  # {power: coefficient}, without zeros


class Theorem:
    """Estimates of y and its derivatives in finite time, from integrals of y and u only.

        sum_i a_i y^(i) = sum_i b_i u^(i) + pi,     a_n = 1,  m < n
        pi = a polynomial of degree g + sinusoids of known frequencies w_1 .. w_k, all of unknown amplitudes

    xi = g + 1 + 2k, N = n + xi, c_j = binomial(N, j), P = s^(g+1) prod (s^2 + w_i^2), D1 = P A, D2 = P B. With

        s^mu D1^(j) / D1 = sum_q k[mu,j,q] s^q + Qy[mu,j],        s^mu D2^(j) / D1 = sum_q k'[mu,j,q] s^q + Qu[mu,j]

    (Q strictly proper, L^-1 the inverse Laplace transform, * convolution),

        (-t)^N y^(mu) = M_mu - F_mu - sum_{h < mu} alpha[mu,h](t) y^(h)
        F_mu = sum_{j=1..N} c_j L^-1[Qy[mu,j]] * ((-t)^(N-j) y)
        M_mu = sum_{j=0..N} c_j L^-1[Qu[mu,j]] * ((-t)^(N-j) u)  +  sum_h beta[mu,h](t) u^(h)

    k[mu,j,q] depends on mu - q only: it is a coefficient of the series of D1^(j)/D1 in 1/s (``k``, ``k_u``).

    Parameters
    ----------
    a : a_0 .. a_n, with a_n = 1
    b : b_0 .. b_m; empty without an input
    degree : g; -1: no polynomial
    frequencies : w_1 .. w_k

    Notes
    -----
    As printed the theorem is wrong in several places: 1/(-t)^N multiplies M - F; the constants k depend on mu and j, r
    on (j, h, q); and the sum of derivatives of u goes up to h = m + mu - n, or the direct term b_m u is lost.

    References
    ----------
    Tian (2009), Estimation d'etat pour des systemes lineaires: approche algebrique, theorem 1.

    Examples
    --------
    >>> Theorem([0, 2, 10, 1], [2], degree=0, frequencies=[50]).alpha(3, 0)     # 29424 t^5 - 1200 t^4 - 1200 t^3
    {3: -1200, 4: -1200, 5: 29424}
    """

    def __init__(self, a, b=(), degree: int = 0, frequencies=()):
        self.a, self.b, self.P = list(a), list(b), disturbance_polynomial(degree, frequencies)
        self.n, self.m, self.xi = len(self.a) - 1, len(self.b) - 1, len(self.P) - 1
        self.N = N = self.n + self.xi
        self.c = [comb(N, j) for j in range(N + 1)]
        self.D1, self.D2 = product(self.P, self.a), product(self.P, self.b)
        self.D1s, self.D2s = derivatives(self.D1, N), derivatives(self.D2, N)  # D1^(0) .. D1^(N)
        self.k = [series(D, self.D1, N) for D in self.D1s]  # k[mu,j,q] = k[j][mu - q]
        self.k_u = [series(D, self.D1, N) for D in self.D2s]

    def direct(self, mu: int, j: int) -> list[Any]:
        """Return k[mu,j,q], q = 0 .. mu - j: the polynomial part of s^mu D1^(j) / D1."""
        return [self.k[j][mu - q] for q in range(mu - j + 1)]

    def alpha(self, mu: int, h: int) -> Powers:
        """Return alpha[mu,h](t), which y^(h) has in the equation of y^(mu), h < mu <= N."""
        N = self.N
        found: Powers = {N - mu + h: comb(mu, h) * (-1) ** N * factorial(N) // factorial(N - mu + h)}
        for j in range(1, mu - h + 1):
            for q in range(h, mu - j + 1):
                self._add(found, self.c[j] * self.k[j][mu - q], j, h, q)
        return _tidy(found)

    def beta(self, mu: int, h: int) -> Powers:
        """Return beta[mu,h](t), which u^(h) has in the equation of y^(mu), h <= m + mu - n."""
        found: Powers = {}
        for j in range(self.m + mu - self.n - h + 1):
            for q in range(h, self.m + mu - self.n - j + 1):
                self._add(found, self.c[j] * self.k_u[j][mu - q], j, h, q)
        return _tidy(found)

    def _add(self, found, factor, j, h, q):
        """Add factor r[j,h,q], which (d/dt)^q (-t)^(N-j) y leaves in front of y^(h)."""
        power = self.N - j - q + h
        r = comb(q, h) * (-1) ** (self.N - j) * factorial(self.N - j) // factorial(power)
        found[power] = found.get(power, 0) + factor * r

    def markov(self, count: int) -> list[Any]:
        """Return g_0 .. g_(count-1), B/A = g_0/s + g_1/s^2 + ..: y^(mu) has the direct terms sum_h g_(mu-1-h) u^(h)."""
        return series(self.b, self.a, count)[1:]


def disturbance_polynomial(degree: int, frequencies) -> list[Any]:
    """Return P, lowest power first: s^(degree+1) prod (s^2 + w^2), whose product with the disturbance has no pole."""
    P: list[Any] = [0] * (degree + 1) + [1]
    for w in frequencies:
        P = product(P, [w * w, 0, 1])
    return P


def product(p, q) -> list[Any]:
    """Return the product of two polynomials, lowest power first."""
    found = [0] * max(len(p) + len(q) - 1, 0) if len(p) and len(q) else []
    for i, a in enumerate(p):
        for j, b in enumerate(q):
            found[i + j] = found[i + j] + a * b
    return found


def derivatives(p, count: int) -> list[list[Any]]:
    """Return a polynomial and its first ``count`` derivatives."""
    found = [list(p)]
    for _ in range(count):
        found.append([i * c for i, c in enumerate(found[-1])][1:])
    return found


def series(p, q, count: int) -> list[Any]:
    """Return the coefficients of 1, 1/s, .. , s^-count in p(s) / q(s), where q is monic and p of no higher degree."""
    top = len(q) - 1
    found: list[Any] = []
    for i in range(count + 1):
        value = p[top - i] if 0 <= top - i < len(p) else 0
        for l in range(max(i - top, 0), i):
            value = value - found[l] * q[top - i + l]
        found.append(value)
    return found


def _tidy(found: Powers) -> Powers:
    expanded = {power: value.expand() if hasattr(value, "expand") else value for power, value in found.items()}
    return {power: expanded[power] for power in sorted(expanded) if expanded[power] != 0}


def transfer_function(A, B, C) -> tuple[list[Fraction], list[Fraction]]:
    """Return a_0 .. a_n and b_0 .. b_m of C (sI - A)^-1 B = b(s)/a(s), exactly (Faddeev and LeVerrier).

    A (n, n), B (n,) and C (n,) are finite floats, taken at their word; b is empty where B is zero.
    """
    A, B, C = ([[Fraction(v) for v in row] for row in A], *([Fraction(v) for v in x] for x in (B, C)))
    n = len(A)
    M = [[Fraction(int(i == j)) for j in range(n)] for i in range(n)]
    a: list[Any] = [Fraction(1)]
    b: list[Any] = []
    for k in range(1, n + 1):
        b.append(sum(C[i] * M[i][j] * B[j] for i in range(n) for j in range(n)))
        M = [[sum(A[i][l] * M[l][j] for l in range(n)) for j in range(n)] for i in range(n)]
        a.append(-sum(M[i][i] for i in range(n)) / k)
        for i in range(n):
            M[i][i] += a[-1]
    while b and not b[0]:
        b.pop(0)
    return a[::-1], b[::-1]


def polynomial_variance(N: int, m: int) -> Fraction:
    """Return V: the m-th derivative at the end of a window T has the variance V sigma^2 h / T^(2m+1).

    sigma is the standard deviation of a sample and h their distance; y is a polynomial of degree N - 1, where the
    theorem and least squares are the same (h small against T).

    Examples
    --------
    >>> polynomial_variance(3, 1)
    Fraction(192, 1)
    """
    return Fraction(factorial(N + m), factorial(m) * factorial(N - m - 1)) ** 2 / (2 * m + 1)
