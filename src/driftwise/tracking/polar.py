"""Range and azimuth of a radar: on the ground, on the earth, and how uncertain.

Azimuth is clockwise from north, in radians, as all angles here unless degrees are said; lengths are in metres.
"""

from __future__ import annotations

import numpy as np

from .frames import MAJOR, SQUARE, ecef

MINOR = MAJOR * np.sqrt(1 - SQUARE)
MEAN = (2 * MAJOR + MINOR) / 3  # radius of the sphere, m
COUNTS = 0.4  # of range azimuth_sd^2 / range_sd: from here on the unbiased conversion differs from the linear one


def ground_range(slant, altitude, height=0.0, radius=MEAN):
    """Return how far along the ground an object lies whose slant range and altitude are known.

    ``2 R asin(sqrt((slant^2 - (altitude - height)^2) / (4 (R + height) (R + altitude))))``: the law of cosines of the
    triangle centre of the earth, radar, object, written without cancellation. For short ranges that is
    ``sqrt(slant^2 - (altitude - height)^2)``. An object that would be higher above the radar than it is far from it is
    taken overhead (0).

    Parameters
    ----------
    slant : array
        m, range as measured.
    altitude, height : array
        m, of the object and of the radar. A pressure altitude may be 300 m wrong; near the radar that is felt.

    Examples
    --------
    A flight level not allowed for would put this aircraft 2.7 km too far out:

    >>> round(float(20e3 - ground_range(20e3, 10e3)))
    2693
    """
    rise = np.asarray(altitude) - height
    square = np.maximum(np.asarray(slant, float) ** 2 - rise**2, 0) / (4 * (radius + height) * (radius + altitude))
    return 2 * radius * np.arcsin(np.sqrt(np.minimum(square, 1)))


def cartesian(range, azimuth):
    """Return (.., 2) metres East and North of a range along the ground and an azimuth."""
    return np.stack([range * np.sin(azimuth), range * np.cos(azimuth)], axis=-1)


def linear_covariance(range, azimuth, range_sd, azimuth_sd):
    """Return the (.., 2, 2) covariance of East and North: range error along, azimuth error across the line of sight."""
    sin, cos = np.sin(azimuth), np.cos(azimuth)
    along, across = np.stack([sin, cos], axis=-1), np.stack([cos, -sin], axis=-1)
    variances = np.asarray(range_sd) ** 2, (range * np.asarray(azimuth_sd)) ** 2
    return sum(np.multiply(v, 1.0)[..., None, None] * e[..., :, None] * e[..., None, :]
               for v, e in zip(variances, (along, across)))  # fmt: skip


def unbiased(range, azimuth, range_sd, azimuth_sd):
    """Return the unbiased position (.., 2), East and North, and its covariance (.., 2, 2), given the measurement.

    A noisy azimuth shortens the mean position by ``exp(-azimuth_sd^2 / 2)``; this conversion undoes it. It counts where
    ``range azimuth_sd^2 / range_sd > 0.4``: wide beams far away. Being conditioned on the measurement, the covariance
    differs from that at the true point by about ``4 azimuth_sd^2`` (8 % at 0.15 rad).

    References
    ----------
    Mo, Song, Zhou, Sun, Bar-Shalom, *Unbiased converted measurements for tracking*, IEEE Transactions on Aerospace and
    Electronic Systems 34 (1998) 1023-1027; its covariance here in the form conditioned on the measurement.

    Examples
    --------
    >>> position, covariance = unbiased(1000.0, 0.0, 10.0, 0.1)
    >>> position.round(1)
    array([   0., 1005.])
    """
    range, azimuth = np.asarray(range, float), np.asarray(azimuth, float)
    shrink = np.exp(-(np.asarray(azimuth_sd) ** 2) / 2)
    spread = (shrink**-2 - 2) * range**2
    half = (range**2 + np.asarray(range_sd) ** 2) / 2
    sin, cos = np.sin(azimuth), np.cos(azimuth)
    east = spread * sin**2 + half * (1 - shrink**4 * np.cos(2 * azimuth))
    north = spread * cos**2 + half * (1 + shrink**4 * np.cos(2 * azimuth))
    both = spread * sin * cos + half * shrink**4 * np.sin(2 * azimuth)
    covariance = np.stack([np.stack([east, both], axis=-1), np.stack([both, north], axis=-1)], axis=-1)
    return cartesian(range, azimuth) / shrink[..., None], covariance


def axes(latitude, longitude):
    """Return the unit vectors East, North and Up at a place, earth-centred; radians."""
    sin, cos, zero = np.sin, np.cos, np.zeros_like(np.asarray(latitude, float) + longitude)
    east = np.stack([-sin(longitude) + zero, cos(longitude) + zero, zero], axis=-1)
    up = np.stack([cos(latitude) * cos(longitude), cos(latitude) * sin(longitude), sin(latitude) + zero], axis=-1)
    return east, np.cross(up, east), up


def geodetic(position):
    """Return latitude, longitude (radians) and height over the ellipsoid (m) of earth-centred positions (.., 3).

    Bowring's formula, used twice: better than a millimetre from the sea floor to orbit.
    """
    x, y, z = np.moveaxis(np.asarray(position, float), -1, 0)
    across = np.hypot(x, y)
    beta = np.arctan2(z * MAJOR, across * MINOR)
    for _ in (1, 2):
        latitude = np.arctan2(
            z + SQUARE / (1 - SQUARE) * MINOR * np.sin(beta) ** 3, across - SQUARE * MAJOR * np.cos(beta) ** 3
        )
        beta = np.arctan2(MINOR * np.sin(latitude), MAJOR * np.cos(latitude))
    normal = MAJOR / np.sqrt(1 - SQUARE * np.sin(latitude) ** 2)
    height = across * np.cos(latitude) + z * np.sin(latitude) - MAJOR**2 / normal
    return latitude, np.arctan2(y, x), height


def place(slant, azimuth, altitude, latitude, longitude, height=0.0):
    """Return latitude and longitude of an object seen by a radar, on WGS-84.

    The line of sight of this azimuth is raised until the point at the slant range has the altitude (Newton's method on
    the elevation, from the sphere's). Refraction is left out.

    Parameters
    ----------
    slant, azimuth, altitude : (T,)
        m, radians, m over the ellipsoid.
    latitude, longitude, height : float
        Of the radar; radians and m.

    Examples
    --------
    Due north of a radar at 50 N, 100 km away and 10 km high:

    >>> latitude, longitude = place(100e3, 0.0, 10e3, np.radians(50), np.radians(10))
    >>> round(float(np.degrees(latitude)), 4), round(float(np.degrees(longitude)), 4)
    (50.8938, 10.0)
    """
    slant, azimuth, altitude = np.broadcast_arrays(np.asarray(slant, float), azimuth, altitude)
    east, north, up = axes(latitude, longitude)
    forward = np.sin(azimuth)[..., None] * east + np.cos(azimuth)[..., None] * north
    radar = ecef(latitude, longitude, height)
    distance = np.maximum(slant, 1e-3)
    rise = ((MEAN + altitude) ** 2 - (MEAN + height) ** 2 - distance**2) / (2 * distance * (MEAN + height))
    elevation = np.arcsin(np.clip(rise, -1, 1))
    for _ in range(4):
        sin, cos = np.sin(elevation)[..., None], np.cos(elevation)[..., None]
        phi, lam, h = geodetic(radar + distance[..., None] * (cos * forward + sin * up))
        slope = distance * np.sum((cos * up - sin * forward) * axes(phi, lam)[2], axis=-1)
        step = (altitude - h) / np.where(np.abs(slope) > 1, slope, np.inf)
        elevation = np.clip(elevation + step, -np.pi / 2, np.pi / 2)
    sin, cos = np.sin(elevation)[..., None], np.cos(elevation)[..., None]
    phi, lam, _ = geodetic(radar + distance[..., None] * (cos * forward + sin * up))
    return phi, lam
