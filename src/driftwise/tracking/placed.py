"""Plots of geographic positions, and which of them are no news."""

from __future__ import annotations

import numpy as np

from .frames import east_north
from .plots import Plots, plots

STANDING = 0.5  # whatever the unit of a reported speed: below it, the same position twice is no stale row


def placed(time, latitude, longitude, *, origin=None, **columns) -> Plots:
    """Return `Plots` of positions in degrees, East and North of ``origin`` or of the first position."""
    latitude, longitude = np.asarray(latitude, float), np.asarray(longitude, float)
    known = np.isfinite(latitude) & np.isfinite(longitude)
    if origin is None and known.any():
        first = np.flatnonzero(known)[0]
        origin = (latitude[first], longitude[first])
    position = np.full((len(latitude), 2), np.nan)
    if known.any():
        position[known] = east_north(latitude[known], longitude[known], origin)
    return plots(time, position, origin=origin, **columns)


def outside(latitude, longitude):
    """Return (what is wrong or "", per position) of degrees: beyond the poles, no fix, or not available as in AIS."""
    wrong = np.full(len(latitude), "", object)
    with np.errstate(invalid="ignore"):
        wrong[(latitude == 0) & (longitude == 0)] = "latitude and longitude are both 0: no fix"
        far = (np.abs(latitude) > 90) | (np.abs(longitude) > 360)
    wrong[far] = [f"position {a:g}, {b:g} is not on earth" for a, b in zip(latitude[far], longitude[far])]
    return wrong


def repeats(time, position, key, sensor=None, speed=None):
    """Return masks (T,) of rows that are no news: (another of its key has this time, stale).

    A row that repeats the position before it, of the same key and sensor, is stale: a table of states was written
    on a clock of its own. It is news where ``speed`` says that the object stands. Plots of unknown objects may share
    a time.
    """
    codes = np.unique(np.asarray(key, str), return_inverse=True)[1]
    known = np.array([who != "" for who in key], bool)
    order = np.lexsort((np.arange(len(time)), time, codes))
    twice, stale = np.zeros(len(time), bool), np.zeros(len(time), bool)
    alike = codes[order[1:]] == codes[order[:-1]]
    twice[order[1:]] = alike & (time[order[1:]] == time[order[:-1]]) & known[order[1:]]
    if sensor is not None:
        codes = np.unique([f"{who}\0{seen}" for who, seen in zip(codes, sensor)], return_inverse=True)[1]
        order = np.lexsort((np.arange(len(time)), time, codes))
    order = order[~twice[order]]
    alike = codes[order[1:]] == codes[order[:-1]]
    stale[order[1:]] = alike & (position[order[1:]] == position[order[:-1]]).all(axis=1)
    if speed is not None:
        stale &= ~(np.abs(speed) < STANDING)
    return twice, stale
