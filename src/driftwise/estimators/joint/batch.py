"""The joint filter's posterior after a whole record by one least squares."""

from __future__ import annotations

import math

import numpy as np

from ...detect.gate import Always
from ...engine import ud, validation
from ...engine.errors import InputError
from ...memory.constant import Constant
from ...models.noise import EquationError, NoisePolynomial
from ...models.rows import regression_rows, triangle
from ...models.scale import sigma2
from ...models.spectral import inside
from .row import HUGE

HEAD_START = 4  # times N samples by the recursion, until a learnt scale has something to go by


def batch(est, y, u=None, state=None):
    """Return the state of ``est`` after a record: what ``scan(y, u).state`` is, by another way.

    Without a walk theorem 3 is ridge least squares on data filtered by 1/C. The prior is N extra rows, x(t0) enters
    through n columns of impulse responses, and the rows are taken in stretches by QR, so memory is that of the record.

    Parameters
    ----------
    est : Joint
        With `EquationError` or `NoisePolynomial`, `Constant`, and no gate.
    y : (T,) complete outputs
    u : (T,) or (T, k) complete inputs
    state : state to start from; a fresh one if omitted

    Returns
    -------
    state
        Same dtype as a scan's: continue with `update`, read with `loglik`, `sigma2`, `model_of`. It agrees with the
        recursion to 1e-9 in mean, covariance, chi2 and logdet, at 100 000 samples too.

    Raises
    ------
    InputError
        For missing samples, other noises or memories, zeros of C not inside the circle (x then stays uncertain), or a
        signal so far above its noise that scan raises R by round-off.

    Notes
    -----
    Good for: checking the recursion with other arithmetic (orthogonal transformations instead of U D updates). Not for
    speed: the compiled recursion takes about as long, gives every innovation on the way, and minds neither
    gaps nor outliers. The first few samples are taken by the recursion, until a learnt scale is known well
    enough for its round-off floor not to matter.

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=400, noise_std=0.1, seed=1)
    >>> est = dw.Joint(2, inputs=1)
    >>> print((est.batch(y, u)["theta"] - est.scan(y, u).state["theta"]).round(12) + 0.0)
    [0. 0. 0. 0.]
    """
    d = _check(est)
    form, n = est.model, est.model.n
    y, u = validation.record(y, u, form.inputs)
    if np.isnan(y).any() or np.isnan(u).any():
        raise InputError("samples are missing: a least squares over the whole record has no row for them; use scan")
    if np.any(abs(y) >= HUGE) or np.any(abs(u) >= HUGE):
        raise InputError(f"a sample is beyond {HUGE:g}, which scan takes as missing; use scan")
    begun = est.start() if state is None else est._rows(state).view(est.dtype).reshape(())
    first = min(len(y), HEAD_START * form.N)
    states, _ = est.update_batch(begun.reshape(1), y[None, :first], u[None, :first] if form.inputs else None)
    begun, y, u = states[0], y[first:], u[first:]
    if not len(y):
        return np.array(begun)

    # s = mean + L z, z ~ N(0, I): y_f - X mean = X L z + v
    mean, L = _root(begun)
    R, root = est.policies[1].R, math.sqrt(est.policies[1].R)
    top, tail = np.eye(form.N, form.N + 1), None
    for X, target, tail in regression_rows(form, y, u, d):  # noqa: B007
        top = triangle(top, np.column_stack([X @ L, target - X @ mean]) / np.append(np.full(form.N, root), root))
    N = form.N
    z = np.linalg.solve(top[:N, :N], top[:N, N])
    spread = np.linalg.solve(top[:N, :N].T, L.T).T  # P = spread spread'
    A, c = _carry(form, d, tail, len(y))
    mean, spread = A @ (mean + L @ z) + c, A @ spread

    out = np.array(begun)
    out["x"], out["theta"] = mean[:n], mean[n:]
    out["D"], out["U"] = ud.factor_root(spread)
    out["samples"] += len(y)
    out["observed"] += len(y)
    out["status"] = 0
    out["chi2"] += top[N, N] ** 2
    out["logdet"] += len(y) * math.log(R) + 2 * np.sum(np.log(abs(np.diag(top)[:N])))
    recent = abs(y[-3000:])
    out["peak"] = max(float(begun["peak"]) * 0.75 ** len(y), np.max(recent[::-1] * 0.75 ** np.arange(len(recent))))
    out["top"] = max(float(begun["top"]), abs(y).max())
    if form.inputs:
        steps = np.diff(u, axis=0, prepend=begun["held"][None])
        out["held"], out["input_variance"] = u[-1], 0.0
        out["known"] += len(u)
        out["sums"] += u.sum(0)
        out["squares"] += (u * u).sum(0)
        out["steps"] += (steps * steps).sum(0)
    _check_floor(est, begun, out, R, abs(y).max())
    return out


def _check(est):
    """Return d (n,); refuse what one least squares cannot do, and say what to use."""
    noise = est.options["noise"]
    if est.starting:
        raise InputError(
            "batch takes the whole record at once, so a start from its first samples is of no use: start=None"
        )
    if not isinstance(noise, EquationError | NoisePolynomial):
        raise InputError(f"batch needs EquationError() or NoisePolynomial(d), not {type(noise).__name__}; use scan")
    if est.model.has_offset:
        raise InputError("batch has no column for an offset; use scan, or subtract it first")
    if not isinstance(est.policies[2], Constant):
        raise InputError("batch needs parameters that stay constant (memory=Constant()); use scan")
    if not isinstance(est.policies[3], Always):
        raise InputError("batch has no gate: an outlier must be found sample by sample; use scan")
    if not est.policies[1].R > 0:
        raise InputError("batch needs noise: with variance 0 every sample is exact; use scan")
    if isinstance(noise, EquationError):
        return np.zeros(est.model.n)
    try:
        return inside("d", noise.d)
    except InputError as error:
        raise InputError(f"{error}. batch filters by 1/C, which then grows for ever; scan does not mind") from None


def _check_floor(est, begun, out, R, top):
    """The recursion raises R by the round-off of y; refuse where that would show."""
    floor = est.options["floor"]
    scale = min(sigma2(est.scale, float(s["observed"]), float(s["chi2"])) for s in (begun, out))
    if floor and not (floor * top) ** 2 < 1e-11 * R * scale:
        raise InputError(
            f"y reaches {top:.3g}, so large against its noise that scan raises R by the round-off of y sample by "
            "sample, which batch cannot do; use scan, or floor=0"
        )


def _root(state):
    """Return the mean (N,) and a root L of the covariance, P = L L'."""
    return np.concatenate([state["x"], state["theta"]]), ud.unpack_root(state["U"], state["D"])


def _carry(form, d, tail, T):
    """Return (A, c): s(T) = A s(0) + c, given the data behind ``tail``.

    x+ = F x + (d - a) y + (b - d b0) u with F = shift_up - d e_1'. Powers of F are impulse responses of 1/C:
    F^T = sum_k B_k h(T - k) and sum_j F^(T-1-j) y(j) = sum_k B_k y_f(T-1-k), where
    (zI - F)^-1 = sum_k B_k z^(n-1-k) / C(z).
    """
    n, c = form.n, d[::-1]
    F = np.eye(n, k=1)
    F[:, 0] -= c
    B = [np.eye(n)]
    for k in range(1, n):
        B.append(F @ B[-1] + c[k - 1] * np.eye(n))
    sums = [sum(b * value for b, value in zip(B, column)) for column in tail.T]  # of h, y_f, u_f
    A, offset = np.eye(form.N), np.zeros(form.N)
    A[:n, :n] = F @ sums[0]  # tail holds h(T-1), ..: one step short
    A[:n, n : 2 * n] = -sums[1]
    offset[:n] = sums[1] @ c
    for i in range(form.inputs):
        A[:n, n * (i + 2) : n * (i + 3)] = sums[2 + i]
        if form.direct:
            A[:n, form.N - form.direct_terms + i] = -sums[2 + i] @ c
    return A, offset
