"""Plots: positions that somebody reported, with whatever else came along."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ..errors import InputError

COLUMNS = ("time", "position", "covariance", "altitude", "key", "name", "sensor")


@dataclass(frozen=True)
class Fault:
    """A record that could not be used: where it lies and what is wrong with it."""

    source: str
    offset: int  # byte, or line of a text file
    what: str


@dataclass(frozen=True)
class Plots:
    """Plots of any number of objects, in order of time.

    Attributes
    ----------
    time : (T,)
        s; Unix time where the source knows the day.
    position : (T, 2)
        Metres East and North of ``origin``.
    covariance : (T, 2, 2)
        Of the measurement, m^2; NaN where the source does not tell.
    altitude : (T,)
        m; NaN where there is none.
    key : (T,) of str
        Who it is: "4BAA5F" (24-bit address), "A1234" (Mode A code), an MMSI or any identifier; "" is unknown.
    name : (T,) of str
        Callsign or ship's name; "" is unknown.
    sensor : (T,) of str
        Which radar or receiver saw it, "SAC/SIC" for ASTERIX; "" is unknown.
    origin : (latitude, longitude) or None
        Degrees, of East = North = 0; None where the source has metres without a place on earth.
    faults : tuple of Fault
        Records skipped while reading.
    """

    time: np.ndarray
    position: np.ndarray
    covariance: np.ndarray
    altitude: np.ndarray
    key: np.ndarray
    name: np.ndarray
    sensor: np.ndarray
    origin: tuple[float, float] | None = None
    faults: tuple[Fault, ...] = field(default=(), repr=False)

    def __len__(self):
        return len(self.time)

    def __getitem__(self, index) -> Plots:
        """Return some of the plots: a slice, a mask or indices."""
        return replace(self, **{name: getattr(self, name)[index] for name in COLUMNS})


def plots(
    time, position, *, covariance=None, altitude=None, key=None, name=None, sensor=None, origin=None, faults=()
) -> Plots:
    """Return `Plots` of columns, sorted by time (stable); what is not given is unknown.

    Parameters
    ----------
    time : (T,)
        s.
    position : (T, 2)
        m East and North. A plot whose time or position is not finite is left out, as a `Fault`.
    covariance : (2, 2) or (T, 2, 2), optional
    altitude : (T,), optional
    key, name, sensor : str or (T,) of str, optional
    origin : (latitude, longitude), optional
    faults : sequence of Fault

    Raises
    ------
    InputError
        Where columns do not have the same length.
    """
    time, position = np.array(time, float).reshape(-1), np.array(position, float).reshape(-1, 2)
    T = len(time)
    if len(position) != T:
        raise InputError(f"position must have a row (East, North) for each of {T} times, got {len(position)} rows")

    def column(label, value, shape, kind, unknown):
        value = np.array(unknown if value is None else value, kind)
        try:
            return np.array(np.broadcast_to(value, (T, *shape)))
        except ValueError:
            raise InputError(f"{label} must have shape {(T, *shape)}, got {value.shape}") from None

    out = Plots(
        time, position,
        column("covariance", covariance, (2, 2), float, np.nan), column("altitude", altitude, (), float, np.nan),
        column("key", key, (), object, ""), column("name", name, (), object, ""),
        column("sensor", sensor, (), object, ""),
        None if origin is None else (float(origin[0]), float(origin[1])), tuple(faults),
    )  # fmt: skip
    good = np.isfinite(time) & np.isfinite(position).all(axis=1)
    order = np.flatnonzero(good)[np.argsort(time[good], kind="stable")]
    lost = tuple(Fault("plots", int(k), "time or position is not a finite number") for k in np.flatnonzero(~good))
    return replace(out[order], faults=out.faults + lost)
