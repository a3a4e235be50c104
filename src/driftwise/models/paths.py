"""What a simulated plant is made of, checked: parameters at every sample, their walks and jumps, disturbances."""

from __future__ import annotations

import numpy as np

from ..engine.errors import InputError
from .canonical import Canonical


def of_model(model):
    """Return b (k, n), direct (k,) or None, a (n,), and c1..cn or None of a `Model`."""
    n, k = model.form.n, model.form.inputs
    theta = np.asarray(model.values, float)
    c = model.noise_polynomial[1:] if model.form.coloured else None
    b = theta[n : n * (k + 1)].reshape(k, n) if k else None
    return b, (theta[model.form.direct_at :] if model.form.direct else None), theta[:n], c


def numbers(name, value) -> np.ndarray:
    """Return finite numbers."""
    try:
        value = np.asarray(value, float)
    except (TypeError, ValueError):
        raise InputError(f"{name} must hold numbers, got {value!r}") from None
    if not np.isfinite(value).all():
        raise InputError(f"{name} must be finite, got {value.tolist()}; lose samples with missing= or missing_inputs=")
    return value


def fraction(name, value) -> float:
    """Return a number from 0 to 1."""
    if not 0 <= value <= 1:
        raise InputError(f"{name} is a fraction from 0 to 1, got {value!r}; was it meant in percent?")
    return float(value)


def spread(name, value) -> float:
    """Return a finite number that is not negative."""
    value = numbers(name, value)
    if value.shape or value < 0:
        raise InputError(f"{name} is a standard deviation: one number, not negative; got {value!r}")
    return float(value)


def length(samples, u) -> int:
    """Return the number of samples."""
    if samples is None:
        if u is None:
            raise InputError("samples is missing: how long shall the record be?")
        return len(u)
    if isinstance(samples, bool) or int(samples) != samples or samples < 0:
        raise InputError(f"samples must be a whole number, not negative; got {samples!r}")
    return int(samples)


def inputs(u, T, k) -> np.ndarray:
    """Return u as (T, k)."""
    u = numbers("u", u)
    if u.shape != (T, k) and not (k == 1 and u.shape == (T,)):
        raise InputError(f"u must be ({T}, {k}){f' or ({T},)' if k == 1 else ''}: {k} input(s) by b; got {u.shape}")
    return u.reshape(T, k)


def start(x0, n) -> np.ndarray:
    """Return the first state (n,)."""
    x = np.zeros(n) if x0 is None else numbers("x0", x0)
    if x.shape != (n,):
        raise InputError(f"x0 must be ({n},), measured state first; got shape {x.shape}")
    return x


def rows(a, b, direct, T) -> tuple[Canonical, np.ndarray]:
    """Return the form and the parameters (T, m) in the order of its names."""
    a = numbers("a", a)
    if a.ndim not in (1, 2) or not a.shape[-1] or (a.ndim == 2 and len(a) not in (1, T)):
        raise InputError(f"a must list a1..an as (n,), or one row per sample as ({T}, n); got shape {a.shape}")
    n = a.shape[-1]
    b = _per_sample(b, T, n)
    k = b.shape[1]
    blocks = [np.broadcast_to(a, (T, n)), b.reshape(T, k * n)]
    if direct is not None:
        direct = np.atleast_1d(numbers("direct", direct))
        if direct.shape != (k,):
            raise InputError(f"direct must list b0 of each of the {k} input(s), got shape {direct.shape}")
        blocks.append(np.broadcast_to(direct, (T, k)))
    return Canonical(n, k, direct is not None and k > 0), np.concatenate(blocks, axis=1)


def _per_sample(b, T, n):
    """Return b as (T, k, n)."""
    if b is None:
        return np.zeros((T, 0, n))
    b = numbers("b", b)
    if b.ndim not in (1, 2, 3) or b.shape[-1] != n or (b.ndim == 3 and len(b) not in (1, T)):
        raise InputError(f"b must list b1..b{n} for each input, like a; got shape {b.shape}")
    if b.ndim == 2 and len(b) == T:
        b = b[:, None]
    return np.broadcast_to(b, (T, *((1, n) if b.ndim == 1 else b.shape[-2:])))


def disturbances(noise, d, noise_std, v, form, T, rng):
    """Return v on the output (T,), w on the state (T, n), and the steps (T, m) of a walk of the parameters.

    w is None where it is a(t) v, which only the parameters tell.
    """
    from . import noise as noises

    n = form.n
    if d is not None:
        d = numbers("d", d)
        if d.shape not in ((n,), (T, n)):
            raise InputError(f"d must list d1..d{n}, like a; got shape {d.shape}")
        return v, d * v[:, None], None
    if isinstance(noise, noises.NoiseCovariance):
        return _correlated(noise, form, T, rng)
    variance = getattr(noise, "variance", None)
    if variance is not None:
        if noise_std:
            raise InputError(f"the noise says variance={variance:g} and noise_std={noise_std:g}: give one of them")
        v = np.sqrt(variance) * rng.standard_normal(T)
    if noise == "output" or isinstance(noise, noises.OutputError):
        return v, None, None
    if isinstance(noise, noises.NoisePolynomial):
        d = noises.resolve(noise, n, form.N, form.salut, 1.0).kappa
        return v, d * v[:, None], None
    if noise == "equation" or isinstance(noise, noises.EquationError):
        return v, np.zeros((T, n)), None
    raise InputError(f"noise must be 'output', 'equation' or a noise of Joint, got {noise!r}")


def _correlated(noise, form, T, rng):
    """Draw (w, w_n) with the covariances of a `NoiseCovariance`: w = kappa w_n + G xi."""
    from . import noise as noises

    kernel = noises.resolve(noise, form.n, form.N, form.salut, 1.0)
    size = len(kernel.kappa)
    v = np.sqrt(kernel.R) * rng.standard_normal(T)
    G = kernel.G.reshape(-1, size)
    w = v[:, None] * kernel.kappa + rng.standard_normal((T, len(G))) @ G
    return v, w[:, : form.n], (w[:, form.n :] if size > form.n else None)


def moved(theta, form, drift, jumps, walk, rng):
    """Return the parameters (T, m) with their random walk and jumps; a walk starts anew at a jump."""
    T, m = theta.shape
    steps = np.zeros((T, m)) if walk is None else walk
    if drift is not None:
        std = numbers("drift", drift)
        if std.shape not in ((), (m,)) or np.any(std < 0):
            raise InputError(f"drift is a standard deviation per sample: one, or {m} for {', '.join(form.names)}")
        steps = steps + std * rng.standard_normal((T, m))
    elif walk is None and not jumps:
        return theta
    away = np.zeros((T, m))
    away[1:] = np.cumsum(steps[:-1], axis=0)
    theta = theta.copy()
    for sample, new in sorted(_checked(jumps or {}, T).items()):
        old = theta[sample].copy()
        changed = _row(new, old, form)
        theta[sample:, changed[1]] = changed[0][changed[1]]
        away[sample:, changed[1]] -= away[sample, changed[1]].copy()
    return theta + away


def _checked(jumps, T):
    if not isinstance(jumps, dict):
        raise InputError(f"jumps must be a dictionary from sample to new parameters, got {jumps!r}")
    for sample in jumps:
        if isinstance(sample, bool) or not isinstance(sample, int | np.integer) or not 0 <= sample < T:
            raise InputError(f"jumps: sample {sample!r} is none of 0 to {T - 1}")
    return jumps


def _row(new, old, form):
    """Return the parameters (m,) after a jump and which of them it set."""
    n, k, m = form.n, form.inputs, len(old)
    if not isinstance(new, dict):
        row = numbers("jumps", new)
        if row.shape != (m,):
            raise InputError(f"a jump must list {', '.join(form.names)}, or name a, b or direct; got shape {row.shape}")
        return row, np.ones(m, bool)
    where = {"a": slice(0, n), "b": slice(n, n * (k + 1)), "direct": slice(n * (k + 1), m)}
    row, is_set = old.copy(), np.zeros(m, bool)
    for name, value in new.items():
        if name not in where:
            raise InputError(f"a jump may name a, b or direct, got {name!r}")
        value = numbers(f"jump of {name}", value).ravel()
        if value.size != len(row[where[name]]):
            raise InputError(f"the jump of {name} must list {len(row[where[name]])} numbers, got {value.size}")
        row[where[name]], is_set[where[name]] = value, True
    return row, is_set
