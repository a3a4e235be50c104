"""Plots: positions that somebody reported, with whatever else came along."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ..engine import validation
from ..engine.errors import InputError

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
        """Return some of the plots: a slice, a mask or indices; of one number that plot alone."""
        index = [index] if isinstance(index, int | np.integer) else index
        return replace(self, **{name: getattr(self, name)[index] for name in COLUMNS})


def checked(origin) -> tuple[float, float]:
    """Return an origin that can be."""
    try:
        latitude, longitude = map(float, origin)
    except (TypeError, ValueError):
        raise InputError(f"origin must be (latitude, longitude) in degrees, got {origin!r}") from None
    if not (abs(latitude) <= 90 and abs(longitude) <= 360):
        raise InputError(
            f"origin must be (latitude, longitude) in degrees, got {origin!r}; are they swapped, or metres?"
        )
    return latitude, longitude


def _words(value) -> np.ndarray:
    """Return text; "" where there is none."""
    value = np.array("" if value is None else value, object)
    words = ["" if one is None or one != one else str(one) for one in value.flat]
    return np.array(words, object).reshape(value.shape)


def own_name(title: str) -> str:
    """Return what to call the object whose own positions a file holds: the file, without its extension.

    >>> own_name("logs/gull 7.nmea"), own_name("standard input")
    ('gull 7', 'standard input')
    """
    return Path(title.removesuffix(".gz")).stem or title


def plots(
    time, position, *, covariance=None, altitude=None, key=None, name=None, sensor=None, origin=None, faults=()
) -> Plots:
    """Return `Plots` of columns, sorted by time (stable); what is not given is unknown.

    Parameters
    ----------
    time : (T,)
        s, or dates (Unix time; UTC where they say no zone).
    position : (T, 2)
        m East and North. A plot whose time or position is not finite is left out, as a `Fault`.
    covariance : (2, 2) or (T, 2, 2), optional
        m^2; a number or two are variances, without correlation.
    altitude : (T,), optional
    key, name, sensor : str or (T,) of str, optional
    origin : (latitude, longitude), optional
    faults : sequence of Fault

    Raises
    ------
    InputError
        Where columns do not have the same length.
    """
    time, position = validation.seconds("time", time).reshape(-1), validation.floats("position", position)
    T = len(time)
    position = position.reshape(1, 2) if T == 1 and position.shape == (2,) else position
    if position.shape != (T, 2):
        raise InputError(f"position must have a row (East, North) for each of {T} times, got shape {position.shape}")
    if covariance is not None and np.shape(covariance) in ((), (2,)):
        covariance = np.diag(np.broadcast_to(validation.floats("covariance", covariance), (2,)))

    def column(label, value, shape, kind, unknown):
        value = validation.floats(label, unknown if value is None else value) if kind is float else _words(value)
        try:
            return np.array(np.broadcast_to(value, (T, *shape)))
        except ValueError:
            raise InputError(f"{label} must have shape {(T, *shape)}, got {value.shape}") from None

    out = Plots(
        time, position,
        column("covariance", covariance, (2, 2), float, np.nan), column("altitude", altitude, (), float, np.nan),
        column("key", key, (), object, ""), column("name", name, (), object, ""),
        column("sensor", sensor, (), object, ""),
        None if origin is None else checked(origin), tuple(faults),
    )  # fmt: skip
    good = np.isfinite(time) & np.isfinite(position).all(axis=1)
    order = np.flatnonzero(good)[np.argsort(time[good], kind="stable")]
    lost = tuple(Fault("plots", int(k), "time or position is not a finite number") for k in np.flatnonzero(~good))
    return replace(out[order], faults=out.faults + lost)
