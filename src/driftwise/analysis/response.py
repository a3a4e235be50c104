"""What inputs do to an output, in hindsight: one response beside coloured noise, of all that was measured.

y = sum B_i/A (factor_i(t) w_i) + level(t) + e/F, with w_i = u_i + bends. Gaps need no care: a response is driven by
inputs, and only samples that were measured are compared with it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .delays import cost
from .response_noise import Whitened
from .response_record import COLOUR, FAR, HUBER, autoregression, local_size
from .scattered_noise import scattered

STEPS, SHRINK = 8, (1.0, 0.4, 0.1)  # of Gauss and Newton, and how much of one is tried
TIMES = 4  # that outliers in a row are looked for
ONSET = 5  # samples about the date of a change that may have been called outliers for it


@dataclass(frozen=True, kw_only=True)
class Response(Whitened):
    """A fitted response: a mean, the noise beside it, and how they are fitted to each other."""

    # --- fitting ------------------------------------------------------------------------------------------------

    def refined(self, steps: int = STEPS) -> Response:
        """Return the parameters that fit best nearby (Gauss and Newton), under the same noise."""
        now, loss = self, self.loss()
        for _ in range(steps):
            way = now.way()
            for part in SHRINK:
                tried = now.at(now.theta + part * way)
                if tried.is_stable and (new := tried.loss()) < loss:
                    break
            else:
                return now
            now, gained, loss = tried, loss - new, new
            if gained < 1e-3 * loss + 1e-9:
                break
        return now

    def coloured(self) -> Response:
        """Return the same with the noise that is left: outliers aside, its colour, its deviation."""
        T, measured = len(self.record.y), np.isfinite(self.record.y)
        left = np.where(self.used, np.where(measured, self.record.y, 0.0) - self.mean, np.nan)
        f = self.colour(left)
        now = replace(self, f=f, sigma=np.ones(T), cache=self.of_mean())
        shape = self.sigma / math.exp(float(np.mean(np.log(self.sigma))))
        s = now.left / shape[now.rows]
        sigma = max(1.4826 * float(np.median(abs(s))), 1e-300)
        size = abs(s)
        square, far = size * size, HUBER * size
        for _ in range(5):  # the deviation that makes Huber's loss least: the criterion does not feel its error
            sigma = max(math.sqrt(np.add.reduce(np.minimum(square, sigma * far)) / max(len(s), 1)), 1e-300)
        return replace(now, sigma=np.maximum(sigma * shape, self.record.floor), cache=self.of_mean())

    def colour(self, left) -> np.ndarray:
        """Return f of the noise that is left, (T,), NaN where not known."""
        if not self.record.is_scattered:
            return autoregression(left, COLOUR)
        found = scattered((left / self.sigma)[self.rows], self.rows)
        return np.array([-found[0], *found[1:]]) if found else np.zeros(0)

    def without_outliers(self) -> Response:
        """Return the same without samples that stand far out of their surroundings.

        Of several in a row the first: the others may but follow from it, and are looked at again without it.
        """
        now, behind = self, np.ones(len(self.used), bool)
        for _ in range(TIMES):
            far = np.zeros(len(now.used), bool)
            far[now.rows] = abs(now.left) > FAR * local_size(now.left, now.record.floor / now.deviations)
            far &= behind
            first = far & ~np.append(False, far[:-1])
            if not first.any():
                break
            now, behind = replace(now, used=now.used & ~first, cache=self.of_mean()), far & ~first
        return now

    def with_all_near(self, at: int, to: int = 0) -> Response:
        """Return the same with all samples about a change, or from one to another, that were measured."""
        used, near = self.used.copy(), slice(max(at - ONSET, 0), max(at, to) + ONSET)
        used[near] |= np.isfinite(self.record.y[near])
        return replace(self, used=used, cache=self.of_mean())

    def settled(self, times: int = 3) -> Response:
        """Return parameters, noise and outliers that fit each other."""
        now = self
        for _ in range(times):
            now = now.refined().coloured()
        return now.refined()

    # --- more or fewer parameters --------------------------------------------------------------------------------

    def widened(self, part: str, value, **parts) -> Response:
        """Return the same with more numbers, ``value`` (m,), at the end of a part of ``more``."""
        at = self.placed()[part].stop
        return replace(self, more=np.insert(self.more, at, value), cache=self.of_noise(), **parts)

    def with_level(self, since: int, size: float = 0.0) -> Response:
        """Return the same with a step of the level, not fitted yet."""
        return self.widened("levels", size, levels=(*self.levels, since))

    def with_gain(self, i: int, since: int, size: float = 0.0) -> Response:
        """Return the same with a step of a gain."""
        at = self.placed()
        more = np.insert(self.more, [at["gains"].stop, at["shifts"].stop], [size, 0.0])
        return replace(self, more=more, gains=(*self.gains, (i, since)), cache=self.of_noise())

    def with_ramp(self, i: int) -> Response:
        """Return the same with a gain that moves along a straight line."""
        return self.widened("ramps", 0.0, ramps=(*self.ramps, i))

    def with_speed(self, since: int, size: float = 0.0, is_alone: bool = False) -> Response:
        """Return the same of a plant that becomes faster or slower at a sample, or the slowest mode of which does."""
        return self.widened("speeds", size, speeds=(*self.speeds, since), is_alone=is_alone)

    def with_bend(self, i: int) -> Response:
        """Return the same with an input that bends."""
        return self.widened("bends", np.zeros(len(self.record.shapes[i])), bent=(*self.bent, i))

    def with_columns(self, columns) -> Response:
        """Return the same with other signals beside."""
        return self.widened("columns", np.zeros(len(columns)), columns=np.vstack([self.columns, columns]))

    def without(self, part: str, j: int) -> Response:
        """Return the same without a step of the level or of a gain, the j-th."""
        left: dict[str, Any] = {part: tuple(one for k, one in enumerate(getattr(self, part)) if k != j)}
        at = self.placed()
        gone = [at[part].start + j, *([at["shifts"].start + j] if part == "gains" else [])]
        return replace(self, more=np.delete(self.more, gone), cache=self.of_noise(), **left)

    def of_noise(self) -> dict:
        """Return what is kept of the same noise and samples beside another mean."""
        return {"gaps": self.gaps}

    # --- what is known -------------------------------------------------------------------------------------------

    @property
    def measured(self) -> int:
        """How many outputs there are, the outliers among them."""
        return int(np.isfinite(self.record.y).sum())

    @property
    def criterion(self) -> float:
        """Schwarz's: less is better, of responses of one record; an outlier counts as a sample at that distance.

        Delays cost what whole numbers do; what waits for inputs before the record is no nearer to the mean than it is.
        """
        s, measured = self.spread, self.measured
        misfit = 2 * float(np.mean(np.log(s))) + 2 * self.loss() / max(len(self.rows), 1)
        misfit += (measured - int(self.used.sum())) / measured * (2 * HUBER * FAR - HUBER**2)
        numbers = (len(self.theta) + len(self.f)) * math.log(measured)
        before, size = self.loudness_before
        return measured * misfit + before * math.log(size) + numbers + 2 * float(cost(self.nk).sum())

    @property
    def dated_criterion(self) -> float:
        """The criterion with the dates of changes, which cost twice a number each (Zhang and Siegmund, 2007)."""
        dates = len(self.levels) + len(self.gains) + len(self.speeds)
        return self.criterion + 2 * dates * math.log(self.measured)
