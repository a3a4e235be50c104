"""`driftwise track --follow`: plots as they come, tracks as they grow."""

from __future__ import annotations

import math
import os
import signal
import sys
from contextlib import contextmanager
from time import perf_counter
from typing import Any

import numpy as np

from driftwise.cli.results import line
from driftwise.engine.errors import CommandError, InputError
from driftwise.tables.growing import Growing

REFRESH = 0.5  # s between two pictures of the live table
SHARE = 0.2  # of the time that may go into drawing


def follow(path: str, live, tracker, quiet: bool, page=None) -> None:
    """Feed a tracker with the plots of a file that grows, or of a pipe, until it ends or Ctrl-C is pressed."""
    source = Growing(path)
    with teller(quiet, page) as tell, asked_to_stop() as asked:
        try:
            while not (source.has_ended or asked()):
                try:
                    data, begins = source.read()
                except InputError as error:  # a line without end
                    if not tracker.counts["plots"]:
                        raise
                    live.leave_out(str(error))
                    continue
                tell(tracker, _feed(tracker, live.take(data, begins)) if data else [], not data)
            tell(tracker, _feed(tracker, live.take(source.rest())) + tracker.finish(), True)
        except BrokenPipeError:  # nobody reads what is told
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            tracker.finish()
        finally:
            source.close()


def _feed(tracker, plots) -> list[Any]:
    return [] if plots is None else tracker.feed(plots)


@contextmanager
def asked_to_stop():
    """Yield a function that says whether Ctrl-C was pressed or the end was asked for; pressed twice it interrupts.

    A table that is read meanwhile is read on: pyarrow would break off, and where it refuses the table anyhow the signal
    would be lost.
    """
    import pyarrow

    asked: list[int] = []

    def ask(number, frame):
        if asked:
            raise KeyboardInterrupt
        asked.append(number)

    old = {number: signal.signal(number, ask) for number in (signal.SIGINT, signal.SIGTERM)}
    pyarrow.enable_signal_handlers(False)
    try:
        yield lambda: bool(asked)
    finally:
        pyarrow.enable_signal_handlers(True)
        for number, handler in old.items():
            signal.signal(number, handler)


@contextmanager
def map_page(port: int | None, quiet: bool):
    """Yield a `TrackMap` at a port of this machine, which is told and closed at the end; None where none is wanted."""
    if port is None:
        yield None
        return
    from driftwise.report.printed import say

    try:
        from driftwise.live.web.track_map import TrackMap

        page = TrackMap(port)
    except ModuleNotFoundError as error:
        raise CommandError(
            f'--page needs {(error.name or "").partition(".")[0]}: pip install "driftwise[live]"'
        ) from None
    except InputError as error:
        raise CommandError(f"--page {port}: {error}") from None
    try:
        if not quiet:
            say(f"the map is at {page.address}", stderr=True)
        yield page
    finally:
        page.close()


@contextmanager
def teller(quiet: bool, page=None):
    """Yield a function (tracker, events, whether nothing waits) that tells what is new, and shows it on the map."""
    with _teller(quiet) as tell:

        def both(tracker, events, is_idle: bool) -> None:
            if page is not None:
                page.show(tracker)
            tell(tracker, events, is_idle)

        yield both


@contextmanager
def _teller(quiet: bool):
    """Yield a function that tells what is new: a table, or lines of JSON."""
    if quiet:
        yield lambda tracker, events, is_idle: None
    elif sys.stdout.isatty():
        from rich.live import Live

        from driftwise.report.printed import console

        with Live(console=console(), auto_refresh=False, transient=True) as shown:
            yield _Picture(shown)
    else:
        yield _Lines()


class _Picture:
    """The table of tracks on a terminal, drawn no more often than it is worth."""

    def __init__(self, shown):
        self.shown, self.next, self.seen = shown, 0.0, -1

    def __call__(self, tracker, events, is_idle: bool) -> None:
        begin = perf_counter()
        if begin < self.next or tracker.counts["plots"] == self.seen:
            return
        from rich.console import Group
        from rich.text import Text

        from driftwise.report import track_report
        from driftwise.report.terminal import MOST_TRACKS, track_table

        rows = track_report.rows(tracker.now())
        count = f"{tracker.counts['plots']} plots \u00b7 {len(rows)} tracks"
        count += f" ({MOST_TRACKS} shown)" if len(rows) > MOST_TRACKS else ""
        last = tracker.events[-1:]
        words = [f"track {e.track} {e.kind}: {e.words}" for e in last]
        head = Text(" \u00b7 ".join([count, *words, "Ctrl-C ends"]), style="dim")
        self.shown.update(Group(head, track_table(rows)) if rows else head, refresh=True)
        self.seen = tracker.counts["plots"]
        self.next = perf_counter() + max(REFRESH, (perf_counter() - begin) / SHARE)


class _Lines:
    """A line of JSON for every event, and for every plot that made an estimate of a confirmed track."""

    def __init__(self):
        self.until: dict[int, float] = {}  # of every track, the time of the last row that was told
        self.next = 0.0

    def __call__(self, tracker, events, is_idle: bool) -> None:
        begin = perf_counter()
        for event in events:
            sys.stdout.write(
                line({"event": event.kind, "time": event.time, "track": event.track, "words": event.words})
            )
        if tracker.counts["plots"] and (is_idle or begin > self.next):
            tracks = tracker.tracks
            for track in tracks:
                self._estimates(track)
            self.until = {track.id: self.until[track.id] for track in tracks}
            self.next = perf_counter() + (perf_counter() - begin) / SHARE
        sys.stdout.flush()

    def _estimates(self, track) -> None:
        """Tell the rows of the trace of a track that have not been told."""
        until = self.until.get(track.id, -math.inf)
        if track.plots.time[-1] <= until:
            return
        known = int(np.searchsorted(track.plots.time, until, side="right"))
        plots = track.plots[known:]
        new = track.estimator.trace_of(plots.time, plots.position, track.table[known:], track.state)
        names = ("time", "speed", "speed_sd", "course", "course_sd", "turn_rate", "turn_rate_sd", "manoeuvre")
        columns = {name: getattr(new, name).tolist() for name in names}
        for name, pair in (("", new.position), ("_sd", new.position_sd)):
            columns |= {f"east{name}": pair[:, 0].tolist(), f"north{name}": pair[:, 1].tolist()}
        who = {"estimate": track.key or track.id, "track": track.id, "name": track.name}
        for row in zip(*columns.values()):
            sys.stdout.write(line({**who, **dict(zip(columns, row))}))
        self.until[track.id] = float(track.plots.time[-1])
