"""Banks of filters for drifting parameters, dense, many series at once; shares no code with the library.

Sections are those of the theory of adaptive noise: 5.10 the bank, 5.11 interacting models, 5.14 the correction with
outliers, 5.15 the guard at rest. The first axis is always the series, the second the mode; P is in units of the
mode's own sigma^2.
"""

from dataclasses import dataclass, fields, replace

import numpy as np
from scipy.special import gammaln

LEVELS = (0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1)


@dataclass
class Bank:
    theta: np.ndarray  # (S, M, n)
    P: np.ndarray  # (S, M, n, n)
    w: np.ndarray  # (S, M)
    nu: np.ndarray  # (S, M)
    chi2: np.ndarray  # (S, M)

    @property
    def s2(self):
        """sigma^2 of each mode: counts as 1 until it has a degree of freedom."""
        ready = self.nu >= 1
        return np.where(ready, self.chi2 / np.where(ready, self.nu, 1), 1.0)

    def at(self, rows):
        return Bank(*(getattr(self, f.name)[rows].copy() for f in fields(self)))

    def put(self, rows, other):
        for f in fields(self):
            getattr(self, f.name)[rows] = getattr(other, f.name)


@dataclass
class Units:
    """ms of 1.5: the running mean square of each regressor, with its floor, and the guard of 5.15.

    At rest: all regressors together below a hundredth of what they usually are, each in units of its own. ms then
    moves a hundred times slower. Rows that are missing or at rest do not count.
    """

    S: int
    n: int
    floor: float = 0.01  # of the largest ms so far
    absolute: float = 0.0
    guard: bool = True

    def __post_init__(self):
        self.ms, self.most, self.count = np.zeros((self.S, self.n)), np.zeros((self.S, self.n)), np.zeros(self.S)

    def see(self, psi, seen):
        """1/ms_i, zero until regressor i was seen, and whether the plant is at rest."""
        size = np.sum(np.divide(psi**2, self.ms, out=np.zeros_like(psi), where=self.ms > 0), axis=1)
        rest = seen & self.guard & (self.count > 4 * self.n) & (size < 0.01 * self.n)
        gain = np.where(rest, 0.00005, np.maximum(1 / (self.count + 1), 0.005))
        self.ms = self.ms + np.where(seen, gain, 0)[:, None] * (psi**2 - self.ms)
        self.count = self.count + (seen & ~rest)
        self.most = np.maximum(self.most, self.ms)
        ms = np.maximum(np.maximum(self.ms, self.floor * self.most), self.absolute)
        return np.divide(1.0, ms, out=np.zeros_like(ms), where=ms > 0), rest


@dataclass
class Taken:
    """What each mode (S, M) made of a sample: its error, relative variance, sigma^2 and the odds of an outlier."""

    e: np.ndarray
    St: np.ndarray
    s2: np.ndarray
    rho: np.ndarray
    evidence: np.ndarray  # (S,)


def start(S, M, n, P0, nu=1.0, chi2=1.0, w=None):
    """P0 is relative to sigma^2; the reference prior has nu = 1 - n, chi2 = 0."""
    w = np.full(M, 1 / M) if w is None else w
    P = np.tile(P0 * np.eye(n), (S, M, 1, 1))
    return Bank(np.zeros((S, M, n)), P, np.tile(w, (S, 1)), np.full((S, M), float(nu)), np.full((S, M), float(chi2)))


def log_density(e, V, nu, learnt):
    """Student-t with squared scale V, or normal with variance V."""
    if not learnt:
        return -0.5 * (np.log(2 * np.pi * V) + e**2 / V)
    half = np.asarray(nu / 2, float)
    constant = gammaln(half + 0.5) - gammaln(half) - 0.5 * np.log(np.pi * nu * V)
    return constant - (nu + 1) / 2 * np.log1p(e**2 / (nu * V))


def project(b, psi):
    Pp = np.einsum("smij,sj->smi", b.P, psi)
    return np.einsum("smi,si->sm", b.theta, psi), Pp, np.einsum("smi,si->sm", Pp, psi) + 1


def normalised(w, floor):
    w = np.maximum(w / w.sum(axis=1, keepdims=True), floor)
    return w / w.sum(axis=1, keepdims=True)


def forecast(b, psi, learnt, heavy=True):
    """Mean and variance of y before it is seen; not `heavy`: without what the tails of Student's t add."""
    yhat, _, St = project(b, psi)
    c = np.where(b.nu > 4, b.nu / np.where(b.nu > 4, b.nu - 2, 1), 2.0) if learnt and heavy else 1.0
    mean = np.sum(b.w * yhat, axis=1)
    return mean, np.sum(b.w * (c * St * b.s2 + (yhat - mean[:, None]) ** 2), axis=1)


def update(b, psi, y, learnt=True, pi=0.0, kappa=400.0, discount=0.995, floor=1e-6, rest=False):
    """Correct every mode with one sample; until all of them know a sigma^2, and at rest, the weights stay."""
    yhat, Pp, St = project(b, psi)
    e, s2 = y[:, None] - yhat, b.s2
    St2 = St + np.maximum(kappa - 1, e**2 / s2 - 1)
    ready, nu = b.nu >= 1, np.maximum(b.nu, 1.0)
    with np.errstate(divide="ignore"):
        l1 = np.log1p(-pi) + log_density(e, St * s2, nu, learnt)
        l2 = np.log(pi) + log_density(e, St2 * s2, nu, learnt)
    both = np.logaddexp(l1, l2)
    rho = np.where(ready, np.exp(l2 - both), 0.0)
    logp = np.where(ready.all(axis=1, keepdims=True), both, 0.0) + np.log(b.w)
    K, K2 = Pp / St[..., None], Pp / St2[..., None]
    Kb = (1 - rho)[..., None] * K + rho[..., None] * K2
    spread = (rho * (1 - rho) * e**2 / s2)[..., None, None] * outer(K - K2, K - K2)
    P = b.P - outer(Kb, Pp) + spread
    most = logp.max(axis=1, keepdims=True)
    p = np.exp(logp - most)
    nu, chi2 = b.nu, b.chi2
    if learnt:
        moves = ~np.broadcast_to(rest, y.shape)[:, None]
        nu = np.where(moves, discount * nu + 1 - rho, nu)
        chi2 = np.where(moves, discount * chi2 + (1 - rho) * e**2 / St, chi2)
    taken = Taken(e, St, s2, rho, most[:, 0] + np.log(p.sum(axis=1)))
    theta = b.theta + Kb * e[..., None]
    w = np.where(np.broadcast_to(rest, y.shape)[:, None], b.w, normalised(p, floor))
    return Bank(theta, (P + P.swapaxes(-1, -2)) / 2, w, nu, chi2), taken


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
    chi2 = np.where(nu >= 1, s2 * nu, np.einsum("sij,si->sj", mu, b.chi2))
    return Bank(theta, P / s2[..., None, None], c, nu, chi2)


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


def predict(b, phi, alm, cap=np.inf, mixed=False):
    """Time update with the NVR of every mode over ms (S, M, n); no variance beyond its cap.

    After mixing it is taken down to its cap, by D P D; otherwise what is added finds no room beyond.
    """
    P = b.P * outer(phi, phi)
    i = np.arange(len(phi))
    D = P[..., i, i]
    mixed = np.broadcast_to(mixed, len(P))[:, None, None]
    P[..., i, i] += np.where(mixed, alm, np.minimum(alm, np.maximum(cap - D, 0)))
    size = np.where(mixed, np.sqrt(np.minimum(1, cap / np.maximum(P[..., i, i], 1e-300))), 1)
    return replace(b, theta=b.theta * phi, P=P * outer(size, size))


def where(seen, a, b):
    def pick(x, y):
        return np.where(seen.reshape((-1,) + (1,) * (x.ndim - 1)), x, y)

    return Bank(*(pick(getattr(a, f.name), getattr(b, f.name)) for f in fields(Bank)))


@dataclass
class Run:
    """What a run over records leaves: (S, T, ..) arrays, and for `AutoMemory` its events (series, sample, kind)."""

    theta: np.ndarray
    P: np.ndarray  # diagonal
    eps: np.ndarray
    S: np.ndarray
    s2: np.ndarray
    nu: np.ndarray
    w: np.ndarray
    events: list
    evidence: np.ndarray
    odds: np.ndarray

    @classmethod
    def of(cls, S, T, n, M):
        def blank(*shape):
            return np.full((S, T, *shape), np.nan)

        return cls(blank(n), blank(n), blank(), blank(), blank(), blank(), blank(M), [], blank(), np.zeros((S, T)))

    def write(self, k, bank):
        theta, P, self.s2[:, k] = moments(bank)
        self.theta[:, k], self.P[:, k] = theta, np.diagonal(P, axis1=1, axis2=2)
        self.w[:, k], self.nu[:, k] = bank.w, np.sum(bank.w * bank.nu, axis=1)


def run_bank(y, psi, phi, first, levels=LEVELS, learnt=True, A=None, floor=1e-6, units=None, cap=np.inf):
    """Bank with forgetting .99 (5.10) from the bank `first`, or interacting with the transition matrix A (5.11)."""
    S, T, n = psi.shape
    units = units or Units(S, n)
    b, out = first, Run.of(S, T, n, len(levels))
    levels, inverse = np.array(levels)[:, None], np.zeros((S, n))
    for k in range(T):
        seen = np.isfinite(y[:, k])
        yk, row = np.where(seen, y[:, k], 0), psi[:, k]
        over, rest = units.see(row, seen)
        inverse = np.where(seen[:, None], over, inverse)
        mean, out.S[:, k] = forecast(b, row, learnt, heavy=False)
        out.eps[:, k] = np.where(seen, yk - mean, np.nan)
        new, taken = update(b, row, yk, learnt, floor=floor, rest=rest)
        out.evidence[:, k] = taken.evidence
        b = where(seen, new, b)
        out.write(k, b)
        moved = forget(b, 0.99, floor) if A is None else mix(b, A)
        b = predict(where(seen, moved, b), phi, levels * inverse[:, None], cap, seen & (A is not None))
    return out
