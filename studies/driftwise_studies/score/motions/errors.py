"""How plots of a drawn scene err, as laws: what a plot says of where an object is; see `simulation.seen`.

A plot is z = p + error, the error of one coordinate normal or Student's of 3, wild ones of both coordinates at once;
on a lattice only the cell of z is seen. A Gaussian state that is seen so stays one by its mean and covariance (Minka
2001).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import gammainc, gammaincinv, ndtr

from .scene import Scene
from .simulation import WILDEST

LEVELS = np.array(
    [0.0, 3e-4, 3e-3, 0.02, 0.1, 0.3, 0.6, 1.0]
)  # of the precision of Student's, in parts of one variance
SIZES = 4  # of wild plots


class Errors(NamedTuple):
    """Of each plot of one object: what is known of its error beforehand."""

    deviation: np.ndarray  # (T,) of one that is not wild
    wild: np.ndarray  # (T,) probability
    size: np.ndarray  # (T,) the deviation of which wild plots are multiples
    heavy: bool = False
    lattice: float = 0.0


def alike(n: int, deviation: float) -> Errors:
    """Return errors that have no trouble."""
    return Errors(np.full(n, deviation), np.zeros(n), np.full(n, deviation))


def known(scene: Scene, sensor: np.ndarray, variance: np.ndarray, wild: np.ndarray) -> Errors:
    """Return the law of each plot's error, from the variance with which it was drawn; see `simulate(stated=True)`."""
    size = np.array([scene.sensors[k].deviation for k in sensor])
    offset2 = np.array([np.hypot(*scene.sensors[k].offset) ** 2 / 2 for k in sensor])
    own = np.sqrt(np.maximum(variance - scene.lattice**2 / 12 - offset2, 0.0))
    for k in np.flatnonzero(wild).tolist():  # that of the last plot of the sensor that is not
        before = np.flatnonzero((sensor[:k] == sensor[k]) & ~wild[:k])
        own[k] = own[before[-1]]
    chance = np.full(len(own), scene.wild)
    for which in range(len(scene.sensors)):
        chance[np.flatnonzero(sensor == which)[:3]] = 0.0
    return Errors(own, chance, size, scene.heavy, scene.lattice)


def scales(heavy: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return shares and variances of the Gaussians of which an error of variance one is made."""
    if not heavy:
        return np.ones(1), np.ones(1)
    share = np.diff(LEVELS)
    edges = gammaincinv(1.5, LEVELS)
    return share, np.diff(gammainc(0.5, edges)) / share  # E[1 / (3 precision)] in each part


class Seen(NamedTuple):
    """What a plot is to particles."""

    log: np.ndarray  # its log density
    x: np.ndarray  # state and covariance with it
    P: np.ndarray
    mean: np.ndarray  # (N, 2) of a plot that is not wild, before it was seen; and its variance
    variance: np.ndarray
    below: np.ndarray  # (N, 2) share of that forecast below the plot, above it
    above: np.ndarray


def gauss(z):
    """Return the density of N(0, 1)."""
    return np.exp(-0.5 * z * z) / np.sqrt(2 * np.pi)


def cell(e, s, lattice: float, within: float):
    """Return, of z ~ N(0, s^2) in a cell about e: probability, mean, variance; the share below and above a place in it.

    ``within``, uniform in 0 to 1, says which: of a cell that is drawn by its probability the share below is uniform.
    """
    flip = np.where(e > 0, -1.0, 1.0)
    a, b = (flip * e - 0.5 * lattice) / s, (flip * e + 0.5 * lattice) / s  # in the lower tail, where nothing cancels
    low, high = ndtr(a), ndtr(b)
    p = high - low
    sure = p > 1e-290
    p = np.where(sure, p, 1.0)
    off = np.where(sure, (gauss(a) - gauss(b)) / p, flip * e / s)
    kept = np.where(sure, 1.0 + (a * gauss(a) - b * gauss(b)) / p - off**2, (lattice / s) ** 2 / 12)
    up = flip > 0
    part = np.where(up, within, 1.0 - within)
    below, above = low + part * p, 1.0 - high + (1.0 - part) * p
    return (
        np.where(sure, p, 1e-300), flip * off * s, np.clip(kept, 1e-12, 1.0) * s * s,
        np.where(up, below, above), np.where(up, above, below),
    )  # fmt: skip


def measure(x, P, y, errors: Errors, k: int, rng) -> Seen:
    """Let particles see plot k; each takes it for wild or not, as likely as it is."""
    n, share, variances = len(x), *scales(errors.heavy)
    prior, cov = x, P
    log = np.zeros(n)
    told = [np.empty((n, 2)) for _ in range(4)]
    for c in range(2):
        h = 2 * c
        m, pp, column = x[:, h], P[:, h, h], P[:, :, h]
        e = y[c] - m
        S = pp[:, None] + variances * errors.deviation[k] ** 2
        s = np.sqrt(S)
        if errors.lattice:
            p, off, left, below, above = cell(e[:, None], s, errors.lattice, float(rng.random()))
        else:
            z = e[:, None] / s
            p, off, left = gauss(z) / s, np.broadcast_to(e[:, None], s.shape), np.zeros_like(S)
            below, above = ndtr(z), ndtr(-z)
        for made, value in zip(told, (m, S @ share + errors.lattice**2 / 12, below @ share, above @ share)):
            made[:, c] = value
        w = share * p
        total = np.maximum(w.sum(axis=1), 1e-300)
        w = w / total[:, None]
        log += np.log(total)
        shift = off / S  # of the state, in units of the column
        by = (w * shift).sum(axis=1)
        x = x + column * by[:, None]
        less = (w * (1 / S - left / S**2 - shift**2)).sum(axis=1) + by**2
        P = P - less[:, None, None] * column[:, :, None] * column[:, None, :]
    if errors.wild[k] > 0.0:
        far = np.zeros(n)
        for j in range(SIZES):
            size = errors.size[k] * np.exp(np.interp((j + 0.5) / SIZES, [0, 1], np.log(WILDEST)))
            part = np.ones(n)
            for c in range(2):
                s = np.sqrt(cov[:, 2 * c, 2 * c] + errors.deviation[k] ** 2 + size**2 / 2)
                part = part * gauss((y[c] - prior[:, 2 * c]) / s) / s * (errors.lattice or 1.0)
            far = far + part / SIZES
        far = np.log(errors.wild[k] * np.maximum(far, 1e-300))
        log = np.logaddexp(np.log1p(-errors.wild[k]) + log, far)
        wide = rng.random(n) < np.exp(far - log)
        x = np.where(wide[:, None], prior, x)
        P = np.where(wide[:, None, None], cov, P)
    return Seen(log, x, P, *told)
