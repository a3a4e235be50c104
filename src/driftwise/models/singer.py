"""Singer's manoeuvre model: an acceleration that forgets itself, and its canonical form for the joint filter."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from math import exp, expm1, factorial, isfinite, log10

import numpy as np

from ..engine.errors import InputError
from .noise import NoisePolynomial
from .spectral import factor, polynomial

TERMS = 34  # of the series: the last is below 1e-17 of the first at alpha dt = 1
LOST = 1e-6  # largest error of the noise spectrum that rounding d to doubles may cause


def _series(power, double, single, times):
    """Coefficients of [polynomial + double e^-2x + (single + times x) e^-x] / x^power, whose low orders vanish."""
    out = []
    for k in range(power, power + TERMS):
        term = double * Fraction((-2) ** k, factorial(k)) + single * Fraction((-1) ** k, factorial(k))
        out.append(float(term + times * Fraction((-1) ** (k - 1), factorial(k - 1))))
    return np.array(out)


HALF = Fraction(1, 2)
POSITION_ACCELERATION = _series(2, 0, 1, 0)
M11 = _series(5, -HALF, 0, Fraction(-2))
M12 = _series(4, HALF, -1, Fraction(1))
M13 = _series(3, -HALF, 0, Fraction(-1))
M22 = _series(3, -HALF, 2, Fraction(0))


def _unit_step(x):
    """Return phi = e^-x, h, f of Phi = [[1, 1, f], [0, 1, h], [0, 0, phi]], and Q / (2 x q), for dt = 1, alpha = x."""
    phi, E1, E2 = exp(-x), -expm1(-x), -expm1(-2 * x)
    if x < 1:
        f, m11, m12, m13, m22 = (
            float(np.polynomial.polynomial.polyval(x, c)) for c in (POSITION_ACCELERATION, M11, M12, M13, M22)
        )
    else:
        f = (x - E1) / x**2
        m11 = (E2 + 2 * x + 2 * x**3 / 3 - 2 * x**2 - 4 * x * phi) / (2 * x**5)
        m12 = (E1**2 + 2 * x * phi - 2 * x + x**2) / (2 * x**4)
        m13 = (E2 - 2 * x * phi) / (2 * x**3)
        m22 = (E2 - 4 * E1 + 2 * x) / (2 * x**3)
    m23, m33 = (E1 / x) ** 2 / 2, E2 / (2 * x)
    return phi, E1 / x, f, np.array([[m11, m12, m13], [m12, m22, m23], [m13, m23, m33]])


@dataclass(frozen=True)
class Singer:
    """Exact discrete model of a target whose acceleration has the correlation q exp(-alpha abs(tau)) (Singer 1970).

    The state is [position, velocity, acceleration]; ``x(t + dt) = Phi x(t) + w``, ``E w w' = Q``.

    Parameters
    ----------
    alpha : float
        Inverse of the manoeuvre's time constant, 1/s.
    q : float
        Variance of the acceleration, (m/s^2)^2. The white noise behind it has intensity 2 alpha q.
    dt : float
        Seconds between samples.

    Attributes
    ----------
    Phi : (3, 3)
        Transition matrix.
    Q : (3, 3)
        Covariance of w: series below alpha dt = 1, closed form above, so every entry keeps its relative digits.

    Raises
    ------
    InputError
        For a number that is not positive and finite, or where Q leaves the range of doubles.

    Notes
    -----
    Bad at: targets that fly straight for minutes and then turn (one q cannot be both), and accelerations with an
    oscillation (a weave): the joint filter learns those modes, Singer's model has none.

    Examples
    --------
    >>> import driftwise as dw
    >>> model = dw.models.Singer(alpha=0.1, q=1.0, dt=1.0)
    >>> print(model.Q[0].round(5))
    [0.00946 0.0234  0.03018]
    >>> form = model.canonical(r=100.0)
    >>> print(form.d.round(5), round(form.variance, 4))
    [-0.48714  1.81092 -2.29256] 185.7454
    """

    alpha: float
    q: float
    dt: float

    def __post_init__(self):
        for name in ("alpha", "q", "dt"):
            value = getattr(self, name)
            try:
                number = float(value)
            except (TypeError, ValueError):
                number = float("nan")
            if isinstance(value, bool) or not (isfinite(number) and number > 0):
                hint = "; for straight flight give a small one" if name == "q" else ""
                raise InputError(f"{name} must be a positive finite number, got {value!r}{hint}")
            object.__setattr__(self, name, number)
        x, dt, q = log10(self.alpha) + log10(self.dt), log10(self.dt), log10(self.q)
        if not all(abs(size) < 280 for size in (x, 2 * dt, x + q, x + q + 4 * dt)):
            raise InputError(
                f"alpha = {self.alpha:g}, q = {self.q:g}, dt = {self.dt:g}: the covariance leaves the range of "
                "doubles. Are the units those of seconds and metres?"
            )

    @property
    def Phi(self) -> np.ndarray:
        """Transition matrix (3, 3)."""
        phi, h, f, _ = _unit_step(self.alpha * self.dt)
        return np.array([[1, self.dt, self.dt**2 * f], [0, 1, self.dt * h], [0, 0, phi]])

    @property
    def Q(self) -> np.ndarray:
        """Covariance of the disturbance of one step (3, 3)."""
        x = self.alpha * self.dt
        unit = self.dt ** np.array([2.0, 1.0, 0.0])
        return 2 * x * self.q * _unit_step(x)[3] * np.outer(unit, unit)

    def canonical(self, r) -> SingerCanonical:
        """Return Salut's form of this model seen by a sensor: A(q) y = C(q) v.

        Parameters
        ----------
        r : float
            Variance of the white noise on the measured position, m^2.

        Raises
        ------
        InputError
            For an r that is not positive, and where q is so small against r that the zeros of C are too close to 1
            for coefficients in doubles: their rounding would change the noise spectrum by more than one millionth.

        Notes
        -----
        C is the spectral factor of ``r A(z) A(1/z)`` plus the spectrum of the manoeuvre, solved in
        s = 4 sin^2(w/2), where neither a small alpha dt nor a small q cancels digits. d depends on alpha, dt and q/r: a
        filter that treats d as known and a as unknown is an approximation.
        """
        try:
            r = float(r)
        except (TypeError, ValueError):
            raise InputError(f"r must be a number, got {r!r}") from None
        if not (isfinite(r) and r > 0):
            raise InputError(f"r must be a positive finite variance, got {r!r}; was a standard deviation's sign lost?")
        x = self.alpha * self.dt
        phi, h, f, m = _unit_step(x)
        kappa = x * h
        g0 = m[1, 1] * kappa**2 + m[2, 2] * h**2 + 2 * m[1, 2] * kappa * h
        g1 = (
            (m[0, 0] - m[0, 1]) * kappa**2 + m[1, 1] * phi + m[2, 2] * f * (f - h)
            + 2 * m[0, 2] * (kappa * f - h - kappa * h / 2) + m[1, 2] * (2 * f - h - kappa * f)
        )  # fmt: skip
        g2 = (m[0, 0] - m[0, 1]) * phi + m[0, 2] * (h - f)
        W = 2 * x * self.q * self.dt**4 / r  # the spectrum of everything over r, as coefficients of s^0 .. s^3
        c = np.array([W * g0, W * g1, kappa**2 + W * g2, phi])
        if not (1e-100 < W < 1e100):
            raise InputError(
                f"q dt^4 / r = {W / 2 / x:.3g} is beyond what doubles hold. Are q and r in the same units?"
            )
        e, V = factor(c)
        d = polynomial(e)
        d[0] = -phi / V  # the last autocovariance; the sum above would lose its digits
        error = _spectrum_error(d, V, c)
        if not error < LOST:
            raise InputError(
                f"q is so small against r (q dt^4 / r = {W / 2 / x:.3g}, alpha dt = {x:.3g}) that the zeros of C lie "
                f"within {e[0] ** (1 / 3):.1g} of 1: rounding d to doubles changes the noise spectrum by a factor 1 "
                f"+- {error:.1g}. Use a longer dt (thin the record), or the state-space form Phi, Q."
            )
        a = np.array([-phi, 1 + 2 * phi, -(2 + phi)])
        unit = self.dt ** np.array([0.0, 1.0, 2.0])
        transform = np.array([[phi, -phi, h - f], [-(1 + phi), 1, f], [1, 0, 0]]) * unit
        return SingerCanonical(a, d, float(r * V), transform, error)


@dataclass(frozen=True)
class SingerCanonical:
    """Salut's form A(q) y = C(q) v of Singer's model seen by a sensor, ready for ``Joint(3)``.

    Attributes
    ----------
    a : (3,)
        a_0, a_1, a_2 of A(z) = (z - 1)^2 (z - exp(-alpha dt)).
    d : (3,)
        d_0, d_1, d_2 of C(z), all zeros inside the circle.
    variance : float
        Variance of v, the one-step prediction error of the steady filter, m^2.
    transform : (3, 3)
        [x_1, x_2, x_3] of Salut = transform @ [position, velocity, acceleration].
    error : float
        Largest relative error, over all frequencies, of the noise spectrum of (d, variance) as stored in doubles.

    Examples
    --------
    >>> import driftwise as dw
    >>> form = dw.models.Singer(0.1, 1.0, 1.0).canonical(100.0)
    >>> s0, P0 = form.prior(position=5000.0, velocity=-200.0), form.P0(1e3, 50.0, 3.0, 0.1)
    >>> est = dw.Joint(3, noise=form.noise, s0=s0, P0=P0)
    >>> state, step = est.update(est.start(), 5010.0)
    >>> print(f"{step.prediction:.0f}")
    5000
    """

    a: np.ndarray
    d: np.ndarray
    variance: float
    transform: np.ndarray
    error: float

    @property
    def noise(self) -> NoisePolynomial:
        """What `Joint` takes as its noise."""
        return NoisePolynomial(tuple(self.d.tolist()), self.variance)

    def prior(self, position=0.0, velocity=0.0, acceleration=0.0) -> np.ndarray:
        """Return s0 = [x_1..x_3 ; a_0..a_2] of ``Joint(3)`` for a target expected to be there at the first sample."""
        return np.concatenate([self.transform @ np.array([position, velocity, acceleration], float), self.a])

    def P0(self, position_std, velocity_std, acceleration_std, a_std) -> np.ndarray:
        """Return the prior covariance (6, 6) of ``Joint(3)``; ``a_std`` is that of each of a_0, a_1, a_2."""
        root = np.zeros((6, 6))
        root[:3, :3] = self.transform * np.array([position_std, velocity_std, acceleration_std], float)
        root[3:, 3:] = a_std * np.eye(3)
        return root @ root.T


def _spectrum_error(d, V, c) -> float:
    """Return the largest relative error of V |C|^2, C with the stored d, against sum_k c_k s^k on 0 <= s <= 4."""
    d0, d1, d2 = map(Fraction, d.tolist())  # in rationals: the doubles as they are
    e2, e1, e0 = d2 + 3, d1 + 2 * d2 + 3, d0 + d1 + d2 + 1
    V = Fraction(float(V))
    got = (
        V * e0 * e0,
        V * (e1 * e1 - 2 * e2 * e0 - e1 * e0),
        V * (e2 * e2 - 2 * e1 + 3 * e0 - e2 * e1 + e2 * e0),
        V * (1 - e2 + e1 - e0),
    )
    off = np.array([float(g - Fraction(float(k))) for g, k in zip(got, c)])
    s = np.concatenate([[0.0], np.geomspace(1e-20, 4.0, 801)])
    powers = s[:, None] ** np.arange(4.0)
    return float(np.max(abs(powers @ off) / (powers @ c)))
