"""The theorem as one filter of order N in observer form, discretised exactly for a y that is linear between samples.

Time is counted in samples here (t = k, h = 1), so that powers of it are powers of whole numbers. With chi = xi/(-t)^N

    xi' = Ao xi + sum_j (By_j (-t)^(N-j) y + Bu_j (-t)^(N-j) u),       (-t)^N y = Co xi

    chi(k+1) = r^N e^Ao chi(k) + sum_e r^e q^(N-e) (Y0_e y(k) + Y1_e y(k+1) + U0_e u(k) + U1_e u(k+1))

where q = 1/(k+1), r = k/(k+1): nothing grows. The tables Y0 .. U1 follow from (k+s)^p = sum_l binomial(p,l) k^(p-l) s^l
and the integrals J_l = int_0^1 e^(Ao (1-s)) s^l ds.
"""

from __future__ import annotations

from math import comb
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from .theorem import Theorem

TERMS = 24  # of a series in a matrix of no larger eigenvalue than 1, beyond its size


class Filter(NamedTuple):
    """The filter's constants; row e of a table belongs to r^e q^(N-e)."""

    Phi: np.ndarray  # (N, N) e^Ao
    Y0: np.ndarray  # (N, N)
    Y1: np.ndarray
    U0: np.ndarray  # (N + 1, N)
    U1: np.ndarray
    powers: np.ndarray  # (N, N): row mu is Co Ao^mu
    alpha: np.ndarray  # for mu = 1 .. N-1, for h < mu: alpha[mu,h]/(-t)^N, its coefficients of 1/t .. 1/t^(mu-h)
    reach: np.ndarray  # (N,): y one sample on, from z
    ahead: np.ndarray  # (2,): and from u now, u then


def discretise(theorem: Theorem, hold: str) -> Filter:
    """Return the filter of a theorem that is in units of samples."""
    N = theorem.N
    Ao, By, Bu = observer_form(theorem)
    Phi, J = integrals(Ao, N + 1)
    Y0, Y1 = np.zeros((2, N, N))
    U0, U1 = np.zeros((2, N + 1, N))
    for j in range(N + 1):
        for l in range(N - j + 1):
            e, weight = N - j - l, (-1) ** j * comb(N - j, l)
            if j:
                Y0[e] += weight * (J[l] - J[l + 1]) @ By[j]
                Y1[e] += weight * J[l + 1] @ By[j]
            U0[e] += weight * (J[l] if hold == "zoh" else J[l] - J[l + 1]) @ Bu[j]
            if hold == "foh":
                U1[e] += weight * J[l + 1] @ Bu[j]
    powers, alpha = np.eye(1, N).repeat(N, 0), []
    for mu in range(1, N):
        powers[mu] = powers[mu - 1] @ Ao
        for h in range(mu):
            found = theorem.alpha(mu, h)
            alpha += [float((-1) ** N * found.get(N - i, 0)) for i in range(1, mu - h + 1)]
    ahead = np.array([(J[0] - J[1]) @ Bu[0], J[1] @ Bu[0]])[:, 0] if hold == "foh" else [(J[0] @ Bu[0])[0], 0.0]
    reach = np.linalg.solve(powers.T, Phi[0])
    return Filter(Phi, Y0, Y1, U0, U1, powers, np.array(alpha), reach, np.array(ahead))


def observer_form(theorem: Theorem) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return Ao (N, N), and By, Bu (N + 1, N) with one row for each j: -c_j D1^(j) (0 for j = 0) and c_j D2^(j)."""
    N = theorem.N
    Ao = np.eye(N, k=1)
    Ao[:, 0] = [-float(d) for d in theorem.D1[N - 1 :: -1]] if N else []
    By, Bu = np.zeros((2, N + 1, N))
    for j, c in enumerate(theorem.c):
        if j:
            By[j] = [-float(c * d) for d in _column(theorem.D1s[j], N)]
        Bu[j] = [float(c * d) for d in _column(theorem.D2s[j], N)]
    return Ao, By, Bu


def _column(p, N) -> list:
    """Return a polynomial's coefficients from s^(N-1) down to 1."""
    return [p[i] if i < len(p) else 0 for i in range(N - 1, -1, -1)]


def integrals(A, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return e^A (N, N), and J_l = int_0^1 e^(A (1-s)) s^l ds for l = 0 .. count, (count + 1, N, N).

    Series over 2^-p of the step, where no eigenvalue is large, then p times doubled: with E = e^(A H) and K over H,
    K_l(2H) = E K_l + sum_i binomial(l,i) H^(l-i) K_i. The entries of A differ by many powers of ten (those of y and
    of its derivatives), and so do the errors: a Pade approximant would spread the largest over all.
    """
    N, size = len(A), float(abs(np.linalg.eigvals(A)).max(initial=0.0))
    doublings = max(int(np.ceil(np.log2(size))) if size > 0 else 0, 0)
    H = 0.5**doublings
    E, K = np.eye(N), np.zeros((count + 1, N, N))
    term = np.eye(N)  # (A H)^i / i!
    for i in range(N + TERMS):
        for l in range(count + 1):
            K[l] += term * (H ** (l + 1) / ((l + i + 1) * comb(l + i, i)))
        term = term @ A * (H / (i + 1))
        E = E + term
    for _ in range(doublings):
        K = np.stack([E @ K[l] + sum(comb(l, i) * H ** (l - i) * K[i] for i in range(l + 1)) for l in range(count + 1)])
        E, H = E @ E, 2 * H
    return E, K


def kernel(theorem: Theorem, t: float, tau, order: int = 0) -> np.ndarray:
    """Return k(t, tau), where y^(order)(t) = int_0^t k(t, tau) y(tau) dtau in the absence of u.

        k(t, tau) = sum_j (-1)^(j-1) binomial(N, j) tau^(N-j) h_j(t - tau) / t^N,      h_j = L^-1[D1^(j) / D1]

    for y itself; those of its derivatives follow by the theorem's recursion. (`Theorem`: in seconds here.)

    Examples
    --------
    >>> kernel(Theorem([0, 0, 1], degree=-1), 1.0, [0.0, 0.5, 1.0])     # a straight line: 6 tau - 2
    array([-2.,  1.,  4.])
    """
    N, tau = theorem.N, np.asarray(tau, float)
    Ao, By, _ = observer_form(theorem)
    rows = [np.linalg.matrix_power(Ao, mu)[0] for mu in range(order + 1)]
    found = np.empty((order + 1, tau.size))
    for i, s in enumerate(tau.ravel()):
        chi = expm(Ao * (t - s)) @ sum((-1) ** j * s ** (N - j) / t**N * By[j] for j in range(1, N + 1))
        for mu in range(order + 1):
            found[mu, i] = rows[mu] @ chi
            for h in range(mu):
                alpha = sum(float(c) * t**power for power, c in theorem.alpha(mu, h).items())
                found[mu, i] -= alpha / (-t) ** N * found[h, i]
    return found[order].reshape(tau.shape)
