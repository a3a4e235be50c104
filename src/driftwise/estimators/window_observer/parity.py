"""The parity test inside a window of regular samples: the newest estimate against the one before, carried on."""

from typing import NamedTuple

import numpy as np

from ...detect.parity import covariance_root, whitening
from ...engine.dispatch import rare
from ...engine.errors import InputError
from .gains import powers
from .horizon import Horizon
from .partial import AT, FORESEEN
from .row import products


class Tables(NamedTuple):
    """White combinations, of variance 1: new z(t) + old z(t-L+1 | t-L) + gains times the inputs of the window."""

    threshold: float  # 0: no test
    restart: float
    new: np.ndarray  # (degrees, m), and a row of zeros where that is odd
    old: np.ndarray
    gains: np.ndarray  # (degrees, L, p + k): 0 for the outputs


def tables(system, dt: float, samples: int, noise_std, hold: str, policy) -> Tables:
    """Return what the kernel needs for `Parity` with windows of so many samples; nothing where there is no policy."""
    m, k, p = system.m, system.inputs, system.outputs
    if policy is None:
        return Tables(0.0, 0.0, np.zeros((0, m)), np.zeros((0, m)), np.zeros((0, samples, p + k)))
    V = white(Horizon(system, dt, noise_std), samples)
    threshold = policy.threshold(len(V))
    V = np.vstack([V, np.zeros((len(V) % 2, m))])
    Phi, G0, G1 = system.discretise(dt, hold)
    moves = powers(Phi, samples)[::-1]  # what becomes of z at each sample until the last one
    inputs = moves @ G1
    inputs[0] = 0.0
    inputs[:-1] += moves[1:] @ G0
    gains = np.zeros((len(V), samples, p + k))
    gains[:, :, p:] = -np.einsum("dm,lmk->dlk", V, inputs)
    old = -V @ moves[0]
    return Tables(threshold, float(policy.restart), V, old, gains)


def white(horizon: Horizon, samples: int) -> np.ndarray:
    """Return V (degrees, m) of V d ~ N(0, 1), d the newer estimate less the older one carried on."""
    system, prior = horizon.augmented, horizon.augmented.prior_std
    Phi = np.linalg.matrix_power(system.discretise(horizon.dt)[0], samples)
    declared = np.isfinite(prior) & (prior > 0)
    if np.any(Phi[np.ix_(declared, np.isinf(prior))]):
        raise InputError(
            "the parity test needs priors that hold for both windows: a disturbance whose derivative has an infinite "
            f"prior_std cannot have a finite one itself ({', '.join(system.names)}: {prior.tolist()})"
        )
    turn = Phi[np.ix_(declared, declared)] * prior[declared] / prior[declared][:, None]
    return whitening(covariance_root(Phi, *horizon.errors(samples), turn))


@rare
def contradiction(form, state):
    """Return d' S^-1 d of the full window and the one before it; 0 where that one was not full."""
    m, L = state.z.size, int(form.length)
    first, size, total = int(state.own[AT]), state.ring.size // 2, 0.0
    before, x = state.predicted[first * m : (first + 1) * m], state.ring[first * (size // L) :]
    if state.own[FORESEEN] < form.length:
        return 0.0
    for d in range(0, form.new.size // m, 2):
        upper, lower = products(form.feed, d * size, x[:size]) if state.held.size > 0 else (0.0, 0.0)
        for i in range(m):
            upper += form.new[d * m + i] * state.z[i] + form.old[d * m + i] * before[i]
            lower += form.new[(d + 1) * m + i] * state.z[i] + form.old[(d + 1) * m + i] * before[i]
        total += upper * upper + lower * lower
    return total
