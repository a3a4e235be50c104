"""Where a plot lies: WGS-84 positions, and metres East and North of an origin on its tangent plane."""

from __future__ import annotations

import numpy as np

MAJOR, FLATTENING = 6378137.0, 1 / 298.257223563  # WGS-84, m
SQUARE = FLATTENING * (2 - FLATTENING)  # eccentricity squared


def ecef(latitude, longitude, height=0.0):
    """Return WGS-84 positions, earth-centred, (.., 3) m; angles in radians, height in m over the ellipsoid."""
    N = MAJOR / np.sqrt(1 - SQUARE * np.sin(latitude) ** 2)
    return np.stack(
        [
            (N + height) * np.cos(latitude) * np.cos(longitude),
            (N + height) * np.cos(latitude) * np.sin(longitude),
            (N * (1 - SQUARE) + height) * np.sin(latitude),
        ],
        axis=-1,
    )


def east_north(latitude, longitude, origin=None):
    """Return (T, 2) metres East and North of ``origin``, or of the first position, on its tangent plane.

    Parameters
    ----------
    latitude, longitude : (T,)
        Degrees; positions are taken at height 0.
    origin : (latitude, longitude), optional
        Degrees.
    """
    phi, lam = np.radians(latitude), np.radians(longitude)
    phi0, lam0 = (phi[0], lam[0]) if origin is None else np.radians(origin)
    offset = ecef(phi, lam) - ecef(phi0, lam0)
    east = np.array([-np.sin(lam0), np.cos(lam0), 0.0])
    north = np.array([-np.sin(phi0) * np.cos(lam0), -np.sin(phi0) * np.sin(lam0), np.cos(phi0)])
    return np.stack([offset @ east, offset @ north], axis=-1)


def geographic(position, origin):
    """Return (T, 2) latitude and longitude, degrees, of metres East and North of ``origin``: `east_north` undone.

    A point is lifted from the tangent plane to the ellipsoid along the plane's normal, which is a quadratic equation:
    exact at height 0, NaN where the plane has left the earth behind (6357 km and more).

    Examples
    --------
    >>> geographic(east_north([48.1, 49.0], [11.2, 9.0], (48.0, 11.0)), (48.0, 11.0)).round(9).tolist()
    [[48.1, 11.2], [49.0, 9.0]]
    """
    position = np.asarray(position, float)
    phi, lam = np.radians(origin)
    up = np.array([np.cos(phi) * np.cos(lam), np.cos(phi) * np.sin(lam), np.sin(phi)])
    east = np.array([-np.sin(lam), np.cos(lam), 0.0])
    flat = position[..., :1] * east + position[..., 1:] * np.cross(up, east)
    D = np.array([1.0, 1.0, 1 / (1 - SQUARE)]) / MAJOR**2  # (x, D x) = 1 on the ellipsoid
    foot = ecef(phi, lam)
    # (foot + flat + h up, D (foot + flat + h up)) = 1, and foot is on the ellipsoid where D foot is along up
    a, b = up @ (D * up), (foot + flat) @ (D * up)
    c = (flat * D * (2 * foot + flat)).sum(-1)
    root = np.where(b * b >= a * c, b * b - a * c, np.nan)
    x = foot + flat - (c / (b + np.sqrt(root)))[..., None] * up
    latitude = np.arctan2(x[..., 2], (1 - SQUARE) * np.hypot(x[..., 0], x[..., 1]))
    return np.degrees(np.stack([latitude, np.arctan2(x[..., 1], x[..., 0])], axis=-1))
