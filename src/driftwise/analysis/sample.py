"""The records that come along."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..engine.errors import InputError

FOLDER = Path(__file__).parent.parent / "data"


def sample_data(name: str) -> dict[str, np.ndarray]:
    """Return the columns of a shipped record, NaN where nothing was measured.

    Parameters
    ----------
    name : "flight" (an airliner climbs and turns, every 2 s) or "nile" (yearly flow, 1871 to 1970)

    Examples
    --------
    >>> flight = sample_data("flight")
    >>> len(flight["track_deg"]), round(float(flight["ground_speed_mps"][-1]))
    (1221, 228)
    """
    path = FOLDER / f"{name}.csv"
    if not path.exists():
        known = ", ".join(sorted(p.stem for p in FOLDER.glob("*.csv")))
        raise InputError(f"there is no sample record {name!r}; there are: {known}")
    table = np.genfromtxt(path, delimiter=",", names=True)
    return {column: np.ascontiguousarray(table[column], float) for column in table.dtype.names or ()}
