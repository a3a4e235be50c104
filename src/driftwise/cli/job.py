"""Commands and jobs. Fields are options, by name; a docstring is the help of its command."""

from __future__ import annotations

import inspect
import math
import os
import signal
from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter
from typing import Any, Protocol, get_type_hints

from driftwise.cli.progress import bar
from driftwise.cli.targets import refuse_targets
from driftwise.engine import bounds
from driftwise.engine.errors import CommandError, InputError, Stopped

BETWEEN = "lies between --from and --to"
LOOK, CELLS = 1000, 1 << 22  # rows by which a clock is known; cells that are held to see how a table is read


class Command(Protocol):
    """A command: a dataclass of its options that can be run."""

    def run(self) -> None: ...


def add_command(app, name: str, command: type[Command]) -> None:
    """Add a command to those of an app; it runs when it is called."""
    hints = get_type_hints(command, include_extras=True)

    def call(**options):
        refuse_numbers(options)
        try:
            command(**options).run()
        except KeyboardInterrupt:
            raise Stopped(130) from None

    parameters = inspect.signature(command).parameters.values()
    signature = inspect.Signature([p.replace(annotation=hints[p.name]) for p in parameters])
    call.__signature__ = signature  # type: ignore[attr-defined]  # any function may have one of its own
    call.__annotations__, call.__doc__ = hints, command.__doc__
    app.command(name)(call)


def refuse_numbers(options: dict[str, Any]) -> None:
    """Refuse whole numbers beyond their bound, what is no number, and a step of the clock that time cannot take."""
    for name, value in options.items():
        option = f"--{name.replace('_', '-')}"
        if isinstance(value, int) and value > (most := bounds.MOST.get(name, bounds.COUNT)):
            raise CommandError(f"{option} is at most {most}, got {value}{bounds.why(name)}.")
        if isinstance(value, float) and (math.isnan(value) or (name == "dt" and not 0 < value < math.inf)):
            wanted = "a positive step of the clock" if name == "dt" else "a number"
            raise CommandError(f"{option} must be {wanted}, got {value:g}.")


class Job(ABC):
    """A command that estimates: `run` takes its steps one after the other.

    check : refuse what cannot be, before anything is read
    estimate : open, read and estimate
    summarise : say what is to be told of it
    tell : write and print
    """

    took: float = 0.0  # s that it took to estimate
    is_stopped = False  # by Ctrl-C while samples came: what was read until then is told

    def run(self) -> None:
        """Take all steps."""
        self.check()
        begun = perf_counter()
        self.estimate()
        self.took = perf_counter() - begun
        self.summarise()
        self.tell()
        if self.is_stopped:
            raise Stopped(130)

    @abstractmethod
    def check(self) -> None:
        """Refuse what cannot be."""

    @abstractmethod
    def estimate(self) -> None:
        """Open, read and estimate."""

    def summarise(self) -> None:  # noqa: B027  (not every job has more to say)
        """Say what is to be told."""

    @abstractmethod
    def tell(self) -> None:
        """Write and print."""


class TableJob(Job):
    """A job on one table, whose results are a page, JSON, and what is printed: `draw`, `content`, `show`."""

    file: str
    save: str | None = None
    report: str | None = None
    json: str | None = None
    writes: Any = (("report", "report"), ("results", "json"))  # what is written, and the option that names its place

    @property
    def title(self) -> str:
        """What to call the place the data come from."""
        return "standard input" if self.file == "-" else self.file

    @property
    def short_title(self) -> str:
        """The same without its folder."""
        return os.path.basename(self.title)

    def check(self) -> None:
        """Refuse places that cannot be written to."""
        refuse_targets(self)

    def tell(self) -> None:
        """Write page and results, print, and say where the files are."""
        from driftwise.cli.results import write
        from driftwise.report.printed import console, say
        from driftwise.version import __version__

        if self.report:
            self.draw(self.report)
        if self.json:
            write({"driftwise": __version__, **self.content()}, self.json)
        self.show(console(stderr=self.json == "-"))
        if self.written and self.json != "-":
            say(", ".join(self.written))

    @property
    def written(self) -> list[str]:
        """What was written where."""
        named = ((what, getattr(self, option)) for what, option in self.writes)
        return [f"{what} in {path}" for what, path in named if path]

    @abstractmethod
    def draw(self, path: str) -> None:
        """Write the page."""

    @abstractmethod
    def content(self) -> dict[str, Any]:
        """Return the results as JSON has them."""

    @abstractmethod
    def show(self, out) -> None:
        """Print the results."""


class RecordJob(TableJob):
    """A job on one record: the columns of a table, read chunk by chunk in constant memory."""

    time: str | None = None
    input: list[str] | None = None
    dt: float | None = None
    start: str | None = None  # a number, or a date
    stop: str | None = None
    raw: bool = False
    chunk: int = 65_536
    record: Any = None
    is_recognised = False  # whether columns were, and rows are read as it was done for that

    @property
    def inputs(self) -> tuple[str, ...]:
        return tuple(self.input or ())

    @property
    def has_clock(self) -> bool:
        """Whether a clock or a step was named; if not, time is counted in samples."""
        return self.time is not None or self.dt is not None

    def open(self, output: str, *more: str, find_clock: bool = True) -> Any:
        """Return the record, its rows as the whole table is read; a clock that was not named may be looked for."""
        from driftwise.tables.record import open_record
        from driftwise.tables.source import is_stream

        columns, table, source = (*more, *self.inputs), None, None
        if not is_stream(self.file):
            table, source = self._understood(output, columns)
        self.record = open_record(self.file, output, columns, self.time, self.chunk, self.raw, source)
        if table is not None and not self.is_recognised:  # else it is told with the columns
            self.record.otherwise = table.otherwise
            self.record.table = table if find_clock and not self.has_clock else None
        if table is not None and not self.has_clock and table.time is None and table.timed:
            self.dt = table.dt  # as lines above the rows say
        return self.record

    def _understood(self, output: str, columns: tuple[str, ...]) -> tuple[Any, Any]:
        """Return the `Table` that the columns are of, and its source; (None, None) of one that is not understood."""
        from driftwise.tables.autoread import read
        from driftwise.tables.parts import source_of
        from driftwise.tables.table import HEAD_ROWS

        rows = max(min(HEAD_ROWS, CELLS // len(source_of(self.file).names)), LOOK)
        try:
            table, segments = read(self.file, output, columns, self.time, self.chunk, rows)
        except InputError:
            return None, None
        return table, segments.source()

    def chunks(self, doing: str) -> Iterator[Any]:
        """Yield the chunks of the record that have rows between --from and --to, with a bar; without any it raises."""
        seen = False
        with reading(self.record.source, doing) as advance:
            for chunk in self.record:
                chunk = self._window(chunk)
                if chunk.rows:
                    yield chunk
                    seen = True
                    advance()
        if not seen:
            clock = self.record.clock
            why = f"its stamps run from {clock.origin} to {clock.end}." if clock.origin else None
            raise InputError(f"{self.record.path}: no row {BETWEEN}; {why or 'what are the units of the time?'}")

    def _window(self, chunk) -> Any:
        """Return the rows of a chunk between --from and --to."""
        if self.start is None and self.stop is None:
            return chunk
        time, moment = self.time_of(chunk, self.dt or 1.0), self.record.moment
        inside = time >= (-float("inf") if self.start is None else moment("--from", self.start))
        inside &= time <= (float("inf") if self.stop is None else moment("--to", self.stop, is_end=True))
        return chunk.pick(inside)

    @property
    def step(self) -> float:
        """Seconds between samples: as said, or of the clock that was read, or 1."""
        return (self.record.clock.dt or 1.0) if self.dt is None else self.dt

    def named(self, column: str) -> str:
        """Return the name of a column with its unit."""
        from driftwise.results.numbers import with_unit

        return with_unit(column, self.record.source.units.get(column))

    def time_of(self, chunk, dt: float) -> Any:
        """Return the time of each row of a chunk: the time column, or rows times dt."""
        import numpy as np

        if self.record.time:
            return chunk.columns[self.record.time]
        return (chunk.first_row + np.arange(chunk.rows)) * dt


@contextmanager
def undivided():
    """Hear a first Ctrl-C at the end: what is counted, kept and saved of a chunk goes together."""
    heard: list[tuple] = []

    def hear(*signalled):
        if heard and callable(old):
            old(*signalled)
        heard.append(signalled)

    old = signal.signal(signal.SIGINT, hear)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, old)
    if heard and callable(old):
        old(*heard[0])


@contextmanager
def reading(source, doing: str):
    """Show a bar while a long table is read; nothing for one that is read at once."""
    with bar(doing, quiet=source.fraction == 1.0) as advance:
        yield lambda: advance(source.fraction)
