"""A difference equation beside a season: what y was at this time of the last one, or of those before on average.

    profile      p_i <- p_i + g (y - p_i),  i = t mod s,  g = max(1/n_i, gain)       n_i outputs were measured there
    model        A(q) y(t) = B(q) u(t) + C(q) p(t) + offset + e(t)

p(t) is known before y(t) is: it is an input that is the output's own past. With gain 1 it is y(t - s), and
(1 - a B)(1 - c B^s), multiplied out, is one of these models. With less it is a mean of several seasons, which has less
noise and lags behind a season that changes.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...engine import validation
from ...engine.errors import InputError
from ...memory.constant import Constant
from ...models.seasonal_equation import SeasonalEquation
from ..arx.estimator import ARX
from ..arx.forecast import Past, run
from ..arx.row import HUGE
from ..common.settings import arguments

LONGEST = 100_000  # samples of a season, at most: a state keeps two numbers of each


class SeasonalARX(ARX):
    """Parameters of A(q) y = B(q) u + C(q) p + e by recursive least squares; p is a season, learnt on the way.

    Parameters
    ----------
    na, nb, nk
        As for `ARX`; ``nb=()`` for no input.
    season : int, or several
        Samples of each season: 12; (24, 168) of hours that have a day and a week.
    gain : float
        Of the profile: 1 keeps the last season, 0.1 the mean of about ten.
    lags : int
        Coefficients of each profile, from that of the present sample back.
    memory, offset, y_scale, u_scale, dt
        As for `ARX`.

    Notes
    -----
    A time of the season that was not seen yet has profile zero; where y is missing, the profile stays. Samples are
    counted: a gap that is not filled with NaN shifts the season. ``model_of`` a state is the model of what is left when
    the season is known; its gain is not that after many seasons.

    Bad at: seasons that are no whole number of samples, and bands of forecasts further ahead than the shortest season,
    which take its profile for known.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> rng, t = np.random.default_rng(0), np.arange(240)
    >>> y = np.cos(2 * np.pi * t / 12) ** 3 + 0.1 * rng.standard_normal(240)
    >>> trace = dw.estimators.SeasonalARX(1, season=12, gain=0.1, offset=True).scan(y)
    >>> bool(trace.innovation[60:].std() < 0.13), trace.names
    (True, ['a1', 's12.0', 's12.1', 'offset'])
    """

    is_arx = False  # not all of its regressors are handed over
    fits_fleet = False

    def __init__(
        self,
        na: int = 1,
        nb=(),
        nk=(),
        *,
        season: Any = 12,
        gain: float = 1.0,
        lags: int = 2,
        memory: Any = Constant(),
        offset: bool = False,
        y_scale: float = 1.0,
        u_scale=1.0,
        dt: float = 1.0,
    ):
        own = arguments(locals())
        self.seasons, self.gain = season_lengths(season), validation.share("gain", gain)
        nb, nk = validation.counts("nb", nb), validation.counts("nk", nk)
        nk = nk * len(nb) if len(nk) == 1 else nk
        k, m, deep = len(nb), len(self.seasons), validation.count("lags", lags, 1)
        scales = [*validation.sizes("u_scale", u_scale, k), *[y_scale] * m]
        self.inner = ARX(
            na, nb + (deep,) * m, nk + (0,) * m, memory=memory, offset=offset, y_scale=y_scale, u_scale=scales, dt=dt
        )
        self.__dict__.update({name: value for name, value in vars(self.inner).items() if name != "inner"})
        self.options, wide = own, self.inner.model
        self.model = SeasonalEquation(wide.na, wide.nb, wide.nk, wide.has_offset, seasons=self.seasons)
        self.u_scale = self.inner.u_scale[:k]
        kept = ("counted", float), ("profile", float, (sum(self.seasons),)), ("seen", float, (sum(self.seasons),))
        self.dtype = np.dtype([*((name, field[0]) for name, field in _fields(self.inner.dtype)), *kept])

    @property
    def is_equation(self) -> bool:
        """Whether its forecasts follow from the equation as it is: not those of a season, which is learnt."""
        return False

    def start(self, series: int | None = None) -> np.ndarray:
        """Return a fresh state, or ``series`` of them."""
        begun = self.inner.start(series)
        state = np.zeros(begun.shape, self.dtype)
        for name, _ in _fields(begun.dtype):
            state[name] = begun[name]
        return state

    def as_regression(self) -> Any:
        """Return None: of a season its past is a regressor that is not handed over."""
        return None

    def smooth(self, *args, **options):
        """Refuse (InputError): hindsight would know the season's profile, which is learnt here as it comes."""
        raise InputError("SeasonalARX has no smoother: ARX, AR and Regression have, with inputs of your own")

    def tune(self, *args, **options):
        """Refuse (InputError), as `smooth` does."""
        raise InputError("SeasonalARX has no tune: ARX, AR and Regression have, with inputs of your own")

    def _theta_units(self) -> np.ndarray:
        return self.inner._theta_units()

    def drive(self, rows, ys, us, outs, spec, scratch):
        """Advance states of S series by T samples in place."""
        width, k = self.inner.width, self.model.inputs
        wide = np.empty((*ys.shape[:2], k + len(self.seasons)))
        wide[..., :k] = us[..., :k]
        for s in range(len(rows)):
            self._follow(rows[s, width:], ys[s, :, 0], wide[s, :, k:])
        own = rows[:, :width].copy()
        self.inner.drive(own, ys, wide, outs, self.inner.spec, scratch)
        rows[:, :width] = own

    def predict(self, state, u=None, horizon: int | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Return mean (h,) and standard deviation (h,) of the next h outputs, as `ARX.predict`.

        Beyond the shortest season the profile follows what was forecast.
        """
        u = validation.inputs_to_come(u, horizon, self.model.inputs)
        h, width, k = len(u), self.inner.width, self.model.inputs
        row, short = self._rows(state)[0], min(self.seasons)
        now, kept = row[:width].copy().view(self.inner.dtype).reshape(()), row[width:]
        wide = np.concatenate([u, np.empty((h, len(self.seasons)))], axis=1)
        z = Past(self.inner, row[:width]).z if h > short else None
        for first in range(0, h, short):
            part = slice(first, first + short)
            self._show(kept, wide[part, k:])
            if h > part.stop and z is not None:  # what is forecast is learnt as if it were measured
                form, theta = self.inner.policies[0], now["theta"].reshape(1, -1).copy()
                mean = run(form, theta, z.reshape(1, -1).copy(), wide[: part.stop], np.ones(1))[0]
                self._follow(kept, mean[part], wide[part, k:])
        return self.inner.predict(now, wide)

    def _show(self, kept, shown):
        """Fill what profiles say of the samples to come, (h, m), no more than the shortest season."""
        to_come, at = int(kept[0]) + np.arange(len(shown)), 1
        for l, s in enumerate(self.seasons):
            shown[:, l] = kept[at : at + s][to_come % s]
            at += s

    def _follow(self, kept, y, shown):
        """Fill what profiles say of each sample, (T, m), and let them follow y (T,); ``kept`` is behind a state."""
        if not np.isfinite(kept).all():
            kept[:] = 0.0
        n, T, at = sum(self.seasons), len(y), 1
        counted, is_known = int(kept[0]), np.abs(y) < HUGE
        value, known = np.where(is_known, y, 0.0), is_known.astype(float)
        for l, s in enumerate(self.seasons):
            profile, seen = kept[at : at + s], kept[n + at : n + at + s]
            at, t = at + s, 0
            while t < T:  # to the end of the season: what is shown of a sample was learnt in those before
                i = (counted + t) % s
                part, there = slice(t, t + min(s - i, T - t)), slice(i, i + min(s - i, T - t))
                shown[part, l] = profile[there]
                seen[there] += known[part]
                gain = known[part] * np.maximum(1.0 / np.maximum(seen[there], 1.0), self.gain)
                profile[there] += gain * (value[part] - profile[there])
                t = part.stop
        kept[0] = counted + T


def season_lengths(season) -> tuple[int, ...]:
    """Return the lengths of one season or several, in samples, checked."""
    found = validation.counts("season", season)
    if not found or not all(2 <= s <= LONGEST for s in found) or len(set(found)) < len(found):
        raise InputError(
            f"season must be samples of a season, 2 to {LONGEST}, or those of several different ones, got {season!r}"
        )
    return found


def _fields(dtype):
    return [(name, dtype.fields[name]) for name in dtype.names]
