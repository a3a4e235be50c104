"""A level that has the season of its clock: sines and cosines of the season and its parts, beside a response."""

from __future__ import annotations

import numpy as np

from .change_places import under_each_noise, worth
from .noise_jumps import SURE
from .response import Response

WAVES = 1, 2, 3, 6  # sines of a season that are tried, the longest as long as it is


def beside_seasons(plain: Response, found: Response, seasons) -> list[Response]:
    """Return ``plain`` beside the seasons that a response of the record is surely without, one after the other.

    A step beside a season that is left to the colour of the noise has to stand out of the season.
    """
    before = len(found.columns)
    for season in seasons:
        sines = [waves(season, many, len(found.used)) for many in WAVES]
        found = with_likeliest(with_likeliest(found, sines), [one * swelling(len(found.used)) for one in sines])
    return [plain.with_columns(found.columns[before:])] if len(found.columns) > before else []


def with_likeliest(found: Response, choices) -> Response:
    """Return a response with the surest of some sets of columns, where one is sure."""
    looks = [look.with_columns(columns) for columns in choices for look in under_each_noise(found)]
    best = max(looks, key=lambda one: _worth(one, found))
    return best.settled(1) if _worth(best, found) > SURE else found


def swelling(T: int) -> np.ndarray:
    """Return by what a season is larger later, (T,): a straight line."""
    return np.arange(T) / T - 0.5


def _worth(one: Response, found: Response) -> float:
    return worth(one, "columns", len(one.columns) - len(found.columns))


def waves(season: int, many: int, T: int) -> np.ndarray:
    """Return the first sines and cosines of a season, (m, T); of two samples a turn there is a cosine alone."""
    angles = 2 * np.pi / season * np.outer(np.arange(1, min(many, season // 2) + 1), np.arange(T))
    both = np.stack([np.cos(angles), np.sin(angles)], axis=1).reshape(-1, T)
    return both[:-1] if 2 * len(angles) == season else both
