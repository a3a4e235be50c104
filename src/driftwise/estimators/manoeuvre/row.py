"""What a manoeuvre filter keeps: the joint filter's row of order three, and the last two positions."""

from typing import NamedTuple

import numpy as np

from ...engine.dispatch import Size, open_row, open_scratch
from ..joint.row import Form, open_joint

# plots seen of the two that start it, scans since the first, and the last two positions
PLOTS, ELAPSED, LAST, BEFORE = range(4)
TRACK = 4


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
    walk: float  # variance of a step of phi
    cap: float  # its prior variance, never exceeded
    limit: float  # of |phi|
    spread: float  # variance of each state after two plots


class ManoeuvreRow(NamedTuple):
    """A joint `Row`, name for name, and ``track``."""

    head: np.ndarray
    s: np.ndarray
    D: np.ndarray
    U: np.ndarray
    held: np.ndarray
    unsure: np.ndarray
    known: np.ndarray
    sums: np.ndarray
    squares: np.ndarray
    steps: np.ndarray
    detector_state: np.ndarray
    track: np.ndarray


@open_row.on(ManoeuvreForm)
def open_row_manoeuvre_form(form, row):
    at = row.size - TRACK
    inner = open_joint(form, row[:at])
    return ManoeuvreRow(
        inner.head, inner.s, inner.D, inner.U, inner.held, inner.unsure, inner.known, inner.sums, inner.squares,
        inner.steps, inner.detector_state, row[at:],
    )  # fmt: skip


open_scratch.on(ManoeuvreForm)(open_scratch.table[Form])  # the scratch is the joint filter's
