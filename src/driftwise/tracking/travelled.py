"""How far a track went, and how far up: lengths of the smoothed path, corrected for what noise does to them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..engine.status import Status
from .tracks import Track

PLOTS = 1000  # that are drawn anew in all, at least
DRAWS = 3, 20  # least and most
STILL = 2.0  # deviations of a velocity below which it may be none
PIECE = 50  # plots: errors of pieces of this length hardly depend on each other


class Travelled(NamedTuple):
    """Distance and climb of a track, m, each with its standard deviation; NaN where there is no altitude."""

    distance: float
    distance_sd: float
    ascent: float
    ascent_sd: float
    descent: float
    descent_sd: float


def travelled(track: Track, seed: int = 0) -> Travelled:
    """Return how far a track went along its path over ground, up and down.

    Noise makes a path of plots longer, and smoothing makes it shorter: corners are cut. How much, a trial says: noise
    as large as that of the plots is added to the smoothed path, and the result is smoothed again. What that changes of
    the length is taken off; that, what it scatters, and the lengths of steps that may be rests, make the error bar (a
    parametric bootstrap: Efron 1982).

    Parameters
    ----------
    track : Track
        Plots that were set aside do not count.
    seed : int
        Of the noise.

    Notes
    -----
    Bad at: errors that stay for minutes, such as those of a phone between houses: they move the whole path, and bars
    that know nothing of it are too short; turns within a few plots.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> from driftwise.tracking.plots import plots
    >>> from driftwise.tracking.travelled import travelled
    >>> time = np.arange(300.0)
    >>> walk = np.stack([1.2 * time, 10 * np.sin(time / 40)], axis=1)  # 363 m
    >>> noisy = walk + 1.5 * np.random.default_rng(1).standard_normal(walk.shape)
    >>> print(round(float(np.hypot(*np.diff(noisy, axis=0).T).sum())), "m from plot to plot")
    842 m from plot to plot
    >>> found = travelled(dw.track(plots(time, noisy), 2.0, single=True)[0])
    >>> print(f"{found.distance:.0f} +- {found.distance_sd:.0f} m")
    361 +- 2 m
    """
    smooth = track.smoothed()
    draws = int(np.clip(PLOTS // max(len(track), 1), *DRAWS))
    rng = np.random.default_rng(seed)
    distance = _corrected(track.estimator, smooth.trace, lambda x: (np.hypot(*np.diff(x, axis=0).T),), draws, rng)
    climb = [(np.nan, np.nan)] * 2
    if smooth.vertical is not None and len(smooth.vertical) > 1:
        climb = _corrected(smooth.vertical.estimator, smooth.vertical, _up_and_down, draws, rng)
    return Travelled(*distance[0], *climb[0], *climb[1])


def _up_and_down(x) -> tuple[np.ndarray, np.ndarray]:
    step = np.diff(x[:, 0])
    return np.maximum(step, 0.0), np.maximum(-step, 0.0)


def _corrected(estimator, trace, lengths, draws: int, rng) -> list[tuple[float, float]]:
    """Return (value, standard deviation) of each sum of lengths of a path, by drawing its plots anew."""
    known = np.isfinite(trace.y).all(axis=1) & ((trace.status & int(Status.OUTLIER)) == 0)
    path, e = trace.position, (trace.y - trace.position)[known]
    # a plot less its smoothed place has the variance of the plot less that of the place
    r = np.mean(e**2, axis=0) + np.mean(trace.position_sd[known] ** 2, axis=0)
    own, again = lengths(path), []
    for _ in range(draws):
        noise = np.sqrt(r) * rng.standard_normal(path.shape)
        drawn = np.where(known[:, None], path + noise, np.nan)
        again.append(lengths(estimator.smooth(trace.time, drawn).position))
    rests = _may_rest(trace)
    found = []
    for k, one in enumerate(own):
        pieces = np.arange(0, len(one), PIECE)
        table = np.stack([np.add.reduceat(drawn[k], pieces) for drawn in again])
        longer = float((table.mean(axis=0) - np.add.reduceat(one, pieces)).sum())
        doubt = float(one[rests].sum())  # whether it was gone at all: anything between 0 and that
        variance = np.sum(table.var(axis=0, ddof=1)) * (1 + 1 / draws) + longer**2 + doubt**2 / 12
        found.append((max(float(one.sum()) - longer - doubt / 2, 0.0), float(np.sqrt(variance))))
    return found


def _may_rest(trace) -> np.ndarray:
    """Return the steps at both ends of which the velocity is not told from none."""
    velocity, sd = trace.velocity, trace.velocity_sd
    still = np.sqrt(np.sum(velocity**2, axis=1)) < STILL * np.sqrt(np.sum(sd**2, axis=1))
    return still[1:] & still[:-1]
