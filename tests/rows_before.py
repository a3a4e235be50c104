"""Rows of tracks as versions before wrote them."""

import numpy as np

from driftwise.estimators.track import bank


def without_courses(rows, C: int) -> np.ndarray:
    """Return rows (.., numbers) without what a target may do: lines kept an acceleration, too, which was 0."""
    at = bank.row_at(C)
    former = np.zeros((*rows.shape[:-1], bank.KALMAN, C, 10))
    lines = rows[..., at.linear : at.linear + 6 * bank.LINES * C]
    curves = rows[..., at.linear + 6 * bank.LINES * C : at.circle]
    former[..., : bank.LINES, :, [0, 1, 3, 4, 6, 9]] = lines.reshape(*rows.shape[:-1], bank.LINES, C, 6)
    former[..., bank.LINES :, :, [0, 1, 3, 4, 6, 9, 2, 5, 7, 8]] = curves.reshape(*rows.shape[:-1], bank.CURVES, C, 10)
    parts = rows[..., : at.linear], former.reshape(*rows.shape[:-1], -1), rows[..., at.circle : at.courses]
    return np.concatenate(parts, axis=-1)
