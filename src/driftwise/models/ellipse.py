"""Ellipses of equal probability, for drawing."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..engine.errors import InputError


class Ellipse(NamedTuple):
    """Centre, semi-axes (large, small) and angle of the large one (radians, anticlockwise from the first axis)."""

    centre: tuple[float, float]
    semi_axes: tuple[float, float]
    angle: float

    def points(self, count: int = 121) -> np.ndarray:
        """Return a closed polyline (count, 2) along the ellipse; raise InputError where it is infinite."""
        if not np.isfinite(self.semi_axes).all():
            raise InputError("the ellipse is infinite (nothing is known of its point): there is no line to draw")
        t = np.linspace(0, 2 * np.pi, count)
        along, across = self.semi_axes[0] * np.cos(t), self.semi_axes[1] * np.sin(t)
        c, s = np.cos(self.angle), np.sin(self.angle)
        return np.array(self.centre) + np.stack([c * along - s * across, s * along + c * across], axis=1)


def confidence_ellipse(covariance, level: float = 0.95, centre=0.0) -> Ellipse:
    """Return the ellipse that holds a Gaussian point of the plane with probability ``level``.

    Parameters
    ----------
    covariance : (2, 2)
        Of (real, imaginary) part, say one of `Model.poles_covariance`. Where it has one direction only (a real
        pole) the ellipse is the two-sided interval at ``level``.
    level : float
        Probability inside, between 0 and 1.
    centre : complex, or (2,)

    Raises
    ------
    InputError
        Where the matrix is no covariance or the level no probability.

    Notes
    -----
    Squared radii are eigenvalues times the chi-square quantile, -2 ln(1 - level) with two degrees of freedom. Bad at:
    what is not Gaussian, as the poles that `Model.notes` calls sampled. Infinite variances give infinite semi-axes.

    Examples
    --------
    >>> e = confidence_ellipse([[4.0, 0.0], [0.0, 1.0]], level=0.95, centre=1 + 2j)
    >>> e.centre, [round(float(r), 3) for r in e.semi_axes], e.angle
    ((1.0, 2.0), [4.895, 2.448], 0.0)
    """
    from scipy.special import ndtri

    C = np.asarray(covariance, float)
    if C.shape != (2, 2) or np.isnan(C).any():
        raise InputError(f"covariance must be (2, 2) without NaN, got {covariance!r}")
    if not 0 < level < 1:
        raise InputError(f"level is a probability between 0 and 1, got {level!r}; was it meant in percent?")
    point = np.asarray(centre)
    middle = (float(point.real), float(point.imag)) if point.ndim == 0 else (float(point[0]), float(point[1]))
    if np.isinf(C).any():
        return Ellipse(middle, (np.inf, np.inf), 0.0)
    sizes, axes = np.linalg.eigh((C + C.T) / 2)
    if sizes[0] < -1e-9 * abs(sizes[1]):
        raise InputError(f"covariance has a negative eigenvalue, {sizes[0]:.3g}: it is none. Was a factor given?")
    is_flat = sizes[0] <= 1e-12 * sizes[1]
    radius = ndtri(0.5 + level / 2) if is_flat else np.sqrt(-2 * np.log1p(-level))
    small, large = radius * np.sqrt(sizes.clip(0))
    angle = float(np.arctan2(axes[1, 1], axes[0, 1]))
    angle = angle - np.pi if angle > np.pi / 2 else angle + np.pi if angle <= -np.pi / 2 else angle
    return Ellipse(middle, (float(large), 0.0 if is_flat else float(small)), angle)
