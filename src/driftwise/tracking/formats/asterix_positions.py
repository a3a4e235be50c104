"""Reports of radars and of aircraft on one plane, metres East and North of an origin."""

from __future__ import annotations

import numpy as np

from ...engine.errors import InputError
from ..frames import east_north, ecef
from ..polar import COUNTS, MEAN, axes, cartesian, geodetic, ground_range, linear_covariance, place, unbiased
from ..sites import HOW, Site
from .asterix_reports import EARTH, POLAR

TOLERANCE = 500.0  # m by which a pressure altitude may exceed the slant range: then the object is overhead


def positions(rows, sites, origin):
    """Return (T, 2) positions, (T, 2, 2) covariances, the origin, and (row, what) of those that cannot be.

    Parameters
    ----------
    rows : sequence of Row
        Reports with a position.
    sites : dict
        "SAC/SIC" -> `Site`.
    origin : (latitude, longitude) or None
    """
    T = len(rows)
    position, covariance = np.full((T, 2), np.nan), np.full((T, 2, 2), np.nan)
    lost: list[tuple[int, str]] = []
    if not T:
        return position, covariance, origin, lost
    kind = np.array([row.body.kind for row in rows])
    sensor = np.array([row.sensor for row in rows], object)
    first, second = np.array([(row.body.first, row.body.second) for row in rows], float).T
    radars = list(dict.fromkeys(sensor[kind != EARTH]))
    lacking = [s for s in radars if s not in sites]
    alone = len(radars) == 1 and (kind != EARTH).all() and origin is None
    if lacking and not alone:
        which = ", ".join(lacking)
        raise InputError(f"plots on one plane need the sites of their radars; missing: {which} (SAC/SIC). {HOW}")
    if origin is None and not lacking:
        at = sites[sensor[0]] if kind[0] != EARTH else None
        origin = (at.latitude, at.longitude) if at else (float(first[0]), float(second[0]))
    altitude = _altitudes(rows)
    where = np.flatnonzero(kind == EARTH)
    if len(where):
        position[where] = east_north(first[where], second[where], origin)
        reported = [k for k in where if rows[k].body.sd]
        for k in reported:
            covariance[k] = np.diag(np.square(np.maximum(rows[k].body.sd, 0.5)))
    for name in radars:
        where = np.flatnonzero((sensor == name) & (kind != EARTH))
        site, polar = sites.get(name), kind[where] == POLAR
        xy = np.stack([first[where], second[where]], axis=-1)
        slant = np.where(polar, xy[:, 0], np.hypot(*xy.T))
        azimuth = np.where(polar, xy[:, 1], np.arctan2(*xy.T))
        position[where], covariance[where], wrong = _radar(slant, azimuth, altitude[where], polar, site, origin)
        lost += [
            (int(where[k]), f"an altitude of {altitude[where[k]]:.0f} m is further from the radar than the plot, "
             f"at {slant[k]:.0f} m: one of them is wrong") for k in np.flatnonzero(wrong)
        ]  # fmt: skip
    return position, covariance, origin, lost


def _altitudes(rows):
    """Return (T,) altitudes; one that is missing is the median of those of the same key, where there are any."""
    altitude = np.array([row.body.altitude for row in rows], float)
    known: dict[str, list] = {}
    for row, h in zip(rows, altitude):
        if row.body.key and h == h:
            known.setdefault(row.body.key, []).append(h)
    median = {key: float(np.median(h)) for key, h in known.items()}
    return np.array([h if h == h else median.get(row.body.key, np.nan) for row, h in zip(rows, altitude)])


def _radar(slant, azimuth, altitude, polar, site, origin):
    """Return positions, covariances and which plots cannot be, of one radar."""
    known = site or Site(0.0, 0.0)
    height = np.where(np.isfinite(altitude), altitude, known.height)
    rise = np.abs(height - known.height)
    wrong = polar & (slant < rise - TOLERANCE)
    beam = np.radians(known.azimuth_sd)
    along = np.where(polar, ground_range(slant, height, known.height), slant)
    # the range error on the ground: that of the slant range where the object is far away, more near the zenith
    sd = np.sqrt(along**2 + 2 * slant * known.range_sd) - along if polar.any() else np.full(len(slant), known.range_sd)
    sd = np.where(polar, np.maximum(sd, known.range_sd), known.range_sd)
    wide = along * beam**2 / sd > COUNTS
    stretch = np.where(wide, np.exp(beam**2 / 2), 1.0)
    spread = linear_covariance(np.hypot(along, sd), 0.0 * azimuth, sd, beam)  # overhead, it may be an sd away
    if wide.any():
        spread[wide] = unbiased(along[wide], 0.0 * azimuth[wide], sd[wide], beam)[1]
    if site is None:
        position, turn = cartesian(stretch * along, azimuth), _rotation(azimuth)
    else:
        phi, lam = np.radians((site.latitude, site.longitude))
        latitude, longitude = place(stretch * slant, azimuth, height, phi, lam, site.height)
        east, north, _ = axes(phi, lam)
        if not polar.all():
            xy = cartesian(stretch * along, azimuth)[~polar]
            flat = geodetic(ecef(phi, lam) + xy[:, :1] * east + xy[:, 1:] * north)
            latitude[~polar], longitude[~polar] = flat[0], flat[1]
        position = east_north(np.degrees(latitude), np.degrees(longitude), origin)
        turn = _directions(phi, lam, azimuth, along / MEAN, np.radians(origin))
    covariance = turn @ spread @ np.swapaxes(turn, -1, -2)
    position[wrong] = np.nan
    return position, covariance, wrong


def _rotation(azimuth):
    """Return (T, 2, 2): columns East and North of the directions across and along the line of sight."""
    sin, cos = np.sin(azimuth), np.cos(azimuth)
    return np.stack([np.stack([cos, sin], axis=-1), np.stack([-sin, cos], axis=-1)], axis=-2)


def _directions(phi, lam, azimuth, angle, origin):
    """Return `_rotation` as seen at the origin, for objects at an angle (radians) from the radar along the earth."""
    east, north, up = axes(phi, lam)
    sin, cos = np.sin(azimuth)[:, None], np.cos(azimuth)[:, None]
    across = cos * east - sin * north
    along = np.cos(angle)[:, None] * (sin * east + cos * north) - np.sin(angle)[:, None] * up
    plane = np.stack(axes(*origin)[:2])
    return np.stack([across @ plane.T, along @ plane.T], axis=-1)
