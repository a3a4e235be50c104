"""What is to be said of tracks: a row of numbers for each, and the whole in a few sentences."""

from __future__ import annotations

from typing import Any, NamedTuple

from driftwise.edge.wording import fixed, number
from driftwise.workflow.clock_words import instant, lasting

__all__ = ["HEAD", "Row", "cells", "clock", "faults_told", "lead", "mean", "row", "rows", "stretches", "times", "when"]

SETTLE = 12  # plots before the error bars of a track are judged
DATED = 1e8  # s: times beyond are Unix times
MANOEUVRE = 0.5  # probability from which a track is said to manoeuvre
TURNED = 30.0  # degrees from which a manoeuvre is called a turn
HEAD = (
    "track", "name", "from", "to", "plots", "missed", "speed m/s", "manoeuvres", "NIS", "in 95 %", "status"
)  # fmt: skip


class Turn(NamedTuple):
    """A manoeuvre that turned a track."""

    start: float
    end: float
    angle: float  # degrees, positive to the right
    rate: float  # degrees per second, the fastest


class Row(NamedTuple):
    """What is told of one track."""

    track: Any
    label: str
    name: str
    start: float
    end: float
    plots: int
    missed: int
    speed: float  # m/s, median
    manoeuvres: int
    nis: float
    coverage: float  # share, of both coordinates
    status: str
    turns: tuple[Turn, ...]

    @property
    def called(self) -> str:
        """What the track is called where one word has to do."""
        return self.name or self.label

    def as_dict(self) -> dict:
        """Return the row by names; the track itself is its number."""
        return {**self._asdict(), "track": self.track.id, "turns": [turn._asdict() for turn in self.turns]}


def row(track) -> Row:
    """Return what is told of a track.

    Missed are the scans without a plot: those that its trace steps over, and those that lie between two plots, by the
    median of the time between them. NIS and coverage leave out the first 12 plots, which
    settle the noise; they are NaN where no more than these came.
    """
    import numpy as np

    trace = track.trace
    seen = np.isfinite(trace.plot).all(axis=1)
    judged = np.flatnonzero(seen)[SETTLE:]
    z = trace.normal_score[judged]
    z = z[np.isfinite(z)]
    nis = trace.nis[judged]
    nis = nis[np.isfinite(nis)]
    speed = trace.speed[np.isfinite(trace.speed)]
    return Row(
        track=track,
        label=track.key or f"#{track.id}",
        name=track.name,
        start=float(trace.time[0]),
        end=float(trace.time[-1]),
        plots=int(seen.sum()),
        missed=int((~seen).sum()) + _between(trace.time),
        speed=float(np.median(speed)) if len(speed) else float("nan"),
        manoeuvres=len(stretches(trace)),
        nis=float(nis.mean()) if len(nis) else float("nan"),
        coverage=float((abs(z) <= 1.96).mean()) if len(z) else float("nan"),
        status=track.status,
        turns=tuple(_turns(trace)),
    )


def _between(time) -> int:
    """Return how many scans fell out between the rows of a trace."""
    import numpy as np

    gaps = np.diff(time)
    usual = float(np.median(gaps)) if len(gaps) else 0.0
    return int((np.round(gaps[gaps > 1.5 * usual] / usual) - 1).sum()) if usual > 0 else 0


def rows(tracks) -> list[Row]:
    """Return the rows of tracks that were ever confirmed and have an estimate, the one with most plots first."""
    found = [row(track) for track in tracks if track.status != "tentative" and len(track.trace.time)]
    return sorted(found, key=lambda r: -r.plots)


def mean(rows: list[Row], name: str) -> float:
    """Return the mean of "nis" or "coverage" over the plots of all tracks that can be judged; NaN where none can."""
    judged = [(getattr(r, name), r.plots - SETTLE) for r in rows if getattr(r, name) == getattr(r, name)]
    return sum(value * plots for value, plots in judged) / sum(n for _, n in judged) if judged else float("nan")


def stretches(trace) -> list[tuple[int, int]]:
    """Return (first row, end) of every run of rows of a trace in which a manoeuvre is more likely than not."""
    import numpy as np

    moving = np.concatenate(([False], np.asarray(trace.manoeuvre) > MANOEUVRE, [False]))
    return [(int(a), int(b)) for a, b in np.flatnonzero(np.diff(moving)).reshape(-1, 2)]


def _turns(trace):
    """Yield the manoeuvres by which the course changed for good."""
    import numpy as np

    for a, b in stretches(trace):
        first, rows = max(a - 1, 0), slice(max(a - 1, 0), b)
        steps = (np.diff(trace.course[rows]) + 180) % 360 - 180
        if not len(steps) or not np.isfinite(steps).all():
            continue
        angle, rate = float(steps.sum()), np.degrees(trace.turn_rate[a:b])
        if abs(angle) >= TURNED:
            fastest = float(rate[np.nanargmax(abs(rate))]) if np.isfinite(rate).any() else float("nan")
            yield Turn(float(trace.time[first]), float(trace.time[b - 1]), angle, fastest)


def clock(time: float) -> str | None:
    """Return the time stamp of second 0, where times like this one are Unix times."""
    return "1970-01-01" if time > DATED else None


def when(time: float, with_day: bool = True) -> str:
    """Return an instant as one writes it, to the second where it is a date."""
    if clock(time) is None:
        return instant(time, None)
    told = instant(round(time), clock(time))
    told = told if " " in told else f"{told} 00:00:00"
    return told if with_day else told.partition(" ")[2]


def cells(found: Row, *, with_day: bool = False) -> list[str]:
    """Return a row as it is printed."""
    coverage = f"{fixed(100 * found.coverage, 1)} %" if found.coverage == found.coverage else "\u2013"
    return [
        found.label, found.name, when(found.start, with_day), when(found.end, with_day), str(found.plots),
        str(found.missed), number(found.speed, 3) if found.speed == found.speed else "\u2013", str(found.manoeuvres),
        fixed(found.nis, 2), coverage, found.status,
    ]  # fmt: skip


def lead(rows: list[Row]) -> str:
    """Return in a few sentences how many objects there were, over which time, what turned and how sure this is."""
    if not rows:
        return "No object was seen often enough to make a track."
    start, end = min(r.start for r in rows), max(r.end for r in rows)
    turning = [r for r in rows if r.turns]
    if len(rows) == 1:
        turned = f"and turned {times(len(rows[0].turns))}" if turning else "and did not turn"
        told = [f"{rows[0].called} was followed for {lasting(end - start)} {turned}."]
    else:
        told = [f"{_count(len(rows), 'object')} in {lasting(end - start)}, {_turned(rows, turning)}."]
    if turning:
        found, turn = max(((r, t) for r in turning for t in r.turns), key=lambda pair: abs(pair[1].angle))
        whose = f"{found.called}, " if len(rows) > 1 else ""
        side = "right" if turn.angle > 0 else "left"
        told.append(
            f"The longest turn: {whose}{abs(turn.angle):.0f}\u00b0 to the {side} from {when(turn.start)} "
            f"to {when(turn.end, False)}, at up to {number(abs(turn.rate), 2)}\u00b0/s."
        )
    told.append(_sure(rows))
    return " ".join(filter(None, told))


def _turned(rows: list[Row], turning: list[Row]) -> str:
    if not turning:
        manoeuvres = sum(r.manoeuvres for r in rows)
        return "none of which turned" if not manoeuvres else f"{_count(manoeuvres, 'manoeuvre')}, no lasting turn"
    names = [r.called for r in turning]
    if len(names) <= 3:
        return f"of which {' and '.join([', '.join(names[:-1]), names[-1]] if len(names) > 1 else names)} turned"
    return f"{len(names)} of which turned"


def _sure(rows: list[Row]) -> str:
    held = mean(rows, "coverage")
    if held != held:
        return "There are too few plots to judge the error bars."
    return f"{fixed(100 * held, 1)} % of the plots fell into their 95 % bands."


def faults_told(faults) -> str:
    """Return in a sentence what could not be read, with the places of the first ones; nothing where all could."""
    if not faults:
        return ""
    kinds: dict[str, list] = {}
    for fault in faults:
        kinds.setdefault(fault.what, []).append(fault)
    most = sorted(kinds.items(), key=lambda item: -len(item[1]))
    told = [f"{what}: {len(some)} (first at {_where(some)})" for what, some in most[:3]]
    rest = sum(len(some) for _, some in most[3:])
    return (
        f"{_count(len(faults), 'record')} skipped \u2013 {'; '.join(told)}{f'; other reasons: {rest}' if rest else ''}."
    )


def _where(faults, most: int = 3) -> str:
    return ", ".join(str(fault.offset) for fault in faults[:most])


def _count(n: int, what: str) -> str:
    return f"{n} {what}{'' if n == 1 else 's'}"


def times(n: int) -> str:
    return {1: "once", 2: "twice"}.get(n, f"{n} times")
