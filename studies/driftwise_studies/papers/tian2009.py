"""Tian (2009): the DC motor, its theorem and figures; who does better, what wrong models and wrong priors cost."""

from __future__ import annotations

from .tian import coefficients, exactness, faults, growth, headline, identification, ours, prior, starts
from .verdict import Reproduction, Scaled

LEAD = (
    "Y. Tian's estimator has no gain, no initial state, and does not see disturbances of known shape: state in "
    "finite time from integrals only. Once its misprints are corrected the theorem is right, and the angle and "
    "speed of his motor are as good as he says. The current is not: with his noise x3 has a standard deviation of "
    "158 A at his epsilon of 0.15 s and 2.8 A after 10 s, where the current itself swings by 24 A. Least squares "
    "on the last second, told roughly how large the disturbance is, has 0.09 A, forgets errors of the model, and "
    "says how sure it is."
)
PARTS = {
    "figures": headline.section,
    "comparison": ours.section,
    "model errors": ours.errors,
    "priors": prior.section,
    "theorem": coefficients.section,
    "discretisation and growth": growth.section,
    "windows": exactness.section,
    "faults": lambda seeds: faults.section(_of(seeds, 100)),
    "unknown frequency": lambda seeds: faults.frequency(_of(seeds, 20)),
    "identification": lambda seeds: identification.section(_of(seeds, 100)),
    "starts": starts.section,
}


def _of(seeds: int, count: int) -> int:
    """Return how many records a part takes that was set for ``count`` of 200."""
    return Scaled(seeds, 200).records(count, 20)


def run(seeds: int, say=lambda title: None) -> Reproduction:
    """Run everything; ``say`` hears the name of each part before it starts."""
    sections = []
    for name, part in PARTS.items():
        say(name)
        sections.append(part(seeds))
    return Reproduction(
        "tian2009",
        "Algebraic state estimation (2009), reproduced",
        LEAD,
        seeds,
        sections,
        "x1, x2, x3 are the motor's angle, speed and current, q1 and q2 the amplitudes of its disturbance, as in the "
        "paper; T is the length of a window.",
    )
