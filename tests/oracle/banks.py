"""Banks of filters for drifting parameters, dense, many series at once; shares no code with the library.

Sections are those of the theory of adaptive noise: 5.10 the bank, 5.11 interacting models, 5.14 the correction with
outliers, 5.15 the guard at rest. The first axis is always the series, the second the mode; P is in units of the
mode's own sigma^2.
"""

from dataclasses import dataclass, field, fields, replace

import numpy as np
from scipy.special import gammaln

LEVELS = (0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1)


@dataclass
class Bank:
    theta: np.ndarray  # (S, M, n)
    P: np.ndarray  # (S, M, n, n)
    w: np.ndarray  # (S, M)
    nu: np.ndarray  # (S, M)
    s2: np.ndarray  # (S, M)

    def at(self, rows):
        return Bank(*(getattr(self, f.name)[rows].copy() for f in fields(self)))

    def put(self, rows, other):
        for f in fields(self):
            getattr(self, f.name)[rows] = getattr(other, f.name)


@dataclass
class Units:
    """ms of 1.5: the running mean square of each regressor, with its floor and the guard of 5.15."""

    n: int
    floor: float = 0.01  # of the largest ms so far
    absolute: float = 0.0
    guard: bool = True
    ms: np.ndarray = field(default_factory=lambda: np.zeros((1, 1)))
    most: np.ndarray = field(default_factory=lambda: np.zeros((1, 1)))
    level: np.ndarray = field(default_factory=lambda: np.zeros(1))
    moving: np.ndarray = field(default_factory=lambda: np.zeros(1))

    def see(self, k, psi, seen):
        """1/ms_i, zero until regressor i was seen, and whether the plant is at rest."""
        power = np.sum(psi**2, axis=1)
        rest = seen & self.guard & (k > 4 * self.n) & (power < 0.01 * self.level)
        learn = seen & ~rest
        self.moving = self.moving + learn
        self.level = self.level + learn * np.maximum(1 / np.maximum(self.moving, 1), 0.005) * (power - self.level)
        self.ms = self.ms + learn[:, None] * max(1 / (k + 1), 0.005) * (psi**2 - self.ms)
        self.most = np.maximum(self.most, self.ms)
        ms = np.maximum(np.maximum(self.ms, self.floor * self.most), self.absolute)
        return np.where(ms > 0, 1 / np.where(ms > 0, ms, 1), 0.0), rest


def start(S, M, n, P0, told, w=None):
    w = np.full(M, 1 / M) if w is None else w
    P = np.tile(P0 / told * np.eye(n), (S, M, 1, 1))
    return Bank(np.zeros((S, M, n)), P, np.tile(w, (S, 1)), np.ones((S, M)), np.full((S, M), float(told)))


def log_density(e, V, nu, learnt):
    """Student-t with squared scale V, or normal with variance V."""
    if not learnt:
        return -0.5 * (np.log(2 * np.pi * V) + e**2 / V)
    constant = gammaln((nu + 1) / 2) - gammaln(nu / 2) - 0.5 * np.log(np.pi * nu * V)
    return constant - (nu + 1) / 2 * np.log1p(e**2 / (nu * V))


def project(b, psi):
    Pp = np.einsum("smij,sj->smi", b.P, psi)
    return np.einsum("smi,si->sm", b.theta, psi), Pp, np.einsum("smi,si->sm", Pp, psi) + 1


def normalised(w, floor):
    w = np.maximum(w / w.sum(axis=1, keepdims=True), floor)
    return w / w.sum(axis=1, keepdims=True)


def forecast(b, psi, learnt):
    """Mean and variance of y before it is seen."""
    yhat, _, St = project(b, psi)
    c = np.where(b.nu > 4, b.nu / np.where(b.nu > 4, b.nu - 2, 1), 2.0) if learnt else 1.0
    mean = np.sum(b.w * yhat, axis=1)
    return mean, np.sum(b.w * (c * St * b.s2 + (yhat - mean[:, None]) ** 2), axis=1)


def update(b, psi, y, learnt=True, pi=0.0, kappa=400.0, discount=0.995, floor=1e-6, rest=False):
    """Correct every mode with one sample; the log evidence beside the new bank."""
    yhat, Pp, St = project(b, psi)
    e, St2 = y[:, None] - yhat, St + kappa - 1
    with np.errstate(divide="ignore"):
        l1 = np.log1p(-pi) + log_density(e, St * b.s2, b.nu, learnt)
        l2 = np.log(pi) + log_density(e, St2 * b.s2, b.nu, learnt)
        logp = np.logaddexp(l1, l2) + np.log(b.w)
    rho = np.exp(l2 - np.logaddexp(l1, l2))
    K, K2 = Pp / St[..., None], Pp / St2[..., None]
    Kb = (1 - rho)[..., None] * K + rho[..., None] * K2
    spread = (rho * (1 - rho) * e**2 / b.s2)[..., None, None] * outer(K - K2, K - K2)
    P = b.P - outer(Kb, Pp) + spread
    most = logp.max(axis=1, keepdims=True)
    p = np.exp(logp - most)
    nu, s2 = b.nu, b.s2
    if learnt:
        moves = ~np.broadcast_to(rest, y.shape)[:, None]
        count = discount * b.nu + 1 - rho
        d = discount * b.nu * b.s2 + (1 - rho) * e**2 / St
        nu, s2 = np.where(moves, np.minimum(count, 200.0), nu), np.where(moves, d / count, s2)
    evidence = most[:, 0] + np.log(p.sum(axis=1))
    theta = b.theta + Kb * e[..., None]
    return Bank(theta, (P + P.swapaxes(-1, -2)) / 2, normalised(p, floor), nu, s2), evidence


def outer(a, b):
    return a[..., :, None] * b[..., None, :]


def moments(b):
    """theta_f, P_f and sigma^2 of the mixture."""
    theta = np.einsum("sm,smi->si", b.w, b.theta)
    off = b.theta - theta[:, None]
    P = np.einsum("sm,smij->sij", b.w, b.s2[..., None, None] * b.P + outer(off, off))
    return theta, P, np.sum(b.w * b.s2, axis=1)


def mix(b, A):
    """Interacting models (5.11): every mode starts from the mixture that may have turned into it."""
    c = b.w @ A
    mu = b.w[:, :, None] * A / c[:, None, :]
    theta = np.einsum("sij,sip->sjp", mu, b.theta)
    s2, nu = np.einsum("sij,si->sj", mu, b.s2), np.einsum("sij,si->sj", mu, b.nu)
    off = b.theta[:, :, None] - theta[:, None]
    P = np.einsum("sij,sipq->sjpq", mu, b.s2[..., None, None] * b.P) + np.einsum("sij,sijp,sijq->sjpq", mu, off, off)
    return Bank(theta, P / s2[..., None, None], c, nu, s2)


def staying(M, stay):
    """Transition matrix: stay, the rest shared equally."""
    A = np.full((M, M), (1 - stay) / (M - 1))
    np.fill_diagonal(A, stay)
    return A


def staying_with_jump(M, stay=0.995, jump=0.0005, back=0.1):
    """The same for M modes of which the last is the jump mode."""
    A = np.full((M, M), (1 - stay) / (M - 2))
    np.fill_diagonal(A, stay - jump)
    A[:, -1], A[-1, :], A[-1, -1] = jump, (1 - back) / (M - 1), back
    return A


def forget(b, power, floor):
    return replace(b, w=normalised(normalised(b.w**power, 0), floor))


def predict(b, phi, alm):
    """Time update with the NVR of every mode over ms (S, M, n)."""
    P = b.P * outer(phi, phi)
    i = np.arange(len(phi))
    P[..., i, i] += alm
    return replace(b, theta=b.theta * phi, P=P)


def where(seen, a, b):
    def pick(x, y):
        return np.where(seen.reshape((-1,) + (1,) * (x.ndim - 1)), x, y)

    return Bank(*(pick(getattr(a, f.name), getattr(b, f.name)) for f in fields(Bank)))


@dataclass
class Run:
    """What a run over records leaves: (S, T, ..) arrays, and for AUTO-C its events (series, sample, kind)."""

    theta: np.ndarray
    P: np.ndarray  # diagonal
    eps: np.ndarray
    S: np.ndarray
    s2: np.ndarray
    w: np.ndarray
    events: list
    evidence: np.ndarray

    @classmethod
    def of(cls, S, T, n, M):
        def blank(*shape):
            return np.full((S, T, *shape), np.nan)

        return cls(blank(n), blank(n), blank(), blank(), blank(), blank(M), [], blank())

    def write(self, k, bank):
        theta, P, self.s2[:, k] = moments(bank)
        self.theta[:, k], self.P[:, k] = theta, np.diagonal(P, axis1=1, axis2=2)
        self.w[:, k] = bank.w
        return theta, P


def run_bank(y, psi, phi, told, levels=LEVELS, learnt=True, A=None, w=None, P0=1000.0, floor=1e-6, units=None):
    """Bank with forgetting .99 (5.10), or interacting with the transition matrix A (5.11)."""
    S, T, n = psi.shape
    units = units or Units(n, floor=0.0, absolute=1e-8, guard=False)
    b, out = start(S, len(levels), n, P0, told, w), Run.of(S, T, n, len(levels))
    levels, inverse = np.array(levels)[:, None], np.zeros((S, n))
    for k in range(T):
        seen = np.isfinite(y[:, k]) & np.isfinite(psi[:, k]).all(axis=1)
        yk, row = np.where(seen, y[:, k], 0), np.where(seen[:, None], psi[:, k], 0)
        over, rest = units.see(k, row, seen)
        inverse = np.where(seen[:, None], over, inverse)
        mean, out.S[:, k] = forecast(b, row, learnt)
        out.eps[:, k] = np.where(seen, yk - mean, np.nan)
        new, out.evidence[:, k] = update(b, row, yk, learnt, floor=floor, rest=rest)
        b = where(seen, new, b)
        out.write(k, b)
        moved = forget(b, 0.99, floor) if A is None else mix(b, A)
        b = predict(where(seen, moved, b), phi, levels * inverse[:, None])
    return out
