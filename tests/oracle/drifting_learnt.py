"""Policies by correlations (5.7), recursive likelihood (5.8) and variational Bayes (5.16); see `drifting`."""

import numpy as np

from .drifting import Policy, diag, diagonal, dot, outer, symmetric, times


def shifted(new, past):
    """The newest value first, the oldest dropped."""
    return np.concatenate([new[:, None], past[:, :-1]], axis=1)


class Correlation(Policy):
    """Autocovariance least squares (5.7): covariances of a design filter, linear in x = (q_i/s_i^2, sigma^2/told)."""

    def __init__(self, learns_sigma2=False, lags=10):
        self.learns_sigma2, self.lags = learns_sigma2, lags

    def init(self, now):
        S, n = now.psi.shape
        m = n + 1
        self.theta, self.P = np.zeros((S, n)), np.tile(1000 * np.eye(n), (S, 1, 1))
        self.M, self.V = np.zeros((S, m, n, n)), np.zeros((S, self.lags, m, n))
        self.G, self.g = np.zeros((S, m, m)), np.zeros((S, m))
        self.past = np.zeros((S, self.lags)), np.ones((S, self.lags))
        self.x = np.append(np.full(n, 1e-3), 1.0) + np.zeros((S, m))

    def step(self, now):
        psi, s0, n = now.psi, now.told, now.psi.shape[1]
        Sd = dot(psi, times(self.P, psi)) + s0
        Kd = times(self.P, psi) / Sd[:, None]
        e = now.y - dot(psi, self.theta)
        A = now.phi[:, None] * (np.eye(n) - outer(Kd, psi))
        b = now.phi * Kd

        c0 = np.einsum("si,smij,sj->sm", psi, self.M, psi)
        c0[:, n] += s0
        c = np.einsum("slmi,si->slm", self.V, psi)
        e_past, S_past = self.past
        if now.k >= 30:
            weight = 1 / (Sd[:, None] * S_past)
            self.G = (1 - 1 / 300) * self.G + 0.5 * outer(c0, c0) / Sd[:, None, None] ** 2
            self.G += np.einsum("sli,slj,sl->sij", c, c, weight)
            self.g = (1 - 1 / 300) * self.g + 0.5 * c0 * (e**2 / Sd**2)[:, None]
            self.g += np.einsum("sli,sl->si", c, e[:, None] * e_past * weight)

        newest = np.einsum("sij,smjk,sk->smi", A, self.M, psi)
        newest[:, n] -= s0[:, None] * b
        self.V = shifted(newest, np.einsum("sij,slmj->slmi", A, self.V))
        self.M = np.einsum("sij,smjk,slk->smil", A, self.M, A)
        for j in range(n):
            self.M[:, j, j, j] += now.s2[:, j]
        self.M[:, n] += s0[:, None, None] * outer(b, b)
        self.past = shifted(e, e_past), shifted(Sd, S_past)
        self.theta = now.phi * (self.theta + Kd * e[:, None])
        self.P = symmetric(outer(now.phi, now.phi) * (self.P - outer(Kd, times(self.P, psi)))) / 0.95

        if now.k >= 60:
            self.solve()
        return self.x[:, :n] * now.s2, self.x[:, n] * s0 if self.learns_sigma2 else now.sigma2

    def solve(self):
        """Eight sweeps of coordinate descent within the bounds."""
        m = self.x.shape[1]
        G = self.G + 1e-6 * (diag(self.G).sum(-1) / m)[:, None, None] * np.eye(m)
        for _ in range(8):
            for i in range(m if self.learns_sigma2 else m - 1):
                others = dot(G[:, i], self.x) - G[:, i, i] * self.x[:, i]
                lo, hi = (0.0, 10.0) if i < m - 1 else (1e-4, 1e4)
                self.x[:, i] = np.clip((self.g[:, i] - others) / G[:, i, i], lo, hi)


def differentiate(dtheta, dP, psi, eps, S, K, d):
    """2.3: dS_j, de_j and the derivatives of theta_f, P_f; ``dtheta`` (S, p, n), ``dP`` (S, p, n, n), ``d`` (S, p)."""
    v = np.einsum("spij,sj->spi", dP, psi)
    dS, de = np.einsum("spi,si->sp", v, psi) + d, -np.einsum("spi,si->sp", dtheta, psi)
    K, eps, S = K[:, None], eps[:, None, None], S[:, None, None]
    dtheta_f = dtheta + (v - K * dS[..., None]) * eps / S + K * de[..., None]
    dP_f = dP - outer(K, v) - outer(v, K) + outer(K, K) * dS[..., None, None]
    return dS, de, dtheta_f, dP_f


def score_term(dS, de, eps, S):
    """Derivative of one term of (C14)."""
    eps, S = eps[:, None], S[:, None]
    return -0.5 * (dS / S * (1 - eps**2 / S) + 2 * eps * de / S)


class Score(Policy):
    """Q given, nothing learnt; sums up the gradient of (C14) in (log q_1 .. log q_n, log sigma^2)."""

    def __init__(self, q):
        self.q = np.asarray(q, float)

    def init(self, now):
        S, n = now.psi.shape
        self.dtheta, self.dP = np.zeros((S, n + 1, n)), np.zeros((S, n + 1, n, n))
        self.score = np.zeros((S, n + 1))

    def step(self, now):
        n = now.psi.shape[1]
        d = now.sigma2[:, None] * np.append(np.zeros(n), 1.0)
        dS, de, dtheta, dP = differentiate(self.dtheta, self.dP, now.psi, now.eps, now.S, now.K, d)
        self.score += score_term(dS, de, now.eps, now.S)
        self.dtheta, self.dP = now.phi * dtheta, outer(now.phi, now.phi) * dP
        for j in range(n):
            self.dP[:, j, j, j] += self.q[j]
        return np.zeros_like(now.psi) + self.q, now.sigma2


class Likelihood(Policy):
    """Recursive maximum likelihood (5.8) in eta = (log NVR_i [, log sigma^2]), NVR shrunk together or ``shared``."""

    def __init__(self, *, shared=False, learns_sigma2=False, start=1e-2, least=1e-6, N=150, tau=1.5):
        self.shared, self.learns_sigma2, self.start, self.least = shared, learns_sigma2, start, least
        self.N, self.tau, self.sd = N, tau, 4.0

    def init(self, now):
        S, n = now.psi.shape
        self.m = 1 if self.shared else n  # NVR entries
        p = self.m + self.learns_sigma2
        self.eta0 = np.full((S, p), np.log(self.start))
        if self.learns_sigma2:
            self.eta0[:, -1] = np.log(now.told)
        self.eta, self.J0 = self.eta0.copy(), np.eye(p) / self.sd**2
        self.J = self.J0 + np.zeros((S, p, p))
        self.dtheta, self.dP, self.q = np.zeros((S, p, n)), np.zeros((S, p, n, n)), np.zeros((S, self.m))

    def climb(self, dS, de, eps, S):
        """Step 2: one Gauss-Newton step of the penalised likelihood."""
        N, m = self.N, self.m
        g = score_term(dS, de, eps, S) - (self.eta - self.eta0) / (self.sd**2 * N)
        information = 0.5 * outer(dS, dS) / S[:, None, None] ** 2 + outer(de, de) / S[:, None, None]
        self.J = (1 - 1 / N) * self.J + self.J0 / N + information
        Js, nvr = self.J.copy(), self.eta[:, :m]
        g[:, :m] -= (nvr - nvr.mean(-1, keepdims=True)) / (self.tau**2 * N)
        Js[:, :m, :m] += (np.eye(m) - 1 / m) / self.tau**2
        self.eta = self.eta + np.clip(np.linalg.solve(Js, g[..., None])[..., 0], -1, 1)
        self.eta[:, :m] = np.clip(self.eta[:, :m], np.log(self.least), np.log(10))
        self.eta[:, m:] = np.clip(self.eta[:, m:], self.eta0[:, m:] - 9, self.eta0[:, m:] + 9)

    def step(self, now):
        n, m = now.psi.shape[1], self.m
        d = np.zeros_like(self.eta)
        if self.learns_sigma2:
            d[:, -1] = now.sigma2
        dS, de, dtheta, dP = differentiate(self.dtheta, self.dP, now.psi, now.eps, now.S, now.K, d)
        if now.k >= 2 * n:
            self.climb(dS, de, now.eps, now.S)
        self.q = np.exp(self.eta[:, :m]) * now.s2
        self.carry(now.phi, dtheta, dP)
        return self.q, np.exp(self.eta[:, -1]) if self.learns_sigma2 else now.sigma2

    def carry(self, phi, dtheta, dP):
        """Step 4: the derivatives through the time update, Q included."""
        self.dtheta, self.dP = phi * dtheta, outer(phi, phi) * dP
        if self.shared:
            self.dP[:, 0] += diagonal(self.q)
        else:
            for j in range(self.m):
                self.dP[:, j, j, j] += self.q[:, j]

    def coast(self, now, Q):
        self.carry(now.phi, self.dtheta, self.dP)
        return Q


class SarkkaNummenmaa(Policy):
    """Variational sigma^2 (2009) beside a nominal Q, forgetting rho; sigma^2 acts one sample later (5.16)."""

    def __init__(self, rho=0.98, nvr=1e-3):
        self.rho, self.nvr = rho, nvr

    def init(self, now):
        self.a, self.b = 5.0, 5 * now.told

    def step(self, now):
        self.a, b0, R = self.rho * self.a + 0.5, self.rho * self.b, now.sigma2
        for _ in range(3):
            S = now.p + R
            self.b = b0 + 0.5 * ((now.eps * R / S) ** 2 + R * now.p / S)
            R = self.b / self.a
        return self.nvr * now.s2, R


class Huang(Policy):
    """Variational P and sigma^2 (2018) around a nominal Q (5.16); ``fixed`` keeps sigma^2."""

    def __init__(self, fixed=False, tau=3.0, nvr=1e-3):
        self.fixed, self.tau, self.nvr, self.rho = fixed, tau, nvr, 1 - np.exp(-4)

    def init(self, now):
        self.u = 1 / (1 - self.rho) + 2
        self.U = (self.u - 2) * now.told

    def step(self, now):
        u0, U0, R = self.rho * (self.u - 2) + 2, self.rho * self.U, now.sigma2
        for _ in range(5):
            A = now.P_f + outer(now.theta_f - now.theta_p, now.theta_f - now.theta_p)
            P = (self.tau * now.P_p + A) / (self.tau + 1)
            B = (now.y - dot(now.psi, now.theta_f)) ** 2 + dot(now.psi, times(now.P_f, now.psi))
            R = R if self.fixed else (U0 + B) / (u0 - 1)
            K = times(P, now.psi) / (dot(now.psi, times(P, now.psi)) + R)[:, None]
            now.theta_f, now.P_f = now.theta_p + K * now.eps[:, None], symmetric(P - outer(K, times(P, now.psi)))
        self.u, self.U = u0 + 1, U0 + B
        return self.nvr * now.s2, R
