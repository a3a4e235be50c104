"""Every memory that is ranked; a family that needs a number comes with several."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

import driftwise as dw
from driftwise import memory as kinds

from .system import System

SIZE, EVERY = 3.0, 1000.0  # deviations of a jump, samples between two: what is told to a memory that must know


class Entrant(NamedTuple):
    """A memory: its family, and what makes it for a system."""

    family: str
    make: Callable[[System], Any]


def same(memory, system: System):
    """Return the memory, whatever the system."""
    return memory


def fixed(family: str, *memories) -> dict[str, Entrant]:
    """Return entrants that are the same for every system."""
    return {repr_of(one): Entrant(family, partial(same, one)) for one in memories}


def repr_of(memory) -> str:
    """Return what one would type."""
    plain = type(memory)._field_defaults
    said = [(k, v) for k, v in memory._asdict().items() if k not in plain or v != plain[k]]
    words = [f"{v!r}" if k == memory._fields[0] and v is not True else f"{k}={v!r}" for k, v in said]
    return f"{type(memory).__name__}({', '.join(words)})"


def jump_of(system: System) -> list[float]:
    """Return a typical jump of each parameter."""
    return (SIZE * np.array(system.deviations)).tolist()


def walking(system: System):
    """Return a walk that is told how far jumps go, and how often."""
    return kinds.RandomWalk(matched=(jump_of(system), EVERY))


def doubting(system: System):
    """Return a mixture over when the last jump was that is told the same."""
    return kinds.BayesianChangePoint(jump_of(system), EVERY)


def restarting(system: System):
    """Return a restart that is told how far jumps go."""
    size = jump_of(system)
    return kinds.RestartOnChange(dw.detect.ScoreCUSUM(jump=size), kinds.CovarianceInflation(size))


def afresh(system: System):
    """Return a restart by default."""
    return kinds.RestartOnChange(dw.detect.ScoreCUSUM(), kinds.GainReset(10.0))


NAMED = {
    "RandomWalk(matched=(jump, 1000))": Entrant("RandomWalk", walking),
    "BayesianChangePoint(jump, 1000)": Entrant("BayesianChangePoint", doubting),
    "RestartOnChange(ScoreCUSUM(jump), CovarianceInflation(jump))": Entrant("RestartOnChange", restarting),
    "RestartOnChange(ScoreCUSUM(), GainReset(10))": Entrant("RestartOnChange", afresh),
}
ENTRANTS: dict[str, Entrant] = {
    **fixed("AutoMemory", kinds.AutoMemory(), kinds.AutoMemory("jumps"), kinds.AutoMemory("outliers")),
    **fixed("Constant", kinds.Constant()),
    **fixed("GainFloor", *map(kinds.GainFloor, (20.0, 50.0, 200.0))),
    **fixed("ExponentialForgetting", *map(kinds.ExponentialForgetting, (0.9, 0.95, 0.98, 0.99, 0.998))),
    **fixed("VariableForgetting", *(kinds.VariableForgetting(*v) for v in ((), (1000.0,), (100.0, 0.5)))),
    **fixed("DirectionalForgetting", *map(kinds.DirectionalForgetting, (0.9, 0.98, 0.99))),
    **fixed("Window", kinds.Window(50), kinds.Window(200)),
    **fixed("Drift", *(kinds.Drift(nvr=v) for v in (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1))),
    **NAMED,
    **fixed("MultipleModel", kinds.MultipleModel()),
    **fixed("IMM", kinds.IMM()),
    **fixed("LikelihoodDrift", kinds.LikelihoodDrift(), kinds.LikelihoodDrift(shared=True)),
    **fixed("FuzzyDrift", kinds.FuzzyDrift()),
    **fixed("CovarianceMatching", *map(kinds.CovarianceMatching, ("scalar", "gain", "myers-tapley", "em"))),
    **fixed("AuxiliaryFilter", kinds.AuxiliaryFilter()),
    **fixed("AutocovarianceLS", kinds.AutocovarianceLS()),
    **fixed("VariationalBayes", *map(kinds.VariationalBayes, ("noise", "both", "drift"))),
}  # fmt: skip
AUTO = "AutoMemory()"
