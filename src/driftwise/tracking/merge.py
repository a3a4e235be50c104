"""Plots of several sources as one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..engine.errors import InputError
from .frames import east_north, geographic
from .plots import COLUMNS, Plots, plots


def moved(some: Plots, origin) -> np.ndarray:
    """Return positions in metres East and North of another origin."""
    if some.origin == origin or not len(some):
        return some.position
    if some.origin is None or origin is None:
        raise InputError("plots with a place on earth and plots without one cannot be mixed: give both an origin")
    latitude, longitude = geographic(some.position, some.origin).T
    return east_north(latitude, longitude, origin)


def joined(parts: Sequence[Plots]) -> Plots:
    """Return all plots in order of time, relative to the first origin."""
    if len(parts) == 1:
        return parts[0]
    origin = next((p.origin for p in parts if len(p)), None)
    columns = {name: np.concatenate([getattr(p, name) for p in parts]) for name in COLUMNS}
    columns["position"] = np.concatenate([moved(p, origin) for p in parts])
    return plots(**columns, origin=origin, faults=[f for p in parts for f in p.faults])
