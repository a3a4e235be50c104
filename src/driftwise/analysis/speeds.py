"""A plant that becomes faster or slower at a sample: its poles before, and what passes through it from then on."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..models.filtering import filter_rows

STEP = 1e-5  # of numeric slopes of a polynomial
ALIKE = 1e-9  # by which the radii of a pair may differ
MOST = 2.5  # of the logarithm of a factor, at most


class Piece(NamedTuple):
    """A stretch with one denominator: its first sample, A, and what holds the gain when inputs are multiplied by it."""

    first: int
    a: np.ndarray
    hold: float


def slowed(a, v: float, is_alone: bool = False) -> np.ndarray:
    """Return 1, a1, .. with all time constants multiplied by e^v, or with that of the slowest mode alone.

    Examples
    --------
    >>> slowed(np.array([1.0, -0.81]), np.log(2.0)).round(3).tolist()
    [1.0, -0.9]
    >>> slowed(np.poly([0.81, 0.5]), np.log(2.0), is_alone=True).round(3).tolist()
    [1.0, -1.4, 0.45]
    """
    return _slowed(np.asarray(a, float).tobytes(), float(v), is_alone).copy()


@lru_cache(4096)  # a search asks two times of three for what it had a moment ago
def _slowed(told: bytes, v: float, is_alone: bool) -> np.ndarray:
    a = np.frombuffer(told)
    poles = np.roots(a)
    radius = abs(poles)
    part = np.where(is_slowest(radius), np.exp(-v), 1.0) if is_alone else np.exp(-v)
    logs = np.log(np.where(radius > 0, radius, 1.0))
    turn = np.where(poles.imag == 0, np.where(poles.real < 0, np.pi, 0.0), np.angle(poles) * part)
    moved = np.where(radius > 0, np.exp(part * logs + 1j * turn), 0.0)
    return np.append(np.real(np.poly(moved)), np.zeros(len(a) - 1 - len(poles)))


def is_slowest(radius) -> np.ndarray:
    """Say of each pole, by its radius, whether it is the slowest, or of the slowest pair."""
    return radius > np.max(radius, initial=0.0) - ALIKE


def pieces(a, speeds: Sequence[int], values, is_alone: bool = False) -> list[Piece]:
    """Return the stretches of a plant that is 1, a1, .. at its end; ``values`` (m,) say how much slower it was before.

    They are logarithms of its time constants before each of ``speeds``, in what they are from there on; or of that of
    its slowest mode alone.

    Examples
    --------
    >>> [(piece.first, piece.a.round(2).tolist()) for piece in pieces(np.array([1.0, -0.81]), [40], [np.log(2.0)])]
    [(0, [1.0, -0.9]), (40, [1.0, -0.81])]
    """
    order, found, v = np.argsort(speeds)[::-1], [], 0.0
    for k in order:
        was = a if v == 0 else slowed(a, v, is_alone)
        found.append(Piece(int(speeds[k]), was, float(was.sum() / a.sum())))
        v += float(values[k])
    was = slowed(a, v, is_alone)
    return [Piece(0, was, float(was.sum() / a.sum())), *found[::-1]]


def passed(stretches: Sequence[Piece], x, is_held: bool = True) -> np.ndarray:
    """Return what comes of signals (k, T), or (T,), through 1/A of each stretch, the outputs before going on.

    ``is_held`` : whether they are multiplied so that the gain stays
    """
    rows = np.atleast_2d(x)
    y = np.empty(rows.shape)
    ends = [piece.first for piece in stretches[1:]] + [rows.shape[1]]
    for (first, a, hold), end in zip(stretches, ends):
        n, inside = len(a) - 1, np.array(rows[:, first:end])
        if is_held:
            inside *= hold
        for m in range(min(n, end - first) if first else 0):
            for j in range(m + 1, n + 1):
                if first + m - j >= 0:
                    inside[:, m] -= a[j] * y[:, first + m - j]
        y[:, first:end] = filter_rows(np.ones(1), a, inside)
    return y.reshape(np.shape(x))


def moved_by(stretches: Sequence[Piece], others: Sequence[Piece], size: float, drive, inner) -> np.ndarray:
    """Return what enters 1/A, (T,), where stretches move towards ``others``, ``size`` away, per unit.

    ``drive`` (T,) is what is multiplied to hold the gain, ``inner`` what comes out.
    """
    found, ends = np.zeros(len(drive)), [piece.first for piece in stretches[1:]] + [len(drive)]
    for now, other, end in zip(stretches, others, ends):
        at = slice(now.first, end)
        slope = (other.a - now.a) / size
        found[at] = (other.hold - now.hold) / size * drive[at]
        for j in np.flatnonzero(slope).tolist():
            first = max(now.first, j)
            found[first:end] -= slope[j] * inner[first - j : end - j]
    return found
