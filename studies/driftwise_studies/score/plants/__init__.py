"""Plants with named physical parameters, drawn from a seed: their records, with the truth."""

from .drawing import draw
from .physics import PLANTS
from .simulation import simulate

__all__ = ["PLANTS", "draw", "simulate"]
