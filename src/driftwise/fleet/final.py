"""A row for each series at the end: what was counted, what was learnt, how good the error bars are."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .counters import COLUMNS
from .fleet_snapshot import census

SLICE = 1 << 14  # series at a time
COUNTS = (*COLUMNS[: COLUMNS.index("scored")], "gaps")  # of the tally
INSTANTS = ("first_time", "last_time", "last_jump")


def final(fleet, tally, level) -> Iterator[tuple[np.ndarray, dict[str, np.ndarray]]]:
    """Yield rows of the fleet and their columns by name, some series at a time.

    Counts and instants are those of `Tally`; ``level`` (S, p) is what was subtracted from the outputs. ``nis`` is the
    mean of z^2, ``coverage`` the share within 1.96 deviations, ``error`` the root mean square of the one-step errors,
    ``error_of_last`` the same had the last value been the forecast.
    """
    known, p = census(fleet), level.shape[1]
    for first in range(0, max(len(fleet), 1), SLICE):
        at = np.arange(first, min(first + SLICE, len(fleet)))
        sums = "scored", "z2", "inside", "compared", "e2", "dy2"
        some = {name: tally[name][at] for name in (*COUNTS, *INSTANTS, "step", *sums)}
        columns = {name: some[name].astype(np.int64) for name in COUNTS}
        columns |= {name: some[name] for name in (*INSTANTS, "step")}
        columns |= {f"level.{j + 1}" if p > 1 else "level": level[at, j] for j in range(p)}
        columns |= dict(zip(known.names, known.theta[at].T))
        columns |= {f"{name}_std": values for name, values in zip(known.names, known.std[at].T)}
        yield (
            at,
            columns
            | {
                "noise_std": known.noise[at],
                "nis": _ratio(some["z2"], some["scored"]),
                "coverage": _ratio(some["inside"], some["scored"]),
                "error": np.sqrt(_ratio(some["e2"], some["compared"])),
                "error_of_last": np.sqrt(_ratio(some["dy2"], some["compared"])),
            },
        )


def _ratio(sums, counts) -> np.ndarray:
    """Return means, NaN of nothing."""
    return np.divide(sums, counts, out=np.full(len(sums), np.nan), where=counts > 0)
