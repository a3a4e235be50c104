"""`driftwise track`: plots in, tracks out, a table of them, files and a page."""

from __future__ import annotations

import glob
import os
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import typer

from driftwise.cli.job import Job
from driftwise.cli.options import Json, Page, Quiet
from driftwise.cli.progress import bar
from driftwise.cli.targets import refuse_files, refuse_folder
from driftwise.engine.errors import CommandError, InputError
from driftwise.tracking.formats import WRITERS

BLOCK = 2000  # plots between two movements of the progress bar
CLASSES = ("aircraft", "helicopter", "glider", "uav", "boat")


@dataclass
class TrackJob(Job):
    """Track what radars or receivers saw: position, velocity and turns of every object, with honest error bars.

    The kind of each file is recognised. Nothing is tuned but the class of objects.

    Examples: driftwise track plots.csv --report tracks.html;
    driftwise track radar.pcap --sites radars.csv --out tracks --format csv,kml;
    driftwise track walk.gpx --speed 2 --smooth --out better --format gpx;
    receiver | driftwise track - --follow
    """

    files: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[FILE...]",
            help="Plots: ASTERIX (raw or pcap), Mode S frames, CSV, JSON, Parquet, NMEA, AIS. - with --follow is "
            "standard input. None with --listen.",
        ),
    ] = None
    site: Annotated[
        list[str] | None,
        typer.Option(
            metavar="LAT,LON[,HEIGHT]",
            help="Where the radar stands: degrees and metres. Of several: SAC/SIC=LAT,LON,HEIGHT, once for each.",
        ),
    ] = None
    sites: Annotated[
        str | None,
        typer.Option(metavar="TABLE", help="The same as CSV (sac, sic, latitude, longitude, height), JSON or TOML."),
    ] = None
    speed: Annotated[
        str,
        typer.Option(metavar="CLASS", help="aircraft, helicopter, glider, uav, boat, or a typical speed in m/s."),
    ] = "aircraft"
    single: Annotated[
        bool, typer.Option("--single", metavar="", help="Plots that do not say whose they are belong to one object.")
    ] = False
    out: Annotated[str | None, typer.Option(metavar="DIR", help="Write the tracks into this folder.")] = None
    format: Annotated[str, typer.Option(metavar="KIND,..", help=f"What is written there: {', '.join(WRITERS)}.")] = (
        "csv"
    )
    register: Annotated[
        bool,
        typer.Option(
            "--register",
            metavar="",
            help="Learn the biases of the sensors (range, azimuth, clock) from objects that several of them see, tell "
            "them, and take them off.",
        ),
    ] = False
    smooth: Annotated[
        bool,
        typer.Option(
            "--smooth",
            metavar="",
            help="Tell the motion at each plot given all plots, before and after: truer, and in hindsight. Wild plots "
            "are set aside.",
        ),
    ] = False
    report: Page = None
    json: Json = None
    follow: Annotated[
        bool,
        typer.Option(
            "--follow",
            metavar="",
            help="Wait for more: a file that grows, or standard input. Ctrl-C ends it. On a terminal a table is kept "
            "up to date; elsewhere each event and estimate is a line of JSON.",
        ),
    ] = False
    listen: Annotated[
        str | None,
        typer.Option(
            metavar="URL",
            help="Take what comes from udp://GROUP:PORT (ASTERIX, sentences, lines), tcp://HOST:PORT (AIS, NMEA, "
            "Beast, SBS, AVR, lines), or - (a capture on standard input). Ctrl-C ends it.",
        ),
    ] = None
    keep: Annotated[
        float, typer.Option(metavar="HOURS", min=0.01, help="With --listen: how long plots and tracks are remembered.")
    ] = 6.0
    delay: Annotated[
        float,
        typer.Option(
            metavar="SECONDS",
            min=0,
            max=599,
            help="With --follow and --listen: hold plots back so long, to put them in order of time.",
        ),
    ] = 0.0
    page: Annotated[
        int | None,
        typer.Option(
            metavar="PORT",
            min=0,
            max=65535,
            help="With --follow and --listen: a map of the tracks as they move, at this port of this machine alone (0 "
            "takes a free one).",
        ),
    ] = None
    quiet: Quiet = False

    @property
    def is_live(self) -> bool:
        """Whether plots are taken as they come."""
        return bool(self.follow or self.listen)

    @property
    def inputs(self) -> list[str]:
        """The files that are read."""
        return list(self.files or ())

    @property
    def title(self) -> str:
        if self.listen:
            return "standard input" if self.listen == "-" else self.listen
        names = [os.path.basename(file) if file != "-" else "standard input" for file in self.inputs]
        return ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")

    @property
    def place(self) -> tuple[float, ...] | None:
        """The site of a radar that has no name: degrees, and metres above the ellipsoid where they were given."""
        bare = [text for text in self.site or () if "=" not in text]
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

        named = [text for text in self.site or () if "=" in text]
        return {**(read_sites(self.sites) if self.sites else {}), **(read_sites(named) if named else {})}

    @property
    def kinds(self) -> tuple[str, ...]:
        """The formats to write."""
        return tuple(part.strip().lower() for part in self.format.split(",") if part.strip())

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
        wrong = [kind for kind in self.kinds if kind not in WRITERS]
        if wrong or not self.kinds:
            raise CommandError(f"--format takes {', '.join(WRITERS)}, with commas between several; got {self.format!r}")
        read = [file for name in self.inputs for file in glob.glob(name, recursive=True) or [name]]
        tracks = [("--out", os.path.join(self.out, f"tracks.{kind}")) for kind in self.kinds] if self.out else []
        if self.out:
            refuse_folder("--out", self.out)
        there = [(option, path) for option, path in tracks if os.path.exists(path)]
        named = [("--report", self.report), ("--json", self.json), *there]
        refuse_files(named, [*read, *filter(None, [self.sites])])
        if self.register and self.is_live:
            raise CommandError("--register looks at a recording: not with --follow or --listen")
        if self.page is not None and not self.is_live:
            raise CommandError(
                "--page shows tracks as they move, with --follow or --listen; of a recording, --report FILE"
            )
        if self.listen:
            from driftwise.tracking.sockets import place

            try:
                place(self.listen)
            except InputError as error:
                raise CommandError(f"--listen: {error}") from None
        if bool(self.listen) == bool(self.inputs):
            raise CommandError(
                "either files or --listen URL, not both"
                if self.listen
                else "which file? driftwise track FILE.., or --listen URL"
            )
        if "-" in self.inputs and not self.follow:
            raise CommandError("standard input is read with --follow: driftwise track - --follow")
        if self.follow and len(self.inputs) != 1:
            raise CommandError(f"--follow takes one file, or - for standard input; got {len(self.inputs)}")
        for file in self.inputs:
            if file != "-" and not os.path.exists(file) and not (set("*?[") & set(file) and not self.follow):
                raise CommandError(f"no such file: {file}")

    def estimate(self) -> None:
        """Track the plots of the files, or as they come."""
        from driftwise.tracking.tracker import Tracker

        plots = None if self.follow or self.listen else self._read()
        self.tracker = Tracker(self.pace, single=self.single, delay=self.delay)
        self.biases: Any = None
        if plots is None:
            from driftwise.cli.follow import map_page

            with map_page(self.page, self.quiet) as page:
                self._listen(page) if self.listen else self._follow(page)
            return
        if self.register:
            plots = self._registered(plots)
        with bar("tracking", self.quiet) as advance:
            self.tracker.feed(plots[:0])  # what could not be read is told once
            plots = replace(plots, faults=())
            for first in range(0, len(plots), BLOCK):
                self.tracker.feed(plots[first : first + BLOCK])
                advance(min((first + BLOCK) / len(plots), 1.0))
            self.tracker.finish()

    def _registered(self, plots):
        """Return plots without the biases of their sensors, which are kept to be told."""
        from driftwise.tracking.registration import register

        self.biases = register(plots, {name: site for name, site in self.radars.items() if site} or None)
        return self.biases.corrected(plots)

    def _read(self):
        from driftwise.tracking.read import read_plots

        radars = self.radars
        with bar(f"reading {self.title}", self.quiet) as advance:
            try:
                return read_plots(self.inputs, site=self.place, sites=radars or None, progress=advance)
            except InputError as error:
                if "SAC/SIC" not in str(error):
                    raise
                raise InputError(f"{error}. Here: --site 25/201=46.2,15.1,800 for each, or --sites FILE") from None

    def _follow(self, page) -> None:
        from driftwise.cli.follow import follow
        from driftwise.tracking.live_plots import LivePlots

        follow(self.inputs[0], LivePlots(self.title, self.place), self.tracker, self.quiet, page)
        if not self.tracker.counts["plots"]:
            raise InputError(f"{self.title}: nothing came that is a plot: a time and a position on every line")

    def _listen(self, page) -> None:
        from driftwise.cli.listen import listen
        from driftwise.tracking.sockets import place
        from driftwise.tracking.wire import Wire

        url = self.listen or "-"
        wire = Wire(self.title, place(url).kind != "udp", self.place, self.radars or None)
        listen(url, wire, self.tracker, self.quiet, self.keep, page)

    def tell(self) -> None:
        """Write the tracks, the page and the numbers, and print the table."""
        from driftwise.cli.results import write as write_json
        from driftwise.report import track_report
        from driftwise.report.printed import console, say
        from driftwise.report.terminal import show_tracks
        from driftwise.version import __version__

        tracks, written = self.tracker.tracks, []
        if self.smooth:
            tracks = tracks.smoothed()
        rows = track_report.rows(tracks)
        if self.report:
            from driftwise.report.tracks_page import write

            written.append(f"report in {write(tracks, self.report, self.title, sites=self._sites(tracks))}")
        if self.json:
            content = {
                "driftwise": __version__, "files": self.inputs or [self.title], "speed": self.pace,
                "origin": tracks.origin,
                "biases": {n: b._asdict() for n, b in self.biases.biases.items()} if self.biases else None,
                "tracks": [r.as_dict() for r in rows],
                "skipped": [f._asdict() if hasattr(f, "_asdict") else vars(f) for f in tracks.faults],
            }  # fmt: skip
            write_json(content, self.json)
            written.append(f"results in {self.json}")
        out = console(stderr=self.json == "-" or (self.is_live and not sys.stdout.isatty()))
        if not self.quiet:
            took = f"{'followed for' if self.is_live else 'took'} {self.took:.1f} s"
            show_tracks(tracks, rows, title=self.title, took=took, out=out)
            for text in self.biases.words() if self.biases else ():
                say(text, stderr=out.stderr)
        if self.out and rows:
            Path(self.out).mkdir(parents=True, exist_ok=True)
            written.append(f"tracks in {', '.join(map(str, tracks.write(self.out, self.kinds)))}")
        for line in written if not self.quiet and self.json != "-" else ():
            say(line, stderr=out.stderr)

    def _sites(self, tracks) -> list[tuple[str, float, float]]:
        """Return where range rings are drawn: about the radars that saw a track."""
        seen = {sensor for track in tracks for sensor in track.sensors}
        found = [(name, site.latitude, site.longitude) for name, site in self.radars.items() if site and name in seen]
        return found if self.place is None else [("radar", self.place[0], self.place[1]), *found]
