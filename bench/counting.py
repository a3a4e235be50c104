"""Numbers that count what is done with them, and know when they would be ready: the plain Python step runs on them."""

from __future__ import annotations

import math
import operator
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import ClassVar, NamedTuple
from unittest import mock

import numpy as np

from driftwise.engine import compile

FUNCTIONS = ("log", "log1p", "exp", "expm1", "tanh", "atan", "cos", "sin", "lgamma", "erf", "erfc")


class Counted:
    """A number, and the moment from which it may be used if everything else costs nothing."""

    __slots__ = ("ready", "value")
    done: ClassVar[Counter[str]] = Counter()
    latency: ClassVar[dict[str, float]] = {}
    free: ClassVar[dict[str, tuple[float, ...]]] = {}  # operands that cost nothing, by kind

    def __init__(self, value, ready: float = 0.0):
        self.value, self.ready = float(value), ready

    def _with(self, other, kind: str, result, is_swapped: bool = False):
        value, ready = (other.value, other.ready) if isinstance(other, Counted) else (float(other), 0.0)
        free = Counted.free.get(kind, ())
        Counted.done[kind] += self.value not in free and value not in free
        with np.errstate(all="ignore"):
            a, b = np.float64(self.value), np.float64(value)
            found = result(b, a) if is_swapped else result(a, b)
        return Counted(found, max(self.ready, ready) + Counted.latency.get(kind, 0.0))

    def __add__(self, other):
        return self._with(other, "sum", operator.add)

    def __sub__(self, other):
        return self._with(other, "sum", operator.sub)

    def __rsub__(self, other):
        return self._with(other, "sum", operator.sub, is_swapped=True)

    def __mul__(self, other):
        return self._with(other, "product", operator.mul)

    def __truediv__(self, other):
        return self._with(other, "division", operator.truediv)

    def __rtruediv__(self, other):
        return self._with(other, "division", operator.truediv, is_swapped=True)

    __radd__, __rmul__ = __add__, __mul__

    def __pow__(self, power):
        found = self
        if power != int(power) or not 0 < power < 5:
            return self._with(power, "logarithm", operator.pow)
        for _ in range(int(power) - 1):
            found = found * self
        return found

    def __neg__(self):
        return Counted(-self.value, self.ready)

    def __abs__(self):
        return Counted(abs(self.value), self.ready)

    def _compare(self, other, how) -> bool:
        Counted.done["comparison"] += 1
        return how(self.value, float(other))

    def __lt__(self, other):
        return self._compare(other, operator.lt)

    def __gt__(self, other):
        return self._compare(other, operator.gt)

    def __le__(self, other):
        return self._compare(other, operator.le)

    def __ge__(self, other):
        return self._compare(other, operator.ge)

    def __eq__(self, other):
        return self._compare(other, operator.eq)

    def __ne__(self, other):
        return self._compare(other, operator.ne)

    __hash__ = None

    def __float__(self):
        return self.value

    def __int__(self):
        return int(self.value)


def counted(values) -> np.ndarray:
    """Return an array of numbers that count."""
    return np.array([Counted(v) for v in np.ravel(values)], dtype=object).reshape(np.shape(values))


def _function(plain, kind: str):
    """Return a function of `math` that counted numbers go through."""

    def take(x, *others):
        if not isinstance(x, Counted):
            return plain(x, *others)
        Counted.done[kind] += 1
        return Counted(plain(x.value, *others), x.ready + Counted.latency.get(kind, 0.0))

    return take


@contextmanager
def counting(latency=None, free=None) -> Iterator[Counter[str]]:
    """Count what is done from here on; say how long each kind takes, and which operands cost nothing."""
    done: Counter[str] = Counter()
    with ExitStack() as stack:
        for name in (*FUNCTIONS, "sqrt"):
            kind = "root" if name == "sqrt" else "logarithm"
            stack.enter_context(mock.patch.object(math, name, _function(getattr(math, name), kind)))
        for name, value in {"latency": latency or {}, "free": free or {}, "done": done}.items():
            stack.enter_context(mock.patch.object(Counted, name, value))
        yield done


class Work(NamedTuple):
    """What a sample asks for, on average."""

    done: dict[str, float]  # operations by kind; `math` functions other than roots count as logarithms
    chain: float  # seconds from a state to the next, if operations that do not wait for each other cost nothing

    @property
    def operations(self) -> float:
        """Arithmetic of any kind; comparisons are not counted."""
        return sum(number for kind, number in self.done.items() if kind != "comparison")


def work(est, ys, us, state, latency: dict[str, float], columns: int = 4) -> Work:
    """Return what samples ys (T, p), us (T, k) ask for, beginning at a state; the first quarter only warms up."""
    drive = compile.plain_driver(*map(type, est.policies))
    rows, outs, scratch = (
        counted(est._rows(state)),
        np.zeros((1, 1, columns), object),
        counted(np.zeros(est.scratch_size)),
    )
    totals: list[Counter[str]] = []
    moments: list[float] = []
    with counting(latency) as counts:
        for y, u in zip(counted(ys), counted(us)):
            counts.clear()
            drive(rows, y[None, None], u[None, None], outs, est.spec, scratch)
            totals.append(Counter(counts))
            moments.append(max(x.ready for x in rows[0] if isinstance(x, Counted)))
    skip = len(totals) // 4
    kept = len(totals) - skip
    done = {kind: n / kept for kind, n in sum(totals[skip:], Counter()).items()}
    return Work(done, (moments[-1] - moments[skip - 1]) / kept)
