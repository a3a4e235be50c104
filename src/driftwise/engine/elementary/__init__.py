"""The elementary functions of the engine, in the engine's own words: the same bits wherever a kernel runs."""

from .circular import cos, sin
from .complementary import erfc
from .exponential import exp, expm1
from .gamma import lgamma
from .length import hypot
from .logarithm import log, log1p
from .power import pow, square

__all__ = ["cos", "erfc", "exp", "expm1", "hypot", "lgamma", "log", "log1p", "pow", "sin", "square"]
