"""Section 3.3 of Salut et al. (1979) on recorded radars: one aircraft, ten boats, records of 50 plots."""

from __future__ import annotations

from . import radar_fifty, radar_track
from .verdict import Reproduction

LEAD = (
    "The paper follows one coordinate of an aircraft through 50 plots of a radar whose data it does not publish: "
    "unknown dynamics of third order, estimated with the state. On two recorded radars that form predicts worse than "
    "a constant-velocity filter. The idea wins once two poles are held at 1 and only the manoeuvre's is learnt, and "
    "most of all in a bank that has plain filters beside it."
)


def run(seeds: int, say=lambda title: None) -> Reproduction:
    """Run everything; ``say`` hears the name of each part before it starts."""
    say("one aircraft")
    sections = radar_track.sections()
    say("records of 50 plots")
    return Reproduction(
        "radar",
        "Section 3.3 of Salut et al. (1979) on recorded radars",
        LEAD,
        seeds,
        [*sections, radar_fifty.section()],
        "The drawn flights beside the recordings have their own number and seed, so --seeds changes nothing. The "
        "paper's own panels are: its Fig. 2 the measurements, Fig. 3 the estimated position, Figs. 4 to 6 the three "
        "parameters; innovations, wrong noise polynomials and fixed filters beside it are not in the paper.",
    )
