"""Several samples ahead: the recursion run on with e = 0, and how sure that is."""

from __future__ import annotations

import numpy as np

from ...engine import validation
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
    z = past.z
    step = STEP * np.sqrt(est._theta_units())

    mean = run(form, theta[None], z[None], u)[0]
    moved = [theta + sign * np.diag(step) for sign in (1, -1)]
    with_them = [z + sign * (past.slope * step).T for sign in (1, -1)]
    up, down = (run(form, t, w, u) for t, w in zip(moved, with_them))
    J = ((up - down) / (2 * step[:, None])).T
    variance = np.einsum("hi,ij,hj->h", J, s2 * est._theta_covariance(state), J)

    # linear in the noise to come and in what is unknown of the past: impulses from rest
    still, plain = np.zeros_like(u), form._replace(offset=0.0)
    impulse = run(plain, theta[None], past.pulse[None], still)[0]
    response = np.append(1.0, impulse[:-1])
    variance += s2 * est.policies[1].R * np.cumsum(response**2)
    if past.covariance.any():
        G = run(plain, np.repeat(theta[None], len(z), axis=0), np.eye(len(z)), still)
        variance += np.einsum("ih,ij,jh->h", G, past.covariance, G)
    return mean, np.sqrt(variance.clip(0))


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
        self.covariance = np.diag(np.concatenate([np.zeros(na), view.us_variance.ravel(), np.zeros(len(r))]))
        self.covariance[:na, :na] = view.ys_covariance.reshape(na, na)
        self.covariance[range(na), range(na)] = np.abs(np.diag(self.covariance)[:na])
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


def run(form, theta, z, u) -> np.ndarray:
    """Return the outputs (K, h) of K parameter vectors (K, N) from K pasts (K, ..), without noise."""
    K, k, deep = len(theta), int(form.inputs), int(form.deep)
    na = int(form.na)
    ys, us, r = z[:, :na], z[:, na : na + k * deep].reshape(K, k, deep), z[:, na + k * deep :]
    nb, nk = form.nb.astype(int), form.nk.astype(int)
    free = na + nb.sum()
    is_rational = isinstance(form, Polynomials)
    nc, nd, nf = (int(form.nc), int(form.nd), form.nf.astype(int)) if is_rational else (0, 0, np.zeros(k, int))
    ends = np.cumsum([nc, nd, *nf])
    out = np.empty((K, len(u)))
    for t, now in enumerate(u):
        us = np.concatenate([np.broadcast_to(now[:, None], (K, k, 1)), us[:, :, :-1]], axis=2) if deep else us
        lags = [us[:, l, nk[l] : nk[l] + nb[l]] for l in range(k)]
        offset = np.full((K, int(theta.shape[1] > free + r.shape[1])), form.offset)
        terms = theta * np.concatenate([-ys, *lags, r, offset], axis=1)
        y = terms.sum(axis=1)
        out[:, t] = y
        ys = np.concatenate([y[:, None], ys[:, :-1]], axis=1)[:, :na]
        if not r.shape[1]:
            continue
        e, d, *f = np.split(r, ends[:-1], axis=1)
        new = [np.zeros(K), -terms[:, free : free + nc + nd].sum(axis=1)]
        b = na
        for l in range(k):
            own = terms[:, b : b + nb[l]].sum(axis=1)
            new.append(-own - terms[:, free + ends[1 + l] : free + ends[2 + l]].sum(axis=1))
            b += nb[l]
        blocks = zip((e, d, *f), new)
        r = np.concatenate([np.concatenate([v[:, None], old], axis=1)[:, : old.shape[1]] for old, v in blocks], axis=1)
    return out
