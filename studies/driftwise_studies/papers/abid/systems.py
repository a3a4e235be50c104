"""The test systems of drifting and jumping parameters, many records at once, one generator for each seed.

    y(k) = psi(k)' theta(k) + e(k),   theta(k+1) = Phi theta(k) + w(k),   e ~ N(0, 0.02),   zero before k = 0

| name | model | parameters |
|---|---|---|
| a | ARX(2,2), square wave | the paper's: Phi = diag(.5, .3, 1, .09), q = 1e-3 (option ``q``) |
| b | ARX(2,2), +-1 white | sines |
| c | FIR(4), AR(1) input | random walks of unequal speed |
| d, e | ARX(2,2), +-1 white | constant with two jumps; constant |
| f10, f01 | c | as c, but the filter is told a variance 10 times too large, too small |
| g | FIR(4), AR(1) input | random walks that are fast for 200 <= k < 400 |
| rest | ARX(2,2) | constant; no input for 200 <= k < 1200, and no noise before 1195 |
| missing | ARX(2,2), +-1 white | constant; a tenth of the outputs is missing (option ``share``) |
| louder | ARX(2,2), +-1 white | constant; the noise is three times as large from 300 on |
| collinear | four regressors, two nearly equal | constant (option ``sigma2``) |

``dirty=True`` adds an outlier of 20 standard deviations to 3 % of the outputs of c, d and e; regressors stay clean.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from driftwise.engine.errors import InputError

SIGMA2 = 0.02
NAMES = ("a", "b", "c", "d", "e", "f10", "f01", "g", "rest", "missing", "collinear", "louder")
RANKED = NAMES[:8]  # the cases policies are compared on
PLANT = np.array([-1.2, 0.5, 1.0, 0.5])  # of `rest` and `missing`


@dataclass(frozen=True)
class System:
    """Records of one test system, a row for each seed, with the truth."""

    name: str
    y: np.ndarray  # (S, T), NaN where missing
    u: np.ndarray  # (S, T, 1) for ARX(2, 2), (S, T, 4) for a regression on psi itself
    psi: np.ndarray  # (S, T, n), NaN where it needs a missing output
    theta: np.ndarray  # (S, T, n), true parameters in the order of psi: a1 a2 b1 b2
    phi: np.ndarray  # (n,), the diagonal of Phi
    q: np.ndarray  # (T, n), the reference's Q: q[k] acts from k to k + 1
    sigma2: float  # variance of e (outside the rest of `rest`)
    told: float  # the variance the filter is told
    reference: tuple[float, float] | None = None  # RMSE of parameters and prediction from sample 50 on, 200 seeds
    jumps: tuple[int, ...] = ()  # samples at which the parameters are new


def system(name: str, seeds: int | range, **options) -> System:
    """Return the records of a test system.

    Parameters
    ----------
    name : one of ``NAMES``
    seeds : how many, or which; a seed gives the same record whatever the others are
    **options : ``q`` of a, ``dirty`` of c, d and e, ``share`` of missing, ``sigma2`` of collinear

    Raises
    ------
    InputError
        Where there is no such system, option or seed.

    Examples
    --------
    >>> from driftwise_studies.papers.abid.systems import system
    >>> few, many = system("d", 2), system("d", range(1, 30))
    >>> few.y.shape, few.theta.shape, bool((few.y[1] == many.y[0]).all())
    ((2, 600), (2, 600, 4), True)
    """
    allowed = {
        "a": {"q"},
        "c": {"dirty"},
        "d": {"dirty"},
        "e": {"dirty"},
        "missing": {"share"},
        "collinear": {"sigma2"},
    }
    if name not in NAMES:
        raise InputError(f"there is no test system called {name!r}; there are: {', '.join(NAMES)}")
    if wrong := sorted(set(options) - allowed.get(name, set())):
        raise InputError(f"system {name!r} has the options {sorted(allowed.get(name, set()))}, got {wrong}")
    chosen = range(seeds) if isinstance(seeds, int) else seeds
    if len(chosen) == 0 or min(chosen) < 0:
        raise InputError(f"seeds must be a number of them, at least 1, or a range from 0 or later, got {seeds!r}")
    family = NAMES.index("c") if name in ("f10", "f01") else NAMES.index(name)
    streams = [np.random.default_rng([seed, family]) for seed in chosen]
    dirty = options.pop("dirty", False)
    made = BUILD[name](streams, **options)
    return with_outliers(made, [np.random.default_rng([seed, family, 1]) for seed in chosen]) if dirty else made


def drawn(streams, what: Callable[[np.random.Generator], Any]) -> np.ndarray:
    """Return one draw for each seed, stacked."""
    return np.stack([what(rng) for rng in streams])


def white(streams, T, scale=np.sqrt(SIGMA2)):
    return scale * drawn(streams, lambda rng: rng.standard_normal(T))


def signs(streams, T):
    """Return the +-1 white input."""
    return drawn(streams, lambda rng: rng.choice([-1.0, 1.0], T))


def walk(streams, theta0, phi, q):
    """Return theta (S, T, n) of theta(k+1) = Phi theta(k) + w(k), w(k) ~ N(0, diag q[k])."""
    w = np.sqrt(q) * white(streams, q.shape, 1.0)
    theta = np.empty_like(w)
    theta[:, 0] = theta0
    for k in range(len(q) - 1):
        theta[:, k + 1] = phi * theta[:, k] + w[:, k]
    return theta


def stable_set(rng) -> np.ndarray:
    """Return [a1 a2 b1 b2] with poles r exp(+-i w)."""
    r, w = rng.uniform(0.3, 0.85), rng.uniform(0.2, 2.5)
    return np.array([-2 * r * np.cos(w), r * r, *(rng.uniform(0.5, 1.5, 2) * rng.choice([-1.0, 1.0], 2))])


def arx(theta, u, e):
    """Return y (S, T) and psi (S, T, 4) = [-y(k-1) -y(k-2) u(k-1) u(k-2)] from rest."""
    records, T, _ = theta.shape
    y, psi = np.zeros((records, T)), np.zeros((records, T, 4))
    for lag in (1, 2):
        psi[:, lag:, 1 + lag] = u[:, :-lag]
    for k in range(T):
        for lag in range(1, min(k, 2) + 1):
            psi[:, k, lag - 1] = -y[:, k - lag]
        y[:, k] = np.einsum("sn,sn->s", psi[:, k], theta[:, k]) + e[:, k]
    return y, psi


def coloured_lags(streams, T):
    """Return psi (S, T, 4) = u(k), .. u(k-3) of u(k+1) = .5 u(k) + sqrt(.75) N(0, 1), stationary from k = 0 on."""
    u = white(streams, T, 1.0)
    for k in range(1, T):
        u[:, k] = 0.5 * u[:, k - 1] + np.sqrt(0.75) * u[:, k]
    psi = np.zeros((*u.shape, 4))
    for lag in range(4):
        psi[:, lag:, lag] = u[:, : T - lag]
    return psi


def constant(q, T=600):
    """Return the same Q at every sample, (T, 4)."""
    return np.broadcast_to(np.asarray(q, float), (T, 4)).copy()


def recursive(name, theta, u, e, *, q, phi=np.ones(4), **more) -> System:
    y, psi = arx(theta, u, e)
    return System(name, y, u[..., None], psi, theta, np.asarray(phi, float), q, SIGMA2, SIGMA2, **more)


def a(streams, q=1e-3):
    phi, q = np.array([0.5, 0.3, 1.0, 0.09]), constant(q)
    square = np.where(np.arange(600) % 20 < 10, 2.0, -2.0)
    theta = walk(streams, [0.0, 0.0, 1.0, 0.0], phi, q)
    known = (0.0382, 0.2214) if q[0, 0] == 1e-3 else None
    return recursive("a", theta, np.tile(square, (len(streams), 1)), white(streams, 600), q=q, phi=phi, reference=known)


def b(streams):
    t = np.arange(600) + drawn(streams, lambda rng: rng.integers(600))[:, None]
    swing = ((-1, 0.25, 400, 0), (0.4, 0.1, 250, 1), (1, 0.5, 300, 2), (0.5, 0.3, 600, 0))
    theta = np.stack(
        [mean + size * np.sin(2 * np.pi * t / period + start) for mean, size, period, start in swing], axis=-1
    )
    q = constant([2.83e-4, 1.70e-4, 1.212e-3, 2.74e-4])
    return recursive("b", theta, signs(streams, 600), white(streams, 600), q=q, reference=(0.0483, 0.1803))


def fir(name, streams, q, told, reference):
    psi = coloured_lags(streams, 600)
    theta = walk(streams, white(streams, 4, 1.0), 1.0, q)
    y = np.einsum("stn,stn->st", psi, theta) + white(streams, 600)
    return System(name, y, psi, psi, theta, np.ones(4), q, SIGMA2, told, reference)


def c(streams):
    return fir("c", streams, constant([1e-3, 1e-4, 1e-5, 0.0]), SIGMA2, (0.0442, 0.1658))


def f10(streams):
    return replace(c(streams), name="f10", told=10 * SIGMA2, reference=(0.0441, 0.1661))


def f01(streams):
    return replace(c(streams), name="f01", told=SIGMA2 / 10, reference=(0.0441, 0.1661))


def d(streams):
    jumps = (200, 400)
    theta = np.repeat(np.stack([drawn(streams, stable_set) for _ in range(3)], axis=1), 200, axis=1)
    q = constant([2.60e-3, 2.82e-4, 8.76e-3, 1.070e-2])
    made = recursive("d", theta, signs(streams, 600), white(streams, 600), q=q, reference=(0.1284, 0.3592))
    return replace(made, jumps=jumps)


def e(streams):
    theta = np.repeat(drawn(streams, stable_set)[:, None], 600, axis=1)
    return recursive("e", theta, signs(streams, 600), white(streams, 600), q=constant(0.0), reference=(0.0136, 0.1428))


def g(streams):
    q = constant(1e-6)
    q[200:400] = 1e-3
    return fir("g", streams, q, SIGMA2, (0.0509, 0.1724))


def rest(streams):
    T, k = 1400, np.arange(1400)
    u = np.where((k >= 200) & (k < 1200), 0.0, signs(streams, T))
    noise = np.where((k >= 200) & (k < 1195), 1e-3, 1.0) * white(streams, T)
    return recursive("rest", np.tile(PLANT, (len(streams), T, 1)), u, noise, q=constant(0.0, T))


def missing(streams, share=0.1):
    theta = np.tile(PLANT, (len(streams), 600, 1))
    made = recursive("missing", theta, signs(streams, 600), white(streams, 600), q=constant(0.0))
    gone = drawn(streams, lambda rng: rng.uniform(size=600)) < share
    psi = made.psi.copy()
    for lag in (1, 2):
        psi[:, lag:, lag - 1][gone[:, :-lag]] = np.nan
    return replace(made, y=np.where(gone, np.nan, made.y), psi=psi)


def collinear(streams, sigma2=1e-2):
    T = 300
    psi = white(streams, (T, 4), 1.0)
    psi[..., 1] = psi[..., 0] + 1e-4 * psi[..., 1]
    theta = np.repeat(white(streams, 4, 1.0)[:, None], T, axis=1)
    y = np.einsum("stn,stn->st", psi, theta) + white(streams, T, np.sqrt(sigma2))
    return System("collinear", y, psi, psi, theta, np.ones(4), constant(0.0, T), sigma2, sigma2)


def louder(streams):
    theta = np.repeat(drawn(streams, stable_set)[:, None], 600, axis=1)
    noise = np.where(np.arange(600) < 300, 1.0, 3.0) * white(streams, 600)
    return recursive("louder", theta, signs(streams, 600), noise, q=constant(0.0))


def with_outliers(clean: System, streams) -> System:
    """Return the system with N(0, (20 sigma)^2) added to an output with probability 0.03; the lags stay clean."""
    T = clean.y.shape[1]
    size = white(streams, T, 20 * np.sqrt(clean.sigma2))
    struck = drawn(streams, lambda rng: rng.uniform(size=T)) < 0.03
    return replace(clean, name=f"{clean.name} dirty", y=clean.y + size * struck, reference=None)


BUILD: dict[str, Callable[..., System]] = {
    "a": a, "b": b, "c": c, "d": d, "e": e, "f10": f10, "f01": f01, "g": g,
    "rest": rest, "missing": missing, "collinear": collinear, "louder": louder,
}  # fmt: skip
