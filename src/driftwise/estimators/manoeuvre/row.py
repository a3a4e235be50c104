"""What a manoeuvre filter keeps: the joint filter's row of order three, and the last two positions."""

from typing import NamedTuple

from ...engine.dispatch import Size, open_scratch
from ...engine.layout import Field
from ..joint.row import JOINT, Form

# plots seen of the two that start it, scans since the first, and the last two positions
PLOTS, ELAPSED, LAST, BEFORE = range(4)


class ManoeuvreForm(NamedTuple):
    """A joint `Form` of order three without inputs, and how its one free pole may move."""

    n: Size
    inputs: Size
    direct: Size
    coloured: Size
    rows: Size
    noises: Size
    floor: float
    Px: float
    least: float
    settle: float
    detector_size: Size
    memory_size: Size
    fades: Size
    learns: Size
    slopes: Size
    forgets_state: float
    offset: Size
    fresh: Size
    walk: float  # variance of a step of phi
    cap: float  # its prior variance, never exceeded
    limit: float  # of |phi|
    spread: float  # variance of each state after two plots


MANOEUVRE = JOINT.replace(Field("track", ("4",), "plots, scans, and the last two positions, of a track that starts"))
MANOEUVRE.on(ManoeuvreForm)
open_scratch.on(ManoeuvreForm)(open_scratch.table[Form])  # the scratch is the joint filter's
