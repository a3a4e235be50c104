"""Every memory for drift of unknown speed, ranked on eight systems; and what the default promises."""

from __future__ import annotations

from .abid import automatic, hindsight, ranking, surprises
from .verdict import Reproduction

LEAD = (
    "Nobody knows Q. Every memory of this package that copes without it, from forgetting over Abid and Kamoun's fuzzy "
    "rule and each rival they list to the default, on the same records of eight systems: constant, wandering, smooth "
    "and jumping parameters, and a noise variance told wrong. Ours is judged by the same numbers, and loses where it "
    "loses."
)


def run(seeds: int, say=lambda title: None) -> Reproduction:
    """Run everything; ``say`` hears the name of each part before it starts."""
    sections = []
    for part in (ranking, automatic, surprises, hindsight):
        say(part.__name__.rsplit(".", 1)[-1])
        sections.append(part.section(seeds))
    return Reproduction(
        "policies",
        "Memories for drift of unknown speed, ranked",
        LEAD,
        seeds,
        sections,
        "The systems are those of the study behind driftwise reproduce abid2008; their records depend on the seed "
        "alone. Expected numbers were measured beforehand, with other code and other records.",
    )
