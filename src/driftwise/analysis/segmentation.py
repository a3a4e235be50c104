"""Where a record changed, in hindsight: a level, the gain of an input or the noise that jumps, with odds."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .beginnings import beginnings
from .change_effects import GAIN, LEVEL, SPEED, part_of
from .change_places import Place, standing
from .change_search import searched
from .driven_noise import are_missed, beside_moves, by_moves, speed_by_moves
from .growing_noise import Growth, growth
from .noise_jumps import LEAST, SURE, NoiseJump
from .pairs import changes, together
from .readings import all_gains, endless, other_reading
from .relative import Units, misfit, read, read_relative
from .response import Response
from .response_orders import grown
from .response_record import long_run
from .seasons import held
from .walks import best_walk, walked, walks

EDGE, BESIDE = 6, 5.0  # part of a record that is its edge; log odds that chance may take
NOISE = "noise"
# Log odds from which one is told, for what is slow looks like a level; and those to a walk: a gain's are seldom weak.
TOLD = {LEVEL: math.log(1000.0), GAIN: SURE, SPEED: SURE}
AT_ONCE = {LEVEL: math.log(10.0), GAIN: 0.0, SPEED: 0.0}
ALL = -1  # the input of a gain's jump that is one of the gains of all
LARGER = 1.05 ** np.arange(40)  # than the least step of a level, what it is that no walk explains as well


class Jump(NamedTuple):
    """A jump: the first sample after it, where that lies in 95 of 100 cases, the log odds, and what jumped.

    A gain of a plant whose answer is not seen to end is none: ``before`` is 1, then, and ``after`` its factor. So it is
    of a speed, where ``after`` says how much longer the plant takes to answer.
    """

    at: int
    interval: tuple[int, int]
    log_odds: float
    kind: str
    input: int  # of a gain; of a speed its place among those of the response
    before: float
    after: float
    is_factor: bool = False
    rival: Jump | None = None  # the other reading, where a gain and a speed cannot be told apart
    is_alone: bool = False  # of a speed: whether it is that of the slowest mode
    share: float | None = None  # of a level whose logarithm jumped: its size as a share of it

    def as_factor(self) -> Jump:
        """Return a gain's jump as a factor."""
        after = self.after / self.before if self.before else math.inf
        return self if self.is_factor else self._replace(before=1.0, after=after, is_factor=True)


class Visible(NamedTuple):
    """The smallest jumps that would have been told outside of the edges of a record."""

    level: float
    gains: tuple[float, ...]  # as shares of the gain of each input
    noise: float  # as a factor


class Hindsight(NamedTuple):
    """The response of a record with all its changes, and its units."""

    response: Response
    units: Units
    seasons: tuple[int, ...] = ()  # with which its noise may come and go, in samples

    def growth(self) -> Growth:
        """Return how the noise grows with the level."""
        return self._noise[0]

    @property
    def _noise(self) -> tuple[Growth, list[NoiseJump]]:
        """How the noise grows, and its jumps beside that: worked out once."""
        cache = self.response.cache
        if "growth" not in cache:
            cache["growth"] = growth(self.response, self.units, self.seasons)
        return cache["growth"]

    def jumps(self) -> list[Jump]:
        """Return what jumped, in order of time."""
        now, units, found = self.response, self.units, []
        places = {one: where for one in changes(now) if (where := standing(now, *one.of(now)))}
        for (kind, i, since), where in together(now, places).items():
            if kind == LEVEL:
                j = now.levels.index(since)
                where = beside_moves(now, j, where)
                step = float(now.more[now.placed()["levels"].start + j])
                if where.log_odds > SURE and where.slow > TOLD[LEVEL] and is_sudden(now, "levels", j, where):
                    told = Jump(where.middle, where.interval, where.log_odds, LEVEL, 0, 0.0, units.size(step))
                    found.append(told._replace(share=units.share(step)))
                continue
            j = now.gains.index((i, since))
            where = by_moves(now, j, where)
            if where.log_odds > TOLD[GAIN] and is_sudden(now, "gains", j, where):
                told = self.gain_jump(now, j, where, endless(now)[i])
                found.append(told._replace(rival=self.rival(GAIN, j, where)))
        for j in range(len(now.speeds)):
            where = standing(now, "speeds", j)
            where = where and speed_by_moves(now, j, where)
            if where and where.log_odds > TOLD[SPEED] and is_sudden(now, "speeds", j, where):
                found.append(speed_jump(now, j, where)._replace(rival=self.rival(SPEED, j, where)))
        for jump in self._noise[1]:
            sizes = jump.before * units.y_scale, jump.after * units.y_scale
            found.append(Jump(jump.at, jump.interval, jump.log_odds, NOISE, 0, *sizes))
        seen = np.flatnonzero(np.isfinite(now.record.y))
        return sorted(jump if jump.kind in (GAIN, SPEED) else unseen(jump, seen) for jump in found)

    def gain_jump(self, now: Response, j: int, where: Place, is_endless: bool) -> Jump:
        """Return the jump of a gain of a response, the j-th."""
        (i, since), last = now.gains[j], len(now.used) - 1
        factor = now.factor(i)
        gain = now.b[i].sum() / now.denominator.sum() * self.units.y_scale / self.units.u_scale[i]
        before, after = (float(gain * factor[k]) for k in (max(since - 1, 0), min(since, last)))
        told = Jump(where.middle, where.interval, where.log_odds, GAIN, i, before, after)
        return told.as_factor() if is_endless else told

    def rival(self, kind: str, j: int, where: Place) -> Jump | None:
        """Return the other reading of a gain or a speed that changed, where both are as likely."""
        found = other_reading(self.response, kind, j, where)
        if found is None and kind == SPEED and all_gains(self.response, j, where):
            slower = speed_jump(self.response, j, where).after
            return Jump(where.middle, where.interval, where.log_odds, GAIN, ALL, 1.0, 1 / slower, is_factor=True)
        if found is None:
            return None
        other, now = found[0], found[2]
        if other == SPEED:
            return speed_jump(now, len(now.speeds) - 1, where)
        return self.gain_jump(now, len(now.gains) - 1, where, is_endless=True)

    def visible(self) -> Visible | None:
        """Return the smallest jumps that would have been told; None where too few samples follow each other."""
        now, n, k = self.response, len(self.response.rows), len(self.response.b)
        if n // EDGE < LEAST:
            return None
        need = 0.5 * math.log(n) + math.log(2 + k) + BESIDE
        places, sizes = now.rows[[n // EDGE, n - n // EDGE]], []
        r = now.left * now.weight
        for kind, i in [(LEVEL, 0), *((GAIN, i) for i in range(k))]:
            d = [part_of(now, kind, i, at, r)[1] for at in places]
            free = max(float(min(x @ x for x in d)), 1e-300)
            calm = max(max(long_run(x * r) / max(float(np.mean(x * x)), 1e-300) for x in d), 1.0)
            sizes.append(math.sqrt(2 * (need + TOLD[kind]) * calm / free))
            if kind == LEVEL:
                sizes[0] = max(sudden(now, x, calm, sizes[0]) for x in d)
            elif are_missed(now, i):
                sizes[-1] = math.inf  # what a change has to be beside them is not known
        share, factors, z = 1 / EDGE, np.linspace(1.05, 10.0, 200), r**2 / max(float(np.mean(r**2)), 1e-300) - 1
        gain = 0.5 * n * (np.log(1 - share + share * factors**2) - share * np.log(factors**2))
        enough = np.flatnonzero(gain / max(long_run(z) / 2, 1.0) > need + SURE)
        noise = beside_rounding(now, float(factors[enough[0]])) if len(enough) else math.inf
        return Visible(sizes[0] * self.units.y_scale, tuple(sizes[1:]), noise)


def speed_jump(now: Response, j: int, where: Place) -> Jump:
    """Return the jump of a speed of a response, the j-th."""
    factor = math.exp(-float(now.more[now.placed()["speeds"].start + j]))
    return Jump(where.middle, where.interval, where.log_odds, SPEED, j, 1.0, factor, is_alone=now.is_alone)


def beside_rounding(now: Response, factor: float) -> float:
    """Return by what factor the noise itself falls where all that is left falls by one: rounding stays as it is."""
    share = min(now.record.floor**2 * float(now.white @ now.white) / float(np.median(now.sigma)) ** 2, 1.0)
    return math.sqrt((1 - share) / (factor**-2 - share)) if share < factor**-2 else math.inf


def sudden(now: Response, d, calm: float, least: float) -> float:
    """Return the least size, and no less than one, from which a level that does ``d`` per unit is no walk.

    What chance takes of the step it may give to the walk.
    """
    U, spread = walks(now, None)
    sizes, z, free = least * LARGER, U.T @ d, 0.5 * float(d @ d) / calm
    more = [size**2 * free - best_walk(size * z, spread, calm) for size in sizes.tolist()]
    return float(sizes[int(np.argmax(np.array(more) > AT_ONCE[LEVEL] + 2 * BESIDE))])


def is_sudden(now: Response, part: str, j: int, where: Place) -> bool:
    """Whether a change is likelier to have come at once than as a walk."""
    return (
        where.whole
        > walked(now, part, j, where.calm) + AT_ONCE[LEVEL if part == "levels" else GAIN if part == "gains" else SPEED]
    )


def unseen(jump: Jump, seen) -> Jump:
    """Return a jump that showed at one of the samples ``seen`` dated between it and the one before, in its middle.

    So is the first end of its interval: what showed there at the earliest came after the sample before.
    """
    low, high = jump.interval
    first, earliest = (after_the_one_before(seen, at) for at in (jump.at, low))
    return jump._replace(at=(first + jump.at) // 2, interval=(min(earliest, first), max(high, jump.at)))


def after_the_one_before(seen, at: int) -> int:
    """Return the sample that follows the last of those ``seen`` before another one."""
    k = int(np.searchsorted(seen, at))
    return int(seen[k - 1]) + 1 if k else at


def hindsight(y, *readings, seasons: tuple[int, ...] = (), events: tuple[int, ...] = ()) -> Hindsight | None:
    """Return what was found in a record, y (T,) and u (T, k); None where too few outputs were measured.

    Of several readings of what the inputs did, the one is taken under which y is likeliest before anything changes; so
    is the logarithm of y (`relative`).
    The level may have each of ``seasons``, in samples; noise that comes and goes with one is none that jumps.
    That a level, a gain or a speed changed at one of the samples ``events`` is as likely beforehand as that it did at
    any: an intervention (Box and Tiao, 1975).

    One response of all inputs beside coloured noise is fitted (`response`). A change is added where it explains most:
    a step of the level, of the gain of an input, or what is none: an input that bends, a gain that moves along a line,
    a line of the spectrum; then all is fitted again, until nothing is surer than 100:1. What a change explains counts
    as the evidence that the samples are worth: it is divided by the long-run variance of the score, with Bartlett's
    weights (Newey and West, 1987), and samples far off count less (Huber, 1964), so that neither tails nor a colour
    that was not seen make jumps. The odds are those of a change anywhere in the record, beside all others.

    Bad at: slow drift that is no straight line; changes close together; one of several poles that jumps alone.
    """
    if np.isfinite(y).sum() <= 2 * LEAST:
        return None
    holds = held(seasons, int(np.isfinite(y).sum()))
    records = [read(y, u, events) for u in readings]
    begun = [(beginnings(record, holds), units) for record, units in records]
    least = [misfit(*one) for one in begun]
    best = int(np.argmin(least))
    found, units = begun[best]
    if found and (other := read_relative(*records[best])):
        logs = beginnings(other[0], holds), other[1]
        found, units = logs if misfit(*logs) < least[best] else begun[best]
    searches = [searched(one) for one in found]
    return Hindsight(grown(min(searches, key=lambda one: one.dated_criterion)), units, seasons) if searches else None
