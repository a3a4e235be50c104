"""Tian's theorem 1: its coefficients in exact arithmetic, as printed and as corrected; kernels, variances, letters."""

import math
from fractions import Fraction
from itertools import zip_longest

import numpy as np
import pytest
from oracle import algebraic_theorem
from paper_motor import GOLDEN

import driftwise as dw
from driftwise.estimators.algebraic_observer.filter import kernel
from driftwise.estimators.algebraic_observer.relation import radical
from driftwise.estimators.algebraic_observer.theorem import Theorem, polynomial_variance, transfer_function

THEOREM = Theorem([0, 2, 10, 1], [2], 0, [50])  # of the paper's motor


def powers(found):
    return {str(power): str(value) for power, value in found.items()}


def test_coefficients_of_the_motor_are_the_golden_ones():
    expected = GOLDEN["theorem_dc_motor"]["expect"]
    a, b = transfer_function([[0, 1, 0], [0, 0, 0.2], [0, -10, -10]], [0, 0, 10], [1, 0, 0])
    assert all(abs(x - y) < 1e-15 for x, y in zip(a + b, [0, 2, 10, 1, 2]))  # 0.2 is no binary fraction
    assert THEOREM.N == expected["N"]
    for key, value in expected["alpha"].items():
        assert powers(THEOREM.alpha(*map(int, key.split(",")))) == value, key
    for key, value in expected["beta"].items():
        assert powers(THEOREM.beta(*map(int, key.split(",")))) == value, key
    assert powers({i: c for i, c in enumerate(THEOREM.D1) if c}) == expected["D1"]
    for j, value in expected["cjD1j"].items():
        D = THEOREM.D1s[int(j)]
        assert powers({i: THEOREM.c[int(j)] * c for i, c in enumerate(D) if c}) == value, j
    for key, value in expected["kq"].items():
        mu, j, q = map(int, key.split(","))
        assert str(THEOREM.direct(mu, j)[q]) == value, key


@pytest.mark.parametrize(
    "given", [([3, -1, 2, 1], [1, 4, 5], 1, [3]), ([5, 1], [7], 2, [2, 9]), ([1, 2, 0, 4, 1], [], -1, [])]
)
def test_coefficients_are_those_of_another_derivation(given):
    found, other = Theorem(*given), algebraic_theorem.Theorem(given[0], given[1] or [0], *given[2:])
    for mu in range(1, found.N + 1):
        for h in range(mu):
            assert found.alpha(mu, h) == other.alpha(mu, h)
            assert not given[1] or found.beta(mu, h) == other.beta(mu, h)


def taylor(p, q, at, count):
    """The first derivatives of p/q at a rational point, by division of power series."""

    def moved(c):
        return [sum(c[i] * math.comb(i, l) * at ** (i - l) for i in range(l, len(c))) for l in range(count + 1)]

    p, q = moved(p), moved(q)
    found: list[Fraction] = []
    for i in range(count + 1):
        found.append((p[i] - sum(found[l] * q[i - l] for l in range(i))) / q[0])
    return [math.factorial(i) * c for i, c in enumerate(found)]


def times(p, q):
    return [sum(p[i] * q[l - i] for i in range(len(p)) if 0 <= l - i < len(q)) for l in range(len(p) + len(q) - 1)]


def remainder(p, mu, q):
    """The remainder of s^mu p by the monic q: their quotient without its polynomial part."""
    rest = [0] * mu + list(p)
    while len(rest) >= len(q):
        lead = rest[-1]
        for i in range(len(q)):
            rest[len(rest) - len(q) + i] -= lead * q[i]
        rest.pop()
    return rest


def residual(theorem, mu, s, U, rest):
    """The theorem's equation of y^(mu), Laplace transformed, at one rational point: zero if it holds.

    Y = (D2 U + rest)/D1: any first state, any disturbance of the shape. t^p y^(h) is (-d/ds)^p s^h Y where p >= h.
    """
    N, T = theorem.N, theorem
    Up, Uq = U
    numerator = [a + b for a, b in zip_longest(times(T.D2, Up), times(rest, Uq), fillvalue=0)]
    Y = numerator, times(T.D1, Uq)

    def transformed(signal, power, order):
        return (-1) ** power * taylor(times([0] * order + [1], signal[0]), signal[1], s, power)[power]

    def value(p):
        return sum(c * s**i for i, c in enumerate(p))

    total = (-1) ** N * transformed(Y, N, mu)
    for h in range(mu):
        total += sum(c * transformed(Y, p, h) for p, c in T.alpha(mu, h).items())
    for h in range(T.m + mu - T.n + 1):
        total -= sum(c * transformed(U, p, h) for p, c in T.beta(mu, h).items())
    for j in range(N + 1):
        c = T.c[j] * (-1) ** (N - j) / value(T.D1)
        if j:
            total += c * value(remainder(T.D1s[j], mu, T.D1)) * transformed(Y, N - j, 0)
        total -= c * value(remainder(T.D2s[j], mu, T.D1)) * transformed(U, N - j, 0)
    return total


class SumAsPrinted(Theorem):
    """The sum over the derivatives of u ends one too early: (18) of the paper."""

    def beta(self, mu, h):
        return {} if h == self.m + mu - self.n else super().beta(mu, h)


class ConstantsAsPrinted(Theorem):
    """The constants k_q do not depend on j."""

    def alpha(self, mu, h):
        self.k = [self.k[1]] * (self.N + 1)
        return super().alpha(mu, h)


@pytest.mark.parametrize(
    "theorem, w",
    [(THEOREM, 50), (Theorem([3, -1, 2, 1], [1, 4, 5], 1, [3]), 3)],
    ids=["the motor", "n = 3, m = 2, g = 1, w = 3"],
)
def test_the_theorem_holds_in_exact_arithmetic(theorem, w):
    rng = np.random.default_rng(1)

    def fraction():
        return Fraction(int(rng.integers(1, 90)), int(rng.integers(1, 30)))

    for _ in range(3):
        U = [fraction(), -fraction()], [fraction(), fraction(), 1]  # numerator and denominator
        rest, s = [fraction() for _ in range(theorem.N)], fraction()
        for mu in range(theorem.n + 1):
            assert residual(theorem, mu, s, U, rest) == 0, mu
    for wrong in (SumAsPrinted, ConstantsAsPrinted):
        as_printed = wrong(theorem.a, theorem.b, theorem.xi - 3, [w])
        assert residual(as_printed, theorem.n, s, U, rest) != 0


def test_kernels_and_variances_are_the_golden_ones():
    case = GOLDEN["kernel_values"]
    theorem = Theorem([int(c) for c in case["given"]["D1"][::-1]], degree=-1)
    found = [float(kernel(theorem, t, tau)) for t, tau in case["given"]["points"]]
    np.testing.assert_allclose(found, case["expect"]["k"], rtol=0, atol=case["tol"])
    tau = np.linspace(0, 1, 5)
    for name, own in GOLDEN["polynomial_kernels"]["expect"].items():
        theorem = Theorem([0] * int(name[2:]) + [1], degree=-1)
        for order, polynomial in enumerate(own.values()):
            expected = np.polyval(polynomial[::-1], tau)
            np.testing.assert_allclose(kernel(theorem, 1.0, tau, order), expected, rtol=0, atol=1e-9)
    case = GOLDEN["polynomial_variance"]
    assert [str(polynomial_variance(*pair)) for pair in case["given"]["pairs"]] == case["expect"]["V"]


def test_letters():
    sympy = pytest.importorskip("sympy")
    a, c, w, k, t = sympy.symbols("a c w k t")
    found = dw.estimators.symbolic_coefficients([0, "c", "a", 1], ["k"], frequencies=["w"])
    expected = (-6 * a**2 + 12 * c + 12 * w**2) * t**5 - 120 * a * t**4 - 1200 * t**3  # of the paper's (28)
    assert sympy.expand(found.alpha[3, 0] - expected) == 0
    assert found.beta == {(3, 0): k * t**6}
    lettered = dw.estimators.symbolic_coefficients(3, frequencies=1)
    numbers = lettered.alpha[3, 0].subs({"a0": 0, "a1": 2, "a2": 10, "w1": 50})
    assert sympy.expand(numbers) == sum(v * t**p for p, v in THEOREM.alpha(3, 0).items())


def test_roots_are_judged_each_once():
    """(s - 1)(s + 2)^2 s^3: numerically s^3 alone would have a root of real part 1e-6."""
    p = [Fraction(1)]
    for root in (1, -2, -2, 0, 0, 0):
        p = times(p, [-root, Fraction(1)])
    found = radical(p)
    assert [c / found[-1] for c in found] == times(times([0, 1], [2, 1]), [-1, 1])
