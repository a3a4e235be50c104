"""Records of a known plant with several outputs."""

from __future__ import annotations

import numpy as np

from ..engine.errors import InputError
from .noise import NoiseCovariance
from .noise_many import covariances
from .structure import Structure, indices


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
        u = np.repeat(rng.choice([-1.0, 1.0], (T, k)), rng.integers(1, 6, T), axis=0)[:T]
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
