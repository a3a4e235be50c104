"""The coefficients of the theorem with letters in them (needs SymPy)."""

from __future__ import annotations

from typing import Any, NamedTuple

from ...engine import validation
from ...engine.errors import InputError
from .theorem import Theorem


class Symbolic(NamedTuple):
    """Coefficients as SymPy expressions in t and the letters they were asked for with; see `Theorem`."""

    N: int
    D1: Any  # in s
    D2: Any
    alpha: dict[tuple[int, int], Any]  # (mu, h): alpha[mu,h](t), mu = 1 .. n
    beta: dict[tuple[int, int], Any]


def symbolic_coefficients(a, b=0, *, degree: int = 0, frequencies: Any = 0) -> Symbolic:
    """Return alpha, beta and the polynomials of Tian's theorem 1 (corrected) as expressions.

    Parameters
    ----------
    a : order n, for the letters a0 .. a(n-1); or a_0 .. a_n with a_n = 1: numbers, expressions, or text for them
    b : m, for the letters b0 .. bm; or b_0 .. b_m
    degree : degree of the polynomial disturbance; -1: none
    frequencies : how many, for the letters w1 ..; or a sequence of frequencies, rad/s

    Examples
    --------
    >>> from driftwise.estimators import symbolic_coefficients
    >>> found = symbolic_coefficients([0, "c", "R/L", 1], ["k"], frequencies=["w"])
    >>> found.alpha[2, 0]
    300*t**4 + 6*R*t**5/L
    """
    try:
        import sympy
    except ImportError:
        raise InputError("letters need SymPy: pip install sympy, or driftwise[symbolic]") from None

    def letters(name, value, first, count):
        if isinstance(value, int):
            return [sympy.Symbol(f"{name}{i}") for i in range(first, first + value + count)]
        return [sympy.Symbol(v) if isinstance(v, str) and v.isidentifier() else sympy.sympify(v) for v in value]

    numbers, w = letters("a", a, 0, 0), letters("w", frequencies, 1, 0)
    numbers += [sympy.Integer(1)] if isinstance(a, int) else []
    inputs = letters("b", b, 0, 1)
    if len(numbers) < 2 or numbers[-1] != 1 or len(inputs) >= len(numbers):
        raise InputError(f"a must end in a_n = 1, n at least 1, and b be shorter (m < n), got {a!r} and {b!r}")
    theorem, t, s = (
        Theorem(numbers, inputs, validation.degree("degree", degree), w),
        sympy.Symbol("t"),
        sympy.Symbol("s"),
    )

    def written(powers, variable=t):
        return sum((c * variable**p for p, c in powers.items()), sympy.Integer(0))

    n, m = theorem.n, theorem.m
    return Symbolic(
        theorem.N,
        written(dict(enumerate(theorem.D1)), s),
        written(dict(enumerate(theorem.D2)), s),
        {(mu, h): written(theorem.alpha(mu, h)) for mu in range(1, n + 1) for h in range(mu)},
        {(mu, h): written(theorem.beta(mu, h)) for mu in range(n + 1) for h in range(m + mu - n + 1)},
    )
