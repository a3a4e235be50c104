"""`driftwise track`: plots in, tracks out, a table of them, files and a page."""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any

from driftwise.cli.progress import bar
from driftwise.cli.targets import refuse_file, refuse_folder
from driftwise.engine.errors import CommandError, InputError

__all__ = ["Order", "deliver", "execute"]

BLOCK = 2000  # plots between two movements of the progress bar
CLASSES = ("aircraft", "helicopter", "glider", "uav", "boat")
FORMATS = ("csv", "parquet", "geojson", "kml", "cat062")


@dataclass(frozen=True)
class Order:
    """What was asked for.

    Attributes
    ----------
    files : paths of recordings; ("-",) with ``follow`` is standard input
    site : "LAT,LON[,HEIGHT]" of the radar, or "SAC/SIC=LAT,LON,HEIGHT" of one of several; degrees and metres
    sites : table of the radars by SAC/SIC
    speed : class of objects, or their typical speed in m/s
    out : folder for the tracks, in the ``formats``
    single : plots without a key are of one object
    delay : s by which plots are held back to be put in order of time
    """

    files: tuple[str, ...]
    site: tuple[str, ...] = ()
    sites: str | None = None
    speed: str = "aircraft"
    out: str | None = None
    formats: str = "csv"
    report: str | None = None
    json: str | None = None
    follow: bool = False
    quiet: bool = False
    single: bool = False
    delay: float = 0.0

    @property
    def title(self) -> str:
        names = [os.path.basename(file) if file != "-" else "standard input" for file in self.files]
        return ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")

    @property
    def place(self) -> tuple[float, ...] | None:
        """The site of a radar that has no name: degrees, and metres above the ellipsoid where they were given."""
        bare = [text for text in self.site if "=" not in text]
        if not bare:
            return None
        try:
            found = tuple(float(part) for part in bare[0].split(","))
        except ValueError:
            found = ()
        if len(bare) > 1 or len(found) not in (2, 3) or not (abs(found[0]) <= 90 and abs(found[1]) <= 360):
            raise CommandError(
                f"--site takes LATITUDE,LONGITUDE[,HEIGHT] in degrees and metres, once, or SAC/SIC=LATITUDE,LONGITUDE,"
                f"HEIGHT for each radar; got {' and '.join(map(repr, bare))}"
            )
        return found

    @property
    def radars(self) -> dict[str, Any]:
        """The sites of radars by "SAC/SIC", of the table and those that were named."""
        from driftwise.tracking.sites import read_sites

        named = [text for text in self.site if "=" in text]
        return {**(read_sites(self.sites) if self.sites else {}), **(read_sites(named) if named else {})}

    @property
    def kinds(self) -> tuple[str, ...]:
        """The formats to write."""
        return tuple(part.strip().lower() for part in self.formats.split(",") if part.strip())

    @property
    def pace(self) -> str | float:
        """The class of objects, or a typical speed."""
        if self.speed in CLASSES:
            return self.speed
        try:
            pace = float(self.speed)
        except ValueError:
            pace = 0.0
        if not 0 < pace < 20_000:
            raise CommandError(f"--speed is one of {', '.join(CLASSES)}, or a typical speed in m/s; got {self.speed!r}")
        return pace

    def check(self) -> None:
        """Refuse what cannot be, before anything is read."""
        self.place, self.pace  # noqa: B018  (they raise)
        wrong = [kind for kind in self.kinds if kind not in FORMATS]
        if wrong or not self.kinds:
            raise CommandError(
                f"--format takes {', '.join(FORMATS)}, with commas between several; got {self.formats!r}"
            )
        for option, path in (("--report", self.report), ("--json", self.json)):
            if path and (path != "-" or option == "--report"):
                refuse_file(option, path)
        if self.out:
            refuse_folder("--out", self.out)
        if "-" in self.files and not self.follow:
            raise CommandError("standard input is read with --follow: driftwise track - --follow")
        if self.follow and len(self.files) != 1:
            raise CommandError(f"--follow takes one file, or - for standard input; got {len(self.files)}")
        for file in self.files:
            if file != "-" and not os.path.exists(file) and not (set("*?[") & set(file) and not self.follow):
                raise CommandError(f"no such file: {file}")


def execute(order: Order) -> None:
    """Read the plots, track them, write what was asked for, and print the table."""
    order.check()
    start = perf_counter()
    plots = _read(order)
    tracker = make(order)
    with bar("tracking", order.quiet) as advance:
        tracker.feed(plots[:0])  # what could not be read is told once
        plots = replace(plots, faults=())
        for first in range(0, len(plots), BLOCK):
            tracker.feed(plots[first : first + BLOCK])
            advance(min((first + BLOCK) / len(plots), 1.0))
        tracker.finish()
    deliver(order, tracker.tracks, f"took {perf_counter() - start:.1f} s")


def make(order: Order) -> Any:
    """Return a tracker of what was asked for."""
    from driftwise.tracking.tracker import Tracker

    return Tracker(order.pace, single=order.single, delay=order.delay)


def _read(order: Order):
    from driftwise.tracking.read import read_plots

    radars = order.radars
    with bar(f"reading {order.title}", order.quiet) as advance:
        try:
            return read_plots(list(order.files), site=order.place, sites=radars or None, progress=advance)
        except InputError as error:
            if "SAC/SIC" not in str(error):
                raise
            raise InputError(f"{error}. Here: --site 25/201=46.2,15.1,800 for each, or --sites FILE") from None


def deliver(order: Order, tracks, took: str) -> None:
    """Write the tracks, the page and the numbers, and print the table."""
    from driftwise.report import track_report
    from driftwise.report.terminal import console, show_tracks

    rows, written = track_report.rows(tracks), []
    if order.report:
        from driftwise.report.tracks_page import write

        written.append(f"report in {write(tracks, order.report, order.title, sites=_sites(order, tracks))}")
    if order.json:
        from driftwise.cli.results import write as write_json

        write_json(_content(order, tracks, rows), order.json)
        written.append(f"results in {order.json}")
    out = console(stderr=order.json == "-" or (order.follow and not sys.stdout.isatty()))
    if not order.quiet:
        show_tracks(tracks, rows, title=order.title, took=took, out=out)
    if order.out and rows:
        Path(order.out).mkdir(parents=True, exist_ok=True)
        files = tracks.write(order.out, order.kinds)
        written.append(f"tracks in {', '.join(map(str, files))}")
    for line in written if not order.quiet and order.json != "-" else ():
        out.print(line, soft_wrap=True)


def _sites(order: Order, tracks) -> list[tuple[str, float, float]]:
    """Return where range rings are drawn: about the radars that saw a track."""
    seen = {sensor for track in tracks for sensor in track.sensors}
    found = [(name, site.latitude, site.longitude) for name, site in order.radars.items() if site and name in seen]
    return found if order.place is None else [("radar", order.place[0], order.place[1]), *found]


def _content(order: Order, tracks, rows) -> dict:
    """Return the results as JSON has them: a record for each track, and what was skipped."""
    from driftwise.version import __version__

    return {
        "driftwise": __version__, "files": order.files, "speed": order.pace, "origin": tracks.origin,
        "tracks": [r.as_dict() for r in rows],
        "skipped": [f._asdict() if hasattr(f, "_asdict") else vars(f) for f in tracks.faults],
    }  # fmt: skip
