"""The page of tracks: what was there and what turned, the plan view, one track over time, the table of tracks."""

from __future__ import annotations

from html import escape
from pathlib import Path

from driftwise.report import track_report
from driftwise.report.page import Card, Page, Panel, group, say, table
from driftwise.report.panels import grade, held_card, zoom_words
from driftwise.report.plan import plan
from driftwise.report.track_plots import Panels
from driftwise.report.track_report import skipped
from driftwise.results.numbers import count_of, fixed, lasting, number, often

CHOICE = 20  # tracks that can be looked at over time: the busiest
TABLE = 300  # rows of the table


def write(tracks, path, title: str = "Tracks", *, sites=(), notes=()) -> Path:
    """Write the page of some `Tracks` and return its path.

    Parameters
    ----------
    tracks : Tracks
    path : file to write
    title : headline
    sites : (name, latitude, longitude) of radars; range rings are drawn about them
    notes : sentences about what was read
    """
    rows = track_report.rows(tracks)
    notes = [*notes, *filter(None, [track_report.counted(tracks.counts)])]
    panels = [*_drawn(tracks, rows, sites), _table(rows), _skipped(tracks.faults), _read(notes)]
    lead = track_report.lead(rows, tracks.counts)
    return Page(title, panels, lead, _facts(rows), _cards(rows, tracks.faults)).write(path)


def _drawn(tracks, rows, sites) -> list[Panel]:
    """Return the plan view and one track over time, each of which chooses what the other shows."""
    if not rows:
        return []
    above = plan(rows, min(CHOICE, len(rows)), _placed(sites, tracks.origin))
    below = Panels(rows[:CHOICE])
    if len(rows) > 1:
        below.link(above.select_one({"name": "tracks"}))
    return [_plan(above, rows, tracks.origin), _tracked(below, rows)]


def _facts(rows) -> list[str]:
    if not rows:
        return []
    start, end = min(r.start for r in rows), max(r.end for r in rows)
    facts = [f"{sum(r.plots for r in rows)} plots", f"{track_report.when(start)} to {track_report.when(end)}"]
    sensors = sorted({sensor for r in rows for sensor in r.track.plots.sensor if sensor})
    return [*facts, *([f"seen by {', '.join(sensors)}"] if 0 < len(sensors) <= 8 else [])]


def _placed(sites, origin):
    """Return the sites as (name, East, North)."""
    if origin is None or not sites:
        return []
    import numpy as np

    from driftwise.tracking.frames import east_north

    names, latitude, longitude = zip(*sites)
    return [(name, *map(float, place)) for name, place in
            zip(names, east_north(np.array(latitude), np.array(longitude), origin))]  # fmt: skip


def _cards(rows, faults) -> list[str]:
    if not rows:
        return []
    start, end = min(r.start for r in rows), max(r.end for r in rows)
    plots, scanned = sum(r.plots for r in rows), [r.missed for r in rows if r.track.is_scanned]
    missed = f"{sum(scanned)} missed, " if scanned else ""
    objects = track_report.objects(rows)
    value, _, unit = lasting(end - start).partition(" ")
    there = [
        Card("Objects", str(objects), f"{len(rows)} tracks" if len(rows) > objects else "followed"),
        Card("Time", value, "first plot to last", unit=unit),
        Card("Plots", str(plots), f"{missed}{count_of(skipped(faults), 'record')} skipped"),
    ]
    turning, speeds = [r for r in rows if r.turns], [r.speed for r in rows if r.speed == r.speed]
    whose = f", by {track_report.objects(turning)} of {objects}" if objects > 1 else ""
    moved = [Card("Turns", str(sum(len(r.turns) for r in rows)), f"of 30\u00b0 and more{whose}")]
    if speeds:
        moved.append(Card("Median speed", *_speed(speeds), unit="m/s"))
    nis, held = track_report.mean(rows, "nis"), track_report.mean(rows, "coverage")
    sure = [
        Card("NIS", fixed(nis, 2), "1: right error bars", _graded(nis, (0.8, 1.25), (0.5, 2))),
        held_card(held, _held(held, track_report.judged(rows, "coverage"))),
    ]
    return [group("What was there", there), group("How it moved", moved), group("How sure", sure)]


def _speed(speeds) -> tuple[str, str]:
    low, high = min(speeds), max(speeds)
    shown = sorted(speeds)[len(speeds) // 2]
    note = f"of the tracks: {number(low, 3)} to {number(high, 3)}" if len(speeds) > 1 else "along the track"
    return number(shown, 3), note


def _graded(value, good, fair) -> str:
    if value != value:
        return ""
    return grade(good[0] <= value <= good[1], fair[0] <= value <= fair[1])


def _held(share: float, plots: int) -> str:
    """Return the grade of what bands hold of so many plots: what chance makes of right ones is good."""
    from driftwise.analysis.forecast_verdicts import coverage_verdict

    return "" if share != share else grade(coverage_verdict(share, plots).is_fine, share >= 0.85)


def _plan(figure, rows, origin) -> Panel:
    words = (
        "East and North in kilometres, at equal scales. Arrow heads show the direction of flight or travel; a wide "
        "band marks where, over five scans, a manoeuvre was more likely than not."
    )
    if origin is not None:
        words += f" The origin lies at {_degrees(origin[0], 'NS')} {_degrees(origin[1], 'EW')}."
    more = "Drag to zoom, Ctrl and wheel to zoom at the pointer, double click for the whole plan."
    if len(rows) > 1:
        more += " Click on a track to see it below."
    if len(rows) > CHOICE:
        more += f" The {CHOICE} tracks with most plots are coloured."
    return Panel("plan", "Plan view", words, (figure, f'<p class="say howto">{escape(more)}</p>'))


def _degrees(value: float, letters: str) -> str:
    return f"{abs(value):.5f}\u00b0 {letters[value < 0]}"


def _tracked(panels, rows) -> Panel:
    words = (
        "Shaded: 95 % bands. Innovations are what each plot differs by from where it was predicted to be; a triangle "
        "marks the onset of a manoeuvre. The running mean of the NIS should stay in its band about 1."
    )
    if panels.is_thinned:
        words += (
            " Of a long track the extremes of every stretch are drawn, so that innovations look larger than most are."
        )
    choice = _choice(rows[:CHOICE]) if len(rows) > 1 else ""
    title = "One track over time" if len(rows) > 1 else f"{rows[0].name or rows[0].track.key or 'The track'} over time"
    return Panel("track", title, words, (choice, *panels.figures, zoom_words(panels.line)))


def _choice(rows) -> str:
    """Return the list to choose a track from; it sets what is selected in the plan view."""
    options = "".join(
        f'<option value="{k}">{escape(_option(r))}</option>' for k, r in enumerate(rows)
    )  # fmt: skip
    choose = "Bokeh.documents[0].get_model_by_name('tracks').selected.indices = [Number(this.value)]"
    return f'<p class="choice"><label>Track <select id="which" onchange="{choose}">{options}</select></label></p>'


def _option(r) -> str:
    name = f"{r.name} ({r.label})" if r.name and r.name != r.label else r.label
    turned = f", turned {often(len(r.turns))}" if r.turns else ""
    return f"{name}: {r.plots} plots{turned}"


def _table(rows) -> Panel:
    if not rows:
        return Panel("tracks", "Tracks", "None: no object was seen often enough.")
    words = (
        "The busiest first. NIS should be about 1, and the 95 % bands hold 95 %; the first 3 plots settle speed and "
        "noise."
    )
    if len(rows) > TABLE:
        words += f" {TABLE} of {len(rows)} tracks are listed."
    body = [track_report.cells(r, with_day=True) for r in rows[:TABLE]]
    return Panel("tracks", "Tracks", words, (table(list(track_report.HEAD), body, text=(0, 1, 2, 3, 10)),))


def _skipped(faults) -> Panel | None:
    if not faults:
        return None
    some = table(["source", "at", "what is wrong"], [[f.source, f.offset, f.what] for f in faults[:200]], text=(0, 2))
    count = count_of(skipped(faults), "record")
    return Panel("skipped", "What was skipped", track_report.fault_words(faults), (some,), count)


def _read(notes) -> Panel | None:
    if not notes:
        return None
    return Panel("read", "What became of the plots", "", tuple(map(say, notes)), count_of(len(notes), "note"))
