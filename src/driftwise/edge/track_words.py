"""What is to be said of tracks: a row of numbers for each, and the whole in a few sentences."""

from __future__ import annotations

from typing import Any, NamedTuple

from driftwise.edge.wording import fixed, number
from driftwise.workflow.clock_words import instant, lasting

__all__ = ["HEAD", "Row", "cells", "clock", "faults_told", "lead", "mean", "objects", "row", "rows", "times", "when"]

DATED = 1e8  # s: times beyond are Unix times
MANOEUVRE = 0.5  # probability from which a track is said to manoeuvre
PAUSE = 2  # rows between two stretches that are one manoeuvre
COURSE = 30.0  # degrees: a course of a larger deviation is not known
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
    spans: tuple[tuple[int, int], ...]  # of rows of its trace in which it manoeuvred

    @property
    def called(self) -> str:
        """What the track is called where one word has to do."""
        return self.name or self.label

    def as_dict(self) -> dict:
        """Return the row by names; the track itself is its number."""
        told = {name: value for name, value in self._asdict().items() if name not in ("track", "spans")}
        return {"track": self.track.id, **told, "turns": [turn._asdict() for turn in self.turns]}


def row(track) -> Row:
    """Return what is told of a track: its summary, the stretches (first row, end) in which it manoeuvred, its turns."""
    import numpy as np

    told, trace = track.summary(), track.trace
    spans, course = _stretches(trace.manoeuvre), trace.course
    known = trace.course_sd < COURSE
    rate = np.degrees(trace.turn_rate)
    turns = tuple(filter(None, (_turn(trace.time, course, known, rate, *span) for span in spans)))
    names = ("start", "end", "plots", "missed", "speed", "manoeuvres", "nis", "coverage", "status")
    return Row(track, track.key or f"#{track.id}", track.name, *(told[name] for name in names), turns, tuple(spans))


def rows(tracks) -> list[Row]:
    """Return the rows of tracks, the one with most plots first."""
    return sorted(map(row, tracks), key=lambda r: -r.plots)


def mean(rows: list[Row], name: str) -> float:
    """Return the mean of "nis" or "coverage" over the plots of all tracks that can be judged; NaN where none can."""
    judged = [(getattr(r, name), r.plots) for r in rows if getattr(r, name) == getattr(r, name)]
    return sum(value * plots for value, plots in judged) / sum(n for _, n in judged) if judged else float("nan")


def objects(rows: list[Row]) -> int:
    """Return how many objects the tracks are of: those of one key, and those that go on with another, are one."""
    return len({r.track.key or r.track.follows or r.track.id for r in rows})


def _stretches(manoeuvre) -> list[tuple[int, int]]:
    """Return (first row, end) of every run of rows in which a manoeuvre is more likely than not."""
    import numpy as np

    moving = np.concatenate(([False], np.asarray(manoeuvre) > MANOEUVRE, [False]))
    found: list[tuple[int, int]] = []
    for a, b in np.flatnonzero(np.diff(moving)).reshape(-1, 2).tolist():
        if found and a - found[-1][1] <= PAUSE:
            a = found.pop()[0]
        found.append((a, b))
    return found


def _turn(time, course, known, rate, a: int, b: int) -> Turn | None:
    """Return the turn that a manoeuvre was, if the course was known and changed for good."""
    import numpy as np

    first = max(a - 1, 0)
    if not known[first:b].all() or b - first < 2:
        return None
    angle = float(((np.diff(course[first:b]) + 180) % 360 - 180).sum())
    if abs(angle) < TURNED:
        return None
    return Turn(float(time[first]), float(time[b - 1]), angle, float(rate[a:b][np.argmax(abs(rate[a:b]))]))


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
    if objects(rows) == 1:
        turns = sum(len(r.turns) for r in rows)
        turned = f"and turned {times(turns)}" if turning else "and did not turn"
        told = [f"{rows[0].called} was followed for {lasting(end - start)} {turned}."]
    else:
        told = [f"{_count(objects(rows), 'object')} in {lasting(end - start)}, {_turned(rows, turning)}."]
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
    names = list(dict.fromkeys(r.called for r in turning))
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
