"""Perriot-Mathonna (1981): the three plates, the formulas of section 4, and what was found around them."""

from __future__ import annotations

from .perriot import convergence, detection, diffusion, equations, lengths, paying, plates
from .verdict import Reproduction

LEAD = (
    "D. Perriot-Mathonna let recursive stochastic algorithms adapt themselves: either their gain never falls to "
    "zero, or it starts anew when a test on the algorithm's own signal says that the parameter has jumped. His "
    "three plates with Hampton's adaptive Kalman gain, run again with many records where he showed one; his "
    "formulas beside simulation; and what does better."
)


def run(seeds: int, say=lambda title: None) -> Reproduction:
    """Run everything; ``say`` hears the name of each part before it starts."""
    sections = []
    for part in (plates, detection, paying, lengths, convergence, diffusion, equations):
        say(part.__name__.rsplit(".", 1)[-1])
        sections.append(part.section(seeds))
    return Reproduction(
        "perriot1981",
        "Self-adapting recursive stochastic algorithms (1981), reproduced",
        LEAD,
        seeds,
        sections,
        "θ multiplies the regressor with plus signs here, as in the paper: an autoregressive coefficient is −a of "
        "the rest of driftwise. All expected numbers were measured beforehand, with other code and other records.",
    )
