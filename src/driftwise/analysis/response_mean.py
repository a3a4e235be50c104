"""What inputs do to an output beside what moves by itself: the mean of a response, and its slopes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from itertools import accumulate, pairwise, starmap
from typing import Self

import numpy as np

from ..models.filtering import linear_filter
from .copies import Copies, copies
from .response_record import Record, delayed
from .speeds import MOST, STEP, Piece, moved_by, passed, pieces, slowed

# of the numbers beside A and B, in order
PARTS = "bends", "gains", "shifts", "ramps", "speeds", "start", "columns", "levels"
KEPT = "placed", "beside", "seen", "rows", "bridge", "gaps", "mixing", "deviations", "aside"  # .. of parts and noise
OF_MEAN = "placed", "drives", "before", "inner", "beside", "mean"  # of what is known, by others of the same mean
EDGE = 0.9998  # of a pole, at most
RINGS = 8.0  # time constants of a pair that a record must hold


def dies_out(a: list[float], edge: float) -> bool:
    """Say whether no pole of 1, a1, .. reaches ``edge`` (reflections, by Schur's recursion)."""
    a = [1.0, *(value / edge**j for j, value in enumerate(a, 1))]
    while len(a) > 1:
        if not abs(a[-1]) < abs(a[0]):
            return False
        a = [a[0] * ahead - a[-1] * back for ahead, back in zip(a[:-1], a[:0:-1])]
    return True


@dataclass(frozen=True, kw_only=True)
class Mean:
    """What y is without noise: sum B_i/A (factor_i(t) w_i) + level(t), with w_i = u_i + bends.

    Attributes
    ----------
    a, b : (n,), (k, m) coefficients of A and B, the latter from lag ``nk`` on
    bent : inputs whose bends are estimated
    gains : (input, first sample) of each gain that changed
    ramps : inputs whose gain moves along a straight line
    levels : the first sample of each step of the level
    speeds : the first sample of each stretch in which the plant is faster or slower than before
    is_alone : whether its slowest mode alone is, then
    columns : (m, T) what else moves the level: a constant, a trend, a season
    more : numbers of bends, gains, shifts (what the level moved with a gain, which turns about
        an unknown point), ramps, speeds (logarithms of what the time constants were before, of what they are
        then), start (the plant at the first sample that was measured), columns, levels
    """

    record: Record
    a: np.ndarray
    b: np.ndarray
    nk: tuple[int, ...]
    columns: np.ndarray
    more: np.ndarray
    bent: tuple[int, ...] = ()
    gains: tuple[tuple[int, int], ...] = ()
    levels: tuple[int, ...] = ()
    ramps: tuple[int, ...] = ()
    speeds: tuple[int, ...] = ()
    is_alone: bool = False
    cache: dict = field(default_factory=dict, compare=False, repr=False)

    @property
    def theta(self) -> np.ndarray:
        """All parameters of the mean, in one row."""
        return np.concatenate([self.a, self.b.ravel(), self.more])

    def at(self, theta) -> Self:
        """Return the same with other parameters."""
        n, m = len(self.a), self.b.size
        kept = {name: self.cache[name] for name in self.kept if name in self.cache}
        return replace(self, a=theta[:n], b=theta[n : n + m].reshape(self.b.shape), more=theta[n + m :], cache=kept)

    @property
    def kept(self) -> tuple[str, ...]:
        """What is known of others of its parts and noise, too."""
        return KEPT if self.bent or self.moving else (*KEPT, "before", "through")

    @property
    def dates(self) -> np.ndarray:
        """The first samples of all changes."""
        return np.array([*self.levels, *(since for _, since in self.gains), *self.speeds])

    def of_mean(self) -> dict:
        """Return what is kept of the same mean beside another noise."""
        return {name: self.cache[name] for name in OF_MEAN if name in self.cache}

    @property
    def is_stable(self) -> bool:
        """Whether what the inputs did dies out: no pole reaches EDGE.

        A pair has to do so within the record: one that swings all along is a disturbance, to be told as one.
        """
        if not dies_out(self.a.tolist(), EDGE) or not self.is_slow_enough:
            return False
        most = 1 - RINGS / len(self.record.y)
        if len(self.a) < 2 or dies_out(self.a.tolist(), most):  # no pole is out there, so no pair is
            return True
        if len(self.a) == 2:
            return not (self.a[0] ** 2 < 4 * self.a[1] and self.a[1] > most**2)
        poles = np.roots(self.denominator)
        return not np.any(abs(poles[abs(poles.imag) > 1e-9]) > most)

    @property
    def is_slow_enough(self) -> bool:
        """Whether no factor of its time constants is beyond all measure, and what inputs did dies out before, too."""
        if not self.speeds:
            return True
        if np.any(abs(self.more[self.placed()["speeds"]]) > MOST):
            return False
        return all(dies_out(piece.a[1:].tolist(), EDGE) for piece in self.stretches)

    @property
    def parts(self) -> tuple:
        """What changes, bends or swings in it."""
        return self.bent, self.gains, self.levels, self.ramps, self.speeds, self.is_alone, len(self.columns)

    def placed(self) -> dict[str, slice]:
        """Return where the parts of ``more`` are."""
        if "placed" not in self.cache:
            bends = sum(len(self.record.shapes[i]) for i in self.bent)
            many = [bends, len(self.gains), len(self.gains), len(self.ramps), len(self.speeds), len(self.a)]
            ends = list(accumulate([0, *many, len(self.columns), len(self.levels)]))
            self.cache["placed"] = dict(zip(PARTS, starmap(slice, pairwise(ends))))
        return self.cache["placed"]

    def factor(self, i: int) -> np.ndarray:
        """Return what the gain of an input is multiplied by, (T,)."""
        T, at = len(self.record.y), self.placed()
        found, t = np.ones(T), np.arange(T)
        for (which, since), value in zip(self.gains, self.more[at["gains"]]):
            if which == i:
                found += value * (t >= since)
        for which, value in zip(self.ramps, self.more[at["ramps"]]):
            if which == i:
                found += value * (t / T - 1)  # one at the end
        return found

    def bend(self, i: int) -> np.ndarray:
        """Return the coefficients of the shapes of an input."""
        values, first = self.more[self.placed()["bends"]], 0
        for j in self.bent:
            size = len(self.record.shapes[j])
            if j == i:
                return values[first : first + size]
            first += size
        return np.zeros(0)

    # --- the mean and its slopes -------------------------------------------------------------------------------

    @property
    def moving(self) -> set[int]:
        """The inputs whose gain changes."""
        return {*(i for i, _ in self.gains), *self.ramps}

    @property
    def denominator(self) -> np.ndarray:
        """1, a1, .."""
        return np.append(1.0, self.a)

    def moved(self, i: int) -> np.ndarray:
        """Return an input with its bends."""
        u = self.record.u[:, i]
        return u + self.bend(i) @ self.record.shapes[i] if i in self.bent else u

    def driven(self, i: int, x) -> np.ndarray:
        """Return B_i of a signal, its delay included, before A."""
        found, d = np.zeros(len(x)), min(self.nk[i], len(x))
        found[d:] = np.convolve(self.b[i], x[: len(x) - d])[: len(x) - d]
        return found

    @property
    def drives(self) -> list[np.ndarray]:
        """What B makes of each input with its bends."""
        if "drives" not in self.cache:
            self.cache["drives"] = [self.driven(i, self.moved(i)) for i in range(len(self.b))]
        return self.cache["drives"]

    @property
    def before(self) -> Copies:
        """What passes through 1/A for each number of B and of ``more`` up to the start, (T,) each."""
        if "before" not in self.cache:
            self.cache["before"] = copies(list(self._before()))
        return self.cache["before"]

    @property
    def stretches(self) -> list[Piece]:
        """The denominators, one after the other."""
        if "stretches" not in self.cache:
            self.cache["stretches"] = self.stretched(self.denominator, self.more[self.placed()["speeds"]])
        return self.cache["stretches"]

    def stretched(self, a, values) -> list[Piece]:
        """Return the denominators of a plant that is ``a`` at its end, ``values`` slower before each of its speeds."""
        return pieces(a, self.speeds, values, self.is_alone)

    def answered(self, x) -> np.ndarray:
        """Return what comes of signals (k, T), or (T,), through 1/A, as it was at each sample."""
        return passed(self.stretches, x)

    @property
    def drive(self) -> np.ndarray:
        """What inputs, and what moves with their gains, put into 1/A, (T,)."""
        if "drive" not in self.cache:
            x, at = np.zeros(len(self.record.y)), self.placed()
            for i, driven in enumerate(self.drives):
                x += self.factor(i) * driven if i in self.moving else driven
            for (_, since), shift in zip(self.gains, self.more[at["shifts"]]):
                x[since:] += shift
            self.cache["drive"] = x
        return self.cache["drive"]

    def faster(self, is_alone: bool) -> np.ndarray:
        """Return what enters 1/A at each sample, (T,), where the plant is slower there, per unit of the logarithm.

        ``is_alone`` : where its slowest mode alone is
        """
        others = [piece._replace(a=slowed(piece.a, STEP, is_alone)) for piece in self.stretches]
        others = [piece._replace(hold=piece.a.sum() / self.denominator.sum()) for piece in others]
        return moved_by(self.stretches, others, STEP, self.drive, self.inner)

    def slopes(self) -> np.ndarray:
        """Return the slopes of all parameters but those of `beside`, (P, T), where the plant becomes faster or slower.

        Those of A and of the speeds are of numbers that move the denominators of all stretches before.
        """
        at, T, n = self.placed(), len(self.record.y), len(self.a)
        values, found = self.more[at["speeds"]], []
        for j in range(n):
            a = self.denominator
            a[j + 1] += STEP
            found.append(moved_by(self.stretches, self.stretched(a, values), STEP, self.drive, self.inner))
        by_speed = []
        for j in range(len(values)):
            others = self.stretched(self.denominator, values + STEP * np.eye(1, len(values), j)[0])
            by_speed.append(moved_by(self.stretches, others, STEP, self.drive, self.inner))
        before = np.array([delayed(self.before.signals[k], late) for k, late in self.before.places[: -n or None]])
        starts = passed(self.stretches, np.eye(n, T, self.record.first), is_held=False)
        inside = passed(self.stretches, np.array([*found, *by_speed]), is_held=False)
        return np.concatenate([inside[:n], self.answered(before), inside[n:], starts])

    def _before(self) -> Iterator[tuple[np.ndarray, Iterable[int]]]:
        T, moving = len(self.record.y), self.moving
        t = np.arange(T)
        for i, d in enumerate(self.nk):
            w, lags = self.moved(i), range(d, d + self.b.shape[1])
            if i in moving:
                factor = self.factor(i)
                yield from ((factor * delayed(w, lag), (0,)) for lag in lags)
            else:
                yield w, lags
        for i in self.bent:
            factor = self.factor(i)
            yield from ((factor * self.driven(i, shape), (0,)) for shape in self.record.shapes[i])
        yield from ((self.drives[i] * (t >= since), (0,)) for i, since in self.gains)
        yield from (((t >= since).astype(float), (0,)) for _, since in self.gains)
        yield from ((self.drives[i] * (t / T - 1), (0,)) for i in self.ramps)
        yield np.eye(1, T, self.record.first)[0], range(len(self.a))

    @property
    def inner(self) -> np.ndarray:
        """What comes out of 1/A, (T,)."""
        if "inner" not in self.cache:
            start = np.zeros(len(self.record.y))
            start[self.record.first :][: len(self.a)] += self.more[self.placed()["start"]]
            if self.speeds:
                self.cache["inner"] = self.answered(self.drive) + passed(self.stretches, start, is_held=False)
            else:
                self.cache["inner"] = linear_filter([1.0], self.denominator, self.drive + start)
        return self.cache["inner"]

    @property
    def beside(self) -> np.ndarray:
        """What moves the level by itself, (m, T): columns and steps."""
        if "beside" not in self.cache:
            t = np.arange(len(self.record.y))
            self.cache["beside"] = np.vstack([self.columns, *((t >= since).astype(float) for since in self.levels)])
        return self.cache["beside"]

    @property
    def mean(self) -> np.ndarray:
        """What y is without noise, (T,)."""
        if "mean" not in self.cache:
            self.cache["mean"] = self.inner + self.more[self.placed()["columns"].start :] @ self.beside
        return self.cache["mean"]

    @property
    def slope_places(self) -> tuple[tuple[int, int], ...]:
        """Where the slopes by parameters but those of `beside` are: of ``-inner`` and `before`, all through 1/A."""
        return (*((0, j) for j in range(1, len(self.a) + 1)), *((1 + k, late) for k, late in self.before.places))
