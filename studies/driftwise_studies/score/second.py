"""The second set of recordings, which nothing was chosen by: those that were answered badly when they first came."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from .records import AIR, ROWS, Record, cell_of, columns, filled, plain, stack


def of(file: str, y: str, *u: str, dt: float = 1.0) -> Callable[[Path], Record]:
    """Return a reader of a file of this set that can be used as it is."""
    return plain(f"second/{file}", y, *u, dt=dt)


def air_handler(where: Path) -> Record:
    """Return the supply-air temperature; mixed air, of which some cells cannot be read, both valves, fan."""
    table = columns(where / "second/ahu_faults_szcav.csv")
    mixed = [float(cell) if _is_number(cell) else np.nan for cell in table[AIR[0]].astype(str)]
    u = np.column_stack([filled(np.array(mixed)), stack(table, AIR[1:])])
    return Record(np.asarray(table["Supply_Air_T"], float), u, 60.0 * np.arange(len(u)))


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


SECOND: dict[str, Callable[[Path], Record]] = {
    "ball_beam": of("ball_beam.csv", "ball_position", "beam_angle", dt=0.1),
    "cd_player_y1": of("cd_player_arm.csv", "y1", "u1", "u2"),
    "cd_player_y2": of("cd_player_arm.csv", "y2", "u1", "u2"),
    "winding_T1": of("winding.csv", "T1", "S1", "S2", "S3", "I1_set", "I3_set", dt=0.1),
    "winding_T3": of("winding.csv", "T3", "S1", "S2", "S3", "I1_set", "I3_set", dt=0.1),
    "evaporator_dry_matter": of("evaporator.csv", "dry_matter", "feed", "vapour", "cooling"),
    "evaporator_flow": of("evaporator.csv", "out_flow", "feed", "vapour", "cooling"),
    "evaporator_temp": of("evaporator.csv", "out_temp", "feed", "vapour", "cooling"),
    "thermic_wall": of("thermic_wall.csv", "heat_flow", "T_in", "T_out"),
    "cylinder_1": of("hydraulic_cylinders.csv", "pos1", "ref1", "ref2", dt=0.1),
    "cylinder_2": of("hydraulic_cylinders.csv", "pos2", "ref1", "ref2", dt=0.1),
    "leaf_hppc_40C": cell_of("second/leaf_cell_hppc_40C.csv"),
    "wye_flow": of("wye_rainfall_flow.csv", "flow_mm_h", "rain_mm_h", dt=3600.0),
    "ahu_szcav": air_handler,
    "uk_seatbelts": of("uk_seatbelts.csv", "drivers", "kms", "PetrolPrice", "law"),
}


def read(name: str, where: Path) -> Record:
    """Return a record of either set."""
    return (ROWS | SECOND)[name](where)
