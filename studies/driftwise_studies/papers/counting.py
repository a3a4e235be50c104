"""What one sample costs: the engine's own code, run on numbers that count the arithmetic done with them."""

from __future__ import annotations

import math

import numpy as np

import driftwise as dw
from driftwise.engine import compile


class Counting:
    """A number that counts; sums with an exact 0 and products with 0, 1 or -1 are free."""

    count = 0

    def __init__(self, value):
        self.value = float(value)

    def __float__(self):
        return self.value

    def __neg__(self):
        return Counting(-self.value)

    def __abs__(self):
        return Counting(abs(self.value))

    def __pow__(self, power):
        Counting.count += 1
        return Counting(self.value**power)


def _teach(name, operation, free):
    def forward(self, other):
        a, b = self.value, float(other)
        Counting.count += a not in free and b not in free
        return Counting(operation(a, b))

    def backward(self, other):
        a, b = float(other), self.value
        Counting.count += a not in free and b not in free
        return Counting(operation(a, b))

    setattr(Counting, f"__{name}__", forward)
    setattr(Counting, f"__r{name}__", backward)


_teach("add", lambda a, b: a + b, (0.0,))
_teach("sub", lambda a, b: a - b, (0.0,))
_teach("mul", lambda a, b: a * b, (0.0, 1.0, -1.0))
_teach("truediv", lambda a, b: a / b, (0.0, 1.0))
for _name, _compare in {
    "lt": lambda a, b: a < b,
    "le": lambda a, b: a <= b,
    "gt": lambda a, b: a > b,
    "ge": lambda a, b: a >= b,
    "eq": lambda a, b: a == b,
    "ne": lambda a, b: a != b,
}.items():
    setattr(Counting, f"__{_name}__", lambda self, other, compare=_compare: compare(self.value, float(other)))


def counting(values):
    """Return an array of counting numbers."""
    values = np.asarray(values, float)
    return np.array([Counting(v) for v in values.ravel()], dtype=object).reshape(values.shape)


def per_sample(n: int, noise=None) -> int:
    """Return the operations of one ordinary sample in the uncompiled driver, one input and direct term, N = 3n + 1."""
    est = dw.Joint(n, inputs=1, direct=True, noise=noise or dw.models.EquationError(0.01), P0=10.0)
    y, u = dw.simulate(np.poly(np.linspace(0.3, 0.6, n))[1:], np.ones(n), samples=60, noise_std=0.1, seed=n)
    rng = np.random.default_rng(n)
    state = est.scan(y, u).state.copy()
    for part in ("x", "theta", "D"):  # nothing is zero by luck
        state[part] = rng.uniform(0.1, 2.0, state[part].shape)
    rows = counting(np.atleast_1d(state).view(float).reshape(1, -1))
    ys, us = counting(np.full((1, 1, 1), 0.3)), counting(np.full((1, 1, 1), 0.7))
    outs, scratch = counting(np.zeros((1, 1, 4))), counting(np.zeros(est.scratch_size))
    Counting.count = 0
    compile.plain_driver(*map(type, est.policies))(rows, ys, us, outs, est.spec, scratch)
    return int(Counting.count)


def arx(n):
    """Return the closed form (docs/decisions/ud.md) for U D U' factors and equation error."""
    return 22 * n * n + 36 * n + 8


def correlated(n: int) -> int:
    """Return the same with a fully correlated d."""
    return math.ceil(2 * n**3 + 28.5 * n * n + 38.5 * n + 11)


def dense(n: int) -> int:
    """Return the operations of the textbook form with full matrices."""
    N = 3 * n + 1
    return 4 * N**3 + 7 * N**2 + 6 * N
