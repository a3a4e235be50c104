"""Spectral factors: the noise polynomial C behind given autocovariances, and its mirror image inside the circle.

With s = (1 - z)(1 - 1/z) = 4 sin^2(w/2) a symmetric polynomial in z is an ordinary one in s, and each root s belongs
to a pair z, 1/z. The distances z - 1 of the pair are (-s +- sqrt(s^2 - 4 s))/2 with product s, and the zero *inside*
the circle is always the nearer to 1: it is s over the other, so nothing cancels however close to 1 it lies.
"""

from __future__ import annotations

import numpy as np

from ..engine.errors import InputError

ON_CIRCLE = 1e-7  # a modulus this close to one counts as one: double roots are not found more finely


def spectral_factor(gamma) -> tuple[np.ndarray, float]:
    """Return (d, variance) of the moving average C(q) v that has the given autocovariances.

    Parameters
    ----------
    gamma : (n + 1,)
        gamma_0 .. gamma_n of v(t) + d_{n-1} v(t-1) + ... + d_0 v(t-n); later ones are zero.

    Returns
    -------
    d : (n,)
        d_0 .. d_{n-1} (Salut's order) of C(z) = z^n + d_{n-1} z^{n-1} + ... + d_0, every zero inside the circle.
    variance : float
        Variance of v.

    Raises
    ------
    InputError
        Where the numbers are no autocovariances (their spectral density is negative somewhere), or the density
        vanishes at some frequency, so that C has zeros on the circle.

    Notes
    -----
    Roots of the spectral density, then Newton's method on the autocovariances (Wilson 1969). Bad at zeros close to
    the circle: given in doubles, autocovariances fix a k-fold zero at distance h only while h^(2k) is well above 1e-16.

    Examples
    --------
    >>> d, variance = spectral_factor([1.25, 0.5])
    >>> print(round(float(d[0]), 12), round(variance, 12))
    0.5 1.0
    """
    try:
        gamma = np.asarray(gamma, float)
    except (TypeError, ValueError):
        raise InputError(f"gamma must hold numbers, got {gamma!r}") from None
    if gamma.ndim != 1 or not gamma.size or not np.isfinite(gamma).all() or not gamma[0] > 0:
        raise InputError(f"gamma must be a finite vector gamma_0 .. gamma_n with gamma_0 > 0, got {gamma!r}")
    if np.any(np.abs(gamma[1:]) > gamma[0]):
        raise InputError("gamma is no autocovariance: an entry exceeds gamma_0 in size. Is gamma_0 first?")
    size = int(np.flatnonzero(gamma)[-1]) + 1  # trailing zeros of gamma: C has so many zeros at the origin
    rho = gamma[:size] / gamma[0]
    d = polynomial(factor(in_s(rho))[0])
    if np.any(abs(zeros(d)) > 1 - ON_CIRCLE):
        raise _no_density()
    c = _wilson(np.append(1.0, d[::-1]), rho)
    d = np.concatenate([np.zeros(len(gamma) - size), (c[1:] / c[0])[::-1]])
    return d, float(gamma[0] * c[0] ** 2)


def minimum_phase(d) -> tuple[np.ndarray, float]:
    """Return (d, gain): the noise polynomial with every zero inside the circle, and what the variance of v gains.

    A zero z outside is replaced by 1/conj(z) and the variance multiplied by ``|z|^2``: the noise keeps its
    autocovariances, so nobody who sees only data can tell the two apart.

    Parameters
    ----------
    d : (n,)
        d_0 .. d_{n-1} of C(z) = z^n + d_{n-1} z^{n-1} + ... + d_0.

    Raises
    ------
    InputError
        For a zero on the circle: its mirror image is itself. Shrink all zeros by ``d * rho ** np.arange(n, 0, -1)``.

    Examples
    --------
    >>> d, gain = minimum_phase([2.0])
    >>> print(d, gain)
    [0.5] 4.0
    """
    d = noise_polynomial("d", d)
    z = zeros(d)
    if np.any(abs(abs(z) - 1) <= ON_CIRCLE):
        raise InputError(
            f"d has a zero on the unit circle (moduli {_moduli(z)}), which no reflection moves: shrink all zeros a "
            "little, d * rho ** np.arange(n, 0, -1) with rho = 0.98 or so"
        )
    out = abs(z) > 1
    if not out.any():
        return d, 1.0
    with np.errstate(over="ignore"):
        gain = float(np.prod(abs(z[out]) ** 2))
    if not np.isfinite(gain):
        raise InputError(f"d has zeros so far out (moduli {_moduli(z)}) that the variance leaves the range of doubles")
    return np.poly(np.where(out, 1 / np.where(out, z, 1).conj(), z))[:0:-1].real.copy(), gain


def zeros(d) -> np.ndarray:
    """Return the zeros of z^n + d_{n-1} z^{n-1} + ... + d_0, largest first."""
    z = np.roots(np.append(1.0, np.asarray(d, float)[::-1])).astype(complex)
    z = np.concatenate([z, np.zeros(len(d) - len(z))])
    return z[np.argsort(-abs(z), kind="stable")]


def noise_polynomial(name, d, size=None) -> np.ndarray:
    """Return d as a finite vector."""
    try:
        d = np.asarray(d, float)
    except (TypeError, ValueError):
        raise InputError(f"{name} must hold numbers, got {d!r}") from None
    if d.ndim != 1 or not np.isfinite(d).all() or (size is not None and len(d) != size):
        count = "" if size is None else f"{size} "
        raise InputError(f"{name} must list the {count}finite coefficients {name}_0, {name}_1, .., got {d!r}")
    return d


def inside(name, d, size=None) -> np.ndarray:
    """Return d; refuse zeros on or outside the circle and say what to do."""
    d = noise_polynomial(name, d, size)
    z = zeros(d)
    if np.any(abs(z) >= 1 - 1e-12):
        raise InputError(
            f"the zeros of {name} must lie inside the unit circle, got moduli {_moduli(z)}. "
            f"driftwise.models.minimum_phase({name}) gives the polynomial with the same spectrum and zeros "
            f"inside (a zero on the "
            "circle has none: shrink it)"
        )
    return d


def _moduli(z) -> str:
    return ", ".join(f"{m:.6g}" for m in abs(z))


def in_s(gamma) -> np.ndarray:
    """Return gamma_0 + sum_k gamma_k (z^k + z^-k) as coefficients of s^0, s^1, .."""
    # z^k + z^-k = 2 T_k(1 - s/2), Chebyshev polynomials
    series = np.polynomial.chebyshev.cheb2poly(np.append(gamma[:1], 2 * np.asarray(gamma[1:])))
    out, power = np.zeros(len(gamma)), np.ones(1)
    for k, value in enumerate(series):
        out[: k + 1] += value * power
        power = np.convolve(power, [1.0, -0.5])
    return out


def factor(c) -> tuple[np.ndarray, float]:
    """Return (e, V): sum_k c_k s^k = V |C|^2, C = (z-1)^n + e_{n-1} (z-1)^{n-1} + ... + e_0; refuse a negative density.

    As accurate as c relative to itself: the zeros may be as close to 1 as they like.
    """
    c = np.asarray(c, float)
    if not c[0] > 0:
        raise _no_density()
    if len(c) == 1:
        return np.zeros(0), float(c[0])
    size = abs(c).max()
    c, n = c / size, len(c) - 1
    top = int(np.flatnonzero(abs(c) > 1e-60)[-1])  # what is dropped are zeros at the origin
    s = _roots(c[: top + 1])
    half, root = -s / 2, np.sqrt(s) * np.sqrt(s - 4) / 2
    far = np.where(abs(half + root) >= abs(half - root), half + root, half - root)
    near = s / far
    if np.any(abs(near) >= abs(far) * (1 - 1e-15)):
        raise _no_density()
    e = np.poly(np.concatenate([near, np.full(n - top, -1.0)])).real[::-1]
    e, V = _newton(e[:-1], c)
    return e, size * V


def _roots(c):
    """Roots of sum_k c_k s^k, each with its own relative accuracy: Aberth's iteration from Newton's polygon."""
    n, log = len(c) - 1, np.log(np.maximum(abs(c), 1e-300))
    starts, at = [], 0
    while at < n:
        slopes = (log[at + 1 :] - log[at]) / np.arange(1, n - at + 1)
        step = 1 + int(np.flatnonzero(slopes >= slopes.max() - 1e-12)[-1])
        starts.extend(np.exp(-slopes[step - 1] + 1j * (2 * np.pi * np.arange(step) / step + 0.7 + at)))
        at += step
    s, k = np.array(starts, complex), np.arange(n + 1)
    for _ in range(200):
        terms = c[:, None] * s ** k[:, None]
        ratio = s * terms.sum(0) / np.where((slope := k @ terms) == 0, 1e-300, slope)  # p / p'
        gaps = s[:, None] - s + np.eye(n)
        move = ratio / (1 - ratio * ((1 / gaps).sum(1) - 1))
        s = s - move
        if np.all(abs(move) <= 1e-15 * abs(s)):
            break
    return s


def _products(n):
    """K (n + 1, n + 1, n + 1): Re (z-1)^i conj(z-1)^j = sum_k K[i, j, k] s^k on the circle."""
    t = [np.array([1.0]), np.array([0.0, -0.5])]  # Re (z-1)^k
    for _ in range(n - 1):
        t.append(np.polynomial.polynomial.polyadd(np.append(0.0, -t[-1]), np.append(0.0, -t[-2])))
    K = np.zeros((n + 1, n + 1, 2 * n + 1))
    for i in range(n + 1):
        for j in range(n + 1):
            low, part = min(i, j), t[abs(i - j)]
            K[i, j, low : low + len(part)] = part
    return K[:, :, : n + 1]


def _newton(e, c):
    """Refine (e, V) on sum_ij V e_i e_j K_ij = c, every unknown and every equation in units of its own size."""
    n = len(e)
    K, e, V = _products(n), np.append(e, 1.0), c[0] / e[0] ** 2
    for _ in range(4):
        terms = V * K * np.multiply.outer(e, e)[:, :, None]
        residual = c - terms.sum((0, 1))
        unit = abs(terms).sum((0, 1)) + 1e-300
        J = np.vstack([2 * terms.sum(1)[:n], terms.sum((0, 1))]).T / unit[:, None]
        step = np.linalg.lstsq(J, residual / unit, rcond=None)[0]
        e[:n] *= 1 + step[:n]
        V *= 1 + step[n]
    return e[:n], float(V)


def polynomial(e) -> np.ndarray:
    """Return d_0 .. d_{n-1} of C(z) = (z-1)^n + e_{n-1} (z-1)^{n-1} + ... + e_0."""
    powers = np.ones(1)
    for value in e[::-1]:  # Horner, lowest power first
        powers = np.append(0.0, powers) - np.append(powers, 0.0)
        powers[0] += value
    return powers[:-1]


def _no_density():
    return InputError(
        "the spectral density vanishes or is negative at some frequency, so there is no noise polynomial with all its "
        "zeros inside the circle. Was a term or a sign of the autocovariances lost?"
    )


def _wilson(c, gamma):
    """Two Newton steps on sum_k c_k c_{k+j} = gamma_j from a c that is nearly right up to its scale."""
    n = len(c)
    c = c / np.sqrt(c @ c)
    for _ in range(2):
        J = np.zeros((n, n))
        for j in range(n):
            J[j, : n - j] += c[j:]
            J[j, j:] += c[: n - j]
        residual = gamma - np.array([c[: n - j] @ c[j:] for j in range(n)])
        c = c + np.linalg.solve(J, residual)
    return c
