"""Ranges and azimuths in a table: where they lie on earth, or about a radar of which nobody says where it stands."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..engine.errors import InputError
from .polar import cartesian, ground_range, place
from .sites import HOW, Site, read_sites


class Placed(NamedTuple):
    """Positions (T, 2): latitude and longitude, degrees; metres East and North of the radar where ``radar`` is None.

    radar : (latitude, longitude) of that of the first plot, degrees, or None
    """

    position: np.ndarray
    radar: tuple[float, float] | None


def of_ranges(slant, azimuth, altitude, sensor, site=None, sites=None) -> Placed:
    """Return where objects are that radars see.

    An object of unknown altitude is taken to be as high as the radar, which puts an aircraft near it too far out.

    Parameters
    ----------
    slant, azimuth, altitude : (T,)
        m, radians, m; NaN where there is no altitude.
    sensor : (T,) of str
    site : (latitude, longitude) or (latitude, longitude, height m), optional
        Of the one radar.
    sites : see `read_sites`, optional
        Of several, by sensor.

    Examples
    --------
    >>> nobody = np.array(["", ""])
    >>> of_ranges(np.array([1000.0, 5000.0]), np.array([0.0, np.pi / 2]), np.array([np.nan, 3000.0]), nobody)[0].round()
    array([[   0., 1000.],
           [3999.,    0.]])
    """
    names = list(dict.fromkeys(sensor.tolist()))
    if site is not None:
        where = dict.fromkeys(names, Site(*site))
    else:
        where = {name: known for name, known in read_sites(sites).items() if name in names}
    lacking = [name for name in names if name not in where]
    if len(lacking) == len(names) <= 1:
        ground = np.where(np.isfinite(altitude), ground_range(slant, np.nan_to_num(altitude)), slant)
        return Placed(cartesian(ground, azimuth), None)
    if lacking:
        raise InputError(f"ranges of several radars need their sites; missing: {', '.join(map(repr, lacking))}. {HOW}")
    position = np.full((len(slant), 2), np.nan)
    for name, radar in where.items():
        at = sensor == name
        height = np.where(np.isfinite(altitude[at]), altitude[at], radar.height)
        latitude, longitude = np.radians([radar.latitude, radar.longitude])
        seen = place(slant[at], azimuth[at], height, latitude, longitude, radar.height)
        position[at] = np.degrees(np.stack(seen, axis=-1))
    first = where[names[0]]
    return Placed(position, (first.latitude, first.longitude))
