"""How a record was sampled, and rows on a regular clock, chunk by chunk."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .clock import DAY
from .coarse_stamps import Coarse, coarse
from .going_on import PAST, goes_on

LONGEST_GAP = 1000  # samples; a longer silence is a restart
RESTART_ROWS = 20  # missing rows that stand for a restart: enough to empty the lags of a model
LATE = 5  # steps that a stamp may go back and still be a row that came late
GAPS = {"regular": 1.75, "uneven": 2.5}  # a step longer than this many usual steps lost samples
UNEQUAL = 1e-3  # of a step, by which the usual one may be off the mean: months have 30.4 days, the most of them 31
ROUNDING = 0.02  # of a tick, by which stamps may be off
WEEKS = 20  # rows, four weeks, below which it is not known that a week rests
RESTING = 0.01  # share of the rows, that the two days have at most on which a week rests
NEXT = 0.5  # of how often its commonest step comes, that a clock shows the next tick
READ = 20  # steps, below which it is not known what they are multiples of
DENSEST = 6  # rows of the regular clock per row of the file, at most


class Sampling(NamedTuple):
    """How the first rows were sampled.

    kind : "none" (no time column), "regular", "uneven" (steps differ by less than half a step: taken as equal) or
        "irregular" (steps differ by orders of magnitude: sampled and held on a regular clock)
    dt : step of the clock; 1 without a time column
    gaps, longest : how many steps lost samples, restarts aside, and the longest of all steps
    duplicates, late, restarts : stamps that repeat the one before, come after later ones, and start again
    set_back : how many times the clock was set back while rows went on
    shared : how rows come that share their stamps, None where none do
    low, high : 5 and 95 % quantile of the steps
    rest : stamp at which one of the weekends begins that a clock of working days leaves out, None for any other clock
    """

    kind: str
    dt: float
    gaps: int = 0
    longest: float = 0.0
    duplicates: int = 0
    late: int = 0
    restarts: int = 0
    low: float = 0.0
    high: float = 0.0
    rest: float | None = None
    set_back: int = 0
    shared: Coarse | None = None


def judge_sampling(time, values=None, signals=None) -> Sampling:
    """Say how a time column (T,) of seconds steps; NaN where a stamp is missing.

    ``values`` (T, k) of its rows tell whether these go on where it goes back; without them none do. All ``signals``
    (T, m) tell whether rows of one stamp are samples, and not the same twice.

    Examples
    --------
    >>> judge_sampling([0, 1, 2, 3, 7, 8, 9, 10.0])[:4]
    ('regular', 1.0, 1, 4.0)
    """
    time = np.array(time, float)
    is_stamped = np.isfinite(time)
    stamps = time[is_stamped]
    rows, of_signals = (None if x is None else np.asarray(x, float)[is_stamped] for x in (values, signals))
    steps = np.diff(stamps)
    forward = steps[steps > 0]
    if not forward.size:
        return Sampling("none", 1.0)
    shared = coarse(stamps, divisor(forward, float(forward.min()) / 2), of_signals)
    if shared is not None:
        time[is_stamped] = shared.spread(stamps)
        forward = np.diff(time[is_stamped])
        forward = forward[forward > 0]
    dt = float(f"{np.median(forward):.9g}")
    rest = resting(time, dt)
    forward = np.diff(worked(time[np.isfinite(time)], rest))
    forward = forward[forward > 0]
    ratio = forward / dt
    whole = np.round(ratio)
    low, high = np.quantile(forward, [0.05, 0.95])
    q10, q90 = np.quantile(forward, [0.1, 0.9])
    sparse = np.mean(whole > 1) > 0.05 and np.mean(np.minimum(whole, LONGEST_GAP)) > DENSEST  # mostly gaps
    on_grid = (whole >= 1) & (np.abs(ratio - whole) <= 0.1 * whole)
    if np.mean(on_grid) >= 0.95 and np.mean(whole == 1) >= 0.7 and not sparse:
        kind = "regular"
        mean = float(f"{forward[on_grid].sum() / whole[on_grid].sum():.9g}")
        dt = mean if abs(mean - dt) > UNEQUAL * dt else dt
    elif high <= 4 * low and q90 - q10 <= dt:
        kind = "uneven"
    else:
        kind = "irregular"
        span = forward[ratio <= LONGEST_GAP].sum()
        least = span / (DENSEST * forward.size)
        common = divisor(forward, least)
        dt = common or max(dt, float(f"{least:.3g}"))
    again, on, _ = starts_again(stamps, dt, stamps[0], None if kind == "irregular" else rows)
    restarts = int(np.count_nonzero(again) + np.count_nonzero(forward > (LONGEST_GAP + 1) * dt))
    parts = np.split(stamps, np.flatnonzero(again | on) + 1)
    return Sampling(
        kind,
        dt,
        int(np.count_nonzero((forward > GAPS.get(kind, np.inf) * dt) & (forward <= (LONGEST_GAP + 1) * dt))),
        float(forward.max()),
        int(np.count_nonzero(steps == 0)),
        sum(int(np.count_nonzero(part < np.maximum.accumulate(part))) for part in parts),
        restarts,
        float(low),
        float(high),
        rest,
        int(np.count_nonzero(on)),
        shared,
    )


def resting(time, dt: float) -> float | None:
    """Return when one of the weekends begins on which a clock (T,) of days has no rows, None where it has them all.

    >>> days = np.flatnonzero(np.arange(70) % 7 < 5) * DAY
    >>> resting(days, DAY) / DAY, worked(days, 5 * DAY)[:8] / DAY
    (5.0, array([0., 1., 2., 3., 4., 5., 6., 7.]))
    """
    stamps = time[np.isfinite(time)]
    if abs(dt - DAY) > 1.0 or len(stamps) < WEEKS:
        return None
    share = np.bincount(np.floor((stamps - stamps[0]) / DAY).astype(int) % 7, minlength=7) / len(stamps)
    both = share + np.roll(share, -1)
    first = int(np.argmin(both))
    is_whole = np.sort(share)[2] > 0.5 / 7  # the five others have theirs
    return float(stamps[0] + DAY * first) if both[first] <= RESTING and is_whole else None


def worked(time, rest: float | None):
    """Return stamps without the weekends before them; as they are where ``rest`` is None."""
    if rest is None:
        return time
    weeks, inside = np.divmod(time - rest, 7 * DAY)
    return time - 2 * DAY * weeks - np.minimum(inside, 2 * DAY)


def divisor(steps, least: float) -> float:
    """Return the longest time that all steps are multiples of, ``least`` or more; 0 where there is none."""
    size = float(steps.min())
    while size >= least:
        many = np.round(steps / size)
        size = float(steps.sum() / many.sum())
        rest = abs(steps - size * many)
        if rest.max() <= ROUNDING * size:
            return float(f"{size:.9g}") if size >= least else 0.0
        size = float(rest[rest > ROUNDING * size].min())
    return 0.0


def skips_ticks(stamps) -> bool:
    """Say whether numbers (T,) are a clock that was read at some of its ticks: often enough the very next one was.

    What grows by itself, as a meter does, has no least step that is its usual one. Steps of one may be an index.

    >>> skips_ticks(15.0 * np.cumsum([1, 3, 1, 2, 1, 1, 4] * 3)), skips_ticks(np.cumsum([1.0, 3, 1, 2, 1, 1, 4] * 3))
    (True, False)
    """
    steps = np.diff(stamps)
    if steps.size < READ or not np.all(steps > 0):
        return False
    tick = divisor(steps, float(steps.sum()) / (DENSEST * steps.size))
    if tick in (0.0, 1.0):
        return False
    many = np.bincount(np.rint(steps / tick).astype(int))
    return bool(many[1] >= NEXT * many.max())


def starts_again(stamps, dt: float, start: float, values=None, known: int = 0):
    """Return (mask of the steps (T - 1,) at which a clock starts again, mask of those at which it was set back while
    rows went on, the stamp where it last started).

    Rows go on where their values (T, k) say so (`goes_on`), but for a clock that is back where it started. It starts
    again where it goes back by more than half of its way so far, or by more than `LONGEST_GAP` steps. By less, rows
    are late until it has caught up. Steps between the first ``known`` rows have been judged.

    >>> starts_again(np.array([0.0, 10, 20, 30, 0, 10]), 1.0, 0.0)[0].tolist()
    [False, False, False, True, False]
    >>> starts_again(np.array([0.0, 10, 20, 30, 20, 30]), 1.0, 0.0)[0].any()
    np.False_
    >>> rows = 0.1 * np.arange(30.0)[:, None]
    >>> np.flatnonzero(starts_again(np.r_[0:20, 8:18.0], 1.0, 0.0, rows)[1]).tolist()
    [19]
    """
    again, on = np.zeros((2, max(len(stamps) - 1, 0)), bool)
    first = max(known - 1, 0)
    for k in first + np.flatnonzero(np.diff(stamps[first:]) < -LATE * dt):
        back = stamps[k] - stamps[k + 1]
        if values is not None and stamps[k + 1] > start + 0.5 * dt and goes_on(stamps, values, int(k), dt):
            on[k] = True
        elif back > LONGEST_GAP * dt or back > 0.5 * (stamps[k] - start):
            again[k], start = True, float(stamps[k + 1])
    return again, on, start


class Regular:
    """Puts rows on a regular clock, chunk by chunk; what comes out does not depend on the chunks.

    Regular or uneven stamps: each row is one sample; where samples were lost, rows of NaN are put in, so that time
    moves. After more than `LONGEST_GAP` lost samples, or where the clock starts again, `RESTART_ROWS` rows of NaN
    stand for the break, and a clock that started again goes on from there. Where it was set back while rows went on,
    it goes on without a break. Rows whose stamp repeats one before, or comes late, are left out, and those before the
    first stamp; where stamps are too coarse to tell rows apart, these come at their pace.
    Irregular stamps: the clock ticks every `dt`; a tick gets the last row before it, of which the columns `held`
    (inputs) stay while the others are NaN until a fresh row comes.

    Parameters
    ----------
    sampling : `Sampling` of the first rows
    held : mask of the columns that are held between irregular rows

    Examples
    --------
    >>> import numpy as np
    >>> clock = Regular(Sampling("regular", 1.0))
    >>> time, values, rows = clock.push(np.array([0.0, 1, 3, 4]), np.array([[5.0], [6], [8], [9]]))
    >>> values[:, 0].tolist(), rows.tolist()
    ([5.0, 6.0, nan, 8.0, 9.0], [0, 1, -1, 2, 3])
    """

    def __init__(self, sampling: Sampling, held=()):
        self.sampling = sampling
        self.held = np.asarray(held, bool)
        self.inserted = self.dropped = self.restarts = 0
        self._rows = 0  # rows taken so far
        self._stamp: float | None = None  # the last stamp as it came, holes filled
        self._came = -np.inf, -np.inf  # stamps that rows share: the last one, counted on, and when its row came
        self._start: float | None = None  # the stamp at which the clock last started
        self.breaks: list[
            tuple[float, float]
        ] = []  # where the clock started again or was set back, and what its stamps are ahead since
        self._shift = 0.0  # what these added to the stamps
        self._past: tuple[np.ndarray, np.ndarray] | None = None  # stamps and values of the last rows as they came
        self._last = -np.inf  # time of the last row kept
        self._row: tuple[float, np.ndarray, int] | None = None  # irregular: the row that the clock waits for
        self._base = self._tick = 0.0  # irregular: where the ticks are counted from, and the next one
        self._width = self.held.size

    def push(self, time, values):
        """Take the next rows: time (T,) or None, values (T, k); return (time, values, rows).

        rows : where each row came from, counted from 0 in the record; -1 where it was put in
        """
        values = np.asarray(values, float)
        self._width = values.shape[1]
        rows = np.arange(self._rows, self._rows + len(values))
        self._rows += len(values)
        if time is None or self.sampling.kind == "none":
            return rows * self.sampling.dt, values, rows
        time = np.asarray(time, float)
        if self._stamp is None:  # rows before the first stamp have no place in time
            start = int(np.argmax(np.isfinite(time))) if np.isfinite(time).any() else len(time)
            self.dropped += start
            time, values, rows = time[start:], values[start:], rows[start:]
        if not len(values):
            return np.empty(0), values, rows
        time = self._forward(time, values)
        past = np.maximum.accumulate(np.concatenate(([self._last], time)))
        keep = time > past[:-1]
        self.dropped += int(len(time) - keep.sum())
        before, self._last = self._last, float(past[-1])
        time, values, rows = time[keep], values[keep], rows[keep]
        if self.sampling.kind == "irregular":
            return self._hold(time, values, rows)
        return self._fill(before, time, values, rows)

    def flush(self):
        """Return what an irregular record still owes: its last row."""
        if self._row is None:
            return np.empty(0), np.empty((0, self._width)), np.empty(0, int)
        _, values, row = self._row
        self._row = None
        return np.array([self._tick]), values[None], np.array([row])

    def _forward(self, stamps, values):
        """Return stamps with holes filled, and moved behind what came before where the clock went back."""
        dt = self.sampling.dt
        first = self._stamp if self._stamp is not None else stamps[0] - dt
        joined = np.concatenate(([first], stamps))
        index = np.arange(joined.size)
        known = np.maximum.accumulate(np.where(np.isfinite(joined), index, 0))
        joined = joined[known] + (index - known) * dt
        past, seen = self._past or (joined[:0], values[:0])
        past, seen = np.concatenate((past, joined[1:])), np.concatenate((seen, values))
        rows = None if self.sampling.kind == "irregular" else seen
        start = first if self._start is None else self._start
        again, on, self._start = starts_again(past, dt, start, rows, len(past) - len(stamps))
        self._past = past[-PAST:], seen[-PAST:]
        again, on = (np.concatenate(([False], mask))[-len(stamps) :] for mask in (again, on))
        self.restarts += int(again.sum())
        step = np.where(again, (RESTART_ROWS + 1) * dt, dt)
        shift = self._shift + np.cumsum(np.where(again | on, step - np.diff(joined), 0.0))
        self.breaks += [(float(joined[k + 1] + shift[k]), float(shift[k])) for k in np.flatnonzero(again | on)]
        self._stamp, self._shift = float(joined[-1]), float(shift[-1])
        return self._spread(joined[1:] + shift)

    def _spread(self, stamps):
        """Return when rows came, where they share their stamps."""
        if self.sampling.shared is None:
            return stamps
        time = self.sampling.shared.spread(stamps, *self._came)
        last = int(np.argmax(stamps))
        last += int(np.flatnonzero(stamps[last:] == stamps[last])[-1])
        if stamps[last] >= self._came[0]:
            self._came = float(stamps[last]), float(time[last])
        return time

    def _lost(self, steps):
        """Return how many rows to put in before each row, and count."""
        ratio = steps / self.sampling.dt
        lost = np.where(ratio > GAPS[self.sampling.kind], np.round(ratio) - 1, 0)
        long = lost > LONGEST_GAP
        self.restarts += int(long.sum())
        lost = np.where(long, RESTART_ROWS, lost).astype(int)
        self.inserted += int(lost.sum())
        return lost

    def _fill(self, before, time, values, rows):
        if not time.size:
            return time, values, rows
        joined = np.concatenate(([before if np.isfinite(before) else time[0]], time))
        steps = np.diff(joined)
        lost = self._lost(np.diff(worked(joined, self.sampling.rest)))
        if not lost.any():
            return time, values, rows
        at = np.arange(time.size) + np.cumsum(lost)
        count = int(at[-1]) + 1
        whole = np.full((count, values.shape[1]), np.nan)
        whole[at] = values
        source = np.full(count, -1)
        source[at] = rows
        clock = np.empty(count)
        clock[at] = time
        for k in np.flatnonzero(lost):  # rows put in: dt apart behind the row before, never past the next
            start = time[k] - steps[k]
            pace = min(self.sampling.dt, steps[k] / (lost[k] + 1))
            clock[at[k] - lost[k] : at[k]] = start + pace * np.arange(1, lost[k] + 1)
        return clock, whole, source

    def _hold(self, time, values, rows):
        if self._row is not None:
            time = np.concatenate(([self._row[0]], time))
            values = np.concatenate((self._row[1][None], values))
            rows = np.concatenate(([self._row[2]], rows))
        elif time.size:
            self._base = float(time[0])
        if not time.size:
            return time, values, rows
        dt = self.sampling.dt
        restart = np.diff(time) > LONGEST_GAP * dt
        starts = np.concatenate(([self._base], time[1:][restart]))
        segment = np.concatenate(([0], np.cumsum(restart)))
        first = np.ceil((time - starts[segment]) / dt - 1e-6).astype(int)  # the first tick that a row can serve
        count = np.where(restart, 1 + RESTART_ROWS, np.diff(first))
        self._base, self._row = float(starts[-1]), (float(time[-1]), values[-1], int(rows[-1]))
        self._tick = self._base + first[-1] * dt
        serves = np.repeat(np.arange(time.size - 1), count)
        later = np.arange(serves.size) - (np.cumsum(count) - count)[serves]  # ticks since the row's first
        whole, source = values[serves].copy(), np.where(later == 0, rows[serves], -1)
        whole[(later > 0)[:, None] & ~(self.held & ~restart[serves][:, None])] = np.nan
        self.restarts += int(restart.sum())
        self.inserted += int(np.count_nonzero(later))
        self.dropped += int(np.count_nonzero(count == 0))
        return starts[segment[serves]] + (first[serves] + later) * dt, whole, source
