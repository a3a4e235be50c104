"""Models of one output out of estimated parameters: state space, poles, gains, and their covariances."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..engine.errors import InputError
from .canonical import Canonical
from .markup import markup
from .response import denominator_std, gain_interval, response
from .roots import Roots, WithPoles, drawn, estimate
from .simulation import simulate

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
