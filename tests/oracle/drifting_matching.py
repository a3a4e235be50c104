"""Policies that match covariances (5.5), and the auxiliary filter (5.6); see `drifting`."""

import numpy as np

from .drifting import Policy, diag, diagonal, dot, outer, ratio, times

START = 1e-3  # NVR until learning starts
FIRST = 10  # row at which it starts


class Matching(Policy):
    """What the rules share: the start, and Q and P_f of the sample before."""

    def init(self, now):
        self.q = START * now.s2
        self.restart(now)

    def restart(self, now):
        """What a rule remembers besides."""

    def learn(self, now):
        raise NotImplementedError

    def step(self, now):
        q, sigma2 = self.learn(now) if now.k >= FIRST else (START * now.s2, now.sigma2)
        self.q, self.P_f, self.s2 = q, now.P_f, now.s2
        return q, sigma2


def ew(mean, value, gain):
    return mean + gain * (value - mean)


class Increment(Matching):
    """K eps^2 K', exponentially weighted or (``window``) the mean of the last values."""

    def __init__(self, window=None):
        self.window = window

    def restart(self, now):
        self.values = []

    def learn(self, now):
        value = (now.phi * now.K * now.eps[:, None]) ** 2
        if self.window is None:
            return np.clip(ew(self.q, value, 0.02), 1e-8 * now.s2, 10 * now.s2), now.sigma2
        self.values = [*self.values, value][-self.window :]
        if len(self.values) < self.window:
            return self.q, now.sigma2
        return np.clip(np.mean(self.values, axis=0), 1e-8 * now.s2, 10 * now.s2), now.sigma2


class Scalar(Matching):
    """One NVR alpha for all: E[eps^2] - sigma^2 - psi' Phi P_f Phi' psi = alpha h."""

    def __init__(self, window=None):
        self.window = window

    def restart(self, now):
        self.alpha, self.A, self.B, self.values = np.full_like(now.eps, START), 0.0, 1e-12, []

    def learn(self, now):
        h = dot(now.psi**2, self.s2)
        a = now.eps**2 - now.sigma2 - (now.p - self.alpha * h)
        if self.window is None:
            self.A, self.B = ew(self.A, a, 0.02), ew(self.B, h, 0.02)
        else:
            self.values = [*self.values, (a, h)][-self.window :]
            self.A, self.B = np.sum(self.values, axis=0)
        self.alpha = np.clip(self.A / np.maximum(self.B, 1e-12), 0, 10)
        return self.alpha[:, None] * now.s2, now.sigma2


def myers_tapley(acc, increment, P_f, before, gain):
    """EW of (K_i eps)^2 + P_f,ii(k) - Phi_ii^2 P_f,ii(k-1); may turn negative."""
    return ew(acc, increment**2 + P_f - before, gain)


class MyersTapley(Matching):
    """``guard``: "clamp", "abs", or None, which lets a negative variance through (a negative control)."""

    def __init__(self, guard="clamp"):
        self.guard = guard

    def learn(self, now):
        if now.k == FIRST:
            self.acc = START * now.s2
        before = now.phi**2 * diag(self.P_f)
        self.acc = myers_tapley(self.acc, now.K * now.eps[:, None], diag(now.P_f), before, 0.02)
        if self.guard is None:
            return self.acc, now.sigma2
        return np.clip(np.abs(self.acc) if self.guard == "abs" else self.acc, 0, 10 * now.s2), now.sigma2


def innovation_variance(sigma2, p, eps, gain):
    """The variance to distrust: it turns negative."""
    return ew(sigma2, eps**2 - p, gain)


class SageHusa(Matching):
    """Full Q and sigma^2 without protection: a negative control."""

    def learn(self, now):
        Q = self.q if self.q.ndim == 3 else diagonal(self.q)
        increment = now.K * now.eps[:, None]
        value = outer(increment, increment) + now.P_f - outer(now.phi, now.phi) * self.P_f
        return ew(Q, value, 0.02), innovation_variance(now.sigma2, now.p, now.eps, 0.02)


def em_step(q, psi, eps, S, gain):
    """One lag of on-line EM (3.1)."""
    return q + gain * q**2 * psi**2 * ((eps**2 - S) / S**2)[..., None]


class OnlineEM(Matching):
    def learn(self, now):
        return np.clip(em_step(self.q, now.psi, now.eps, now.S, 0.02), 1e-8 * now.s2, now.s2), now.sigma2


def auxiliary_z(psi, p, q, sigma2, eps):
    """Step 2: eps^2 without sigma^2 and what P_f(k-1) explains."""
    return eps**2 - sigma2 - (p - dot(psi**2, q))


def auxiliary_step(q, Pq, psi, z, S, lam):
    """Steps 3 to 5: the Kalman filter of z = h'q + v, var v = 2 S^2, with forgetting."""
    h = psi**2
    Kq = times(Pq, h) / (dot(h, times(Pq, h)) + 2 * S**2)[..., None]
    return q + Kq * (z - dot(h, q))[..., None], (Pq - outer(Kq, times(Pq, h))) / lam


class Auxiliary(Matching):
    """``spread``: prior deviation of q in s_i^2; ``most=None`` clamps nothing (naive). Slow start: (.01, .99, 1)."""

    def __init__(self, spread=0.1, lam=0.995, most=10.0):
        self.spread, self.lam, self.most = spread, lam, most

    def learn(self, now):
        z = auxiliary_z(now.psi, now.p, self.q, now.sigma2, now.eps)
        if now.k == FIRST:
            self.q, self.Pq = START * now.s2, diagonal((self.spread * now.s2) ** 2)
        q, Pq = auxiliary_step(self.q, self.Pq, now.psi, z, now.S, self.lam)
        D = np.minimum(1, ratio(10 * now.s2, np.sqrt(diag(Pq))))
        self.Pq = outer(D, D) * Pq
        return (q if self.most is None else np.clip(q, 0, self.most * now.s2)), now.sigma2
