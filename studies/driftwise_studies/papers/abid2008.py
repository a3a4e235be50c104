"""Abid and Kamoun (2008): the example with known Q, the fuzzy rule and the auxiliary filter; what is wrong with it."""

from __future__ import annotations

from .abid import gain, headline, likelihood, matching, rule
from .verdict import Reproduction

LEAD = (
    "A. Abid and M. Kamoun track drifting parameters with a Kalman filter whose Q a fuzzy rule finds from the last "
    "innovation and the last step. Their example run again with many records where they showed one, with the gain as "
    "they print it and as it must be, and what the comparison is worth."
)


def run(seeds: int, say=lambda title: None) -> Reproduction:
    """Run everything; ``say`` hears the name of each part before it starts."""
    sections = []
    for part in (headline, gain, likelihood, rule, matching):
        say(part.__name__.rsplit(".", 1)[-1])
        sections.append(part.section(seeds))
    return Reproduction(
        "abid2008",
        "Kalman tracking with a fuzzy Q (2008), reproduced",
        LEAD,
        seeds,
        sections,
        "ψ, θ, Φ, ε and σ² are the paper's letters; ψ = [−y −y u u], so signs are those of the rest of driftwise.",
    )
