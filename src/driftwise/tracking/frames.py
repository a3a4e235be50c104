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
