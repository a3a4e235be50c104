"""What inputs do to an output, in hindsight: one response beside coloured noise, of all that was measured.

y = sum B_i/A (factor_i(t) w_i) + level(t) + e/F, with w_i = u_i + bends. Gaps need no care: a response is driven by
inputs, and only samples that were measured are compared with it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from itertools import accumulate, pairwise, starmap
from typing import Any

import numpy as np

from ..models.filtering import linear_filter
from ..results.stable import is_endless
from .copies import Copies, copies
from .interrupted_noise import Gaps, gaps
from .response_record import COLOUR, FAR, HUBER, SHARE, Record, autoregression, delayed, least_squares, local_size
from .scattered_noise import Bridge, bridge, scattered

STEPS, SHRINK = 8, (1.0, 0.4, 0.1)  # of Gauss and Newton, and how much of one is tried
PARTS = "bends", "gains", "shifts", "ramps", "start", "columns", "levels"  # of the numbers beside A and B, in order
KEPT = "placed", "rows", "bridge", "gaps", "mixing", "deviations"  # of what is known, by others of its parts and noise
INNER = "shifts", "start"  # parts of the mean that pass through 1/A without an input
EDGE = 0.9998  # of a pole, at most
RINGS = 8.0  # time constants of a pair that a record must hold
MATTERS = 0.05  # of the gain, which a mode must make up to have a say in it
TIMES = 4  # that outliers in a row are looked for
ONSET = 5  # samples about the date of a change that may have been called outliers for it


def dies_out(a: list[float], edge: float) -> bool:
    """Say whether no pole of 1, a1, .. reaches ``edge`` (reflections, by Schur's recursion)."""
    a = [1.0, *(value / edge**j for j, value in enumerate(a, 1))]
    while len(a) > 1:
        if not abs(a[-1]) < abs(a[0]):
            return False
        a = [a[0] * ahead - a[-1] * back for ahead, back in zip(a[:-1], a[:0:-1])]
    return True


def huber(r) -> float:
    """Return Huber's loss of what is left."""
    r = np.minimum(abs(r), 1e6)
    near = np.minimum(r, HUBER)
    return float(np.sum(near * (r - 0.5 * near)))


@dataclass(frozen=True)
class Response:
    """A fitted response: what it is made of, and its numbers.

    Attributes
    ----------
    a, b : (n,), (k, m) coefficients of A and B, the latter from lag ``nk`` on
    bent : inputs whose bends are estimated
    gains : (input, first sample) of each gain that changed
    ramps : inputs whose gain moves along a straight line
    levels : the first sample of each step of the level
    columns : (m, T) what else moves the level: a constant, a trend, a season
    more : numbers of bends, gains, shifts (what the level moved with a gain, which turns about
        an unknown point), ramps, start (the plant at the first sample), columns, levels
    f : (p,) of the noise; sigma : (T,) its deviation
    used : (T,) samples that are measured and no outliers
    """

    record: Record
    a: np.ndarray
    b: np.ndarray
    nk: tuple[int, ...]
    columns: np.ndarray
    more: np.ndarray
    f: np.ndarray
    sigma: np.ndarray
    used: np.ndarray
    bent: tuple[int, ...] = ()
    gains: tuple[tuple[int, int], ...] = ()
    levels: tuple[int, ...] = ()
    ramps: tuple[int, ...] = ()
    cache: dict = field(default_factory=dict, compare=False, repr=False)

    # --- numbers -----------------------------------------------------------------------------------------------

    @property
    def theta(self) -> np.ndarray:
        """All parameters of the mean, in one row."""
        return np.concatenate([self.a, self.b.ravel(), self.more])

    def at(self, theta) -> Response:
        """Return the same with other parameters."""
        n, m = len(self.a), self.b.size
        kept = {name: self.cache[name] for name in KEPT if name in self.cache}
        return replace(self, a=theta[:n], b=theta[n : n + m].reshape(self.b.shape), more=theta[n + m :], cache=kept)

    @property
    def is_stable(self) -> bool:
        """Whether what the inputs did dies out: no pole reaches EDGE.

        A pair has to do so within the record: one that swings all along is a disturbance, to be told as one.
        """
        if not dies_out(self.a.tolist(), EDGE):
            return False
        most = 1 - RINGS / len(self.record.y)
        if len(self.a) < 2 or dies_out(self.a.tolist(), most):  # no pole is out there, so no pair is
            return True
        if len(self.a) == 2:
            return not (self.a[0] ** 2 < 4 * self.a[1] and self.a[1] > most**2)
        poles = np.roots(self.denominator)
        return not np.any(abs(poles[abs(poles.imag) > 1e-9]) > most)

    @property
    def parts(self) -> tuple:
        """What changes, bends or swings in it."""
        return self.bent, self.gains, self.levels, self.ramps, len(self.columns)

    def placed(self) -> dict[str, slice]:
        """Return where the parts of ``more`` are."""
        if "placed" not in self.cache:
            bends = sum(len(self.record.shapes[i]) for i in self.bent)
            many = [bends, len(self.gains), len(self.gains), len(self.ramps), len(self.a)]
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

    def driven(self, i: int, x) -> np.ndarray:
        """Return B_i of a signal, its delay included, before A."""
        return np.convolve(self.numerator(i), x)[: len(x)]

    @property
    def drives(self) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """Each input with its bends, what B makes of it, and the factor of its gain."""
        if "drives" not in self.cache:
            w = [self.moved(i) for i in range(len(self.b))]
            self.cache["drives"] = [(x, self.driven(i, x), self.factor(i)) for i, x in enumerate(w)]
        return self.cache["drives"]

    def numerator(self, i: int) -> np.ndarray:
        """Return B of an input with its delay."""
        return np.concatenate([np.zeros(self.nk[i]), self.b[i]])

    @property
    def denominator(self) -> np.ndarray:
        """1, a1, .."""
        return np.append(1.0, self.a)

    def moved(self, i: int) -> np.ndarray:
        """Return an input with its bends."""
        u = self.record.u[:, i]
        return u + self.bend(i) @ self.record.shapes[i] if i in self.bent else u

    def before(self) -> Copies:
        """Return what passes through 1/A for each number of B and of ``more`` up to the start, (T,) each."""
        T, drives = len(self.record.y), self.drives
        t, moving = np.arange(T), {*(i for i, _ in self.gains), *self.ramps}
        found: list[tuple[np.ndarray, Iterable[int]]] = []
        for i, ((w, _, factor), d) in enumerate(zip(drives, self.nk)):
            lags = range(d, d + self.b.shape[1])
            found += [(factor * delayed(w, lag), (0,)) for lag in lags] if i in moving else [(w, lags)]
        found += [(drives[i][2] * self.driven(i, shape), (0,)) for i in self.bent for shape in self.record.shapes[i]]
        found += [(drives[i][1] * (t >= since), (0,)) for i, since in self.gains]
        found += [((t >= since).astype(float), (0,)) for _, since in self.gains]
        found += [(drives[i][1] * (t / T - 1), (0,)) for i in self.ramps]
        return copies([*found, (np.eye(1, T)[0], range(len(self.a)))])

    def slopes(self) -> tuple[Copies, np.ndarray]:
        """Return the mean's derivative by each parameter, and the mean itself, (T,)."""
        if "slopes" in self.cache:
            return self.cache["slopes"]
        T, A, before = len(self.record.y), self.denominator, self.before()
        whole = sum((factor * m for _, m, factor in self.drives), np.zeros(T))
        inner, *after = linear_filter([1.0], A, np.vstack([whole, before.signals]).T).T
        at, first, level = self.placed(), self.b.size, self.beside
        for part in (at[name] for name in INNER):
            for value, (k, late) in zip(self.more[part], before.places[first + part.start : first + part.stop]):
                inner[late:] += value * after[k][: T - late]
        again = linear_filter([1.0], A, inner)
        places = [(0, j) for j in range(1, len(self.a) + 1)] + [(1 + k, late) for k, late in before.places]
        places += [(1 + len(after) + j, 0) for j in range(len(level))]
        slopes = Copies(np.vstack([-again, *after, level]), tuple(places))
        self.cache["slopes"] = slopes, inner + self.more[at["columns"].start :] @ level
        return self.cache["slopes"]

    @property
    def beside(self) -> np.ndarray:
        """What moves the level by itself, (m, T): columns and steps."""
        t = np.arange(len(self.record.y))
        return np.vstack([self.columns, *((t >= since).astype(float) for since in self.levels)])

    @property
    def mean(self) -> np.ndarray:
        """What y is without noise, (T,)."""
        if "slopes" in self.cache:
            return self.cache["slopes"][1]
        if "mean" not in self.cache:
            T, at = len(self.record.y), self.placed()
            x = sum((factor * m for _, m, factor in self.drives), np.zeros(T))
            for (_, since), shift in zip(self.gains, self.more[at["shifts"]]):
                x[since:] += shift
            x[: len(self.a)] += self.more[at["start"]]
            self.cache["mean"] = linear_filter([1.0], self.denominator, x)
            self.cache["mean"] += self.more[at["columns"].start :] @ self.beside
        return self.cache["mean"]

    # --- as a regression with white noise -----------------------------------------------------------------------

    @property
    def rows(self) -> np.ndarray:
        """The samples that count: used, and not the first ones, by which the noise is whitened."""
        if "rows" not in self.cache:
            clear = self.used.copy()
            for j in range(1, len(self.f) + 1 if not self.record.is_scattered else 1):
                clear[j:] &= self.used[:-j]
                clear[:j] = False
            if self.gaps is not None:
                clear[self.gaps.at] = True
            clear[: max(max(self.nk, default=0) + self.b.shape[1] - 1, 0)] = False  # driven by inputs before the record
            self.cache["rows"] = np.flatnonzero(clear)
        return self.cache["rows"]

    @property
    def bridge(self) -> Bridge | None:
        """How noise is whitened by the sample before, however long ago that was; None where most follow another."""
        if not (self.record.is_scattered and len(self.f)):
            return None
        if "bridge" not in self.cache:
            self.cache["bridge"] = bridge(-float(self.f[0]), float(self.f[1:].sum()), self.rows)
        return self.cache["bridge"]

    @property
    def deviations(self) -> np.ndarray:
        """The deviation of the white noise at the rows that count."""
        if "deviations" not in self.cache:
            self.cache["deviations"] = self.sigma[self.rows]
        return self.cache["deviations"]

    @property
    def gaps(self) -> Gaps | None:
        """How noise is whitened after samples that are missing among others; None where none is."""
        if "gaps" not in self.cache:
            is_whole = self.record.is_scattered or not len(self.f)
            self.cache["gaps"] = None if is_whole else gaps(self.f, self.used)
        return self.cache["gaps"]

    @property
    def mixing(self) -> tuple[np.ndarray, Any] | None:
        """Which rows come after gaps, and what makes innovations there of signals that went through `white`."""
        if self.gaps is None:
            return None
        if "mixing" not in self.cache:
            _, after, kept = np.intersect1d(self.rows, self.gaps.at, assume_unique=True, return_indices=True)
            self.cache["mixing"] = after, self.gaps.mixing(kept, len(self.used), self.sigma)
        return self.cache["mixing"]

    @property
    def spread(self) -> np.ndarray:
        """The deviation of what the past leaves open of y, at the rows that count."""
        if self.gaps is None:
            return self.deviations * (1.0 if self.bridge is None else self.bridge.size)
        size = np.ones(len(self.used))
        size[self.gaps.at] = self.gaps.size
        return self.deviations * size[self.rows]

    @property
    def white(self) -> np.ndarray:
        """The polynomial that whitens samples which follow each other, 1, f1, ..; 1 beside a `bridge`."""
        return np.append(1.0, [] if self.record.is_scattered else self.f)

    @property
    def needed(self) -> np.ndarray:
        """The samples at which signals through `white` are asked for: where gaps are, those before rows as well."""
        return self.rows if self.mixing is None else np.arange(len(self.used))

    def scaled(self, x) -> np.ndarray:
        """Return what went through `white`, at the samples needed, as rows that count in deviations of white noise."""
        if self.mixing is not None:
            after, mixing = self.mixing
            found = x[..., self.rows] / self.deviations
            found[..., after] = (mixing @ x.T).T
            return found
        found = x / self.deviations
        return found if self.bridge is None else self.bridge.whitened(found)

    def whitened(self, x) -> np.ndarray:
        """Return signals (.., T) at the rows that count, in deviations of white noise."""
        return self.scaled(linear_filter(self.white, [1.0], x.T).T[..., self.needed])

    @property
    def left(self) -> np.ndarray:
        """What the mean leaves of y there."""
        if "left" not in self.cache:
            self.cache["left"] = self.whitened(np.where(self.used, self.record.y - self.mean, 0.0))
        return self.cache["left"]

    @property
    def weight(self) -> np.ndarray:
        """Huber's, as roots."""
        if "weight" not in self.cache:
            self.cache["weight"] = np.sqrt(np.minimum(1.0, HUBER / np.maximum(abs(self.left), 1e-300)))
        return self.cache["weight"]

    def jacobian(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the slopes there, (rows, P), weighted, in units of their own sizes, and these."""
        J = self.scaled(self.slopes()[0].filtered(self.white, [1.0]).at(self.needed)).T
        J *= self.weight[:, None]
        size = np.sqrt(np.einsum("ij,ij->j", J, J))
        size = np.where(size > 0, size, 1.0)
        J /= size
        return J, size

    @property
    def basis(self) -> np.ndarray:
        """An orthonormal basis of what the parameters can do there, (rows, P)."""
        if "basis" not in self.cache:
            Q, R = np.linalg.qr(self.jacobian()[0])
            self.cache["basis"] = Q[:, abs(np.diag(R)) > 1e-7]
        return self.cache["basis"]

    def loss(self) -> float:
        """Return Huber's loss of what is left."""
        if "loss" not in self.cache:
            self.cache["loss"] = huber(self.left)
        return self.cache["loss"]

    # --- fitting ------------------------------------------------------------------------------------------------

    def refined(self, steps: int = STEPS) -> Response:
        """Return the parameters that fit best nearby (Gauss and Newton), under the same noise."""
        now, loss = self, self.loss()
        for _ in range(steps):
            J, size = now.jacobian()
            way = least_squares(J, now.left * now.weight) / size
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
        now = replace(self, f=f, sigma=np.ones(T), cache={"slopes": self.slopes()})
        shape = self.sigma / math.exp(float(np.mean(np.log(self.sigma))))
        s = now.left / shape[now.rows]
        sigma = max(1.4826 * float(np.median(abs(s))), 1e-300)
        for _ in range(5):  # the deviation that makes Huber's loss least: the criterion does not feel its error
            sigma = max(
                float(np.sqrt(np.mean(s**2 * np.minimum(1.0, HUBER * sigma / np.maximum(abs(s), 1e-300))))), 1e-300
            )
        return replace(now, sigma=np.maximum(sigma * shape, self.record.floor), cache={"slopes": self.slopes()})

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
            far[now.rows] = abs(now.left) > FAR * local_size(now.left)
            far &= behind
            first = far & ~np.append(False, far[:-1])
            if not first.any():
                break
            now, behind = replace(now, used=now.used & ~first, cache={"slopes": self.slopes()}), far & ~first
        return now

    def with_all_near(self, at: int) -> Response:
        """Return the same with all samples about a change that were measured."""
        used, near = self.used.copy(), slice(max(at - ONSET, 0), at + ONSET)
        used[near] |= np.isfinite(self.record.y[near])
        return replace(self, used=used, cache={name: self.cache[name] for name in ("slopes",) if name in self.cache})

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
        """Schwarz's: less is better, of responses of one record; an outlier counts as a sample at that distance."""
        s, measured = self.spread, self.measured
        misfit = 2 * float(np.mean(np.log(s))) + 2 * self.loss() / max(len(self.rows), 1)
        misfit += (measured - int(self.used.sum())) / measured * (2 * HUBER * FAR - HUBER**2)
        return measured * misfit + (len(self.theta) + len(self.f)) * math.log(measured)

    @property
    def dated_criterion(self) -> float:
        """The criterion with the dates of changes, which cost twice a number each (Zhang and Siegmund, 2007)."""
        dates = len(self.levels) + len(self.gains)
        return self.criterion + 2 * dates * math.log(self.measured)

    def covariance(self) -> np.ndarray:
        """Return the covariance of theta: of white noise or, in each direction, of scores as they were, if larger."""
        J, size = self.jacobian()
        kept = np.setdiff1d(np.arange(len(size)), self.over(J))
        J, size = J[:, kept], size[kept]
        Q, R = np.linalg.qr(J)
        found = np.zeros((len(self.theta),) * 2)
        if np.any(abs(np.diag(R)) < 1e-9):
            return np.full(found.shape, np.inf)
        inverse = np.linalg.solve(R, np.eye(len(R))) / size[:, None]
        r = self.left * self.weight
        scores = Q * r[:, None]
        many = min(len(r) // SHARE, int(4 * (len(r) / 100) ** (2 / 9)) * 3)
        S = scores.T @ scores
        for j in range(1, many + 1):
            cross = scores[j:].T @ scores[:-j]
            S += (1 - j / (many + 1)) * (cross + cross.T)
        value, vector = np.linalg.eigh(S)
        free = len(r) / max(len(r) - len(size) - len(self.f), 1)
        own = inverse @ (vector * (free * np.maximum(value, np.mean(r**2)))) @ vector.T @ inverse.T
        found[np.ix_(kept, kept)] = own
        return found

    def over(self, J) -> np.ndarray:
        """Return which parameters of the start are over before the first row of J (rows, P): after a long delay."""
        first = len(self.a) + self.b.size
        start = first + np.arange(len(self.more))[self.placed()["start"]]
        order = np.concatenate([np.setdiff1d(np.arange(J.shape[1]), start), start])
        dead = order[abs(np.diag(np.linalg.qr(J[:, order], mode="r"))) < 1e-9]
        return np.intersect1d(dead, start)

    def endless(self, covariance) -> list[bool]:
        """Say of each input whether its answer may never end, as far as the record tells: it has no gain, then."""
        n, A = len(self.a), self.denominator
        poles, found = np.roots(A), [False] * len(self.b)
        for k, p in enumerate(poles):
            way = -(p ** np.arange(n - 1, -1, -1)) / np.polyval(np.polyder(A), p)  # of the pole by each coefficient
            way = (way * np.conj(p)).real / max(abs(p), 1e-300)
            std = math.sqrt(max(float(way @ covariance[:n, :n] @ way), 0.0))
            if is_endless(abs(p), std, len(self.record.y)):
                rest = np.prod(1 - np.delete(poles, k) / p) * (1 - p)
                for i, b in enumerate(self.b):  # what this mode does to the end of a step, of all that is done to it
                    part = abs(np.polyval(b[::-1], 1 / p) / rest)
                    found[i] |= bool(part > MATTERS * abs(b.sum() / A.sum()))
        return found
