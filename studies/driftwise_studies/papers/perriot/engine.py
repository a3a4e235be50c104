"""The paper's generic recursion (1)-(5) in plain NumPy: pseudo-linear and gradient form, R, U-D and random walk.

It shares no code with the estimators of the package, so that it can be their oracle. theta multiplies the regressor
with PLUS signs here (y = theta nu + v): an AR coefficient is -a of the rest of the package.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from . import factors


class Structure(NamedTuple):
    """The known matrices: x (n0), y (p), u (m), nu (s), theta (p, s).

    nu = H x + T u;   y = C x + D u + theta nu + v;   x+ = F x + G theta nu + B u + K y. The paper has no C and no D.
    """

    F: np.ndarray  # n0, n0
    G: np.ndarray  # n0, p
    B: np.ndarray  # n0, m
    H: np.ndarray  # s, n0
    K: np.ndarray  # n0, p
    T: np.ndarray  # s, m
    C: np.ndarray  # p, n0
    D: np.ndarray  # p, m


class Run(NamedTuple):
    """What a recursion leaves: theta (T, p, s) after each sample, eps (T, p) before it, and the last x, W and Psi."""

    theta: np.ndarray
    eps: np.ndarray
    x: np.ndarray
    W: np.ndarray
    Psi: np.ndarray


def registers(na=0, nf=0, nb=0, nc=0, p=1, m=1, direct=False) -> Structure:
    """Return a shift-register structure; x stacks past y, model outputs w, u and residuals e, newest first.

    na alone is ARX, nf output error (Landau), na with nc ARMAX (extended least squares, RML1). ``direct`` lets u of
    the same sample into nu.
    """
    sizes = [na * p, nf * p, nb * m, nc * p]
    n0 = sum(sizes)
    starts = np.cumsum([0, *sizes[:-1]])
    F, G, B, K = np.zeros((n0, n0)), np.zeros((n0, p)), np.zeros((n0, m)), np.zeros((n0, p))
    for start, size, width in zip(starts, sizes, (p, p, m, p)):
        inside = start + np.arange(width, size)
        F[inside, inside - width] = 1.0
    enters = [(K, 1.0, p), (G, 1.0, p), (B, 1.0, m), (K, 1.0, p)]
    for start, size, (matrix, sign, width) in zip(starts, sizes, enters):
        if size:
            matrix[start : start + width] = sign * np.eye(width)
    if nc:
        G[starts[3] : starts[3] + p] = -np.eye(p)  # the newest residual is y - theta nu
    s = n0 + (m if direct else 0)
    H, T = np.eye(s, n0), np.eye(s, m, -n0) if direct else np.zeros((s, m))
    return Structure(F, G, B, H, K, T, np.zeros((p, n0)), np.zeros((p, m)))


def hampton(Phi: float) -> Structure:
    """Return Hampton's adaptive Kalman gain (theta = K) as a member of the class; it needs C, and theta a priori.

    x = [Phi xh(n-1 | n-2), eps_{n-1}], so that the output of the model is x_1 + K Phi eps_{n-1}.
    """
    one = np.zeros((1, 1))
    return Structure(
        F=np.array([[Phi, 0.0], [-1.0, 0.0]]),
        G=np.array([[Phi], [-1.0]]),
        B=np.zeros((2, 1)),
        H=np.array([[0.0, Phi]]),
        K=np.array([[0.0], [1.0]]),
        T=one,
        C=np.array([[1.0, 0.0]]),
        D=one,
    )


# --- gain sequences ----------------------------------------------------------------------------------------


def limited(n, N):
    """Return (6): 1/n, but never below 1/N."""
    return np.maximum(1.0 / np.asarray(n, float), 1.0 / N)


def weighted(n, p):
    """Return (8): (1 - p)/(1 - p^n), the gains of measurements weighted by p per sample (p = 1: 1/n)."""
    n = np.asarray(n, float)
    return 1.0 / n if p == 1.0 else (1 - p) / -np.expm1(n * np.log(p))


def forgetting(gains, first):
    """Return the forgetting factors that do what a gain sequence does; ``first`` is the gain before it."""
    g = np.concatenate([[first], gains])
    return g[:-1] * (1 - g[1:]) / g[1:]


# --- what turns rows and errors into a change of theta ---------------------------------------------------------


class Information:
    """(5) and (4) as printed: R first, then theta with the new R."""

    def __init__(self, R0, Lam=None):
        self.R, self.Lam = np.array(R0, float), Lam

    def __call__(self, g, rows, e):
        """Return the change of theta for rows (r, k) and errors (r, c)."""
        rows, e = factors.whiten(self.Lam, rows, e)
        self.R = self.R + g * (rows.T @ rows - self.R)
        return g * np.linalg.solve(self.R, rows.T @ e)


class Swapped(Information):
    """Negative control: (4) before (5), so with the R of the sample before."""

    def __call__(self, g, rows, e):
        """Return the change of theta."""
        old = self.R
        super().__call__(g, rows, e)
        return g * np.linalg.solve(old, rows.T @ e)


class Factored:
    """The same in U-D form: P = g R^-1, a gain sequence as forgetting factors; a reset only scales D."""

    def __init__(self, R0, first=1.0, Lam=None):
        self.U, self.d = factors.factorise(first * np.linalg.inv(R0))
        self.g, self.Lam = first, Lam

    @property
    def P(self):
        """P as a matrix."""
        return self.U * self.d @ self.U.T

    def __call__(self, g, rows, e):
        """Return the change of theta."""
        self.d, self.g = self.d / (self.g * (1 - g) / g), g
        self.U, self.d, step = factors.correct(self.U, self.d, *factors.whiten(self.Lam, rows, e))
        return step


class Walking:
    """Theta as a random walk with variance q per sample; the noise covariance is the mean of past eps eps'.

    ``prior`` = (n_c, Lam_0) starts that mean as if n_c samples had given Lam_0; without it the first sample only
    starts the mean.
    """

    def __init__(self, q, P0, memory=100.0, prior=None):
        self.U, self.d = factors.factorise(np.atleast_2d(P0))
        self.q, self.memory, self.n = np.asarray(q, float), memory, 0
        self.weight = 0.0 if prior is None else prior[0]
        self.Lam: Any = None if prior is None else np.atleast_2d(prior[1])

    @property
    def P(self):
        """P as a matrix."""
        return self.U * self.d @ self.U.T

    def __call__(self, _, rows, e):
        """Return the change of theta; ``_`` is the gain, which P replaces."""
        self.U, self.d = factors.widen(self.U, self.d, self.q)
        step = np.zeros((rows.shape[1], e.shape[1]))
        if self.Lam is not None:
            self.U, self.d, step = factors.correct(self.U, self.d, *factors.whiten(self.Lam, rows, e))
        seen = np.outer(e, e)
        old = seen if self.Lam is None else self.Lam
        self.Lam = old + max(1 / self.memory, 1 / (self.n + 1 + self.weight)) * (seen - old)
        self.n += 1
        return step


# --- the recursion ----------------------------------------------------------------------------------------------


def run(
    structure: Structure,
    y,
    u,
    gains,
    change,
    theta0,
    *,
    gradient=False,
    posterior=True,
    posterior_gradient=None,
    project=False,
    x0=None,
) -> Run:
    """Return what the recursion leaves after y (T, p) and u (T, m) with the gain of each sample.

    Parameters
    ----------
    change : `Information`, `Factored` or `Walking`
    gradient : rows Psi = d yhat / d theta (RPEM) instead of nu (PLR); then R is (p s, p s), theta row by row
    posterior : theta_n in (2) as the paper has it; Hampton's filter needs theta_{n-1}
    posterior_gradient : the same for the gradient; mixing the two is a negative control
    project : halve a step until F + G theta H is stable

    Examples
    --------
    y = .7 y_{n-1} + u_{n-1} without noise, gains 1/2, 1/3, ... after a prior R_0 with gain 1:

    >>> y, u = np.zeros((200, 1)), np.random.default_rng(0).standard_normal((200, 1))
    >>> for n in range(1, 200):
    ...     y[n] = 0.7 * y[n - 1] + u[n - 1]
    >>> change = Information(1e-6 * np.eye(2))
    >>> found = run(registers(na=1, nb=1), y, u, 1 / np.arange(2.0, 202), change, np.zeros((1, 2)))
    >>> print(found.theta[-1].round(3))
    [[0.7 1. ]]
    """
    F, G, B, H, K, T, C, D = structure
    p, s = C.shape[0], H.shape[0]
    theta, x = np.array(theta0, float).reshape(p, s), np.zeros(len(F)) if x0 is None else np.array(x0, float)
    W, Psi = np.zeros((len(F), p * s)), np.zeros((p, p * s))
    same = posterior if posterior_gradient is None else posterior_gradient
    thetas, errors = [], []
    for y_n, u_n, g in zip(y, u, gains):
        nu = H @ x + T @ u_n
        eps = y_n - C @ x - D @ u_n - theta @ nu
        E = np.kron(np.eye(p), nu)
        Psi = (C + theta @ H) @ W + E
        step = change(g, Psi, eps[:, None]).reshape(p, s) if gradient else change(g, nu[None], eps[None]).T
        new = stable(structure, theta, theta + step) if project else theta + step
        chosen, chosen_gradient = new if posterior else theta, new if same else theta
        W = (F + G @ chosen_gradient @ H) @ W + G @ E
        x = F @ x + G @ chosen @ nu + B @ u_n + K @ y_n
        theta = new
        thetas.append(theta)
        errors.append(eps)
    return Run(np.array(thetas), np.array(errors), x, W, Psi)


def stable(structure: Structure, old, new, margin=1e-3):
    """Return ``new``, halved towards ``old`` until the spectral radius of F + G theta H is below 1 - margin."""
    F, G, H = structure.F, structure.G, structure.H
    for _ in range(30):
        if np.abs(np.linalg.eigvals(F + G @ new @ H)).max() <= 1 - margin:
            return new
        new = (new + old) / 2
    return old
