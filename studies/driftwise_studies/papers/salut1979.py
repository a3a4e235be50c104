"""Salut, Aguilar, Favier, Alengrin (1979): sections 3.2 and 3.3, and what was found around them."""

from __future__ import annotations

from . import arithmetic, error_bars, jumps, numerics, tests_1_to_4, weave
from .verdict import Reproduction

LEAD = (
    "G. Salut, J. Aguilar, G. Favier and G. Alengrin estimated the state and the parameters of a linear stochastic "
    "system together, exactly, and followed an aircraft with it. Their six simulated tests, run again with many "
    "records where they had one, with exact arithmetic beside theirs. Their radar experiment has a reproduction of its "
    "own, on recorded radars: driftwise reproduce radar."
)


def run(seeds: int, say=lambda title: None) -> Reproduction:
    """Run everything; ``say`` hears the name of each part before it starts."""
    sections = []
    for part in (tests_1_to_4, arithmetic, numerics, error_bars, jumps, weave):
        say(part.__name__.rsplit(".", 1)[-1].replace("_", " "))
        sections.append(part.section(seeds))
    return Reproduction(
        "salut1979",
        "Optimal joint adaptive estimation of parameter and state (1979), reproduced",
        LEAD,
        seeds,
        sections,
        "Where the paper is silent (priors, Q_π) the choice is stated. Signs: the paper lists −a in its section "
        "3.2; so does this page.",
    )
