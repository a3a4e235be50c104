"""What is to be said of tracks: a row of numbers for each, and the whole in a few sentences."""

from __future__ import annotations

import os
import re
from itertools import pairwise
from typing import Any, NamedTuple

from driftwise.results.numbers import count_of, fixed, instant, lasting, number, often

DATED = 1e8  # s: times beyond are Unix times
SLOW = 0.1  # of the median speed of a track: below, it stands ..
STANDS, SURE = 0.5, 3.0  # .. and below this speed, m/s, or so many of its deviations
COURSE = 15.0  # degrees: a course of a larger deviation is not known
TURNED = 30.0  # degrees from which a change of course is called a turn
PACE = 10.0  # degrees in a window
HEAD = (
    "track", "name", "from", "to", "plots", "missed", "m/s", "manoeuvres", "NIS", "in 95 %", "status"
)  # fmt: skip


COUNTED = re.compile(r"(.*): (\d+), this is the first", re.DOTALL)  # a fault that stands for several


class Turn(NamedTuple):
    """A change of course."""

    start: float
    end: float
    angle: float  # degrees, positive to the right
    rate: float  # degrees per second, on average


class Row(NamedTuple):
    """What is reported of one track."""

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
        values = {name: value for name, value in self._asdict().items() if name not in ("track", "spans")}
        return {"track": self.track.id, **values, "turns": [turn._asdict() for turn in self.turns]}


def row(track) -> Row:
    """Return what is reported of a track: summary, turns, segments (first row, end) in which it manoeuvred."""
    found, trace = track.summary(), track.trace
    start, end, plots, missed, speed, manoeuvres, nis, coverage, status = (
        found[name] for name in ("start", "end", "plots", "missed", "speed", "manoeuvres", "nis", "coverage", "status")
    )
    return Row(
        track, track.key or f"#{track.id}", track.name, start, end, plots, missed, speed, manoeuvres, nis, coverage,
        status, _turns(trace), _segments(trace),
    )  # fmt: skip


def rows(tracks) -> list[Row]:
    """Return the rows of tracks, the one with most plots first."""
    return sorted(map(row, tracks), key=lambda r: -r.plots)


def mean(rows: list[Row], name: str) -> float:
    """Return the mean of "nis" or "coverage" over the plots of all tracks that can be judged; NaN where none can."""
    judged = [(getattr(r, name), r.plots) for r in rows if getattr(r, name) == getattr(r, name)]
    return sum(value * plots for value, plots in judged) / sum(n for _, n in judged) if judged else float("nan")


def judged(rows: list[Row], name: str) -> int:
    """Return the plots of all tracks of which "nis" or "coverage" can be judged."""
    return sum(r.plots for r in rows if getattr(r, name) == getattr(r, name))


def objects(rows: list[Row]) -> int:
    """Return how many objects the tracks are of: those of one key, and those that go on with another, are one."""
    return len({r.track.key or r.track.follows or r.track.id for r in rows})


def _window(time) -> float:
    """Return the time, s, over which the motion is looked at: five scans, at least 20 s."""
    import numpy as np

    return max(20.0, 5.0 * float(np.median(np.diff(time)))) if len(time) > 1 else 20.0


def _segments(trace) -> tuple[tuple[int, int], ...]:
    """Return (first row, end) of the runs of rows about which a manoeuvre was, on average, more likely than not."""
    import numpy as np

    half = 0.5 * _window(trace.time)
    sums = np.concatenate(([0.0], np.cumsum(np.nan_to_num(trace.manoeuvre))))
    first = np.searchsorted(trace.time, trace.time - half, "left")
    end = np.searchsorted(trace.time, trace.time + half, "right")
    return tuple(_runs((sums[end] - sums[first]) / (end - first) > 0.5))


def _runs(chosen) -> list[tuple[int, int]]:
    """Return (first, end) of every run of what is chosen."""
    import numpy as np

    edges = np.flatnonzero(np.diff(np.concatenate(([False], chosen, [False]))))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def _turns(trace) -> tuple[Turn, ...]:
    """Return where the course changed for good, by 30 degrees and more, at a pace of 10 degrees in a window."""
    import numpy as np

    course = trace.course
    speed = trace.speed
    least = max(SLOW * np.nanmedian(speed), STANDS)
    moves = (speed > least) & (speed > SURE * trace.speed_sd)  # at rest, noise turns the course
    known = np.flatnonzero(moves & (trace.course_sd < COURSE))
    if len(known) < 3:
        return ()
    time, half = trace.time[known], 0.5 * _window(trace.time)
    course = np.unwrap(course[known], period=360.0)
    swing = np.interp(time + half, time, course) - np.interp(time - half, time, course)
    found = []
    for a, b in (run for side in (1, -1) for run in _runs(side * swing > PACE)):
        i, j = np.searchsorted(time, time[a] - half), np.searchsorted(time, time[b - 1] + half, "right") - 1
        angle = float(course[j] - course[i])
        if abs(angle) < TURNED:
            continue
        share = (course[i : j + 1] - course[i]) / angle
        begin, end = time[i + int(np.flatnonzero(share <= 0.05)[-1])], time[i + int(np.flatnonzero(share >= 0.95)[0])]
        begin = min(begin, end)
        found.append(Turn(float(begin), float(end), angle, 0.9 * angle / float(end - begin) if end > begin else angle))
    return tuple(sorted(found))


def clock(time: float) -> str | None:
    """Return the time stamp of second 0, where times like this one are Unix times."""
    return "1970-01-01" if time > DATED else None


def when(time: float, with_day: bool = True) -> str:
    """Return an instant as one writes it, to the second where it is a date."""
    if clock(time) is None:
        return instant(time, None)
    text = instant(round(time), clock(time))
    text = text if " " in text else f"{text} 00:00:00"
    return text if with_day else text.partition(" ")[2]


def cells(found: Row, *, with_day: bool = False) -> list[str]:
    """Return a row as it is printed."""
    missed = str(found.missed) if found.track.is_scanned else "\u2013"
    return [
        found.label, found.name, when(found.start, with_day), when(found.end, with_day), str(found.plots),
        missed, number(found.speed, 3) if found.speed == found.speed else "\u2013", str(found.manoeuvres),
        fixed(found.nis, 2), fixed(100 * found.coverage, 1), found.status,
    ]  # fmt: skip


def hint(rows: list[Row], counts: dict[str, int]) -> str:
    """Return what to try where most plots made no track, or tracks without a key follow one another."""
    if counts.get("outliers", 0) + counts.get("discarded", 0) > 0.5 * counts.get("plots", 0) > 2:
        return "most plots imply speeds beyond the class, or fit no track: try another --speed, and check the units"
    spans = sorted((r.start, r.end) for r in rows if not r.track.key)
    shared = sum(max(a[1] - b[0], 0.0) for a, b in pairwise(spans))
    if len(spans) < 2 or shared > 0.1 * sum(end - start for start, end in spans):
        return ""
    return "the tracks follow one another in time: if all plots are of one object, add --single"


def counted(counts: dict[str, int]) -> str:
    """Return in a sentence what became of plots that made no track; nothing where all did."""
    words = (
        ("discarded", "on tracks that were never confirmed"), ("outliers", "set aside as outliers"),
        ("repeated", "told again what was known"), ("late", "came too late"), ("clock", "had a wild clock"),
    )  # fmt: skip
    found = [f"{counts[name]} {what}" for name, what in words if counts.get(name)]
    return f"of {counts['plots']} plots, {', '.join(found)}" if found else ""


def lead(rows: list[Row], counts: dict[str, int]) -> str:
    """Return in a few sentences how many objects there were, over which time, what turned and how sure this is."""
    if not rows:
        return f"No object was seen often enough to make a track, in {count_of(counts.get('plots', 0), 'plot')}."
    start, end = min(r.start for r in rows), max(r.end for r in rows)
    turning = [r for r in rows if r.turns]
    if objects(rows) == 1:
        turns = sum(len(r.turns) for r in rows)
        turned = f"and turned {often(turns)}" if turning else "and did not turn"
        who = rows[0].called if rows[0].name or rows[0].track.key else "One object"
        said = [f"{who} was followed for {lasting(end - start)} {turned}."]
    else:
        said = [f"{count_of(objects(rows), 'object')} in {lasting(end - start)}, {_turned(rows, turning)}."]
    if turning:
        found, turn = max(((r, t) for r in turning for t in r.turns), key=lambda pair: abs(pair[1].angle))
        whose = f"{found.called}, " if len(rows) > 1 else ""
        side = "right" if turn.angle > 0 else "left"
        said.append(
            f"The longest turn: {whose}{abs(turn.angle):.0f}\u00b0 to the {side} from {when(turn.start)} "
            f"to {when(turn.end, False)}, at {number(abs(turn.rate), 2)}\u00b0/s."
        )
    said.append(_sure(rows))
    return " ".join(filter(None, said))


def _turned(rows: list[Row], turning: list[Row]) -> str:
    if not turning:
        manoeuvres = sum(r.manoeuvres for r in rows)
        return "none of which turned" if not manoeuvres else f"{count_of(manoeuvres, 'manoeuvre')}, no lasting turn"
    names = list(dict.fromkeys(r.called for r in turning))
    if len(names) <= 3:
        return f"of which {' and '.join([', '.join(names[:-1]), names[-1]] if len(names) > 1 else names)} turned"
    return f"{len(names)} of which turned"


def _sure(rows: list[Row]) -> str:
    held = mean(rows, "coverage")
    if held != held:
        return "There are too few plots to judge the error bars."
    return f"{fixed(100 * held, 1)} % of the plots fell into their 95 % bands."


def skipped(faults) -> int:
    """Return how many records could not be used."""
    return sum(_kind(fault)[1] for fault in faults)


def fault_words(faults) -> str:
    """Return in a sentence what could not be read, with the places of the first ones; nothing where all could."""
    if not faults:
        return ""
    sources = {fault.source for fault in faults}
    kinds: dict[str, list] = {}
    for fault in faults:
        what, count = _kind(fault)
        place = f"{os.path.basename(fault.source)}:{fault.offset}" if len(sources) > 1 else str(fault.offset)
        kinds.setdefault(what, []).append((count, place))
    counts = {what: sum(n for n, _ in some) for what, some in kinds.items()}
    most = sorted(kinds, key=lambda what: -counts[what])
    said = [f"{what}: {counts[what]} ({_where(kinds[what])})" for what in most[:3]]
    said += [f"for other reasons: {sum(counts[what] for what in most[3:])}"] if len(most) > 3 else []
    return f"{count_of(sum(counts.values()), 'record')} skipped \u2013 {'; '.join(said)}."


def _kind(fault) -> tuple[str, int]:
    """Return what is wrong, and with how many records."""
    match = COUNTED.fullmatch(fault.what)
    return (match[1], int(match[2])) if match else (fault.what, 1)


def _where(some, most: int = 3) -> str:
    """Return the places of the first ones: bytes of a binary file, lines or rows of a text."""
    places = ", ".join(place for _, place in some[:most])
    return f"at {places}{', ..' if len(some) > most else ''}" if some[0][0] == 1 else f"first at {places}"
