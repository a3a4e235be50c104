"""Tracks as tables: CSV and Parquet, a row for each plot."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from ..engine.atomic import replaced
from ..engine.errors import InputError
from ..tables.spreadsheet import harmless
from .formats import WRITERS
from .frames import geographic
from .times import dated, stamps
from .tracks import Track, Tracks

PAIRS = {  # column of the table to column of the trace
    "east north": "position", "east_sd north_sd": "position_sd", "plot_east plot_north": "y",
    "predicted_east predicted_north": "prediction", "velocity_east velocity_north": "velocity",
}  # fmt: skip
SINGLE = "speed", "speed_sd", "course", "course_sd", "turn_rate", "turn_rate_sd", "manoeuvre", "onset", "nis"
HEIGHTS = {  # the same of the trace of altitudes
    "estimated_altitude": "position", "estimated_altitude_sd": "position_sd",
    "vertical_rate": "velocity", "vertical_rate_sd": "velocity_sd",
}  # fmt: skip
MOTION = "velocity_east", "velocity_north", "speed", "course"
WORDS = "key", "name", "sensor"


def columns(tracks: Tracks) -> dict[str, np.ndarray]:
    """Return the plots of all tracks, track by track: what was plotted, what had been predicted, what was estimated.

    track, key, name, sensor; time (s, or datetime64 where it is Unix time); latitude, longitude (degrees, WGS-84, where
    the origin is known) and east, north (m) of the estimate with east_sd, north_sd; plot_east, plot_north, altitude as
    they came; predicted_east, predicted_north with predicted_east_sd, predicted_north_sd before the plot was known;
    velocity_east, velocity_north and speed (m/s), course (degrees from North), turn_rate (rad/s), each with what it may
    err (.._sd); estimated_altitude (m) and vertical_rate (m/s, upwards), with theirs, NaN where no altitude is known;
    manoeuvre (probability), onset, nis (of the plot, mean over its coordinates).
    """
    parts = [_columns(track) for track in tracks]
    if not parts:
        raise InputError("there are no tracks to write: were no plots confirmed? See tracks.counts")
    table = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    if dated(table["time"]):
        table["time"] = stamps(table["time"])
    return table


def _columns(track: Track) -> dict[str, np.ndarray]:
    trace, plots = track.trace, track.plots
    table: dict[str, Any] = {"track": np.full(len(track), track.id), "time": plots.time}
    table |= {name: getattr(plots, name) for name in WORDS}
    if track.origin is not None:
        table["latitude"], table["longitude"] = geographic(trace.position, track.origin).T
    for names, column in PAIRS.items():
        table |= zip(names.split(), getattr(trace, column).T)
    table |= zip(("predicted_east_sd", "predicted_north_sd"), np.sqrt(trace.variance).T)
    table["altitude"], upwards = plots.altitude, track.vertical
    for name, column in HEIGHTS.items():
        value = np.full(len(track), np.nan) if upwards is None else getattr(upwards, column)[:, 0]
        table[name] = np.where(np.isfinite(value), value, np.nan)
    table |= {name: getattr(trace, name) for name in SINGLE}
    for name in MOTION:  # of the first plot nothing is known of it
        table[name] = np.where(np.isfinite(table["speed_sd"]), table[name], np.nan)
    return table


def _arrow(tracks: Tracks):
    """Return the table in Arrow; what is not finite is null."""
    import pyarrow as pa

    table = {}
    for name, column in columns(tracks).items():
        lost = ~np.isfinite(column) if column.dtype == float else None
        table[name] = pa.array(column, mask=lost)
        if column.dtype.kind == "M":
            table[name] = table[name].cast(pa.timestamp("us", "UTC"))
    return pa.table(table)


def write_parquet(tracks: Tracks, path) -> Path:
    """Write a row for each plot, see `columns`; times that are Unix times are time stamps in UTC."""
    import pyarrow.parquet as pq

    with replaced(path) as beside:
        pq.write_table(_arrow(tracks), beside, compression="zstd")
    return Path(path)


def write_csv(tracks: Tracks, path) -> Path:
    """Write a row for each plot, see `columns`; times that are Unix times are ISO 8601, an empty cell is unknown."""
    import pyarrow as pa
    from pyarrow import compute, csv

    table = _arrow(tracks)
    at = table.schema.get_field_index("time")
    if pa.types.is_timestamp(table.schema.field(at).type):
        text = compute.strftime(table.column(at), "%Y-%m-%dT%H:%M:%SZ")
        table = table.set_column(at, "time", text)
    for at, field in enumerate(table.schema):
        if pa.types.is_string(field.type):
            table = table.set_column(at, field.name, pa.array(map(harmless, table.column(at).to_pylist()), pa.string()))
    with replaced(path) as beside:
        csv.write_csv(table, beside)
    return Path(path)


def write_cat062(tracks: Tracks, path, source: tuple[int, int] = (0, 0)) -> Path:
    """Write ASTERIX CAT062, a record for each plot, sent by ``source``: system area and identification code."""
    from .formats.cat062 import encode_cat062

    with replaced(path) as beside:
        Path(beside).write_bytes(encode_cat062(tracks, *source))
    return Path(path)


def write(tracks: Tracks, folder, formats=("csv",)) -> list[Path]:
    """Write ``tracks.csv`` and its kin (`formats.WRITERS`) into a folder, and return the paths."""
    formats = [formats] if isinstance(formats, str) else list(formats)
    for name in formats:
        if name not in WRITERS:
            raise InputError(f"formats must be of {', '.join(WRITERS)}, got {name!r}")
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    return [_writer(name)(tracks, folder / f"tracks.{name}") for name in formats]


def _writer(name: str) -> Any:
    module, _, function = WRITERS[name].partition(":")
    return getattr(import_module(module), function)
