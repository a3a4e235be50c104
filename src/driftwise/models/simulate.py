"""Records from a known plant: missing, drifting, jumping, whatever a test or a demonstration needs."""

from __future__ import annotations

import numpy as np

from ..errors import InputError


def simulate(
    a,
    b=None,
    *,
    samples: int,
    noise_std: float = 0.0,
    noise: str = "equation",
    d=None,
    direct=None,
    u=None,
    missing: float = 0.0,
    seed: int = 0,
):
    """Return (y, u) of a plant A(q) y = B(q) u + C(q) v.

    Parameters
    ----------
    a : (n,) or (T, n)
        a1..an; a row per sample lets the parameters drift or jump.
    b : (n,), (k, n), (T, n) or (T, k, n), optional
        b1..bn of each input. Two axes are read as (T, n) where the first one is ``samples`` long.
    samples : int
        T.
    noise_std : float
        Standard deviation of v.
    noise : "equation" (white in the equation), "output" (white on y), or ignored where ``d`` is given
    d : (n,), optional
        d1..dn of C(q) = 1 + d1 q^-1 + ...
    direct : (k,), optional
        b0 of each input.
    u : (T,) or (T, k), optional
        Inputs; random signs held for one to five samples if omitted.
    missing : float
        Fraction of the outputs to lose (NaN).
    seed : int

    Returns
    -------
    y : (T,)
    u : (T,) or (T, k); None where there is no input

    Examples
    --------
    >>> y, u = simulate([-0.8], [1.0], samples=3, u=[1, 0, 0], noise_std=0)
    >>> print(y)
    [0.  1.  0.8]
    """
    rng = np.random.default_rng(seed)
    T = int(samples)
    a = np.broadcast_to(np.asarray(a, float), (T, np.shape(a)[-1]))
    n = a.shape[1]
    b = _per_sample(b, T, n)
    k = b.shape[1]
    if u is None:
        u = np.repeat(rng.choice([-1.0, 1.0], (T, k)), rng.integers(1, 6, T), axis=0)[:T]
    u = np.asarray(u, float).reshape(T, k)
    b0 = np.zeros(k) if direct is None else np.atleast_1d(np.asarray(direct, float))
    v = noise_std * rng.standard_normal(T)
    if d is not None:
        d = np.broadcast_to(np.asarray(d, float), (T, n))
    elif noise in ("output", "equation"):
        d = a if noise == "output" else np.zeros((T, n))
    else:
        raise InputError(f"noise must be 'output' or 'equation', got {noise!r}")
    x, y = np.zeros(n), np.empty(T)
    for t in range(T):
        y[t] = x[0] + b0 @ u[t] + v[t]
        x = np.append(x[1:], 0.0) - a[t] * y[t] + u[t] @ b[t] + d[t] * v[t]
    y[rng.random(T) < missing] = np.nan
    return y, (None if k == 0 else u[:, 0] if k == 1 else u)


def _per_sample(b, T, n):
    """Return b as (T, k, n)."""
    if b is None:
        return np.zeros((T, 0, n))
    b = np.asarray(b, float)
    if b.shape[-1] != n:
        raise InputError(f"b must list b1..b{n} for each input, like a; got shape {b.shape}")
    if b.ndim == 2 and len(b) == T:
        b = b[:, None]
    return np.broadcast_to(b, (T, *((1, n) if b.ndim == 1 else b.shape[-2:])))
