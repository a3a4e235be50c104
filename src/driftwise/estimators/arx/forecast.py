"""Several samples ahead: the recursion run on with e = 0, and how sure that is."""

from __future__ import annotations

import numpy as np

from ...engine import compile, validation
from ...engine.dispatch import open_row
from ..armax.regressors import Polynomials, open_kept
from ..base import Estimator
from .forms import METHODS

STEP = 1e-6  # of a parameter's unit: derivatives by central differences


def forecast(est, state, u, horizon) -> tuple[np.ndarray, np.ndarray]:
    """Return mean and standard deviation (h,) of the outputs after ``state``: `Recursive.predict`."""
    form = est.policies[0]
    if type(form) not in (*METHODS.values(), Polynomials):  # how other regressors go on, only their step knows
        return Estimator.predict(est)
    u = validation.inputs_to_come(u, horizon, est.model.inputs)
    past = Past(est, est._rows(state)[0])
    theta, s2 = np.array(state["theta"]), est.sigma2(state)
    step, unknown = STEP * np.sqrt(est._theta_units()), np.flatnonzero(past.covariance.diagonal())
    N, own = len(step), np.arange(len(step))

    # the recursion itself, with each parameter a step more and less; then, from rest, what is linear: the noise to
    # come and what is unknown of the past, as impulses
    up, down, pulse = slice(1, 1 + N), slice(1 + N, 1 + 2 * N), 1 + 2 * N
    thetas, pasts = np.empty((pulse + 1 + len(unknown), N)), np.zeros((pulse + 1 + len(unknown), len(past.z)))
    thetas[:], pasts[:pulse] = theta, past.z
    thetas[1 + own, own] += step
    thetas[1 + N + own, own] -= step
    pasts[up] += (past.slope * step).T
    pasts[down] -= (past.slope * step).T
    pasts[pulse] = past.pulse
    pasts[pulse + 1 + np.arange(len(unknown)), unknown] = 1.0
    ahead = run(form, thetas, pasts, u, (np.arange(len(thetas)) < pulse).astype(float))

    J = (ahead[up] - ahead[down]) / (2 * step[:, None])
    variance = (J * (s2 * est._theta_covariance(state) @ J)).sum(axis=0)
    noise = np.ones(len(u))
    noise[1:] = ahead[pulse, :-1] ** 2
    variance += s2 * est.policies[1].R * noise.cumsum()
    if len(unknown):
        G = ahead[pulse + 1 :]
        variance += (G * (past.covariance[np.ix_(unknown, unknown)] @ G)).sum(axis=0)
    return ahead[0], np.sqrt(variance.clip(0))


class Past:
    """The registers as one vector z = [y.. ; u of each input.. ; lags of e, -v, -w], the covariance of what is unknown.

    ``slope`` is dz/dtheta, ``pulse`` what e = 1 at the last sample would have left in z.
    """

    def __init__(self, est, row):
        form, N = est.policies[0], est.model.N
        view = open_row(form, row)
        na, wide = view.ys.size, view.us.size
        is_rational = isinstance(form, Polynomials)
        r = open_kept(form, view).r if is_rational else np.zeros(0)
        self.z = np.concatenate([view.ys, view.us.ravel(), r])
        size, first = len(self.z), na + wide
        self.slope, self.pulse = np.zeros((size, N)), np.zeros(size)
        self.pulse[:na][:1] = 1.0
        self.covariance = np.zeros((size, size))
        self.covariance[:na, :na] = view.ys_covariance.reshape(na, na)
        own = self.covariance.reshape(-1)[:: size + 1]  # the diagonal
        own[:na], own[na:first] = np.abs(own[:na]), view.us_variance.ravel()
        if not is_rational:
            return
        kept, nc, nd = open_kept(form, view), int(form.nc), int(form.nd)
        if kept.dr.size:
            self.slope[first:] = kept.dr
        self.pulse[first : first + nc][:1] = 1.0
        self.pulse[first + nc : first + nc + nd][:1] = -1.0
        if kept.is_uncertain[0]:
            # S holds the next regressors: -y, the lags of each input that its B has reached, r
            deep, inner, at, b = int(form.deep), list(range(na)), list(range(na)), na
            for l, (nb, nk) in enumerate(zip(est.model.nb, est.model.nk)):
                inner += range(b + 1, b + nb)
                at += range(na + l * deep + nk, na + l * deep + nk + nb - 1)
                b += nb
            inner += range(b, b + len(r))
            at += range(first, size)
            sign = np.where(np.arange(len(at)) < na, -1.0, 1.0)
            self.covariance[np.ix_(at, at)] = kept.S[np.ix_(inner, inner)] * np.outer(sign, sign)


def run(form, theta, z, u, driven) -> np.ndarray:
    """Return the outputs (K, h) of K parameter vectors (K, N) from K pasts (K, ..), without noise.

    ``driven`` (K,) is 1 where inputs and offset act, 0 where they do not.
    """
    k, is_rational = int(form.inputs), isinstance(form, Polynomials)
    nc, nd, nf = (form.nc, form.nd, form.nf) if is_rational else (0, 0, np.zeros(k))
    sizes = np.array([form.na, k, form.deep, nc, nd, *form.nb, *form.nk, *nf], np.int64)
    out = np.empty((len(theta), len(u)))
    go = compile.function(run_on, 2, 2, 2, 1, 1, 2, "index")
    go(theta, z, u, driven, driven * form.offset, out, sizes)
    return out


def run_on(theta, past, u, driven, offset, out, sizes):
    """Fill ``out``; a ``past`` is [y.. ; u of each input.. ; lags of e, -v, -w of each input], all newest first."""
    na, k, deep, nc, nd = sizes[0], sizes[1], sizes[2], sizes[3], sizes[4]
    noise = na + k * deep  # where the lags of e begin
    for i in range(out.shape[0]):
        p, z = theta[i], past[i]
        for t in range(out.shape[1]):
            y, v, at, free = 0.0, 0.0, na, na
            for j in range(na):
                y -= p[j] * z[j]
            for l in range(k):
                free += sizes[5 + l]
            for j in range(nc + nd):
                v += p[free + j] * z[noise + j]
            w, b = noise + nc + nd, free + nc + nd
            for l in range(k):
                nb, nk, nf, own = sizes[5 + l], sizes[5 + k + l], sizes[5 + 2 * k + l], 0.0
                first = na + l * deep
                for j in range(deep - 1, 0, -1):
                    z[first + j] = z[first + j - 1]
                if deep > 0:
                    z[first] = driven[i] * u[t, l]
                for j in range(nb):
                    own += p[at + j] * z[first + nk + j]
                for j in range(nf):
                    own += p[b + j] * z[w + j]
                for j in range(nf - 1, 0, -1):
                    z[w + j] = z[w + j - 1]
                if nf > 0:
                    z[w] = -own
                y += own
                at += nb
                b += nf
                w += nf
            for j in range(b, p.size):
                y += p[j] * offset[i]
            y += v
            out[i, t] = y
            for j in range(na - 1, 0, -1):
                z[j] = z[j - 1]
            if na > 0:
                z[0] = y
            for j in range(nc - 1, 0, -1):
                z[noise + j] = z[noise + j - 1]
            if nc > 0:
                z[noise] = 0.0  # e to come is zero
            for j in range(nc + nd - 1, nc, -1):
                z[noise + j] = z[noise + j - 1]
            if nd > 0:
                z[noise + nc] = -v
