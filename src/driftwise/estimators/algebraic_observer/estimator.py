"""State, derivatives and disturbance of a known plant from integrals only: Tian's theorem 1."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np

from ...detect.gate import Always
from ...detect.watch import Silent
from ...engine import validation
from ...engine.errors import InputError
from ...memory.constant import Constant
from ...models.scale import InverseGamma, KnownScale
from ..common.observer import Observed, Observer, check_names
from ..common.settings import arguments
from . import step as _step  # noqa: F401  (registers the step)
from .filter import discretise
from .relation import Relation, known
from .row import ALGEBRAIC, SCRATCH, Algebraic
from .theorem import Theorem


class AlgebraicObserver(Observer):
    """State of a known plant, and derivatives of its output, from integrals of y and u: theorem 1 of Tian (2009).

    The plant has one output and at most one input, x' = A x + B u + into q, and q is a polynomial and sinusoids of
    known frequencies, all of unknown amplitude. Integrals of (-t)^j y and (-t)^j u (one filter whose order is that of
    the plant with the disturbance) yield y and its derivatives whatever the first state and the amplitudes were; x
    follows from them. Nothing is tuned, nothing forgotten. Where y is a polynomial it *is* least squares on all
    samples; where undamped modes remain, its deviations become N/sqrt(2N - 1) times those of least squares.

    Parameters
    ----------
    plant : Plant
        x' = A x + B u, y = C x. `AlgebraicObserver.of_equation` takes an equation of y and u instead.
    into : (n,)
        How the disturbance enters each x'; left out where there is none (``degree=-1``, no frequencies).
    dt : float
        Seconds between samples.
    hold : "zoh" or "foh"
        What u does between its samples: held, or a straight line. Needed where the plant has an input.
    degree : int
        Degree of the polynomial disturbance (0: a constant); -1: none.
    frequencies : sequence of float
        Frequencies of the sinusoidal disturbances, rad/s.
    noise_std : float, optional
        Standard deviation of the white noise on y; learnt from the innovations if omitted.
    tolerance : float, or one for each state, optional
        Largest standard deviation that counts as ready. (Of an equation: of y, y', .. y^(n-1).)
    epsilon : float, optional
        Seconds until it is ready; the paper's rule, which knows nothing of noise.

    Raises
    ------
    InputError
        Where the theorem does not hold, or must not be used; the message says why.

    Notes
    -----
    The trace holds the states, the disturbance ``pi`` = C A^(n-1) into q, and ``y_e``, ``dy``, ``d2y`` .. up to y^(n).
    Until as many samples as unknowns were measured, and the tolerance or epsilon is met, estimates are NaN and the
    status says NOT_READY. Deviations are those of white noise; y is taken as a straight line between samples, which
    they leave out (an error of the order dt^2, small where modes and disturbances turn slowly within a sample). A
    missing y is taken as predicted (MISSING_OUTPUT, FILLED; the deviations know), a missing u as held. A y that is
    missing before anything is determined begins the integrals anew. No derivative of u is needed, but for those of y
    that have direct terms: there the hold says what it is ("foh": the last slope).

    Bad at: nearly everything that `WindowObserver` is good at. It never forgets, so an error of the plant stays in the
    estimate; its deviations are larger; inner states can be useless at any epsilon (the paper's own x3 has a deviation
    of 158 A at its epsilon). It is here as the reference, and to compare with.

    References
    ----------
    Tian (2009), corrected (`estimators/algebraic/theorem.py` says what was wrong).

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> t = np.arange(200) * 0.01
    >>> y = np.sin(t) + 0.01 * np.random.default_rng(0).standard_normal(200)
    >>> spring = dw.Plant([[0, 1], [-1, 0]], states=("position", "speed"))
    >>> trace = dw.AlgebraicObserver(spring, into=[0, 1], dt=0.01, noise_std=0.01, tolerance=0.02).scan(y)
    >>> trace.names, trace.x[-1].round(2), trace.x_std[-1].round(3)
    (['pi', 'y_e', 'dy', 'd2y'], array([ 0.91, -0.41]), array([0.002, 0.004]))
    >>> trace.events()[0].text
    'ready at 0.77 s'
    """

    def __init__(
        self,
        plant: Any,
        *,
        into: Any = None,
        dt: float,
        hold: str | None = None,
        degree: int = 0,
        frequencies: Any = (),
        noise_std: float | None = None,
        tolerance: Any = None,
        epsilon: float | None = None,
    ):
        self.options = arguments(locals())
        self.dt, self.irregular = validation.size("dt", dt), False
        self.degree, self.frequencies = validation.degree("degree", degree), validation.frequencies(frequencies)
        self.noise_std = None if noise_std is None else validation.size("noise_std", noise_std)
        self.known = found = known(plant, into, self.degree, self.frequencies)
        self.plant = found.plant
        self.hold = validation.hold(hold, len(found.inputs))
        self.theorem = Theorem(found.a, found.b, self.degree, [Fraction(w) for w in self.frequencies])
        rows, feeds, slopes, names = self._read_out()
        n = len(found.states)
        self.model = Observed(
            n, n + (self.theorem.xi > 0), len(rows), len(found.inputs), 1, found.states, names, found.inputs,
            [found.output],
        )  # fmt: skip
        check_names(self.model)
        limits = self._limits(tolerance, len(rows))
        wait = 0.0 if epsilon is None else math.ceil(validation.positive("epsilon", epsilon) / self.dt - 1e-9)
        form = self._form_of(rows, feeds, slopes, limits, wait)
        self.scale = InverseGamma(0.5, 1e-20) if noise_std is None else KnownScale()
        self.policies = (form, KnownScale(), Constant(), Always(), self.scale, Silent())
        self.dtype, self.scratch_size = ALGEBRAIC.dtype(form), SCRATCH.size(form)

    @classmethod
    def of_equation(cls, a, b=(), **options) -> AlgebraicObserver:
        """Return the observer of sum_i a_i y^(i) = sum_i b_i u^(i) + disturbance: derivatives of y, no states.

        Parameters
        ----------
        a, b : a_0 .. a_n with a_n = 1, b_0 .. b_m with m < n; no b without an input
        options : dt, hold, degree, frequencies, noise_std, tolerance, epsilon

        Examples
        --------
        >>> import driftwise as dw
        >>> dw.AlgebraicObserver.of_equation([0, 2, 10, 1], [2], dt=0.001, hold="foh", frequencies=[50]).names
        ['pi', 'y_e', 'dy', 'd2y', 'd3y']
        """
        return cls(Relation(a, b), **options)

    def _read_out(self):
        """Return rows on z = (y, y', ..), weights of u and of its slope, and names, of the states and what follows."""
        theorem, found, dt = self.theorem, self.known, self.dt
        n, d = theorem.n, min(theorem.n + 1, theorem.N)
        a = np.array([float(v) for v in found.a])
        steps = dt ** -np.arange(d, dtype=float)  # from units of samples to seconds
        values = np.zeros((n + 1, d))
        values[:d] = np.eye(d)
        if not theorem.xi:
            values[n] = -a[:n]
        parts, names = [values], [f"{'' if not i else 'd' if i == 1 else f'd{i}'}{found.output}" for i in range(n + 1)]
        names[0] += "_e"
        if theorem.xi:
            parts, names = [a[None], *parts], ["pi", *names]
        if found.states:
            parts = [np.pad(np.linalg.inv(found.observability), ((0, 0), (0, d - n))), *parts]
        rows = np.vstack(parts) * steps
        direct = np.array([0.0, *(float(g) for g in theorem.markov(n))])
        feeds, slopes = np.zeros((2, len(rows)))
        feeds[-n - 1 :] = direct
        if self.hold == "foh":
            slopes[-n:] = direct[:-1]
        if len({*found.states, *names}) < len(found.states) + len(names):
            raise InputError(f"states must not be named {', '.join(names)}: that is what else is estimated")
        return rows, feeds, slopes, names

    def _limits(self, tolerance, count) -> np.ndarray:
        """Return the largest deviation of each estimate that is ready, infinite where none was stated."""
        n = self.theorem.n
        limits = np.full(count, np.inf)
        first = 0 if self.known.states else count - n - 1
        limits[first : first + n] = validation.tolerance(tolerance, n, n)
        return limits

    def _form_of(self, rows, feeds, slopes, limits, wait) -> Algebraic:
        theorem, dt = self.theorem, Fraction(self.dt)
        n, N, inputs = theorem.n, theorem.N, len(self.known.inputs)
        scaled = Theorem(
            [c * dt ** (n - i) for i, c in enumerate(theorem.a)], [c * dt ** (n - i) for i, c in enumerate(theorem.b)],
            self.degree, [Fraction(w) * dt for w in self.frequencies],
        )  # fmt: skip
        found = discretise(scaled, self.hold)
        none = np.zeros(0)
        return Algebraic(
            N=N, inputs=inputs, dt=self.dt, least=max(N, 2), wait=wait,
            R=1.0 if self.noise_std is None else self.noise_std**2, Phi=found.Phi.ravel(), Y0=found.Y0.ravel(),
            Y1=found.Y1.ravel(), U0=found.U0.ravel() if inputs else none, U1=found.U1.ravel() if inputs else none,
            powers=found.powers.ravel(), alpha=found.alpha, reach=found.reach, ahead=found.ahead, rows=rows.ravel(),
            feeds=feeds, slopes=slopes, tolerance=limits,
        )  # fmt: skip
