"""Models of one output and of several out of estimated parameters: state space, poles, gains, and their covariances."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..engine.errors import InputError
from .canonical import Canonical
from .markup import markup
from .response import denominator_std, gain_interval, response
from .roots import Roots, WithPoles, drawn, estimate, parts, solve, spread
from .simulation import simulate
from .structure import Structure

ONE = np.ones(1)


class StateSpace:
    """A, B, C, D of a model, for whoever goes on with them; ``dt`` is 0 in continuous time."""

    form: Any
    dt: float
    A: Any
    B: Any
    C: Any
    D: Any

    @property
    def names(self) -> list[str]:
        """Names of the parameters."""
        return self.form.names

    def to_scipy(self) -> tuple:
        """Return ``(A, B, C, D, dt)``, what scipy.signal's dlti and dlsim take (`scipy.signal.dlti(*abcd, dt=dt)`)."""
        return self.A, self.B, self.C, self.D, self.dt

    def to_control(self) -> Any:
        """Return a python-control StateSpace (needs the extra ``control``)."""
        if not self.form.inputs:
            raise InputError("the model has no input, so it has no transfer function; its poles are in model.poles")
        try:
            import control
        except ImportError:
            raise ImportError("to_control() needs python-control: pip install driftwise[control]") from None
        return control.StateSpace(self.A, self.B, self.C, self.D, self.dt)


class ObserverForm(StateSpace):
    """A and C of one output in observer canonical form: the measured state is the first one."""

    values: Any

    @property
    def A(self) -> np.ndarray:
        """State matrix E - a C; in continuous time in 1/s."""
        n = self.form.n
        A = np.eye(n, k=1)
        A[:, 0] -= self.values[:n]
        return A

    @property
    def C(self) -> np.ndarray:
        """Output matrix (1, n)."""
        return np.eye(1, self.form.n)


@dataclass(frozen=True)
class Model(ObserverForm, WithPoles):
    """Discrete state space in observer canonical form, with the covariance of its parameters.

    x(t+1) = A x(t) + B u(t), y(t) = C x(t) + D u(t); C = [1, 0, ..].

    Uncertainties are first order (delta method, dp/da_i = -p^i / D'(p) for a pole p) where that holds. Poles and zeros
    that lie closer together than a few of their std are sampled: 8192 Gaussian draws of the parameters from a fixed
    seed, second moments about the root itself. Whatever is divided by a number that cannot be told from zero (a gain
    near an integrator, a zero where b1 is nothing) has an infinite std. ``notes`` says in words where that happened.

    Bad at: laws far from Gaussian. A nearly double pole is uncertain along a cross, not an ellipse; look at
    `samples`. The covariance is the estimator's own: under a wrong noise model it is not the error.

    Parameters
    ----------
    form : Canonical
        Order, inputs, which terms there are.
    values : (m,)
        a1.., b1.., in the order of ``names``.
    covariance : (m, m)
    dt : float
        Seconds between samples.

    Examples
    --------
    >>> import numpy as np
    >>> from driftwise.models.canonical import Canonical
    >>> m = Model(Canonical(2, inputs=1), np.array([-1.5, 0.56, 1.0, -0.5]), 1e-4 * np.eye(4))
    >>> m.poles.real.round(3).tolist(), m.zeros().real.tolist(), m.poles_std.round(2).tolist()
    ([0.8, 0.7], [0.5], [0.09, 0.08])
    >>> m.notes
    ['poles 1 and 2 nearly coincide: sampled']
    """

    form: Canonical
    values: np.ndarray  # a1..an, b1..bn of each input, b0
    covariance: np.ndarray
    dt: float = 1.0

    @property
    def B(self) -> np.ndarray:
        """Input matrix b - a b0, (n, k)."""
        a, b = self.form.polynomials(self.values)
        return b[:, 1:].T - np.outer(a[1:], b[:, 0])

    @property
    def D(self) -> np.ndarray:
        """Direct terms (1, k)."""
        return self.form.polynomials(self.values)[1][:, :1].T

    @property
    def noise_polynomial(self) -> np.ndarray:
        """C (n + 1,) in powers of q^-1, as far as it is a parameter; 1, 0, .. where it is not."""
        return self.form.noise_polynomial(self.values)

    # --- poles and zeros -----------------------------------------------------------------------------------

    @cached_property
    def samples(self) -> np.ndarray:
        """Parameters (8192, m) drawn from their posterior with a fixed seed."""
        return drawn(self.values, self.covariance, np.random.default_rng(0))

    @cached_property
    def _poles(self) -> Roots:
        n = self.form.n
        P = np.zeros((n + 1, n + 1))
        P[1:, 1:] = self.covariance[:n, :n]
        a = self.form.polynomials(self.values)[0]
        return estimate(a, P, lambda: np.insert(self.samples[:, :n], 0, 1.0, axis=1), "pole", ["1", *self.names[:n]])

    @cached_property
    def _zeros(self) -> list[Roots]:
        found = []
        n, k, direct = self.form.n, self.form.inputs, self.form.direct
        for i in range(k):
            at = [self.form.direct_at + i] * direct + list(range(n * (i + 1), n * (i + 2)))
            names = [self.names[j] for j in at]
            what = "zero" if k == 1 else f"input {i + 1}'s zero"
            P = self.covariance[np.ix_(at, at)]
            found.append(estimate(self.values[at], P, lambda: self.samples[:, at], what, names))
        return found

    def _zeros_of(self, input) -> Roots:
        if isinstance(input, bool) or input not in range(self.form.inputs):
            raise InputError(f"input must be one of 0 to {self.form.inputs - 1}, got {input!r}; they count from 0")
        return self._zeros[input]

    def zeros(self, input: int = 0) -> np.ndarray:
        """Return the zeros from an input, largest first: n with a direct term, else n - 1; inf at infinity.

        A zero whose std is infinite may lie at infinity: the leading coefficient cannot be told from 0 (see ``notes``).
        """
        return self._zeros_of(input).values

    def zeros_covariance(self, input: int = 0) -> np.ndarray:
        """Return the covariance (.., 2, 2) of (real, imaginary) part of each zero."""
        return self._zeros_of(input).covariance

    def zeros_std(self, input: int = 0) -> np.ndarray:
        """Return the root mean square radius of uncertainty of each zero."""
        return self._zeros_of(input).std

    def zeros_method(self, input: int = 0) -> list[str]:
        """Return how the uncertainty of each zero was found: "first order", "sampled", or "infinite" for lost ones."""
        return self._zeros_of(input).method

    @property
    def notes(self) -> list[str]:
        """What is not an ordinary standard deviation here, in words; empty where everything is."""
        found = [*self._poles.notes, *(note for z in self._zeros for note in z.notes)]
        if self.form.inputs and np.isinf(self.dc_gain_std).any():
            den, std = self.form.polynomials(self.values)[0].sum(), denominator_std(self.form, self.covariance, ONE)[0]
            found.append(f"A(1) = {den:.2g} ± {std:.2g} cannot be told from 0: the steady-state gain has no bound")
        return found

    # --- gains ---------------------------------------------------------------------------------------------

    def frequency_response(self, w) -> tuple[np.ndarray, np.ndarray]:
        """Return G (k, len(w)) and the covariance (k, len(w), 2, 2) of its (real, imaginary) parts at ``w`` rad/s.

        First order; sampled where A(e^{jw}) is less clear of zero, infinite where it cannot be told from zero.
        """
        z = np.exp(1j * np.asarray(w, float) * self.dt)
        return response(self.form, self.values, self.covariance, lambda: self.samples, np.atleast_1d(z))

    @cached_property
    def _dc(self):
        return response(self.form, self.values, self.covariance, lambda: self.samples, ONE)

    @property
    def dc_gain(self) -> np.ndarray:
        """Steady-state gain from each input, (k,); infinite for an exact integrator."""
        return self._dc[0][:, 0].real

    @property
    def dc_gain_std(self) -> np.ndarray:
        """Standard deviation of the steady-state gains; infinite where A(1) lies within four std of zero."""
        return np.sqrt(self._dc[1][:, 0, 0, 0])

    def dc_gain_interval(self, level: float = 0.95) -> np.ndarray:
        """Return the interval (k, 2) of the steady-state gains after Fieller: exact where the std fails.

        The whole line where A(1) cannot be told from zero at that level.
        """
        if not 0 < level < 1:
            raise InputError(f"level is a probability between 0 and 1, got {level!r}; was it meant in percent?")
        return gain_interval(self.form, self.values, self.covariance, level)

    # --- out -----------------------------------------------------------------------------------------------

    def _repr_html_(self):
        return markup("\n".join(self.notes), list(zip(self.names, self.values, np.sqrt(np.diag(self.covariance)))))

    def simulate(self, u=None, *, samples: int | None = None, **options):
        """Return a `simulate`d record (y, u) of this model; ``options`` are those of `driftwise.simulate`."""
        return simulate(self, u=u, samples=samples, **options)

    def to_transfer_function(self) -> tuple[np.ndarray, np.ndarray]:
        """Return numerators (k, n + 1) and denominator (n + 1,) in powers of q^-1, which is descending powers of z.

        A row goes to `scipy.signal.dlti(numerator, denominator, dt=dt)` or `control.tf(numerator, denominator, dt)`.
        """
        denominator, numerators = self.form.polynomials(self.values)
        return numerators, denominator


@dataclass(frozen=True)
class ModelMIMO(StateSpace):
    """Discrete state space of several outputs, with the covariance of its parameters.

    x(t+1) = A x(t) + B u(t), y(t) = C x(t) + D u(t); the states are those of `Structure`, each output's measured one
    first.
    An output that acts at once on a later one (a0) is solved for in C and D. Uncertainties are first order: a simple
    pole p with left and right eigenvectors l, r moves by l' dA r / l' r. They fail for poles that nearly coincide:
    `close_poles` lists those that their error bars do not tell apart; sample from ``covariance`` there.

    Examples
    --------
    >>> model = ModelMIMO(Structure((1, 1)), np.array([-0.5, 0.0, -0.2, -0.9]), np.eye(4) * 1e-4)
    >>> print(model.poles.real, model.poles_std.round(4), model.close_poles)
    [0.9 0.5] [0.0112 0.0112] []
    """

    form: Structure
    values: np.ndarray
    covariance: np.ndarray
    dt: float = 1.0

    @cached_property
    def _parts(self):
        """Return G_y (n, p), G_u (n, k), L (p, p), D0 (p, k) of x+ = shift(x) - G_y y + G_u u, L y = x_0 + D0 u."""
        form = self.form
        n, p, k = form.n, form.outputs, form.inputs
        A, B = form.polynomials(self.values)
        G_y, G_u = np.zeros((n, p)), np.zeros((n, k))
        for i, nu in enumerate(form.nu):
            G_y[form.x_at[i] : form.x_at[i + 1]] = A[1 : nu + 1, i]
            G_u[form.x_at[i] : form.x_at[i + 1]] = B[1 : nu + 1, i]
        return G_y, G_u, A[0], B[0]

    @property
    def A(self) -> np.ndarray:
        """State matrix (n, n)."""
        form = self.form
        A = np.eye(form.n, k=1)
        A[np.array(form.x_at[1:]) - 1] = 0.0
        return A - self._parts[0] @ self.C

    @property
    def B(self) -> np.ndarray:
        """Input matrix (n, k)."""
        G_y, G_u, _, _ = self._parts
        return G_u - G_y @ self.D

    @property
    def C(self) -> np.ndarray:
        """Output matrix (p, n)."""
        measured = np.eye(self.form.n)[self.form.x_at[:-1]]
        return np.linalg.solve(self._parts[2], measured)

    @property
    def D(self) -> np.ndarray:
        """Direct terms (p, k)."""
        return np.linalg.solve(self._parts[2], self._parts[3])

    @cached_property
    def _poles(self):
        """Poles, largest first, and their derivatives with respect to the parameters (n, m)."""
        from scipy.linalg import eig

        form, A, C = self.form, self.A, self.C
        poles, left, right = eig(A, left=True)
        J = np.zeros((form.n, len(self.values)), complex)
        G_y, _, L, _ = self._parts
        seen = C @ right  # (p, n): what each mode shows
        push = left.conj().T  # (n, n)
        size = np.einsum("ij,ji->i", push, right)
        at_once = push @ G_y @ np.linalg.inv(L)
        with np.errstate(divide="ignore", invalid="ignore"):
            for m, (i, j, lag) in enumerate(zip(form.targets, form.sources, form.lags)):
                if j < form.outputs:
                    pushed = -push[:, form.x_at[i] + lag - 1] if lag else at_once[:, i]
                    J[:, m] = pushed * seen[j] / size
        order = np.argsort(-abs(poles), kind="stable")
        return poles[order].astype(complex), J[order]

    @property
    def poles(self) -> np.ndarray:
        """Poles, largest first, (n,)."""
        return self._poles[0]

    @property
    def poles_covariance(self) -> np.ndarray:
        """Covariance of (real, imaginary) of each pole, (n, 2, 2); infinite for a multiple one."""
        J = np.stack([self._poles[1].real, self._poles[1].imag], axis=1)
        with np.errstate(over="ignore", invalid="ignore"):
            C = J @ self.covariance @ J.swapaxes(1, 2)
        C[~np.isfinite(C).all(axis=(1, 2))] = np.inf
        return C

    @property
    def poles_joint_covariance(self) -> np.ndarray:
        """Covariance (2 n, 2 n) of all poles at once, real and imaginary part in turn; NaN beside a multiple one."""
        return spread(parts(self._poles[1]), self.covariance)

    @property
    def poles_std(self) -> np.ndarray:
        """Root mean square radius of uncertainty of each pole, (n,)."""
        return np.sqrt(np.trace(self.poles_covariance, axis1=1, axis2=2))

    @property
    def close_poles(self) -> list[tuple[int, int]]:
        """Pairs of poles nearer to each other than two of their standard deviations: their first-order bars fail."""
        p, std = self.poles, self.poles_std
        pairs = [(i, j) for i in range(len(p)) for j in range(i + 1, len(p))]
        return [(i, j) for i, j in pairs if not abs(p[i] - p[j]) > 2 * (std[i] + std[j])]

    @property
    def zeros(self) -> np.ndarray:
        """Transmission zeros, where G(z) loses rank, largest first; for as many inputs as outputs.

        The roots of det diag(z^nu_i) B(z), of degree n with direct terms, else n - p; inf at infinity. (A plant with
        more outputs than inputs, or fewer, has none, unless by coincidence.)
        """
        form = self.form
        if form.inputs != form.outputs:
            raise InputError(
                f"zeros are of as many inputs as outputs, the model has {form.inputs} and {form.outputs}; "
                "for one channel use control.tf or scipy on to_scipy()"
            )
        # a determinant of polynomials is interpolated on the unit circle, where the FFT is the inverse
        skip = 0 if form.direct else 1
        degree = form.n - skip * form.outputs
        z = np.exp(2j * np.pi * np.arange(degree + 1) / (degree + 1))
        rows = np.zeros((degree + 1, form.outputs, form.outputs), complex)
        B = form.polynomials(self.values)[1]
        for i, nu in enumerate(form.nu):
            rows[:, i] = z[:, None] ** np.arange(nu - skip, -1, -1) @ B[skip : nu + 1, i]
        c = np.fft.fft(np.linalg.det(rows)).real / (degree + 1)
        largest = abs(c).max()
        return solve(np.where(abs(c) > 1e-13 * largest, c, 0.0)[::-1]) if largest > 0 else np.zeros(0, complex)

    @property
    def is_stable(self) -> bool:
        """Whether every pole lies inside the unit circle."""
        return bool(np.all(abs(self.poles) < 1))

    def frequency_response(self, w) -> tuple[np.ndarray, np.ndarray]:
        """Return G (p, k, len(w)) at ``w`` rad/s, and the covariance (.., 2, 2) of its (real, imaginary) parts.

        Both are infinite where z = e^{jw} is a pole.
        """
        return self._response(np.exp(1j * np.atleast_1d(np.asarray(w, float)) * self.dt))

    def _response(self, z):
        """A(q) y = B(q) u: G = A^-1 B, dG/da_ij = -A^-1[:, i] z^-lag G[j], dG/db_il = A^-1[:, i] z^-lag in column l."""
        form, m = self.form, len(self.values)
        p, k = form.outputs, form.inputs
        A, B = form.polynomials(self.values)
        lags = z[:, None] ** -np.arange(len(A), dtype=float)
        den = np.einsum("zh,hij->zij", lags, A)
        is_pole = np.linalg.det(den) == 0
        inverse = np.linalg.inv(np.where(is_pole[:, None, None], np.eye(p), den))
        G = inverse @ np.einsum("zh,hil->zil", lags, B)
        J = np.zeros((p, k, len(z), m), complex)
        for c, (i, j, lag) in enumerate(zip(form.targets, form.sources, form.lags)):
            gain = inverse[:, :, i].T * lags[:, lag]  # (p, z)
            if j < p:
                J[..., c] = -gain[:, None] * G[:, j].T
            else:
                J[:, j - p, :, c] = gain
        J = np.stack([J.real, J.imag], axis=3)
        C = J @ self.covariance @ J.swapaxes(-1, -2)
        G[is_pole], C[:, :, is_pole] = np.inf, np.diag([np.inf, np.inf])
        return np.moveaxis(G, 0, -1), C

    @property
    def dc_gain(self) -> np.ndarray:
        """Steady-state gain from each input to each output, (p, k)."""
        return self._response(np.ones(1))[0][..., 0].real

    @property
    def dc_gain_std(self) -> np.ndarray:
        """Standard deviation of the steady-state gains, first order, (p, k)."""
        return np.sqrt(self._response(np.ones(1))[1][:, :, 0, 0, 0])
