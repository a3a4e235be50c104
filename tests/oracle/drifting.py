"""Filters of drifting parameters with unknown noise: plain NumPy, dense P, a leading axis of series.

    y(k) = psi(k)' theta(k) + e(k),   theta(k+1) = Phi theta(k) + w(k),   Phi diagonal                       (C1)-(C4)

`run` is the recursion C10-C12; what is learnt is a `Policy`, whose
`step(sample)` returns Q(k) (a diagonal (S, n), or full (S, n, n)) and sigma^2(k + 1), and may replace `theta_f`
and `P_f` in the sample. A row is missing for all series at once; it moves time and nothing else, k counts the others.
`drifting_matching` and `drifting_learnt` hold the longer policies.
"""

from dataclasses import dataclass, field

import numpy as np


def dot(a, b):
    return (a * b).sum(-1)


def times(P, x):
    return np.einsum("...ij,...j->...i", P, x)


def outer(a, b):
    return a[..., :, None] * b[..., None, :]


def diagonal(q):
    return q[..., None] * np.eye(q.shape[-1])


def diag(P):
    return np.diagonal(P, axis1=-2, axis2=-1)


def ratio(a, b):
    """a / b, 0 where b is: what has no unit yet (1.5) does not count."""
    return np.divide(a, b, out=np.zeros_like(b), where=b > 0)


def symmetric(P):
    return (P + np.swapaxes(P, -1, -2)) / 2


class MeanSquare:
    """ms_i and 1/ms_i (1.5), floored at a number or (``relative``) a share of its largest so far; 0 until seen."""

    def __init__(self, floor=1e-8, relative=False):
        self.floor, self.relative, self.ms, self.largest = floor, relative, 0.0, 0.0

    def take(self, psi, k):
        self.ms = self.ms + max(1 / (k + 1), 0.005) * (psi**2 - self.ms)
        self.largest = np.maximum(self.largest, self.ms)

    @property
    def floored(self):
        return np.maximum(self.ms, self.floor * self.largest if self.relative else self.floor)

    @property
    def inverse(self):
        ms = self.floored
        return ratio(1.0, ms)


@dataclass
class Sample:
    """What a policy sees of sample k: before the correction (p), after it (f)."""

    k: int  # rows with data before this one
    t: int  # rows before this one
    psi: np.ndarray
    y: np.ndarray
    phi: np.ndarray
    theta_p: np.ndarray
    P_p: np.ndarray
    sigma2: np.ndarray
    told: np.ndarray
    inverse_ms: np.ndarray
    s2: np.ndarray = field(init=False)  # s_i^2 in units of the told sigma^2
    p: np.ndarray = field(init=False)  # psi' P_p psi
    eps: np.ndarray = field(init=False)
    S: np.ndarray = field(init=False)
    K: np.ndarray = field(init=False)
    theta_f: np.ndarray = field(init=False)
    P_f: np.ndarray = field(init=False)

    def __post_init__(self):
        self.s2 = self.told[:, None] * self.inverse_ms
        self.p = dot(self.psi, times(self.P_p, self.psi))
        self.eps = self.y - dot(self.theta_p, self.psi)
        self.S = self.p + self.sigma2

    def correct(self, R):
        self.K = times(self.P_p, self.psi) / (self.p + R)[:, None]
        self.theta_f = self.theta_p + self.K * self.eps[:, None]
        self.P_f = symmetric(self.P_p - outer(self.K, times(self.P_p, self.psi)))

    @property
    def moved(self):
        """Phi P_f Phi'."""
        return outer(self.phi, self.phi) * self.P_f


@dataclass
class Run:
    """Histories (S, T, ..); `q` is the diagonal of Q(k), `sigma2` the one used at k."""

    theta_p: np.ndarray
    theta_f: np.ndarray
    P_p: np.ndarray
    P_f: np.ndarray
    P_next: np.ndarray
    theta_next: np.ndarray
    eps: np.ndarray
    S: np.ndarray
    q: np.ndarray
    sigma2: np.ndarray

    @property
    def loglik(self):
        """(C14), a value for each series."""
        return -0.5 * np.nansum(
            np.log(2 * np.pi) + np.log(self.S) + self.eps**2 / self.S, -1, where=~np.isnan(self.eps)
        )


def run(policy, y, psi, phi, told, *, theta0=0.0, P0=1000.0, robust=None, published=False, protected=True, ms=None):
    """Return the `Run` over y (S, T), psi (S, T, n); ``published`` is the printed gain without Phi (2.1)."""
    S, T, n = psi.shape
    phi, ms = np.broadcast_to(np.asarray(phi, float), (n,)), MeanSquare() if ms is None else ms
    theta, P = np.zeros((S, n)) + theta0, np.zeros((S, n, n)) + (P0 if np.ndim(P0) else P0 * np.eye(n))
    told = np.zeros(S) + told
    sigma2, Q, k, kept = told, np.zeros((S, n, n)), 0, []
    for t in range(T):
        missing = np.isnan(y[:, t]).any() or np.isnan(psi[:, t]).any()
        if not missing:
            ms.take(psi[:, t], k)
        now = Sample(k, t, psi[:, t], y[:, t], phi, theta, P, sigma2, told, ms.inverse)
        if t == 0:
            policy.init(now)
        if missing:
            now.theta_f, now.P_f, Q = theta, P, policy.coast(now, Q)
        else:
            now.correct(sigma2 if robust is None else robust(now))
            q, sigma2 = policy.step(now)
            Q = allowed(q) if protected else q if q.ndim == 3 else diagonal(q)
            k += 1
        theta = phi * now.theta_f
        if published:
            theta = phi * now.theta_p + now.K * now.eps[:, None]
        before, P = P, symmetric(now.moved + Q)
        kept.append((now.theta_p, now.theta_f, before, now.P_f, P, theta, now.eps, now.S, diag(Q), now.sigma2))
    return Run(*(np.stack(each, axis=1) for each in zip(*kept)))


def allowed(q):
    """The guard of 5.1: q_i >= 0, a full Q symmetric with eigenvalues >= 0."""
    if q.ndim == 2:
        return diagonal(np.maximum(q, 0.0))
    values, vectors = np.linalg.eigh(symmetric(q))
    return np.einsum("sij,sj,skj->sik", vectors, np.maximum(values, 0.0), vectors)


class Policy:
    def init(self, now):
        """At the first row, missing or not."""

    def step(self, now):
        """Return Q(k) and sigma^2(k + 1)."""
        raise NotImplementedError

    def coast(self, now, Q):
        """Return Q(k) of a missing row: the last one."""
        return Q


class Known(Policy):
    """Q given: constant (n,) or a row for each sample (T, n)."""

    def __init__(self, q):
        self.q = np.asarray(q, float)

    def at(self, now):
        return np.zeros_like(now.theta_p) + (self.q if self.q.ndim == 1 else self.q[now.t])

    def step(self, now):
        return self.at(now), now.sigma2

    def coast(self, now, Q):
        return diagonal(self.at(now))


class FixedNVR(Policy):
    """q_i = NVR s_i^2."""

    def __init__(self, nvr=1e-3):
        self.nvr = nvr

    def step(self, now):
        return self.nvr * now.s2, now.sigma2


class Forgetting(Policy):
    """P_p(k+1) = Phi P_f Phi' / lambda (5.2): ``lam`` constant, or with ``N0`` clip(1 - eps^2/(S N0), .8, 1).

    ``cap``: nothing is forgotten where trace P_f/lambda would not stay below it.
    """

    def __init__(self, lam=0.98, N0=None, cap=np.inf):
        self.lam, self.N0, self.cap = lam, N0, cap

    def init(self, now):
        self.used = []

    def step(self, now):
        lam = np.full_like(now.eps, self.lam) if self.N0 is None else np.clip(1 - now.eps**2 / now.S / self.N0, 0.8, 1)
        lam = np.where(diag(now.P_f).sum(-1) / lam < self.cap, lam, 1.0)
        self.used.append(lam)
        return (1 / lam - 1)[:, None, None] * now.moved, now.sigma2


class Directional(Policy):
    """P_p(k+1) = P_f + (1/lambda - 1) psi psi' / (psi' P_f^-1 psi), Phi = I."""

    def __init__(self, lam=0.98):
        self.lam = lam

    def step(self, now):
        information = dot(now.psi, np.linalg.solve(now.P_f, now.psi[..., None])[..., 0])
        part = np.where(information > 1e-10, (1 / self.lam - 1) / np.maximum(information, 1e-10), 0.0)
        return part[:, None, None] * outer(now.psi, now.psi), now.sigma2


def residual_variance(sigma2, p, S, eps, gain):
    """sigma^2 from the residual r = eps sigma^2/S (5.3): always positive."""
    z = (eps * sigma2 / S) ** 2 + sigma2 * p / S
    return sigma2 + gain * (z - sigma2)


class Learning(Policy):
    """ "+R": sigma^2 learnt from residuals beside a policy, which takes the current one as its unit."""

    def __init__(self, policy):
        self.policy = policy

    def init(self, now):
        self.policy.init(now)

    def coast(self, now, Q):
        return self.policy.coast(now, Q)

    def step(self, now):
        now.s2 = now.sigma2[:, None] * now.inverse_ms
        q, _ = self.policy.step(now)
        learnt = residual_variance(now.sigma2, now.p, now.S, now.eps, max(0.02, 1 / (now.k + 6)))
        return q, np.maximum(learnt, 1e-12)


def fuzzy_table(x1, x2, levels=(1e-4, 1e-2, 1.0), e0=1.0, e1=3.0, d1=1.0, geometric=False):
    """alpha_i of the rules {small or large |eps|} x {zero or not increment}, product AND, weighted mean (5.4)."""
    m, d = np.clip((x1 - e0) / (e1 - e0), 0, 1), np.minimum(1, np.abs(x2) / d1)
    weights = (1 - m) * (1 - d), (1 - m) * d + m * (1 - d), m * d
    if geometric:
        return np.exp(sum(w * np.log(max(level, 1e-12)) for w, level in zip(weights, levels)))
    return sum(w * level for w, level in zip(weights, levels))


class Fuzzy(Policy):
    """The rule of 5.4: inputs of the sample before and increments of theta_p, or (``delayed=False``) K eps now."""

    def __init__(self, levels=(1e-4, 1e-2, 1.0), e0=1.0, e1=3.0, d1=1.0, geometric=False, delayed=True):
        self.table, self.delayed = dict(levels=levels, e0=e0, e1=e1, d1=d1, geometric=geometric), delayed

    def init(self, now):
        self.inputs, self.theta_before = None, np.zeros_like(now.theta_p)

    def step(self, now):
        increment = now.theta_p - self.theta_before if self.delayed else now.K * now.eps[:, None]
        x1, x2 = np.abs(now.eps) / np.sqrt(now.S), ratio(increment, np.sqrt(now.s2))
        used = self.inputs if self.delayed and self.inputs is not None else (x1, x2)
        self.inputs, self.theta_before = (x1, x2), now.theta_p
        return fuzzy_table(used[0][:, None], used[1], **self.table) * now.s2, now.sigma2


def hard_gate(now):
    return np.where(np.abs(now.eps) > 3 * np.sqrt(now.S), 1e12, now.sigma2)


def huber(now):
    w = np.minimum(1, 2 * np.sqrt(now.S) / np.maximum(np.abs(now.eps), 1e-300))
    return np.maximum(now.S / w - now.p, now.sigma2)


def student(now, nu=4):
    lam = np.ones_like(now.eps)
    for _ in range(4):
        R = now.sigma2 / lam
        r = now.eps * R / (now.p + R)
        lam = (nu + 1) / (nu + (r**2 + now.p * R / (now.p + R)) / now.sigma2)
    return now.sigma2 / lam
