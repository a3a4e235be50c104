"""The equation of y and u that the theorem is about, from a plant or as given; what it cannot be is refused here."""

from __future__ import annotations

from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from ...engine import validation
from ...engine.errors import InputError
from ...models.plant import Augmented, Plant, Polynomial, Sinusoid
from ...results.snapshot import register
from .theorem import derivatives, product, transfer_function

GROWS = 1e-7  # real part of a pole, relative to the largest pole, from which it counts as unstable
ZERO = 1e-9  # size of C A^k D, relative to its terms, up to which it counts as zero


@register
class Relation(NamedTuple):
    """sum_i a_i y^(i) = sum_i b_i u^(i) + disturbance, a_n = 1: a plant without its states."""

    a: Any
    b: Any = ()


class Known(NamedTuple):
    """What the observer needs of either."""

    a: list[Fraction]
    b: list[Fraction]
    plant: Augmented  # with the disturbance
    observability: np.ndarray  # (n, n) rows C A^i; (0, 0) without states
    states: list[str]
    inputs: list[str]
    output: str


def known(plant, into, degree, frequencies) -> Known:
    """Return the equation of a `Plant` or a `Relation`, or say why the theorem is not for it."""
    found = (
        _of_relation(plant, into, degree, frequencies)
        if isinstance(plant, Relation)
        else _of_plant(plant, into, degree, frequencies)
    )
    _refuse_growth(found.a)
    return found


def _of_relation(relation, into, degree, frequencies) -> Known:
    a, b = (np.atleast_1d(validation.floats(name, v)) for name, v in zip("ab", relation))
    if a.ndim != 1 or len(a) < 2 or not np.isfinite(a).all() or a[-1] != 1:
        raise InputError(
            f"a must be a_0 .. a_n, n at least 1, with a_n = 1 (of the highest derivative, last), got {relation.a!r}"
        )
    if b.ndim != 1 or len(b) >= len(a) or not np.isfinite(b).all() or (len(b) and b[-1] == 0):
        raise InputError(f"b must be b_0 .. b_m, m < n and b_m not 0 (empty: no input), got {relation.b!r}")
    if into is not None:
        raise InputError("into says how the disturbance enters the states, and an equation of y and u has none")
    n, A = len(a) - 1, np.eye(len(a) - 1, k=1)
    A[:, 0] = -a[-2::-1]
    plant = Plant(A, np.pad(b[::-1], (n - len(b), 0)) if len(b) else None, np.eye(n)[0])  # in observer form
    system = Augmented(plant, _disturbances(np.eye(n)[-1], degree, frequencies))
    exact = [Fraction(v) for v in a], [Fraction(v) for v in b]
    return Known(*exact, system, np.zeros((0, 0)), [], system.input_names, system.output_names[0])


def _disturbances(into, degree, frequencies) -> list[Any]:
    polynomial = [Polynomial(into, np.inf, degree)] if degree >= 0 else []
    return [*polynomial, *(Sinusoid(w, into, np.inf) for w in frequencies)]


def _of_plant(plant, into, degree, frequencies) -> Known:
    has_disturbance = degree >= 0 or len(frequencies) > 0
    if has_disturbance and into is None:
        raise InputError(
            "into must say how the disturbance enters each x', one number for each state; without a disturbance "
            "say degree=-1"
        )
    if into is not None and not has_disturbance:
        raise InputError("into says how a disturbance enters, but there is none: degree=-1, no frequencies")
    system = Augmented(plant, _disturbances(into, degree, frequencies))
    n, A, C = system.n, system.A[: system.n, : system.n], system.H[0, : system.n]
    if system.outputs > 1 or system.inputs > 1:
        raise InputError(
            f"the theorem is for one output and at most one input, and the plant has {system.outputs} and "
            f"{system.inputs}: use WindowObserver, or one AlgebraicObserver.of_equation for each output"
        )
    if np.any(system.D):
        raise InputError("the theorem needs m < n, no direct term: observe y - D u, which is known, and leave D out")
    a, b = transfer_function(A, system.B[:n, 0] if system.inputs else np.zeros(n), C)
    rows = [C]
    for _ in range(n - 1):
        rows.append(rows[-1] @ A)
    if into is not None:
        _refuse_channel(rows, np.abs(A), np.full(n, validation.floats("into", into)), a, b)
    system.require_observable()
    return Known(a, b, system, np.array(rows), system.names[:n], system.input_names, system.output_names[0])


def _refuse_channel(rows, size, D, a, b):
    terms = abs(rows[0])
    for k, row in enumerate(rows[:-1]):
        if abs(row @ D) > ZERO * (terms @ abs(D)):
            power = "C" if k == 0 else "C A" if k == 1 else f"C A^{k}"
            raise InputError(
                f"assumption (2) of the theorem, C D = C A D = .. = C A^(n-2) D = 0 (D: into), fails: {power} D = "
                f"{row @ D:g}. Read out of y and its derivatives by (4), the states would be wrong by what the "
                "disturbance adds, silently. WindowObserver has no such condition; the derivatives alone are right: "
                f"AlgebraicObserver.of_equation({_floats(a)}, {_floats(b)}, ..)"
            )
        terms = terms @ size


def _refuse_growth(a):
    poles = np.roots(_floats(radical(a))[::-1])
    worst = poles[np.argmax(poles.real)] if len(poles) else 0.0
    if np.real(worst) > GROWS * abs(poles).max():
        raise InputError(
            f"the plant has a mode that grows like exp({np.real(worst):g} t), Re(lambda) > 0: the theorem's integrals "
            "carry all noise along, and the deviation of its estimates grows as fast (for lambda = 3 it is 79 times "
            "that of a sample after 5 s, where least squares has 0.079). Use WindowObserver, which has no such trouble"
        )


def radical(p) -> list[Fraction]:
    """Return a polynomial with the same roots, each once: numerical roots are then as good as the coefficients."""
    f, g = list(p), derivatives(p, 1)[1]
    while any(g):
        f, g = g, _divide(f, g)[1]
    return _divide(list(p), f)[0]


def _divide(p, q) -> tuple[list[Fraction], list[Fraction]]:
    """Return quotient and remainder (without leading zeros) of polynomials, lowest power first."""
    rest, quotient = list(p), [Fraction(0)] * max(len(p) - len(q) + 1, 1)
    for i in range(len(p) - len(q), -1, -1):
        quotient[i] = share = rest[i + len(q) - 1] / Fraction(q[-1])
        for j, c in enumerate(product([share], q)):
            rest[i + j] -= c
    rest = rest[: len(q) - 1]
    while rest and not rest[-1]:
        rest.pop()
    return quotient, rest


def _floats(p) -> list[float]:
    return [float(c) for c in p]
