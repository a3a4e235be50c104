"""The size of a state: what a series of a fleet takes, and what has to be saved of it."""

from __future__ import annotations

from collections.abc import Iterator

import driftwise as dw

from .verdicts import Table


def verdicts() -> Iterator[Table]:
    """Yield the bytes of a state of common estimators."""
    kinds = {
        "AR(1)": dw.AR(1),
        "ARX(2, 2)": dw.ARX(2, 2),
        "ARX(2, 2), RestartOnChange": dw.ARX(2, 2, memory=dw.RestartOnChange()),
        "ARX(2, 2), AutoMemory": dw.ARX(2, 2, memory=dw.AutoMemory()),
        "ARMAX(2, 2, 1)": dw.ARMAX(2, 2, 1),
        "Joint(1)": dw.Joint(1),
        "Joint(3)": dw.Joint(3),
        "Joint(3), input, direct": dw.Joint(3, inputs=1, direct=True),
        "Joint(8), input, direct": dw.Joint(8, inputs=1, direct=True),
        "JointMIMO((2, 2)), two inputs": dw.JointMIMO((2, 2), inputs=2),
    }
    rows = [(name, est.model.N, est.dtype.itemsize, est.dtype.itemsize / 1000) for name, est in kinds.items()]
    text = "One row of numbers is all that is kept of a series; a fleet is a matrix of them, beside its index of keys."
    yield Table("Bytes of a state", ("estimator", "unknowns", "bytes", "GB of a million series"), rows, text)
