"""Records from a known plant, of one output or several: missing, drifting, jumping, whatever a test needs."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..engine.errors import InputError
from . import paths
from .canonical import Canonical
from .noise import NoiseCovariance, covariances
from .structure import Structure, indices

LIMIT = 1e100  # what an estimator takes for a measurement


class _Pair(NamedTuple):
    y: np.ndarray
    u: np.ndarray | None


class Record(_Pair):
    """A pair (y, u) that also knows the truth: ``parameters`` (T, m) and ``x`` (T, n), in the orders of a trace."""

    parameters: np.ndarray
    x: np.ndarray
    __array_ufunc__ = None  # an array leaves the arithmetic to the pair, which has none

    def _refuse(self, other):
        raise InputError("a record is a pair (y, u): take its .y, as in y - model.simulate(u).y")

    __sub__ = __rsub__ = __radd__ = __truediv__ = __rtruediv__ = _refuse

    def __array__(self, *args, **kwargs):
        return self._refuse(None)


def simulate(
    a: Any,
    b=None,
    *,
    samples: int | None = None,
    noise_std: float = 0.0,
    noise: Any = "equation",
    d=None,
    direct=None,
    u=None,
    missing: float = 0.0,
    seed: int = 0,
    missing_inputs: float = 0.0,
    x0=None,
    drift=None,
    jumps: dict | None = None,
) -> Record:
    """Return (y, u) of a plant A(q) y = B(q) u + C(q) v; the pair also holds the true ``parameters`` and ``x``.

    Parameters
    ----------
    a : (n,) or (T, n), or a Model
        a1..an; a row per sample lets the parameters drift or jump. A `Model` brings its own b and direct terms.
    b : (n,), (k, n), (T, n) or (T, k, n), optional
        b1..bn of each input. Two axes are read as (T, n) where the first one is ``samples`` long.
    samples : int
        T; the length of ``u`` if omitted.
    noise_std : float
        Standard deviation of v.
    noise : "equation" (white in the equation), "output" (white on y), or a noise of `Joint`
        `EquationError`, `OutputError` and `NoisePolynomial` take ``noise_std`` where they have no variance;
        `NoiseCovariance(Q, S, R)` is taken as it is, in Salut's order. Ignored where ``d`` is given.
    d : (n,), optional
        d1..dn of C(q) = 1 + d1 q^-1 + ...
    direct : (k,), optional
        b0 of each input.
    u : (T,) or (T, k), optional
        Inputs; random signs held for one to five samples if omitted.
    missing, missing_inputs : float
        Fraction of the outputs, and of the inputs, to lose (NaN). The plant has seen them.
    seed : int
    x0 : (n,), optional
        State at the first sample, measured state first; zero if omitted.
    drift : float or (m,), optional
        Standard deviation per sample of a random walk of each parameter, in the order a1.., b1.., b0.
    jumps : {sample: (m,) or {"a": .., "b": .., "direct": ..}}, optional
        New parameters from that sample on; what a dictionary does not name stays.

    Returns
    -------
    y : (T,)
    u : (T,) or (T, k); None where there is no input

    Raises
    ------
    InputError
        Where shapes do not fit, or where the plant is unstable and y passes 1e100.

    Notes
    -----
    Bad at speed: a Python loop, some 5 us per sample. Drift knows no bounds: a long walk of a leaves the unit circle.

    Examples
    --------
    >>> y, u = simulate([-0.8], [1.0], samples=3, u=[1, 0, 0], noise_std=0)
    >>> print(y)
    [0.  1.  0.8]
    >>> record = simulate([-0.8], [1.0], samples=4, jumps={2: {"a": [-0.5]}})
    >>> record.parameters[:, 0].tolist()
    [-0.8, -0.8, -0.5, -0.5]
    """
    if hasattr(a, "form"):
        if b is not None or direct is not None:
            raise InputError("a model brings its own b and direct terms: leave b and direct out")
        b, direct, a, c = paths.of_model(a)
        d = c if d is None else d
    T = paths.length(samples, u)
    rng = np.random.default_rng(seed)
    form, theta = paths.rows(a, b, direct, T)
    k = form.inputs
    if u is None:
        u = _signs(rng, T, k)
    u = paths.inputs(u, T, k)
    v = paths.spread("noise_std", noise_std) * rng.standard_normal(T)
    lost = rng.random(T) < paths.fraction("missing", missing)

    truth = np.random.default_rng([seed, 1])  # a stream of its own: what is added does not move u and v
    v, w, walk = paths.disturbances(noise, d, noise_std, v, form, T, truth)
    theta = paths.moved(theta, form, drift, jumps, walk, truth)
    if w is None:
        w = theta[:, : form.n] * v[:, None]  # white on the output: C = A
    y, x = _run(form, theta, u, v, w, paths.start(x0, form.n))

    y[lost] = np.nan
    u = u.copy()
    u[truth.random(u.shape) < paths.fraction("missing_inputs", missing_inputs)] = np.nan
    record = Record(y, None if k == 0 else u[:, 0] if k == 1 else u)
    record.parameters, record.x = theta, x
    return record


def _run(form: Canonical, theta, u, v, w, x):
    """Return y (T,) and the states (T, n) of x+ = shift_up(x) - a y + b u + w, y = x[0] + b0 u + v."""
    n, k, T = form.n, form.inputs, len(u)
    a, b = theta[:, :n], theta[:, n : n * (k + 1)].reshape(T, k, n)
    b0 = theta[:, n * (k + 1) :] if form.direct else np.zeros((T, k))
    y, states = np.empty(T), np.empty((T, n))
    for t in range(T):
        states[t] = x
        y[t] = x[0] + b0[t] @ u[t] + v[t]
        if not abs(y[t]) < LIMIT:
            size = max(abs(np.roots(np.append(1.0, a[t]))), default=0.0)
            raise InputError(
                f"y passes {LIMIT:.0e} at sample {t}: the plant is unstable there (largest pole {size:.3g}). "
                "Was the sign of a changed (y(t) = -a1 y(t-1) - ...)? Otherwise ask for fewer samples."
            )
        x = np.append(x[1:], 0.0) - a[t] * y[t] + u[t] @ b[t] + w[t]
    return y, states


def _signs(rng, T: int, k: int) -> np.ndarray:
    """Return random signs (T, k), held for one to five samples."""
    return np.repeat(rng.choice([-1.0, 1.0], (T, k)), rng.integers(1, 6, T), axis=0)[:T]


def simulate_mimo(
    structure,
    parameters,
    *,
    samples: int,
    inputs: int = 0,
    direct: bool = False,
    noise_std=0.0,
    noise: NoiseCovariance | None = None,
    u=None,
    x0=None,
    missing: float = 0.0,
    seed: int = 0,
):
    """Return (y, u) of a plant with several outputs in canonical form.

    Parameters
    ----------
    structure : (p,), or a Structure
        Structure indices nu_1 .. nu_p; a Structure (``form`` of a `ModelMIMO`) brings inputs and direct terms along.
    parameters : (m,) or (T, m)
        In the order of ``JointMIMO(structure, inputs, direct).names``; a row per sample lets them drift or jump.
    samples : int
        T.
    inputs, direct : as in `JointMIMO`
    noise_std : float or (p,)
        Standard deviation of the white equation error of each output.
    noise : NoiseCovariance, optional
        Q (n, n), S (n, p), R (p, p) of the stacked noise in Salut's order, in place of ``noise_std``.
    u : (T,) or (T, k), optional
        Inputs; random signs held for one to five samples if omitted.
    x0 : (n,), optional
        State before the first sample, measured state of each output first; zero if omitted.
    missing : float
        Fraction of the samples of each output to lose (NaN).
    seed : int

    Returns
    -------
    y : (T, p)
    u : (T, k); None where there is no input

    Raises
    ------
    InputError
        Where a shape does not fit.

    Notes
    -----
    The model is that of `Structure` (its docstring has the equations). Bad at plants that were not thought of in
    canonical form: any state space has one, but its parameters are rarely what one knows.

    Examples
    --------
    >>> y, u = simulate_mimo((1, 1), [-0.5, 0.0, 1.0, -0.2, 0.0, 2.0], samples=3, inputs=1, u=[1, 0, 0])
    >>> print(y)
    [[0.  0. ]
     [1.  2. ]
     [0.5 0.2]]
    """
    form = structure
    if not isinstance(form, Structure):
        form = Structure(indices(structure, inputs), inputs, bool(direct) and inputs > 0)
    T, n, p, k = int(samples), form.n, form.outputs, form.inputs
    theta = np.asarray(parameters, float)
    if theta.shape not in ((form.N - n,), (T, form.N - n)):
        raise InputError(f"parameters must list the {form.N - n} numbers {form.names}; got shape {theta.shape}")
    theta = np.broadcast_to(theta, (T, form.N - n))
    rng = np.random.default_rng(seed)
    if u is None:
        u = _signs(rng, T, k)
    u = np.asarray(u, float)
    if u.size != T * k:
        raise InputError(f"u must be ({T}, {k}), got shape {u.shape}")
    u = u.reshape(T, k)
    Q, S, R = np.zeros((n, n)), np.zeros((n, p)), np.diag(np.broadcast_to(np.square(noise_std), p))
    if noise is not None:
        Q, S, R = covariances(noise, form, np.ones(p))
    w = rng.multivariate_normal(np.zeros(n + p), np.block([[Q, S], [S.T, R]]), T, method="eigh")
    x, y = np.zeros(n) if x0 is None else np.array(x0, float), np.empty((T, p))
    ends = np.array(form.x_at[1:]) - 1
    for t in range(T):
        A, B = form.polynomials(theta[t])
        rest = x[form.x_at[:-1]] + B[0] @ u[t] + w[t, n:]
        for i in range(p):
            y[t, i] = rest[i] - A[0, i, :i] @ y[t, :i]
        x = np.append(x[1:], 0.0)
        x[ends] = 0.0
        x += w[t, :n]
        for i, nu in enumerate(form.nu):
            first = form.x_at[i]
            x[first : first + nu] += B[1 : nu + 1, i] @ u[t] - A[1 : nu + 1, i] @ y[t]
    y[rng.random((T, p)) < missing] = np.nan
    return y, (u if k else None)
