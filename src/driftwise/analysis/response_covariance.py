"""How sure the numbers of a response are, and whether what it answers ends."""

from __future__ import annotations

import math

import numpy as np

from ..results.stable import is_endless
from .response import Response
from .response_record import SHARE

FADED = 1e-9  # of itself, that a start has left in all rows together
MATTERS = 0.05  # of the gain, which a mode must make up to have a say in it


def covariance(now: Response) -> np.ndarray:
    """Return the covariance of theta: of white noise or, in each direction, of scores as they were, if larger."""
    J, size = now.jacobian()
    kept = np.setdiff1d(np.arange(len(size)), over(now, J, size))
    J, size = J[:, kept], size[kept]
    Q, R = np.linalg.qr(J)
    found = np.zeros((len(now.theta),) * 2)
    if np.any(abs(np.diag(R)) < 1e-9):
        return np.full(found.shape, np.inf)
    inverse = np.linalg.solve(R, np.eye(len(R))) / size[:, None]
    r = now.left * now.weight
    scores = Q * r[:, None]
    many = min(len(r) // SHARE, int(4 * (len(r) / 100) ** (2 / 9)) * 3)
    S = scores.T @ scores
    for j in range(1, many + 1):
        cross = scores[j:].T @ scores[:-j]
        S += (1 - j / (many + 1)) * (cross + cross.T)
    value, vector = np.linalg.eigh(S)
    free = len(r) / max(len(r) - len(size) - len(now.f), 1)
    own = inverse @ (vector * (free * np.maximum(value, np.mean(r**2)))) @ vector.T @ inverse.T
    found[np.ix_(kept, kept)] = own
    return found


def over(now: Response, J, size) -> np.ndarray:
    """Return which parameters of the start are over before the first row of J (rows, P): after a long delay.

    ``size`` (P,) is what the columns of J were divided by.
    """
    first = len(now.a) + now.b.size
    start = first + np.arange(len(now.more))[now.placed()["start"]]
    order = np.concatenate([np.setdiff1d(np.arange(J.shape[1]), start), start])
    dead = order[abs(np.diag(np.linalg.qr(J[:, order], mode="r"))) < 1e-9]
    return np.union1d(np.intersect1d(dead, start), start[size[start] < FADED])


def without_end(now: Response, P) -> list[bool]:
    """Say of each input whether its answer may never end, as far as the record tells: it has no gain, then.

    ``P`` is the covariance of the parameters.
    """
    n, A = len(now.a), now.denominator
    poles, found = np.roots(A), [False] * len(now.b)
    for k, p in enumerate(poles):
        way = -(p ** np.arange(n - 1, -1, -1)) / np.polyval(np.polyder(A), p)  # of the pole by each coefficient
        way = (way * np.conj(p)).real / max(abs(p), 1e-300)
        std = math.sqrt(max(float(way @ P[:n, :n] @ way), 0.0))
        if is_endless(abs(p), std, len(now.record.y)):
            rest = np.prod(1 - np.delete(poles, k) / p) * (1 - p)
            for i, b in enumerate(now.b):  # what this mode does to the end of a step, of all that is done to it
                part = abs(np.polyval(b[::-1], 1 / p) / rest)
                found[i] |= bool(part > MATTERS * abs(b.sum() / A.sum()))
    return found
