"""Compile ahead what `driftwise fleet run` needs without options: sorting, counting, ARX(2, 2) and AR(2)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..estimators.arx.estimator import AR, ARX
from ..memory.auto import AutoMemory
from .counters import adding
from .crew import Crew
from .grouping import stable_order


def warm() -> Iterator[str]:
    """Compile one after the other and yield what it is."""
    stable_order(np.array([1, 0]), 2)
    adding()
    yield "samples by series"
    for est in (ARX(2, 2, offset=True, memory=AutoMemory()), AR(2, offset=True, memory=AutoMemory())):
        crew, own = Crew(est), est.n_columns
        for columns in (4, own, own + 2 * est.model.N):  # what `Fleet`, and what `FleetRun` reads of a sample
            crew.loop(columns)
        yield f"Fleet({est!r})"
