"""What a user says of a detector, as kernels want it."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..engine.errors import InputError, refuse_class
from .gain import GainProbes, PullTest
from .probes import ProbeBank
from .score import ScoreSums
from .watch import watch


def resolve_detector(detector, units=()) -> Any:
    """Return the kernel's detector; ``units`` are the squared units of the parameters whose slopes it is told."""
    parameters = len(units)
    known = (
        "VarianceCUSUM(), PageHinkley(), GLR() or ScoreCUSUM()"
        if parameters
        else "VarianceCUSUM(), PageHinkley() or GLR()"
    )
    if isinstance(detector, ProbeBank | GainProbes | PullTest):
        raise InputError(
            f"detector must be {known}, got {detector!r}: it compares probes of a gain, which only AdaptiveGain runs"
        )
    refuse_class("detector", detector)
    resolve = getattr(detector, "resolve", None)
    found = resolve(parameters) if resolve else detector
    if type(found) not in watch.table:
        raise InputError(f"detector must be {known}, got {detector!r}")
    return found._replace(d=found.d * np.sqrt(units)) if isinstance(found, ScoreSums) else found
