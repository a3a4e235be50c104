"""Roots of a polynomial with uncertain coefficients: first order where that holds, sampled where it does not."""

from __future__ import annotations

from functools import cached_property
from itertools import combinations
from typing import NamedTuple

import numpy as np

# A root whose std exceeds this fraction of the distance to its nearest neighbour is sampled: there the first-order
# variance is 4 % short, at twice that 20 % and more (tests/models/test_roots.py).
CLOSE = 0.05
DRAWS = 8192  # a sampled std is good to one percent
USUAL, HIGHEST = 20, 100  # orders up to which all draws are taken, and beyond which none: each is an eigenvalue problem
# A leading coefficient, or a denominator, known to this fraction: its inverse has 8 % more variance than first order.
SMALL = 0.1
# One that lies within so many std of zero has an inverse without a variance.
CLEAR = 4.0


class Roots(NamedTuple):
    """Roots, largest first, the covariance (n, 2, 2) of their (real, imaginary) parts, and how each was found.

    ``joint`` (2 n, 2 n) is the covariance of all parts, ``slopes`` (2 n, m) are those by the coefficients.
    """

    values: np.ndarray
    covariance: np.ndarray
    method: list[str]
    notes: list[str]
    joint: np.ndarray
    slopes: np.ndarray

    @property
    def std(self) -> np.ndarray:
        """Root mean square radius of uncertainty of each root."""
        return np.sqrt(np.trace(self.covariance, axis1=1, axis2=2))


def drawn(mean, covariance, rng) -> np.ndarray:
    """Return draws (8192, m) of a normal law, of each number in its own unit: large ones blur no small one."""
    size = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    unit = np.where((size > 0) & np.isfinite(size), size, 1.0)
    P = covariance / unit / unit[:, None]
    found = rng.multivariate_normal(np.zeros(len(unit)), P, DRAWS, check_valid="ignore", method="eigh")
    return np.asarray(mean + unit * found)


class WithPoles:
    """The poles of a model in discrete time, which finds them once, as ``_poles``."""

    @cached_property
    def _poles(self) -> Roots:
        raise NotImplementedError

    @cached_property
    def poles(self) -> np.ndarray:
        """Poles, largest first, the lower one of a conjugate pair first; of A and, where there are any, of every F."""
        return self._poles.values

    @cached_property
    def poles_covariance(self) -> np.ndarray:
        """Covariance (.., 2, 2) of (real, imaginary) part of each pole; how it was found: ``method``."""
        return self._poles.covariance

    @cached_property
    def poles_joint_covariance(self) -> np.ndarray:
        """Covariance (2 n, 2 n) of all poles at once: real and imaginary part of the first, of the second, and so on.

        What two poles have in common is off the diagonal blocks: the difference of two, a sum of time constants. First
        order; where a pole is "sampled", all of its polynomial are, together (the blocks of others may then differ a
        little from `poles_covariance`). NaN beside a pole of which nothing is known.

        Examples
        --------
        >>> import numpy as np, driftwise as dw
        >>> from driftwise.models.canonical import Canonical
        >>> m = dw.models.Model(Canonical(2), np.array([-1.4, 0.45]), np.diag([1e-6, 0.0]))
        >>> slow, fast = m.poles_joint_covariance[0, 0], m.poles_joint_covariance[2, 2]
        >>> print(m.poles.real.round(3), (m.poles_joint_covariance[0, 2] / np.sqrt(slow * fast)).round(6))
        [0.9 0.5] -1.0
        """
        return self._poles.joint

    @cached_property
    def poles_std(self) -> np.ndarray:
        """Root mean square radius of uncertainty of each pole."""
        return self._poles.std

    @cached_property
    def method(self) -> list[str]:
        """How the uncertainty of each pole was found: "first order", or "sampled" where poles nearly coincide."""
        return self._poles.method

    @property
    def is_stable(self) -> bool:
        """Whether every pole lies inside the unit circle."""
        return bool(np.all(abs(self.poles) < 1))


def order(p: np.ndarray) -> np.ndarray:
    """Return the index that puts roots largest first, the lower one of a conjugate pair before the upper."""
    return np.lexsort((p.imag, -np.abs(p)))


def solve(c) -> np.ndarray:
    """Return the roots of c[0] z^m + ... + c[m], largest first, those at infinity as inf."""
    c = np.asarray(c, float)
    p = np.roots(c).astype(complex)
    infinite = np.full(len(c) - 1 - len(p), complex(np.inf, 0.0))
    return np.concatenate([infinite, p[order(p)]])


def estimate(c, covariance, draws, kind: str, names: list[str]) -> Roots:
    """Return the roots of c[0] z^m + ... + c[m] and how uncertain they are.

    Parameters
    ----------
    c : (m + 1,) coefficients
    covariance : (m + 1, m + 1) of the coefficients
    draws : callable that returns (S, m + 1) sampled coefficients
    kind : "pole" or "zero", for the notes
    names : names of the coefficients, for the notes
    """
    if len(c) == 1:
        return Roots(np.zeros(0, complex), np.zeros((0, 2, 2)), [], [], np.zeros((0, 0)), np.zeros((0, 1)))
    if c[0] == 0 == covariance[0, 0]:  # known to be zero: a root at infinity, nothing uncertain
        rest = estimate(c[1:], covariance[1:, 1:], lambda: draws()[:, 1:], kind, names[1:])
        there, slopes = np.diag([np.inf, np.inf])[None], np.pad(rest.slopes, ((2, 0), (1, 0)))
        joint = _apart(np.diag([np.inf, np.inf]), rest.joint, np.nan)
        values, covariance = np.append(np.inf, rest.values), np.append(there, rest.covariance, 0)
        return Roots(values, covariance, ["infinite", *rest.method], rest.notes, joint, slopes)
    if c[-1] == 0 and not covariance[-1].any():  # likewise, a root at 0
        rest = estimate(c[:-1], covariance[:-1, :-1], lambda: draws()[:, :-1], kind, names[:-1])
        there, slopes = np.zeros((1, 2, 2)), np.pad(rest.slopes, ((0, 2), (0, 1)))
        values, covariance = np.append(rest.values, 0.0), np.append(rest.covariance, there, 0)
        joint = _apart(rest.joint, np.zeros((2, 2)), 0.0)
        return Roots(values, covariance, [*rest.method, "first order"], rest.notes, joint, slopes)
    p = solve(c)
    if not np.isfinite(covariance).all():
        unknown, n = [f"nothing is known of the {kind}s yet"], len(p)
        everything = np.full((n, 2, 2), np.inf), ["unknown"] * n, unknown, np.full((2 * n, 2 * n), np.inf)
        return Roots(p, *everything, np.full((2 * n, n + 1), np.nan))
    lost = _leading(c, covariance)
    J = derivatives(c, p)
    C, joint = own_blocks(J, covariance), spread(J, covariance)
    method, notes = ["first order"] * len(p), []
    pairs = _close_pairs(p, C, lost)
    ratio = np.sqrt(covariance[0, 0]) / abs(c[0]) if c[0] else 0.0
    sampled = np.zeros(len(p), bool)
    sampled[[i for pair in pairs for i in pair]] = True
    if lost or ratio > SMALL:
        sampled[:] = True
    sampled[:lost] = False
    if len(p) > HIGHEST:
        sampled[:], pairs = False, {}
        notes.append(f"{len(p)} {kind}s are too many to be sampled: first order")
    if sampled.any():
        many = DRAWS if len(p) <= USUAL else DRAWS * USUAL**3 // len(p) ** 3
        own, joint = _sampled(p, draws()[:many], lost)
        C[sampled] = own[sampled]
        method = ["sampled" if s else m for s, m in zip(sampled, method)]
    if lost:
        C[:lost] = np.diag([np.inf, np.inf])
        joint = _apart(np.diag(np.full(2 * lost, np.inf)), joint[2 * lost :, 2 * lost :], np.nan)
        method[:lost] = ["infinite"] * lost
        notes.append(_lost_words(c, covariance, lost, kind, names))
    elif ratio > SMALL and sampled.any():
        notes.append(f"{names[0]} is known to {100 * ratio:.0f} % only: the {kind}s are sampled")
    notes += [f"{kind}s {i + 1} and {j + 1} nearly coincide: sampled" for (i, j), far in pairs.items() if far < CLEAR]
    return Roots(p, C, method, notes, joint, J)


def _apart(first, second, shared) -> np.ndarray:
    """Return the covariance of two that share nothing, or nothing that is known."""
    n, m = len(first), len(second)
    joint = np.full((n + m, n + m), shared)
    joint[:n, :n], joint[n:, n:] = first, second
    return joint


def _leading(c, covariance) -> int:
    """Return how many leading coefficients cannot be told from zero: so many roots may lie at infinity."""
    known = np.abs(c) > CLEAR * np.sqrt(np.diag(covariance))
    return int(np.argmax(known)) if known.any() else len(c) - 1


def _lost_words(c, covariance, lost, kind, names) -> str:
    std = np.sqrt(np.diag(covariance))
    what = ", ".join(f"{name} ({v:.2g} ± {s:.2g})" for name, v, s in zip(names[:lost], c, std))
    many = f"the largest {kind}" if lost == 1 else f"the {lost} largest {kind}s"
    return f"{what} cannot be told from 0: {many} may lie at infinity"


def derivatives(c, p) -> np.ndarray:
    """Return dp/dc_i = -p^(m-i) / c'(p), (2 m, m + 1), real and imaginary; NaN where the slope c'(p) is zero."""
    m = len(c) - 1
    finite = np.isfinite(p)
    J = np.full((m, m + 1), complex(np.nan, np.nan))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        J[finite] = -(p[finite, None] ** np.arange(m, -1, -1)) / np.polyval(np.polyder(c), p[finite])[:, None]
    return parts(J)


def parts(J) -> np.ndarray:
    """Return real and imaginary parts of n complex rows, one below the other, (2 n, m)."""
    return np.stack([J.real, J.imag], axis=1).reshape(2 * len(J), J.shape[1])


def spread(J, covariance) -> np.ndarray:
    """Return J P J' of 2 n rows; a root without a finite variance has an infinite one, and shares what nobody knows."""
    with np.errstate(over="ignore", invalid="ignore"):
        joint = J @ covariance @ J.T
    lost = np.repeat(~np.isfinite(np.diag(joint)).reshape(-1, 2).all(axis=1), 2)
    joint[lost], joint[:, lost] = np.nan, np.nan
    joint[lost, lost] = np.inf
    return joint


def own_blocks(J, covariance):
    """Return the blocks (n, 2, 2) of each root alone; infinite where one is not finite."""
    J = J.reshape(-1, 2, J.shape[1])
    with np.errstate(over="ignore", invalid="ignore"):
        C = J @ covariance @ J.swapaxes(1, 2)
    C[~np.isfinite(C).all(axis=(1, 2))] = np.inf
    return C


def _close_pairs(p, C, lost) -> dict[tuple[int, int], float]:
    """Return the nearest neighbours that are not far apart, and their distance in std."""
    finite = p[lost:]
    if len(finite) < 2:
        return {}
    distance = abs(finite[:, None] - finite) + np.diag(np.full(len(finite), np.inf))
    nearest = distance.min(axis=1)
    std = np.sqrt(np.trace(C[lost:], axis1=1, axis2=2))
    # a nearly double root obeys (z - p)^2 = noise: it moves by the root of std times distance, not by its std
    with np.errstate(invalid="ignore"):
        reach = np.where(std > nearest, np.sqrt(std * nearest), std)
    reach = np.where(np.isnan(reach), np.inf, reach)
    found = {}
    for i, j in enumerate(distance.argmin(axis=1)):
        spread = max(reach[i], reach[j])
        if spread > CLOSE * nearest[i] or nearest[i] == 0:
            pair = (lost + min(i, int(j)), lost + max(i, int(j)))
            found[pair] = nearest[i] / spread if spread > 0 else 0.0
    return dict(sorted(found.items()))


def _sampled(p, draws, lost):
    """Return second moments about p over sampled coefficients: of each root (n, 2, 2), and of all (2 n, 2 n).

    Each draw's roots go to the nearest of p, one to one.

    Nearness is chordal (distance on the Riemann sphere), so that a root at infinity has a place too. Where two
    assignments cost the same (a real pair that became complex), the mean with the mirror image undoes the choice.
    """
    q = _many_roots(draws)
    far = ~np.isfinite(p)
    known = np.where(far, 0, p)
    scale = np.sqrt(1 + np.abs(known) ** 2)
    distance = np.abs(q[:, None, :] - known[:, None]) / (scale[:, None] * np.sqrt(1 + np.abs(q[:, None, :]) ** 2))
    distance[:, far] = 1 / np.sqrt(1 + np.abs(q[:, None, :]) ** 2)
    q = np.take_along_axis(q, _assignment(distance**2), axis=1)
    e = np.where(far, 0, q - known)
    e = np.stack([e.real, e.imag], axis=-1)
    mirror = [i if v.imag == 0 else int(np.argmin(abs(known - v.conjugate()))) for i, v in enumerate(known)]
    C = np.einsum("sia,sib->iab", e, e) / len(e)
    whole, mirrored = e.reshape(len(e), -1), (e[:, mirror] * [1, -1]).reshape(len(e), -1)
    joint = (whole.T @ whole + mirrored.T @ mirrored) / (2 * len(e))
    return (C + C[mirror] * [[1, -1], [-1, 1]]) / 2, joint


def _assignment(cost):
    """Return which of n things each of n places gets, (S, n): the nearest pair first, then swaps while they pay."""
    S, n = cost.shape[:2]
    s, left, match = np.arange(S), cost.copy(), np.empty((S, n), int)
    for _ in range(n):
        i, j = np.divmod(left.reshape(S, -1).argmin(axis=1), n)
        match[s, i] = j
        left[s, i] = left[s, :, j] = np.inf
    for i, j in 2 * list(combinations(range(n), 2)):
        k, l = match[:, i], match[:, j]
        pays = cost[s, i, l] + cost[s, j, k] < cost[s, i, k] + cost[s, j, l]
        match[pays, i], match[pays, j] = l[pays], k[pays]
    return match


def _many_roots(c):
    """Return the roots (S, m) of S polynomials at once: eigenvalues of companion matrices, largest first."""
    S, m = len(c), c.shape[1] - 1
    companion = np.zeros((S, m, m))
    companion[:, 0] = -c[:, 1:] / c[:, :1]
    companion[:, np.arange(1, m), np.arange(m - 1)] = 1
    q = np.linalg.eigvals(companion).astype(complex)
    return np.take_along_axis(q, np.lexsort((q.imag, -np.abs(q)), axis=1), axis=1)
